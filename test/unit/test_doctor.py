"""The doctor's judgements: each line from made-up measurements, in the words of the symptom."""
import io
import math
import random
import re
import socketserver
import struct
import threading
import time
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from tb3_labs.doctor import examination, network
from tb3_labs.doctor.examination import (
    examine, judge_disk, judge_mouse, judge_pad, judge_python)
from tb3_labs.doctor.body import (
    BODY_TOPICS, CHECKSUMS, drift_of, judge_battery, judge_board, judge_drift, judge_firmware,
    judge_motors)
from tb3_labs.doctor.line import Verdict, exit_status, fault, ok, printed, summary, warning
from tb3_labs.doctor.listening import (
    Ear, imu_of, line_of, stamp_of, torque_of, version_of, voltage_of, wheels_of)
from tb3_labs.doctor.network import (
    PROBLEMS, Address, Answer, judge_address, judge_master, judge_nat, judge_second_master,
    own_addresses, way_out)
from tb3_labs.doctor.questions import Graph, Peer
from tb3_labs.doctor.robot import (
    PAUSES, Driver, MasterName, judge_clock, judge_drivers, judge_gyro, judge_names, judge_nodes,
    judge_presence, judge_stream, judge_way_back)

OK, WARNING, FAULT = Verdict.OK, Verdict.WARNING, Verdict.FAULT


def check(line, verdict, *words):
    """The verdict, and the words in the line; what is not ok says what to do, what is ok does not.
    """
    text = printed(line)
    assert line.verdict is verdict, text
    for word in words:
        assert word in text
    assert bool(line.remedy) == (verdict is not OK), text
    assert len(text.splitlines()) == 1


# ----- a line, and the sum

def test_a_line_is_one_line_with_its_verdict_in_front():
    assert printed(ok('Disk', 'a')).split() == ['ok', 'Disk', 'a']
    assert printed(warning('Disk', 'a', 'b')).split() == ['warning', 'Disk', 'a.', 'Do:', 'b']
    assert printed(fault('Disk', 'a\nb', 'c\r\033[2Jd')).isprintable()
    assert printed(fault('Disk', 'a', 'b')).startswith('FAULT')
    assert '\033' not in printed(fault('Disk', 'a', 'b'))
    assert printed(fault('Disk', 'a', 'b'), True).startswith('\033[1;31mFAULT')


@pytest.mark.parametrize('lines, words, status', [
    ([], 'no fault found', 0), ([OK], 'no fault found', 0),
    ([OK, WARNING], 'no fault found, 1 warning', 0), ([FAULT], '1 fault', 1),
    ([FAULT, OK, FAULT], '2 faults: begin with the first fault', 1),
    ([WARNING, FAULT, WARNING, FAULT], '2 faults, 2 warnings: begin with the first fault', 1)])
def test_the_last_line_is_the_sum(lines, words, status):
    lines = [fault('x', 'y', 'z') if verdict is FAULT else warning('x', 'y', 'z')
             if verdict is WARNING else ok('x', 'y') for verdict in lines]
    assert summary(lines) == words
    assert exit_status(lines) == status


# ----- this computer

def test_python():
    check(judge_python('3.8.10', '/usr/bin/python3', {}), OK, '3.8.10')
    check(judge_python('3.9.1', '/opt/conda/bin/python3', {'rospy': 'why', 'numpy': '', 'yaml': ''}),
          FAULT, '/opt/conda', 'import rospy (why), nor numpy, yaml. Do:', 'source scripts/setup.sh')
    check(judge_python('3.8.10', '/usr/bin/python3', {}, '2'), FAULT, 'ROS 2', 'new terminal')


def test_pad_and_mouse():
    check(judge_pad([]), OK, 'none')
    check(judge_pad([('/dev/input/js0', True)]), OK, 'js0')
    check(judge_pad([('/dev/input/js0', True), ('/dev/input/js1', False)]), WARNING, 'js1', 'usermod')
    check(judge_mouse(True, False, True), OK)
    check(judge_mouse(True, True, True), WARNING, 'Wayland', 'Xorg')
    check(judge_mouse(True, False, False), WARNING, 'pynput')
    check(judge_mouse(False, False, False), OK, 'no screen')


