"""A node's signals and end, in processes of their own; its waits, its log lines and commands."""
import contextlib
import functools
import os
import re
import runpy
import signal
import socket
import struct
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from geometry_msgs.msg import Twist, Vector3
from pages import SCRIPTS
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.ros import core_runner, early_signals, topics
from rosgraph.network import encode_ros_handshake_header
from rospy.impl.registration import RegManager
from rospy.impl.tcpros_base import TCPROSTransport, TCPServer
from rospy.impl.tcpros_pubsub import TCPROSPub
from rospy.topics import _PublisherImpl
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.node import Interrupted, catch_signals, pause
from tb3_labs.ros.rospy_internals import (
    answer_side_by_side, find_late_publishers, ignore_own_messages, write_at_once)


class Child:
    """A process that runs `body`, with the signals of a node. `before_it` is called first."""

    def __init__(self, body, before_it=lambda: None):
        ours, theirs = socket.socketpair()
        self.pid = os.fork()
        if not self.pid:
            with contextlib.suppress(BaseException):
                before_it()
                catch_signals()
                body(lambda word: theirs.sendall(word.encode() + b'\n'))
            os._exit(0)
        theirs.close()
        self.lines = ours.makefile()
        assert self.lines.readline() == 'ready\n'

    def words(self):
        """Returns the rest of its output, up to its end."""
        with self.lines:
            words = self.lines.read().split()
        os.waitpid(self.pid, 0)
        return words


def wait(say, looks=300):
    """A signal just before a sleep does not interrupt the sleep. run() waits in the same way."""
    try:
        say('ready')
        for _ in range(looks):
            pause(0.2)
        say('woken')
    except Interrupted:
        say('interrupted')


