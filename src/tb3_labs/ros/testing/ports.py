"""Ports for masters that tests and benchmarks start."""
import random
import socket

#: Below the ports that Linux gives to whoever asks for any: a program that starts meanwhile, such as a
#: master's own roslaunch, cannot take one of these.
PORTS = range(20000, 32000)


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