@pytest.mark.parametrize('free, verdict', [
    (0.99e9, FAULT), (1e9, WARNING), (4.9e9, WARNING), (5e9, OK)])
def test_disk(free, verdict):
    check(judge_disk('/home/ann', free), verdict, '/home/ann', 'GB')
    check(judge_disk('/usr', free, writable=False), WARNING, '/usr', 'cannot be written')


# ----- the network

LAN = dict(own=('192.168.0.5', '10.8.0.2'), way_out='192.168.0.5', master_here=False)


@pytest.mark.parametrize('here, verdict, words', [
    (dict(ros_hostname='localhost', resolved='127.0.0.1'), OK, 'this computer alone'),
    (dict(hostname='ann', resolved='127.0.1.1'), OK, 'neither'),
    (dict(LAN, ros_ip='192.168.0.5', resolved='192.168.0.5'), OK, 'ROS_IP=192.168.0.5'),
    (dict(LAN, ros_hostname='ann', resolved='192.168.0.5'), OK, 'ROS_HOSTNAME=ann (192.168.0.5)'),
    (dict(LAN, master_here=True, ros_ip='192.168.0.5', resolved='192.168.0.5'), OK, 'ROS_IP'),
    (dict(LAN, hostname='ann', resolved='127.0.1.1'), WARNING, 'the name ann'),
    (dict(LAN, ros_ip='192.168.0.77', resolved='192.168.0.77'), FAULT,
     'not an address of this computer (it has 192.168.0.5, 10.8.0.2)'),
    (dict(LAN, ros_hostname='nn', resolved=''), FAULT, 'ROS_HOSTNAME=nn does not resolve'),
    (dict(LAN, ros_hostname='localhost', resolved='127.0.0.1'), FAULT, 'the robot itself'),
    (dict(LAN, ros_ip='10.8.0.2', resolved='10.8.0.2'), WARNING, 'another network'),
    (dict(LAN, ros_ip='10.8.0.2', ros_hostname='ann', resolved='192.168.0.5'), WARNING,
     'goes before ROS_IP')])
def test_address(here, verdict, words):
    check(judge_address(Address(**here)), verdict, words)


def test_the_advice_is_the_address_towards_the_robot():
    line = judge_address(Address(ros_ip='1.2.3.4', resolved='1.2.3.4', **LAN))
    assert line.remedy.startswith('export ROS_IP=192.168.0.5,')
    line = judge_address(Address(ros_hostname='nn', own=('10.8.0.2',), way_out='127.0.0.1'))
    assert line.remedy.startswith('unset ROS_HOSTNAME; export ROS_IP=10.8.0.2,')


@pytest.mark.parametrize('kind, way, elsewhere, verdict', [
    ('', '172.20.0.5', True, OK), ('WSL', '192.168.0.5', True, OK), ('WSL', '', True, OK),
    ('WSL', '172.20.0.5', False, OK), ('WSL', '172.20.0.5', True, FAULT),
    ('WSL', '172.32.0.1', True, OK), ('a container', '172.17.0.2', True, FAULT)])
def test_nat(kind, way, elsewhere, verdict):
    check(judge_nat(kind, way, elsewhere), verdict, kind)


def test_a_kernel_of_wsl_is_known(monkeypatch):
    monkeypatch.setattr(network, 'open', lambda path: io.StringIO(
        {'/proc/version': 'Linux version 5.15 microsoft-standard-WSL2'}[path]), raising=False)
    assert network.nat_kind() == 'WSL'


def test_master():
    check(judge_master(Answer('http://robot3:11311', '', '192.168.0.9', 0.004)), OK,
          'robot3:11311 (192.168.0.9) answers in 4 ms')
    for problem in PROBLEMS:
        check(judge_master(Answer('http://robot3:11311', problem, '192.168.0.9')), FAULT,
              'robot3', PROBLEMS[problem])
    check(judge_master(Answer('http://localhost:11311', 'refused')), FAULT, 'start roscore')
    check(judge_master(Answer('', 'malformed')), FAULT, '(empty)')


