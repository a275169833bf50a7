"""Checks the address that the nodes of this computer advertise.

An address is a text such as '192.168.0.5', or '' if there is no address. Only IPv4 is used, as in
ROS 1. A node *advertises* the name or address to which other nodes connect. As in rospy, the
advertised name is ROS_HOSTNAME, else ROS_IP, else the computer's name.
"""
import os
import socket
import subprocess
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Tuple

from tb3_labs.doctor import Finding, fault, ok, warning


def is_loopback(address: str) -> bool:
    """Returns True if an address or a name belongs to the loopback interface."""
    return address.startswith('127.') or address in ('localhost', '::1')


@lru_cache(maxsize=None)
def own_addresses() -> Tuple[str, ...]:
    """Returns the addresses of this computer, without the loopback addresses."""
    result = subprocess.run(['hostname', '-I'], stdout=subprocess.PIPE, universal_newlines=True)
    return tuple(address for address in result.stdout.split() if ':' not in address)


def is_own(address: str) -> bool:
    """Returns True if an address belongs to this computer."""
    return is_loopback(address) or address in own_addresses()


@lru_cache(maxsize=None)
def address_of(name: str) -> str:
    """Returns a host's address, perhaps after seconds, or '' if the name does not resolve."""
    try:
        return socket.gethostbyname(name) if name else ''
    except (OSError, UnicodeError):
        return ''


def outgoing_address(address: str) -> str:
    """Returns the address from which this computer sends to `address`, or '' without a route."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))    # the port does not matter, because nothing is sent
            return str(probe.getsockname()[0])
        except OSError:
            return ''


@dataclass(frozen=True)
class Computer:
    """The settings of this computer's address, and the addresses that it really has."""

    ros_ip: str = ''
    ros_hostname: str = ''
    hostname: str = ''                 # the computer's own name
    resolved_address: str = ''         # the address of the advertised name
    addresses: Tuple[str, ...] = ()    # without the loopback addresses
    outgoing_address: str = ''         # the address from which this computer sends to the master
    is_master_here: bool = True        # the master runs on this computer

    @property
    def advertised_name(self) -> str:
        """The name or address that this computer advertises."""
        return self.ros_hostname or self.ros_ip or self.hostname

    @property
    def remedy(self) -> str:
        """The commands that make this computer's nodes advertise the right address. If the master
        is on this computer, the right address is the first of the `addresses`."""
        unset = 'unset ROS_HOSTNAME; ' if self.ros_hostname else ''
        usable = (address for address in (self.outgoing_address, *self.addresses)
                  if address and not is_loopback(address))
        address = next(usable, 'ADDRESS_OF_THIS_COMPUTER')
        return f'{unset}export ROS_IP={address}, then start the nodes here again'


def this_computer(master_address: str) -> Computer:
    """Returns the Computer that runs this program. An unknown `master_address` is ''."""
    computer = Computer(
        ros_ip=os.environ.get('ROS_IP', ''), ros_hostname=os.environ.get('ROS_HOSTNAME', ''),
        hostname=socket.gethostname(), addresses=own_addresses(),
        is_master_here=not os.environ.get('ROS_MASTER_URI'))
    if master_address:
        computer = replace(computer, outgoing_address=outgoing_address(master_address),
                           is_master_here=is_own(master_address))
    return replace(computer, resolved_address=address_of(computer.advertised_name))


def judge_address(computer: Computer) -> Finding:
    """Judges whether other computers can reach this computer by its advertised name."""
    if not computer.ros_ip and not computer.ros_hostname:
        text = 'neither ROS_IP nor ROS_HOSTNAME is set: '
        if computer.is_master_here:
            return ok('Address', text + 'this is right for this computer alone')
        text += f'the robot is told the name {computer.hostname}, and may not resolve it'
        return warning('Address', text, computer.remedy)
    resolved = computer.resolved_address
    text = _setting_text(computer)
    if is_loopback(resolved) and computer.is_master_here:
        text += ' is right for this computer alone; for a real robot set ROS_IP'
        return ok('Address', text)
    if resolved in computer.addresses:
        return ok('Address', text + ' is an address of this computer')
    if not resolved:
        text += ' does not resolve, not even here'
    elif is_loopback(resolved):
        text += (': on the robot this address is the robot itself, so the robot cannot reach this '
                 'computer')
    else:
        addresses = ', '.join(computer.addresses) or 'none'
        text += f' is not an address of this computer (it has {addresses})'
    return fault('Address', text, computer.remedy)


def _setting_text(computer):
    """Returns a text such as ROS_IP='192.168.0.5', with the resolved address of a name."""
    variable = 'ROS_HOSTNAME' if computer.ros_hostname else 'ROS_IP'
    text = f'{variable}={computer.advertised_name!r}'
    resolved = computer.resolved_address
    if resolved not in ('', computer.advertised_name) and not is_loopback(resolved):
        text += f' ({resolved})'
    if computer.ros_hostname and computer.ros_ip:
        text += f' (it goes before ROS_IP={computer.ros_ip!r})'
    return text
