"""Settings that change while a node runs: any Config, by dynamic_reconfigure's messages.

A node offers them by LiveSettings. A person changes them by the program below (HELP), or in
rqt_reconfigure.

dynamic_reconfigure 1.7.3 (Debian 12) has a Python server and a dynparam of its own. They are not
used because of measured defects (test/ros/parameters_test.py shows that this file has none):
- The server clips an invalid value to the nearest bound without a word. Here the node refuses it.
- The server writes each change to the parameter server. So a node that starts again begins with
  the faults that were switched on before.
- Its import asks rosdep, which prints a line in every terminal if rosdep was not initialised.
- dynparam shows a refusal as a traceback of 28 lines, and waits for ever for an unknown node.
"""
import math
import re
import sys
import threading
from dataclasses import asdict, fields, replace

import rosgraph
import rospy
import yaml
from dynamic_reconfigure.msg import (
    BoolParameter, ConfigDescription, DoubleParameter, Group, GroupState, IntParameter,
    ParamDescription, StrParameter)
from dynamic_reconfigure.msg import Config as Values
from dynamic_reconfigure.srv import Reconfigure

from tb3_labs.config import bounds_in_words, nearest

_TYPES = {bool: 'bool', int: 'int', float: 'double', str: 'str'}
_LOWEST = {bool: False, int: -2 ** 31, float: -math.inf, str: ''}
_HIGHEST = {bool: True, int: 2 ** 31 - 1, float: math.inf, str: ''}
#: The group that all settings are in.
_GROUP = 'Default'


class LiveSettings:
    """Offers the fields of `config`, except those named in `fixed`.

    `apply` is called with each new configuration, in a thread of its own; it may refuse it by a
    ``ValueError``.
    """

    def __init__(self, config, apply, fixed=()):
        self._current = config
        self._apply = apply
        self._offered = [item for item in fields(config) if item.name not in fixed]
        self._lock = threading.Lock()    # one change after the other
        descriptions = rospy.Publisher('~parameter_descriptions', ConfigDescription, queue_size=10,
                                       latch=True)
        self._updates = rospy.Publisher('~parameter_updates', Values, queue_size=10, latch=True)
        descriptions.publish(_description(config, self._offered))
        self._updates.publish(self._message())
        rospy.Service('~set_parameters', Reconfigure, self._on_request)

    def _on_request(self, request):
        with self._lock:
            self._change(decoded(request.config))
            message = self._message()
            self._updates.publish(message)
            return message

    def _change(self, values):
        """Apply {name: value}. Raises ServiceException with the reason if it is refused."""
        try:
            names = [item.name for item in self._offered]
            unknown = sorted(set(values) - set(names))
            if unknown:
                raise ValueError('{} cannot be changed while the node runs; {}'.format(
                    unknown[0], nearest(unknown[0], names)))
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

    def _message(self):
        return encoded({item.name: getattr(self._current, item.name) for item in self._offered},
                       [GroupState(name=_GROUP, state=True)])


def encoded(values, groups=()):
    """Returns the dynamic_reconfigure/Config of {name: value}."""
    def of(kind, message):
        return [message(name, value) for name, value in values.items() if type(value) is kind]

    return Values(of(bool, BoolParameter), of(int, IntParameter), of(str, StrParameter),
                  of(float, DoubleParameter), list(groups))


def decoded(message):
    """Returns {name: value} of a dynamic_reconfigure/Config."""
    return {item.name: item.value
            for item in message.bools + message.ints + message.strs + message.doubles}


def _description(config, offered):
    """Returns the dynamic_reconfigure/ConfigDescription of the fields `offered` of `config`."""
    parameters = [ParamDescription(
        name=item.name, type=_TYPES[type(item.default)],
        description='{}: {}'.format(item.metadata['meaning'], bounds_in_words(item)),
        edit_method=_choices(item)) for item in offered]
    return ConfigDescription(
        groups=[Group(name=_GROUP, parameters=parameters)],
        max=_bounds(offered, 'high', _HIGHEST), min=_bounds(offered, 'low', _LOWEST),
        dflt=encoded({item.name: getattr(config, item.name) for item in offered}))


def _bounds(offered, which, widest):
    """Returns the dynamic_reconfigure/Config of the bounds `which` ('low' or 'high'); a field
    without one has the `widest` of its type."""
    bounds = {}
    for item in offered:
        kind, bound = type(item.default), item.metadata[which]
        bounds[item.name] = widest[kind] if bound is None else kind(bound)
    return encoded(bounds)


