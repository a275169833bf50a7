"""The files and programs that the README and doc/ name exist, and have the arguments that the pages use. sheets_test.py
types the commands of the blocks."""
import fnmatch
import re

from pages import (
    FOLDERS, LAUNCHABLE, OTHERS, OWN_FILE, PAGES, PLACEHOLDER, ROOT, SKELETONS, anchors,
    arguments_of, by_name, commands, in_backticks, own_paths, words_of)

from sheets_steps import KINDS, steps_of

#: Steps of the commands within sentences and tables.
WALK = ROOT / 'test' / 'ros' / 'sheets_walk.md'


def steps_on(page):
    return steps_of(page.read_text(encoding='utf-8'))


def test_the_readme_is_short():
    lines = (ROOT / 'README.md').read_text(encoding='utf-8').splitlines()
    assert len(lines) <= 80 and 'No real TurtleBot3 was available' in ' '.join(lines[:10])
    assert 'imu_lab.md' in ''.join([line for line in lines if line][:13])    # a student begins there
    assert [line for line in lines if len(line) > 120 and not line.startswith(('![', '|'))] == []


@by_name(PAGES)
def test_links_lead_somewhere(page):
    for target in re.findall(r'\]\(([^)]+)\)', page.read_text(encoding='utf-8')):
        if target.startswith(('http://', 'https://')):
            continue
        path, _, anchor = target.partition('#')
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), target


@by_name(PAGES)
def test_paths_in_backticks_exist(page):
    paths = own_paths()
    for code in in_backticks(page):
        for word in re.split(r'[\s,;()\'"]+', code):
            word = PLACEHOLDER.sub('*', word[2:] if word.startswith('./') else word).strip('/')
            if 'build/' in word or ':' in word or word == '*':
                continue        # a file that the set-up makes, or a path of another computer
            whole = word.split('/')[0] in FOLDERS and '/' in word
            if whole or (OWN_FILE.fullmatch(word) and word not in OTHERS):
                assert any(fnmatch.fnmatch(path, word) or not whole and path.endswith('/' + word)
                           for path in paths), code


@by_name(PAGES)
def test_launch_files_and_their_arguments_exist(page):
    for command in commands(page):
        words = words_of(command)
        files = [word for word in words if re.fullmatch(r'\w+\.(launch|test)', word)
                 and not PLACEHOLDER.match(word)]
        files += [name + '.launch' for name in re.findall(r'(?:^|\s)\./scripts/(\w+)\.sh', command)
                  if name + '.launch' in LAUNCHABLE]
        for name in set(files) - OTHERS:
            kinds = (LAUNCHABLE,) if 'tb3_labs' in words else (LAUNCHABLE, SKELETONS)
            paths = [kind[name] for kind in kinds if name in kind]
            assert paths, command
            names = {word.split(':=')[0] for word in words if ':=' in word}
            assert names <= set().union(*map(arguments_of, paths)), command


@by_name(PAGES)
def test_programs_and_options_of_rosrun_exist(page):
    for command in commands(page):
        for script, rest in re.findall(r'rosrun tb3_labs (\S+)(.*)', command):
            path = ROOT / 'scripts' / script
            assert path.exists(), command
            for option in set(re.findall(r'\s(--\w+)', rest)) - {'--help'}:
                assert repr(option) in path.read_text(encoding='utf-8'), command


@by_name([*PAGES, WALK])
def test_a_block_that_is_not_typed_has_a_reason(page):
    """sheets_steps.py refuses a block that does not say how it is typed."""
    assert [step for step in steps_on(page) if step.kind == 'never' and len(step.argument) < 10] == []


def test_the_walk_types_commands_of_the_pages():
    there = {command for page in PAGES for command in commands(page)}
    assert [step.text for step in steps_on(WALK)
            if step.kind in ('run', 'long') and not set(step.commands) <= there] == []


def test_the_walk_types_the_commands_that_the_pages_leave_to_the_walk():
    typed = {command for step in steps_on(WALK) if step.kind in KINDS[:3] for command in step.commands}
    literal = {command for page in PAGES for step in steps_on(page)
               if step.kind == 'never' and 'sheets_walk.md' in step.argument for command in step.commands}
    assert len(literal) > 10 and literal - typed == set()
