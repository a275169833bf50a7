"""The doctor prints the right line about made-up measurements."""
import math
import os
import random
import signal
import socket
import subprocess
import sys

import pytest

from real_recordings import arrays_of
from tb3_labs.doctor import fault, finding_text, ok, summary_text, warning
from tb3_labs.doctor.checks import examine
from tb3_labs.doctor.computer import Computer, judge_address, outgoing_address, own_addresses
from tb3_labs.doctor.master_and_nodes import (
    PROBLEM_TEXTS, Peer, RobotGraph, judge_master, judge_names, judge_nodes, judge_return_path,
    judge_robot)
from tb3_labs.doctor.motion import judge_motion
from tb3_labs.doctor.programs import judge_programs
from tb3_labs.doctor.streams import (
    drift_of, judge_clock, judge_drift, judge_drivers, judge_gyro, judge_stream)
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import ImuSample, OdometrySample, WheelSample
from tb3_labs.robot.turtlebot3 import Twist2

OK, WARNING, FAULT = 'ok', 'warning', 'FAULT'


def check(line, verdict, *words):
    """A line has this verdict and these words. A line that is not ok has a remedy."""
    text = finding_text(line)
    assert line.severity == verdict, text
    for word in words:
        assert word in text
    assert bool(line.remedy) == (verdict is not OK), text
    assert len(text.splitlines()) == 1


def test_a_finding_is_one_line_that_begins_with_its_severity():
    assert finding_text(ok('Disk', 'a')).split() == ['ok', 'Disk', 'a']
    assert finding_text(warning('Disk', 'a', 'b')).split() == ['warning', 'Disk', 'a.', 'Do:', 'b']
    assert finding_text(fault('Disk', 'a\nb', 'c\r\033[2Jd')).isprintable()


@pytest.mark.parametrize('verdicts, words', [
    ('', 'faults: 0, warnings: 0'), ('ow', 'faults: 0, warnings: 1'), ('f', 'faults: 1, warnings: 0'),
    ('wfof', 'faults: 2, warnings: 1; begin with the first fault')])
def test_the_last_line_has_the_numbers_of_faults_and_warnings(verdicts, words):
    kinds = {'o': ok('x', 'y'), 'w': warning('x', 'y', 'z'), 'f': fault('x', 'y', 'z')}
    assert summary_text([kinds[letter] for letter in verdicts]) == words


CORE, HERE, AFAR = '/turtlebot3_core', 'http://localhost:40001/', 'http://robot3:40001/'
LAN = dict(addresses=('192.168.0.5', '10.8.0.2'), outgoing_address='192.168.0.5', is_master_here=False)
GOOD = Computer(ros_ip='192.168.0.5', resolved_address='192.168.0.5', **LAN)
NAMED = Computer(ros_hostname='ann', resolved_address='192.168.0.5', **LAN)
WRONG = Computer(ros_hostname='localhost', resolved_address='127.0.0.1', **LAN)
NEXT_DRIVER = {'/move_to_goal': 'http://ann:40002/', '/pad': 'http://ann:40003/'}


def address(**facts):
    return judge_address(Computer(**facts))


def robot_of(namespace='/', listeners=(CORE,), others=(), **sensors):
    """Returns the line on a robot. `sensors` is {topic: nodes that publish the topic}."""
    return judge_robot(RobotGraph(namespace, [
        [[namespace + name, nodes] for name, nodes in sensors.items()]
        + [[name + 'odom', ['/other']] for name in others],
        [[namespace + 'cmd_vel', list(listeners)]], []]))


def node_at(*peer):
    return judge_nodes({CORE: Peer(*peer)})


def stream(*silences, period=0.005):
    """Returns the line on 5 s of messages with this period, but without messages in `silences`."""
    times = [round(period * k, 3) for k in range(round(5.0 / period) + 1)]
    return judge_stream('/imu', [at for at in times if not any(
        begin < at < end for begin, end in silences)], 5.0, CORE)


