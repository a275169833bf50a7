#!/usr/bin/env python3
"""Judges the node that is running now by its lab's criteria: the checkpoint at the bench.

Usage: checkoff.py turn [--name "Ann Miller"]

It does not start a robot or a node. A person starts both, types on request, and tells things that
only a person can see. doc/instructor/marking.md tells more. The exit status is 0 only if all
criteria are met.

Subscribes
    ground_truth  geometry_msgs/PoseStamped: the simulated robot's true pose; else imu and odom
    cmd_vel       geometry_msgs/Twist: the node's commands
    /rosout       rosgraph_msgs/Log: its log
Publishes, as the lab's part needs it
    mouse_info, joy, ctrl_relinq, cmd_vel
"""
import re
import signal
import sys
import time
from pathlib import Path

import rosgraph
import rospkg
import rospy
from roslib.packages import find_node

from tb3_labs.command_line import Parser, reason
from tb3_labs.marking.marks import LABS, MOVE2GOAL, points_of, read_points
from tb3_labs.marking.move2goal import GOAL
from tb3_labs.marking.own_numbers import own_numbers
from tb3_labs.marking.ros_checkoff import Checkoff, parts_of
from tb3_labs.marking.ros_running_node import Impossible, Person
from tb3_labs.report.messages import RECORDED
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.program import Program

#: The folder for the bags.
BAGS = Path(rospkg.get_ros_home()) / 'checkoffs'
#: The bag is closed within this time [s].
CLOSING = 10.0


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='checkoff.py', description='Judges the node that is running now, at the bench.')
    parser.add_argument('lab', choices=sorted(LABS))
    parser.add_argument('--name', default='', help="the student's name")
    parser.add_argument('--own', action='store_true', help='of {}: judge by the numbers of '
                        'skeleton.py --student NAME'.format(MOVE2GOAL))
    parser.add_argument('--parts', default='', help='these parts of the lab alone, with commas')
    parser.add_argument('--node', default='', help="the node's name, if several could be meant")
    parser.add_argument('--points', type=Path, help='YAML file with the points of each criterion; '
                        'default: test/marking/points.yaml of this package')
    parser.add_argument('-o', dest='folder', metavar='FOLDER', type=Path, default=BAGS,
                        help='folder for the bag; default: %(default)s')
    return parser.parse_args(words)


def main(words):
    """Judge the node. Returns the exit status."""
    given, person, begun = parse(words), Person(), time.strftime('%Y-%m-%d %H:%M')
    lab = LABS[given.lab]
    try:
        parts = parts_of(given.lab, lab.checked_parts(given.parts))
        worth = points_of(given.lab, read_points(given.points))
        goal = own_goal(given, person) if given.own else GOAL
        given.folder.mkdir(parents=True, exist_ok=True)
        if not rosgraph.is_master_online():
            raise Impossible('no master runs here: start the robot and your node first')
        rospy.init_node('checkoff', anonymous=True, disable_signals=True)
        checkoff = Checkoff(given.lab, parts, worth, given.node, person, goal)
    except (OSError, ValueError, RuntimeError, Impossible) as problem:
        return tell_problem(problem)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    person.tell('{}: {}. Lines with > are for you to do, lines with ? to answer. Ctrl+C ends it.'
                .format(lab.title, ', '.join(parts)))
    person.tell('Judged by {}.'.format(
        "the simulated robot's true pose" if checkoff.has_truth else
        'odometry and IMU, since this robot sends no true pose'))
    bag = given.folder / (re.sub(r'\W+', '_', ' '.join(filter(None, (
        'checkoff', given.lab, given.name, time.strftime('%Y%m%d_%H%M%S'))))) + '.bag')
    recorder = recording(bag)
    try:
        checkoff.run()
    except Impossible as problem:
        return tell_problem(problem)
    except KeyboardInterrupt:
        person.tell('\nInterrupted.')
    finally:
        if recorder is not None:
            recorder.send(signal.SIGINT)
            wait_until(lambda: recorder.status is not None, CLOSING)
            recorder.kill()
        rospy.signal_shutdown('done')
    person.tell('\n{}: {:g} of {:g} points, {}, {} ({}), node {}'.format(
        given.name or 'No name given', *checkoff.criteria.points, begun, lab.title,
        ', '.join(parts), checkoff.node.name or 'not found'))
    person.tell('Watch it again: rosrun tb3_labs lab_report.py {}'.format(bag.resolve())
                if recorder else 'Bag: none, rosbag is missing')
    return 0 if checkoff.criteria.all_met else 1


def own_goal(given, person):
    """The student's own goal, which is told to the person. ``ValueError`` if there is none."""
    if given.lab != MOVE2GOAL or not given.name:
        raise ValueError('--own is for {} alone, with --name'.format(MOVE2GOAL))
    numbers = own_numbers(given.name)
    person.tell(numbers.remark)
    return numbers.goal_pose


def recording(bag):
    """A Program that records for lab_report.py; None if rosbag is not installed."""
    found = find_node('rosbag', 'record')
    topics = [rospy.resolve_name(topic) for topic in RECORDED]
    return Program([found[0], '--quiet', '-O', str(bag)] + topics) if found else None


def tell_problem(problem):
    """Print why the node cannot be judged. Returns the exit status."""
    print('checkoff.py: {}'.format(reason(problem)), file=sys.stderr)
    return 2


if __name__ == '__main__':
    sys.exit(main(rospy.myargv(sys.argv)[1:]))
