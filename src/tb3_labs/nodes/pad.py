"""What the sticks and buttons of a gamepad mean.

Units: axes from -1 to 1, forward and left positive (as joy_node sends them). Indices count from 0,
as in sensor_msgs/Joy; the defaults are the handout's numbering.
"""
import math
from dataclasses import dataclass
from typing import NamedTuple

from tb3_labs.config import Config, setting

#: No pad has as many axes or buttons.
MOST = 31


@dataclass(frozen=True)
class PadConfig(Config):
    """Which axis and which button does what."""

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


class PadState(NamedTuple):
    """A pad at one moment: sticks after their dead zone, and what is pressed."""

    forward: float = 0.0
    left: float = 0.0
    relinquish: bool = False
    regain: bool = False
    reset: bool = False
    hold: bool = False

    @property
    def at_rest(self):
        """Are both sticks in their middle?"""
        return self.forward == 0.0 and self.left == 0.0


def read_pad(axes, buttons, config):
    """The PadState of a message's axes and buttons; ``ValueError`` where it is no such pad."""
    needed_axes = 1 + max(config.linear_axis, config.angular_axis)
    needed_buttons = 1 + max(config.relinquish_button, config.regain_button, config.reset_button,
                             config.hold_button)
    if len(axes) < needed_axes or len(buttons) < needed_buttons:
        raise ValueError('{} axes and {} buttons, where the parameters need {} and {}: another '
                         'kind of pad?'.format(len(axes), len(buttons), needed_axes,
                                               needed_buttons))
    forward, left = axes[config.linear_axis], axes[config.angular_axis]
    if not (math.isfinite(forward) and math.isfinite(left)):
        raise ValueError('stick ({}, {}) is not finite'.format(forward, left))
    pressed = [bool(buttons[index]) for index in (
        config.relinquish_button, config.regain_button, config.reset_button)]
    hold = config.hold_button >= 0 and bool(buttons[config.hold_button])
    return PadState(_outside(config.dead_zone, forward), _outside(config.dead_zone, left),
                    *pressed, hold)


def _outside(dead_zone, position):
    """Rest inside the dead zone; from its edge evenly up to the full stick."""
    size = min(abs(position), 1.0)
    if size <= dead_zone:
        return 0.0
    return math.copysign((size - dead_zone) / (1.0 - dead_zone), position)
