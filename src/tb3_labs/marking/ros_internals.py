"""The private parts of rospy and genpy that the marking reads, each behind one function.

They are known from the sources of rospy 1.15.15 and genpy 0.6.16 (Debian 12). The private parts
that the nodes use are in :mod:`tb3_labs.ros.rospy_internals`.

A gamepad's call of its own service type fails if rospy no longer compares a client's checksum with
`_md5sum`, or no longer passes on the header and the bytes of an AnyMsg.
test/marking/check_gamepad.test and test/ros/mark.test show it.
"""
import importlib
from io import BytesIO
from pathlib import Path
from typing import Any, Callable, Dict

import rospkg
import rospy
from rospy.msg import AnyMsg

from tb3_labs.ros.rospy_internals import connection_of


def sender_of(subscriber: rospy.Subscriber, message: Any) -> str:
    """Returns the URI of the program that sent a message; '' if the connection has ended.

    The URI comes from the master, not from the sender. It is `endpoint_id` of the connection that
    has the message's header. If rospy renames it, an AttributeError ends the marking of a node at
    its first message.
    """
    header = connection_of(message)
    for connection in list(subscriber.impl.connections):
        if connection.header is header:
            return connection.endpoint_id
    return ''


def name_of_sender(message: Any) -> str:
    """Returns the name of a message's sender, as the sender says it."""
    return connection_of(message).get('callerid') or 'an unknown program'


def service_types(packages: rospkg.RosPack) -> Dict[str, Any]:
    """Returns {checksum: class} of std_srvs and of all services in these packages that are built.

    std_srvs is named because Debian installs only its Python module. If genpy renames `_md5sum` or
    `_request_class`, no type is found, and every call is refused.
    """
    types = {}
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

    def __eq__(self, other: object) -> bool:
        return True

    def __ne__(self, other: object) -> bool:
        return False

    __hash__ = str.__hash__


class _AnyType:
    """Given to rospy in place of the class of a service."""

    _type = '*'
    _md5sum = _AnySum('*')
    _request_class = AnyMsg
    _response_class = AnyMsg


def offer_any_service(name: str, on_call: Callable[[str, bytes], Any]) -> rospy.Service:
    """Returns a rospy.Service that takes requests of any type.

    ``on_call(checksum, data)`` gets the checksum of the client's type and the bytes of its request.
    ``on_call`` returns the response, a message.

    If rospy compares checksums in another way, each call is refused because of its type.
    """
    def answer(raw: AnyMsg) -> AnyMsg:
        response = on_call(connection_of(raw)['md5sum'], raw._buff)
        buffer, whole = BytesIO(), AnyMsg()
        response.serialize(buffer)
        whole.deserialize(buffer.getvalue())
        return whole
    return rospy.Service(name, _AnyType, answer)
