"""Signals, waits and the end of a node; and the private parts of rospy that the nodes change."""
import contextlib
import os
import re
import runpy
import signal
import socket
import struct
import subprocess
import sys
import time
from functools import partial
from types import SimpleNamespace

import pytest

from geometry_msgs.msg import Twist, Vector3
from pages import SCRIPTS
from tb3_labs.ros import early_signals
from rosgraph.network import encode_ros_handshake_header
from rospy.impl.registration import RegManager
from rospy.impl.tcpros_base import TCPROSTransport, TCPServer
from rospy.impl.tcpros_pubsub import TCPROSPub
from rospy.topics import _PublisherImpl
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.node import Interrupted, catch_signals, end_roslaunch, exit_process, interruptible_sleep
from tb3_labs.ros.rospy_internals import join_publisher_lists, make_writes_immediate, serve_connections_in_threads


class Child:
    """A process that calls `before_it()`, and then `body(say)` with the signals of a node."""

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
        """Wait for the end of the process. Returns the rest of its output."""
        with self.lines:
            words = self.lines.read().split()
        os.waitpid(self.pid, 0)
        return words


def wait(say, looks=300):
    """Wait as run_node() does. A signal just before a sleep does not interrupt the sleep."""
    try:
        say('ready')
        for _ in range(looks):
            interruptible_sleep(0.2)
        say('woken')
    except Interrupted:
        say('interrupted')


#: A shell does this before it starts a background job of a script.
ignore_ctrl_c = partial(signal.signal, signal.SIGINT, signal.SIG_IGN)
#: nohup does this. The tests may run under nohup.
ignore_hangups = partial(signal.signal, signal.SIGHUP, signal.SIG_IGN)
allow_hangups = partial(signal.signal, signal.SIGHUP, signal.SIG_DFL)


@pytest.mark.parametrize('number, before_it', [
    (signal.SIGINT, allow_hangups), (signal.SIGINT, ignore_ctrl_c), (signal.SIGTERM, allow_hangups),
    (signal.SIGHUP, allow_hangups), (signal.SIGTSTP, allow_hangups)])
def test_a_signal_ends_a_wait(number, before_it):
    child = Child(wait, before_it)
    os.kill(child.pid, number)
    assert child.words() == ['interrupted']


def test_a_process_exits_with_its_status_or_with_1_after_a_failure(monkeypatch):
    """check_lab.py gives the status of its test."""
    statuses = []
    monkeypatch.setattr('tb3_labs.ros.node.rospy.is_shutdown', lambda: True)
    monkeypatch.setattr(os, '_exit', statuses.append)
    exit_process(3)
    monkeypatch.setattr('tb3_labs.ros.node._failures', ['a callback failed'])
    exit_process()
    assert statuses == [3, 1]


def test_nohup_is_respected():
    child = Child(lambda say: wait(say, 2), ignore_hangups)
    os.kill(child.pid, signal.SIGHUP)
    assert child.words() == ['woken']


def test_a_signal_that_a_library_swallows_ends_the_wait():
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
def test_only_a_roslaunch_is_ended(tmp_path, monkeypatch, name):
    (tmp_path / name).write_text('echo; read; exit 0')
    parent = subprocess.Popen(['bash', str(tmp_path / name)], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE)
    parent.stdout.readline()    # now the kernel knows its command line
    monkeypatch.setattr(os, 'getppid', lambda: parent.pid)
    end_roslaunch()
    parent.communicate()
    assert parent.returncode == (-signal.SIGTERM if name == 'roslaunch' else 0)


#: test_house.py shows that all nodes and tools run as these do.
NODE, MODULE, TOOL = 'scripts/gamepad.py --help', 'launch/run.py robot_description burger', 'scripts/mystery.py --help'


@pytest.mark.parametrize('program, output', [
    (NODE, '>/dev/full'), (MODULE, '>/dev/full'), (TOOL, '>/dev/full'), (TOOL, '>&-'), (TOOL, '| :'),
    (TOOL, '>&- 2>&- <&-')])
def test_a_closed_terminal_does_not_end_a_program(program, output):
    """Otherwise `mark.py ... | head` would lose the marks of a class."""
    line = '{{ python3 {}/{}; echo $? >&3; }} {}'.format(SCRIPTS.parent, program, output)
    ran = subprocess.run(['bash', '-c', line], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                         text=True, preexec_fn=lambda: os.dup2(1, 3), pass_fds=[3])
    assert ran.stdout == '0\n'


