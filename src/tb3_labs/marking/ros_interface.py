"""The reset of a student's node, and a service for a student's call of a reset.

A student may define the type of the reset. Its fields are filled and read by their names, such as
x, pos_x, y, yaw, theta, heading, yaw_deg. A standard pose is possible too.

The private parts of rospy and genpy that the marking reads stand at the end, each behind one
function. They are known from the sources of rospy 1.15.15 and genpy 0.6.16 (Debian 12).
"""
import importlib
import math
import threading
from io import BytesIO
from pathlib import Path

import rospkg
import rospy
from rospy.msg import AnyMsg

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.move2goal import ANSWER_TIME
from tb3_labs.marking.ros_student_node import OFFERS
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_quaternion
from tb3_labs.ros.rospy_internals import connection_of

#: Name of a field of a request -> the part of a pose that it takes.
PLACES = {'x': 'x', 'pos_x': 'x', 'x_pos': 'x', 'x0': 'x', 'pose_x': 'x',
          'y': 'y', 'pos_y': 'y', 'y_pos': 'y', 'y0': 'y', 'pose_y': 'y'}
#: ALL: the parts of a pose that a request can take. UNIT: the unit of the request's yaw is known.
ALL, UNIT = frozenset({'x', 'y', 'yaw'}), 'unit'
ANGLES = ('yaw', 'theta', 'th', 'heading', 'angle', 'phi')
#: The reset's usual names by the handouts, likeliest first. Any other name with one of WORDS in it
#: comes after them.
NAMES = ('reset_pose', 'reset', 'set_pose', 'reset_local_pose', 'set_local_pose')
WORDS = ('reset', 'pose')


def fill_pose(request, pose):
    """Fill a Pose2 into the fields of a message that are meant for a pose.

    Returns the parts that were filled, of ALL, and UNIT. A yaw is filled in rad if its name does
    not end in '_deg'.
    """
    filled = set()
    for name, kind in zip(request.__slots__, request._slot_types):
        low, value = name.lower(), getattr(request, name)
        bare = low[:-4] if low.endswith(('_deg', '_rad')) else low
        if kind == 'geometry_msgs/Pose':
            value.position.x, value.position.y = pose.x, pose.y
            value.orientation = to_quaternion(pose.yaw)
            filled |= ALL | {UNIT}
        elif hasattr(value, '_slot_types') and kind not in ('std_msgs/Header', 'time', 'duration'):
            filled |= fill_pose(value, pose)
        elif not kind.startswith('float') or '[' in kind:
            continue
        elif low in PLACES:
            setattr(request, name, getattr(pose, PLACES[low]))
            filled.add(PLACES[low])
        elif bare in ANGLES:
            setattr(request, name, math.degrees(pose.yaw) if low.endswith('_deg') else pose.yaw)
            filled |= {'yaw', UNIT} if bare != low else {'yaw'}
    return filled


def is_origin(request):
    """Does a request declare (0, 0, 0), or no pose at all?"""
    for name, kind in zip(request.__slots__, request._slot_types):
        value = getattr(request, name)
        if hasattr(value, '_slot_types'):
            if kind != 'std_msgs/Header' and not is_origin(value):
                return False
        elif kind in ('float32', 'float64') and name != 'w' and abs(value) > 1e-6:
            return False
    return True


def is_unit(request):
    """Is every quaternion of a request a rotation, of length 1?"""
    for name, kind in zip(request.__slots__, request._slot_types):
        value = getattr(request, name)
        if kind == 'geometry_msgs/Quaternion':
            length = math.sqrt(value.x ** 2 + value.y ** 2 + value.z ** 2 + value.w ** 2)
            if not abs(length - 1.0) < 0.01:
                return False
        elif hasattr(value, '_slot_types') and not is_unit(value):
            return False
    return True


