#!/usr/bin/env python3
"""The network, the master and the disk: gone during a drive, and back. Each test is a process of
its own, since a process cannot change its master."""
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client
from concurrent.futures import ThreadPoolExecutor

import rosgraph
import rospkg
import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, String

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.ros.observer import Observer

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from costs import free_port    # noqa: E402
from node_case import STARTING, ZERO, Hiccups, Node    # noqa: E402 (a relay's folder)
from panel_page import Page    # noqa: E402
from rosunit_internals import rosrun    # noqa: E402
from two_hosts import TwoHosts    # noqa: E402

DEMO = os.path.join(rospkg.RosPack().get_path('tb3_labs'), 'scripts', 'demo.sh')


class Room:
    """A master, a robot, move_to_goal during a drive, and an observer."""

    def __init__(self, port, on_robot=None):
        self.port, self.nodes = port, []
        self.master = None
        self.start_master()
        rospy.init_node('watcher', disable_signals=True)
        self.seen, self.hiccups = Observer(), Hiccups()
        self.seen.watch_robot()
        self.seen.watch('imu', Imu)
        self.seen.watch('goal_state', String, lambda message: message.data)
        self.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=5)    # each word counts
        self.goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        robot = 'fake_turtlebot3.py', '__name:=turtlebot3', '_imu_rate:=100'
        if on_robot is None:
            self.robot = self.start(*robot)
        else:
            with on_robot:
                self.robot = self.start(*robot)
        self.node = self.start('move2goal_tf.py')

    def start(self, executable, *arguments):
        self.nodes.append(Node(executable, *arguments))
        return self.nodes[-1]

    def start_master(self):
        self.master = subprocess.Popen(['rosmaster', '--core', '-p', str(self.port)],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + STARTING
        while time.monotonic() < deadline:
            with socket.socket() as probe:
                host = re.search('//(.*):', os.environ['ROS_MASTER_URI']).group(1)
                if probe.connect_ex((host, self.port)) == 0:
                    return
            time.sleep(0.05)
        raise RuntimeError('no master')

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
        """Send this goal until it is reached: after a long cut, TCP waits for seconds before it sends
        again, in each direction for itself. Then the sensors are back, and the commands not yet.
        """
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
        self.master.kill()
        self.master.wait()


def master_gone_and_back():
    """Connections go on without a master; a new one knows no node."""
    port = free_port()
    os.environ.update(ROS_MASTER_URI='http://localhost:%d' % port, ROS_HOSTNAME='localhost')
    room = Room(port)
    try:
        room.drive(0.8)
        room.master.kill()
        room.master.wait()
        room.reach()
        room.drive(2.0)
        room.robot.send(signal.SIGSTOP)
        last = room.seen.all('imu')[-1][0]
        room.seen.wait_for('cmd_vel', lambda command: command == ZERO)
        zero = room.seen.all('cmd_vel')[-1][0]
        assert zero - last < 0.4 + room.hiccups.since(last, zero), 'late zero without a master'
        room.robot.send(signal.SIGCONT)
        room.seen.wait_for('cmd_vel', lambda command: command[0] > 0.2)
        room.start_master()
        nodes = subprocess.check_output(['rosnode', 'list'], universal_newlines=True).split()
        assert '/move_to_goal' not in nodes, nodes
        room.reach()
        assert room.node.status is None and 'Traceback' not in room.node.text, room.node.text
        assert room.node.end() == 0
    finally:
        room.close()


def connected_to(node):
    """The names of the nodes that are connected to a node's publishers."""
    address = rosgraph.Master(rospy.get_name()).lookupNode(node)
    _, _, links = xmlrpc.client.ServerProxy(address).getBusInfo(rospy.get_name())
    return {name for _, name, direction, *_ in links if direction == 'o'}


def panel_without_a_master():
    """A page that was opened after the master died stops the robot; no thread waits for it."""
    port, page_port = free_port(), free_port()
    os.environ.update(ROS_MASTER_URI='http://localhost:%d' % port, ROS_HOSTNAME='localhost')
    room = Room(port)
    try:
        panel = room.start('panel.py', '_port:=%d' % page_port)
        panel.wait_for('in a browser')
        room.seen.wait_until(lambda: {'/move_to_goal', '/turtlebot3'} <= connected_to('/panel'))
        room.drive(3.0)
        room.seen.wait_for('ground_truth', lambda pose: pose.x > 0.1)
        room.master.kill()
        room.master.wait()
        for stop in 'stop', 'take':
            page = Page('http://localhost:%d/' % page_port)
            page.wait_until(lambda: 'picture' in page.latest, 5.0, 'a picture')
            assert page.ask('begin') == (True, ''), page.answers
            page.ask('let go')
            if stop == 'take':
                room.drive(3.0)
            said_at = time.time()
            confirmed, text = page.ask(stop)
            assert confirmed, text
            room.seen.wait_for('cmd_vel', lambda command: command == ZERO)
            room.wait(0.3)
            moving = [at for at, command in room.seen.all('cmd_vel') if command != ZERO][-1]
            assert moving - said_at < 0.1 + room.hiccups.since(said_at, moving), (
                'it drove on for %.2f s' % (moving - said_at))
        assert panel.status is None and 'Traceback' not in panel.text, panel.text
    finally:
        room.close()


def master_that_does_not_answer():
    """Like a master behind a network that is cut: no node waits for it to drive or to end."""
    port = free_port()
    os.environ.update(ROS_MASTER_URI='http://localhost:%d' % port, ROS_HOSTNAME='localhost')
    room = Room(port)
    try:
        room.drive(0.8)
        room.master.send_signal(signal.SIGSTOP)
        room.reach()
        pauses = [after - before - room.hiccups.since(before, after) for (before, _), (after, _) in zip(
            room.seen.all('cmd_vel'), room.seen.all('cmd_vel')[1:])]
        assert max(pauses) < 0.4, 'no command for %.2f s' % max(pauses)
        begun = time.monotonic()
        assert room.node.end() == 0, room.node.text
        assert time.monotonic() - begun < 8.0, 'the node did not end'
    finally:
        room.master.send_signal(signal.SIGCONT)
        room.close()


def network_cut_and_back():
    """Both sides stop; after a short cut the drive goes on, after a long one it was given up."""
    hosts = TwoHosts()
    try:
        with hosts.on('laptop'):
            room = Room(11311, hosts.on('robot'))
            try:
                # the robot's own messages of its true pose, on its side of the cut
                with hosts.on('robot'):
                    truth = subprocess.Popen(
                        ['rostopic', 'echo', '-p', '/ground_truth/pose/position/x'],
                        stdout=subprocess.PIPE, universal_newlines=True)
                room.nodes.append(_Killable(truth))
                room.drive(3.0)
                for seconds in (0.6, 5.0):
                    hosts.connect(False)
                    cut = time.time()
                    room.seen.wait_for('cmd_vel', lambda command: command == ZERO)
                    zero = room.seen.all('cmd_vel')[-1][0] - cut
                    withheld = room.hiccups.since(cut, cut + zero)
                    assert zero < 0.4 + withheld, 'the laptop stopped after %.2f s' % zero
                    room.wait(max(0.0, cut + seconds - time.time()))
                    hosts.connect(True)
                    if seconds < 1.0:
                        room.seen.wait_for('cmd_vel', lambda command: command[0] > 0.2, 10.0)
                        continue
                    room.seen.wait_for('goal_state', lambda state: state.startswith('gave up'),
                                       20.0)
                    rest = _rest_after(truth, cut)
                    print('network cut: zero after %.2f s, robot at rest after %.2f s' % (
                        zero, rest))
                    assert rest < 0.5 + 0.5, 'the robot came to rest after %.2f s' % rest
                room.go_back_to(0.2)
                assert 'Traceback' not in room.node.text, room.node.text
            finally:
                room.close()
    finally:
        hosts.remove()


class _Killable:
    def __init__(self, process):
        self._process = process

    def kill(self):
        self._process.kill()
        self._process.wait()


def _rest_after(truth, cut):
    """Seconds from `cut` to the last motion before the standstill in it."""
    moved, last = cut, None
    for line in truth.stdout:
        if line[0] == '%':
            continue
        at, x = line.split(',')
        at, x = int(at) * 1e-9, float(x)
        if last is not None and at > cut and abs(x - last) > 1e-5:
            moved = at
        last = x
        if at > cut + 2.0:
            return moved - cut


def own_master():
    """This environment, with the address of a master that is not started yet."""
    return dict(os.environ, ROS_MASTER_URI='http://localhost:{}'.format(free_port()))


def _listening(root):
    """{(address, port)} of the listening sockets of a process and all its descendants."""
    parents = {}
    for pid in filter(str.isdigit, os.listdir('/proc')):
        try:
            with open('/proc/%s/stat' % pid) as stat:
                parents[int(pid)] = int(stat.read().rpartition(')')[2].split()[1])
        except OSError:
            continue
    family = {root}
    while True:
        more = {pid for pid, parent in parents.items() if parent in family} - family
        if not more:
            break
        family |= more
    inodes = set()
    for pid in family:
        for descriptor in os.listdir('/proc/%d/fd' % pid):
            try:
                target = os.readlink('/proc/%d/fd/%s' % (pid, descriptor))
            except OSError:
                continue
            inodes.update(re.findall(r'socket:\[(\d+)\]', target))
    found = set()
    for name, size in (('tcp', 4), ('tcp6', 16)):
        with open('/proc/net/' + name) as table:
            for line in list(table)[1:]:
                fields = line.split()
                if fields[3] == '0A' and fields[9] in inodes:
                    address, port = fields[1].split(':')
                    raw = bytes.fromhex(address)
                    if size == 4:
                        text = socket.inet_ntoa(raw[::-1])
                    else:
                        text = socket.inet_ntop(socket.AF_INET6, b''.join(
                            raw[at:at + 4][::-1] for at in range(0, 16, 4)))
                    found.add((text, int(port, 16)))
    return found


def demonstration_on_a_full_disk():
    """From the README's own shell: all sockets listen on the loopback. The drive goes on although
    the disk is full, and the recorder reports that the recording does not."""
    has_small_disk = not no_small_disk()
    with tempfile.TemporaryDirectory() as folder:
        mount = 'mount -t tmpfs -o size=2m tmpfs {0} && '.format(folder) if has_small_disk else ''
        launch = subprocess.Popen(
            ['unshare', '-m'] * has_small_disk + [
                'sh', '-c', '{0}cd {1} && PWD={1} exec {2} drives:=1 record:={3}'.format(
                    mount, folder, DEMO, str(has_small_disk).lower())],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
            env=dict(own_master(), PYTHONUNBUFFERED='1'), universal_newlines=True)    # seen at once
        output = ''
        for line in launch.stdout:
            output += line
            if 'MOVE_FORWARD' in line:    # by then all its programs run
                break
        sockets = _listening(launch.pid)
        output += launch.communicate(timeout=2.0 * STARTING)[0]
    print(output[-3000:])
    print('%d listening sockets: %s' % (len(sockets), sorted({where for where, _ in sockets})))
    assert len(sockets) >= 8, sockets
    assert all(address.startswith('127.') for address, _ in sockets), sockets
    assert 'Goal reached!' in output, output
    assert not has_small_disk or re.search(
        r'Less than 1G of space free on disk .* Disabling recording', output), output


def no_small_disk():
    """'' or the reason why there can be no small disk for one test."""
    if os.geteuid() or subprocess.call(['unshare', '-m', 'true'], stderr=subprocess.DEVNULL):
        return 'a small disk of its own needs root'
    return ''


SCENES = {scene.__name__: scene for scene in (
    master_gone_and_back, panel_without_a_master, master_that_does_not_answer,
    network_cut_and_back, demonstration_on_a_full_disk)}


class NetworkTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        """The scenes are independent, each with a master of its own: all run at the same time."""
        pool = ThreadPoolExecutor(len(SCENES))
        cls.addClassCleanup(pool.shutdown)
        cls.played = {scene: pool.submit(cls.play, scene) for scene, missing in (
            ('master_gone_and_back', ''), ('panel_without_a_master', ''),
            ('master_that_does_not_answer', ''),
            ('network_cut_and_back', TwoHosts.missing()),
            ('demonstration_on_a_full_disk', '')) if not missing}

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

    def test_the_master_goes_and_comes_back(self):
        self.check('master_gone_and_back')

    def test_a_page_without_a_master_stops_the_robot(self):
        self.check('panel_without_a_master')

    def test_the_master_does_not_answer(self):
        self.check('master_that_does_not_answer')

    def test_the_network_is_cut_and_comes_back(self):
        if TwoHosts.missing():
            self.skipTest(TwoHosts.missing())
        self.check('network_cut_and_back')

    def test_the_demonstration_on_a_full_disk_listens_on_the_loopback_only(self):
        self.check('demonstration_on_a_full_disk')


if __name__ == '__main__':
    if sys.argv[1:] and sys.argv[1] in SCENES:
        SCENES[sys.argv[1]]()
    else:
        rosrun('network', NetworkTest)
