#!/usr/bin/env python3
"""Marks submissions whose marks are known.

They are the nodes of student_nodes/, written as a student writes them, and the same nodes with one
deliberate mistake each. Each mistake must lose the marks that it should, and no others.
"""
import csv
import os
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple

import rospkg
import rostest

from tb3_labs.ros.marking import box

PACKAGE = Path(rospkg.RosPack().get_path('tb3_labs'))
NODES = PACKAGE / 'test' / 'ros' / 'student_nodes'
TURN, MOVE, IMU, PAD = 'turtlebot_controller.py', 'move2goal.py', 'imu_sub.py', 'gamepad.py'
EVERYTHING = 'everything'
NAME = '<package format="2"><name>lab2</name><version>0.0.0</version><description>A lab' \
    '</description><maintainer email="student@example.org">A student</maintainer><license>BSD' \
    '</license><buildtool_depend>catkin</buildtool_depend><depend>std_msgs</depend>' \
    '<build_depend>message_generation</build_depend></package>\n'
#: A package with a message of its own, as the handout has it.
CMAKE = '''cmake_minimum_required(VERSION 3.0)
project(lab2)
find_package(catkin REQUIRED COMPONENTS message_generation std_msgs)
add_message_files(FILES MouseController.msg)
generate_messages(DEPENDENCIES std_msgs)
catkin_package()
'''
MESSAGE = 'Header header\nstd_msgs/Bool status\nfloat32 xPos\nfloat32 yPos\n'
OWN_MESSAGE = [('from tb3_labs.msg import', 'from lab2.msg import')]
#: No other program sleeps for this time [s].
SLEEP = '97531'
HANG = """        import subprocess
        import time
        subprocess.Popen(['sleep', '{}'], start_new_session=True)
        while True:
            time.sleep(1.0)
""".format(SLEEP)
FLOOD = """        def flood():
            import time
            while True:
                print(self.yaw, self.goal)
                time.sleep(2e-4)
        threading.Thread(target=flood, daemon=True).start()
"""
#: At its end this node says what delay its robot has.
TELLS_DELAY = [
    ("    rospy.init_node('imu_sub')", """    rospy.init_node('imu_sub')
    from dynamic_reconfigure.client import Client
    delay = Client('turtlebot3', timeout=10).get_configuration()['sensor_latency']"""),
    ("        print('Shutting", "        print('sensor_latency: {}\\n'.format(delay), end='')\n        print('Shutting")]


class Case(NamedTuple):
    """A submission: a node of student_nodes, what is replaced in it, and the criteria it fails."""

    student: str
    node: str
    changes: list
    lost: set


