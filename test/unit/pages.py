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
#: A placeholder for a reader's own name, in a path or a command.
PLACEHOLDER = re.compile(r'[A-Z]{2,}(?![a-z])')
#: A name in backticks is a file of this package if it has this form.
OWN_FILE = re.compile(r'[\w*./-]+\.(?:py|launch|test|rviz|sh|msg|srv)')
#: The pages also name these files, which are not of this package.
OTHERS = {'turtlebot3_core.launch', 'turtlebot3_robot.launch', 'move2goal.py', 'move_to_goal.py'}
#: Launch files and rostests, by name.
LAUNCHABLE = {path.name: path for folder, kind in (
    ('launch', '*.launch'), ('test/ros', '*.test'), ('launch/checks', '*.test'))
    for path in (ROOT / folder).glob(kind)}
#: Launch files of the students' packages, which skeleton.py writes. A name may also be in LAUNCHABLE.
SKELETONS = {path.name[:-len('.in')]: path
             for path in (ROOT / 'doc' / 'skeletons').glob('*/launch/*.launch.in')}
#: For tests of what the set-up makes.
needs_setup = pytest.mark.skipif(not (ROOT / 'build' / '.ws' / 'build.stamp').exists(),
                                 reason='scripts/setup.sh has not set this repository up')
#: Folders of this package.
FOLDERS = ('doc', 'launch', 'msg', 'scripts', 'src', 'srv', 'test')


def own_paths():
    """Returns the paths of all files and folders of this package, such as 'scripts/demo.py'. A file
    of a skeleton has the name that students see."""
    return [re.sub(r'[.]in$', '', path.relative_to(ROOT).as_posix()) for folder in FOLDERS
            for path in (ROOT / folder).glob('**/*')] + [path.name for path in ROOT.iterdir()]


def by_name(pages):
    return pytest.mark.parametrize('page', pages, ids=lambda page: page.name)


def prose_and_code(page):
    """Returns (text outside of code blocks, lines of the code blocks) of a page."""
    parts = page.read_text(encoding='utf-8').split('```')
    return ' '.join(parts[0::2]), [
        line for part in parts[1::2] for line in part.splitlines()[1:]]    # without the info string


def in_backticks(page):
    """Returns all inline code of a page. Each piece is one line."""
    return [' '.join(code.split()) for code in re.findall(r'`([^`]+)`', prose_and_code(page)[0])]


def commands(page):
    """Returns all inline code, and the lines of code blocks without their comments."""
    return in_backticks(page) + [
        re.split(r'\s#\s', line)[0].strip() for line in prose_and_code(page)[1]]


def anchors(page):
    """Returns the anchors that GitHub makes of the headings of a page."""
    headings = re.findall(r'^#+ (.*)$', prose_and_code(page)[0], re.MULTILINE)
    return [re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings]


def arguments_of(path):
    """Returns the arguments of a launch file."""
    return {arg.get('name') for arg in ET.parse(str(path)).getroot().findall('arg')
            if arg.get('value') is None}


def words_of(command):
    """Returns the words of a command, split as in a shell."""
    try:
        return shlex.split(command)
    except ValueError:      # a line of a text that is not a command
        return command.split()
