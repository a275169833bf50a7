"""The labs that can be marked."""
from typing import NamedTuple, Tuple

from tb3_labs.marking import gamepad, imu, move2goal, turn


class Lab(NamedTuple):
    """What a lab asks for, and what its node's file is called."""

    title: str
    criteria: list
    files: Tuple[str, ...]     # this package's own first

    @property
    def parts(self):
        """The parts of the lab, in which its criteria are tried."""
        return list(dict.fromkeys(criterion.part for criterion in self.criteria))


LABS = {
    'imu': Lab('IMU exercise', imu.CRITERIA, ('imu_sub.py',)),
    'turn': Lab('IMU lab', turn.CRITERIA, ('turtlebot_controller.py',)),
    'move2goal': Lab('Transformation lab, move to goal', move2goal.CRITERIA,
                     ('move2goal_tf.py', 'move2goal.py')),
    'gamepad': Lab('Transformation lab, gamepad', gamepad.CRITERIA, ('gamepad.py',)),
}
