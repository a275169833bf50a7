"""The rooms of the package: imports only go down, and every room says what it is for."""
import ast
import os

import pytest

SOURCES = os.path.join(os.path.dirname(__file__), os.pardir, os.pardir, 'src', 'tb3_labs')
#: From the ground up; a room imports from those of lower floors, and from itself.
FLOORS = [{'config', 'news', 'geometry'}, {'robot', 'supervision'}, {'localization', 'control'},
          {'nodes', 'report'}, {'simulation', 'marking'}, {'ros'}]
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
#: What the pure rooms do without.
ROS = {'rospy', 'roslib', 'rosgraph', 'rosbag', 'actionlib', 'tf2_ros', 'time', 'threading'}


def imports():
    """(path in the package, module imported) of every import."""
    for folder, _, names in os.walk(SOURCES):
        for name in names:
            if name.endswith('.py'):
                path = os.path.join(folder, name)
                with open(path) as file:
                    tree = ast.parse(file.read())
                for node in ast.walk(tree):
                    if isinstance(node, ast.ImportFrom):
                        yield os.path.relpath(path, SOURCES), node.module
                    elif isinstance(node, ast.Import):
                        for alias in node.names:
                            yield os.path.relpath(path, SOURCES), alias.name


def room_of(path):
    return os.path.splitext(path.split(os.sep)[0])[0]


def test_imports_only_go_down():
    wrong = []
    for path, module in imports():
        if module.startswith('tb3_labs.') and module.split('.')[1] not in ('msg', 'srv'):
            here, there = room_of(path), module.split('.')[1]
            if there != here and FLOOR[there] >= FLOOR[here]:
                wrong.append('{} imports {}'.format(path, module))
    assert wrong == []


def test_no_room_but_ros_knows_ros_or_a_clock():
    wrong = ['{} imports {}'.format(path, module) for path, module in imports()
             if room_of(path) != 'ros' and (module.split('.')[0] in ROS
                                            or module.split('.')[-1] in ('msg', 'srv'))]
    assert wrong == []


@pytest.mark.parametrize('room', sorted(
    os.path.relpath(folder, SOURCES) for folder, _, names in os.walk(SOURCES)
    if '__init__.py' in names))
def test_every_room_says_which_question_it_answers(room):
    with open(os.path.join(SOURCES, room, '__init__.py')) as file:
        assert len(ast.get_docstring(ast.parse(file.read()))) > 30
