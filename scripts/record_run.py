#!/usr/bin/env python3
"""Records a run for lab_report.py: becomes `rosbag record` of this namespace's topics.

Usage: record_run.py [-o PATH]    for instance: rosrun tb3_labs record_run.py -o run

rosbag keeps a topic's name as it is given. It gets absolute names here (/imu, or /robot3/imu where
ROS_NAMESPACE or the launch file says robot3), so that evo, Foxglove and PlotJuggler find them.
A topic that nobody sends costs nothing.
"""
import os
import sys

import rosgraph
from rosgraph.names import script_resolve_name

from tb3_labs.command_line import Parser
from tb3_labs.report.messages import RECORDED
from tb3_labs.ros.launching.optional import how_to_install, path_of
from tb3_labs.ros.launching.recording import problem_of_folder

#: roslaunch's name for this node, which becomes rosbag's.
NODE = 'record'


def main(words):
    """Become rosbag's record; the exit status if that cannot be."""
    parser = Parser(
        prog='record_run.py',
        description='Records the topics for lab_report.py into PATH_DATE.bag, by absolute names. '
                    'Ctrl+C ends it.',
        epilog='Example: rosrun tb3_labs record_run.py -o run. Topics: {}.'.format(
            ', '.join(RECORDED)))
    parser.add_argument('-o', metavar='PATH', dest='path', default='run',
                        help='where to; date and .bag are added; default: %(default)s')
    path = parser.parse_args(rosgraph.myargv(words)).path
    recorder = path_of('rosbag', 'record')
    problem = problem_of_folder(path) if recorder else how_to_install('rosbag')
    if problem:
        print('record_run.py: ' + problem, file=sys.stderr)
        return 1
    topics = [script_resolve_name(NODE, name) for name in RECORDED]
    remappings = [word for word in words if ':=' in word]
    os.execv(recorder, [recorder, '-o', path] + topics + remappings)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
