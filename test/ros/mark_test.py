"""Marks submissions whose marks are known.

They are plain nodes with deliberate mistakes, in the layout of a course's repository, and a skeleton as a student
gets it. Each mistake must lose its own marks, and no other marks. A skeleton must earn nothing.

The check tests of this package's own nodes judge by the same criteria; test/benchmark/wrong_nodes.py
marks many wrong nodes of each lab.
"""
import csv
import html
import os
import pty
import re
import shutil
import runpy
import signal
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple, Optional

import rospkg

from tb3_labs.marking.student_nodes import LAB_NODES
from tb3_labs.ros.clocks import wait_until

from node_case import path_of, plain_node

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'unit'))

import sandboxes

PACKAGE = Path(rospkg.RosPack().get_path('tb3_labs'))
SKELETON = runpy.run_path(str(PACKAGE / 'scripts' / 'skeleton.py'))
#: A machine that cannot make sandboxes marks without them. On other machines sandboxes must work.
UNPROTECTED = ['--unprotected'] if sandboxes.MISSING else []
#: No other program sleeps for this time [s]. In another checkout, this test has another number.
SLEEP = str(900000 + os.getpid())
#: Lines of a node that hangs at Ctrl+C, and leaves a process behind.
HANG = """        import subprocess
        import time
        subprocess.Popen(['sleep', '{}'], start_new_session=True)
        while True:
            time.sleep(1.0)
""".format(SLEEP)
#: Lines of a node that prints more than a person can read, within a second even on a slow machine.
FLOOD = """        def flood():
            import time
            while True:
                print('{} {}\\n'.format(self, msg) * 2000)
                time.sleep(0.1)
        import threading
        if not hasattr(self, 'flooded'):
            self.flooded = threading.Thread(target=flood, daemon=True)
            self.flooded.start()
"""


class Case(NamedTuple):
    """A submission with a mistake or several, and the criteria that it fails."""

    student: str
    node: str
    changes: Optional[list]     # replacements in the plain node; None: the skeleton is handed in
    lost: Optional[set]         # None: all criteria


#: The names of a student who hands in a zip file, and of a student who works on Windows.
ZIPPED, WINDOWS = 'no wrap', 'careless'
#: (lab, its parts, options of mark.py ...) -> submissions. A submission may have several mistakes, since each
#: submission needs a robot and a master.
XBOX, HEADING = ('gamepad', 'buttons,no service', '--pad', 'xbox'), ('imu', 'heading', '--jobs', '2')
CASES = {
    XBOX: [
        # the flood is the node's way to say why a reset failed
        Case(WINDOWS, 'gamepad.py', [
            ('    def joy_callback(self, msg):\n', '    def joy_callback(self, msg):\n' + FLOOD),
            ('msg.buttons[2]', 'msg.buttons[3]'), ('        if self.has_control:', '        if True:'),
            ('self.ctrl_pub.publish(False)', 'pass'), ('_request(0.0', '_request(1.0'),
            ('reset successfully', 'is done')],
             {'silent_meanwhile', 'regains', 'resets', 'says_success'}),
    ],
    HEADING: [
        Case(ZIPPED, 'imu_sub.py', [
            ('return 360 + yaw if yaw < 0 else yaw', 'return yaw'),
            ('        self.ctrl_c = True\n', '        self.ctrl_c = True\n' + HANG)],
             {'from_0_to_360', 'clean_exit'}),
        Case('skeleton', 'imu_sub.py', None, None),
    ],
}


def hand_in(folder, case):
    """Write a student's repository. It has the packages of all labs, as skeleton.py writes them, with
    plain nodes. The nodes are not executable, and one has Windows line endings."""
    repository = folder / case.student
    repository.mkdir(parents=True)
    for name, lab in LAB_NODES.items():
        package, node = lab.packages[0], lab.files[0]
        files = SKELETON['package_files'](PACKAGE / SKELETON['FOLDER'] / name, package)
        place, code = 'src/' + node, plain_node(node, 'lab2')
        if node == case.node:
            code = files[place] if case.changes is None else changed(code, case.changes)
        is_from_windows = node == case.node and case.student == WINDOWS
        files[place] = code.replace('\n', '\r\n') if is_from_windows else code
        SKELETON['write_package'](files, repository / package)
        (repository / package / place).chmod(0o644)
    if case.student == ZIPPED:
        shutil.make_archive(str(folder / (ZIPPED + '_LATE_12_345_lab2')), 'zip',
                            str(folder / ZIPPED))
        shutil.rmtree(str(folder / ZIPPED))


def changed(code, changes):
    """Returns the code with replacements. Each text to replace is there once."""
    for old, new in changes:
        assert code.count(old) == 1, old
        code = code.replace(old, new)
    return code


