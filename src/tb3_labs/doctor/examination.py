"""The doctor's examinations, in order; each yields its lines as soon as it knows them.

This file also has the judgements of this computer: its Python, gamepad, mouse and disk.
"""
import glob
import importlib
import importlib.util
import math
import os
import shutil
import socket
import sys
import time
from dataclasses import replace
from typing import Iterator, Mapping, Sequence, Tuple

from tb3_labs.doctor.body import (
    BODY_TOPICS, drift_of, judge_battery, judge_board, judge_drift, judge_firmware, judge_motors)
from tb3_labs.doctor.line import Line, fault, ok, warning
from tb3_labs.doctor.listening import (
    Ear, compare, imu_of, line_of, listen, stamp_of, torque_of, version_of, voltage_of, wheels_of)
from tb3_labs.doctor.network import (
    Address, is_own, judge_address, judge_master, judge_nat, judge_second_master, nat_kind,
    own_addresses, resolved, way_out)
from tb3_labs.doctor.questions import (
    RESOLVING, Graph, Peer, ask_all, local_drivers, master_names, peers_of, second_masters,
    together, within)
from tb3_labs.doctor.robot import (
    judge_clock, judge_drivers, judge_gyro, judge_names, judge_nodes, judge_presence, judge_stream,
    judge_way_back)

#: The packages that the labs' nodes import.
PACKAGES = ('rospy', 'numpy', 'squaternion', 'geometry_msgs.msg', 'nav_msgs.msg',
            'sensor_msgs.msg', 'tf2_ros', 'tb3_labs.srv')
#: Free space below which rosbag record stops, and below which it warns [bytes].
RECORDS_NO_MORE = 1e9
RECORDS_NOT_LONG = 5e9

SOURCE = 'source scripts/setup.sh in this terminal, then rosrun tb3_labs doctor.py'
AFTER_BOARD = 'what the line on the board says, then call the doctor again'
#: A topic that was heard for less than this does not count as silent [s].
HEARD = 0.3
#: The last line of a node comes within this time [s].
LAST_LINE = 0.5
#: A robot needs at most this long to connect to a driver that has just been started [s].
CONNECTING = 1.0


def examine(namespace, seconds):
    """Yields the lines on this computer and on the robot in `namespace`; listens for `seconds`."""
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
    """Returns the Address of this computer, with the way to the master if its address is known."""
    return Address(
        os.environ.get('ROS_IP', ''), os.environ.get('ROS_HOSTNAME', ''), socket.gethostname(),
        of_told, own_addresses(), way_out(master_address) if master_address else '',
        is_own(master_address) if master_address else not os.environ.get('ROS_MASTER_URI'))


def _way_or_first(here):
    return here.way_out or (here.own[0] if here.own else '')


