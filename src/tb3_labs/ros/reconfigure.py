"""Settings that change while a node runs: any Config behind dynamic_reconfigure.

What rqt_reconfigure and `dynparam` see (names, types, bounds, meanings) is built from the
configuration's own fields. Unlike dynamic_reconfigure's own server this one refuses a bad value,
with the reason, instead of silently moving it to the nearest bound; and it writes nothing to the
parameter server, so that a node that starts again starts as it was launched, without the faults
somebody switched on an hour ago.
"""
import math
from dataclasses import asdict, fields, replace
from types import SimpleNamespace

import roslib
import rospy

from tb3_labs.config import bounds_in_words

# dynamic_reconfigure asks rosdep for its own path while it is imported, of no use under catkin:
# where rosdep was never initialised that prints a line into every student's terminal.
_load_manifest, roslib.load_manifest = roslib.load_manifest, lambda package: None
try:
    from dynamic_reconfigure.server import Server
finally:
    roslib.load_manifest = _load_manifest

_TYPES = {bool: 'bool', int: 'int', float: 'double', str: 'str'}
_LOWEST = {bool: False, int: -2 ** 31, float: -math.inf, str: ''}
_HIGHEST = {bool: True, int: 2 ** 31 - 1, float: math.inf, str: ''}


class LiveSettings(Server):
    """Offers the fields of `config`, except those named in `fixed`.

    `apply` is called with each new configuration, in a thread of its own; it refuses by raising
    ``ValueError``. A refusal changes nothing.
    """

    def __init__(self, config, apply, fixed=()):
        self._current = config
        self._apply = apply
        offered = [item for item in fields(config) if item.name not in fixed]
        super().__init__(_description(config, offered), self._change)

    def _change(self, wanted, _level):
        """dynamic_reconfigure's callback: its settings in, those that hold out."""
        values = {name: value for name, value in wanted.items() if name != 'groups'}
        try:
            unknown = sorted(set(values) - set(self.type.defaults))
            if unknown:
                raise ValueError('{} cannot be changed here; these can: {}'.format(
                    ', '.join(unknown), ', '.join(sorted(self.type.defaults))))
            changed = replace(self._current, **values)
            if changed != self._current:
                self._apply(changed)
        except ValueError as problem:
            rospy.logwarn('not changed: %s', problem)
            raise rospy.ServiceException(str(problem)) from None
        for name, value in asdict(changed).items():
            if value != getattr(self._current, name):
                rospy.loginfo('%s is now %s', name, value)
        self._current = changed
        wanted.update({name: getattr(changed, name) for name in values})
        return wanted

    def _clamp(self, config):
        """Nothing: `_change` refuses."""

    def _copy_from_parameter_server(self):
        """Nothing: the configuration has been read."""

    def _copy_to_parameter_server(self):
        """Nothing: what is changed here lasts as long as the node."""


def _description(config, offered):
    """What dynamic_reconfigure's server expects of a module made from a .cfg file."""
    def values(choose):
        return {item.name: choose(item, type(item.default)) for item in offered}

    return SimpleNamespace(
        defaults=values(lambda item, kind: getattr(config, item.name)),
        min=values(lambda item, kind: _first(item.metadata['low'], _LOWEST[kind])),
        max=values(lambda item, kind: _first(item.metadata['high'], _HIGHEST[kind])),
        level=values(lambda item, kind: 0),
        config_description={
            'name': 'Default', 'type': '', 'state': True, 'id': 0, 'parent': 0, 'groups': [],
            'parameters': [{
                'name': item.name,
                'type': _TYPES[type(item.default)],
                'level': 0,
                'description': '{}: {}'.format(item.metadata['meaning'], bounds_in_words(item)),
                'edit_method': _choices(item),
            } for item in offered]})


def _first(bound, otherwise):
    return otherwise if bound is None else type(otherwise)(bound)


def _choices(item):
    """A list of choices, in the form rqt_reconfigure reads; empty where any value is valid."""
    choices = item.metadata['choices']
    if not choices:
        return ''
    kind = _TYPES[type(item.default)]
    return str({'enum_description': item.metadata['meaning'],
                'enum': [{'name': str(choice), 'value': choice, 'type': kind,
                          'description': ''} for choice in choices]})