class MarkTest(unittest.TestCase):
    """mark.py runs once for each key of CASES. The tests read the files that it wrote."""
    IS_NODE = False

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix='mark test ')    # a path may have blanks
        os.chmod(cls.folder.name, 0o711)    # without sandboxes root's programs are another user
        cls.temporary = Path(cls.folder.name) / 'tmp'
        cls.temporary.mkdir()
        cls.program = path_of('mark.py')    # not in threads: the import of catkin_pkg 0.4 fails in two at a time
        with ThreadPoolExecutor(len(CASES)) as pool:
            cls.runs = dict(zip(CASES, pool.map(cls.run_mark, CASES)))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def run_mark(cls, key):
        """Mark the submissions of a key. Returns (folder of the marks, output, exit status)."""
        lab, parts, *own = key
        base = Path(cls.folder.name) / ' '.join(key)
        for case in CASES[key]:
            hand_in(base / 'submissions', case)
        done = subprocess.run(
            [cls.program, str(base / 'submissions'), '--lab', lab, '-o',
             str(base / 'marks'), '--parts', parts, *own] + UNPROTECTED,
            env=dict(os.environ, TMPDIR=str(cls.temporary)), stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, timeout=560, universal_newlines=True)
        return base / 'marks', done.stdout, done.returncode

    def rows(self, key):
        folder, printed, status = self.runs[key]
        self.assertEqual(status, 0, printed)
        with open(str(folder / 'marks.csv'), newline='', encoding='utf-8-sig') as file:
            return {row['student']: row for row in csv.DictReader(file)}

    def test_each_submission_loses_these_criteria_and_no_others(self):
        for key, cases in CASES.items():
            rows = self.rows(key)
            self.assertEqual(sorted(rows), sorted(case.student for case in cases))
            for case in cases:
                row = rows[case.student]
                names = list(row)
                graded = {name: float(row[name]) for name in names[3:names.index('node')]
                          if not name.startswith('extra_')}
                self.assertEqual(float(row['points']), sum(graded.values()))
                self.assertEqual(
                    {name for name in graded if graded[name] == 0.0},
                    set(graded) if case.lost is None else case.lost,
                    self.words_of(key, case.student)[-6000:])

    def words_of(self, key, student):
        page = (self.runs[key][0] / (student + '.html')).read_text(encoding='utf-8')
        self.assertIn('id="timeline"', page)
        self.assertNotIn(str(self.temporary), page)
        return ' '.join(html.unescape(re.sub('<[^>]*>', ' ', page)).split())

    def test_what_was_seen_is_told(self):
        for key, student, sentence in (
                (XBOX, WINDOWS, 'Windows line endings'),
                (XBOX, WINDOWS, 'The pad was "xbox"'),
                (XBOX, WINDOWS, '3 is Y'),
                (HEADING, ZIPPED, 'still running 5 s after Ctrl+C'),
                (HEADING, ZIPPED, 'see doc/imu_lab.md'),
                (HEADING, 'skeleton', 'TODO 2 is open: nothing listens to imu')):
            self.assertIn(sentence, self.words_of(key, student))

    def test_a_flood_fills_nothing(self):
        folder = self.runs[XBOX][0]
        sizes = {path: path.stat().st_size for path in folder.rglob('*') if path.is_file()}
        self.assertLess(max(sizes.values()), 1000000, sizes)

    def test_nothing_is_left(self):
        self.assertEqual(self.left(self.temporary), [])
        self.assertFalse(os.path.exists(self.folder.name.split(' ')[0]))    # a path cut at its blank
        lines = subprocess.check_output(['ps', '-eo', 'args'], universal_newlines=True)
        self.assertNotIn('sleep ' + SLEEP, lines)

    def left(self, folder):
        """Returns the files in a folder for temporary files, and the processes that use the folder."""
        lines = subprocess.check_output(['ps', '-eo', 'args'], universal_newlines=True)
        return os.listdir(str(folder)) + [line for line in lines.splitlines() if str(folder) in line]

    def test_nothing_is_left_if_its_terminal_is_closed_or_it_is_killed(self):
        for number in (signal.SIGTERM, signal.SIGKILL):
            folder = Path(tempfile.mkdtemp(dir=self.folder.name))
            folder.chmod(0o711)
            theirs, terminal = pty.openpty()
            marking = subprocess.Popen(     # setsid makes the terminal mark.py's own
                ['setsid', '--ctty', path_of('mark.py'), str(Path(self.folder.name) / ' '.join(
                    HEADING) / 'submissions'), '--lab', 'imu', '-o', str(folder) + '_marks',
                 *UNPROTECTED],
                env=dict(os.environ, TMPDIR=str(folder)), stdin=terminal, stdout=terminal,
                stderr=terminal)
            os.close(terminal)
            self.assertTrue(wait_until(
                lambda: any('check_lab.py' in line for line in self.left(folder)), 30.0), number)
            if number == signal.SIGTERM:        # the closed terminal sends SIGHUP first
                self.assertNotIn(b'Traceback', os.read(theirs, 100000))
                os.close(theirs)
            marking.send_signal(number)
            marking.wait(30.0)
            if number == signal.SIGKILL:        # nobody is left to remove the files
                os.close(theirs)
                self.assertTrue(wait_until(lambda: not [
                    line for line in self.left(folder) if ' ' in line], 10.0), self.left(folder))
            else:
                self.assertEqual(self.left(folder), [])
