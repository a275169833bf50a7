"""A service that takes calls of whatever type, for nodes that bring a type of their own.

A client says by a checksum which type it means. The server accepts each, looks for a type with
that checksum among the packages it was told of, and answers with success.
"""
import importlib
import io
import threading

import rospy
from rospy.msg import AnyMsg

from tb3_labs.ros.marking.requests import is_origin


class _AnySum(str):
    """Equal to the checksum of every type."""

    def __eq__(self, other):
        return True

    def __ne__(self, other):
        return False

    __hash__ = str.__hash__


class _AnyType:
    """Stands where rospy wants the class of a service."""

    _type = '*'
    _md5sum = _AnySum('*')
    _request_class = AnyMsg
    _response_class = AnyMsg


class AnyService:
    """Counts the calls of services with these names, and whether they declared the origin."""

    def __init__(self, names, packages):
        self._types = {}
        for package in packages:
            try:
                module = importlib.import_module(package + '.srv')
            except ImportError:
                continue    # not built, or it has none
            self._types.update({kind._md5sum: kind for kind in vars(module).values()
                                if hasattr(kind, '_request_class')})
        self._lock = threading.Lock()
        self._calls = []     # of each: did it declare the origin?
        self._services = [rospy.Service(name, _AnyType, self._on_call) for name in names]

    @property
    def calls(self):
        """For each call so far: did it declare (0, 0, 0)? True also where its type is unknown."""
        with self._lock:
            return list(self._calls)

    def close(self):
        """Offer nothing any more."""
        for service in self._services:
            service.shutdown()

    def _on_call(self, raw):
        kind = self._types.get(raw._connection_header['md5sum'])
        request = kind._request_class() if kind else None
        if request is not None:
            request.deserialize(raw._buff)
        with self._lock:
            self._calls.append(request is None or is_origin(request))
        if request is None:
            raise rospy.ServiceException('the type of this request is not known here')
        response = kind._response_class()
        for name, value in (('success', True), ('message', 'reset')):
            if name in response.__slots__:
                setattr(response, name, value)
        buffer = io.BytesIO()
        response.serialize(buffer)
        answer = AnyMsg()
        answer.deserialize(buffer.getvalue())
        return answer
