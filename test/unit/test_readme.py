"""The README and doc/: all that they name exists, and takes the arguments that they give."""
import fnmatch
import pathlib
import re
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'test'))

import make_parameters  # noqa: E402

PAGES = [ROOT / 'README.md'] + sorted((ROOT / 'doc').glob('*.md'))
#: Placeholders for the reader's own names, in paths and commands.
PLACEHOLDER = re.compile(r'[A-Z]{2,}(?![a-z])')
#: Names in backticks that are files of this package, in any folder.
OWN_FILE = re.compile(r'[\w*./-]+\.(?:py|launch|test|rviz|sh|msg|srv)')
#: Files of others, or of the reader, that the pages name.
OTHERS = {'turtlebot3_robot.launch', 'move2goal.py'}
#: Launch files that robot.launch may include.
LABS = ['turn', 'move2goal', 'gamepad', 'imu_sub']
#: Launch files and rostests, by name.
LAUNCHABLE = {path.name: path for folder, kind in (
    ('launch', '*.launch'), ('test/ros', '*.test'), ('test/marking', '*.test'))
    for path in (ROOT / folder).glob(kind)}


#: Folders of this package.
FOLDERS = ('doc', 'launch', 'msg', 'scripts', 'setup', 'src', 'srv', 'test')


def own_paths():
    """All files and folders of this package, as 'scripts/demo.py'."""
    return [path.relative_to(ROOT).as_posix() for folder in FOLDERS
            for path in (ROOT / folder).glob('**/*')] + [path.name for path in ROOT.iterdir()]


def by_name(pages):
    return pytest.mark.parametrize('page', pages, ids=lambda page: page.name)


def prose_and_code(page):
    """(text outside of code blocks, lines of the code blocks) of a page."""
    parts = page.read_text(encoding='utf-8').split('```')
    return ' '.join(parts[0::2]), [line for part in parts[1::2] for line in part.splitlines()]


def in_backticks(page):
    """All inline code, each on one line."""
    return [' '.join(code.split()) for code in re.findall(r'`([^`]+)`', prose_and_code(page)[0])]


def commands(page):
    """Everything to be typed: inline code, and the lines of code blocks without their comments."""
    return in_backticks(page) + [
        re.split(r'\s#\s', line)[0].strip() for line in prose_and_code(page)[1]]


def anchors(page):
    """The headings of a page, as GitHub makes links of them."""
    headings = re.findall(r'^#+ (.*)$', prose_and_code(page)[0], re.MULTILINE)
    return [re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings]


def arguments_of(path):
    """Arguments that a launch file takes, also for the files it passes all of them on to."""
    launch = ET.parse(str(path)).getroot()
    found = {arg.get('name') for arg in launch.findall('arg')}
    for include in launch.iter('include'):
        if include.get('pass_all_args') == 'true':
            names = re.findall(r'(\w+)\.launch', include.get('file')) or (
                ['fake_robot'] if 'fake_robot' in include.get('file') else LABS)
            found.update(*(arguments_of(ROOT / 'launch' / (name + '.launch')) for name in names))
    return found


def given(words):
    """Names of the arguments NAME:=VALUE among `words`."""
    return {word.split(':=')[0] for word in words if ':=' in word}


def test_the_readme_is_short():
    assert len((ROOT / 'README.md').read_text(encoding='utf-8').splitlines()) <= 250


@by_name(PAGES)
def test_links_lead_somewhere(page):
    for target in re.findall(r'\]\(([^)]+)\)', page.read_text(encoding='utf-8')):
        path, _, anchor = target.partition('#')
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), target


@by_name(PAGES)
def test_paths_in_backticks_exist(page):
    paths = own_paths()
    for code in in_backticks(page):
        for word in re.split(r'[\s,;()\'"]+', code):
            word = PLACEHOLDER.sub('*', word[2:] if word.startswith('./') else word).rstrip('/')
            if 'build/' in word or ':' in word or word == '*':
                continue        # made by the set-up, or of other machines
            whole = word.split('/')[0] in FOLDERS and '/' in word
            if whole or (OWN_FILE.fullmatch(word) and word not in OTHERS):
                assert any(fnmatch.fnmatch(path, word) or not whole and path.endswith('/' + word)
                           for path in paths), code


def test_each_file_of_the_design_stands_in_the_folder_of_its_row():
    rows = 0
    for line in (ROOT / 'doc' / 'design.md').read_text(encoding='utf-8').splitlines():
        cells = line.split('|')
        if len(cells) == 5 and cells[1].strip().startswith('`') and '?' in cells[2]:
            rows += 1
            folders = re.findall(r'`([^`]+)/`', cells[1])
            for name in re.findall(r'`(\w+\.\w+)`', cells[3]):
                assert any((ROOT / folder / name).exists() for folder in folders), line
    assert rows >= 12


def test_the_design_has_a_row_for_each_room():
    page = (ROOT / 'doc' / 'design.md').read_text(encoding='utf-8')
    for room in (ROOT / 'src' / 'tb3_labs').iterdir():
        if (room / '__init__.py').exists():
            assert '| `src/tb3_labs/{}/` |'.format(room.name) in page


@by_name(PAGES)
def test_launch_files_and_their_arguments_exist(page):
    for command in commands(page):
        words = command.split()
        files = [word for word in words if re.fullmatch(r'\w+\.(launch|test)', word)
                 and not PLACEHOLDER.match(word)]
        if './scripts/demo.sh' in words:
            files.append('demo.launch')
        for name in set(files) - OTHERS:
            assert name in LAUNCHABLE, command
            assert given(words) <= arguments_of(LAUNCHABLE[name]), command


@by_name(PAGES)
def test_arguments_that_are_named_alone_exist(page):
    known = set().union(*(arguments_of(path) for path in LAUNCHABLE.values()))
    for command in commands(page):
        if re.fullmatch(r'\w+:=\S*( \w+:=\S*)*', command):
            assert given(command.split()) <= known, command


@by_name(PAGES)
def test_what_rosrun_starts_exists_with_its_options(page):
    for command in commands(page):
        for script, rest in re.findall(r'rosrun tb3_labs (\S+)(.*)', command):
            path = ROOT / 'scripts' / script
            assert path.exists(), command
            for option in re.findall(r'\s(--\w+)', rest):
                assert repr(option) in path.read_text(encoding='utf-8'), command


@by_name(PAGES)
def test_dynparam_sets_what_is_live_to_what_is_valid(page):
    nodes = {node.name: node for node in make_parameters.nodes()}
    for command in commands(page):
        for name, parameter, value in re.findall(r'dynparam set /(\w+) (\w+) (\S+)', command):
            node = nodes[name]
            assert parameter in {item.name for item, live in node.settings if live}, command
            kind = next(kind for kind in node.configs if parameter in kind.__dataclass_fields__
                        and kind is not make_parameters.ModelConfig)
            replace(kind(), **{parameter: yaml.safe_load(value)})


@by_name(PAGES)
def test_test_names_match_a_test(page):
    names = [path.stem for path in LAUNCHABLE.values() if path.suffix == '.test']
    for command in commands(page):
        for words in re.findall(r'\./scripts/test\.sh((?: \w+)+)', command):
            for word in words.split():
                assert word in ('unit', 'ros') or PLACEHOLDER.fullmatch(word) or any(
                    word in name for name in names), command


@by_name(PAGES)
def test_unit_tests_that_are_named_exist(page):
    for code in in_backticks(page):
        if re.fullmatch(r'test_\w+', code) and not code.startswith('test_extra'):
            assert (ROOT / 'test' / 'unit' / (code + '.py')).exists(), code
