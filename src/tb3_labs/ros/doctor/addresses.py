"""The addresses of this computer, and what names resolve to here. IPv4 alone, as ROS 1 has it."""
import fcntl
import os
import socket
import struct

from tb3_labs.doctor.network import is_loopback

#: Asks for the address of an interface (Linux, netdevice(7)).
SIOCGIFADDR = 0x8915


def own_addresses():
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


def resolved(name):
    """The address of a name. It may wait for seconds: call it within a deadline."""
    return socket.getaddrinfo(name, None, socket.AF_INET, socket.SOCK_STREAM)[0][4][0]


def way_out(address):
    """This computer's address on the way to another; '' without a way. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))
            return probe.getsockname()[0]
        except OSError:
            return ''


def is_own(address):
    """Does an address belong to this computer?"""
    return is_loopback(address) or address in own_addresses()


def nat_kind():
    """'WSL', 'a container', or '' for a computer of its own."""
    try:
        with open('/proc/version') as file:
            if 'microsoft' in file.read().lower():
                return 'WSL'
    except OSError:
        pass
    return 'a container' if any(map(os.path.exists, (
        '/.dockerenv', '/run/.containerenv'))) else ''
