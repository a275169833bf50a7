"""Shared by the tests of the README and of doc/: their commands, links and names."""
import pathlib
import re
import shlex
import xml.etree.ElementTree as ET

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / 'scripts'
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'doc').glob('*.md')),
         *sorted((ROOT / 'doc' / 'instructor').glob('*.md'))]
#: Placeholders for the reader's own names, in paths and commands.
PLACEHOLDER = re.compile(r'[A-Z]{2,}(?![a-z])')
#: Names in backticks that are files of this package, in any folder.
OWN_FILE = re.compile(r'[\w*./-]+\.(?:py|launch|test|rviz|sh|msg|srv)')
#: Files of others, or of the reader, that the pages name.
OTHERS = {'turtlebot3_core.launch', 'turtlebot3_robot.launch', 'move2goal.py', 'move_to_goal.py'}
#: Launch files and rostests, by name.
LAUNCHABLE = {path.name: path for folder, kind in (
    ('launch', '*.launch'), ('test/ros', '*.test'), ('launch/checks', '*.test'))
    for path in (ROOT / folder).glob(kind)}
#: Launch files of the students' packages, as the skeletons write them: a name may be in both.
SKELETONS = {path.name[:-len('.in')]: path
             for path in (ROOT / 'doc' / 'skeletons').glob('*/launch/*.launch.in')}
#: Folders of this package.
FOLDERS = ('doc', 'launch', 'msg', 'scripts', 'src', 'srv', 'test')


def own_paths():
    """All files and folders of this package, as 'scripts/demo.py'; a skeleton's as students have
    it."""
    return [re.sub(r'[.]in$', '', path.relative_to(ROOT).as_posix()) for folder in FOLDERS
            for path in (ROOT / folder).glob('**/*')] + [path.name for path in ROOT.iterdir()]


def by_name(pages):
    return pytest.mark.parametrize('page', pages, ids=lambda page: page.name)


def prose_and_code(page):
    """(text outside of code blocks, lines of the code blocks) of a page."""
    parts = page.read_text(encoding='utf-8').split('```')
    return ' '.join(parts[0::2]), [
        line for part in parts[1::2] for line in part.splitlines()[1:]]    # without the info string


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
    """The arguments that a launch file takes."""
    return {arg.get('name') for arg in ET.parse(str(path)).getroot().findall('arg')
            if arg.get('value') is None}


def words_of(command):
    """The words of a command, as a shell splits them."""
    try:
        return shlex.split(command)
    except ValueError:      # a line of a text that is not a command
        return command.split()