def test_second_master():
    check(judge_second_master('http://robot3:11311', []), OK)
    check(judge_second_master('http://robot3:11311', ['127.0.0.1:11311']), WARNING, '127.0.0.1:11311')


# ----- the robot

CORE = '/turtlebot3_core'


def test_presence():
    check(judge_presence([], [], [], '/'), FAULT, 'nobody publishes /imu or /odom', 'bringup')
    check(judge_presence([], [], [], '/robot9/', ['/robot3/']), FAULT,
          'rosrun tb3_labs doctor.py robot3')
    check(judge_presence([], [], [], '/robot9/', ['/']), FAULT, 'bringup')
    check(judge_presence([], [CORE], [CORE], '/'), FAULT, 'nobody publishes /imu')
    check(judge_presence([CORE], [], [CORE], '/'), FAULT, 'nobody publishes /odom')
    check(judge_presence([CORE], [CORE], [], '/'), FAULT, 'cannot be driven')


def test_nodes():
    check(judge_nodes({CORE: Answer('http://localhost:40001/', 'refused', '127.0.0.1')}, False),
          FAULT, 'others cannot reach that', 'on the robot')
    check(judge_nodes({CORE: Answer('http://localhost:40001/', 'refused', '127.0.0.1')}, True),
          FAULT, 'rosnode cleanup', 'on the robot')
    check(judge_nodes({CORE: Answer('http://robot3:40001/', 'refused', '192.168.0.8')}, False),
          FAULT, 'refuses', 'is robot3 really 192.168.0.8?')
    check(judge_nodes({CORE: Answer('http://robot3:40001/', 'unresolved')}, False), FAULT,
          'cannot resolve', 'add "ITS_ADDRESS robot3" to /etc/hosts')
    check(judge_nodes({CORE: Answer('http://robot3:40001/', 'silent', '192.168.0.8')}, False),
          FAULT, 'does not answer', 'ping 192.168.0.8')


@pytest.mark.parametrize('uri, problem', [
    ('', 'malformed'), ('localhost:11311', 'malformed'), ('http://localhost', 'malformed'),
    ('http://localhost:1', 'refused'), ('http://robot3.invalid:11311/', 'unresolved')])
def test_a_peer_that_cannot_be_asked_says_why(uri, problem):
    peer = Peer(uri)
    assert peer.ask('getPid') is None and peer.answer.problem == problem


def test_the_nodes_around_a_robot():
    graph = Graph('/robot3/', [
        [['/robot3/odom', [CORE]], ['/robot9/odom', ['/other']], ['/robot3/cmd_vel', ['/pad']],
         ['/rosout', ['/robot3/serial', '/robot9/serial', '/robot3/panel']]],
        [['/robot3/cmd_vel', ['/recorder', CORE]]], []])
    assert (graph.others, graph.hearers, graph.drivers) == (['/robot9/'], [CORE], ['/pad'])
    assert (graph.robot_nodes, graph.serial_nodes) == ([CORE], ['/robot3/serial'])


def test_names():
    uri = 'http://ann:11311'
    check(judge_names([], '192.168.0.5'), WARNING, 'no node')
    check(judge_names([MasterName(CORE, uri, '', False)], '192.168.0.5'), WARNING, uri)
    check(judge_names([MasterName(CORE, uri, '10.0.0.9', False)], '192.168.0.5'), FAULT,
          'which is 10.0.0.9 here', 'the master is at 192.168.0.5')


