"""The rooms of the package import only from lower rooms. Files keep the rules of the house."""
import ast
import hashlib
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
from collections import Counter, defaultdict
from functools import lru_cache

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCES = ROOT / 'src' / 'tb3_labs'
SCRIPTS = sorted((ROOT / 'scripts').glob('*.py'))
OWN_FILES = [path for folder in ('src', 'scripts', 'launch', 'test', 'doc')
             for path in (ROOT / folder).rglob('*.py')]
#: The notions, from the lowest floor up. A room imports only from lower floors, and from itself.
NOTIONS = [{'handout'}, {'safe_output'}, {'config', 'command_line', 'drawing'}, {'geometry'}, {'robot', 'supervision'},
           {'localization', 'control', 'watch'}, {'nodes'}]
#: {tool: other tools that it imports}. The modules of a tool that use ROS are named ros_*.py.
TOOLS = {'simulation': set(), 'report': {'simulation'}, 'marking': {'report'},
         'panel': set(), 'doctor': set()}
FLOORS = NOTIONS + [{'ros', 'recording'}, {'the ROS sides of nodes'}, set(TOOLS)]
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
#: Modules that the notions do not use.
ROS = {'rospy', 'roslib', 'rosgraph', 'rosbag', 'actionlib', 'tf2_ros', 'time', 'threading'}

#: Floors within ros/, from the lowest floor up.
ROS_FLOORS = [{'rospy_internals', 'conversions', 'parameters', 'launch_arguments',
               'robot_description'},
              {'clocks'}, {'node'}, {'topics', 'live_settings', 'cmd_vel'},
              {'dynparam', 'core_runner', 'sensor_topics', 'reset_client'}]
ROS_FLOOR = {part: floor for floor, parts in enumerate(ROS_FLOORS) for part in parts}
#: Public attributes with private names: of namedtuples, of os and sys, and of generated messages.
PUBLIC = {'_replace', '_asdict', '_fields', '_exit', '_current_frames', '_type', '_md5sum', '_slot_types',
          '_request_class', '_response_class'}
#: Private parts of rospy that have no underscore.
ROSPY_PARTS = {'impl', 'core', 'rostime', 'get_stats'}


@lru_cache(maxsize=None)
def tree_of(path):
    return ast.parse(path.read_text(encoding='utf-8'), str(path), feature_version=(3, 8))


@lru_cache(maxsize=None)
def imports():
    """[(path in the package, parts of the module imported)] of every import."""
    found = []
    for path in SOURCES.rglob('*.py'):
        for node in ast.walk(tree_of(path)):
            names = []
            if isinstance(node, ast.ImportFrom):
                names = [node.module]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            found += [(path.relative_to(SOURCES), name.split('.')) for name in names]
    return found


def room_of(path):
    return path.parts[0].replace('.py', '')


def floor_of(parts):
    """The ROS side of a node, a file ros_*.py beside the core, is on the floor above ros/."""
    is_side = parts[0] == 'nodes' and any(part.startswith('ros_') for part in parts[1:])
    return FLOOR['the ROS sides of nodes' if is_side else parts[0].replace('.py', '')]


def is_ros(module):
    return module[0] in ROS or module[-1] in ('msg', 'srv')


def test_imports_only_go_down():
    for path, module in imports():
        here = room_of(path)
        lower = {'msg', 'srv', *TOOLS.get(here, ())}
        if module[0] == 'tb3_labs' and not lower.issuperset(module[1:2]):
            below = floor_of(path.parts) - floor_of(module[1:])
            assert below > 0 or below == 0 and module[1] == here, (path, module)
        if module[:2] == ['tb3_labs', 'ros'] and module[2:] and here == 'ros':
            part = room_of(path.relative_to('ros'))
            assert module[2] == part or ROS_FLOOR[module[2]] < ROS_FLOOR[part], (path, module)


def test_the_notions_know_neither_ros_nor_a_clock():
    """The probe is not checked, since it runs in a student's process, with ROS."""
    assert [(path, module) for path, module in imports() if floor_of(path.parts) < FLOOR['ros']
            and path.parts[:2] != ('watch', 'probe') and is_ros(module)] == []


def test_a_tool_uses_ros_only_in_files_named_ros():
    assert [(path, module) for path, module in imports()
            if room_of(path) in TOOLS and not path.name.startswith('ros_')
            and module[0] not in ('time', 'threading')
            and (is_ros(module) or module[:2] == ['tb3_labs', 'ros'])] == []


