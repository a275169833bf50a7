"""A private master at a free port; processes; their costs: CPU time, memory, threads. On Linux."""
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
#: Below the ports that Linux gives to programs that ask for any port: a program that starts meanwhile, such
#: as a master's own roslaunch, cannot take one of these.
PORTS = range(20000, 32000)
_PAGE = os.sysconf('SC_PAGE_SIZE')


def free_port():
    """A TCP port of this computer on which nobody listens."""
    while True:
        port = random.choice(PORTS)
        with socket.socket() as probe:
            try:
                probe.bind(('127.0.0.1', port))
            except OSError:
                continue
            return port


def start_master(stack, port):
    """The TestProgram of this process's master; RuntimeError if it does not answer."""
    master = TestProgram(['rosmaster', '--core', '-p', str(port)])
    stack.callback(master.kill)
    if not wait_until(rosgraph.is_master_online, MASTER_TIMEOUT, 0.02):
        raise RuntimeError('rosmaster does not answer after {:.0f} s'.format(MASTER_TIMEOUT))
    return master


def processes_with(uri):
    """Yields the folder in /proc of each process that was started with this master."""
    for process in pathlib.Path('/proc').glob('[0-9]*'):
        with contextlib.suppress(OSError):    # it has ended, or belongs to another user
            if 'ROS_MASTER_URI={}\0'.format(uri).encode() in (process / 'environ').read_bytes():
                yield process


def process_of(node):
    """Process id of a running node, by its name."""
    uri = rosgraph.Master(rospy.get_name()).lookupNode(rospy.resolve_name(node))
    return xmlrpc.client.ServerProxy(uri).getPid(rospy.get_name())[2]


def cpu_time(pid):
    """CPU time of a process and its threads so far [s]."""
    # The process's own clock, see clock_getcpuclockid(3); /proc counts only in ticks of 10 ms.
    return time.clock_gettime((~pid << 3) | 2)


def threads(pid):
    """Number of threads of a process."""
    with open('/proc/{}/stat'.format(pid)) as stat:
        # the command's name may hold any character
        return int(stat.read().rpartition(')')[2].split()[17])


def memory(pid):
    """Resident memory of a process [MB]."""
    with open('/proc/{}/statm'.format(pid)) as statm:
        return int(statm.read().split()[1]) * _PAGE / 1048576.0