class _Robot:
    """All examinations that need a master."""

    def __init__(self, namespace, master, here, state):
        self._master, self._here = master, here
        self._graph = Graph(namespace, state)
        self._namespace = namespace
        #: {node: Peer} of the robot's nodes, and of those that publish cmd_vel.
        self._peers = peers_of(master, self._graph.robot_nodes)
        self._drivers = peers_of(master, self._graph.drivers)

    def examine(self, seconds):
        """Yields the lines on the master, the robot, the robot's nodes, and their messages."""
        pids = ask_all(dict(self._drivers, **self._peers), 'getPid')
        hosts = {peer.address for peer in self._peers.values() if peer.address}
        yield judge_nat(nat_kind(), _way_or_first(self._here), not self._here.master_here or any(
            not is_own(host) for host in hosts))
        yield judge_master(self._master.answer)
        # if a computer does not answer at all, a master on it would not answer either
        reached = {peer.address for peer in self._peers.values()
                   if peer.answer.problem in ('', 'refused')}
        yield judge_second_master(self._master.uri, second_masters(self._master, reached))
        yield judge_presence(self._graph.imu, self._graph.odom, self._graph.hearers,
                             self._namespace, self._graph.others)
        if not self._graph.imu and not self._graph.odom:
            yield from self._look_at_serial_node()
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
        """Yields the lines on names, and on the way from the robot to this computer."""
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
        """Yields the lines on drivers, sensors and clock."""
        graph = self._graph
        imu, odom, joints, battery, state, version = (
            [Ear(self._namespace + name, node, alive[node].uri, read)
             for node in nodes if node in alive][:1]
            for name, nodes, read in (
                ('imu', graph.imu, imu_of), ('odom', graph.odom, stamp_of),
                ('joint_states', graph.joints, wheels_of),
                *((name, graph.body[name], read)
                  for name, read in zip(BODY_TOPICS, (voltage_of, torque_of, version_of)))))
        printed = [Ear('/rosout', node, alive[node].uri, line_of)
                   for node in graph.serial_nodes if node in alive]
        commands = [Ear(self._namespace + 'cmd_vel', node, peer.uri)
                    for node, peer in self._drivers.items() if not peer.answer.problem]
        pause = listen(commands + imu + odom + joints + battery + state + version + printed,
                       seconds)
        yield judge_drivers(self._graph.drivers, {
            ear.node: len(ear.messages) for ear in commands}, seconds, [
                node for node, peer in self._drivers.items() if peer.answer.problem])
        lines = self._lines(printed)
        versions = [fields[0] for ear in version for _, _, fields in ear.messages]
        firmware = judge_firmware(
            lines, versions[-1] if versions else '',
            {ear.topic.rpartition('/')[2]: ear.checksum for ear in imu + odom + joints + battery},
            graph.missing)
        board = judge_board(lines)
        disturbed = bool(board and board.remedy)
        yield from filter(None, (firmware, board))
        for ear in imu + odom:
            line = judge_stream(ear.topic, len(ear.messages), ear.seconds, *ear.gap(), ear.problem,
                                pause, is_own(alive[ear.node].address))
            # a board that calibrates is silent
            yield replace(line, remedy=AFTER_BOARD) if disturbed and line.remedy else line
        yield self._judge_clock(imu + odom, alive)
        watch = compare(imu, joints, self._namespace + 'reset')
        if watch:
            yield judge_gyro(watch.cause if watch.problem() else '', watch.remedy,
                             watch.has_compared)
        if not (disturbed or watch and watch.problem()):
            yield judge_drift(*drift_of(
                [fields[:2] for ear in imu for _, _, fields in ear.messages],
                [fields[1:] for ear in joints for _, _, fields in ear.messages if fields]),
                self._namespace)
        volts, torques = ([fields[1] for ear in ears for _, _, fields in ear.messages]
                          for ears in (battery, state))
        board_speaks = any(ear.messages for ear in odom)
        if board_speaks and any(ear.seconds > HEARD and not ear.problem for ear in battery):
            yield judge_battery(min(volts, default=math.nan))
        if board_speaks and any(ear.seconds > HEARD and not ear.problem for ear in state):
            yield judge_motors(torques[-1] if torques else None, self._namespace)

    def _look_at_serial_node(self):
        """Yields the line on a board that does not publish anything: why?"""
        peers = peers_of(self._master, self._graph.serial_nodes)
        ears = [Ear('/rosout', node, peer.uri, line_of) for node, peer in peers.items()]
        listen(ears, LAST_LINE if ears else 0.0)
        yield from filter(None, [judge_firmware(self._lines(ears), '', {}, is_there=False)])

    def _lines(self, ears):
        """Returns the lines that the ears heard, without those of other robots of one process."""
        others = tuple(name.strip('/') + ': ' for name in self._graph.others if name != '/')
        return [fields[1] for ear in ears for _, _, fields in ear.messages
                if not fields[1].startswith(others)]

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


# This computer ----------------------------------------------------------------------------------

