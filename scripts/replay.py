#!/usr/bin/env python3
"""Tries a recorded run again: its sensors and inputs go through your node as it is now.

Usage: replay.py RUN.bag PACKAGE NODE [ARGUMENT ...] [--speed 4] [--watch] [-o FOLDER]

The recorded imu, odom, joy, mouse_info and ctrl_relinq are played, the resets are called, and the
turns are typed, on a ROS master of its own. The page shows the commands of the node over the
recorded ones. It is open loop: the recorded robot does not obey the node.
"""
import sys
import time
from pathlib import Path

from roslib.packages import find_node

from tb3_labs.command_line import Parser, reason
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS, robot_model

#: Time between two looks at a watched file [s].
LOOK = 0.5


def parse(words):
    """The command line's arguments."""
    parser = Parser(prog='replay.py', description='Tries a recorded run again, with a node as it '
                    'is now; on a ROS master of its own.',
                    epilog='Example: replay.py run.bag lab7_tf move2goal_tf.py --speed 4')
    parser.add_argument('bag', metavar='RUN.bag', type=Path)
    parser.add_argument('package')
    parser.add_argument('node')
    parser.add_argument('arguments', nargs='*', metavar='ARGUMENT',
                        help='arguments of the node, right after its name')
    parser.add_argument('--speed', type=float, default=1.0,
                        help='speed, times the recorded one, 0.1 to 10; default: %(default)g')
    parser.add_argument('--watch', action='store_true',
                        help='replay whenever the file of the node is saved; Ctrl+C ends it')
    parser.add_argument('-o', dest='folder', type=Path,
                        help='where to write; default: RUN_replay beside the bag')
    parser.add_argument('--ns', metavar='ROBOT', help='namespace of the robot, / for none')
    parser.add_argument('--model', choices=sorted(MODELS), default=DEFAULT_MODEL,
                        help='default: %(default)s')
    given = parser.parse_args(words)
    if not 0.1 <= given.speed <= 10.0:
        parser.error('--speed: {:g} is not within 0.1 and 10'.format(given.speed))
    return given


def main(words):
    """Replay once, or whenever the node's file is saved. Returns the exit status."""
    given = parse(words)
    files = find_node(given.package, given.node) if given.package else []
    if not files:
        return fail('rosrun finds no {} in package {}: is it executable, and its workspace sourced?'
                    .format(given.node, given.package))
    from tb3_labs.marking.ros_replay import NotReplayed, Replay
    from tb3_labs.report.again import write_replay
    from tb3_labs.report.movements import completed
    from tb3_labs.report.ros_bag import BagProblem, read_run
    from tb3_labs.report.turns import turns
    try:
        run = completed(read_run(str(given.bag), given.ns))
        turned = turns(run)
        replay = Replay(run, turned, given.package, given.node, given.arguments)
        source, folder = Path(files[0]).resolve(), given.folder or given.bag.with_name(
            given.bag.stem + '_replay')
        print('The run is played: {:.0f} s.'.format(run.duration / given.speed), flush=True)
        while True:
            saved = source.stat().st_mtime
            try:
                again = replay.play(given.speed)
                page, result = write_replay(run, robot_model(given.model), turned, again, folder)
                print('\n'.join(result))
                print('Watch it: {}'.format(page), flush=True)
            except NotReplayed as problem:
                if not given.watch:
                    raise
                fail(problem)
            if not given.watch:
                return 0
            print('{} is watched: save it, and it runs again. Ctrl+C ends it.'.format(source.name),
                  flush=True)
            while source.stat().st_mtime == saved:
                time.sleep(LOOK)
    except (BagProblem, NotReplayed, OSError) as problem:
        return fail(reason(problem))
    except KeyboardInterrupt:
        return 130


def fail(problem):
    """Print why the run is not replayed. Returns the exit status."""
    print('replay.py: {}'.format(problem), file=sys.stderr)
    return 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
