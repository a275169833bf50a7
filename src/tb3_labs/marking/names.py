"""The names of the labs and of the handouts' nodes, and rules for names in submissions."""
import keyword
import re
from typing import NamedTuple, Tuple

IMU, TURN, MOVE2GOAL, GAMEPAD = 'imu', 'turn', 'move2goal', 'gamepad'
#: The names that ROS allows. `\\w` would also allow other letters.
NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*')


class NodeNames(NamedTuple):
    """The names by which the marking finds the node of a lab."""

    packages: Tuple[str, ...]   # usual names of the student's package
    files: Tuple[str, ...]      # usual names of the node's file; this package uses the first name
    class_name: str             # the handout's name of the class
    node_name: str              # the handout's name of the node
    sensors: Tuple[str, ...]    # needed topics; a node is ready if it listens to the first topic
    uses: Tuple[str, ...]       # other topics that a complete node has, and its call of the reset


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
    """Do ROS and Python allow `text` as the name of a package, a type or a field?"""
    return bool(NAME.fullmatch(text)) and not keyword.iskeyword(text)
