"""A page's pad is the pad that the node gamepad was started with."""
import pytest

from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.panel.joy import joy_of
from tb3_labs.panel.requests import Pad


def pressed(pad, config):
    return [number for number, state in enumerate(joy_of(pad, config)[1]) if state]


def test_with_the_handouts_numbers():
    """Axis 1 drives, axis 3 turns; A, B and Y are the buttons 0, 1 and 2."""
    axes, buttons = joy_of(Pad(0.5, -0.25, a=True, y=True), PadConfig())
    assert axes == [0.0, 0.5, 0.0, -0.25, 0.0, 0.0, 0.0, 0.0]
    assert buttons == [1, 0, 1] + [0] * 8


def test_a_pad_at_rest_is_a_pad_of_the_usual_size():
    assert joy_of(Pad(), PadConfig()) == ([0.0] * 8, [0] * 11)


@pytest.mark.parametrize('button, number', [('a', 4), ('b', 9), ('y', 0), ('hold', 7)])
def test_each_button_has_the_number_of_its_function(button, number):
    config = PadConfig(relinquish_button=4, regain_button=9, reset_button=0, hold_button=7)
    assert pressed(Pad(**{button: True}), config) == [number]


def test_a_pad_without_a_hold_button_says_nothing_of_a_grip():
    assert pressed(Pad(hold=True), PadConfig()) == []
    assert joy_of(Pad(hold=True), PadConfig()) == joy_of(Pad(), PadConfig())


@pytest.mark.parametrize('linear, angular', [(31, 0), (0, 31), (8, 9), (7, 6)])
def test_axes_of_any_number(linear, angular):
    axes, _ = joy_of(Pad(0.5, -0.25), PadConfig(linear_axis=linear, angular_axis=angular))
    assert len(axes) == max(8, linear + 1, angular + 1)
    assert {number: axis for number, axis in enumerate(axes) if axis} == {
        linear: 0.5, angular: -0.25}


@pytest.mark.parametrize('number', [10, 11, 31])
def test_buttons_of_any_number(number):
    _, buttons = joy_of(Pad(b=True), PadConfig(regain_button=number))
    assert len(buttons) == max(11, number + 1) and buttons[number] == 1 and sum(buttons) == 1
    assert set(map(type, buttons)) == {int}        # as sensor_msgs/Joy has them
