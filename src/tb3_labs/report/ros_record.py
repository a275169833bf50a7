"""Runs rosbag's recorder, then prints the command that shows the run again.

    python3 -m tb3_labs.report.ros_record PREFIX COMMAND...     as a launch-prefix

The bag's path begins with PREFIX, as in ``rosbag record -o``. On a signal the recorder closes
the bag, and this process ends after the recorder.
"""
import signal
import subprocess
import sys
from pathlib import Path


def main(prefix: str, command: list) -> int:
    """Run until the recorder ends. Returns the exit status of the recorder."""
    signal.signal(signal.SIGINT, lambda *_: None)    # the recorder hears Ctrl+C, too
    recorder = subprocess.Popen(command)
    signal.signal(signal.SIGTERM, lambda *_: recorder.terminate())
    status = recorder.wait()
    path = Path(prefix)
    bags = sorted(path.parent.glob(path.name + '_*.bag'), key=lambda bag: bag.stat().st_mtime)
    if bags:
        print('Watch the run again: rosrun tb3_labs lab_report.py {}'.format(bags[-1]), flush=True)
    return status


if __name__ == '__main__':
    sys.exit(main(sys.argv[1], sys.argv[2:]))