def _choices(item):
    """Returns the choices of a field as rqt_reconfigure reads them; '' if it has none."""
    choices = item.metadata['choices']
    if not choices:
        return ''
    kind = _TYPES[type(item.default)]
    return str({'enum_description': item.metadata['meaning'],
                'enum': [{'name': str(choice), 'value': choice, 'type': kind,
                          'description': ''} for choice in choices]})


# ----- the program dynparam -----

HELP = """Shows and changes settings of a running node. A refusal is one line.

Usage: dynparam list                     the nodes whose settings can change
       dynparam get NODE [NAME]          their values
       dynparam set NODE NAME VALUE      such as: dynparam set /turtlebot3 imu_silent true

The exit status is 0 only if that was done. Terminals of scripts/setup.sh call it `dynparam`, all
others `python3 -m tb3_labs.ros.dynparam`.

Calls
    NODE/set_parameters    dynamic_reconfigure/Reconfigure"""
SERVICE = '/set_parameters'
#: Longest wait for a node's answer [s].
ANSWER = 2.0
#: rospy puts these words around the reason that a node gives for a refusal.
REASON = re.compile(r'^.*responded with an error: b([\'"])'
                    r'(?:service cannot process request: )?(.*)\1$', re.DOTALL)
USAGE = 'usage: dynparam list | get NODE [NAME] | set NODE NAME VALUE'
#: {command: valid numbers of words, the command included}
COMMANDS = {'list': (1,), 'get': (2, 3), 'set': (4,)}


def nodes():
    """The names of the nodes whose settings can change."""
    _, _, services = rosgraph.Master(rospy.get_name()).getSystemState()
    return sorted(name[:-len(SERVICE)] for name, _ in services if name.endswith(SERVICE))


def call(node, config):
    """Change settings of `node`, and return {name: value} of all. ``ValueError`` if it refuses."""
    answers = []

    def ask():
        try:
            answers.append(rospy.ServiceProxy(node + SERVICE, Reconfigure)(config).config)
        except rospy.ServiceException as problem:
            answers.append(ValueError(REASON.sub(r'\2', str(problem))))
    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    thread.join(ANSWER)
    if not answers:
        raise ValueError('{} does not answer'.format(node))
    if isinstance(answers[0], ValueError):
        raise answers[0]
    return decoded(answers[0])


def settings_of(node):
    """Returns (the node's full name, {name: value} of its settings); ``ValueError`` if no such node
    has settings that can change."""
    known, node = nodes(), rospy.resolve_name(node)
    if node not in known:
        raise ValueError('there is no node {} whose settings can change; {}'.format(
            node, nearest(node, known)))
    return node, call(node, Values())


def value_of(text, kind):
    """Returns the typed text as a `kind`, or else as another type, which the node refuses."""
    try:
        value = text if kind is str else yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    if kind is float and type(value) is int:
        return float(value)
    return value if type(value) in (bool, int, float) else text


def carry_out(command, node='', name='', text=None):
    """Carry out a valid command line; ``ValueError`` with the reason of a refusal."""
    if command == 'list':
        print('\n'.join(nodes()) or 'no node: is a robot running?')
        return
    node, settings = settings_of(node)
    if name and name not in settings:
        raise ValueError('{} is unknown; {}'.format(name, nearest(name, settings)))
    if command == 'get':
        for each in [name] if name else sorted(settings):
            print('{}: {}'.format(each, shown(settings[each])))
    else:
        value = value_of(text, type(settings[name]))
        print('{} is {} now'.format(name, shown(call(node, encoded({name: value}))[name])))


def shown(value):
    """Returns a value as it is written in YAML."""
    return yaml.safe_dump(value).split('\n')[0]


def main(words):
    """Carry out the command line. Returns the exit status."""
    if words[:1] in (['-h'], ['--help']):
        print(HELP)
        return 0
    try:
        if not words or len(words) not in COMMANDS.get(words[0], ()):
            raise ValueError(USAGE)
        if not rosgraph.is_master_online():
            raise ValueError('no ROS master answers at {}: start a launch file first'.format(
                rosgraph.get_master_uri()))
        rospy.init_node('dynparam', anonymous=True, disable_rosout=True)
        carry_out(*words)
    except (ValueError, rospy.ROSException) as problem:
        print('dynparam: {}'.format(problem), file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main(rospy.myargv()[1:]))
