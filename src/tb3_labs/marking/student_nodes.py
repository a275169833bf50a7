"""The names of the nodes that students write, and the start of a node from a submission."""
import ast
import json
import keyword
import os
import re
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from tb3_labs.marking.limits import LIMIT_FILES_COMMAND

IMU, TURN, MOVE2GOAL, GAMEPAD = 'imu', 'turn', 'move2goal', 'gamepad'
#: The names that ROS allows. `\w` would also allow letters that are not ASCII.
NAME_PATTERN = re.compile(r'[A-Za-z][A-Za-z0-9_]*')


class NodeNames(NamedTuple):
    """The names by which the marking finds the node of a lab."""

    packages: Tuple[str, ...]   # usual names of the student's package
    files: Tuple[str, ...]      # usual names of the node's file. This package uses the first name
    class_name: str             # the name of the node's class in the handout
    node_name: str              # the node's ROS name in the handout
    needed_topics: Tuple[str, ...]      # the node is ready when it listens to the first topic
    other_signs: Tuple[str, ...]    # other topics of a complete node, and its call for the reset


LAB_NODES = {
    IMU: NodeNames(('ice6',), ('imu_sub.py',), 'IMU', 'imu_sub', ('imu',), ()),
    TURN: NodeNames(('lab2',), ('turtlebot_controller.py',), 'Controller', 'controller', ('imu',),
                    ('mouse_info', 'cmd_vel')),
    MOVE2GOAL: NodeNames(('lab7_tf', 'lab7'), ('move2goal_tf.py', 'move2goal.py'), 'MoveToGoal',
                         'move_to_goal', ('odom', 'imu'), ('imu', 'cmd_vel', 'Service(')),
    GAMEPAD: NodeNames(('lab4_gamepad', 'lab7_tf', 'lab7'), ('gamepad.py',), 'Gamepad', 'gamepad',
                       ('joy',), ('cmd_vel', 'ctrl_relinq', 'ServiceProxy(')),
}


def is_valid_name(text: str) -> bool:
    """Returns True if ROS and Python allow `text` as the name of a package, a type or a field."""
    return NAME_PATTERN.fullmatch(text) is not None and not keyword.iskeyword(text)


def syntax_nodes_of(text: bytes) -> List[Any]:
    """Returns the elements of a program's syntax tree (``ast``), the module first. Returns [] if
    `text` is not valid Python, or is nested too deeply."""
    try:
        return list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []


OWN_PACKAGE = 'tb3_labs'
IDENTITY_VARIABLE = 'TB3_LABS_SUBMISSION'       # contains the identity of a trial
NODE_START_VARIABLE = 'TB3_LABS_NODE_START'     # contains the path of a file with a NodeStart
#: A program in a sandbox can write only into these folders.
SANDBOX_HOME = '/home/student'
WRITABLE_FOLDERS = '/tmp', SANDBOX_HOME, '/dev/shm'
#: This command starts a node, which dies when its parent process dies. `nice` gives the robot
#: priority over the node on a busy processor.
NODE_PREFIX = ['setpriv', '--pdeathsig', 'KILL', 'nice', '-n', '5']


class NodeStart(NamedTuple):
    """The data for the start of a node. mark.py writes them into a file, which the check reads."""

    prefix: Sequence[str] = NODE_PREFIX + LIMIT_FILES_COMMAND   # the command's first words
    environment: Optional[Dict[str, str]] = None        # None means the environment of this process
    types: Optional[Dict[str, Any]] = None      # the result of message_examples.py
    is_sandboxed: bool = False
    program: str = ''              # the node's path, or '' if rosrun must find the node
    name: str = ''                 # package/file, shown on the pages
    submission_folder: str = ''    # the folder of the submission

    @classmethod
    def from_environment(cls) -> 'NodeStart':
        """Returns the NodeStart that mark.py wrote, or the default, which has no sandbox."""
        if NODE_START_VARIABLE not in os.environ:
            return cls()
        return cls(*json.loads(Path(os.environ[NODE_START_VARIABLE]).read_text()))

    def write(self, path: Path) -> Dict[str, str]:
        """Write the NodeStart into a file. Returns {NODE_START_VARIABLE: path of the file}."""
        path.write_text(json.dumps(self))
        return {NODE_START_VARIABLE: str(path)}
