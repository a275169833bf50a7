"""Changes a setting of a running node. If the node refuses the change, one line shows the reason.

Usage: dynparam set NODE NAME VALUE      such as: dynparam set /turtlebot3 imu_silent true

The exit status is 0 only if the node changed the setting. In a terminal after scripts/setup.sh the
command is `dynparam`, in others `python3 $(rospack find tb3_labs)/launch/run.py dynparam`.

Calls
    NODE/set_parameters    dynamic_reconfigure/Reconfigure
"""
# The program `dynparam` of dynamic_reconfigure 1.7.3 shows a refusal as a traceback of 28 lines,
# and waits without end for an unknown node.

import re
import sys

import rosgraph
import rospy
from dynamic_reconfigure.msg import Config as Values
from dynamic_reconfigure.srv import Reconfigure

from tb3_labs.command_line import number_or_text
from tb3_labs.config import hint_for
from tb3_labs.ros.live_settings import decode, encode
from tb3_labs.ros.topics import require_master
from tb3_labs.terminal import run_tool

SERVICE = '/set_parameters'
#: Longest wait for a node's answer [s].
MAX_ANSWER_TIME = 2.0
#: rospy's text of a refusal. The second group is the node's reason.
REFUSAL = re.compile(r'^.*responded with an error: b([\'"])'
                     r'(?:service cannot process request: )?(.*)\1$', re.DOTALL)
USAGE = 'usage: dynparam set NODE NAME VALUE'


def configurable_nodes():
    """Returns the names of the nodes whose settings can change."""
    _, _, services = rosgraph.Master(rospy.get_name()).getSystemState()
    return sorted(name[:-len(SERVICE)] for name, _ in services if name.endswith(SERVICE))


def change_settings(node, config):
    """Change settings of `node`. Returns {name: value} of all settings of the node. ``ValueError``
    with the reason if the node refuses the change."""
    rospy.wait_for_service(node + SERVICE, MAX_ANSWER_TIME)
    try:
        return decode(rospy.ServiceProxy(node + SERVICE, Reconfigure)(config).config)
    except rospy.ServiceException as problem:
        raise ValueError(REFUSAL.sub(r'\2', str(problem))) from None


def change(node, name, text):
    """Set the setting `name` of `node` to a typed text. ``ValueError`` with the reason if a name is
    unknown, or if the node refuses the value."""
    known = configurable_nodes()
    node = rospy.resolve_name(node)
    if node not in known:
        raise ValueError(
            f'there is no node {node} whose settings can change; {hint_for(node, known)}')
    settings = change_settings(node, Values())    # an empty request changes nothing
    if name not in settings:
        raise ValueError(f'{name} is unknown; {hint_for(name, settings)}')
    # if the value does not have the type of the setting, the node refuses it
    value = {'true': True, 'false': False}.get(text.lower(), number_or_text(text))
    print(f'{name} is {change_settings(node, encode({name: value}))[name]} now')


def main(argv):
    """Carry out the command line. Returns the exit status."""
    if argv[:1] in (['-h'], ['--help']):
        print(__doc__.strip())
        return 0
    try:
        if len(argv) != 4 or argv[0] != 'set':
            raise ValueError(USAGE)
        require_master()
        rospy.init_node('dynparam', anonymous=True, disable_rosout=True)
        change(*argv[1:])
    except (ValueError, rospy.ROSException) as problem:
        print(f'dynparam: {problem}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    run_tool(lambda _: main(rospy.myargv()[1:]))