def test_way_back():
    good = Address(ros_ip='192.168.0.5', resolved='192.168.0.5', **LAN)
    named = Address(ros_hostname='ann', resolved='192.168.0.5', **LAN)
    wrong = Address(ros_hostname='localhost', resolved='127.0.0.1', **LAN)
    drives = Driver('/move_to_goal', 'http://ann:40002/', True)
    check(judge_way_back([drives, Driver('/pad', 'http://ann:40003/', False)], CORE, named, True),
          FAULT, CORE, '/pad at http://ann:40003:', 'commands do not arrive', 'ROS_IP=192.168.0.5')
    check(judge_way_back(None, CORE, good, True), WARNING, 'does not tell')
    check(judge_way_back([], CORE, wrong, False), OK, 'on this computer')
    check(judge_way_back([], CORE, good, True), OK, '192.168.0.5')
    check(judge_way_back([], CORE, named, True), WARNING, 'must resolve the name ann')
    check(judge_way_back([], CORE, wrong, True), FAULT, 'cannot reach localhost')


def test_drivers():
    check(judge_drivers([], {}, 5.0), OK, 'no node drives')
    check(judge_drivers(['/a'], {'/a': 0}, 5.0), OK, 'does not now')
    check(judge_drivers(['/a', '/b'], {'/a': 50, '/b': 0}, 5.0), OK, '/a drives')
    check(judge_drivers(['/a', '/b'], {'/b': 5, '/a': 50}, 5.0), FAULT, '/a (10/s) and /b (1/s)')
    check(judge_drivers(['/b', '/a'], {'/a': 0}, 5.0), OK, '/a, /b could', 'if it jerks')
    check(judge_drivers(['/a'], {}, 5.0, ['/a']), WARNING, '/a', 'rosnode cleanup')


@pytest.mark.parametrize('stream, verdict, words', [
    (dict(count=1000, gap=0.02), OK, '200/s'), (dict(count=150, gap=PAUSES), OK, '30/s'),
    (dict(count=50, gap=0.2), OK, '10/s'), (dict(count=25, gap=0.2), WARNING, 'only 5/s'),
    (dict(count=900, gap=0.3, late=0.29), WARNING,
     'your WLAN holds messages for 0.3 s: the robot will pause'),
    (dict(count=900, gap=0.3, late=0.01), WARNING, 'the robot itself was silent for 0.3 s'),
    (dict(count=900, gap=0.3), WARNING, 'nothing came for 0.3 s'),
    (dict(count=900, gap=2.5, late=2.4), FAULT, 'a drive is given up'),
    (dict(count=900, gap=0.3, late=0.29, own_pause=0.2), WARNING, 'this computer held'),
    (dict(count=900, gap=0.3, late=0.29, robot_here=True), WARNING, 'this computer held'),
    (dict(gap=5.0), FAULT, 'nothing came on /imu for 5.0 s'),
    (dict(problem='no connection'), FAULT, 'cannot be heard: no connection')])
def test_stream(stream, verdict, words):
    check(judge_stream('/imu', seconds=5.0, **stream), verdict, 'imu', words)


@pytest.mark.parametrize('clock, verdict, words', [
    (dict(least_delay=0.004, round_trip=0.008), OK, 'right within 0.004 s'),
    (dict(least_delay=0.05, round_trip=0.02), OK, 'right within 0.04 s'),
    (dict(least_delay=0.3, round_trip=0.002), WARNING, '0.3 s behind (to 0.001 s), or all its messages'),
    (dict(least_delay=-0.3, round_trip=0.002), WARNING, '0.3 s ahead'),
    (dict(least_delay=-0.3, round_trip=1.0), WARNING, '0.8 s ahead (to 0.5 s)'),
    (dict(least_delay=-7200.0, round_trip=0.004), FAULT, '7200.0 s ahead'),
    (dict(least_delay=40.0, round_trip=0.004), FAULT, '40.0 s behind'),
    (dict(least_delay=0.3, robot_here=True), WARNING, '0.3 s old'),
    (dict(least_delay=40.0, stamps_are_zero=True), WARNING, 'zero'),
    (dict(date_offset=0.7), OK, 'right within 1 s'), (dict(date_offset=-60.0), FAULT, '60.0 s behind'),
    (dict(), WARNING, 'cannot be seen'), (dict(least_delay=9.0, simulated=True), OK, 'simulated')])
def test_clock(clock, verdict, words):
    check(judge_clock(**clock), verdict, words)


