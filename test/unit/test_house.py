"""The rooms of the package: imports only go down, and every room states its purpose."""
import ast
import glob
import os
from functools import lru_cache

import pytest

SOURCES = os.path.join(os.path.dirname(__file__), os.pardir, os.pardir, 'src', 'tb3_labs')
#: The notions, from the ground up; a room imports only from lower floors, and from itself.
NOTIONS = [{'config', 'news', 'command_line'}, {'geometry'}, {'robot', 'supervision'}, {'localization', 'control'},
           {'nodes'}]
#: What a tool takes from other tools. Each holds all of one tool, its ROS in files named ros_*.py.
TOOLS = {'simulation': set(), 'report': {'simulation'}, 'marking': {'report', 'simulation'}, 'panel': set(),
         'doctor': set(), 'handout': set()}
FLOOR = {room: floor for floor, rooms in enumerate(NOTIONS + [{'ros'}, set(TOOLS)]) for room in rooms}
#: Modules that the notions do not use.
ROS = {'rospy', 'roslib', 'rosgraph', 'rosbag', 'actionlib', 'tf2_ros', 'time', 'threading'}


@lru_cache(maxsize=None)
def imports():
    """[(path in the package, module imported)] of every import."""
    found = []
    for folder, _, names in os.walk(SOURCES):
        for name in names:
            if name.endswith('.py'):
                path = os.path.join(folder, name)
                with open(path) as file:
                    tree = ast.parse(file.read())
                for node in ast.walk(tree):
                    if isinstance(node, ast.ImportFrom):
                        found.append((os.path.relpath(path, SOURCES), node.module))
                    elif isinstance(node, ast.Import):
                        found += [(os.path.relpath(path, SOURCES), alias.name)
                                  for alias in node.names]
    return found


def room_of(path):
    return os.path.splitext(path.split(os.sep)[0])[0]


def test_imports_only_go_down():
    wrong = []
    for path, module in imports():
        if module.startswith('tb3_labs.') and module.split('.')[1] not in ('msg', 'srv'):
            here, there = room_of(path), room_of(os.sep.join(module.split('.')[1:]))
            if there != here and FLOOR[there] >= FLOOR[here] and there not in TOOLS.get(here, ()):
                wrong.append('{} imports {}'.format(path, module))
    assert wrong == []


def is_ros(module):
    return module.split('.')[0] in ROS or module.split('.')[-1] in ('msg', 'srv')


def test_the_notions_know_neither_ros_nor_a_clock():
    wrong = ['{} imports {}'.format(path, module) for path, module in imports()
             if FLOOR[room_of(path)] < FLOOR['ros'] and is_ros(module)]
    assert wrong == []


def test_the_ros_of_a_tool_is_seen_by_the_names_of_its_files():
    wrong = ['{} imports {}'.format(path, module) for path, module in imports()
             if room_of(path) in TOOLS and not os.path.basename(path).startswith('ros_')
             and (is_ros(module) and module not in ('time', 'threading') or module.startswith('tb3_labs.ros.'))]
    assert wrong == []


@pytest.mark.parametrize('room', sorted(
    os.path.relpath(folder, SOURCES) for folder, _, names in os.walk(SOURCES)
    if '__init__.py' in names))
def test_every_room_says_which_question_it_answers(room):
    with open(os.path.join(SOURCES, room, '__init__.py')) as file:
        assert len(ast.get_docstring(ast.parse(file.read()))) > 30


# ----- ros/, and the nodes and tools in scripts/ -----

#: Floors within ros/, from the ground up: its own files, then its folders.
ROS_FLOORS = [{'rospy_internals', 'conversions', 'parameters', 'reconfigure', 'signals', 'launch',
               'robot_description'}, {'clocks', 'dynparam'}, {'console'}, {'node'},
              {'topics', 'diagnostics', 'reset_call'},
              {'cmd_vel', 'ctrl_relinq', 'goals', 'resets', 'display', 'observer', 'program'}]