#: This number of mark.py runs at a time; each marks no more submissions at a time than JOBS. More
#: of them hold the robots up, and each is tried twice.
AT_A_TIME, JOBS = 3, 4
UNCLAMPED = ('min(max(abs(K_HDG * error), MIN_ANG_Z), MAX_ANG_Z)', 'abs(K_HDG * error)')
WRONG_SIDE = ('self.yaw + 90', 'self.yaw - 90')
#: (lab, its parts) or (lab, its parts, network) -> submissions, the longest runs first. What a
#: student gets wrong most easily comes with its part alone. A submission has several mistakes if
#: they lose different criteria, since each submission costs a robot and a master.
CASES = {
    ('turn', 'turns'): [
        Case('across the jump', TURN, [
            ('.to_euler(degrees=True)[2] % 360', '.to_euler(degrees=True)[2]'),
            ('(self.yaw + 90) % 360', 'self.yaw + 90'), ('(self.yaw - 90) % 360', 'self.yaw - 90'),
            ('error -= 360', 'pass'), ('error += 360', 'pass'), UNCLAMPED],
             {'short_way', 'clamped'}),
        Case('endless loop', TURN, [("    rospy.init_node('controller')", '    import time\n    while True: time.sleep(1.0)')],
             EVERYTHING),
        Case('flood', TURN, [('        threading.Thread(', FLOOD + '        threading.Thread('),
                             WRONG_SIDE],
             {'answers_nonsense', 'left', 'short_way'}),
        Case('syntax error', TURN, [('def turn(self):', 'def turn(self)')], EVERYTHING),
    ],
    ('turn', ''): [
        Case('good', TURN, OWN_MESSAGE, set()),
    ],
    ('move2goal', 'drive,reset,control'): [
        Case('good', MOVE, [], set()),
    ],
    ('move2goal', 'drive'): [
        Case('driven through', MOVE, [('math.hypot(dx, dy) < DISTANCE_TOL', 'False'),
                                      ('if self.control and', 'if')],
             {'waits', 'goal_place', 'goal_heading', 'says_reached', 'silent_at_goal'}),
    ],
    ('gamepad', ''): [
        Case('good', PAD, [], set()),
        Case('waits for the service', PAD, [
            ('threading.Thread(target=self.reset, daemon=True).start()', 'self.reset()')],
            {'not_blocked'}),
    ],
    ('turn', 'mouse,both'): [
        Case('blocking input', TURN, [
            ('threading.Thread(target=self.keyboard, daemon=True).start()', 'pass'),
            ('            self.control()\n', '            if self.goal is None:\n'
             "                self.handle(input('l or r? '))\n            self.control()\n")],
            {'mouse_drives', 'mouse_dead_zone', 'mouse_off', 'mouse_after_turn', 'mouse_in_turn'}),
    ],
    ('turn', 'shutdown'): [
        Case('hangs', TURN, [('        self.pub.publish(Twist())\n\n    def run', HANG
                              + '\n    def run')], {'clean_exit', 'stops_robot'}),
    ],
    ('imu', 'heading'): [
        Case('good', IMU, [], set()),
        Case('no wrap', IMU, [('if yaw < 0:', 'if yaw < -999:')], {'from_0_to_360'}),
    ],
    ('imu', 'heading', 'bad'): [
        Case('good', IMU, TELLS_DELAY, set()),
    ],
}


def hand_in(folder, case):
    """Write a submission: no exec bit, and one of them has Windows line endings."""
    code = (NODES / case.node).read_text()
    for old, new in case.changes:
        assert old in code, old
        code = code.replace(old, new)
    package = folder / case.student / 'lab2'
    (package / 'scripts').mkdir(parents=True)
    (package / 'package.xml').write_text(NAME)
    (package / 'CMakeLists.txt').write_text(CMAKE)
    if case.changes is OWN_MESSAGE:
        (package / 'msg').mkdir()
        (package / 'msg' / 'MouseController.msg').write_text(MESSAGE)
    if WRONG_SIDE in case.changes:
        code = code.replace('\n', '\r\n')
    (package / 'scripts' / case.node).write_bytes(code.encode())


class Page(HTMLParser):
    """What a page refers to; every element must be closed."""

    def __init__(self, path):
        super().__init__()
        self.links, self.pictures, self.open, self.words = [], [], [], ''
        self.feed(path.read_text(encoding='utf-8'))
        assert not self.open, self.open

    def handle_starttag(self, tag, attributes):
        if tag not in ('meta', 'img'):
            self.open.append(tag)
        self.links += [value for name, value in attributes if name == 'href']
        self.pictures += [value for name, value in attributes if name == 'src']

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        self.words += data


