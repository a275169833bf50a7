"""Two hosts on one machine. Each host is a network namespace. A third namespace connects them, and can be cut.

Needs root and iproute2. A process starts on a host with the words of :meth:`TwoHosts.prefix` and the host's
environment. A running thread calls :meth:`TwoHosts.enter`.
"""
import contextlib
import ctypes
import os
import subprocess
from unittest import mock

HOSTS = {'robot': '10.77.1', 'laptop': '10.77.2'}
CLONE_NEWNET = 0x40000000
PREFIX = 'tb3labs-{}-'.format(os.getpid())


class TwoHosts:
    """Makes the hosts. Call :meth:`remove` at the end."""

    @staticmethod
    def missing():
        """Returns the reason why hosts cannot be made here, or ''."""
        if os.geteuid() != 0:
            return 'network namespaces need root'
        if subprocess.call(['which', 'ip'], stdout=subprocess.DEVNULL):
            return 'iproute2 is not installed'
        trial = PREFIX + 'trial'
        if subprocess.call(['ip', 'netns', 'add', trial], stderr=subprocess.DEVNULL):
            return 'network namespaces are not allowed here'
        subprocess.call(['ip', 'netns', 'del', trial])
        return ''

    def __init__(self):
        for name in ('lab',) + tuple(HOSTS):
            _ip('netns add {0}{1}; -n {0}{1} link set lo up', name)
        for number, (name, net) in enumerate(HOSTS.items()):
            _ip('link add tb{2}a netns {0}{1} type veth peer name tb{2}b netns {0}lab;'
                '-n {0}{1} addr add {3}.2/24 dev tb{2}a; -n {0}{1} link set tb{2}a up;'
                '-n {0}lab addr add {3}.1/24 dev tb{2}b; -n {0}lab link set tb{2}b up;'
                '-n {0}{1} route add default via {3}.1', name, number, net)
        self.connect(True)

    @staticmethod
    def address(name):
        return HOSTS[name] + '.2'

    def environment(self, name):
        """Returns the environment of a ROS node on a host. The master is on the laptop."""
        return {'ROS_IP': self.address(name), 'ROS_HOSTNAME': self.address(name),
                'ROS_MASTER_URI': 'http://{}:11311'.format(self.address('laptop'))}

    @staticmethod
    def prefix(name):
        """Returns the words in front of a command that runs on a host."""
        return ['ip', 'netns', 'exec', PREFIX + name]

    def enter(self, name):
        """From now on this thread, and each thread that this thread starts, is on a host."""
        os.environ.update(self.environment(name))
        with open('/run/netns/' + PREFIX + name) as host:
            _join(host)

    @contextlib.contextmanager
    def on(self, name):
        """The body of a `with` runs on a host, with the host's environment."""
        with open('/proc/thread-self/ns/net') as before, mock.patch.dict(os.environ):
            self.enter(name)
            try:
                yield
            finally:
                _join(before)

    @staticmethod
    def connect(yes):
        """Connect the hosts, or cut their connection."""
        subprocess.check_call(TwoHosts.prefix('lab') + [
            'sh', '-c', 'echo {:d} > /proc/sys/net/ipv4/ip_forward'.format(yes)])

    @staticmethod
    def remove():
        """Remove the hosts and their network."""
        for name in ('lab',) + tuple(HOSTS):
            _ip('netns del {0}{1}', name)


def _ip(commands, *arguments):
    for command in commands.format(PREFIX, *arguments).split(';'):
        subprocess.check_call(['ip'] + command.split())


def _join(namespace):
    """Let this thread join the network namespace of an open file."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.setns(namespace.fileno(), CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), 'setns: ' + os.strerror(ctypes.get_errno()))
