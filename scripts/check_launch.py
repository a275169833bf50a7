#!/usr/bin/env python3
"""Says in one line why a launch cannot do what it is asked for; nothing is started.

Each launch file of this package runs it while roslaunch reads that file (see launch/check.sh). It
then ends that roslaunch, if there is anything to say.

Usage: check_launch.py tb3_labs FILE.launch [ARG:=VALUE ...]    the words that follow roslaunch
"""
import signal
import socket
import sys

#: Longest wait for each answer of a master or node [s].
LONGEST_ANSWER = 1.0


def main(words):
    """The exit status: 1 if there is a problem."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)    # Ctrl+C while it runs: without a traceback
    if set(words) & {'-h', '--help'}:
        print(__doc__.strip())
        return 0
    socket.setdefaulttimeout(LONGEST_ANSWER)
    # these imports take half a second: after the lines above
    from tb3_labs.ros.launching import command, parent, rehearsal
    roslaunch = None if words else parent.parent()
    try:
        asked = command.read(roslaunch.words if roslaunch else words)
        problem = rehearsal.problem_of(asked) if asked else ''
    except Exception as error:    # an error of the check itself must not keep a robot from starting
        print('tb3_labs: this launch was not checked: {}: {}'.format(type(error).__name__, error),
              file=sys.stderr)
        return 0
    if not problem:
        return 0
    print('tb3_labs: ' + problem, file=sys.stderr, flush=True)
    if roslaunch:
        roslaunch.end()    # it would add five lines to the reason, with a piece of XML
    return 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