JUDGEMENTS = [
    # the network; the advice is the address towards the robot
    (address(ros_hostname='localhost', resolved_address='127.0.0.1'), OK, 'this computer alone'),
    (address(hostname='ann', resolved_address='127.0.1.1'), OK, 'neither'),
    (judge_address(GOOD), OK, "ROS_IP='192.168.0.5'"),
    (judge_address(NAMED), OK, "ROS_HOSTNAME='ann' (192.168.0.5)"),
    (address(**LAN, hostname='ann', resolved_address='127.0.1.1'), WARNING, 'the name ann'),
    (address(**LAN, ros_ip='192.168.0.77', resolved_address='192.168.0.77'), FAULT,
     'not an address of this computer (it has 192.168.0.5, 10.8.0.2)',
     'Do: export ROS_IP=192.168.0.5,'),
    (address(**LAN, ros_hostname='nn', resolved_address=''), FAULT, "ROS_HOSTNAME='nn' does not resolve"),
    (address(ros_hostname='nn', addresses=('10.8.0.2',), outgoing_address='127.0.0.1'), FAULT,
     'Do: unset ROS_HOSTNAME; export ROS_IP=10.8.0.2,'),
    (judge_address(WRONG), FAULT, 'the robot itself'),
    # rospy tells others ROS_HOSTNAME if both are set
    (address(**LAN, ros_ip='192.168.0.5', ros_hostname='nn', resolved_address=''), FAULT,
     "ROS_HOSTNAME='nn' (it goes before ROS_IP='192.168.0.5') does not"),
    (judge_master(Peer('http://robot3:11311', '', '192.168.0.9')), OK,
     "robot3:11311' (192.168.0.9) answers"),
    *[(judge_master(Peer('http://robot3:11311', problem, '192.168.0.9')), FAULT, 'robot3',
       PROBLEM_TEXTS[problem]) for problem in PROBLEM_TEXTS],
    (judge_master(Peer('http://localhost:11311', 'refused')), FAULT, 'start roscore'),
    (judge_master(Peer('localhost:12311', 'malformed')), FAULT,
     "'localhost:12311' is not an address", 'Do: export ROS_MASTER_URI=http://ADDRESS:11311'),
    # the robot
    (robot_of(listeners=()), FAULT, 'nobody publishes /imu or /odom', 'bringup'),
    (robot_of('/robot9/', others=['/robot3/']), FAULT, 'rosrun tb3_labs doctor.py /robot3/'),
    (robot_of(imu=[CORE]), FAULT, 'nobody publishes /odom'),
    (robot_of(listeners=(), imu=[CORE], odom=[CORE]), FAULT, 'cannot be driven'),
    (node_at(HERE, 'refused', '127.0.0.1'), FAULT, 'others cannot reach that', 'rosnode cleanup',
     'on the robot'),
    (node_at(AFAR, 'refused', '192.168.0.8'), FAULT, 'refuses', 'ping robot3', 'rosnode cleanup'),
    (node_at(AFAR, 'unresolved'), FAULT, 'cannot resolve',
     'on the robot: export ROS_IP'),
    (node_at(AFAR, 'silent', '192.168.0.8'), FAULT, 'does not answer', 'ping robot3'),
    # the way back
    (judge_return_path(NEXT_DRIVER, {'http://ann:40002'}, CORE, NAMED, True), FAULT, CORE,
     '/pad at http://ann:40003:', 'commands do not arrive', 'ROS_IP=192.168.0.5'),
    (judge_return_path(NEXT_DRIVER, {'http://ann:40002', 'http://ann:40003'}, CORE, NAMED, True), OK,
     'connected to /move_to_goal, /pad'),
    (judge_return_path({}, (), CORE, WRONG, False), OK, 'on this computer'),
    (judge_return_path({}, (), CORE, GOOD, True), OK, '192.168.0.5'),
    (judge_return_path({}, (), CORE, NAMED, True), WARNING, 'must resolve the name ann'),
    (judge_return_path({}, (), CORE, WRONG, True), FAULT, 'cannot reach localhost'),
    # messages
    (judge_drivers({}), OK, 'no node drives', 'if it jerks'),
    (judge_drivers({'/a': 50}), OK, '/a (10/s) drives'),
    (judge_drivers({'/b': 5, '/a': 50}), FAULT, '/a (10/s) and /b (1/s)'),
    (stream(), OK, 'imu', '200/s'),
    (stream((1.0, 1.3)), WARNING, 'silent for 0.3 s: the robot will pause', 'rostopic delay /imu'),
    (stream((4.7, 9.9)), WARNING, 'silent for 0.3 s'),    # until the doctor stops listening
    (stream((-1.0, 1.3)), OK, '200/s'),                   # the doctor was connected late
    (stream((1.0, 3.5)), FAULT, 'silent for 2.5 s: a drive is given up'),
    (stream((-1.0, 9.9)), FAULT, 'nothing came on /imu for 5.0 s'),
    (judge_stream('/robot3/joint_states'), FAULT, 'joint_states nobody publishes /robot3/joint'),
    # the clock
    (judge_clock(0.09), OK, 'right within 0.1 s'), (judge_clock(-0.09), OK, 'right within 0.1 s'),
    (judge_clock(0.3), WARNING, "robot's clock is 0.3 s behind, or all its messages come so late", 'date'),
    (judge_clock(-0.3), WARNING, "robot's clock is 0.3 s ahead: tf may", 'other programs', 'date'),
    (judge_clock(-7200.0), FAULT, '7200.0 s ahead', 'date'), (judge_clock(40.0), FAULT, '40.0 s behind'),
    # gyro and wheels
    (judge_gyro('it lies', 'let it rest', True), FAULT, 'it lies', 'let it rest'),
    (judge_gyro('', '', False), WARNING, 'cannot be compared'),
    (judge_gyro('', '', True), OK, 'agrees'),
    (judge_drift(1.9, '/robot3/'), OK, '+1.9 deg/min'),
    (judge_drift(-2.1, '/robot3/'), WARNING, '-2.1 deg/min'),
    (judge_drift(2.1, '/robot3/'), WARNING, 'rostopic pub -1 /robot3/reset')]


