"""The network, the master and the disk: gone during a drive, and back."""
import contextlib
import ipaddress
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import rosgraph
import rospkg
import rospy
from sensor_msgs.msg import Imu

from masters import free_port, processes_with, start_master
from drive_case import DriveCase
from node_case import SILENCE, STARTING, TestProgram
from panel_page import PanelPage, address_of
from rosunit_internals import needs_setup
from tb3_labs.geometry.se2 import Pose2
from two_hosts import TwoHosts

SCENES = 'master_gone_and_back', 'panel_without_a_master', 'network_cut_and_back'
DEMO = os.path.join(rospkg.RosPack().get_path('tb3_labs'), 'scripts', 'demo.sh')


class Scenes(DriveCase):
    """A scene has a master, a robot, and move_to_goal during a drive. It runs in a separate process,
    since a process cannot change its master."""

    @classmethod
    def setUpClass(cls):
        """Do nothing. open() calls the method of the base class after the start of the master."""

    def open(self, port, **on_robot):
        """Start all nodes, and a master at this port. `on_robot` has options of the robot's Node."""
        self.port = port
        self.start_master()
        rospy.init_node('watcher', disable_signals=True)
        super().setUpClass()
        self.observer.watch('imu', Imu)
        self.robot = self.start('fake_turtlebot3.py', '__name:=turtlebot3', '_imu_rate:=50',
                                **on_robot)
        self.node = self.start('move2goal_tf.py')

    def start_master(self):
        self.master = start_master(self.port)
        self.addCleanup(self.master.kill)

    def open_here(self):
        """Start all nodes on this computer."""
        port = free_port()
        os.environ.update(ROS_MASTER_URI='http://localhost:%d' % port, ROS_HOSTNAME='localhost')
        self.open(port)

    def drive(self, x):
        """Drive towards (x, 0, 0). Returns when the robot drives fast."""
        self.observer.wait_for('goal_state', seconds=STARTING)
        self.wait_for_subscriber(self.control, self.goals)
        self.go_to(Pose2(x))
        self.control.publish(False)
        self.control.publish(True)
        self.wait_for_speed(0.2)

    def go_back_to(self, x):
        """Send this goal until it is reached. After a long cut TCP waits for seconds before it sends again, and
        each direction waits separately. So messages of sensors may arrive before the commands do."""
        outcome = ''
        for _ in range(3):
            self.observer.forget('goal_state')
            self.go_to(Pose2(x))
            outcome = self.wait_for_state('GOAL_REACHED', 'gave up', seconds=30.0)
            if outcome == 'GOAL_REACHED':
                break
        self.assertEqual(outcome, 'GOAL_REACHED')

    def assert_sound(self, node):
        """The node runs, and printed no traceback."""
        self.assertIsNone(node.status, node.text)
        self.assertNotIn('Traceback', node.text)

    def master_gone_and_back(self):
        """A master does not answer, as if the network were cut. Then it dies, and a new master knows no node.
        Connections stay, and no node waits for a master to drive, to stop or to end."""
        self.open_here()
        self.drive(0.8)
        self.master.send(signal.SIGSTOP)
        self.wait_for_state('GOAL_REACHED', seconds=30.0)
        times = [at for at, _ in self.observer.all('cmd_vel')]
        pauses = [after - before - self.hiccups.since(before, after)
                  for before, after in zip(times, times[1:])]
        self.assertLess(max(pauses), 0.4)
        self.drive(2.0)
        self.master.kill()
        self.observer.wait_for('ground_truth', lambda pose: pose.x > 1.1)
        self.robot.send(signal.SIGSTOP)
        self.zero_since(self.observer.all('imu')[-1][0], 0.4)
        self.robot.send(signal.SIGCONT)
        self.wait_for_speed(0.2)
        self.start_master()
        nodes = subprocess.check_output(['rosnode', 'list'], universal_newlines=True).split()
        self.assertNotIn('/move_to_goal', nodes)
        self.wait_for_state('GOAL_REACHED', seconds=30.0)
        self.assert_sound(self.node)
        self.master.send(signal.SIGSTOP)
        self.assertEqual(self.node.end(seconds=8.0), 0)

    def panel_without_a_master(self):
        """A page that was opened after the master died stops the robot, and no thread hangs."""
        self.open_here()
        panel = self.start('panel.py', '_port:=%d' % free_port())
        address = address_of(panel)
        self.observer.wait_until(lambda: {'/move_to_goal', '/turtlebot3'} <= connected_to('/panel'))
        self.drive(3.0)
        self.observer.wait_for('ground_truth', lambda pose: pose.x > 0.1)
        self.master.kill()
        page = PanelPage(address)
        page.hold(pad={})    # which makes the panel ask the master
        page.wait_for(page='this')
        said_at = time.time()
        self.assertEqual(page.ask('stop'), (True, 'control taken, the robot stands'))
        self.let_pass(SILENCE)
        self.assert_stopped(said_at, 0.1)
        self.assert_sound(panel)

    def network_cut_and_back(self):
        """Both sides stop. After a short cut the drive goes on. A long cut ends the drive."""
        hosts = TwoHosts()
        self.addCleanup(hosts.remove)
        hosts.enter('laptop')
        robot = {'prefix': hosts.prefix('robot'), 'environment': hosts.environment('robot')}
        self.open(11311, **robot)
        # the true pose, as the robot's computer receives it during the cut
        truth = TestProgram(
            robot['prefix'] + ['rostopic', 'echo', '-p', '/ground_truth/pose/position/x'],
            environment=robot['environment'])
        self.addCleanup(truth.kill)
        self.drive(3.0)
        truth.wait_for('\n', times=3)
        for seconds in (0.6, 5.0):
            hosts.connect(False)
            cut = time.time()
            zero = self.zero_since(cut, 0.4)
            self.let_pass(cut + seconds - time.time())
            hosts.connect(True)
            if seconds < 1.0:
                self.wait_for_speed(0.2, 10.0)
        self.wait_for_state('gave up')
        rest = rest_after(truth, cut)
        print('network cut: zero after %.2f s, robot at rest after %.2f s' % (zero - cut, rest))
        self.assertLess(rest, 0.5 + 0.5)
        self.go_back_to(0.2)
        self.assert_sound(self.node)


