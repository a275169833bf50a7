"""Starts a separate master at a free port, and measures CPU time, memory and threads of processes on Linux."""
import contextlib
import os
import pathlib
import random
import socket
import time
import xmlrpc.client

import rosgraph
import rospy

from node_case import TestProgram
from tb3_labs.ros.clocks import wait_until

#: Longest wait for a master, or a node [s].
MASTER_TIMEOUT = 30.0
#: Linux gives higher ports to programs that ask for any port. So a program that starts meanwhile, such as the
#: roslaunch of a master, takes none of these ports.
PORTS = range(20000, 32000)
_PAGE = os.sysconf('SC_PAGE_SIZE')


def free_port():
    """Returns a TCP port of this computer on which no program listens."""
    while True:
        port = random.choice(PORTS)
        with socket.socket() as probe:
            try:
                probe.bind(('127.0.0.1', port))
            except OSError:
                continue
            return port


def start(stack, command, **options):
    """Starts a program, which the ExitStack `stack` ends."""
    started = TestProgram(command, **options)
    stack.callback(started.kill)
    return started


def start_master(stack, port):
    """Starts the master of this process. Raises RuntimeError if the master does not answer."""
    master = start(stack, ['rosmaster', '--core', '-p', str(port)])
    if not wait_until(rosgraph.is_master_online, MASTER_TIMEOUT, 0.02):
        raise RuntimeError('rosmaster does not answer after {:.0f} s'.format(MASTER_TIMEOUT))
    return master


@contextlib.contextmanager
def benchmark():
    """Makes this process a node of a new master at a free port. Yields the ExitStack that ends the processes."""
    print('machine: {} cores, load {:.1f}'.format(os.cpu_count(), os.getloadavg()[0]))
    port = free_port()
    os.environ.update(ROS_MASTER_URI='http://localhost:%d' % port, ROS_HOSTNAME='localhost')
    with contextlib.ExitStack() as stack:
        start_master(stack, port)
        rospy.init_node('benchmark', disable_signals=True)
        try:
            yield stack
        finally:
            rospy.signal_shutdown('done')


def wait_for_node(node, topic):
    """Waits until a node is connected to a topic. Returns its process id. Raises RuntimeError if it does not start."""
    def is_there():
        with contextlib.suppress(rosgraph.MasterException, OSError):
            publishers, subscribers, _ = rosgraph.Master(rospy.get_name()).getSystemState()
            return any('/' + node in nodes for name, nodes in publishers + subscribers
                       if name == '/' + topic)
    if not wait_until(is_there, MASTER_TIMEOUT, 0.01):
        raise RuntimeError(node + ' does not start')
    return process_of(node)


def processes_with(uri):
    """Yields the folder in /proc of each process that was started with this master."""
    for process in pathlib.Path('/proc').glob('[0-9]*'):
        with contextlib.suppress(OSError):    # it has ended, or belongs to another user
            if 'ROS_MASTER_URI={}\0'.format(uri).encode() in (process / 'environ').read_bytes():
                yield process


def process_of(node):
    """Returns the process id of the node with this name."""
    uri = rosgraph.Master(rospy.get_name()).lookupNode(rospy.resolve_name(node))
    return xmlrpc.client.ServerProxy(uri).getPid(rospy.get_name())[2]


def cpu_time(pid):
    """Returns the CPU time that a process has used [s]."""
    # The process's own clock, see clock_getcpuclockid(3); /proc counts only in ticks of 10 ms.
    return time.clock_gettime((~pid << 3) | 2)


def shares(seconds, *pids):
    """Returns the CPU shares of processes [%], measured for `seconds`."""
    before, begun = [cpu_time(pid) for pid in pids], time.monotonic()
    time.sleep(seconds)
    took = time.monotonic() - begun
    return [100.0 * (cpu_time(pid) - then) / took for pid, then in zip(pids, before)]


def threads(pid):
    """Returns the number of threads of a process."""
    with open('/proc/{}/stat'.format(pid)) as stat:
        # the command's name may hold any character
        return int(stat.read().rpartition(')')[2].split()[17])


def memory(pid):
    """Returns the resident memory of a process [MB]."""
    with open('/proc/{}/statm'.format(pid)) as statm:
        return int(statm.read().split()[1]) * _PAGE / 1048576.0