@pytest.mark.parametrize('judgement', JUDGEMENTS, ids=lambda judgement: judgement[0].subject)
def test_each_judgement_has_its_severity_and_its_words(judgement):
    check(*judgement)


@pytest.mark.parametrize('start', [0.0, math.pi - 0.001, -math.pi])
def test_the_drift_of_a_standing_robot_is_the_slope_of_its_yaw(start):
    rate, chance = math.radians(6.0) / 60.0, random.Random(1)
    still, turning = [(1.0, 2.0), (1.004, 2.0)], [(1.0, 2.0), (1.0, 2.006)]
    imu = [(100.0 + 0.01 * k, math.remainder(start + rate * 0.01 * k, 2.0 * math.pi))
           for k in range(500)]
    assert drift_of(imu, still) == pytest.approx(6.0)
    assert drift_of(imu, turning) is None and drift_of(imu, []) is None
    assert drift_of(imu[:11], still) is None and drift_of(imu[:1] * 20, still) == 0.0
    noisy = [(stamp, yaw + chance.gauss(0.0, math.radians(0.1))) for stamp, yaw in imu]
    # 0.1 deg of noise in 500 samples of 5 s: 0.1 / (sqrt(500) x 5 s / sqrt(12)), three times
    assert abs(drift_of(noisy, still) - 6.0) < 0.6
    assert abs(drift_of(noisy[:20], still)) < 1.0    # 0.2 s are too short


