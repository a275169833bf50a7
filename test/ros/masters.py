"""Starts a separate master at a free port, and finds the processes that belong to a master."""
import contextlib
import pathlib
import random
import socket
import time
import xmlrpc.client

import rosgraph
import rospy

from node_case import TestProgram
from tb3_labs.ros.clocks import wait_until

#: Longest wait for a master [s].
MASTER_TIMEOUT = 30.0
#: Linux gives higher ports to programs that ask for any port. So a program that starts meanwhile, such as the
#: roslaunch of a master, takes none of these ports.
PORTS = range(20000, 32000)


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


def start_master(port):
    """Starts the master of this process. Raises RuntimeError if the master does not answer."""
    master = TestProgram(['rosmaster', '--core', '-p', str(port)])
    if not wait_until(rosgraph.is_master_online, MASTER_TIMEOUT, 0.02):
        master.kill()
        raise RuntimeError('rosmaster does not answer after {:.0f} s'.format(MASTER_TIMEOUT))
    return master


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
