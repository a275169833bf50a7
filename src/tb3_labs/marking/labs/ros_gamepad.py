"""Scripts for the trials of a gamepad node. The marker imitates the gamepad and offers the reset
services. ResetServices uses private parts of rospy 1.15.15 (Debian 12)."""
import math
import time
from contextlib import AbstractContextManager
from functools import partial
from io import BytesIO
from types import SimpleNamespace

import rospy
from rospy.msg import AnyMsg
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, Empty

from tb3_labs.handout import CTRL_RELINQ_TOPIC, JOY_TOPIC, PAD_AXES, PAD_BUTTONS, SET_POSE_SERVICE
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.gamepad import Y_STEP
from tb3_labs.marking.labs.ros_move2goal import RESET_NAMES, fields_of
from tb3_labs.marking.trial.ros_stimuli import DELIVERY_TIME, Repeater
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.rospy_internals import connection_of

PRESS_TIME = 0.15          # [s]
Y_PRESS_TIME = 0.6         # If Y is down so long [s], a wrong node may call the reset twice.
MAX_ROUNDING = 1e-6        # A number in a pose counts as zero up to this value.
MAX_LENGTH_ERROR = 0.01    # of a quaternion, because a node may round its numbers


class HeldPad(Repeater):
    """The gamepad that the marker imitates. At first the sticks are in the middle."""

    def __init__(self, numbers):
        """`numbers` is {name of an axis or a button: number}."""
        super().__init__(JOY_TOPIC, Joy)
        self.numbers = SimpleNamespace(**numbers)
        self._buttons = [0] * PAD_BUTTONS
        self.hold_sticks()
        self.wait_for_subscriber()

    def hold_sticks(self, forward=0.0, left=0.0):
        """Move the sticks to these values, each from -1 to 1, and hold them there."""
        self._axes = [0.0] * PAD_AXES
        self._axes[self.numbers.linear_axis] = forward
        self._axes[self.numbers.angular_axis] = left
        self._publish()

    def press(self, button, seconds=PRESS_TIME):
        """Press a button for `seconds` [s] and release it."""
        for is_down, duration in ((1, seconds), (0, PRESS_TIME)):
            self._buttons[button] = is_down
            self._publish()
            time.sleep(duration)

    def _publish(self):
        self.hold(Joy(axes=list(self._axes), buttons=list(self._buttons)))


def _push_stick_up(trial, pad, name):
    trial.observe(name, stimuli.STICK_HOLD_TIME, partial(pad.hold_sticks, forward=1.0))
    pad.hold_sticks()
    time.sleep(DELIVERY_TIME)


def try_sticks(trial):
    with ResetServices(trial):
        trial.node.start()
        with HeldPad(trial.pad) as pad:
            for name, place in stimuli.STICK_POSITIONS.items():
                trial.observe(name, stimuli.STICK_HOLD_TIME, partial(pad.hold_sticks, *place))


def try_buttons(trial):
    """Press A, push a stick, press B, push a stick, and press Y. Then send Ctrl+C while a stick
    drives the robot."""
    with ResetServices(trial) as services:
        if not trial.node.is_alive:
            trial.node.start()
        with HeldPad(trial.pad) as pad:
            _try_hand_over(trial, pad)
            requests = _try_reset_button(trial, pad, services)
            remarks = trial.source_findings()['remarks']
            trial.add_remarks(f'{remark} See {Y_STEP}.' for remark in remarks)
            if not all(map(has_covariance, requests)):
                trial.add_remarks(['The covariance of its reset is all zeros: TODO 4 is open.'])
            trial.send_ctrl_c_in_motion(partial(_start_driving, trial, pad))


def _try_reset_button(trial, pad, services):
    """Press Y and return the requests of the node. If the node does not call the service with the
    right name, offer all RESET_NAMES and press Y again."""
    calls = services.calls
    with trial.stimulus(stimuli.RESET_BUTTON) as stimulus:
        for names in ((SET_POSE_SERVICE,), RESET_NAMES):
            if calls:
                break
            services.offer(names)
            pad.press(pad.numbers.reset_button, Y_PRESS_TIME)
            wait_until(lambda: calls, stimuli.CALL_AFTER_Y_TIME - Y_PRESS_TIME)
            time.sleep(DELIVERY_TIME)
        called_names = [name for name, _ in calls]
        requests = [request for _, request in calls]
        stimulus.facts.update({
            stimuli.CALL_COUNT: len(calls),
            stimuli.SERVICE_NAME: called_names[0] if called_names else '',
            stimuli.IS_ORIGIN: all(map(is_origin, requests)),
            stimuli.NONZERO_FIELDS: [nonzero_fields(request) for request in requests],
            stimuli.IS_UNIT: all(map(is_unit, requests))})
    return requests


def _start_driving(trial, pad):
    def push_stick_up():
        pad.hold_sticks()
        pad.wait_for_subscriber()
        pad.hold_sticks(forward=1.0)
    pad.hold_sticks()
    return trial.set_in_motion(lambda: trial.node.is_alive, push_stick_up, 1.5)


