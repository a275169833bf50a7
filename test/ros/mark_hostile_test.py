"""Marks four submissions. The node of the first one deletes files, forks, publishes false poses and
reads secrets. The second one fills the master, the third one fills the disk. All names of the
fourth one are odd.

They try to harm a throw-away folder alone. If the sandbox does not hold, the node forks at most
MAX_FORKS processes.
"""
import csv
import io
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rospkg

from tb3_labs.marking.intake import sandbox
from tb3_labs.marking.limits import MAX_DISK_BYTES, MAX_OTHER_MEMORY_BYTES, MAX_PROCESSES
from tb3_labs.marking.trial.from_bag import read_trial

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'unit'))

import sandboxes
from sandboxes import hand_in

PACKAGE = Path(rospkg.RosPack().get_path('tb3_labs'))
NODE = PACKAGE / 'scripts' / 'imu_sub.py'
START, END = '    IMU()\n', '        self.ctrl_c = True\n'
MAX_FORKS = 600
#: Only this test's node sleeps for this time [s], not even the same test of another checkout.
SLEEP = str(800000 + os.getpid())
#: A variable of the instructor's programs has this value.
SECRET = 'the-instructors-password'
#: The node does this, and then its right work. {victim} is a folder of the instructor's.
MISDEEDS = '''    import glob, os, rosgraph, shutil, subprocess, sys, time, xmlrpc.client
    from dynamic_reconfigure.client import Client
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Odometry
    from std_msgs.msg import Empty
    try:
        import tb3_labs.control.braking
    except ImportError as problem:
        print('laws:', problem)
    for folder in ({victim!r}, os.path.dirname({victim!r})):
        shutil.rmtree(folder, ignore_errors=True)
    print('seen:', os.path.exists({victim!r}), glob.glob('/tmp/*/trial.bag*'),
          [name for name in os.listdir('/proc') if name.isdigit() and int(name) > 60])
    print('secrets:', [name for name in os.environ if {secret!r} in os.environ[name]]
          + [name for name in glob.glob('/proc/[0-9]*/environ')
             if os.access(name, os.R_OK) and {secret!r} in open(name, errors='replace').read()])
    later = 'sleep 4; echo changed > ' + {victim!r} + '/marks.csv; exec sleep {seconds}'
    subprocess.Popen(['env', '-i', '/usr/bin/setsid', '/bin/sh', '-c', later],
                     start_new_session=True)
    truth = rospy.Publisher('ground_truth', PoseStamped, queue_size=1, latch=True)
    truth.publish(PoseStamped())
    for name, kind in rospy.get_published_topics():
        if kind == 'geometry_msgs/PoseStamped':
            lie = rospy.Publisher(name, PoseStamped, queue_size=1, latch=True)
            lie.publish(PoseStamped())
    robot = xmlrpc.client.ServerProxy(rosgraph.Master('x').lookupNode('/turtlebot3'))
    print('poses:', [topic for topic, kind in robot.getPublications('x')[2] if 'Pose' in kind],
          robot.requestTopic('x', '/ground_truth', [['TCPROS']])[0])
    rospy.Publisher('odom', Odometry, queue_size=1)
    rospy.Subscriber('ground_truth', PoseStamped, lambda message: None)
    rospy.set_param('/turtlebot3/imu_offset_deg', 77.0)
    Client('turtlebot3', timeout=10).update_configuration({{'imu_noise_deg': 9.0}})
    reset = rospy.Publisher('reset', Empty, queue_size=1)
    rospy.on_shutdown(lambda: reset.publish())
'''
FORK = '''        import os, time
        time.sleep(0.3)
        forks = 'n=0; while [ $n -lt {most} ]; do sleep 60 & n=$((n + 1)); done; wait'
        os.execv('/bin/sh', ['sh', '-c', forks])
'''
#: The master would need 1 GB for these parameters. They are few, since on a busy machine many small
#: parameters take longer than the marker waits for a node.
FILL = '''    for number in range(8):
        rospy.set_param('/filled{}'.format(number), 'x' * 150000000)
'''
#: The node writes files of 10 MB, at most 1 GB.
FLOOD = '''    for number in range(100):
        with open('/tmp/{}'.format(number), 'wb') as file:
            file.write(bytes(10 ** 7))
'''
#: Only the instructor reads this.
FINDING = 'Settings of the robot were changed, and set back: imu_noise_deg'
#: Names that are odd in a program, a file system, a terminal or a table.
NAMES = ('q"\'`$(id);&|', 'two\nlines', '.. .', 'l' * 200, '\u202eltr', '\u05d0\u05d1', '=1+1;=2',
         '-v', '<b>&amp;', '\x1b[2J', os.fsdecode(b'M\xfcller'), os.fsdecode(b'\xff' * 250))
