"""Shows and changes settings of a running node. A refusal is one line.

Usage: dynparam list                     the nodes whose settings can change
       dynparam get NODE [NAME]          their values
       dynparam set NODE NAME VALUE      such as: dynparam set /turtlebot3 imu_silent true

The exit status is 0 only if that was done. In a terminal after scripts/setup.sh the command is
`dynparam`, in others `python3 $(rospack find tb3_labs)/launch/run.py dynparam`.

Calls
    NODE/set_parameters    dynamic_reconfigure/Reconfigure
"""
# The program `dynparam` of dynamic_reconfigure 1.7.3 shows a refusal as a traceback of 28 lines,
# and waits without end for an unknown node.

import re
import sys

import rosgraph
import rospy
import yaml
from dynamic_reconfigure.msg import Config as Values
from dynamic_reconfigure.srv import Reconfigure

from tb3_labs.command_line import number_or_text
from tb3_labs.config import nearest
from tb3_labs.ros.live_settings import decode, encode
from tb3_labs.ros.topics import require_master
from tb3_labs.terminal import run_tool

SERVICE = '/set_parameters'
#: Longest wait for a node's answer [s].
LONGEST_ANSWER = 2.0
#: rospy's text of a refusal. The second group is the node's reason.
REFUSAL = re.compile(r'^.*responded with an error: b([\'"])'
                     r'(?:service cannot process request: )?(.*)\1$', re.DOTALL)
USAGE = 'usage: dynparam list | get NODE [NAME] | set NODE NAME VALUE'
#: {command: valid numbers of words, together with the command}
COMMANDS = {'list': (1,), 'get': (2, 3), 'set': (4,)}


def nodes():
    """Returns the names of the nodes whose settings can change."""
    _, _, services = rosgraph.Master(rospy.get_name()).getSystemState()
    return sorted(name[:-len(SERVICE)] for name, _ in services if name.endswith(SERVICE))


def call(node, config):
    """Change settings of `node`. Returns {name: value} of all settings of the node. ``ValueError``
    with the reason if the node refuses the change."""
    rospy.wait_for_service(node + SERVICE, LONGEST_ANSWER)
    try:
        return decode(rospy.ServiceProxy(node + SERVICE, Reconfigure)(config).config)
    except rospy.ServiceException as problem:
        raise ValueError(REFUSAL.sub(r'\2', str(problem))) from None


def settings_of(node):
    """Returns the full name of `node`, and {name: value} of its settings. ``ValueError`` if the
    node is unknown, or if none of its settings can change."""
    known, node = nodes(), rospy.resolve_name(node)
    if node not in known:
        raise ValueError(
            f'there is no node {node} whose settings can change; {nearest(node, known)}')
    return node, call(node, Values())


def value_of(text, kind):
    """Returns the value of a typed text. The node itself refuses a value that is not of type
    `kind`."""
    if kind is float:
        return number_or_text(text)    # YAML reads 1e-3 as a text, and 400 digits are not a float
    try:
        value = text if kind is str else yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):    # Python raises ValueError for 5000 digits
        return text
    is_small_integer = type(value) is int and abs(value) < 2 ** 31
    return value if type(value) in (bool, float) or is_small_integer else text


def carry_out(command, node='', name='', text=None):
    """Carry out a valid command line. ``ValueError`` with the reason if the node refuses it."""
    if command == 'list':
        print('\n'.join(nodes()) or 'no node: is a robot running?')
        return
    node, settings = settings_of(node)
    if name and name not in settings:
        raise ValueError(f'{name} is unknown; {nearest(name, settings)}')
    if command == 'get':
        for each in [name] if name else sorted(settings):
            print(f'{each}: {in_yaml(settings[each])}')
    else:
        value = value_of(text, type(settings[name]))
        print(f'{name} is {in_yaml(call(node, encode({name: value}))[name])} now')


def in_yaml(value):
    """Returns a value as YAML text."""
    return yaml.safe_dump(value).split('\n')[0]


def main(argv):
    """Carry out the command line. Returns the exit status."""
    if argv[:1] in (['-h'], ['--help']):
        print(__doc__.strip())
        return 0
    try:
        if not argv or len(argv) not in COMMANDS.get(argv[0], ()):
            raise ValueError(USAGE)
        require_master()
        rospy.init_node('dynparam', anonymous=True, disable_rosout=True)
        carry_out(*argv)
    except (ValueError, rospy.ROSException) as problem:
        print(f'dynparam: {problem}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    run_tool(lambda _: main(rospy.myargv()[1:]))