def test_gyro():
    check(judge_gyro('it lies', 'let it rest', True), FAULT, 'it lies', 'let it rest')
    check(judge_gyro('', '', False), OK, 'cannot be compared')


# ----- the body

@pytest.mark.parametrize('volts, verdict, words', [
    (12.3, OK, '12.3 V'), (11.21, OK, '11.2'), (11.19, WARNING, 'charge'), (11.01, WARNING, 'cuts'),
    (10.99, FAULT, '11.0 V: below 11.0 V the board cuts the motors'), (6.1, FAULT, 'charge'),
    (5.0, FAULT, 'USB alone'), (math.nan, WARNING, 'did not come')])
def test_battery(volts, verdict, words):
    check(judge_battery(volts), verdict, words)


def test_motors():
    check(judge_motors(True), OK, 'on')
    check(judge_motors(False, '/robot3/'), FAULT, 'torque is off',
          'rostopic pub -1 /robot3/motor_power std_msgs/Bool true')
    check(judge_motors(None), FAULT, 'do not answer', 'cables')


@pytest.mark.parametrize('lines, version, more, verdict, words', [
    ([], '1.2.6', {}, OK, '1.2.6'), ([], '1.2.2', {}, WARNING, '1.2.2, but the labs know 1.2.6'),
    (['Requesting topics...'], '1.2.6', {}, OK, '1.2.6'),
    (['Requesting topics...'], '', {'is_there': False}, FAULT, 'ROS 2'),
    (['Unable to sync with device; possible link problem'], '', {}, FAULT, 'burger_noetic'),
    (['Lost sync with device, restarting...'], '', {}, FAULT, 'the board is off'),
    (['Creation of publisher failed: Checksum does not match: 4d,47'], '1.2.6', {}, WARNING,
     'another definition'),
    (['Creation of publisher failed: Checksum does not match: 4d,47'], '', {'is_there': False}, FAULT,
     'another definition'),
    ([], '1.2.6', {'missing': ['battery_state']}, WARNING, 'there is no battery_state'),
    ([], '1.2.6', {'checksums': dict(CHECKSUMS, imu='*', sensor_state='5e')}, OK, '1.2.6'),
    ([], '1.2.6', {'checksums': {'imu': CHECKSUMS['odom']}}, FAULT,
     'imu has another definition (md5 cd5e73d190d741a2f92e81eda573aca7)')])
def test_firmware(lines, version, more, verdict, words):
    check(judge_firmware(lines, version, **dict({'checksums': {}}, **more)), verdict, words)
    assert judge_firmware(['some line'], '', {}) is None


def test_the_checksums_are_those_of_the_messages():
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import BatteryState, Imu, JointState
    assert CHECKSUMS == {'imu': Imu._md5sum, 'odom': Odometry._md5sum,
                         'joint_states': JointState._md5sum, 'battery_state': BatteryState._md5sum}


BEGIN, END, RESET, CONNECTED = ('Start Calibration of Gyro', 'Calibration End', 'Reset Odometry',
                                'Connected to OpenCR board!')


@pytest.mark.parametrize('lines, verdict, words', [
    ([END], OK, 'calibrated'), ([RESET], OK, 'calibrated'), ([BEGIN], WARNING, 'calibrates its gyro now'),
    ([END, CONNECTED], WARNING, 'calibrates its gyro now'),
    ([END, CONNECTED, BEGIN, END], WARNING, 'restarted'), ([BEGIN, END], WARNING, 'restarted'),
    ([END, BEGIN, END, RESET], WARNING, 'was reset meanwhile')])
def test_board(lines, verdict, words):
    check(judge_board(['robot1: ' + line for line in lines]), verdict, words)
    assert judge_board(['Setup publisher on imu']) is None


@pytest.mark.parametrize('drift, error, verdict, words', [
    (1.9, 0.0, OK, '+1.9 deg/min'), (-2.1, 0.0, WARNING, '-2.1 deg/min'),
    (2.1, 0.0, WARNING, 'rostopic pub -1 /robot3/reset'), (2.5, 0.6, OK, '+2.5'),
    (None, 0.0, OK, 'cannot be seen')])
