"""The labs, and the names that the handouts give to their nodes."""
from typing import NamedTuple, Tuple

#: The names of the labs.
IMU, TURN, MOVE2GOAL, GAMEPAD = 'imu', 'turn', 'move2goal', 'gamepad'


class NodeNames(NamedTuple):
    """The names by which the node of a lab is found."""

    packages: Tuple[str, ...]   # usual names of the student's package
    files: Tuple[str, ...]      # usual names of the node's file, first the name in this package
    class_name: str             # the handout's name of the class
    node_name: str              # the handout's name of the node
    sensors: Tuple[str, ...]    # topics that a node needs; it is ready if it listens to the first


LAB_NODES = {
    IMU: NodeNames(('ice6',), ('imu_sub.py',), 'IMU', 'imu_sub', ('imu',)),
    TURN: NodeNames(('lab2',), ('turtlebot_controller.py',), 'Controller', 'controller', ('imu',)),
    MOVE2GOAL: NodeNames(('lab7_tf', 'lab7'), ('move2goal_tf.py', 'move2goal.py'), 'MoveToGoal',
                         'move_to_goal', ('odom', 'imu')),
    GAMEPAD: NodeNames(('lab4_gamepad', 'lab7_tf', 'lab7'), ('gamepad.py',), 'Gamepad', 'gamepad',
                       ('joy',)),
}
