"""An embedded robot's bytes reach a subscriber whole and in order, whenever it reads; nobody waits."""
import socket

import pytest

from tb3_labs.ros.robot.outbox import CAPACITY, Outbox

#: Of the size of an IMU message.
SIZE = 330


def piece(number, size=SIZE):
    return number.to_bytes(4, 'big') * (size // 4 + 1)


@pytest.fixture
def pair():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        yield ours, theirs


def read_all(stream):
    stream.setblocking(False)
    data = b''
    try:
        while True:
            data += stream.recv(1000000)
    except BlockingIOError:
        return data


def test_what_is_read_at_once_arrives_at_once(pair):
    ours, theirs = pair
    outbox = Outbox(ours)
    for number in range(100):
        assert outbox.send(piece(number))
        assert theirs.recv(1000) == piece(number)


@pytest.mark.parametrize('size', [SIZE, 100000])
def test_who_does_not_read_gets_whole_pieces_in_order_and_later_all_that_is_new(pair, size):
    ours, theirs = pair
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 5000)
    outbox, accepted = Outbox(ours), []
    for number in range(5000):
        if outbox.send(piece(number, size)):
            accepted.append(number)
    assert CAPACITY / size < len(accepted) < 4000
    got = read_all(theirs)
    for number in range(5000, 5100):       # it reads again
        assert outbox.send(piece(number, size)) or size > CAPACITY
        got += read_all(theirs)
    while outbox._waiting:
        outbox.send(b'')
        got += read_all(theirs)
    length = len(piece(0, size))
    assert len(got) % length == 0
    numbers = [int.from_bytes(got[at:at + 4], 'big') for at in range(0, len(got), length)]
    assert got == b''.join(piece(number, size) for number in numbers)
    assert numbers[:len(accepted)] == accepted
    if size < CAPACITY:
        assert numbers == accepted + list(range(5000, 5100))


def test_a_piece_may_be_larger_than_what_waits_otherwise(pair):
    """The messages of a network's longest stall come as one piece."""
    ours, theirs = pair
    outbox, stall = Outbox(ours), piece(7, 10 * CAPACITY)
    assert outbox.send(stall)
    got = read_all(theirs)
    while len(got) < len(stall):
        outbox.send(b'')
        got += read_all(theirs)
    assert got == stall


def test_a_subscriber_that_is_gone_is_told(pair):
    ours, theirs = pair
    theirs.close()
    with pytest.raises(OSError):
        Outbox(ours).send(piece(1))
