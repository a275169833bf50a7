"""The scripts for a gamepad node: the marker plays the pad, and offers the reset.

ResetServices uses private parts of rospy, by the source of rospy 1.15.15 (Debian 12). No other
program needs them.
"""
import math
import time
from functools import partial
from io import BytesIO
from types import SimpleNamespace

import rospy
from rospy.msg import AnyMsg
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, Empty

from tb3_labs.handout import CTRL_RELINQ, JOY, SET_POSE
from tb3_labs.marking.labs import gamepad as lab
from tb3_labs.marking.labs.criteria import LOST
from tb3_labs.marking.labs.ros_move2goal import NAMES, fields_of
from tb3_labs.marking.trial.ros_stimuli import UNDER_WAY, Repeater
from tb3_labs.nodes.gamepad.pad import PAD_AXES, PAD_BUTTONS
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.rospy_internals import connection_of

#: A button is pressed for PRESS [s]; Y is held for HOLD [s].
PRESS, HOLD = 0.15, 0.6


class HeldPad(Repeater):
    """The gamepad of the marker; at first its sticks are in their middle."""

    def __init__(self, numbers):
        """`numbers`: name -> number of its axes and buttons."""
        super().__init__(JOY, Joy)
        self.numbers = SimpleNamespace(**numbers)
        self._buttons = [0] * PAD_BUTTONS
        self.sticks()
        self.wait_for_subscriber()

    def sticks(self, forward=0.0, left=0.0):
        """Hold the sticks at these values, each -1 to 1."""
        self._axes = [0.0] * PAD_AXES
        self._axes[self.numbers.linear_axis] = forward
        self._axes[self.numbers.angular_axis] = left
        self._publish()

    def others(self, seconds=0.3):
        """Push each axis without a function for this time [s]."""
        used = self.numbers.linear_axis, self.numbers.angular_axis
        for number in sorted(set(range(PAD_AXES)) - set(used)):
            self._axes[number] = 1.0
            self._publish()
            time.sleep(seconds)
            self.sticks()

    def press(self, button, seconds=PRESS):
        """Press a button for this time [s], and release it."""
        for down, held in ((1, seconds), (0, PRESS)):
            self._buttons[button] = down
            self._publish()
            time.sleep(held)

    def _publish(self):
        self.hold(Joy(axes=list(self._axes), buttons=list(self._buttons)))


def _stick_up(trial, pad, name):
    trial.watch(name, lab.HELD, lambda: pad.sticks(1.0))
    pad.sticks()
    time.sleep(UNDER_WAY)


def sticks(trial):
    """Hold the sticks at several places."""
    with ResetServices(trial):
        trial.node.start()
        with HeldPad(trial.option) as pad:
            for name, place in lab.PLACES.items():
                trial.watch(name, lab.HELD, lambda: pad.sticks(*place))
            with trial.stimulus(lab.OTHER_AXES):
                pad.others()


def buttons(trial):
    """Press A, push a stick, press B, push a stick, press Y; then send Ctrl+C while a stick drives.
    """
    with ResetServices(trial) as services:
        calls = services.calls
        if not trial.node.alive:
            trial.node.start()
        with HeldPad(trial.option) as pad:
            _hand_over(trial, pad)
            with trial.stimulus(lab.RESET_BUTTON) as record:
                for names in ((SET_POSE,), NAMES):    # at first only the right name is offered
                    if calls:
                        break
                    services.offer(names)
                    pad.press(pad.numbers.reset_button, HOLD)
                    wait_until(lambda: calls, lab.RESET_TIME - HOLD)
                    time.sleep(UNDER_WAY)
                requests = [request for _, request in calls]
                record.facts.update({
                    lab.CALLS: len(calls), lab.NAME: calls[0][0] if calls else '',
                    lab.ORIGIN: all(map(is_origin, requests)),
                    lab.UNIT: all(map(is_unit, requests))})
            trial.remark(f'{received} See {lab.Y_STEP}.'
                         for received in trial.text()['remarks'])
            if not all(map(has_covariance, requests)):
                trial.remark(['The covariance of its reset is all zeros: TODO 4 is open.'])
            trial.ctrl_c_in_motion(lambda: _start_driving(trial, pad))


def _start_driving(trial, pad):
    def push():
        pad.sticks()
        pad.wait_for_subscriber()
        pad.sticks(1.0)
    pad.sticks()
    return trial.set_in_motion(lambda: trial.node.alive, push, 1.5)


