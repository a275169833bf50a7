"""The scripts for a gamepad node: the marker plays the pad, and offers the reset."""
import time
from contextlib import closing
from pathlib import Path

import rospkg
import rospy
import yaml
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool

from tb3_labs.marking import gamepad as asked
from tb3_labs.marking.gamepad import HELD, RESET_TIME, SAYS
from tb3_labs.marking.observation import CTRL_RELINQ, JOY
from tb3_labs.marking.ros_interface import AnyService
from tb3_labs.marking.ros_robot import UNDER_WAY, Repeater
from tb3_labs.nodes.pad import PadConfig
from tb3_labs.ros.clocks import wait_until

#: A pad has this number of axes and of buttons; those without a function stay zero.
AXES, BUTTONS = 8, 11
#: A button is pressed for PRESS [s]; Y is held for HOLD [s].
PRESS, HOLD = 0.15, 0.6
#: A node that will drive has begun to drive within this time [s].
REACTION = 1.5
#: The pad that is played if none is named.
HANDOUT = 'handout'


def pad_called(name):
    """Returns the PadConfig of a pad; ``ValueError`` with the valid names if it is unknown."""
    folder = Path(rospkg.RosPack().get_path('tb3_labs')) / 'launch' / 'params'
    known = {path.stem[len('pad_'):]: path for path in folder.glob('pad_*.yaml')}
    if name not in known:
        raise ValueError('there is no pad {!r}; valid: {}'.format(name, ', '.join(sorted(known))))
    return PadConfig(**yaml.safe_load(known[name].read_text(encoding='utf-8')))


def pad_in_words(name):
    """Returns a sentence on the pad and the numbers of its axes and buttons."""
    pad = pad_called(name)
    return ('The pad was "{}": axis {} drives, axis {} turns; button {} is A, {} is B, '
            '{} is Y.').format(
        name, pad.linear_axis, pad.angular_axis, pad.relinquish_button, pad.regain_button,
        pad.reset_button)


class HeldPad(Repeater):
    """The gamepad of the marker; at first its sticks are in their middle."""

    def __init__(self, numbers):
        """`numbers`: the numbers of its axes and buttons, a PadConfig."""
        super().__init__(JOY, Joy)
        self.numbers = numbers
        self._buttons = [0] * BUTTONS
        self.sticks()
        self.wait_until_heard()

    def sticks(self, forward=0.0, left=0.0):
        """Hold the sticks at these values, each -1 to 1."""
        self._axes = [0.0] * AXES
        self._axes[self.numbers.linear_axis] = forward
        self._axes[self.numbers.angular_axis] = left
        self._show()

    def push(self, forward=0.0, left=0.0):
        """Hold the sticks in their middle until the node heard that, then at these values."""
        self.sticks()
        self.wait_until_heard()
        self.sticks(forward, left)

    def press(self, button, seconds=PRESS):
        """Press a button for this time [s], and let it go."""
        for down, held in ((1, seconds), (0, PRESS)):
            self._buttons[button] = down
            self._show()
            time.sleep(held)

    def _show(self):
        self.hold(Joy(axes=list(self._axes), buttons=list(self._buttons)))


def _reset_service(stage):
    return closing(AnyService(stage.node.graph.types.own_services()))


def _stick_up(stage, pad, name):
    with stage.stimulus(name):
        pad.sticks(1.0)
        time.sleep(HELD)
    pad.sticks()
    time.sleep(UNDER_WAY)


def sticks(stage):
    """The sticks at several places."""
    with _reset_service(stage):
        if not stage.node.start():
            return
        with HeldPad(stage.pad) as pad:
            for name, place in asked.PLACES.items():
                with stage.stimulus(name):
                    pad.sticks(*place)
                    time.sleep(HELD)


def buttons(stage):
    """A, the sticks, B, the sticks, Y; then Ctrl+C while a stick drives."""
    with _reset_service(stage) as service:
        if not stage.node.alive and not stage.node.start():
            return
        with HeldPad(stage.pad) as pad:
            _hand_over(stage, pad)
            with stage.stimulus(asked.RESET) as record:
                pad.press(pad.numbers.reset_button, HOLD)
                wait_until(lambda: service.calls, RESET_TIME - HOLD)
                time.sleep(UNDER_WAY)
                record.facts.update({asked.CALLS: len(service.calls),
                                     asked.ORIGIN: all(origin for origin, _ in service.calls),
                                     asked.UNIT: all(unit for _, unit in service.calls)})
            stage.ctrl_c_in_motion(lambda: _start_driving(stage, pad))


def _start_driving(stage, pad):
    pad.sticks()
    return stage.set_in_motion(lambda: stage.node.alive, lambda: pad.push(1.0), REACTION)


def _hand_over(stage, pad):
    said, late = [], []
    listener = rospy.Subscriber(CTRL_RELINQ, Bool, lambda message: said.append(message.data))
    with stage.stimulus(asked.HAND_OVER) as record:
        pad.press(pad.numbers.relinquish_button)
        wait_until(lambda: True in said, SAYS)
        time.sleep(UNDER_WAY)
        latecomer = rospy.Subscriber(CTRL_RELINQ, Bool, late.append)
        record.facts.update({asked.LATCHED: wait_until(lambda: late, SAYS),
                             asked.RELINQUISHED: said[-1] if said else None})
        latecomer.unregister()
    _stick_up(stage, pad, asked.UP_HANDED_OVER)
    with stage.stimulus(asked.TAKE_BACK) as record:
        pad.press(pad.numbers.regain_button)
        wait_until(lambda: said and not said[-1], SAYS)
        record.facts[asked.RELINQUISHED] = said[-1] if said else None
    listener.unregister()
    time.sleep(UNDER_WAY)
    _stick_up(stage, pad, asked.UP_TAKEN_BACK)


def no_service(stage):
    """Y while nobody offers a reset, and a stick right after it."""
    if not stage.node.start():
        return
    with HeldPad(stage.pad) as pad, stage.stimulus(asked.RESET_WITHOUT_SERVICE):
        pad.press(pad.numbers.reset_button)
        pad.sticks(1.0)
        time.sleep(RESET_TIME)


def lost(stage):
    """The pad falls silent while it drives."""
    with HeldPad(stage.pad) as pad:
        moving = _start_driving(stage, pad)
        if moving is not None:
            stage.falls_silent(asked.PAD_SILENT, moving, lambda: pad.hold(None))


PARTS = {asked.STICKS: sticks, asked.BUTTONS: buttons, asked.NO_SERVICE: no_service,
         asked.LOST: lost}
