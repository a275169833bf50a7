"""How a gamepad node is tried out: the stage is the pad, and offers the reset."""
import rospy
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool

from tb3_labs.ros.marking.any_service import AnyService
from tb3_labs.ros.marking.hand import Hand
from tb3_labs.ros.marking.reset_caller import NAMES

LISTENS = 'joy'
#: The handout's numbering.
FORWARD, LEFT = 1, 3
A, B, Y = 0, 1, 2
#: A pad has so many; numbers beyond what the handout uses are always zero.
AXES, BUTTONS = 8, 11
#: How long a button is pressed [s], and how long Y is held.
PRESS, HOLD = 0.15, 0.6
#: A reset was called, or had failed, by then [s].
RESET_TIME = 2.5


class Pad:
    """The hand on the gamepad."""

    def __init__(self, stage):
        self._stage = stage
        self._hand = Hand('joy', Joy)
        self._buttons = [0] * BUTTONS
        self.sticks()

    def sticks(self, forward=0.0, left=0.0):
        """Hold the sticks there: -1 to 1."""
        self._axes = [0.0] * AXES
        self._axes[FORWARD], self._axes[LEFT] = forward, left
        self._show()

    def press(self, button, seconds=PRESS):
        """Press a button, and let it go."""
        for down, wait in ((1, seconds), (0, PRESS)):
            self._buttons[button] = down
            self._show()
            self._stage.wait(wait)

    def silence(self):
        """Pull its plug."""
        self._hand.hold(None)

    def close(self):
        """Put it away."""
        self._hand.close()

    def _show(self):
        self._hand.hold(Joy(axes=list(self._axes), buttons=list(self._buttons)))


def _reset(stage):
    package = stage.observation.node.split('/')[0]
    return AnyService(NAMES, ['std_srvs', 'tb3_labs', package])


def sticks(stage):
    """What the sticks command."""
    service = _reset(stage)
    if stage.start():
        pad = Pad(stage)
        stage.wait(0.5)
        for name, place in (('left stick up', (1.0, 0.0)), ('left stick half up', (0.5, 0.0)),
                            ('left stick down', (-1.0, 0.0)), ('right stick left', (0.0, 1.0)),
                            ('right stick right', (0.0, -1.0)), ('sticks let go', (0.0, 0.0))):
            with stage.stimulus(name):
                pad.sticks(*place)
                stage.wait(1.0)
        pad.close()
    service.close()


def buttons(stage):
    """A, the sticks, B, the sticks, Y; Ctrl+C while a stick drives."""
    service = _reset(stage)
    if stage.alive or stage.start():
        pad = Pad(stage)
        stage.wait(0.5)
        _hand_over(stage, pad)
        with stage.stimulus('Y') as record:
            pad.press(Y, HOLD)
            stage.wait_until(lambda: service.calls, RESET_TIME - HOLD)
            stage.wait(0.3)      # for what it prints
            record.facts.update(calls=len(service.calls), origin=all(service.calls))
        stage.ctrl_c_in_motion(lambda: _drive(stage, pad))
        pad.close()
    service.close()


def _drive(stage, pad):
    """Does a node, started if need be, drive by the stick? None if it does not run."""
    pad.sticks()
    if not stage.alive and not stage.start():
        return None
    stage.wait(0.5)
    begun = stage.now
    pad.sticks(1.0)
    stage.wait(0.5)
    return stage.moves(begun)


def _hand_over(stage, pad):
    """A, and back by B."""
    said = []
    listener = rospy.Subscriber('ctrl_relinq', Bool, lambda message: said.append(message.data))
    with stage.stimulus('A', relinquished=None, latched=False) as record:
        pad.press(A)
        stage.wait_until(lambda: True in said, 1.0)
        stage.wait(0.3)
        late = []
        latecomer = rospy.Subscriber('ctrl_relinq', Bool, lambda message: late.append(message))
        record.facts['latched'] = stage.wait_until(lambda: late, 1.0)
        record.facts['relinquished'] = said[-1] if said else None
        latecomer.unregister()
    with stage.stimulus('left stick up after A'):
        pad.sticks(1.0)
        stage.wait(1.0)
    pad.sticks()
    stage.wait(0.2)
    with stage.stimulus('B', relinquished=None) as record:
        pad.press(B)
        stage.wait_until(lambda: said and not said[-1], 1.0)
        record.facts['relinquished'] = said[-1] if said else None
    listener.unregister()
    stage.wait(0.3)
    with stage.stimulus('left stick up after B'):
        pad.sticks(1.0)
        stage.wait(0.7)
    pad.sticks()
    stage.wait(0.5)


def no_service(stage):
    """Y while nobody offers a reset, and a stick right after it."""
    stage.stop()
    if not stage.start():
        return
    pad = Pad(stage)
    stage.wait(0.5)
    with stage.stimulus('Y without a service'):
        pad.press(Y)
        pad.sticks(1.0)
        stage.wait(RESET_TIME)
    pad.close()


def lost(stage):
    """The pad falls silent while it drives."""
    pad = Pad(stage)
    moving = _drive(stage, pad)
    if moving is not None:
        with stage.stimulus('pad silent', was_moving=moving):
            pad.silence()
            stage.wait(2.0)
    pad.close()


PARTS = {'sticks': sticks, 'buttons': buttons, 'no service': no_service, 'lost': lost}
