"""robot.launch over a real SSH connection to this computer. The embedded robot stands in for the board, for which a
robot starts rosserial_python."""
import getpass
import math
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import rospkg
import rospy
from geometry_msgs.msg import PoseStamped, Twist

from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.ros.conversions import to_pose2

from masters import free_port, process_of
from node_case import NodeCase, TestProgram

HOST = '127.0.0.1'
CORE, BOARD = '/turtlebot3_core', '/board'
SSHD = shutil.which('sshd', path=os.environ['PATH'] + ':/usr/sbin')
LOADER = pathlib.Path(rospkg.RosPack().get_path('tb3_labs')) / 'launch' / 'env_robot.sh'

#: A stand-in for the board's driver on the robot, with the same package and call. The node has another name, since it
#: takes other parameters.
SERIAL_NODE = '#!/bin/sh\nexec rosrun tb3_labs fake_turtlebot3.py "$@" __name:=board\n'
MANIFEST = ('<package format="2"><name>rosserial_python</name><version>0.0.0</version>'
            '<description>a stand-in</description><license>BSD</license>'
            '<maintainer email="nobody@localhost">nobody</maintainer></package>\n')


def write(path, text, mode=0o600):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(mode)
    return path


def make_key(path):
    """Makes a key without a password. Returns its public half."""
    path.parent.mkdir(parents=True, exist_ok=True)
    subprocess.check_call(['ssh-keygen', '-q', '-t', 'ed25519', '-N', '', '-f', str(path)])
    return path.with_suffix('.pub').read_text()


@unittest.skipUnless(SSHD and shutil.which('ssh-keygen'),
                     'sshd is not installed (apt install openssh-server)')
class RobotTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix='robot_test_')
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.make_robot()
        cls.start_sshd()
        super().setUpClass()
        cls.observer.watch('/ground_truth', PoseStamped, lambda message: (
            message.header.stamp.to_sec(), to_pose2(message.pose)))    # by the robot's own time

    @classmethod
    def make_robot(cls):
        """Make the robot's workspace, and its env_robot.sh with the values set."""
        here = os.environ['CMAKE_PREFIX_PATH'].split(':')[0]
        packages = cls.folder / 'packages'
        write(packages / 'rosserial_python' / 'package.xml', MANIFEST)
        write(packages / 'rosserial_python' / 'serial_node.py', SERIAL_NODE, 0o700)
        setup = write(cls.folder / 'setup.bash', 'source {}/setup.bash\n'
                      'ROS_PACKAGE_PATH={}:$ROS_PACKAGE_PATH\n'.format(here, packages))
        lines = LOADER.read_text().splitlines()
        for key, value in (('setup=', setup), ('model=', 'waffle')):
            number, = [number for number, line in enumerate(lines) if line.startswith(key)]
            lines[number] = key + str(value)
        cls.loader = write(cls.folder / 'env_robot.sh', '\n'.join(lines) + '\n', 0o700)

    @classmethod
    def start_sshd(cls):
        """Start sshd on a free port for one key, and make a home that logs in with it."""
        cls.port = free_port()
        host_key = make_key(cls.folder / 'host_key')
        known = ''.join('{} {}\n'.format(name, host_key)
                        for name in (HOST, '[{}]:{}'.format(HOST, cls.port)))
        user_key = make_key(cls.folder / 'home' / '.ssh' / 'id_ed25519')
        write(cls.folder / 'home' / '.ssh' / 'known_hosts', known)

        config = write(cls.folder / 'sshd_config', '\n'.join([
            'Port {}'.format(cls.port), 'ListenAddress ' + HOST, 'PidFile none',
            'HostKey {}/host_key'.format(cls.folder),
            'AuthorizedKeysFile {}'.format(write(cls.folder / 'authorized_keys', user_key)),
            'StrictModes no', 'UsePAM no', 'PasswordAuthentication no',
            'SetEnv ROS_HOME={}/ros_home'.format(cls.folder), '']))
        if os.geteuid() == 0:
            os.makedirs('/run/sshd', exist_ok=True)    # missing if the service never ran
        cls.sshd = TestProgram([SSHD, '-D', '-e', '-f', str(config)])
        cls.addClassCleanup(cls.sshd.kill)
        cls.sshd.wait_for('Server listening')

    def launch(self):
        """Start robot.launch for this computer. With the present user's name roslaunch would not use SSH."""
        program = TestProgram(
            ['roslaunch', '--disable-title', '--skip-log-check', 'tb3_labs', 'robot.launch', 'robot:=' + HOST,
             'user:=' + getpass.getuser(), 'ssh_port:={}'.format(self.port), 'env_loader:={}'.format(self.loader),
             'port:=/dev/ttyACM7'],
            environment={'HOME': str(self.folder / 'home'), 'LOGNAME': 'somebody_else',
                         'SSH_AUTH_SOCK': '', 'DISPLAY': ''})
        self.addCleanup(self.end, program)
        return program

    def end(self, program):
        """End a program by Ctrl+C, so that it leaves no process behind, also on the robot."""
        if program.status is None:
            program.end(seconds=40.0)
        program.kill()

    def test_one_line_starts_the_robot_and_a_second_line_turns_it(self):
        program = self.launch()
        self.observer.wait_for('ground_truth', seconds=40.0)
        self.assertEqual(rospy.get_param(CORE + '/port'), '/dev/ttyACM7')
        self.assertEqual(rospy.get_param(CORE + '/baud'), 115200)
        process = process_of(BOARD)

        # the robot has got TURTLEBOT3_MODEL, since a Burger is slower
        drive = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        forward = Twist()
        forward.linear.x = 1.0
        driving = rospy.Timer(rospy.Duration(0.1), lambda event: drive.publish(forward))
        self.observer.wait_for('ground_truth', lambda pose: pose.x > 0.5)
        (start, first), *_, (stop, last) = [
            truth for _, truth in self.observer.all('/ground_truth', rospy.get_time() - 1.0)]
        driving.shutdown()
        self.assertGreater(first.distance_to(last) / (stop - start),
                           (MODELS['burger'].max_linear + MODELS['waffle'].max_linear) / 2.0)
        self.observer.wait_for_rest('ground_truth')

        lab = TestProgram(['roslaunch', '--disable-title', 'tb3_labs', 'turn.launch', 'model:=waffle'],
                          terminal=True, environment={'DISPLAY': ''})
        self.addCleanup(self.end, lab)
        lab.wait_for('and Enter', 40.0)
        lab.type('l')
        lab.wait_for('Turned', 20.0)
        self.observer.wait_for_rest('ground_truth')
        self.assertAlmostEqual(math.degrees(self.observer.latest('ground_truth').yaw), 90.0, delta=0.5)

        lab.end(seconds=40.0)
        program.end(seconds=40.0)
        self.assertNotIn('Traceback', program.text)
        self.assertFalse(pathlib.Path('/proc/{}'.format(process)).exists())