ROS_FLOOR = {part: floor for floor, parts in enumerate(ROS_FLOORS) for part in parts}
#: These files alone touch private parts of libraries.
INTERNALS = {'rospy_internals.py', 'ros_internals.py'}
#: Private without an underscore: modules that rospy keeps for itself, and what its handles hold.
ROSPY_PARTS = {'impl', 'core', 'rostime', 'get_stats'}


def test_imports_within_ros_only_go_down():
    wrong = []
    for path, module in imports():
        if room_of(path) == 'ros' and module.startswith('tb3_labs.ros.'):
            here, there = room_of(os.path.relpath(path, 'ros')), module.split('.')[2]
            if there != here and ROS_FLOOR[there] >= ROS_FLOOR[here]:
                wrong.append('{} imports {}'.format(path, module))
    assert wrong == []


def private_parts(tree):
    """(line, name) of each private attribute of another object; os._exit() is public in spite of
    its name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            own = isinstance(node.value, ast.Name) and node.value.id in ('self', 'cls')
            hidden = node.attr.startswith('_') and not node.attr.startswith('__')
            if hidden and not own and node.attr != '_exit' or node.attr in ROSPY_PARTS:
                yield node.lineno, node.attr
        elif isinstance(node, ast.ImportFrom) and (node.module or '').startswith('rospy.'):
            yield node.lineno, node.module


def test_one_file_alone_touches_the_private_parts_of_rospy():
    files = [path for folder in ('ros', os.path.join(os.pardir, os.pardir, 'scripts'))
             for path in glob.glob(os.path.join(SOURCES, folder, '**', '*.py'), recursive=True)
             if os.path.basename(path) not in INTERNALS]
    assert len(files) > 30
    wrong = []
    for path in files:
        with open(path) as file:
            wrong += ['{}:{} {}'.format(os.path.relpath(path, SOURCES), *part)
                      for part in private_parts(ast.parse(file.read()))]
    assert wrong == []


@pytest.mark.parametrize('code', [
    'message._connection_header', 'self._publisher.impl', 'rospy.core.is_shutdown_requested()',
    'rospy.rostime.wallsleep(1.0)', 'from rospy.topics import Publisher', 'handler._write = put'])
def test_private_parts_are_noticed(code):
    assert list(private_parts(ast.parse(code)))


@pytest.mark.parametrize('code', [
    'self._publisher.publish(0)', 'rospy.get_time()', 'os._exit(1)', 'server.__class__'])
def test_public_parts_are_not(code):
    assert not list(private_parts(ast.parse(code)))


# ----- scripts/ -----

#: What a person chooses from after `rosrun tb3_labs <Tab>`.
MOST_PROGRAMS = 19
SCRIPTS = sorted(glob.glob(os.path.join(SOURCES, os.pardir, os.pardir, 'scripts', '*.py')))


@pytest.mark.parametrize('path', SCRIPTS, ids=os.path.basename)
def test_every_script_answers_help(path):
    """By run() of tb3_labs.ros.node, by command_line.Parser, or by itself; bad_start.test tries some of them."""
    with open(path) as file:
        text = file.read()
    assert len(ast.get_docstring(ast.parse(text))) > 60
    assert any(words in text for words in (
        "\n    run('", 'parser = Parser(', "'--help'", 'sys.exit(__doc__'))


@pytest.mark.parametrize('path', SCRIPTS, ids=os.path.basename)
def test_every_script_is_executable(path):
    """All but demo.py, which demo.sh starts: rosrun does not list it."""
    assert os.access(path, os.X_OK) == (os.path.basename(path) != 'demo.py')


def test_rosrun_lists_the_scripts_alone():
    """In a catkin workspace its completion finds every executable file that is not hidden."""
    root = os.path.realpath(os.path.join(SOURCES, os.pardir, os.pardir))
    found = []
    for folder, folders, names in os.walk(root):
        folders[:] = [name for name in folders if not name.startswith('.') and name != 'build']
        found += [os.path.relpath(os.path.join(folder, name), root) for name in names
                  if not name.startswith('.') and os.access(os.path.join(folder, name), os.X_OK)]
    assert {os.path.dirname(path) for path in found} == {'scripts'}
    assert len(found) <= MOST_PROGRAMS, found