def _try_hand_over(trial, pad):
    values = [None]
    late_values = []
    subscriber = rospy.Subscriber(
        CTRL_RELINQ_TOPIC, Bool, lambda message: values.append(message.data))
    with trial.stimulus(stimuli.HAND_OVER) as stimulus:
        pad.press(pad.numbers.relinquish_button)
        wait_until(lambda: True in values, stimuli.PUBLISH_TIME)
        time.sleep(DELIVERY_TIME)
        late_subscriber = rospy.Subscriber(CTRL_RELINQ_TOPIC, Bool, late_values.append)
        stimulus.facts[stimuli.IS_LATCHED] = wait_until(lambda: late_values, stimuli.PUBLISH_TIME)
        stimulus.facts[stimuli.RELINQ_VALUE] = values[-1]
        late_subscriber.unregister()
    _push_stick_up(trial, pad, stimuli.STICK_UP_AFTER_A)
    values.append(None)
    with trial.stimulus(stimuli.TAKE_BACK) as stimulus:
        pad.press(pad.numbers.regain_button)
        wait_until(lambda: values[-1] is False, stimuli.PUBLISH_TIME)
        stimulus.facts[stimuli.RELINQ_VALUE] = values[-1]
    subscriber.unregister()
    time.sleep(DELIVERY_TIME)
    _push_stick_up(trial, pad, stimuli.STICK_UP_AFTER_B)


def try_reset_without_service(trial):
    """Press Y while no reset service exists. Push a stick after Y is released."""
    trial.node.start()
    with HeldPad(trial.pad) as pad, trial.stimulus(stimuli.RESET_WITHOUT_SERVICE):
        pad.press(pad.numbers.reset_button)
        pad.hold_sticks(1.0)
        time.sleep(stimuli.CALL_AFTER_Y_TIME)


def try_lost_pad(trial):
    """End the messages of the gamepad while a stick drives the robot."""
    with HeldPad(trial.pad) as pad:
        trial.silence_device(stimuli.PAD_SILENT, _start_driving(trial, pad), lambda: pad.hold(None))


PARTS = {stimuli.STICKS: try_sticks, stimuli.BUTTONS: try_buttons,
         stimuli.NO_SERVICE: try_reset_without_service, stimuli.DEVICE_LOST: try_lost_pad}


# -- a reset service of any type

def nonzero_fields(request):
    """Returns texts such as 'pose.position.x is 1' on the numbers in a request that must be 0 for
    the pose (0, 0, 0)."""
    return [f'{name} is {value:.3g}' for name, type_name, value in fields_of(request)
            if type_name in ('float32', 'float64') and name.split('.')[-1] != 'w'
            and not abs(value) <= MAX_ROUNDING]     # `not`, so that a NaN counts, too


def is_origin(request):
    """Returns True if the pose in a request is (0, 0, 0), or if the request has no pose."""
    return not nonzero_fields(request)


def is_unit(request):
    """Returns True if each quaternion in a request has the length 1."""
    lengths = [math.hypot(value.x, value.y, value.z, value.w)
               for _, type_name, value in fields_of(request)
               if type_name == 'geometry_msgs/Quaternion']
    return all(abs(length - 1.0) < MAX_LENGTH_ERROR for length in lengths)


def has_covariance(request):
    """Returns True if each covariance in a request has a number that is not zero."""
    return all(any(value) for name, _, value in fields_of(request) if name.endswith('covariance'))


class _AnySum(str):
    """A checksum that equals every other checksum, so that rospy accepts every client."""

    def __ne__(self, other):
        return False


#: This object replaces the class of a service, so that rospy accepts clients of any type.
ANY_TYPE = SimpleNamespace(_type='*', _md5sum=_AnySum('*'), _request_class=AnyMsg,
                           _response_class=AnyMsg)


class ResetServices(AbstractContextManager):
    """Offers the reset services RESET_NAMES, until the end of a ``with`` block.

    The services accept requests of any type. The client's checksum shows the type. A request of a
    known type succeeds, and a request of an unknown type fails. `calls` is a list of (name,
    request), in which an Empty replaces a request of an unknown type.
    """

    def __init__(self, trial):
        self.calls = []
        self._types = trial.node.graph.types.services_by_checksum()
        self._services = {}
        self._bag = trial.bag
        self.offer(RESET_NAMES)

    def __exit__(self, *exception):
        self.offer(())

    def offer(self, names):
        """Offer the services `names` and end all other reset services."""
        for name in set(self._services) - set(names):
            self._services.pop(name).shutdown()
        for name in set(names) - set(self._services):
            self._services[name] = rospy.Service(name, ANY_TYPE, partial(self._on_call, name))

    def _on_call(self, name, raw):
        service_class = self._types.get(connection_of(raw)['md5sum'])
        if service_class is None:
            self.calls.append((name, Empty()))
            raise rospy.ServiceException('the type of this request is not known here')
        request = service_class._request_class().deserialize(raw._buff)
        self.calls.append((name, request))
        self._bag.add_event('call', service=name, of=service_class._type, request=str(request))
        response = service_class._response_class()
        for field, value in (('success', True), ('message', 'reset')):
            if field in response.__slots__:
                setattr(response, field, value)
        buffer = BytesIO()
        response.serialize(buffer)
        return AnyMsg().deserialize(buffer.getvalue())