def test_drift(drift, error, verdict, words):
    check(judge_drift(drift, error, '/robot3/'), verdict, words)


@pytest.mark.parametrize('start', [0.0, math.pi - 0.001, -math.pi])
def test_the_drift_of_a_standing_robot_is_the_slope_of_its_yaw(start):
    rate, chance = math.radians(6.0) / 60.0, random.Random(1)
    still, turning = [(1.0, 2.0), (1.004, 2.0)], [(1.0, 2.0), (1.0, 2.006)]
    imu = [(100.0 + 0.01 * k, math.remainder(start + rate * 0.01 * k, 2.0 * math.pi))
           for k in range(500)]
    assert drift_of(imu, still)[0] == pytest.approx(6.0)
    assert drift_of(imu, turning)[0] is None
    assert drift_of(imu[:11], still)[0] is None and drift_of(imu[:1] * 20, still)[0] == 0.0
    noisy = [(stamp, yaw + chance.gauss(0.0, math.radians(0.1))) for stamp, yaw in imu]
    drift, error = drift_of(noisy, still)
    # 0.1 deg of noise in two means of 125 samples, 3.75 s apart: 0.1 x sqrt(2 / 125) / 3.75 s, twice
    assert abs(drift - 6.0) < 1.5 * error and error == pytest.approx(0.40, rel=0.2)


# ----- the looks themselves, at a robot of this process

def messages_at(stamp):
    """{topic: the bytes of a message} of a robot at rest."""
    from geometry_msgs.msg import Twist
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import BatteryState, Imu, JointState
    from rosgraph_msgs.msg import Log
    from tb3_labs.simulation.ros_board import kind_of
    state = kind_of('SensorState')(torque=True, left_encoder=-1, battery=11.5)
    version = kind_of('VersionInfo')('2020', '1.2.6', '2.0')
    battery, log = BatteryState(voltage=11.5), Log(msg='Calibration End', name=CORE)
    imu, odom, wheels, packed = Imu(), Odometry(), JointState(), {}
    for message in (imu, odom, wheels, battery, log, state):
        message.header.frame_id = 'base_link'
        message.header.stamp.secs, message.header.stamp.nsecs = int(stamp), int(stamp % 1.0 * 1e9)
    imu.orientation.z, imu.orientation.w = math.sin(0.3), math.cos(0.3)
    imu.angular_velocity.x, imu.angular_velocity.z = 0.1, 0.002
    wheels.name, wheels.position = ['wheel_right_joint', 'wheel_left_joint'], [2.5, -1.5]
    for topic, message in (('imu', imu), ('odom', odom), ('joint_states', wheels),
                           ('cmd_vel', Twist()), ('battery_state', battery), ('rosout', log),
                           ('sensor_state', state), ('firmware_version', version)):
        packed['/' + topic] = io.BytesIO()
        message.serialize(packed['/' + topic])
    return {topic: buffer.getvalue() for topic, buffer in packed.items()}


def test_the_fields_of_a_message_are_read_from_its_bytes():
    told = messages_at(12.25)
    assert stamp_of(told['/odom']) == (12.25,)
    assert imu_of(told['/imu']) == pytest.approx((12.25, 0.6, 0.002))
    assert (line_of(told['/rosout']), voltage_of(told['/battery_state'])) == (
        (12.25, 'Calibration End'), (12.25, 11.5))
    assert torque_of(told['/sensor_state']) == (12.25, True)
    assert version_of(told['/firmware_version']) == ('1.2.6',)
    assert wheels_of(told['/joint_states']) == (12.25, -1.5, 2.5)


class Publisher(socketserver.StreamRequestHandler):
    """Sends sixty messages to each subscriber, some of others, and closes the connection."""

    def handle(self):
        header = self.rfile.read(struct.unpack('<I', self.rfile.read(4))[0])
        topic = re.search(rb'topic=(/\w+)', header).group(1).decode()
        checksum = b'md5sum=' + CHECKSUMS.get(topic[1:], '*').encode()
        self.wfile.write(struct.pack('<II', 4 + len(checksum), len(checksum)) + checksum)
        for _ in range({'/cmd_vel': 5, '/battery_state': 5, '/rosout': 1}.get(topic, 60)):
            told = messages_at(time.time())[topic]
            self.wfile.write(struct.pack('<I', len(told)) + told)
            time.sleep(0.01)


