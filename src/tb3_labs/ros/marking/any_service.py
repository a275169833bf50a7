"""A reset service that takes calls of any type, for nodes that bring a type of their own.

A client says by a checksum which type it means. The service looks for a type with that checksum in
the packages it was told of, and answers with success.
"""
import threading
from pathlib import Path

import rospy

from tb3_labs.marking.ros_internals import ServiceType, offer_any_service, service_types
from tb3_labs.ros.marking.requests import is_origin


def packages_with_services(packages):
    """The names of those packages of a rospkg.RosPack that have services, and of std_srvs, which
    Debian installs as a Python module alone."""
    return ['std_srvs'] + [name for name in packages.list()
                           if (Path(packages.get_path(name)) / 'srv').is_dir()]


class AnyService:
    """Services with these names; counts their calls, and notes whether each declared the origin."""

    def __init__(self, names, packages, more=()):
        """`packages`: names of the packages whose types are known; `more`: classes of others."""
        self._types = service_types(packages)
        self._types.update({kind._md5sum: ServiceType(kind._request_class, kind._response_class)
                            for kind in more})
        self._lock = threading.Lock()
        self._calls = []
        self._services = [offer_any_service(name, self._on_call) for name in names]

    @property
    def calls(self):
        """For each call so far: did it declare (0, 0, 0)? True also if its type is unknown."""
        with self._lock:
            return list(self._calls)

    def close(self):
        """Offer nothing any more."""
        for service in self._services:
            service.shutdown()

    def _on_call(self, checksum, data):
        kind = self._types.get(checksum)
        if kind is None:
            self._note(True)
            raise rospy.ServiceException('the type of this request is not known here')
        request = kind.request()
        request.deserialize(data)
        self._note(is_origin(request))
        response = kind.response()
        for name, value in (('success', True), ('message', 'reset')):
            if name in response.__slots__:
                setattr(response, name, value)
        return response

    def _note(self, origin):
        with self._lock:
            self._calls.append(origin)
