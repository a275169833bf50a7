"""Names: of the labs, of the nodes of the handouts, and of a student's packages and types."""
import keyword
import re
from os.path import commonprefix
from typing import NamedTuple, Tuple

#: The names of the labs.
IMU, TURN, MOVE2GOAL, GAMEPAD = 'imu', 'turn', 'move2goal', 'gamepad'
#: A name of a package, a type or a field that ROS allows. `\\w` would allow more letters.
NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*')


class NodeNames(NamedTuple):
    """The names by which the node of a lab is found."""

    packages: Tuple[str, ...]   # usual names of the student's package
    files: Tuple[str, ...]      # usual names of the node's file, first the name in this package
    class_name: str             # the handout's name of the class
    node_name: str              # the handout's name of the node
    sensors: Tuple[str, ...]    # topics that a node needs; it is ready if it listens to the first
    uses: Tuple[str, ...]       # other topics of a complete node, and its call for the reset


LAB_NODES = {
    IMU: NodeNames(('ice6',), ('imu_sub.py',), 'IMU', 'imu_sub', ('imu',), ()),
    TURN: NodeNames(('lab2',), ('turtlebot_controller.py',), 'Controller', 'controller', ('imu',),
                    ('mouse_info', 'cmd_vel')),
    MOVE2GOAL: NodeNames(('lab7_tf', 'lab7'), ('move2goal_tf.py', 'move2goal.py'), 'MoveToGoal',
                         'move_to_goal', ('odom', 'imu'), ('imu', 'cmd_vel', 'Service(')),
    GAMEPAD: NodeNames(('lab4_gamepad', 'lab7_tf', 'lab7'), ('gamepad.py',), 'Gamepad', 'gamepad',
                       ('joy',), ('cmd_vel', 'ctrl_relinq', 'ServiceProxy(')),
}


def is_name(text: str) -> bool:
    """Does ROS allow this as the name of a package, a type or a field, and Python too?"""
    return bool(NAME.fullmatch(text)) and not keyword.iskeyword(text)


def is_typo_of(name: str, near: str) -> bool:
    """Does `name` differ from `near` by one letter, or by two letters that changed places? Names
    with different digits (cv, cv2) are different modules."""
    same = sum(len(commonprefix(pair)) for pair in ([name, near], [name[::-1], near[::-1]]))
    longest = max(len(name), len(near))
    return (name[0] == near[0] and abs(len(name) - len(near)) < 2
            and re.sub(r'\d', '', name) != re.sub(r'\d', '', near)
            and same >= longest - 1 - (sorted(name) == sorted(near)))
