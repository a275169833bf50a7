"""The bag of a checkoff: what lab_report.py reads, and what the person was seen to do."""
import signal
import subprocess

import roslib.packages
import rospy

from tb3_labs.report.messages import RECORDED

#: The bag is closed within this time [s].
CLOSING = 10.0


class Bag:
    """Records until it is closed; `path` is None if rosbag is not there."""

    def __init__(self, path):
        """`path`: of the bag."""
        found = roslib.packages.find_node('rosbag', 'record')
        self.path = path if found else None
        self._process = subprocess.Popen(
            [found[0], '--quiet', '-O', str(path)] + [rospy.resolve_name(t) for t in RECORDED],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True) if found else None

    def close(self):
        """Record no more."""
        if self._process is None:
            return
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(CLOSING)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