def ignores_ctrl_c():
    """A shell does this before it starts a background job of a script."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def heeds_hangups():
    """The tests may run under nohup: this undoes it."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def ignores_hangups():
    """Ignore SIGHUP, as nohup does."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)


@pytest.mark.parametrize('number, before_it', [
    (signal.SIGINT, heeds_hangups), (signal.SIGINT, ignores_ctrl_c), (signal.SIGTERM, heeds_hangups),
    (signal.SIGHUP, heeds_hangups), (signal.SIGTSTP, heeds_hangups)])
def test_a_signal_ends_a_wait(number, before_it):
    child = Child(wait, before_it)
    os.kill(child.pid, number)
    assert child.words() == ['interrupted']


def test_nohup_is_respected():
    child = Child(lambda say: wait(say, 2), ignores_hangups)
    os.kill(child.pid, signal.SIGHUP)
    assert child.words() == ['woken']


def test_a_signal_that_a_library_swallows_ends_the_wait_all_the_same():
    def body(say):
        try:
            say('ready')
            time.sleep(10.0)
        except:    # noqa: E722 (as the library does)
            say('swallowed')
        wait(say)

    child = Child(body)
    os.kill(child.pid, signal.SIGINT)
    assert child.words() == ['swallowed', 'ready', 'interrupted']


@pytest.mark.parametrize('name', ['roslaunch', 'another'])
def test_only_a_roslaunch_is_ended(tmp_path, name):
    parent = tmp_path / name
    parent.write_text('import subprocess, sys\nsubprocess.run([sys.executable, "-c", '
                      '"from tb3_labs.ros.node import end_roslaunch; end_roslaunch()"])\n')
    assert subprocess.call([sys.executable, str(parent)]) == (
        -signal.SIGTERM if name == 'roslaunch' else 0)


# ----- waits, log lines and terminals

RUN = SCRIPTS.parent / 'launch' / 'run.py'
#: A node, a module, and a tool; test_house.py sees that all are run as these are.
PRINTS = [(SCRIPTS / 'gamepad.py', '--help'), (RUN, 'robot_description', 'burger'), (SCRIPTS / 'mystery.py', '--list')]


@pytest.mark.parametrize('words, output', [(words, '>/dev/full') for words in PRINTS] + [
    (PRINTS[-1], output) for output in ('>&-', '| :', '>&- 2>&- <&-')],
    ids=lambda part: part if isinstance(part, str) else part[-1] + part[0].name)
def test_a_terminal_that_has_gone_ends_nothing(words, output):
    """Otherwise `mark.py ... | head` would lose the marks of a class."""
    ran = subprocess.run(['bash', '-c', '{{ "$@"; echo $? >&3; }} {}'.format(output), 'bash', sys.executable,
                          *map(str, words)], stdout=subprocess.PIPE, text=True,
                         stderr=subprocess.STDOUT, preexec_fn=lambda: os.dup2(1, 3), pass_fds=[3])
    assert ran.stdout == '0\n'


def test_a_folder_that_was_deleted_is_told(tmp_path):
    ran = subprocess.run(['bash', '-c', 'mkdir "$0/gone"; cd "$0/gone"; rmdir "$0/gone"; exec "$@"', str(tmp_path),
                          sys.executable, str(SCRIPTS / 'skeleton.py'), 'turn', '.'], stderr=subprocess.PIPE, text=True)
    assert ran.stderr == 'skeleton.py: the current folder was deleted: go to another one, such as cd ~\n'


@pytest.mark.parametrize('address', ['', 'localhost:11311', 'http://localhost:x'])
def test_an_address_of_a_master_that_is_none_is_told_with_a_valid_one(address, monkeypatch):
    monkeypatch.setenv('ROS_MASTER_URI', address)
    with pytest.raises(ValueError, match='ROS_MASTER_URI {} is not an address such as http'.format(address)):
        topics.require_master()


# ----- Ctrl+C while a node imports its modules

RUNS = re.compile(r'^from tb3_labs\.ros\.node import .*\brun\b', re.MULTILINE)
LAB_NODES = sorted(path.name for path in SCRIPTS.glob('*.py') if RUNS.search(path.read_text()))


def test_a_node_first_imports_what_ends_it():
    assert [name for name in LAB_NODES
            if re.search('^(?:import|from) (.*?)(?: |$)', (SCRIPTS / name).read_text(), re.M)[1]
            != 'tb3_labs.ros.early_signals'] == []


@pytest.mark.parametrize('name, before_it', [(LAB_NODES[0], None), (LAB_NODES[0], ignores_ctrl_c)])
def test_ctrl_c_ends_a_node_that_still_imports(name, before_it):
    node = subprocess.Popen([sys.executable, '-X', 'importtime', str(SCRIPTS / name)],
                            stderr=subprocess.PIPE, text=True, preexec_fn=before_it,
                            env=dict(os.environ, ROS_MASTER_URI='http://localhost:1'))
    try:
        for line in node.stderr:
            if 'rospy.' in line:
                break
        node.send_signal(signal.SIGINT)
        assert node.wait(100.0) == -signal.SIGINT and 'Traceback' not in node.stderr.read()
    finally:
        node.kill()
        node.wait()
        node.stderr.close()


@pytest.mark.parametrize('command, sent', [
    ((0.2, 1e-40), (0.2, 0.0)), ((-1e-300, -2.0), (0.0, -2.0)), ((2e-4, -2e-4), (2e-4, -2e-4)),
    ((1e-40, -1e-40), None)])
def test_a_speed_that_turns_no_motor_is_sent_as_zero(monkeypatch, command, sent):
    published = []
    monkeypatch.setattr(core_runner.rospy, 'Publisher',
                        lambda *_, **__: SimpleNamespace(publish=lambda twist: published.append(
                            (twist.linear.x, twist.angular.z))))
    monkeypatch.setattr(core_runner, 'write_at_once', lambda publisher: None)
    core_runner.CmdVel().send(Twist2(*command))
    assert published == ([sent] if sent else [])


def test_a_subscriber_that_hangs_holds_up_no_other_and_hears_the_last_message_later():
    """The private parts of rospy that this package changes."""
    topic, readers = _PublisherImpl('/cmd_vel', Twist), []
    write_at_once(SimpleNamespace(impl=topic))
    for name in '/robot', '/hangs':
        written, read = socket.socketpair()
        readers.append(read)
        connection = TCPROSTransport(TCPROSPub('/cmd_vel', Twist), '/cmd_vel')
        connection.set_socket(written, name)
        topic.add_connection(connection)
    for count in range(1, 20001):
        topic.publish(Twist(linear=Vector3(count, 0.0, 0.0)))
        assert readers[0].recv(1000)[4:12] == struct.pack('<d', count)
    heard = b''
    while heard[-48:-40] != struct.pack('<d', 20000):
        heard += readers[1].recv(100000)
    times = [struct.unpack_from('<d', heard, start + 4)[0] for start in range(0, len(heard), 52)]
    assert times == sorted(times) and 100 < len(times) < 20000    # whole messages, in their order
    readers[1].close()
    topic.publish(Twist())
    assert wait_until(lambda: topic.publish(Twist()) or not topic.has_connection('/hangs'), 10.0)
    assert topic.has_connection('/robot')


def test_an_answer_without_a_publisher_does_not_hide_one_of_its_topic_that_was_told_before():
    """The changed private part of rospy overlooks no publisher that registers together with a subscriber."""
    manager = RegManager(None)
    find_late_publishers(manager)
    one, two = ['http://robot:1/'], ['http://robot:2/', 'http://robot:3/']
    ignore_own_messages('/cmd_vel')
    manager.uri = two[0]
    for topic, given, kept in (('/odom', one, one), ('/odom', [], one), ('/imu', two, two),
                               ('/cmd_vel', one + two, one + two[1:])):
        manager.publisher_update(topic, given)
        assert manager.updates[-1] == (topic, kept)


def test_a_connection_that_is_no_node_holds_up_no_other():
    """A browser, a scanner of ports, or a master that calls an earlier node does this."""
    server = TCPServer(lambda connection, _: connection.sendall(connection.recv(100)))
    answer_side_by_side(server)
    connect = functools.partial(socket.create_connection, ('localhost', server.port))
    silent = [connect(0.9) for _ in range(20)]    # none is tried again after 1 s: nobody accepts yet
    request = connect(10.0)
    request.sendall(b'POST /RPC2 HTTP/1.1')
    node = connect(10.0)
    header = encode_ros_handshake_header({'topic': '/imu'})
    node.sendall(header)
    server.start()
    assert node.recv(100) == header
    with contextlib.suppress(ConnectionResetError):
        assert request.recv(100) == b''
    for connection in (*silent, request, node):
        connection.close()
    server.shutdown()


@pytest.mark.parametrize('name', ['squaternion', 'numpy'])
def test_a_workspace_without_a_package_of_python_is_told_what_to_type(name, monkeypatch):
    """The build runs this file, too."""
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(early_signals.__file__)
    said = str(ended.value)
    assert said.startswith('tb3_labs: {} has no package {}. '.format(sys.executable, name))
    assert 'rosdep install --from-paths src --ignore-src -y.' in said and '\n' not in said


def test_a_program_without_squaternion_says_so_in_one_line():
    run = subprocess.run([sys.executable, '-c', 'import runpy, sys; sys.modules["squaternion"] = '
                          'None; runpy.run_path(sys.argv[1], run_name="__main__")',
                          str(SCRIPTS / 'imu_sub.py')], stderr=subprocess.PIPE, text=True)
    assert run.returncode == 1 and run.stderr.count('\n') == 1
    assert 'no package squaternion' in run.stderr and 'setup.sh' in run.stderr
