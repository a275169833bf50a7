#!/usr/bin/env python3
"""Makes a report of recorded runs: paths, errors, speeds and tables, as a page, PNG and CSV.

Usage: lab_report.py RUN.bag [RUN2.bag ...] [-o FOLDER] [--goal X Y YAW_DEG] [--ns ROBOT]
                     [--model MODEL] [--turn NUMBER] [--student NAME]

Record with
    roslaunch tb3_labs record.launch
Any bag with sensor_msgs/Imu and nav_msgs/Odometry will do. Drives and turns are found in goal_state
or, for a node of your own, in cmd_vel; resets in the line `Local pose set to x=..., y=..., yaw=...`
on /rosout. Several runs make one page that compares them, and a page for each.
"""
import math
import sys
from pathlib import Path

from tb3_labs.command_line import Parser, number_or_text
from tb3_labs.geometry.se2 import TypedPose
from tb3_labs.marking.own_numbers import own_numbers
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS, robot_model


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='lab_report.py', description='Makes a report of a recorded run of a TurtleBot3; of '
        'several runs one page that compares them, and a page for each.',
        epilog='Example: lab_report.py lab.bag precise.bag -o compared')
    parser.add_argument('bags', metavar='RUN.bag', nargs='+')
    parser.add_argument('-o', dest='folder', help='where to write; default: RUN_report beside it; '
                        'for several runs: runs_report beside the first')
    parser.add_argument('--goal', nargs=3, type=number_or_text, metavar=('X', 'Y', 'YAW_DEG'),
                        help='goal in the local frame [m, m, deg] of drives whose goal was not '
                        "recorded; default: the lab's, -0.61 0.61 0")
    parser.add_argument('--ns', metavar='ROBOT', help='namespace of the robot, / for none')
    parser.add_argument('--model', choices=sorted(MODELS), default=DEFAULT_MODEL,
                        help='the robot with these limits; default: %(default)s')
    parser.add_argument('--turn', type=int, choices=range(1, 1000), metavar='NUMBER', default=0,
                        help='draw this turn of the table alone; default: all turns')
    parser.add_argument('--student', metavar='NAME', help='tell if the robot began with the start '
                        'and the IMU offset of skeleton.py --student NAME')
    given = parser.parse_args(words)
    if given.goal is not None:
        try:
            given.goal = TypedPose(*given.goal).pose
        except ValueError as problem:
            parser.error('--goal: {}'.format(problem))
    if given.student is not None:
        try:
            own_numbers(given.student)
        except ValueError as problem:
            parser.error('--student: {}'.format(problem))
    return given


def report(arguments):
    """Write the report. Returns (page, [problem, ...]); the page is None if no bag can be read.

    Raises ``OSError`` if nothing can be written, ``ImportError`` without matplotlib.
    """
    from tb3_labs.report.compare import summarize, write_comparison
    from tb3_labs.report.movements import LAB_GOAL, completed
    from tb3_labs.report.page import write_report
    from tb3_labs.report.ros_bag import BagProblem, read_run
    goal = LAB_GOAL if arguments.goal is None else arguments.goal
    model = robot_model(arguments.model)
    bags, pages, summaries, problems = [Path(bag) for bag in arguments.bags], [], [], []
    several = len(bags) > 1
    folder = Path(arguments.folder) if arguments.folder else bags[0].with_name(
        'runs_report' if several else bags[0].stem + '_report')
    for bag, name in zip(bags, names_of(bags)):
        own = folder / name if several else folder
        try:
            run = completed(read_run(str(bag), arguments.ns), goal)
            if arguments.student is not None:
                print(whose(run, arguments.student))
            pages.append(write_report(run, model, own, arguments.turn))
        except (BagProblem, ValueError) as problem:
            problems.append(str(problem))
            continue
        if several:
            summaries.append(summarize(run, model, name, name + '/report.html'))
    if several and pages:
        return write_comparison(summaries, folder, problems), problems
    return (pages[0] if pages else None), problems


def whose(run, student):
    """Returns a line that tells if a run began with the numbers of a student."""
    from tb3_labs.report.run_data import yaw_offset
    numbers, first = own_numbers(student), run.odometry.pose(0)
    start = first.x, first.y, math.degrees(first.yaw) % 360.0
    offset = math.degrees(yaw_offset(run).mean) % 360.0
    return ('{}: the robot began at ({:.2f}, {:.2f}) m, {:.0f} degrees, with an IMU offset of '
            '{:.0f} degrees: {}the numbers of {}, which are {}'.format(
                run.name, *start, offset, '' if numbers.recorded(start, offset) else 'not ',
                student, numbers))


def names_of(bags):
    """Returns a name for each bag, which its folder gets, too: the name of its file, with a number
    if an earlier bag has the same name."""
    names = []
    for bag in bags:
        alike = sum(other.stem == bag.stem for other in bags[:len(names)])
        names.append(bag.stem + ('_{}'.format(alike + 1) if alike else ''))
    return names


def main(words):
    """Read the bags, and write the report. Returns the exit status."""
    arguments = parse(words)
    try:
        page, problems = report(arguments)
    except ImportError as problem:
        return _fail('{}; install it: sudo apt install --no-install-recommends python3-{}'.format(
            problem, (problem.name or 'matplotlib').split('.')[0]))
    except OSError as problem:
        return _fail('cannot write the report to {}: {}; choose another folder with -o'.format(
            problem.filename or arguments.folder, problem.strerror or problem))
    except KeyboardInterrupt:
        return 130
    for problem in problems:
        _fail(problem)
    if page is not None:
        print('Report: {}'.format(page))
    return 1 if problems else 0


def _fail(problem):
    print('lab_report.py: {}'.format(problem), file=sys.stderr)
    return 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
