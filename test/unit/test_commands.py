"""Every command of the README and of doc/ is typed by sheets_test.py, or stands there with the reason
why it cannot be."""
import re
import sys

import pytest
from pages import PAGES, ROOT, by_name

sys.path.insert(0, str(ROOT / 'test' / 'ros'))

from sheets_steps import promised, steps_of, without_comment  # noqa: E402

WALK = ROOT / 'test' / 'ros' / 'sheets_walk.md'
SHEETS = [ROOT / 'doc' / 'imu_lab.md', ROOT / 'doc' / 'transformation_lab.md']
#: Blocks of commands, and inline code: in a page's order.
CODE = re.compile(r'^ *```(\w*)\n(.*?)^ *```$|`([^`]+)`', re.MULTILINE | re.DOTALL)
#: Inline code that is a command: a program and its words, or a script of this package.
COMMAND = re.compile(r'([A-Z_]+=\S+ )?((ros(run|launch|test|topic|service|node|bag|param|dep|msg|version)|catkin\w*|dynparam|source|'
                     r'docker|git|ssh\S*|scp|apt|sudo|python3|timeout|export|cd|mkdir|kill|chmod|curl) |'
                     r'\./?(scripts|test)/\w+\.sh|test/\w+\.sh)')


def commands_of(text):
    """All that a page tells to type, in its order: lines of blocks, and inline code."""
    found = []
    for language, block, inline in CODE.findall(text):
        lines = block.splitlines() if language == 'bash' else [' '.join(inline.split())] if inline else []
        found += [command for command in map(without_comment, lines)
                  if command and not command.startswith('#') and (language or COMMAND.match(command))]
    return found


def lines_of(path, *kinds):
    """The lines of a page's steps of these kinds, as sheets_test.py types them."""
    return [without_comment(line) for step in steps_of(path.read_text(encoding='utf-8'))
            if step.kind in kinds for line in step.commands.splitlines()]


KNOWN = {line for path in [WALK] + SHEETS for line in lines_of(path, 'run', 'long', 'not run')}


@by_name(PAGES)
def test_every_command_is_typed_or_says_why_not(page):
    assert [command for command in commands_of(page.read_text(encoding='utf-8')) if command not in KNOWN] == []


def test_the_walk_types_what_the_pages_have():
    there = {command for page in PAGES for command in commands_of(page.read_text(encoding='utf-8'))}
    assert [line for line in lines_of(WALK, 'run', 'long', 'not run') if line not in there] == []


def test_the_readme_is_walked_in_its_order():
    order = commands_of((ROOT / 'README.md').read_text(encoding='utf-8'))
    text = WALK.read_text(encoding='utf-8').split('\n## README: ')[1:]
    walked = [without_comment(line) for section in text for step in steps_of(section.split('\n## ')[0])
              if step.kind in ('run', 'long') for line in step.commands.splitlines()]
    first = [line for number, line in enumerate(walked) if line in order and line not in walked[:number]]
    assert len(first) > 20 and sorted(first, key=order.index) == first


@pytest.mark.parametrize('page', [WALK] + SHEETS, ids=lambda page: page.name)
def test_what_is_not_typed_says_why(page):
    assert [step for step in steps_of(page.read_text(encoding='utf-8'))
            if step.kind == 'not run' and len(step.argument) < 10] == []


def test_a_new_command_is_seen_wherever_it_stands():
    text = 'Type `rostopic  list`\nor `cmd_vel`:\n\n   ```bash\n   ls -l   # a comment\n   # one more\n   ```\n```\nno command\n```\n'
    assert commands_of(text) == ['rostopic list', 'ls -l']


def test_a_promise_holds_for_other_numbers_and_lines_between():
    pattern = promised('drive 1 -0.610 ... ok\ndone')
    assert pattern.search('drive 1   0.123  0.8 mm  ok\nother\ndone\n')
    assert not pattern.search('drive 2  -0.610  ok\ndone\n') and not pattern.search('done\ndrive 1 -0.610  ok\n')


def test_a_block_that_says_nothing_is_refused():
    with pytest.raises(AssertionError, match='line 3'):
        steps_of('```bash\nrostopic list\n```\n')
