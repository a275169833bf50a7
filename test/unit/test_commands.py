"""Every command of the README and of doc/ is typed by sheets_test.py, or stands there with the reason
why it cannot be."""
import re
import sys

import pytest
from pages import PAGES, ROOT, by_name

sys.path.insert(0, str(ROOT / 'test' / 'ros'))

from sheets_steps import KINDS, steps_of, without_comment

WALK = ROOT / 'test' / 'ros' / 'sheets_walk.md'
INLINE = re.compile(r'^ *```.*?^ *```$|`([^`]+)`', re.MULTILINE | re.DOTALL)
#: Inline code that is a command: a program and its words, or a script of this package.
COMMAND = re.compile(
    r'([A-Z_]+=\S+ )?((ros(run|launch|test|topic|service|node|bag|param|dep|msg|version)|catkin\w*|'
    r'dynparam|bash|source|docker|git|ssh\S*|scp|apt|sudo|python3|timeout|export|cd|mkdir|kill|chmod|curl) |'
    r'\./?(scripts|test)/\w+\.sh|test/\w+\.sh)')


def typed(path):
    """The commands of a page's blocks, all of which say how they are typed."""
    return [command for step in steps_of(path.read_text(encoding='utf-8')) if step.kind in KINDS[:3] + (
        'never',) for command in step.commands if command]


def inline(text):
    """The commands of a page that stand in its sentences and tables."""
    found = [without_comment(' '.join(code.split())) for code in INLINE.findall(text)]
    return [code for code in found if COMMAND.match(code)]


@pytest.fixture(scope='module')
def known():
    return {command for path in [WALK, *PAGES] for command in typed(path)}


@by_name(PAGES)
def test_every_command_is_typed_or_says_why_not(page, known):
    text = page.read_text(encoding='utf-8')
    assert [command for command in inline(text) if command not in known] == []
    assert [step for step in steps_of(text) if step.kind == 'never' and len(step.argument) < 10] == []


def test_the_walk_types_what_the_pages_have():
    there = {command for page in PAGES for command in inline(page.read_text(encoding='utf-8')) + typed(page)}
    assert [step.text for step in steps_of(WALK.read_text(encoding='utf-8'))
            if step.kind in ('run', 'long', 'never') and not set(step.commands) <= there] == []


def test_what_the_walk_types_in_another_home_is_what_the_page_says():
    literal = [command for page in PAGES for step in steps_of(page.read_text(encoding='utf-8'))
               if step.kind == 'never' and 'sheets_walk.md' in step.argument for command in step.commands]
    assert len(literal) > 10 and [command for command in literal if command not in typed(WALK)] == []