def look_at_python() -> Line:
    """Returns the line on the interpreter and its packages. Each package is imported, because it
    may be installed but lack a package that it needs."""
    missing = {}
    for name in PACKAGES:
        try:
            importlib.import_module(name)
        except Exception as trouble:    # a broken package may raise anything
            missing[name.partition('.')[0] if name != 'tb3_labs.srv' else 'tb3_labs'] = (
                ' '.join(str(trouble).split()) or type(trouble).__name__)
    return judge_python('.'.join(map(str, sys.version_info[:3])), sys.executable, missing,
                        os.environ.get('ROS_VERSION', '1'))


def judge_python(version: str, executable: str, missing: Mapping[str, str],
                 ros_version: str = '1') -> Line:
    """Can the labs' nodes run? `missing`: {package: why it cannot be imported}; `ros_version`: the
    variable ROS_VERSION."""
    here = 'Python {} ({})'.format(version, executable)
    if ros_version == '2':
        return fault('Python', 'a ROS 2 was sourced in this terminal, and it breaks the Python of '
                     'ROS 1', 'open a new terminal; ' + SOURCE)
    if missing:
        first, *others = missing
        return fault('Python', '{} cannot import {} ({}){}'.format(
            here, first, missing[first], ', nor ' + ', '.join(others) if others else ''), SOURCE)
    return ok('Python', here + ' has all packages')


def look_at_devices() -> Iterator[Line]:
    """The lines on gamepad and mouse."""
    yield judge_pad([(path, os.access(path, os.R_OK))
                     for path in sorted(glob.glob('/dev/input/js*'))])
    yield judge_mouse(bool(os.environ.get('DISPLAY')), bool(os.environ.get('WAYLAND_DISPLAY')),
                      importlib.util.find_spec('pynput') is not None)


def judge_pad(pads: Sequence[Tuple[str, bool]]) -> Line:
    """Can a gamepad be read? `pads`: (device, may this user read it?)."""
    closed = [device for device, readable in pads if not readable]
    if closed:
        return warning('Gamepad', '{} is plugged in, but cannot be read'.format(closed[0]),
                       'sudo usermod -aG input $USER, then log in again')
    if pads:
        return ok('Gamepad', '{} is plugged in'.format(pads[0][0]))
    return ok('Gamepad', 'none is plugged in (only the gamepad lab needs one; the panel has one)')


def judge_mouse(has_display: bool, is_wayland: bool, has_pynput: bool) -> Line:
    """Can mouse_client.py read the mouse of this session?"""
    if is_wayland:
        return warning('Mouse', 'the mouse cannot be read in a Wayland session',
                       'log in again with an "Xorg" (X11) session')
    if not has_display:
        return ok('Mouse', 'no screen here, so no mouse to drive by (the panel has a mouse pad)')
    if not has_pynput:
        return warning('Mouse', 'the mouse needs the Python package pynput',
                       'sudo apt install python3-pynput')
    return ok('Mouse', 'it can be read')


def look_at_disk() -> Line:
    """The line on the space for bags in the current folder."""
    try:
        folder = os.getcwd()
        return judge_disk(folder, shutil.disk_usage(folder).free, os.access(folder, os.W_OK))
    except OSError:
        return judge_disk('this folder, which is gone', 0.0, False)


def judge_disk(folder: str, free: float, writable: bool = True) -> Line:
    """Is there space for bags? `free`: free space in `folder` [bytes]."""
    gigabytes = '{:.1f} GB free in {}'.format(free / 1e9, folder)
    if not writable:
        return warning('Disk', '{} cannot be written: no bag can be recorded here'.format(folder),
                       'cd ~')
    if free < RECORDS_NO_MORE:
        return fault('Disk', gigabytes + ': rosbag records nothing below 1 GB',
                     'delete old bags, or record in another folder')
    if free < RECORDS_NOT_LONG:
        return warning('Disk', gigabytes + ': rosbag warns below 5 GB', 'delete old bags')
    return ok('Disk', gigabytes)