def motion(linear=0.0, angular=0.0, frozen='', standing=False, silence=(9.0, 9.0), told=(0.0, 9.0), jitter=0.0):
    """Returns the line on a Burger that drives 5 s by this command, without noise. The samples of `frozen` repeat
    themselves. A robot that is `standing` does not obey. Its wheels jump by `jitter` [rad] to and fro."""
    samples = []
    for tick in range(100):    # 20 samples of each sensor in a second
        now = 0.05 * tick
        driven = 0.0 if standing else now
        yaw, path = angular * driven, linear * driven
        wheels = [(path + side * 0.08 * yaw) / 0.033 + jitter * (tick % 2) for side in (-1.0, 1.0)]
        speeds = (0.0, 0.0) if standing else (linear, angular)
        made = dict(imu=ImuSample(now, 0.0 if frozen == 'imu' else yaw, speeds[1]),
                    odom=OdometrySample(now, Pose2() if frozen == 'odom' else Pose2(path, 0.0, yaw), *speeds),
                    wheels=WheelSample(now, *([0.0, 0.0] if frozen == 'wheels' else wheels)))
        if not silence[0] < now < silence[1]:
            samples += [(now, sample) for sample in made.values()]
        if told[0] <= now <= told[1]:
            samples.append((now, Twist2(linear, angular)))
    return judge_motion(samples)


HANGS, STANDS = 'repeats one reading though the robot is told to move', 'does not move although it is told to'


@pytest.mark.parametrize('facts, words', [
    (dict(angular=0.5, frozen='imu'), ['imu ' + HANGS, 'bringup', 'board off and on']),
    (dict(linear=0.1, angular=-0.2, frozen='imu'), ['imu ' + HANGS]),
    (dict(linear=0.1, frozen='odom'), ['odom ' + HANGS]), (dict(angular=0.5, frozen='odom'), ['odom ' + HANGS]),
    (dict(linear=-0.1, standing=True), [STANDS, 'battery']), (dict(angular=0.5, standing=True), [STANDS]),
    (dict(angular=0.5, standing=True, jitter=0.0015), [STANDS]),    # one step of the encoder
    (dict(linear=0.1, frozen='wheels'), [STANDS]),    # the servos are silent, and the odometry runs on
    (dict(linear=0.1, standing=True, silence=(1.0, 3.0)), [STANDS])])
def test_a_robot_that_does_not_obey_and_a_hanging_driver_are_named(facts, words):
    check(motion(**facts), FAULT, *words)


@pytest.mark.parametrize('facts', [
    {}, dict(standing=True, frozen='imu'), dict(linear=0.1), dict(linear=0.1, angular=0.5), dict(angular=-0.11),
    dict(linear=0.021), dict(linear=0.02, standing=True), dict(angular=0.1, standing=True),    # too slow to be seen
    dict(linear=0.1, frozen='imu'),                                      # straight ahead without noise
    dict(linear=0.1, standing=True, told=(9.0, 9.0)),                    # no node drives
    dict(linear=0.1, standing=True, told=(1.0, 1.75)),                   # and 0.5 s later the board stops
    dict(linear=0.1, standing=True, silence=(1.0, 4.0)), dict(angular=0.5, frozen='imu', silence=(0.3, 4.7))])
def test_a_robot_that_rests_obeys_or_is_not_heard_is_not_accused(facts):
    assert motion(**facts) is None


def to_odometry(stamp, x, y, yaw, *speeds):
    return OdometrySample(stamp, Pose2(x, y, yaw), *speeds)


@pytest.mark.parametrize('name, command, is_accused', [
    ('burger_drive', (), False), ('burger_static', (), False), ('burger_static', (0.1, 0.0), True)])
def test_a_real_burger_is_accused_only_if_it_stands_though_it_is_told_to_move(name, command, is_accused):
    """The recordings have no commands. The speeds that the odometry shows take their place."""
    tables = arrays_of(name, ('imu', 'odometry', 'wheels'))
    samples = [(arrived_at, make(*numbers)) for make, rows in zip((ImuSample, to_odometry, WheelSample), tables)
               for arrived_at, *numbers in rows.tolist()]
    samples += [(arrived_at, Twist2(*(command or (sample.linear, sample.angular))))
                for arrived_at, sample in samples if isinstance(sample, OdometrySample)]
    assert (judge_motion(sorted(samples, key=lambda each: each[0])) is not None) == is_accused


HEARD = 'cmd_vel', 'joy', 'turn', 'mouse_info', 'ctrl_relinq', 'heading'
LISTENS = '/lab1 listens to {}, which nobody publishes; {} is published by {}'
PUBLISHES = '/lab1 publishes {}, which nobody hears; {} is heard by {}'


