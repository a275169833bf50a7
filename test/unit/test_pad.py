"""Sticks and buttons of a pad, by the course's numbering and by others."""
import math

import pytest

from tb3_labs.handout import PAD_AXES, PAD_BUTTONS
from tb3_labs.nodes.gamepad.pad import PadConfig, PadListener, PadState, read_pad
from tb3_labs.supervision.control_holder import ControlMessages

AXES = [0.0] * PAD_AXES
BUTTONS = [0] * PAD_BUTTONS
CONFIG = PadConfig(dead_zone=0.1)


def axes(**values):
    return [values.get('a{}'.format(index), 0.0) for index in range(8)]


@pytest.mark.parametrize('position, speed', [
    (0.0, 0.0), (0.1, 0.0), (-0.1, 0.0), (1.0, 1.0), (-1.0, -1.0), (1.01, 1.0), (0.55, 0.5)])
def test_sticks_are_even_from_the_edge_of_their_dead_zone(position, speed):
    state = read_pad(axes(a1=position), BUTTONS, CONFIG)
    assert state.forward == pytest.approx(speed) and state.left == 0.0
    assert read_pad(axes(a3=position), BUTTONS, CONFIG).left == pytest.approx(speed)
    assert state.is_at_rest is (abs(position) <= 0.1)


OTHER = PadConfig(linear_axis=4, angular_axis=0, reset_button=7, hold_button=5)


@pytest.mark.parametrize('config, values, buttons, state', [
    (CONFIG, AXES, [1, 0, 0], PadState(relinquish=True)),
    (CONFIG, AXES, [0, 1, 0], PadState(regain=True)),
    (CONFIG, AXES, [0, 0, 1], PadState(reset=True)),
    (OTHER, [1.0, 0.0, 0.0, 0.0, -1.0], [0, 0, 0, 0, 0, 1, 0, 1],
     PadState(-1.0, 1.0, reset=True, hold=True))])
def test_the_handouts_numbers_and_those_of_another_pad(config, values, buttons, state):
    assert read_pad(values, buttons, config) == state._replace(axes=values, buttons=buttons)


@pytest.mark.parametrize('values, buttons, reason', [
    ([], [], 'need 4 and 3: another kind of pad'), ([0.0] * 3, BUTTONS, 'another kind of pad'),
    (AXES, [0, 0], 'another kind of pad'), (axes(a1=math.nan), BUTTONS, 'not finite'),
    (axes(a3=math.inf), BUTTONS, 'not finite')])
def test_another_pad_and_invalid_sticks_are_refused(values, buttons, reason):
    with pytest.raises(ValueError, match=reason):
        read_pad(values, buttons, CONFIG)


def test_in_the_first_message_only_the_stop_button_is_just_pressed():
    listener = PadListener()
    listener.on_message(read_pad(AXES, [1, 1, 1], CONFIG), 1.0, 0.0)
    presses = listener.presses
    assert presses.regain and not presses.relinquish and not presses.reset
    assert listener.state.regain and not listener.came_after_loss


@pytest.mark.parametrize('stamps, lateness', [((0.1, 0.2, 0.6), 0.5), ((0.0, 0.0, 0.0), 0.0)])
def test_after_a_loss_lateness_is_known_by_stamps_alone(stamps, lateness):
    """A stamp of 0.0 is no stamp: then a message may have waited during the loss."""
    listener = PadListener()
    for now, stamp in zip((1.0, 1.1), stamps):
        listener.on_message(read_pad(AXES, BUTTONS, CONFIG), now, stamp)
    listener.on_message(read_pad(AXES, BUTTONS, CONFIG), 2.0, stamps[2])
    assert listener.came_after_loss and listener.lateness == pytest.approx(lateness)
    assert listener.knows_lateness(2.0) is (lateness > 0.0)


def test_a_late_b_does_not_hide_a_later_stop():
    messages = ControlMessages()
    messages.stopped_at = 9.5        # by others
    messages.stop(9.0)
    assert messages.stopped_at == 9.5
