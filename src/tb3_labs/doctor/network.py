"""The way between this computer and the others: addresses, names, NAT, masters.

Addresses are texts such as '192.168.0.5', only IPv4, as in ROS 1; '' is not an address. Nodes of
this computer *tell* others an address to connect to: ROS_HOSTNAME, else ROS_IP, else the computer's
own name, as in rospy.
"""
import fcntl
import ipaddress
import os
import socket
import struct
from dataclasses import dataclass
from typing import Sequence, Tuple

from tb3_labs.doctor.line import Line, fault, ok, warning

#: The private network that WSL 2 and Docker put between a Linux and its host.
NAT = ipaddress.ip_network('172.16.0.0/12')
#: The request for the address of an interface (Linux, netdevice(7)).
SIOCGIFADDR = 0x8915


def is_loopback(address: str) -> bool:
    """Does an address mean the computer itself?"""
    return address.startswith('127.') or address in ('localhost', '::1')


def own_addresses() -> Tuple[str, ...]:
    """The addresses of this computer, without the loopback's."""
    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            try:
                answer = fcntl.ioctl(probe.fileno(), SIOCGIFADDR,
                                     struct.pack('256s', name.encode()[:15]))
            except OSError:
                continue    # an interface without an address
            address = socket.inet_ntoa(answer[20:24])
            if not is_loopback(address):
                found.append(address)
    return tuple(found)


def resolved(name: str) -> str:
    """Returns the address of a name. This may take seconds: call it with a deadline."""
    return str(socket.getaddrinfo(name, None, socket.AF_INET, socket.SOCK_STREAM)[0][4][0])


