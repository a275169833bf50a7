"""doctor.py reports each of many real faults in time, and leaves nothing behind.

All patients (robots or computers with faults) are examined at the same time. Then each test reads
the lines about some patients.
"""
import contextlib
import os
import re
import signal
import sys
import time
import xmlrpc.client
from concurrent.futures import ThreadPoolExecutor

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from node_case import STARTING, NodeCase, NodeProgram, TestProgram, path_of
from tb3_labs.ros.clocks import wait_until
from two_hosts import PREFIX, TwoHosts

#: The simulated robot, with fewer messages.
ROBOT = 'fake_turtlebot3.py', '_imu_rate:=50'
#: The robot's network delays messages.
HOLDING = '_stalls_per_min:=120', '_longest_stall:=1.2'
#: The stamps of a patient are ahead by this time [s].
AHEAD = 3.0
#: Makes a computer in a separate network in which the master is unknown.
BAD_COMPUTER = '''
ip link set lo up; ip link add lan type veth peer name far; ip link set far up
ip addr add 172.20.0.5/20 dev lan; ip link set lan up
ip route add default via 172.20.0.1
exec "$@"
'''
#: (patient, subject of the line, verdict, words in the line)
FOUND = (
    ('no master', 'Master', 'FAULT', 'refuses.*start roscore'),
    ('robot9', 'Robot', 'FAULT', 'nobody publishes /robot9/imu .*/robot1/'),
    ('robot2', 'Robot', 'FAULT', '2 robots answer: /doctor, /robot2/turtlebot3 all'),
    ('robot3', 'Drivers', 'FAULT', '/doctor .* and /rival_of_robot3 .* at the same time'),
    ('robot3', 'Gyro', 'FAULT',
     'the gyro contradicts the wheels.*rostopic pub -1 /robot3/reset std_msgs/Empty'),
    ('robot4', 'Motion', 'FAULT', 'imu repeats one reading though the robot is told to move.*bringup'),
    ('ahead', 'Clock', 'FAULT', r'3\.[01] s ahead'),
    ('ahead', 'joint_states', 'FAULT', 'nobody publishes /ahead/joint_states'),
    ('ahead', 'Gyro', 'warning', 'cannot be compared'),
    ('ahead', 'Hearers', 'warning',
     '/ahead/lab1 listens to /ahead/imu_data, .* published by /doctor'),
    ('ahead', 'Senders', 'warning', '/ahead/lab1 publishes /ahead/turtle1/cmd_vel, which nobody '
     'hears; /ahead/cmd_vel is heard by /doctor'))
FOUND_ON_HOSTS = (
    ('laptop', 'imu', '(warning|FAULT)', 'silent for [0-9.]+ s: .*rostopic delay /robot1/imu'),
    ('laptop', 'Way back', 'ok', 'is connected to /driver_of_robot1'),
    ('laptop', 'Address', 'ok', "it goes before ROS_IP='10.77.2.2'. is an address"),
    ('bad laptop', 'Way back', 'FAULT',
     'cannot reach /driver_of_robot2 at http://ann.invalid:.*ROS_IP=10.77.2.2'),
    ('bad laptop', 'Address', 'FAULT', "10.77.9.9' is not an address .*10.77.2.2"),
    ('cut', 'Master', 'FAULT', "10.77.2.2:11311' (does not answer|cannot be reached)"),
    ('bad computer', 'Address', 'FAULT', "ROS_HOSTNAME='localhost': on the robot this address is the robot"),
    ('bad computer', 'Master', 'FAULT', "10.1.1.1:11311' (does not answer|cannot be reached)"))


class Doctors:
    """Calls a doctor for each patient. `ended` is {patient: (exit status, output, seconds)}.

    The seconds are those from the first line to the end, without delays of the computer. The start
    of Python takes long on a busy computer.
    """

    def __init__(self, hiccups):
        self._hiccups = hiccups
        self._called = {}
        self.ended = {}
        self._pool = ThreadPoolExecutor(20)

    def call(self, patient, *arguments, prefix=(), environment=None):
        program = TestProgram([*prefix, sys.executable, path_of('doctor.py'), *arguments],
                              environment=environment)
        self._called[patient] = self._pool.submit(self._watch, program)
        return program

    def _watch(self, program):
        wait_until(lambda: program.lines or program.status is not None, STARTING)
        begun = time.time()
        try:
            status = program.wait(STARTING)
        finally:
            program.kill()
        return status, program.text, time.time() - begun - self._hiccups.since(begun)

    def wait(self):
        """Wait for the end of all doctors."""
        self.ended = {patient: watch.result() for patient, watch in self._called.items()}