@pytest.mark.parametrize('form, namespace, topics, right', [
    (LISTENS, '/', '/imu_data /imu/data /IMU /imus /Imu /lab1/imu /robot3/imu /turtle1/imu /imu_raw /raw_imu '
     '/imu9250 /imu/data_raw', 'imu'),
    (LISTENS, '/robot3/', '/imu /IMU /robot3/IMU /robot3/lab1/imu /robot3/imu/imu', 'imu'),
    (LISTENS, '/', '/odometry/filtered', 'odom'),
    # unknown topics, another robot's topics, and the topic of a silent sensor
    (LISTENS, '/', '/reset /map /scan /simulator /joint_state', ''),
    (LISTENS, '/robot3/', '/robot3/imu /robot4/imu', ''),
    (PUBLISHES, '/', '/turtle1/cmd_vel /CMD_VEL /cmdvel /cmd_val /lab1/cmd_vel /robot/cmd_vel', 'cmd_vel'),
    (PUBLISHES, '/', '/mouse', 'mouse_info'), (PUBLISHES, '/', '/ctrl_relinquish', 'ctrl_relinq'),
    (PUBLISHES, '/robot3/', '/cmd_vel /robot3/turtle1/cmd_vel /robot3/cmd_Vel', 'cmd_vel'),
    (PUBLISHES, '/', '/turns', 'turn'), (PUBLISHES, '/', '/joyy', 'joy'),
    (PUBLISHES, '/', '/heading_error /speed', ''), (PUBLISHES, '/robot3/', '/robot4/cmd_vel', '')])
def test_a_node_that_uses_a_wrong_name_is_reported(form, namespace, topics, right):
    for topic in topics.split():
        published = [[namespace + name, [CORE]] for name in ('imu', 'odom')]
        received = [[namespace + name, ['/record', CORE] if name == 'cmd_vel' else ['/controller']]
                    for name in HEARD]
        (received if form is LISTENS else published).append([topic, ['/lab1']])
        lines = list(judge_names(RobotGraph(namespace, [published, received, []])))
        if right:
            node = CORE if right in ('imu', 'odom', 'cmd_vel') else '/controller'
            check(*lines, WARNING, form.format(topic, namespace + right, node))
        else:
            assert lines == [], topic


#: {node of a right graph: topics that it publishes}. Nobody hears some of them.
PUBLISHED = {
    CORE: 'imu odom joint_states tf battery_state cmd_vel_rc100 magnetic_field sensor_state version_info',
    '/lds': 'scan rpms', '/joy_node': 'joy', '/rosout': 'rosout_agg', '/turtlebot3': 'clock',
    '/state_publisher': 'tf tf_static', '/camera': 'camera/imu camera/odom/sample',
    '/rviz': 'initialpose move_base_simple/goal clicked_point', '/robot4/lab': 'robot4/cmd_vel',
    '/imu_sub': 'heading heading_error imu_yaw', '/gamepad': 'cmd_vel joy_scaled ctrl_relinq',
    '/controller': 'cmd_vel cmd_vel_raw controller/variables turn/status diagnostics',
    '/move_to_goal': 'cmd_vel local_pose local_path goal_marker goal_state move2goal/status',
    '/panel': 'joy mouse_info turn move_base_simple/goal ctrl_relinq cmd_vel'}
#: {node of a right graph: topics to which it listens}. Nobody publishes some of them.
RECEIVED = {
    CORE: 'cmd_vel reset sound motor_power imu_calibration', '/joy_node': 'joy/set_feedback', '/rosout': 'rosout',
    '/rviz': 'map scan odometry/filtered odom imu ground_truth tf_static clock particlecloud',
    '/record': 'imu odom cmd_vel reset initialpose turn mouse_info ground_truth',
    '/imu_sub': 'imu clock', '/controller': 'imu joint_states mouse_info turn turn/goal turn/cancel reset',
    '/gamepad': 'joy', '/fused': 'imu imu_1 odom odom_1', '/robot4/lab': 'robot4/imu',
    '/move_to_goal': 'imu odom ctrl_relinq move2goal/goal move2goal/cancel initialpose',
    '/panel': 'local_pose goal_state current_goal has_control joy heading'}