def connected_to(node):
    """The names of the nodes that are connected to a node's publishers."""
    address = rosgraph.Master(rospy.get_name()).lookupNode(node)
    _, _, links = xmlrpc.client.ServerProxy(address).getBusInfo(rospy.get_name())
    return {name for _, name, direction, *_ in links if direction == 'o'}


def rest_after(truth, cut):
    """Returns the time from the cut to the last motion within 2 s, by lines of rostopic [s]."""
    lines = re.findall(r'^(\d+),(\S+)\n', truth.text, re.M)
    samples = [(int(at) * 1e-9, float(x)) for at, x in lines]
    assert samples[-1][0] > cut + 2.0, 'the truth is not told'
    return max([at - cut for (_, before), (at, x) in zip(samples, samples[1:])
                if cut < at < cut + 2.0 and abs(x - before) > 1e-5], default=0.0)


def listening(uri):
    """Returns {(address, port)} on which the processes with this master listen."""
    inodes, found = set(), set()
    for process in processes_with(uri):
        for descriptor in process.glob('fd/*'):
            with contextlib.suppress(OSError):    # it was closed
                inodes.update(re.findall(r'socket:\[(\d+)\]', os.readlink(str(descriptor))))
    for table in 'tcp', 'tcp6':
        for line in Path('/proc/net', table).read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = line.split()[:10]
            if state == '0A' and inode in inodes:
                address, port = map(bytes.fromhex, local.split(':'))
                words = [address[at:at + 4][::-1] for at in range(0, len(address), 4)]
                found.add((ipaddress.ip_address(b''.join(words)), int.from_bytes(port, 'big')))
    return found


class NetworkTest(unittest.TestCase):
    IS_NODE = False

    @classmethod
    def setUpClass(cls):
        """Start all scenes at the same time."""
        pool = ThreadPoolExecutor(len(SCENES))
        cls.addClassCleanup(pool.shutdown)
        cls.no_hosts = TwoHosts.missing()
        cls.played = {scene: pool.submit(cls.play, scene) for scene in SCENES
                      if scene != 'network_cut_and_back' or not cls.no_hosts}

    @staticmethod
    def play(scene):
        """Run a scene in a separate process. Returns (exit status, output)."""
        played = subprocess.run([sys.executable, os.path.realpath(__file__), scene],
                                timeout=4.0 * STARTING, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, universal_newlines=True)
        return played.returncode, played.stdout[-3000:]

    def check(self, scene):
        played = self.played.pop(scene, None)    # another attempt runs it alone
        status, output = played.result() if played else self.play(scene)
        print(output)
        self.assertEqual(status, 0, output)

    def test_a_master_does_not_answer_dies_and_comes_back(self):
        self.check('master_gone_and_back')

    def test_a_page_without_a_master_stops_the_robot(self):
        self.check('panel_without_a_master')

    def test_the_network_is_cut_and_comes_back(self):
        if self.no_hosts:
            self.skipTest(self.no_hosts)
        self.check('network_cut_and_back')

    @needs_setup
    def test_the_demonstration_on_a_full_disk_listens_on_the_loopback_only(self):
        """The drive goes on although the disk is full, and the recorder reports that it stops recording."""
        has_small_disk = os.geteuid() == 0 and not subprocess.call(
            ['unshare', '-m', 'true'], stderr=subprocess.DEVNULL)
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        command = 'cd {} && exec {} drives:=1'.format(folder.name, DEMO)
        prefix = []
        if has_small_disk:
            command = 'mount -t tmpfs -o size=2m tmpfs {} && {} record:=true'.format(folder.name, command)
            prefix = ['unshare', '-m']
        uri = 'http://localhost:{}'.format(free_port())
        demo = TestProgram(prefix + ['sh', '-c', command], environment={'ROS_MASTER_URI': uri})
        self.addCleanup(demo.kill)
        demo.wait_for('MOVE_FORWARD', 3 * STARTING)    # now all its programs run
        sockets = listening(uri)
        demo.wait(2.0 * STARTING)
        print(demo.text[-3000:])
        self.assertGreaterEqual(len(sockets), 8)
        self.assertTrue(all(address.is_loopback for address, _ in sockets), sockets)
        self.assertIn('Goal reached!', demo.text)
        if has_small_disk:
            self.assertRegex(
                demo.text, r'Less than 1G of space free on disk .* Disabling recording')


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], 'Scenes.' + sys.argv[1]], warnings='ignore')
