"""Changes a setting of a running node. If the node refuses the change, one line shows the reason.

Usage: dynparam set NODE NAME VALUE      such as: dynparam set /turtlebot3 imu_silent true

The exit status is 0 only if the node changed the setting. The command is `dynparam` in a terminal
that has sourced scripts/setup.sh. In another terminal the command is `python3 $(rospack find
tb3_labs)/launch/run.py dynparam`.

Calls
    NODE/set_parameters    dynamic_reconfigure/Reconfigure
"""
# This module replaces the program `dynparam` of dynamic_reconfigure 1.7.3, which shows a refusal as
# a traceback of 28 lines, and waits forever for a node that does not exist.

import re
import sys

import rospy
from dynamic_reconfigure.srv import Reconfigure

from tb3_labs.command_line import number_or_text
from tb3_labs.ros.live_settings import decode, encode
from tb3_labs.ros.topics import require_master
from tb3_labs.safe_output import run_tool

SERVICE_TIMEOUT = 2.0    # [s]
#: Matches the text with which rospy reports that a node refuses a request.
REFUSAL = re.compile(r'^.*responded with an error: b(?P<quote>[\'"])'
                     r'(?:service cannot process request: )?(?P<reason>.*)(?P=quote)$', re.DOTALL)
USAGE = 'usage: dynparam set NODE NAME VALUE'


def change(node, name, text):
    """Change the setting `name` of `node` to the value that a user typed as `text`. If the node
    refuses, raises ``ValueError`` with the reason. Raises ``ROSException`` for an unknown node."""
    service = rospy.resolve_name(node) + '/set_parameters'
    rospy.wait_for_service(service, SERVICE_TIMEOUT)
    is_bool = text.lower() in ('true', 'false')    # the node refuses a text in place of a bool
    value = text.lower() == 'true' if is_bool else number_or_text(text)
    try:
        settings = rospy.ServiceProxy(service, Reconfigure)(encode({name: value})).config
    except rospy.ServiceException as error:
        raise ValueError(REFUSAL.sub(r'\g<reason>', str(error))) from None
    print(f'{name} is {decode(settings)[name]} now')


def main(argv):
    """Returns the exit status."""
    if argv[:1] in (['-h'], ['--help']):
        print(__doc__.strip())
        return 0
    try:
        if len(argv) != 4 or argv[0] != 'set':
            raise ValueError(USAGE)
        require_master()
        rospy.init_node('dynparam', anonymous=True, disable_rosout=True)
        change(*argv[1:])
    except (ValueError, rospy.ROSException) as error:
        print(f'dynparam: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    run_tool(lambda _: main(rospy.myargv()[1:]))
