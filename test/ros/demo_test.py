"""The demonstration succeeds, and the report of its recording has the errors that it printed."""
import contextlib
import math
import os
import pathlib
import re
import tempfile
import time
import unittest

import rospkg

from tb3_labs.recording.ros_bag import read_run
from tb3_labs.report.motion.drives import drive_reports
from tb3_labs.report.motion.resets_and_goals import frame_intervals

from masters import free_port, processes_with
from node_case import TestProgram
from rosunit_internals import needs_setup

SCRIPT = os.path.join(rospkg.RosPack().get_path('tb3_labs'), 'scripts', 'demo.sh')
#: A row of the table about a good drive, with the true errors [mm], [deg].
ROW = re.compile(r'^drive \d .*?([\d.]+) mm ([\d.]+) deg .* ok$', re.MULTILINE)
#: The report takes its origin from the first local_pose after a reset. Its heading is as noisy as that
#: of the reset: together 0.007 deg, or 0.1 mm after 0.86 m. The limits are five times as large [mm], [deg].
MAX_DIFFERENCE = 0.5, 0.05


def demo(*arguments, **options):
    """Start demo.sh with a new master. Returns (TestProgram, address of the master)."""
    uri = 'http://localhost:{}'.format(free_port())
    environment = dict(options.pop('environment', {}), ROS_MASTER_URI=uri)
    return TestProgram(list(options.pop('prefix', ())) + [SCRIPT, *arguments],
                       environment=environment, **options), uri


def left_behind(uri):
    """Returns the command lines of the processes that were started with this master."""
    found = []
    for process in processes_with(uri):
        with contextlib.suppress(OSError):    # it has ended
            found.append((process / 'cmdline').read_bytes())
    return found


@needs_setup
class DemoTest(unittest.TestCase):

    def test_both_drives_are_good_and_the_report_agrees(self):
        with tempfile.TemporaryDirectory(prefix='demo_test_') as folder:
            run, uri = demo('use_sim_time:=true', 'record:=true', 'robot_set:={imu_rate: 60}',
                            prefix=['sh', '-c', 'cd {} && exec "$0" "$@"'.format(folder)])
            self.addCleanup(run.kill)
            self.assertEqual(run.wait(300.0), 0, run.text)
            self.assertEqual(left_behind(uri), [])
            table = [[float(number) for number in row] for row in ROW.findall(run.text)]
            path, = pathlib.Path(folder).glob('run_*.bag')
            recorded = read_run(str(path))
        reported = drive_reports(recorded)
        self.assertEqual((len(table), len(frame_intervals(recorded))), (2, 2), run.text)
        self.assertEqual([drive.outcome for drive in reported], ['reached'] * 2)
        for drive, printed in zip(reported, table):
            true = 1000.0 * drive.true_error[0], abs(math.degrees(drive.true_error[1]))
            for value, expected, most in zip(true, printed, MAX_DIFFERENCE):
                self.assertLess(abs(value - expected), most)    # NaN is not less

    def test_ctrl_c_ends_the_script_at_once_without_a_line(self):
        """Ctrl+C while programs start would make them print tracebacks."""
        for after in (0.3, 1.0, 2.0):
            run, uri = demo('web:=false', 'stay:=true', terminal=True)
            self.addCleanup(run.kill)
            time.sleep(after)
            self.assertEqual(run.end(), 130, run.text)
            # on a fast machine the demonstration has begun at 2 s
            self.assertEqual([line for line in run.lines if line.strip() and '[INFO]' not in line], [])
            self.assertEqual(left_behind(uri), [])

    def test_an_unknown_argument_or_parameter_ends_the_demonstration(self):
        cases = [('stya:=true', 'is stay:= meant?'),
                 ('robot_set:={slp: 1}', '/turtlebot3/slp is unknown; is slip meant')]
        runs = [demo('web:=false', argument) for argument, _ in cases]
        for run, _ in runs:
            self.addCleanup(run.kill)
        for (run, uri), (_, words) in zip(runs, cases):
            self.assertEqual(run.wait(200.0), 1, run.text)
            line, = [each for each in run.lines if 'FATAL' in each or 'tb3_labs: ' in each]
            self.assertIn(words, line)
            self.assertNotIn('RLException', run.text)
            self.assertEqual(left_behind(uri), [])
