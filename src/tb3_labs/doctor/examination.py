"""The doctor's looks, in order; each gives its lines as soon as it knows them."""
import os
import socket
import time
from dataclasses import replace

from tb3_labs.doctor.computer import look_at_devices, look_at_disk, look_at_python
from tb3_labs.doctor.listening import Ear, compare, imu_of, listen, stamp_of, wheels_of
from tb3_labs.doctor.network import (
    Address, is_own, judge_address, judge_master, judge_nat, judge_second_master, nat_kind,
    own_addresses, resolved, way_out)
from tb3_labs.doctor.questions import (
    RESOLVING, Graph, Peer, ask_all, local_drivers, master_names, peers_of, second_masters,
    together, within)
from tb3_labs.doctor.robot import (
    judge_clock, judge_drivers, judge_gyro, judge_names, judge_nodes, judge_presence, judge_stream,
    judge_way_back)

#: A robot needs at most this long to connect to a driver that has just been started [s].
CONNECTING = 1.0


def examine(namespace, seconds):
    """The lines on this computer and on the robot in `namespace`, listening for `seconds`."""
    yield look_at_python()
    master = Peer(os.environ.get('ROS_MASTER_URI', ''))
    told = os.environ.get('ROS_HOSTNAME') or os.environ.get('ROS_IP') or socket.gethostname()
    address, state = together([
        (within, RESOLVING, resolved, told), (master.ask, 'getSystemState')])
    here = _address(address or '', master.address)
    yield judge_address(here)
    if state is None:
        yield judge_nat(nat_kind(), _way_or_first(here), not here.master_here)
        yield judge_master(master.answer)
    else:
        yield from _Robot(namespace, master, here, state).examine(seconds)
    yield from look_at_devices()
    yield look_at_disk()


def _address(of_told, master_address):
    """The Address of this computer, on the way to the master if that has an address."""
    return Address(
        os.environ.get('ROS_IP', ''), os.environ.get('ROS_HOSTNAME', ''), socket.gethostname(),
        of_told, own_addresses(), way_out(master_address) if master_address else '',
        is_own(master_address) if master_address else not os.environ.get('ROS_MASTER_URI'))


def _way_or_first(here):
    return here.way_out or (here.own[0] if here.own else '')


class _Robot:
    """All looks that need a master."""

    def __init__(self, namespace, master, here, state):
        self._master, self._here = master, here
        self._graph = Graph(namespace, state)
        self._namespace = namespace
        #: {node: Peer} of the robot's nodes, and of those that publish cmd_vel.
        self._peers = peers_of(master, self._graph.robot_nodes)
        self._drivers = peers_of(master, self._graph.drivers)

    def examine(self, seconds):
        """The lines on master, robot, its nodes, and their messages."""
        pids = ask_all(dict(self._drivers, **self._peers), 'getPid')
        hosts = {peer.address for peer in self._peers.values() if peer.address}
        yield judge_nat(nat_kind(), _way_or_first(self._here), not self._here.master_here or any(
            not is_own(host) for host in hosts))
        yield judge_master(self._master.answer)
        # a computer that does not answer at all would not answer as a master either
        reached = {peer.address for peer in self._peers.values()
                   if peer.answer.problem in ('', 'refused')}
        yield judge_second_master(self._master.uri, second_masters(self._master, reached))
        yield judge_presence(self._graph.imu, self._graph.odom, self._graph.hearers,
                             self._namespace, self._graph.others)
        if not self._peers:
            return
        yield judge_nodes({node: peer.answer for node, peer in self._peers.items()},
                          self._here.master_here)
        alive = {node: peer for node, peer in self._peers.items() if pids[node] is not None}
        if not alive:
            return    # no node is left that could be asked or heard
        yield from self._ways(alive)
        yield from self._listen(seconds, alive)

    def _ways(self, alive):
        """The lines on names, and on the way from the robot to this computer."""
        yield judge_names(master_names(alive, self._master), self._master.address)
        hearer = next((node for node in self._graph.hearers if node in alive), None)
        if hearer is None:
            return
        address = alive[hearer].address
        mine = {node: peer for node, peer in self._drivers.items() if node not in self._peers and (
            peer.answer.problem == 'unresolved'
            or is_own(peer.address) and not peer.answer.problem)}
        drivers = local_drivers(mine, alive[hearer])
        if drivers and not all(driver.is_connected for driver in drivers):
            time.sleep(CONNECTING)    # a driver may have been started just now
            drivers = local_drivers(mine, alive[hearer]) or drivers
        here = replace(self._here, way_out=way_out(address), master_here=False)
        yield judge_way_back(drivers, hearer, here, not is_own(address))

    def _listen(self, seconds, alive):
        """The lines on drivers, sensors and clock."""
        imu, odom, joints = (
            [Ear(self._namespace + name, node, alive[node].uri, read)
             for node in nodes if node in alive][:1]
            for name, nodes, read in (('imu', self._graph.imu, imu_of),
                                      ('odom', self._graph.odom, stamp_of),
                                      ('joint_states', self._graph.joints, wheels_of)))
        commands = [Ear(self._namespace + 'cmd_vel', node, peer.uri)
                    for node, peer in self._drivers.items() if not peer.answer.problem]
        pause = listen(commands + imu + odom + joints, seconds)
        yield judge_drivers(self._graph.drivers, {
            ear.node: len(ear.messages) for ear in commands}, seconds, [
                node for node, peer in self._drivers.items() if peer.answer.problem])
        for ear in imu + odom:
            yield judge_stream(ear.topic, len(ear.messages), ear.seconds, *ear.gap(), ear.problem,
                               pause, is_own(alive[ear.node].address))
        yield self._judge_clock(imu + odom, alive)
        watch = compare(imu, joints, self._namespace + 'reset')
        if watch:
            yield judge_gyro(watch.cause if watch.problem() else '', watch.remedy,
                             watch.has_compared)

    def _judge_clock(self, ears, alive):
        simulated = Peer(self._master.uri).ask('getParam', '/use_sim_time') is True
        heard = [(wall, fields[0]) for ear in ears for _, wall, fields in ear.messages]
        delays = [wall - stamp for wall, stamp in heard]
        zero = any(stamp == 0.0 for _, stamp in heard)
        answers = [peer.answer.round_trip for peer in alive.values()]
        dates = [peer.date_offset for peer in alive.values() if peer.date_offset is not None]
        return judge_clock(min(delays, default=None), min(answers, default=0.0),
                           dates[0] if dates else None, zero, simulated,
                           all(is_own(peer.address) for peer in alive.values()))