@pytest.fixture
def robot():
    """The URI of a node that is its own master."""
    with SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False) as asked, \
            socketserver.ThreadingTCPServer(('127.0.0.1', 0), Publisher) as publisher:
        uri = 'http://localhost:{}/'.format(asked.server_address[1])
        publishers = [['/' + topic, [CORE]] for topic in (
            'imu', 'odom', 'joint_states', 'rosout', *BODY_TOPICS)]
        for method, value in (
                ('getSystemState', [publishers + [['/cmd_vel', ['/pad']]],
                                    [['/cmd_vel', [CORE]]], []]),
                ('lookupNode', uri), ('getPid', 7), ('getMasterUri', uri), ('getParam', False),
                ('getBusInfo', [[1, uri, 'i', 'TCPROS', '/cmd_vel', True]]),
                ('requestTopic', ['TCPROS', '127.0.0.1', publisher.server_address[1]])):
            asked.register_function(lambda *_, value=value: [1, '', value], method)
        for server in (asked, publisher):
            threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        yield uri
        for server in (asked, publisher):
            server.shutdown()


def test_a_sound_robot_is_found_sound(robot, monkeypatch):
    for name, value in (('ROS_MASTER_URI', robot), ('ROS_IP', '127.0.0.1'), ('ROS_HOSTNAME', ''),
                        ('TURTLEBOT3_MODEL', 'burger')):
        monkeypatch.setenv(name, value)
    lines = {line.subject: line for line in examine('/', 1.0)}
    for subject, words in (
            ('Address', 'this computer alone'), ('Master', 'answers in'), ('Robot', CORE),
            ('Nodes', CORE + ' answers in'), ('Names', 'the same master'),
            ('Way back', 'connected to /pad'),
            ('Drivers', '/pad drives'), ('Clock', 'right within'), ('Gyro', 'agrees'),
            ('Drift', '+0.0 deg/min'), ('Battery', '11.5 V'), ('Motors', 'on'),
            ('Firmware', '1.2.6'), ('Board', 'calibrated')):
        check(lines[subject], OK, words)
    assert FAULT not in (lines['imu'].verdict, lines['odom'].verdict)
    ear = Ear('/battery_state', CORE, robot)
    deadline = time.monotonic() + 5.0       # a busy machine may connect late
    while len(ear.messages) < 5 and time.monotonic() < deadline:
        time.sleep(0.01)
    assert (len(ear.messages), ear.problem, ear.checksum) == (5, '', CHECKSUMS['battery_state'])


def test_without_a_master_the_way_there_is_judged(monkeypatch):
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:1')
    monkeypatch.setattr(examination, 'nat_kind', lambda: 'WSL')
    monkeypatch.setattr(examination, 'way_out', lambda _: '172.20.0.5')
    lines = {line.subject: line for line in examine('/', 0.5)}
    check(lines['NAT'], OK, 'good for the simulated robot alone')
    check(lines['Master'], FAULT, 'refuses')
    assert [way_out(address) for address in own_addresses()] == list(own_addresses())


@pytest.mark.parametrize('end, gap, late', [(1.3, 0.5, 0.4), (2.5, 1.3, math.nan)])
def test_the_longest_gap_and_what_the_message_after_it_was_late_by(end, gap, late):
    """All messages take 7 s by a clock that is off; the one at 1.0 s takes 0.4 s more."""
    ear = Ear('/imu', CORE, '')
    ear._begun, ear._ended = 0.0, end
    ear.messages = [(at, at + 7.0, (at - delay,))
                    for at, delay in ((0.1, 0.0), (0.5, 0.0), (1.0, 0.4), (1.2, 0.0))]
    assert ear.gap() == pytest.approx((gap, late), nan_ok=True)
