"""`/diagnostics` of a driving node, once a second while they are heard, as rqt_robot_monitor and
rostopic echo do."""
import threading

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import Updater

from tb3_labs.ros.node import guarded

REPORT_PERIOD = 1.0    # [s, wall clock]


class Diagnostics:
    """Publishes the answer of `report()`: ``(problem, {name: value})``; '' is no problem.

    `report` is called once a second, heard or not, so that rates are those of the last second. Its
    thread holds no lock of the node.
    """

    def __init__(self, hardware, report):
        self._report = report
        self._latest = '', {}
        self._updater = Updater()
        self._updater.setHardwareID(hardware)
        self._updater.add('state', self._fill)    # the node's name is put before it
        self._ending = threading.Event()
        rospy.on_shutdown(self._ending.set)
        threading.Thread(target=guarded(self._run), name='diagnostics', daemon=True).start()

    def _run(self):
        while not self._ending.wait(REPORT_PERIOD):
            self._latest = self._report()
            if self._updater.publisher.get_num_connections():
                self._updater.force_update()

    def _fill(self, status):
        problem, values = self._latest
        status.summary(DiagnosticStatus.WARN if problem else DiagnosticStatus.OK, problem or 'OK')
        for name, value in values.items():
            status.add(name, str(value))
        return status


class SourceReport:
    """Age, rate and invalid messages of sources, for `values` of a report."""

    def __init__(self, *sources):
        """Each source: a freshness.Freshness, the Traffic of its topic, the clock of its age."""
        self._sources = sources

    def values(self):
        """{'imu age [s]': '0.004', 'imu rate [1/s]': '200.1', ...}"""
        values = {}
        for source, traffic, clock in self._sources:
            values[source.name + ' age [s]'] = '{:.3f}'.format(source.age(clock()))
            values[source.name + ' rate [1/s]'] = '{:.1f}'.format(traffic.rate())
            values[source.name + ' dropped'] = source.dropped
        return values