def way_out(address: str) -> str:
    """Returns this computer's address on the way to `address`; '' without a way. Sends nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))
            return str(probe.getsockname()[0])
        except OSError:
            return ''


def is_own(address: str) -> bool:
    """Does an address belong to this computer?"""
    return is_loopback(address) or address in own_addresses()


def nat_kind() -> str:
    """Returns 'WSL' or 'a container' if this Linux runs in one, else ''."""
    try:
        with open('/proc/version') as file:
            if 'microsoft' in file.read().lower():
                return 'WSL'
    except OSError:
        pass
    return 'a container' if any(map(os.path.exists, (
        '/.dockerenv', '/run/.containerenv'))) else ''


@dataclass(frozen=True)
class Address:
    """The address that this computer tells others, and its real addresses.

    `hostname` is the computer's own name; `resolved` is the address of the told name, as looked up
    here; `own` are all addresses but the loopback; `way_out` is the address from which packets go
    to the master (the loopback, if they go over the loopback). `master_here`: does the master run
    on this computer?
    """

    ros_ip: str = ''
    ros_hostname: str = ''
    hostname: str = ''
    resolved: str = ''
    own: Tuple[str, ...] = ()
    way_out: str = ''
    master_here: bool = True

    @property
    def told(self) -> str:
        """The address or name that others are told."""
        return self.ros_hostname or self.ros_ip or self.hostname

    @property
    def source(self) -> str:
        """The told address or name with its origin, such as 'ROS_IP=192.168.0.5'."""
        for name, value in (('ROS_HOSTNAME', self.ros_hostname), ('ROS_IP', self.ros_ip)):
            if value:
                return '{}={}'.format(name, value)
        return 'the name {}'.format(self.hostname)

    @property
    def advice(self) -> str:
        """The commands that tell others the right address."""
        address = self.way_out if self.way_out and not is_loopback(self.way_out) else (
            self.own[0] if self.own else 'ADDRESS_OF_THIS_COMPUTER')
        return '{}export ROS_IP={}, then start the nodes here again'.format(
            'unset ROS_HOSTNAME; ' if self.ros_hostname else '', address)


def judge_address(here: Address) -> Line:
    """Can others reach this computer by the address that its nodes tell them?"""
    if not here.ros_ip and not here.ros_hostname:
        if here.master_here:
            return ok('Address', 'neither ROS_IP nor ROS_HOSTNAME is set: good for this computer '
                      'alone')
        return warning('Address', 'neither ROS_IP nor ROS_HOSTNAME is set: the robot is told the '
                       'name {}, and may not resolve it'.format(here.hostname), here.advice)
    if not here.resolved:
        return fault('Address', '{} does not resolve, not even here'.format(here.source),
                     here.advice)
    if is_loopback(here.resolved):
        if here.master_here:
            return ok('Address', '{}: this computer alone; for a real robot set ROS_IP'.format(
                here.source))
        return fault('Address', '{} means, on the robot, the robot itself: it cannot reach this '
                     'computer'.format(here.source), here.advice)
    if here.resolved not in here.own:
        return fault('Address', '{} is not an address of this computer (it has {})'.format(
            _with_address(here), ', '.join(here.own) or 'none'), here.advice)
    if not here.master_here and here.way_out and here.resolved != here.way_out:
        return warning('Address', '{} is in another network than the master (the way there begins '
                       'at {})'.format(_with_address(here), here.way_out), here.advice)
    if here.ros_hostname and here.ros_ip and here.ros_ip != here.resolved:
        return warning('Address', 'ROS_HOSTNAME={} goes before ROS_IP={}, and is another address '
                       '({})'.format(here.ros_hostname, here.ros_ip, here.resolved),
                       'unset ROS_HOSTNAME')
    return ok('Address', '{} is an address of this computer'.format(_with_address(here)))


def _with_address(here: Address) -> str:
    known = here.resolved in ('', here.told)
    return here.source if known else '{} ({})'.format(here.source, here.resolved)


def judge_nat(kind: str, way_out: str, others_elsewhere: bool) -> Line:
    """Can a robot reach this computer through NAT? `kind`: see :func:`nat_kind`;
    `others_elsewhere`: is the master or the robot on another computer?"""
    if not kind:
        return ok('NAT', 'this is neither WSL nor a container')
    if not way_out or ipaddress.ip_address(way_out) not in NAT:
        return ok('NAT', 'this is {}, but its address is not one of NAT'.format(kind))
    if not others_elsewhere:
        return ok('NAT', 'this is {} behind NAT ({}): good for the simulated robot alone'.format(
            kind, way_out))
    return fault(
        'NAT', 'this is {} behind NAT: no robot can reach {}'.format(kind, way_out),
        'networkingMode=mirrored in .wslconfig (Windows 11), then wsl --shutdown; else use a Linux '
        'of its own' if kind == 'WSL' else 'start the container with the network of its host')


#: The problems in reaching a program at an address, and their words.
PROBLEMS = {
    'malformed': 'is not an address such as http://192.168.0.5:11311',
    'unresolved': 'has a name that this computer cannot resolve',
    'refused': 'refuses: the computer is on, but nothing listens there',
    'silent': 'does not answer',
    'unreachable': 'cannot be reached: there is no way to that network',
    'strange': 'answers, but not as a ROS program'}


@dataclass(frozen=True)
class Answer:
    """The outcome of a question to a program at `uri`: `problem` is a key of PROBLEMS, or '';
    `address` is the address of the name in `uri`; `round_trip` is the time until the answer [s]."""

    uri: str
    problem: str = ''
    address: str = ''
    round_trip: float = 0.0


def judge_master(master: Answer) -> Line:
    """Does a master answer?"""
    where = master.uri or '(empty)'
    if master.address and master.address not in where:
        where += ' ({})'.format(master.address)
    if not master.problem:
        return ok('Master', '{} answers in {:.0f} ms'.format(where, 1e3 * master.round_trip))
    return fault('Master', 'ROS_MASTER_URI {} {}'.format(where, PROBLEMS[master.problem]), {
        'malformed': 'export ROS_MASTER_URI=http://ADDRESS:11311',
        'unresolved': "put the master's address in place of the name: export "
                      'ROS_MASTER_URI=http://ADDRESS:11311',
        'refused': 'start roscore, or a launch file, on that computer',
    }.get(master.problem, 'is that computer on, in the same network, and is the address still its '
          'own? ping ' + (master.address or 'ADDRESS')))


def judge_second_master(master: str, others: Sequence[str]) -> Line:
    """Is there one master only? `others`: addresses, with port, of other masters that answered."""
    if not others:
        return ok('Masters', 'no second master was found')
    return warning('Masters', 'another master answers at {}: programs that use it do not see those '
                   'of {}'.format(', '.join(others), master),
                   'end the roscore, or roslaunch, that began there')