def as_the_master_lists(topics_of, without):
    """Returns [[topic, nodes]] of {node: topics}, but not for the node `without`."""
    nodes = {}
    for node, topics in topics_of.items():
        for topic in topics.split() if node != without else ():
            nodes.setdefault('/' + topic, []).append(node)
    return sorted(map(list, nodes.items()))


@pytest.mark.parametrize('without', ['', '/panel', '/joy_node', '/controller', '/gamepad', '/rviz', '/move_to_goal'])
def test_the_nodes_of_a_right_graph_have_no_wrong_names(without):
    state = [as_the_master_lists(PUBLISHED, without), as_the_master_lists(RECEIVED, without), []]
    assert list(judge_names(RobotGraph('/', state))) == []


@pytest.mark.parametrize('uri, problem', [
    ('', 'malformed'), ('localhost:11311', 'malformed'), ('http://localhost', 'malformed'),
    ('http://localhost:1', 'refused'), ('http://robot3.invalid:11311/', 'unresolved')])
def test_a_peer_without_an_answer_has_a_problem(uri, problem):
    peer = Peer(uri)
    assert peer.ask('getPid') is None and peer.problem == problem


def test_a_peer_that_never_answers_is_silent(monkeypatch):
    monkeypatch.setattr('tb3_labs.doctor.master_and_nodes.ANSWER_TIMEOUT', 0.1)
    with socket.create_server(('127.0.0.1', 0)) as server:
        peer = Peer('http://localhost:{}'.format(server.getsockname()[1]))
        assert peer.ask('getPid') is None and peer.problem == 'silent'


def test_the_nodes_around_a_robot():
    graph = RobotGraph('/robot3/', [
        [['/robot3/odom', [CORE]], ['/robot9/odom', ['/other']], ['/robot3/cmd_vel', ['/pad']],
         ['/rosout', ['/robot3/panel']]], [['/robot3/cmd_vel', ['/recorder', CORE]]], []])
    assert (graph.other_robots, graph.cmd_vel_listeners, graph.cmd_vel_publishers) == (['/robot9/'], [CORE], ['/pad'])
    assert graph.robot_nodes == [CORE]


@pytest.mark.parametrize('is_stopped, uri, is_named', [
    (True, 'http://localhost:1', True), (False, 'http://localhost:1', False), (True, 'http://localhost:2', False)])
def test_a_program_that_ctrl_z_stopped_is_named(tmp_path, is_stopped, uri, is_named):
    (tmp_path / 'roslaunch').write_text('import sys\nprint(flush=True)\nsys.stdin.read()\n')
    with subprocess.Popen([sys.executable, str(tmp_path / 'roslaunch'), 'ice6', 'imu.launch'], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, env=dict(os.environ, ROS_MASTER_URI='http://localhost:1')) as program:
        program.stdout.readline()
        if is_stopped:
            program.send_signal(signal.SIGSTOP)    # as Ctrl+Z does in a terminal
            os.waitid(os.P_PID, program.pid, os.WSTOPPED)
        lines = list(judge_programs(uri))
        program.kill()
    if is_named:
        check(*lines, WARNING, 'roslaunch ice6 imu.launch (process {}) is'.format(program.pid), 'type fg, then Ctrl+C')
    else:
        assert lines == []


# ----- examinations; doctor.test examines robots

def test_an_address_of_the_master_without_http_is_the_only_fault(monkeypatch):
    monkeypatch.setenv('ROS_MASTER_URI', 'localhost:12311')
    assert [line.subject for line in examine('/')] == ['Master']


def test_without_a_master_the_network_is_judged(monkeypatch):
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:1')
    address, master = examine('/')
    assert address.subject == 'Address'
    check(master, FAULT, 'refuses')
    assert [outgoing_address(address) for address in own_addresses()] == list(own_addresses())
