"""The labs that can be marked."""
from typing import List, NamedTuple, Tuple

from tb3_labs.marking import gamepad, imu, move2goal, observation, turn
from tb3_labs.marking.criteria import Criterion

#: The names of the labs.
IMU, TURN, MOVE2GOAL, GAMEPAD = 'imu', 'turn', 'move2goal', 'gamepad'


class Lab(NamedTuple):
    """The requirements of a lab, and the names by which its node is found."""

    title: str
    criteria: List[Criterion]
    packages: Tuple[str, ...]  # usual names of the student's package
    files: Tuple[str, ...]     # usual names of the node's file, that of this package first
    class_name: str            # the handout's name of the class
    node_name: str             # the handout's name of the node
    listens: str               # the topic that a node must listen to before it is ready

    @property
    def parts(self) -> List[str]:
        """The parts of the lab, in which its criteria are tried."""
        return list(dict.fromkeys(criterion.part for criterion in self.criteria))

    def checked_parts(self, text: str) -> List[str]:
        """The parts in a list with commas; ``ValueError`` for a part that the lab does not have."""
        parts = [part.strip() for part in text.split(',') if part.strip()]
        if not set(parts) <= set(self.parts):
            raise ValueError('{} has these parts: {}; not: {}'.format(
                self.title, ', '.join(self.parts), ', '.join(sorted(set(parts) - set(self.parts)))))
        return parts


LABS = {
    IMU: Lab('IMU exercise', imu.CRITERIA, ('ice6',), ('imu_sub.py',), 'IMU', 'imu_sub',
             observation.IMU),
    TURN: Lab('IMU lab', turn.CRITERIA, ('lab2',), ('turtlebot_controller.py',), 'Controller',
              'controller', observation.IMU),
    MOVE2GOAL: Lab('Transformation lab, move to goal', move2goal.CRITERIA, ('lab7_tf', 'lab7'),
                    ('move2goal_tf.py', 'move2goal.py'), 'MoveToGoal', 'move_to_goal',
                    observation.ODOM),
    GAMEPAD: Lab('Transformation lab, gamepad', gamepad.CRITERIA,
                 ('lab4_gamepad', 'lab7_tf', 'lab7'), ('gamepad.py',), 'Gamepad', GAMEPAD,
                 observation.JOY),
}
