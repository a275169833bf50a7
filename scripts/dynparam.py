#!/usr/bin/env python3
"""Shows and changes settings of a running node, as dynamic_reconfigure's own dynparam does. It answers
within two seconds, and a refusal is one line.

Usage: dynparam list                     the nodes whose settings can change
       dynparam get NODE [NAME]          their values
       dynparam set NODE NAME VALUE      such as: dynparam set /turtlebot3 imu_silent true

The exit status is 0 only if that was done. Terminals of scripts/setup.sh call it `dynparam`, all others
`rosrun tb3_labs dynparam.py`.

Calls
    NODE/set_parameters    dynamic_reconfigure/Reconfigure
"""
import difflib
import re
import sys
import threading

import rosgraph
import rospy
import yaml
from dynamic_reconfigure.msg import (
    BoolParameter, Config, ConfigDescription, DoubleParameter, IntParameter, StrParameter)
from dynamic_reconfigure.srv import Reconfigure

SERVICE = '/set_parameters'
#: Longest wait for a node's answer [s].
ANSWER = 2.0
#: rospy puts these words around the reason that a node gives for a refusal.
REASON = re.compile(r'^.*responded with an error: b([\'"])'
                    r'(?:service cannot process request: )?(.*)\1$', re.DOTALL)
USAGE = 'usage: dynparam list | get NODE [NAME] | set NODE NAME VALUE'
#: Type of a value: (its list in a Config, its message, how it is called).
KINDS = {bool: ('bools', BoolParameter, 'true or false'),
         int: ('ints', IntParameter, 'a whole number'),
         float: ('doubles', DoubleParameter, 'a number'), str: ('strs', StrParameter, 'text')}


def nodes():
    """The names of the nodes whose settings can change."""
    _, _, services = rosgraph.Master(rospy.get_name()).getSystemState()
    return sorted(name[:-len(SERVICE)] for name, _ in services if name.endswith(SERVICE))


def call(node, config):
    """{name: value} of a node's settings after a change by `config`; ``ValueError`` with the reason of
    a refusal."""
    answer = []

    def ask():
        try:
            answer.append(rospy.ServiceProxy(node + SERVICE, Reconfigure)(config).config)
        except rospy.ServiceException as problem:
            answer.append(ValueError(REASON.sub(r'\2', str(problem))))
    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    thread.join(ANSWER)
    if not answer:
        raise ValueError('{} does not answer'.format(node))
    if isinstance(answer[0], ValueError):
        raise answer[0]
    return {item.name: item.value for kind, _, _ in KINDS.values()
            for item in getattr(answer[0], kind)}


def settings_of(node):
    """(the node's full name, {name: value} of its settings); ``ValueError`` for an unknown one."""
    known, node = nodes(), rospy.resolve_name(node)
    if node not in known:
        near = difflib.get_close_matches(node, known, 1)
        raise ValueError('there is no node {} whose settings can change{}; there are: {}'.format(
            node, ', near it: ' + near[0] if near else '', ', '.join(known) or 'none'))
    return node, call(node, Config())


def check_name(name, settings):
    """``ValueError`` if there is no such setting."""
    if name not in settings:
        near = difflib.get_close_matches(name, settings, 1)
        raise ValueError('{} is unknown{}; known: {}'.format(
            name, ', near it: ' + near[0] if near else '', ', '.join(sorted(settings))))


def valid_of(node, name, otherwise):
    """The valid values of a setting in the words of its node, as tb3_labs.ros.reconfigure says them at
    the end of its description; `otherwise` if the node does not say them."""
    try:
        described = rospy.wait_for_message(node + '/parameter_descriptions', ConfigDescription, ANSWER / 2.0)
    except rospy.ROSException:
        return otherwise
    words = next((item.description.rpartition(': ')[2] for group in described.groups
                  for item in group.parameters if item.name == name), '')
    return words if words.startswith((otherwise, 'one of ')) else otherwise


def config_of(node, name, text, settings):
    """The Config that sets `name` to `text`, which is read as the present value's type."""
    check_name(name, settings)
    kind = type(settings[name])
    part, message, words = KINDS[kind]
    try:
        value = text if kind is str else yaml.safe_load(text)
    except yaml.YAMLError:
        value = None
    if kind is float and type(value) is int:
        value = float(value)
    if type(value) is not kind:
        raise ValueError('{} = {!r} is not valid: {}'.format(name, text, valid_of(node, name, words)))
    return Config(**{part: [message(name, value)]})


def check_usage(words):
    """``ValueError`` if the command line is none of these."""
    if len(words) not in {'list': [1], 'get': [2, 3], 'set': [4]}.get(words[0] if words else '', []):
        raise ValueError(USAGE)


def carry_out(words):
    """Do what a valid command line asks for; ``ValueError`` with the reason of a refusal."""
    if words[0] == 'list':
        print('\n'.join(nodes()) or 'no node: is a robot running?')
    elif words[0] == 'get':
        _, settings = settings_of(words[1])
        if len(words) == 3:
            check_name(words[2], settings)
        for name in words[2:] or sorted(settings):
            print('{}: {}'.format(name, yaml.safe_dump(settings[name]).split('\n')[0]))
    else:
        node, settings = settings_of(words[1])
        now = call(node, config_of(node, words[2], words[3], settings))
        print('{} is {} now'.format(words[2], yaml.safe_dump(now[words[2]]).split('\n')[0]))


def main(words):
    """The exit status."""
    if words[:1] in (['-h'], ['--help']):
        print(__doc__.strip())
        return 0
    try:
        check_usage(words)
        if not rosgraph.is_master_online():
            raise ValueError('no ROS master answers at {}: start a launch file first'.format(
                rosgraph.get_master_uri()))
        rospy.init_node('dynparam', anonymous=True, disable_rosout=True)
        carry_out(words)
    except ValueError as problem:
        print('dynparam: {}'.format(problem), file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main(rospy.myargv()[1:]))
