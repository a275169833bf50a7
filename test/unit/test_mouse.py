"""Mouse positions into velocities, by the numbers of the course's mouse lab."""
import pytest

from tb3_labs.nodes.controller.mouse import Mice, MouseState
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.events import IncomingMessage, LogQueue, Novelty


def hear(mouse, active, x, y, now, name='', stamp=0.0):
    """Give a message to `mouse`. Returns the reason of a stop, or an empty text."""
    return mouse.on_message(IncomingMessage(MouseState(active, x, y), now, name, sent_at=stamp))


def inactive_mouse(name=''):
    mouse = Mice(LogQueue())
    hear(mouse, False, 0.0, 0.0, 0.0, name)
    return mouse


@pytest.fixture
def lost():
    """A mouse that was lost while it was driving the robot."""
    mouse = inactive_mouse()
    hear(mouse, True, 0.9, 0.0, 0.0)
    mouse.lose(0.3)
    return mouse


@pytest.mark.parametrize('x, y, linear, angular', [
    (0.0, 0.0, 0.0, 0.0),
    (0.25, -0.25, 0.0, 0.0),          # the dead zone is closed
    (0.26, 0.0, 0.0, -0.13),          # right is clockwise
    (-0.5, 0.0, 0.0, 0.25),           # left is counter-clockwise
    (0.0, 0.5, 0.25, 0.0),            # up is forward
    (0.1, -1.0, -0.5, 0.0),           # straight back, although not quite in the middle
    (1.7, -3.0, -0.5, -0.5),          # a place beyond the edge of the screen is the edge
])
def test_the_speeds_of_a_mouse_position(x, y, linear, angular):
    mouse = inactive_mouse()
    hear(mouse, True, x, y, 0.1)
    hear(mouse, True, x, y, 0.2)
    assert mouse.twist == pytest.approx(Twist2(linear, angular))


@pytest.mark.parametrize('active, x', [(True, 0.0), (False, 0.9)])
def test_a_lost_mouse_comes_back_by_the_middle_or_a_deactivation(active, x, lost):
    assert not lost.is_active
    for now in (1.0, 1.1, 1.2, 1.3):
        hear(lost, True, 0.9, 0.0, now)
    assert not lost.is_active
    hear(lost, active, x, 0.0, 1.4)
    hear(lost, True, 0.9, 0.0, 1.5)
    assert lost.is_active and lost.twist != Twist2()


@pytest.mark.parametrize('active, x', [(True, 0.0), (False, 0.9)])
def test_messages_of_a_silence_do_not_bring_a_lost_mouse_back(active, x, lost):
    """The messages arrive together when the silence ends, and may be as old as the silence."""
    for k in range(20):
        hear(lost, active, x, 0.0, 5.0 + 0.001 * k)
    hear(lost, True, 0.9, 0.0, 5.1)
    assert not lost.is_active


def test_a_lost_mouse_drives_after_a_deactivation_and_a_later_activation(lost):
    hear(lost, False, 0.9, 0.0, 0.4)
    hear(lost, True, 0.9, 0.0, 5.0)
    assert lost.is_active


def two_active_mice():
    """Returns the Mouse with two active mice. The page was activated last."""
    mouse = inactive_mouse('mouse')
    hear(mouse, False, 0.0, 0.0, 0.0, 'page')
    for name in 'mouse', 'page':
        for k in range(8):
            hear(mouse, True, 0.0, 0.0, 1.0 + 0.05 * k, name)
    assert mouse.is_active
    return mouse


def test_a_deactivated_mouse_stops_the_other_mice_until_they_are_centred():
    mouse = two_active_mice()
    assert hear(mouse, False, 0.0, 0.0, 1.4, 'page') and not mouse.is_active
    hear(mouse, True, 0.9, 0.0, 1.45, 'mouse')
    assert not mouse.is_active
    for k in range(10):
        hear(mouse, True, 0.0, 0.0, 1.5 + 0.05 * k, 'mouse')
    hear(mouse, True, 0.9, 0.0, 2.0, 'mouse')
    assert mouse.is_active and mouse.twist != Twist2()


def test_a_lost_mouse_does_not_drive_beside_an_active_mouse():
    mouse = inactive_mouse('page')
    hear(mouse, True, 0.0, 0.0, 1.0, 'page')
    hear(mouse, True, 0.9, 0.0, 1.01, 'mouse')
    assert mouse.is_active and mouse.twist == Twist2()


def test_a_silent_mouse_stops_the_other_mouse():
    mouse = two_active_mice()
    for k in range(8):
        hear(mouse, True, 0.9, 0.0, 1.4 + 0.05 * k, 'mouse')
    assert mouse.lose_if_silent(1.75).startswith('no mouse for 0.4 s: move it')
    hear(mouse, True, 0.9, 0.0, 1.8, 'mouse')
    assert not mouse.is_active


def test_a_delayed_message_only_deactivates_a_mouse():
    mouse = inactive_mouse('laptop')
    assert not hear(mouse, True, 0.0, 0.0, 10.0, 'laptop', 510.0)
    assert mouse.is_active
    for k in range(5):                  # 0.3 s late
        hear(mouse, True, 0.0, 0.0, 10.4 + 0.05 * k, 'laptop', 510.1 + 0.05 * k)
        assert not mouse.is_active
    hear(mouse, True, 0.9, 0.0, 10.65, 'laptop', 510.65)
    assert not mouse.is_active
    for k in range(10):
        hear(mouse, True, 0.0, 0.0, 10.7 + 0.05 * k, 'laptop', 510.7 + 0.05 * k)
    assert mouse.is_active
    assert hear(mouse, False, 0.0, 0.0, 12.2, 'laptop', 511.2) and not mouse.is_active


@pytest.mark.parametrize('stamp, novelty, drives', [
    (0.0, Novelty.NEW, True), (510.0, Novelty.SAME_STAMP, False),
    (0.0, Novelty.SAME_STAMP, False)])     # with a simulated clock
def test_a_mouse_is_silent_if_its_driver_repeats_a_stamp(stamp, novelty, drives):
    mouse = inactive_mouse('laptop')
    for k in range(100):
        mouse.on_message(IncomingMessage(MouseState(True, 0.9, 0.0), 10.0 + 0.05 * k, 'laptop',
                                         novelty if k else Novelty.NEW, sent_at=stamp))
    assert (mouse.is_active and not mouse.lose_if_silent(15.0)) is drives
    assert mouse.on_message(IncomingMessage(MouseState(False, 0.9, 0.0), 15.0, 'laptop', novelty, sent_at=stamp))