class ResetCaller:
    """The reset service of the node of a Graph; `found` is its name, '' if there is none."""

    def __init__(self, graph):
        bases = {name: name.rsplit('/', 1)[-1].lower() for name in graph.of_node(OFFERS)}
        likely = [name for name, base in bases.items() if any(word in base for word in WORDS)]
        usual = [name for wanted in NAMES for name in sorted(likely) if bases[name] == wanted]
        self.found = (usual + sorted(likely) + [''])[0]
        self._kind = graph.service(self.found) if self.found else None
        #: The parts of a pose that its request takes, as fill_pose() returns them.
        self.takes = set()
        if self._kind is not None:      # if unknown, call() returns the reason
            self.takes = fill_pose(self._kind._request_class(), Pose2())

    def call(self, pose):
        """Call the reset with a Pose2. Returns the reason why it failed, else ''."""
        if self._kind is None:
            return 'the type of {} cannot be loaded'.format(self.found)
        request = self._kind._request_class()
        fill_pose(request, pose)
        answers = []

        def ask():
            try:
                response = rospy.ServiceProxy(self.found, self._kind)(request)
                refused = getattr(response, 'success', True) is False
                answers.append('it was refused: {}'.format(getattr(response, 'message', ''))[:200]
                               if refused else '')
            except (rospy.ServiceException, rospy.ROSException, TypeError) as problem:
                answers.append(str(problem)[:200])
        threading.Thread(target=ask, daemon=True).start()
        if not wait_until(lambda: answers, ANSWER_TIME):
            return '{} did not answer within {:g} s'.format(self.found, ANSWER_TIME)
        return answers[0]


class AnyService:
    """Reset services with the names NAMES. They take calls of any type, and answer with success.

    The client's checksum tells the type: a type of a ROS package, or one of the student's.
    """

    def __init__(self, own):
        """`own`: classes of the student's services."""
        self._types = service_types()
        self._types.update({kind._md5sum: kind for kind in own})
        #: For each call so far: did it declare (0, 0, 0), and is its quaternion a rotation? Both are
        #: True also if its type is unknown.
        self.calls = []
        self._services = [offer_any_service(name, self._on_call) for name in NAMES]

    def close(self):
        for service in self._services:
            service.shutdown()

    def _on_call(self, checksum, data):
        kind = self._types.get(checksum)
        if kind is None:
            self.calls.append((True, True))
            raise rospy.ServiceException('the type of this request is not known here')
        request = kind._request_class()
        request.deserialize(data)
        self.calls.append((is_origin(request), is_unit(request)))
        response = kind._response_class()
        for name, value in (('success', True), ('message', 'reset')):
            if name in response.__slots__:
                setattr(response, name, value)
        return response


# -- private parts of rospy and genpy

def sender_of(subscriber, message):
    """The URI of the program that sent a message; '' if the connection has ended.

    The URI comes from the master, not from the sender. It is `endpoint_id` of the connection that
    has the message's header. If rospy renames it, an AttributeError ends the marking of a node at
    its first message.
    """
    header = connection_of(message)
    for connection in list(subscriber.impl.connections):
        if connection.header is header:
            return connection.endpoint_id
    return ''


def name_of_sender(message):
    """The name of a message's sender, as the sender says it."""
    return connection_of(message).get('callerid') or 'an unknown program'


def service_types():
    """Returns {checksum: class} of std_srvs and of all services of ROS packages that are built.

    std_srvs is named because Debian installs only its Python module. If genpy renames `_md5sum` or
    `_request_class`, no type is found, and every call is refused.
    """
    types, packages = {}, rospkg.RosPack()
    for package in ['std_srvs'] + [name for name in packages.list()
                                   if (Path(packages.get_path(name)) / 'srv').is_dir()]:
        try:
            module = importlib.import_module(package + '.srv')
        except ImportError:
            continue    # not built
        types.update({kind._md5sum: kind for kind in vars(module).values()
                      if hasattr(kind, '_request_class')})
    return types


class _AnySum(str):
    """Equal to the checksum of every type."""

    def __eq__(self, other):
        return True

    def __ne__(self, other):
        return False

    __hash__ = str.__hash__


class _AnyType:
    """Given to rospy in place of the class of a service."""

    _type = '*'
    _md5sum = _AnySum('*')
    _request_class = AnyMsg
    _response_class = AnyMsg


def offer_any_service(name, on_call):
    """Returns a rospy.Service that takes requests of any type.

    ``on_call(checksum, data)`` gets the checksum of the client's type and the bytes of its request,
    and returns the response, a message.

    A gamepad's call of its own service type fails if rospy no longer compares a client's checksum
    with `_md5sum`, or no longer passes on the header and the bytes of an AnyMsg.
    launch/checks/check_gamepad.test and test/ros/mark.test show it.
    """
    def answer(raw):
        response = on_call(connection_of(raw)['md5sum'], raw._buff)
        buffer, whole = BytesIO(), AnyMsg()
        response.serialize(buffer)
        whole.deserialize(buffer.getvalue())
        return whole
    return rospy.Service(name, _AnyType, answer)
