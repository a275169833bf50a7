"""The settings of a gamepad: the functions of its axes and buttons.

Indices count from 0, as in sensor_msgs/Joy. The defaults are the numbers of the course's gamepad
lab; the button Y comes from the handout.
"""
from dataclasses import dataclass

from tb3_labs.config import Config, setting

#: The highest index of an axis or button. No pad has as many.
MOST = 31


@dataclass(frozen=True)
class PadConfig(Config):
    """The functions of axes and buttons."""

    linear_axis: int = setting(1, 'axis that drives, forward positive', low=0, high=MOST)
    angular_axis: int = setting(3, 'axis that turns, left positive', low=0, high=MOST)
    relinquish_button: int = setting(0, 'gives the robot to move_to_goal: A', low=0, high=MOST)
    regain_button: int = setting(1, 'takes it back: B', low=0, high=MOST)
    reset_button: int = setting(2, 'declares the robot to be at (0, 0, 0): Y', low=0, high=MOST)
    hold_button: int = setting(-1, 'drives only while it is held; -1: none', low=-1, high=MOST)
    dead_zone: float = setting(0.08, 'sticks nearer to their middle are at rest', low=0.0, high=0.9)
    linear_scale: float = setting(0.26, "full stick; the robot's own limit holds as well", 'm/s',
                                  low=0.01, high=1.0)
    angular_scale: float = setting(2.84, "full stick; the robot's own limit holds as well", 'rad/s',
                                   low=0.05, high=5.0)
    drive_without_pad: bool = setting(
        False, 'move_to_goal may drive on when the pad is lost')

    @property
    def has_hold(self) -> bool:
        """Does the pad drive only while a button is held?"""
        return self.hold_button >= 0