def _hand_over(trial, pad):
    received, late = [], []
    listener = rospy.Subscriber(CTRL_RELINQ, Bool, lambda message: received.append(message.data))
    with trial.stimulus(lab.HAND_OVER) as record:
        pad.press(pad.numbers.relinquish_button)
        wait_until(lambda: True in received, lab.PUBLISH_TIME)
        time.sleep(UNDER_WAY)
        latecomer = rospy.Subscriber(CTRL_RELINQ, Bool, late.append)
        record.facts[lab.LATCHED] = wait_until(lambda: late, lab.PUBLISH_TIME)
        record.facts[lab.RELINQUISHED] = received[-1] if received else None
        latecomer.unregister()
    _stick_up(trial, pad, lab.UP_HANDED_OVER)
    received.clear()
    with trial.stimulus(lab.TAKE_BACK) as record:
        pad.press(pad.numbers.regain_button)
        wait_until(lambda: received and not received[-1], lab.PUBLISH_TIME)
        record.facts[lab.RELINQUISHED] = received[-1] if received else None
    listener.unregister()
    time.sleep(UNDER_WAY)
    _stick_up(trial, pad, lab.UP_TAKEN_BACK)


def no_service(trial):
    """Press Y while nobody offers a reset, and push a stick right after it."""
    trial.node.start()
    with HeldPad(trial.option) as pad, trial.stimulus(lab.RESET_WITHOUT_SERVICE):
        pad.press(pad.numbers.reset_button)
        pad.sticks(1.0)
        time.sleep(lab.RESET_TIME)


def lost(trial):
    """Let the pad fall silent while it drives."""
    with HeldPad(trial.option) as pad:
        trial.falls_silent(lab.PAD_SILENT, _start_driving(trial, pad), lambda: pad.hold(None))


PARTS = {lab.STICKS: sticks, lab.BUTTONS: buttons, lab.NO_SERVICE: no_service, LOST: lost}


# -- a reset service of any type

def is_origin(request):
    """Does a request declare the pose (0, 0, 0), or no pose?"""
    return all(abs(value) <= 1e-6 for name, kind, value in fields_of(request)
               if kind in ('float32', 'float64') and name != 'w')


def is_unit(request):
    """Is each quaternion of a request of length 1?"""
    return all(abs(math.sqrt(q.x ** 2 + q.y ** 2 + q.z ** 2 + q.w ** 2) - 1.0) < 0.01
               for _, kind, q in fields_of(request) if kind == 'geometry_msgs/Quaternion')


def has_covariance(request):
    """Is a number of each covariance of a request not zero?"""
    return all(any(value) for name, _, value in fields_of(request) if name == 'covariance')


class _AnySum(str):
    """A checksum that rospy takes for equal to each client's."""

    def __ne__(self, other):
        return False


#: The class of a service of any type, for rospy.
ANY_TYPE = SimpleNamespace(_type='*', _md5sum=_AnySum('*'), _request_class=AnyMsg,
                           _response_class=AnyMsg)


class ResetServices:
    """Reset services with the names NAMES, until the end of a ``with`` block. They accept calls of
    any type, and answer with success. `calls` has (name, request) of each call; an Empty stands for
    a request of an unknown type.

    The client's checksum shows the type. The fields of a student's own type are not read.
    A call of a student's own type fails if rospy no longer compares a client's checksum with
    `_md5sum`, or no longer hands over the header and the bytes of an AnyMsg.
    launch/checks/check_gamepad.test and test/ros/mark.test would show this.
    """

    def __init__(self, trial):
        self.calls, self._types, self._services = [], trial.node.graph.types.by_sum(), {}
        self._recording = trial.recording
        self.offer(NAMES)

    def __enter__(self):
        return self

    def __exit__(self, *problem):
        self.offer(())

    def offer(self, names):
        """Offer services of these names; end all others."""
        for name in set(self._services) - set(names):
            self._services.pop(name).shutdown()
        for name in set(names) - set(self._services):
            self._services[name] = rospy.Service(name, ANY_TYPE, partial(self._on_call, name))

    def _on_call(self, name, raw):
        kind = self._types.get(connection_of(raw)['md5sum'])
        if kind is None:
            self.calls.append((name, Empty()))
            raise rospy.ServiceException('the type of this request is not known here')
        request = kind._request_class().deserialize(raw._buff)
        self.calls.append((name, request))
        self._recording.event('call', service=name, of=kind._type, request=str(request))
        response, buffer = kind._response_class(), BytesIO()
        for name, value in (('success', True), ('message', 'reset')):
            if name in response.__slots__:
                setattr(response, name, value)
        response.serialize(buffer)
        return AnyMsg().deserialize(buffer.getvalue())
