#!/usr/bin/env python3
"""Makes a report of a recorded run, as a page with PNG and CSV files.

The report has a timeline, paths, turns and tables. The bag must have messages of the types
sensor_msgs/Imu and nav_msgs/Odometry; record.launch records such a bag. The report finds drives and
turns in goal_state, or in cmd_vel if your node does not publish goal_state. The report finds resets
in the line `Local pose set to x=..., y=..., yaw=...` on /rosout. To compare runs, put their
turns.csv or drives.csv into one spreadsheet. TURTLEBOT3_MODEL gives the robot's name and size.
"""
import os
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from tb3_labs.command_line import Parser, error_text, number_or_text, printable
from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG
from tb3_labs.robot.turtlebot3 import model_of_environment
from tb3_labs.supervision.goal_requests import TypedPose
from tb3_labs.safe_output import run_tool

MAX_PRINTED_LENGTH = 1000    # [characters]


def parse(argv):
    parser = Parser(
        prog='lab_report.py', description='Makes a report of a recorded run of a TurtleBot3.',
        epilog='Example: lab_report.py run.bag -o report')
    parser.add_argument('bag', metavar='RUN.bag', type=Path)
    parser.add_argument('-o', dest='folder', metavar='FOLDER', type=Path,
                        help='where to write; default: RUN_report beside the bag')
    parser.add_argument('--goal', nargs=3, type=number_or_text, metavar=('X', 'Y', 'YAW_DEG'),
                        help='goal in the local frame [m, m, deg] of drives whose goal was not '
                        f"recorded; default: the lab's, {GOAL_X:g} {GOAL_Y:g} {GOAL_YAW_DEG:g}")
    parser.add_argument('--ns', metavar='ROBOT', help='namespace of the robot, / for none')
    arguments = parser.parse_args(argv)
    if arguments.goal is not None:
        try:
            arguments.goal = TypedPose(*arguments.goal).pose
        except ValueError as error:
            parser.error(f'--goal: {error}')
    return arguments


def with_goals_of_trial(run):
    """Returns the RunData with the goals and resets that the marker of a trial gave to the node.
    Returns an unchanged RunData if the run was not a trial."""
    from tb3_labs.marking.trial.from_bag import trial_of
    with suppress(Exception):       # the events in a stranger's bag may be any texts
        trial = trial_of(run).recording
        numbers = [*trial.goals.columns, *trial.resets.columns]
        if all(np.isfinite(column).all() for column in numbers):    # a text raises an exception
            return replace(run, goals=trial.goals, resets=trial.resets)
    return run


def main(argv):
    """Write the report. Returns the exit status."""
    arguments = parse(argv)
    try:
        from tb3_labs.report.motion.movements import with_derived_fields
        from tb3_labs.report.page.files import write_report    # needs matplotlib
        from tb3_labs.recording.ros_bag import read_run
        recorded_run = read_run(str(arguments.bag), arguments.ns)
        if len(recorded_run.events):
            recorded_run = with_goals_of_trial(recorded_run)
        run = with_derived_fields(recorded_run, arguments.goal)
        for note in run.notes:
            _print(f'{arguments.bag}: {note}')
        folder = arguments.folder or arguments.bag.with_name(arguments.bag.stem + '_report')
        page, *others = write_report(run, model_of_environment(os.environ), folder)
        print(f'Report: {page}\nBeside it: {", ".join(path.name for path in others)}')
    except ImportError as error:
        return _fail(f'{error}; install it: sudo apt install --no-install-recommends '
                     'python3-matplotlib')
    except OSError as error:
        return _fail(f'cannot write the report: {error_text(error)}; '
                     'choose another folder with -o')
    except ValueError as error:
        return _fail(error)
    except KeyboardInterrupt:
        return 130
    return 0


def _fail(problem):
    _print(problem)
    return 1


def _print(text):
    """Print a text, which may come from a stranger's bag."""
    print(f'lab_report.py: {printable(str(text)[:MAX_PRINTED_LENGTH])}', file=sys.stderr)


if __name__ == '__main__':
    run_tool(main)
