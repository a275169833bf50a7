#!/usr/bin/env python3
"""The network, the master and the disk: gone during a drive, and back. Each test is a process of
its own, since a process cannot change its master."""
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
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, String

from costs import free_port
from node_case import STARTING, ZERO, Hiccups, Node, Program, watch_robot
from panel_page import Page
from rosunit_internals import rosrun
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.ros.program import Observer
from two_hosts import TwoHosts

DEMO = os.path.join(rospkg.RosPack().get_path('tb3_labs'), 'scripts', 'demo.sh')


class Room:
    """A master, a robot, move_to_goal during a drive, and an observer."""

    def __init__(self, port, on_robot=None):
        self.port, self.nodes = port, []
        self.start_master()
        rospy.init_node('watcher', disable_signals=True)
        self.seen, self.hiccups = Observer(), Hiccups()
        watch_robot(self.seen)
        self.seen.watch('imu', Imu)
        self.seen.watch('goal_state', String, lambda message: message.data)
        self.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=5)    # each word counts
        self.goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        robot = 'fake_turtlebot3.py', '__name:=turtlebot3', '_imu_rate:=100'
        with on_robot or contextlib.nullcontext():
            self.robot = self.start(*robot)
        self.node = self.start('move2goal_tf.py')

    def start(self, executable, *arguments):
        self.nodes.append(Node(executable, *arguments))
        return self.nodes[-1]

    def start_master(self):
        self.master = subprocess.Popen(['rosmaster', '--core', '-p', str(self.port)],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        assert wait_until(rosgraph.is_master_online, STARTING), 'no master'

    def kill_master(self):
        self.master.kill()
        self.master.wait()

    def drive(self, x):
        """Drive towards (x, 0, 0); returns in full motion."""
        self.seen.wait_for('goal_state', seconds=STARTING)
        self.seen.wait_until(lambda: self.control.get_num_connections() and (
            self.goals.get_num_connections()), STARTING, 'move_to_goal')
        self.goals.publish(to_pose_stamped(Pose2(x, 0.0, 0.0), 'local', 0.0))
        self.control.publish(False)
        self.control.publish(True)
        self.seen.wait_for('cmd_vel', lambda command: command[0] > 0.2)

    def reach(self):
        self.seen.wait_for('goal_state', lambda state: state == 'GOAL_REACHED', 30.0)

    def go_back_to(self, x):
        """Send this goal until it is reached: after a long cut, TCP waits for seconds before it
        sends again, in each direction for itself. Then the sensors are back, and the commands not
        yet."""
        outcome = ''
        for _ in range(3):
            self.seen.forget('goal_state')
            self.goals.publish(to_pose_stamped(Pose2(x, 0.0, 0.0), 'local', 0.0))
            outcome = self.seen.wait_for('goal_state', lambda state: state == 'GOAL_REACHED' or (
                state.startswith('gave up')), 30.0)
            if 'does not move' not in outcome:
                break
        assert outcome == 'GOAL_REACHED', outcome

    def wait(self, seconds):
        until = time.monotonic() + seconds
        self.seen.wait_until(lambda: time.monotonic() > until)

    def close(self):
        for node in self.nodes:
            node.kill()
        self.kill_master()


@contextlib.contextmanager
def room():
    """A Room with a master of its own on this computer."""
    port = free_port()
    os.environ.update(ROS_MASTER_URI='http://localhost:%d' % port, ROS_HOSTNAME='localhost')
    with contextlib.closing(Room(port)) as opened:
        yield opened


def master_gone_and_back():
    """A master does not answer, as behind a network that is cut; it dies; a new one knows no node.
    Connections go on, and no node waits for a master to drive, to stop or to end."""
    with room() as lab:
        lab.drive(0.8)
        lab.master.send_signal(signal.SIGSTOP)
        lab.reach()
        times = [at for at, _ in lab.seen.all('cmd_vel')]
        pauses = [after - before - lab.hiccups.since(before, after)
                  for before, after in zip(times, times[1:])]
        assert max(pauses) < 0.4, 'no command for %.2f s' % max(pauses)
        lab.drive(2.0)
        lab.kill_master()
        lab.seen.wait_for('ground_truth', lambda pose: pose.x > 1.1)
        lab.robot.send(signal.SIGSTOP)
        last = lab.seen.all('imu')[-1][0]
        lab.seen.wait_for('cmd_vel', lambda command: command == ZERO)
        zero = lab.seen.all('cmd_vel')[-1][0]
        assert zero - last < 0.4 + lab.hiccups.since(last, zero), 'late zero without a master'
        lab.robot.send(signal.SIGCONT)
        lab.seen.wait_for('cmd_vel', lambda command: command[0] > 0.2)
        lab.start_master()
        nodes = subprocess.check_output(['rosnode', 'list'], universal_newlines=True).split()
        assert '/move_to_goal' not in nodes, nodes
        lab.reach()
        assert lab.node.status is None and 'Traceback' not in lab.node.text, lab.node.text
        lab.master.send_signal(signal.SIGSTOP)
        begun = time.monotonic()
        assert lab.node.end() == 0, lab.node.text
        assert time.monotonic() - begun < 8.0, 'the node did not end'


def connected_to(node):
    """The names of the nodes that are connected to a node's publishers."""
    address = rosgraph.Master(rospy.get_name()).lookupNode(node)
    _, _, links = xmlrpc.client.ServerProxy(address).getBusInfo(rospy.get_name())
    return {name for _, name, direction, *_ in links if direction == 'o'}


def panel_without_a_master():
    """A page that was opened after the master died stops the robot; no thread waits for it."""
    page_port = free_port()
    with room() as lab:
        panel = lab.start('panel.py', '_port:=%d' % page_port)
        panel.wait_for('in a browser')
        lab.seen.wait_until(lambda: {'/move_to_goal', '/turtlebot3'} <= connected_to('/panel'))
        lab.drive(3.0)
        lab.seen.wait_for('ground_truth', lambda pose: pose.x > 0.1)
        lab.kill_master()
        for stop in 'stop', 'take':
            page = Page('http://localhost:%d/' % page_port)
            page.wait_until(lambda: 'picture' in page.latest, 5.0, 'a picture')
            assert page.ask('begin') == (True, ''), page.answers
            page.ask('let go')
            if stop == 'take':
                lab.drive(3.0)
            said_at = time.time()
            confirmed, text = page.ask(stop)
            assert confirmed, text
            lab.seen.wait_for('cmd_vel', lambda command: command == ZERO)
            lab.wait(0.3)
            moving = [at for at, command in lab.seen.all('cmd_vel') if command != ZERO][-1]
            assert moving - said_at < 0.1 + lab.hiccups.since(said_at, moving), (
                'it drove on for %.2f s' % (moving - said_at))
        assert panel.status is None and 'Traceback' not in panel.text, panel.text


def network_cut_and_back():
    """Both sides stop; after a short cut the drive goes on, after a long one it was given up."""
    hosts = TwoHosts()
    try:
        with hosts.on('laptop'):
            with contextlib.closing(Room(11311, hosts.on('robot'))) as lab:
                # the robot's own messages of its true pose, on its side of the cut
                with hosts.on('robot'):
                    truth = Program(['rostopic', 'echo', '-p', '/ground_truth/pose/position/x'])
                lab.nodes.append(truth)
                lab.drive(3.0)
                truth.wait_for('\n', times=3)
                for seconds in (0.6, 5.0):
                    hosts.connect(False)
                    cut = time.time()
                    lab.seen.wait_for('cmd_vel', lambda command: command == ZERO)
                    zero = lab.seen.all('cmd_vel')[-1][0] - cut
                    withheld = lab.hiccups.since(cut, cut + zero)
                    assert zero < 0.4 + withheld, 'the laptop stopped after %.2f s' % zero
                    lab.wait(max(0.0, cut + seconds - time.time()))
                    hosts.connect(True)
                    if seconds < 1.0:
                        lab.seen.wait_for('cmd_vel', lambda command: command[0] > 0.2, 10.0)
                        continue
                    lab.seen.wait_for('goal_state', lambda state: state.startswith('gave up'),
                                       20.0)
                    rest = rest_after(truth, cut)
                    print('network cut: zero after %.2f s, robot at rest after %.2f s' % (
                        zero, rest))
                    assert rest < 0.5 + 0.5, 'the robot came to rest after %.2f s' % rest
                lab.go_back_to(0.2)
                assert 'Traceback' not in lab.node.text, lab.node.text
    finally:
        hosts.remove()


def rest_after(truth, cut):
    """Seconds from `cut` to the last motion before the standstill in it, by lines of rostopic."""
    lines = re.findall(r'^(\d+),(\S+)\n', truth.text, re.M)
    samples = [(int(at) * 1e-9, float(x)) for at, x in lines]
    assert samples[-1][0] > cut + 2.0, 'the truth is not told'
    return max([at - cut for (_, before), (at, x) in zip(samples, samples[1:])
                if cut < at < cut + 2.0 and abs(x - before) > 1e-5], default=0.0)


def listening(environment):
    """{(address, port)} on which processes with this environment's master listen."""
    master, inodes = environment['ROS_MASTER_URI'].encode(), set()
    for process in Path('/proc').glob('[0-9]*'):
        with contextlib.suppress(OSError):    # it has ended
            is_ours = master in (process / 'environ').read_bytes()
            for descriptor in map(str, process.glob('fd/*') if is_ours else ()):
                with contextlib.suppress(OSError):    # it was closed
                    inodes.update(re.findall(r'socket:\[(\d+)\]', os.readlink(descriptor)))
    found = set()
    for table in 'tcp', 'tcp6':
        for line in Path('/proc/net', table).read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = line.split()[:10]
            if state == '0A' and inode in inodes:
                address, port = map(bytes.fromhex, local.split(':'))
                words = [address[at:at + 4][::-1] for at in range(0, len(address), 4)]
                found.add((ipaddress.ip_address(b''.join(words)), int.from_bytes(port, 'big')))
    return found


def demonstration_on_a_full_disk():
    """From the README's own shell: all sockets listen on the loopback. The drive goes on although
    the disk is full, and the recorder reports that the recording does not."""
    has_small_disk = os.geteuid() == 0 and not subprocess.call(
        ['unshare', '-m', 'true'], stderr=subprocess.DEVNULL)
    environment = dict(os.environ, ROS_MASTER_URI='http://localhost:{}'.format(free_port()),
                       PYTHONUNBUFFERED='1')    # its output is seen at once
    with tempfile.TemporaryDirectory() as folder:
        mount = 'mount -t tmpfs -o size=2m tmpfs {0} && '.format(folder) if has_small_disk else ''
        launch = subprocess.Popen(
            ['unshare', '-m'] * has_small_disk + [
                'sh', '-c', '{0}cd {1} && PWD={1} exec {2} drives:=1 record:={3}'.format(
                    mount, folder, DEMO, str(has_small_disk).lower())],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
            env=environment, universal_newlines=True)
        output = ''
        for line in launch.stdout:
            output += line
            if 'MOVE_FORWARD' in line:    # by then all its programs run
                break
        sockets = listening(environment)
        output += launch.communicate(timeout=2.0 * STARTING)[0]
    print(output[-3000:])
    assert len(sockets) >= 8, sockets
    assert all(address.is_loopback for address, _ in sockets), sockets
    assert 'Goal reached!' in output, output
    assert not has_small_disk or re.search(
        r'Less than 1G of space free on disk .* Disabling recording', output), output


SCENES = {scene.__name__: scene for scene in (
    master_gone_and_back, panel_without_a_master, network_cut_and_back,
    demonstration_on_a_full_disk)}


class NetworkTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        """The scenes are independent, each with a master of its own: all run at the same time."""
        pool = ThreadPoolExecutor(len(SCENES))
        cls.addClassCleanup(pool.shutdown)
        cls.no_hosts = TwoHosts.missing()
        cls.played = {name: pool.submit(cls.play, name) for name in SCENES
                      if name != 'network_cut_and_back' or not cls.no_hosts}

    @staticmethod
    def play(scene):
        """One scene in a process of its own: (exit status, output)."""
        played = subprocess.run([sys.executable, os.path.realpath(__file__), scene],
                                timeout=4.0 * STARTING, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, universal_newlines=True)
        return played.returncode, played.stdout[-3000:]

    def check(self, scene):
        status, output = self.played[scene].result()
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

    def test_the_demonstration_on_a_full_disk_listens_on_the_loopback_only(self):
        self.check('demonstration_on_a_full_disk')


if __name__ == '__main__':
    if sys.argv[1:] and sys.argv[1] in SCENES:
        SCENES[sys.argv[1]]()
    else:
        rosrun('network', NetworkTest)
