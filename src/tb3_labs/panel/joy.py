"""The pad of a page as the node `gamepad` expects a pad: its axes and buttons, by number.

The numbers are those of the node's own parameters (PadConfig), so a page needs no numbers of any
make, whatever `pad:=` the node was started with.
"""
from typing import List, Tuple

from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.panel.requests import Pad

#: Axes and buttons of the most common pad: nodes of students may look at any of them.
AXES, BUTTONS = 8, 11


def joy_of(pad: Pad, config: PadConfig) -> Tuple[List[float], List[int]]:
    """(axes, buttons) of a sensor_msgs/Joy: axes from -1 to 1, forward and left positive."""
    axes = [0.0] * max(AXES, 1 + config.linear_axis, 1 + config.angular_axis)
    axes[config.linear_axis] = pad.forward
    axes[config.angular_axis] = pad.left
    functions = {config.relinquish_button: pad.a, config.regain_button: pad.b,
                 config.reset_button: pad.y}
    if config.has_hold:
        functions[config.hold_button] = pad.hold
    buttons = [0] * max(BUTTONS, 1 + max(functions))
    for number, pressed in functions.items():
        buttons[number] = int(pressed)
    return axes, buttons
