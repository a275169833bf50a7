"""Lets a user change settings of a running node, by dynparam or in rqt_reconfigure.

LiveSettings replaces the Python server of dynamic_reconfigure 1.7.3 (Debian 12). That server
silently clips an invalid value to the nearest bound, so no callback can refuse the value. The
server also writes each change to the parameter server, so a simulated fault would be present after
the next start. The import of the server calls rosdep, which may print a line. Test:
test/ros/live_test.py.
"""
import threading
from dataclasses import asdict, fields, replace

import rospy
from dynamic_reconfigure.msg import (
    BoolParameter, ConfigDescription, DoubleParameter, Group, GroupState, IntParameter,
    ParamDescription, StrParameter)
from dynamic_reconfigure.msg import Config as Values
from dynamic_reconfigure.srv import Reconfigure

from tb3_labs.config import spelling_hint, valid_values_text
from tb3_labs.ros.node import guarded

#: {type of a setting: name of the type in dynamic_reconfigure}
_TYPES = {bool: 'bool', float: 'double'}
_GROUP = 'Default'    # the name of the group that contains all settings


class LiveSettings:
    """Offers the fields of `config` to the user, except the fields whose names are in `fixed`. Each
    offered field is a float or a bool. A thread of rospy calls `apply_config` with each new Config.
    If `apply_config` raises ValueError, the user's change is refused."""

    def __init__(self, config, apply_config, fixed=()):
        self._current = config
        self._apply_config = apply_config
        self._offered_fields = [item for item in fields(config) if item.name not in fixed]
        self._lock = threading.Lock()    # guards changes
        descriptions = rospy.Publisher('~parameter_descriptions', ConfigDescription, queue_size=10,
                                       latch=True)
        self._updates = rospy.Publisher('~parameter_updates', Values, queue_size=10, latch=True)
        descriptions.publish(_description(config, self._offered_fields))
        self._updates.publish(self._message())
        rospy.Service('~set_parameters', Reconfigure, guarded(self._on_request))

    def _on_request(self, request):
        with self._lock:
            self._change(decode(request.config))
            message = self._message()
            self._updates.publish(message)
        return message

    def _change(self, values):
        """Apply {name: value}. Raises ServiceException with the reason if the change is refused."""
        try:
            names = [item.name for item in self._offered_fields]
            unknown = sorted(set(values) - set(names))
            if unknown:
                raise ValueError(f'{unknown[0]} cannot be changed while the node runs; '
                                 + spelling_hint(unknown[0], names))
            changed = replace(self._current, **values)
            if changed != self._current:
                self._apply_config(changed)
        except ValueError as error:
            rospy.logwarn('not changed: %s', error)
            raise rospy.ServiceException(str(error)) from None

        for name, value in asdict(changed).items():
            if value != getattr(self._current, name):
                rospy.loginfo('%s is now %s', name, value)
        self._current = changed

    def _message(self):
        values = {item.name: getattr(self._current, item.name) for item in self._offered_fields}
        return encode(values, [GroupState(name=_GROUP, state=True)])


def encode(values, groups=()):
    """Returns the dynamic_reconfigure/Config of {name: value}."""
    def of_type(value_type, message_type):
        return [message_type(name, value) for name, value in values.items()
                if type(value) is value_type]

    return Values(bools=of_type(bool, BoolParameter), ints=of_type(int, IntParameter),
                  strs=of_type(str, StrParameter), doubles=of_type(float, DoubleParameter),
                  groups=list(groups))


def decode(message):
    """Returns {name: value} of a dynamic_reconfigure/Config."""
    return {item.name: item.value
            for item in message.bools + message.ints + message.strs + message.doubles}


def _description(config, offered_fields):
    parameters = [ParamDescription(
        name=item.name, type=_TYPES[type(item.default)],
        description=f'{item.metadata["meaning"]}: {valid_values_text(item)}')
        for item in offered_fields]
    return ConfigDescription(
        groups=[Group(name=_GROUP, parameters=parameters)],
        max=_bounds(offered_fields, 'high', bool_bound=True),
        min=_bounds(offered_fields, 'low', bool_bound=False),
        dflt=encode({item.name: getattr(config, item.name) for item in offered_fields}))


def _bounds(offered_fields, bound_key, bool_bound):
    return encode({
        item.name: bool_bound if type(item.default) is bool else item.metadata[bound_key]
        for item in offered_fields})
