#!/usr/bin/env python3
"""Starts a Python node, and shows its variables while the node runs. Type `rosrun tb3_labs
watch.py` before the node's usual command.

    rosrun tb3_labs watch.py rosrun lab2 turtlebot_controller.py
    rostopic echo /variables

In a launch file, write <node ... launch-prefix="rosrun tb3_labs watch.py"/>. The node keeps its own
process, signals, terminal and exit status.

Publishes
    variables    diagnostic_msgs/DiagnosticArray, 20 times a second while somebody listens:
                 a key and a value for each variable
"""
import os
import sys

from tb3_labs.safe_output import run_tool
from tb3_labs.watch import with_probe


def main(command):
    """Replace this process by the node. Returns the exit status if the node cannot be started."""
    if command[:1] in (['-h'], ['--help']):
        print(__doc__.strip())
        return 0
    if not command or command[0].startswith('-'):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    try:
        os.execvpe(command[0], command, with_probe(os.environ))
    except OSError as error:
        print(f'watch.py: {command[0]} cannot be started: {error.strerror}', file=sys.stderr)
        return 127


if __name__ == '__main__':
    run_tool(main)