#: {room of marking: modules that it does not import}. An intake uses no criterion, a lab starts no process.
APART = {'intake': {'labs', 'trial'}, 'labs': {'subprocess', 'os', 'pty', 'signal', 'processes'}}
BELOW_ROOMS = {'student_nodes', 'limits'}
ABOVE_ROOMS = {path.stem for path in (SOURCES / 'marking').glob('[!_]*.py')} - BELOW_ROOMS


def test_the_rooms_of_marking_stay_apart():
    assert [(path, module) for path, module in imports() if path.parts[0] == 'marking'
            and len(path.parts) > 2 and (APART.get(path.parts[1], set()) | ABOVE_ROOMS) & set(module)] == []
    folders = [SOURCES / 'marking', *(path for path in (SOURCES / 'marking').iterdir() if path.is_dir())]
    assert max(len(list(folder.glob('[!_]*.py'))) for folder in folders) <= 10
    assert [module for path, module in imports() if path.stem in BELOW_ROOMS
            and 'tb3_labs' in module and not BELOW_ROOMS & set(module)] == []


def test_every_room_states_its_question():
    assert [path for path in SOURCES.rglob('__init__.py')
            if len(ast.get_docstring(tree_of(path)) or '') < 30] == []


def test_no_name_of_a_class_stands_twice():
    names = [node.name for path in SOURCES.rglob('*.py') for node in tree_of(path).body
             if isinstance(node, ast.ClassDef)]
    assert [name for name, count in Counter(names).items() if count > 1] == []


def test_a_constant_of_the_rooms_that_decide_has_one_value_in_the_whole_package():
    places, ours = defaultdict(set), set()
    for path in [*SOURCES.rglob('*.py'), *SCRIPTS]:
        for node in tree_of(path).body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and any(
                    isinstance(getattr(part, 'value', ''), (int, float))
                    for part in ast.walk(node.value)):
                places[node.targets[0].id].add(path)
                if {'localization', 'supervision', 'nodes'} & set(path.relative_to(ROOT).parts):
                    ours.add(node.targets[0].id)
    ours = {name for name in ours if name.isupper()}
    assert len(ours) > 40 and {name for name in ours if len(places[name]) > 1} == set()


def private_parts(tree):
    """(line, name) of each private attribute of another object."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            own = isinstance(node.value, ast.Name) and node.value.id in ('self', 'cls')
            hidden = node.attr.startswith('_') and not node.attr.startswith('__')
            if hidden and not own and node.attr not in PUBLIC or node.attr in ROSPY_PARTS:
                yield node.lineno, node.attr
        elif isinstance(node, ast.ImportFrom) and (node.module or '').startswith('rospy.'):
            yield node.lineno, node.module


def test_two_files_alone_touch_the_private_parts_of_rospy():
    """ros_gamepad.py of marking offers a service of any type."""
    assert {path.name for path in [*SOURCES.rglob('*.py'), *SCRIPTS]
            if list(private_parts(tree_of(path)))} == {'rospy_internals.py', 'ros_gamepad.py'}


def test_a_node_reads_the_clock_while_it_holds_the_lock():
    """The second of two resets had the older stamp: its time was read before it waited for the lock."""
    calls = [call for path in SOURCES.rglob('*.py') for call in ast.walk(tree_of(path))
             if isinstance(call, ast.Call) and getattr(call.func, 'attr', '') in ('call_and_decide', 'call_core')]
    assert len(calls) > 20
    assert [ast.dump(call) for call in calls for given in call.args if isinstance(given, ast.Call)
            and getattr(given.func, 'id', '').endswith('_time')] == []


@pytest.mark.skipif(importlib.util.find_spec('flake8') is None,
                    reason='flake8 is not installed (TB3_LABS_TESTS=1 ./scripts/setup.sh installs it)')
def test_flake8_finds_nothing():
    """A file that passed before is not checked again."""
    passed, settings = ROOT / 'build' / '.ws' / 'flake8', (ROOT / '.flake8').read_bytes()
    known = passed.read_text().split() if passed.is_file() else ()
    files = {hashlib.sha256(settings + str(path).encode() + path.read_bytes()).hexdigest(): str(path)
             for path in [ROOT / 'setup.py', *OWN_FILES] if 'skeletons' not in path.parts}
    new = [path for key, path in files.items() if key not in known]
    result = subprocess.run(
        [sys.executable, '-m', 'flake8', *(new or ['setup.py'])], cwd=str(ROOT),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    assert (result.stdout, result.returncode) == ('', 0)
    if os.access(str(passed.parent), os.W_OK):
        passed.write_text('\n'.join(files))


@pytest.mark.skipif(shutil.which('catkin_lint') is None, reason='catkin_lint is not installed')
def test_catkin_lint_finds_nothing(tmp_path):
    """catkin_lint reads a folder with the package's name. Without a package it also ends with 0."""
    (tmp_path / 'tb3_labs').symlink_to(ROOT)
    printed = subprocess.run(['catkin_lint', '-W2', '--strict', '--offline', str(tmp_path / 'tb3_labs')],
                             stderr=subprocess.PIPE, universal_newlines=True, check=False).stderr
    assert 'checked 1 packages and found 0 problems' in printed