class DoctorTest(NodeCase):
    IS_NODE = False

    @classmethod
    def setUpClass(cls):
        rospy.init_node('stand_in', disable_signals=True)
        cls.missing = TwoHosts.missing()
        cls.hosts = None
        cls.doctors = Doctors(cls.hiccups)
        if not cls.missing:
            cls.hosts = TwoHosts()
            cls.addClassCleanup(cls.hosts.remove)
            # this changes the environment of this process for a while, so it comes first
            cls._start_hosts()
        cls._start_patients()
        cls._call_doctors()

    @classmethod
    def keep(cls, program):
        """Kill the program after the last test."""
        cls.addClassCleanup(program.kill)
        return program

    @classmethod
    def _start_patients(cls):
        for namespace in '/robot1', '/robot2':
            cls.keep(NodeProgram(*ROBOT, '__ns:=' + namespace))
        cls.keep(NodeProgram(*ROBOT, '_gyro_bias_deg:=-28', '__name:=robot', '__ns:=/robot3'))
        cls.keep(NodeProgram(*ROBOT, '_imu_frozen:=true', '__ns:=/robot4'))
        for node, topic, command in (('rival_of_robot3', '/robot3/cmd_vel', '{}'),
                                     ('driver_of_robot4', '/robot4/cmd_vel', '{angular: {z: 0.5}}')):
            cls.keep(TestProgram(['rostopic', 'pub', '-r', '10', '__name:=' + node, topic,
                                  'geometry_msgs/Twist', command]))
        cls.publishers = [rospy.Publisher(name, kind, queue_size=1) for name, kind in (
            ('/ahead/imu', Imu), ('/ahead/odom', Odometry), ('/robot3/cmd_vel', Twist),
            ('/robot2/imu', Imu))]
        rospy.Subscriber('/ahead/cmd_vel', Twist, lambda message: None)
        cls.keep(NodeProgram('plain_turtlebot_controller.py', 'imu:=imu_data',
                             'cmd_vel:=turtle1/cmd_vel', '__name:=lab1', '__ns:=/ahead'))
        cls.timer = rospy.Timer(rospy.Duration(0.05), lambda event: cls._publish())
        cls.wait_for_publisher('/robot1/odom', '/robot3/odom', '/robot3/cmd_vel',
                               '/robot2/odom', '/robot4/cmd_vel', '/robot4/odom', '/ahead/turtle1/cmd_vel')
        time.sleep(1.0)    # robots connect to their drivers

    @classmethod
    def _start_hosts(cls):
        """Start two robots on one host, and their drivers on the laptop, where the master is. One driver
        advertises a name that the robot cannot resolve."""
        with cls.hosts.on('laptop'):
            cls.keep(TestProgram(['rosmaster', '--core', '-p', '11311']))
        with cls.hosts.on('robot'):
            cls.wait_for(cls.state)
            for namespace in '/robot1', '/robot2':
                cls.keep(NodeProgram(*ROBOT, *HOLDING, '__ns:=' + namespace))
        with cls.hosts.on('laptop'):
            for robot, name in (('robot1', cls.hosts.address('laptop')), ('robot2', 'ann.invalid')):
                cls.keep(TestProgram(['rostopic', 'pub', '-r', '5', '__name:=driver_of_' + robot,
                                      '/%s/cmd_vel' % robot, 'geometry_msgs/Twist', '{}'],
                                     environment={'ROS_HOSTNAME': name}))
            cls.wait_for_publisher('/robot1/cmd_vel', '/robot2/cmd_vel', '/robot2/odom')

    @staticmethod
    def _publish():
        for publisher in DoctorTest.publishers[:2]:
            message = publisher.data_class()
            message.header.stamp = rospy.Time.now() + rospy.Duration(AHEAD)
            publisher.publish(message)
        DoctorTest.publishers[2].publish(Twist())

    @staticmethod
    def state():
        """The state of the master: publishers, subscribers, services."""
        return xmlrpc.client.ServerProxy(os.environ['ROS_MASTER_URI']).getSystemState('/test')[2]

    @classmethod
    def wait_for(cls, question):
        def is_so():
            with contextlib.suppress(OSError):
                return question()
        if not wait_until(is_so, STARTING, 0.1):
            raise RuntimeError('the patients do not start')

    @classmethod
    def wait_for_publisher(cls, *topics):
        cls.wait_for(lambda: set(topics) <= {topic for topic, _ in cls.state()[0]})

    @classmethod
    def _call_doctors(cls):
        call = cls.doctors.call
        cls.before = cls.state()
        call('healthy', 'robot1')
        for namespace in 'robot2', 'robot3', 'robot4', 'robot9', 'ahead':
            call(namespace, namespace)
        if cls.hosts:
            call('laptop', 'robot1', **cls.on('laptop'))
            call('bad laptop', 'robot2', **cls.on('laptop', ROS_HOSTNAME='', ROS_IP='10.77.9.9'))
        interrupted = call('interrupted', 'robot3')
        node = '/doctor_{}_'.format(interrupted.pid)
        cls.wait_for(lambda: any(each.startswith(node) for topic, nodes in cls.state()[1]
                                 for each in nodes if topic == '/robot3/cmd_vel'))
        time.sleep(0.2)    # cmd_vel is the doctor's last topic, so now it listens
        interrupted.send(signal.SIGINT)
        cls.doctors.wait()
        cls.after = cls.state()
        # the time of these doctors is limited
        call('no master', environment={'ROS_MASTER_URI': 'http://localhost:1'})
        if cls.hosts:
            call('bad computer', prefix=['unshare', '-n', 'sh', '-c', BAD_COMPUTER, 'sh'], environment={
                'ROS_MASTER_URI': 'http://10.1.1.1:11311', 'ROS_HOSTNAME': 'localhost'})
            cls.hosts.connect(False)
            call('cut', 'robot1', **cls.on('robot'))
        cls.doctors.wait()

    @classmethod
    def on(cls, host, **environment):
        """Returns options of a program, by which it runs on this host."""
        return {'prefix': ['nsenter', '--net=/run/netns/' + PREFIX + host],
                'environment': dict(cls.hosts.environment(host), **environment)}

    def read(self, patient):
        """Returns ({subject: line}, exit status, seconds) of a patient."""
        status, output, seconds = self.doctors.ended[patient]
        print('{} ({:.1f} s, status {}):\n{}'.format(patient, seconds, status, output))
        self.assertNotIn('Traceback', output)
        lines = {line.split()[1]: line for line in output.splitlines()[:-1]}
        if 'Way' in lines:
            lines['Way back'] = lines['Way']
        return lines, status, seconds

    def check(self, found):
        """Each line of `found` has its verdict and its words."""
        wrong = []
        for patient, subject, verdict, words in found:
            lines, status, _ = self.read(patient)
            if not re.search('^{} .*{}'.format(verdict, words), lines[subject]):
                wrong.append((patient, lines[subject], words))
            has_fault = any(line.startswith('FAULT') for line in lines.values())
            self.assertEqual(status, int(has_fault))
        self.assertEqual(wrong, [])

    def test_a_healthy_robot_has_no_fault(self):
        lines, status, seconds = self.read('healthy')
        self.assertEqual(status, 0)
        self.assertEqual(list(lines), [
            'Address', 'Master', 'Robot', 'Nodes', 'Way',
            'Drivers', 'imu', 'odom', 'joint_states', 'Clock', 'Gyro', 'Drift', 'Way back'])
        self.assertIn('agrees with the wheels', lines['Gyro'])
        # a busy computer delays messages
        self.assertEqual([line for subject, line in lines.items() if not line.startswith('ok') and (
            subject not in ('imu', 'odom', 'joint_states', 'Clock'))], [])
        self.assertLess(seconds, 12.0)

    def test_nothing_is_left_registered(self):
        self.assertEqual(self.before, self.after)

    def test_ctrl_c_ends_the_doctor_without_a_traceback(self):
        status, output, _ = self.doctors.ended['interrupted']
        self.assertEqual(status, 130)
        self.assertNotIn('Traceback', output)
        self.assertNotIn('Interrupt', output)

    def test_each_fault_of_a_robot_is_named_in_time(self):
        self.check(FOUND)
        _, _, seconds = self.read('no master')
        self.assertLess(seconds, 3.0)

    def test_each_fault_of_a_network_is_named_in_time(self):
        if not self.hosts:
            self.skipTest(self.missing)
        self.check(FOUND_ON_HOSTS)
        for patient in 'cut', 'bad computer':
            _, _, seconds = self.read(patient)
            self.assertLess(seconds, 4.0)
        _, output, _ = self.doctors.ended['bad computer']
        self.assertRegex(output.splitlines()[-1], '^faults: 2, .*begin with the first')