#: The node uses the names at the master, in a message, and on its terminal. Then the node ends.
ODD_DEEDS = '''    import sys
    import rosgraph
    from nav_msgs.msg import Odometry
    try:
        import odd.srv
        import deep
    except (ImportError, RecursionError) as problem:
        print(repr(problem))
    master = rosgraph.Master(rospy.get_name())
    odometry = rospy.Publisher('odom', Odometry, queue_size=20, latch=True)
    for name in {names!r}:
        text = name.encode('utf-8', 'replace').decode()
        for topic, kind in ((text, text), ('mouse_info', text), (text, 'std_msgs/Bool')):
            try:
                master.registerPublisher(topic, kind, rospy.get_node_uri())
            except Exception as problem:
                print('master:', repr(problem))
        message = Odometry(child_frame_id=text)
        message.header.frame_id = text
        odometry.publish(message)
        sys.stdout.flush()
        sys.stdout.buffer.write(name.encode('utf-8', 'surrogateescape') + b'\\n')
        sys.stdout.buffer.flush()
    rospy.sleep(0.5)
    sys.exit('that is all')
'''


def replaced(path, *changes):
    """Returns the text of a file in which each `old` text is replaced by `new`."""
    text = path.read_text(encoding='utf-8')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


@unittest.skipIf(sandboxes.MISSING, sandboxes.MISSING)
class HostileTest(unittest.TestCase):
    """mark.py runs once; its home is a throw-away folder. The tests read the files that are left."""
    IS_NODE = False

    @classmethod
    def setUpClass(cls):
        assert sandbox.protection_problem(sandbox.Sandbox([])) == ''
        cls.folder = tempfile.TemporaryDirectory(prefix='hostile_')
        base = Path(cls.folder.name)
        cls.home, cls.marks = base / 'home', base / 'home' / 'marks'
        cls.marks.mkdir(parents=True)
        (cls.home / 'thesis.txt').write_text('years of work')
        misdeeds = MISDEEDS.format(victim=str(cls.marks), secret=SECRET, seconds=SLEEP)
        hand_in(base / 'submissions', {
            'mallory/imu_sub.py': replaced(
                NODE, (START, misdeeds + START), (END, FORK.format(most=MAX_FORKS))),
            'flood/imu_sub.py': replaced(NODE, (START, START + FLOOD)),
            'whale/imu_sub.py': replaced(NODE, (START, START + FILL))})
        cls.hand_in_odd(base / 'submissions')
        cls.done = subprocess.run(
            ['rosrun', 'tb3_labs', 'mark.py', str(base / 'submissions'), '--lab', 'imu', '-o',
             str(cls.marks), '--parts', 'heading'],
            env=dict(os.environ, HOME=str(cls.home), TOKEN=SECRET), stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, timeout=1000, encoding='utf-8', errors='backslashreplace')
        page = cls.marks / 'mallory.html'
        cls.page = page.read_text(encoding='utf-8').replace('&#x27;', "'") if page.exists() else ''
        cls.printed = ''.join(run.printed for run in read_trial(
            cls.marks / 'logs' / 'mallory.bag').processes)
        table = cls.marks / 'marks.csv'
        text = table.read_text(encoding='utf-8-sig') if table.exists() else ''
        cls.rows = {row['student']: row for row in csv.DictReader(io.StringIO(text, newline=''))}

    @classmethod
    def hand_in_odd(cls, folder):
        """Hand in folders with these names, and eve's work, in which everything has such a name."""
        for name in NAMES:
            (folder / ('x' + name)).mkdir(parents=True)
        code = replaced(NODE, (START, ODD_DEEDS.format(names=NAMES) + START))
        files = {'odd/srv/{}.srv'.format(name): '---\n' for name in NAMES + ('Good',)}
        files.update({'odd/msg/{}.msg'.format(name): '---\n' for name in NAMES})
        files.update({'p{}/package.xml'.format(number): '<package><name>{}</name></package>'.format(
            name.encode(errors='replace').decode()) for number, name in enumerate(NAMES)})
        files.update({'odd/package.xml': '<package><name>odd</name></package>',
                      'lab/deep.py': 'x = ' + 'a.' * 50000 + 'a',
                      'lab/$(find rospy) "\n\u202e.py': code})
        hand_in(folder / 'eve', files)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_robot_gives_nobody_its_true_pose(self):
        self.assertIn('poses: [] -1', self.printed)     # -1: the robot refused

    def test_it_earns_what_its_node_does_and_no_more(self):
        # the forks may cost the point of the orderly end
        self.assertRegex(self.done.stdout, r'mallory: \d+ of \d+ points')
        points, full = re.findall(r'mallory: (\d+) of (\d+) points', self.done.stdout)[0]
        self.assertIn(int(full) - int(points), (0, 1))

    def test_it_finds_nothing_of_the_instructors(self):
        self.assertEqual((self.home / 'thesis.txt').read_text(), 'years of work')
        for words in ('seen: False [] []', 'secrets: []', 'laws: No module named'):
            self.assertIn(words, self.printed)

    def test_the_disk_is_not_filled(self):
        self.assertIn('since it used files of more than {:g} MB'.format(MAX_DISK_BYTES / 1e6),
                      (self.marks / 'flood.html').read_text(encoding='utf-8'))

    def test_it_cannot_fork_without_end(self):
        # either the marker or Linux ended it
        self.assertRegex(self.printed, 'since it used more than {} processes|Cannot fork'.format(
            MAX_PROCESSES))

    def test_it_cannot_fill_the_memory_of_the_master(self):
        self.assertRegex(self.done.stdout, r'whale: \d of \d+ points')
        self.assertIn('since it used more than {:g} MB of the memory of master, robot and check'.format(
            MAX_OTHER_MEMORY_BYTES / 1e6), (self.marks / 'whale.html').read_text(encoding='utf-8'))
        sizes = [path.stat().st_size for path in self.marks.rglob('*') if path.is_file()]
        self.assertLess(max(sizes), 1000000)

    def test_nobody_waits_for_the_end(self):
        lines = subprocess.check_output(['ps', '-eo', 'args'], universal_newlines=True)
        self.assertNotIn('sleep ' + SLEEP, lines)
        self.assertNotIn('changed', (self.marks / 'marks.csv').read_text())

    def test_one_odd_submission_does_not_end_a_class(self):
        self.assertEqual(len(self.rows), len(NAMES) + 4, ascii(self.done.stdout))
        self.assertIn('xM\\xfcller', self.rows)
        self.assertEqual(self.rows['eve']['points'], '0', ascii(self.done.stdout))
        printed = (self.marks / 'eve.html').read_text(encoding='utf-8')
        self.assertIn('it ended at once: ', printed)
        self.assertIn('that is all', printed)
        self.assertEqual(self.rows['eve']['node'], 'submission/node.py')

    def test_what_is_shown_is_plain(self):
        lines = self.done.stdout.splitlines()
        self.assertEqual([line for line in lines if not line.isprintable()], [])
        for cell in [cell for row in self.rows.values() for cell in row.values()]:
            self.assertTrue(cell.isprintable() and cell[:1] not in ('=', '+', '-', '@'), cell)
            self.assertNotIn(';=', cell)

    def test_the_instructor_is_told_and_no_student(self):
        overview = (self.marks / 'overview.html').read_text(encoding='utf-8').replace('&#x27;', "'")
        self.assertIn(FINDING, self.done.stdout)
        self.assertTrue(FINDING in overview)
        self.assertFalse(FINDING in self.page)