def test_a_line_of_a_test_has_at_most_120_characters():
    assert [(path.name, line) for path in (ROOT / 'test').rglob('*.py')
            for line in path.read_text(encoding='utf-8').splitlines() if len(line) > 120] == []


def test_all_files_are_python38():
    """Noetic has Python 3.8. A newer Python accepts some syntax that 3.8 refuses, so test/oldest.sh
    runs this, too, and imports the unit tests. vermin (PyPI) finds uses of a newer standard library:
    vermin -t=3.8- --violations --eval-annotations --feature union-types src scripts test doc
    """
    assert len([tree_of(path) for path in OWN_FILES if 'unit' not in path.parts]) > 100


def test_no_program_starts_a_python_that_looks_into_the_current_folder():
    """With -c, -m or - a student's copy.py in that folder would run. -I or `del sys.path[0]` prevents it."""
    start = re.compile(r'python[\d.]*"?(?: -W \w+| 2>\S+)*( -[A-Zcm]?) (?!\'import sys; del sys\.path\[0\];)')
    files = [path for folder in ('launch', 'scripts', 'doc/skeletons', '.devcontainer')
             for path in (ROOT / folder).rglob('*') if path.is_file() and path.suffix not in ('.py', '.pyc')]
    assert len(files) > 30
    assert [(path.name, line) for path in files for line in path.read_text(encoding='utf-8').splitlines()
            if (start.search(line.partition('# ')[0]) or [0, ' -I'])[1] != ' -I'] == []


def closure(script):
    """Returns the script, and all modules of the package that it imports, directly or not."""
    read, waiting = set(), [script]
    while waiting:
        path = waiting.pop()
        read.add(path)
        for node in ast.walk(tree_of(path)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else (
                [node.module] + [node.module + '.' + alias.name for alias in node.names]
                if isinstance(node, ast.ImportFrom) else [])
            files = {SOURCES.parent / (name.replace('.', '/') + '.py') for name in names}
            waiting += [file for file in files - read if file.is_file()]
    return read


BOUNDS = re.findall(r'^\| (`.*\.py`) \| (\d+) \| ([\d,]+) \|$',
                    (ROOT / 'doc' / 'instructor' / 'design.md').read_text(encoding='utf-8'), re.MULTILINE)


@pytest.mark.parametrize('node, files, lines', [
    (node, int(files), int(lines.replace(',', '')))
    for nodes, files, lines in BOUNDS for node in re.findall('`(.*?)`', nodes)])
def test_a_node_is_read_in_one_sitting(node, files, lines):
    read = closure(ROOT / 'scripts' / node)
    assert len(read) <= files and sum(len(path.read_text(encoding='utf-8').splitlines()) for path in read) <= lines


#: rosrun completes at most this number of programs.
MAX_PROGRAMS = 21


@pytest.mark.parametrize('path', [path for path in SCRIPTS if not re.match('plain_|imu_sub', path.name)],
                         ids=lambda path: path.name)
def test_every_script_but_those_of_the_handout_answers_help(path):
    """A node runs by run_node(), a tool by run_tool()."""
    assert len(ast.get_docstring(tree_of(path))) > 60
    text = path.read_text(encoding='utf-8')
    assert any(words in text for words in ("\n    run_node('", 'parser = Parser(', "'--help'"))
    assert 'Parser(' not in text or '\n    run_tool(' in text


def test_rosrun_lists_the_scripts_alone():
    """In a catkin workspace its completion finds every executable file that is not hidden."""
    found = []
    for folder, folders, names in os.walk(str(ROOT)):
        folders[:] = [name for name in folders if not name.startswith('.') and name != 'build']
        paths = [pathlib.Path(folder, name) for name in names if not name.startswith('.')]
        found += [path for path in paths if os.access(str(path), os.X_OK)]
    assert {path.parent for path in found} == {ROOT / 'scripts'}
    assert set(SCRIPTS) <= set(found) and len(found) <= MAX_PROGRAMS, found
