"""Publishes `/diagnostics` of a driving node once a second, for rqt_robot_monitor and rostopic."""
import threading

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import Updater

from tb3_labs.ros.node import guarded

REPORT_PERIOD = 1.0    # [s, wall clock]


class Diagnostics:
    """Publishes the answer of `report()`: ``(problem or '', {name: value})``.

    `report` is called without a lock once a second, also without a subscriber.
    """

    def __init__(self, hardware, report):
        self._report = report
        self._updater = Updater()
        self._updater.setHardwareID(hardware)
        self._updater.add('state', self._fill)    # the Updater puts the node's name before it
        self._ending = threading.Event()
        rospy.on_shutdown(self._ending.set)
        threading.Thread(target=guarded(self._run), name='diagnostics', daemon=True).start()

    def _run(self):
        while not self._ending.wait(REPORT_PERIOD):
            self._updater.force_update()

    def _fill(self, status):
        problem, values = self._report()
        status.summary(DiagnosticStatus.WARN if problem else DiagnosticStatus.OK, problem or 'OK')
        for name, value in values.items():
            status.add(name, str(value))
        return status


def values_of(source, now):
    """Returns {'imu age [s]': '0.004', 'imu dropped': 0} of a freshness.Freshness: its age, and the
    number of its invalid messages."""
    return {source.name + ' age [s]': '{:.3f}'.format(source.age(now)),
            source.name + ' dropped': source.dropped}