class MarkTest(unittest.TestCase):
    """mark.py runs once for each lab and parts of it; the tests look at what it wrote."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix='mark test ')    # spaces happen
        cls.temporary = Path(cls.folder.name) / 'tmp'
        cls.temporary.mkdir()
        with ThreadPoolExecutor(AT_A_TIME) as pool:
            cls.runs = dict(zip(CASES, pool.map(cls.run_mark, CASES)))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def run_mark(cls, key):
        """Mark these submissions; (folder of the marks, what was printed, exit status)."""
        lab, parts, network = (key + ('quiet',))[:3]
        base = Path(cls.folder.name) / ' '.join(key)
        for case in CASES[key]:
            hand_in(base / 'submissions', case)
        done = subprocess.run(
            ['rosrun', 'tb3_labs', 'mark.py', str(base / 'submissions'), '--lab', lab, '-o',
             str(base / 'marks'), '--parts', parts, '--network', network, '--jobs',
             str(min(JOBS, len(CASES[key]))), '--limit', '120']
            + ['--unprotected'] * bool(box.problem()),
            env=dict(os.environ, TMPDIR=str(cls.temporary)), stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, timeout=560, universal_newlines=True)
        return base / 'marks', done.stdout, done.returncode

    def rows(self, key):
        folder, printed, status = self.runs[key]
        self.assertEqual(status, 0, printed)
        with open(str(folder / 'marks.csv'), newline='', encoding='utf-8') as file:
            return {row['student']: row for row in csv.DictReader(file)}

    def check(self, *key):
        """Each submission lost what it should, and nothing else."""
        rows = self.rows(key)
        self.assertEqual(sorted(rows), sorted(case.student for case in CASES[key]))
        lost, expected = {}, {}
        for case in CASES[key]:
            row = rows[case.student]
            names = list(row)
            graded = [name for name in names[3:names.index('node')]
                      if not name.startswith('extra_')]
            self.assertEqual(float(row['points']), sum(float(row[name]) for name in graded))
            lost[case.student] = {name for name in graded if float(row[name]) == 0.0}
            expected[case.student] = set(graded) if case.lost == EVERYTHING else case.lost
        self.assertEqual(lost, expected)

    def test_turn_good(self):
        self.check('turn', '')

    def test_turn_turns(self):
        self.check('turn', 'turns')

    def test_turn_mouse(self):
        self.check('turn', 'mouse,both')

    def test_turn_shutdown(self):
        self.check('turn', 'shutdown')

    def test_move2goal_good(self):
        self.check('move2goal', 'drive,reset,control')

    def test_move2goal_drive(self):
        self.check('move2goal', 'drive')

    def test_gamepad(self):
        self.check('gamepad', '')

    def test_imu(self):
        self.check('imu', 'heading')

    def test_a_bad_network_is_the_robots_and_is_told(self):
        self.check('imu', 'heading', 'bad')
        told = [Page(self.runs[key][0] / 'good.html').words for key in (
            ('imu', 'heading', 'bad'), ('imu', 'heading'))]
        self.assertIn('sensor_latency: 0.03', told[0])
        self.assertEqual(['Judged over the network "bad".' in words for words in told],
                         [True, False])

    def test_the_pages(self):
        for key in CASES:
            folder = self.runs[key][0]
            overview = Page(folder / 'overview.html')
            self.assertEqual(len(overview.links), len(CASES[key]))
            for case in CASES[key]:
                page = Page(folder / (case.student + '.html'))
                self.assertEqual(bool(page.pictures), True)
                self.assertTrue(all(source.startswith('data:image/png;base64,')
                                    for source in page.pictures))
                if case.lost:
                    self.assertIn('see doc/', page.words)

    def test_what_was_seen_is_told(self):
        def words(key, student):
            return Page(self.runs[key][0] / (student + '.html')).words
        for key, student, sentence in (
                (('turn', 'turns'), 'flood', 'to the right, then stopped; see doc/imu_lab.md'),
                (('turn', 'turns'), 'flood', 'Windows line endings'),
                (('turn', 'turns'), 'syntax error', 'it ended at once: "SyntaxError'),
                (('turn', 'turns'), 'endless loop', 'it ran, but never listened'),
                (('turn', 'turns'), 'flood', 'lines were printed in'),
                (('turn', 'turns'), 'across the jump', 'rad/s while turning'),
                (('turn', 'shutdown'), 'hangs', 'still running 5 s after Ctrl+C'),
                (('move2goal', 'drive'), 'driven through', 'still moving after')):
            self.assertIn(sentence, words(key, student))

    def test_a_flood_fills_nothing(self):
        folder = self.runs['turn', 'turns'][0]
        sizes = {path: path.stat().st_size for path in folder.rglob('*') if path.is_file()}
        self.assertLess(max(sizes.values()), 1000000, sizes)

    def test_nothing_is_left(self):
        self.assertEqual(list(self.temporary.glob('tb3_labs_*')), [])
        lines = subprocess.check_output(['ps', '-eo', 'args'], universal_newlines=True)
        self.assertNotIn('sleep ' + SLEEP, lines)
        self.assertNotIn(str(self.temporary), lines)

    def test_progress_is_told(self):
        printed = self.runs['turn', ''][1]
        self.assertIn('[1/1] good ...', printed)
        self.assertRegex(printed, r'\[1/1\] good: 30 of 30 points, \d+ s')


if __name__ == '__main__':
    rostest.rosrun('tb3_labs', 'mark', MarkTest)