def test_a_deleted_folder_is_reported(tmp_path):
    ran = subprocess.run(['bash', '-c', 'mkdir "$0/gone"; cd "$0/gone"; rmdir "$0/gone"; exec "$@"', str(tmp_path),
                          sys.executable, str(SCRIPTS / 'skeleton.py'), 'turn', '.'], stderr=subprocess.PIPE, text=True)
    assert ran.stderr == 'skeleton.py: the current folder was deleted: go to another one, such as cd ~\n'


RUNS = re.compile(r'^from tb3_labs\.ros\.node import .*\brun_node\b', re.MULTILINE)
LAB_NODES = sorted(path.name for path in SCRIPTS.glob('*.py') if RUNS.search(path.read_text()))


def test_a_node_imports_early_signals_first():
    first = re.compile('^(?:import|from) (.*?)(?: |$)', re.MULTILINE)
    assert {first.search((SCRIPTS / name).read_text())[1] for name in LAB_NODES} == {early_signals.__name__}


@pytest.mark.parametrize('name, before_it', [(LAB_NODES[0], None), (LAB_NODES[0], ignore_ctrl_c)])
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


def test_a_hanging_subscriber_delays_no_other_subscriber_and_gets_the_last_message():
    topic, readers = _PublisherImpl('/cmd_vel', Twist), []
    make_writes_immediate(SimpleNamespace(impl=topic))
    for name in '/robot', '/hangs':
        written, read = socket.socketpair()
        readers.append(read)
        connection = TCPROSTransport(TCPROSPub('/cmd_vel', Twist), '/cmd_vel')
        connection.set_socket(written, name)
        topic.add_connection(connection)
    for count in range(1, 2001):
        topic.publish(Twist(linear=Vector3(count, 0.0, 0.0)))
        assert readers[0].recv(1000)[4:12] == struct.pack('<d', count)
    heard = b''
    while heard[-48:-40] != struct.pack('<d', 2000):
        heard += readers[1].recv(100000)
    times = [struct.unpack_from('<d', heard, start + 4)[0] for start in range(0, len(heard), 52)]
    assert times == sorted(times) and 100 < len(times) < 2000    # whole messages, in their order
    readers[1].close()
    topic.publish(Twist())
    assert wait_until(lambda: topic.publish(Twist()) or not topic.has_connection('/hangs'), 10.0)
    assert topic.has_connection('/robot')


def test_a_list_without_a_publisher_does_not_remove_a_waiting_publisher():
    """A publisher that registers together with a subscriber is found."""
    manager = RegManager(None)
    join_publisher_lists(manager)
    one, two = ['http://robot:1/'], ['http://robot:2/', 'http://robot:3/']
    for topic, given, kept in (('/odom', one, one), ('/odom', [], one), ('/imu', two, two)):
        manager.publisher_update(topic, given)
        assert manager.updates[-1] == (topic, kept)


def test_a_connection_of_a_browser_delays_no_node():
    """A browser, a scanner of ports, or a master that calls an earlier node makes such a connection."""
    server = TCPServer(lambda connection, _: connection.sendall(connection.recv(100)))
    serve_connections_in_threads(server)
    connect = partial(socket.create_connection, ('localhost', server.port))
    silent = [connect(0.9) for _ in range(20)]    # the server accepts nothing yet, and all fit
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


def test_a_connection_that_its_client_has_closed_is_not_served():
    """Else a publisher may drop the second connection of a subscriber, which closed its first."""
    served = []
    server = TCPServer(lambda connection, _: (served.append(connection.recv(100)),
                                              connection.sendall(b'welcome')))
    serve_connections_in_threads(server)
    headers = [encode_ros_handshake_header({'topic': topic}) for topic in ('/first', '/second')]
    first, second = (socket.create_connection(('localhost', server.port), 10.0) for _ in headers)
    first.sendall(headers[0])
    first.close()
    second.sendall(headers[1])
    server.start()
    assert second.recv(100) == b'welcome' and served == [headers[1]]
    second.close()
    server.shutdown()


@pytest.mark.parametrize('program, name, remedy', [
    (early_signals.__file__, 'squaternion', 'rosdep install --from-paths src --ignore-src -y.'),
    (early_signals.__file__, 'numpy', 'catkin_make'), (SCRIPTS / 'imu_sub.py', 'squaternion', 'setup.sh'),
    (SCRIPTS / 'doctor.py', 'tb3_labs.doctor.checks', 'setup.sh')])
def test_a_missing_package_of_python_is_one_line_with_a_remedy(program, name, remedy, monkeypatch):
    """The build runs early_signals.py, too."""
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(program))
    line = str(ended.value)
    assert 'no package ' + name in line and remedy in line and '\n' not in line
