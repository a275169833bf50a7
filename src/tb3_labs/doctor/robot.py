"""Judgements of a robot: its nodes, its drivers, the way back to this computer, its messages, its
clock, and its gyro.

Units: seconds, messages per second. `gap` is the longest time between two arrivals.
"""
import math
from typing import Mapping, NamedTuple, Optional, Sequence

from tb3_labs.doctor.line import Line, fault, ok, warning
from tb3_labs.doctor.network import PROBLEMS, Address, Answer, is_loopback

#: The labs' nodes stop the robot if a sensor is silent for this long [s].
PAUSES = 0.22
#: The labs' nodes give up the drive if a sensor is silent for this long [s]. Both values are copies
#: from supervision.freshness: the students' edition has the doctor, but not that module.
GIVES_UP = 2.0
#: Fewer samples than this are too few to steer by [1/s].
FEW = 10.0
#: A clock that is off by more than CLOCK_OFF disturbs tf [s]. If it is off by more than
#: CLOCK_WRONG, nothing that uses stamps works [s].
CLOCK_OFF = 0.1
CLOCK_WRONG = 1.0


def judge_presence(imu: Sequence[str], odom: Sequence[str], hearers: Sequence[str],
                   namespace: str, others: Sequence[str] = ()) -> Line:
    """Is there one robot? `imu`, `odom`: the nodes that publish this topic; `hearers`: the nodes
    that hear cmd_vel; `others`: other namespaces that have a robot."""
    at = namespace.rstrip('/')
    if not imu and not odom:
        there = ' (there is one in {})'.format(', '.join(others)) if others else ''
        return fault('Robot', 'nobody publishes {0}/imu or {0}/odom{1}'.format(at, there),
                     'rosrun tb3_labs doctor.py ' + others[0].strip('/') if others and (
                         others[0].strip('/')) else "start the robot's bringup, or "
                     'roslaunch tb3_labs fake_robot.launch')
    for topic, nodes in (('imu', imu), ('odom', odom)):
        if len(nodes) > 1:
            return fault('Robot', '{} robots answer: {} all publish {}/{}'.format(
                len(nodes), ', '.join(sorted(nodes)), at, topic),
                'switch all but one off, or give each robot a namespace, or a master, of its own')
        if not nodes:
            return fault('Robot', 'nobody publishes {}/{}'.format(at, topic),
                         "restart the robot's bringup, and look at its first lines")
    if not hearers:
        return fault('Robot', 'nobody hears {}/cmd_vel: the robot cannot be driven'.format(at),
                     "restart the robot's bringup, and look at its first lines")
    return ok('Robot', '{} publishes {}/imu and odom, {} hears cmd_vel'.format(
        imu[0], at, ', '.join(sorted(hearers))))


def judge_nodes(answers: Mapping[str, Answer], master_here: bool) -> Line:
    """Do the robot's nodes answer at the addresses that they told the master? {node: Answer}"""
    for node, answer in sorted(answers.items()):
        if not answer.problem:
            continue
        host = answer.uri.partition('//')[2].rpartition(':')[0]
        text = '{} says it is at {}, which {}'.format(
            node, answer.uri.rstrip('/') or '(nothing)', PROBLEMS[answer.problem])
        if is_loopback(answer.address) and not master_here:
            return fault('Nodes', '{} says it is at {}: others cannot reach that'.format(
                node, host), "on the robot: export ROS_IP=ITS_ADDRESS, then start it again")
        if is_loopback(answer.address):
            return fault('Nodes', text, 'if it has ended: rosnode cleanup; if it runs on the '
                         'robot: export ROS_IP=ITS_ADDRESS there, then start it again')
        if answer.problem == 'unresolved':
            return fault('Nodes', text, 'on the robot: export ROS_IP=ITS_ADDRESS, then start it '
                         'again; or here: add "ITS_ADDRESS {}" to /etc/hosts'.format(host))
        if answer.problem == 'refused':
            return fault('Nodes', text, 'rosnode cleanup, then start {} again{}'.format(
                node, '' if host == answer.address else '; is {} really {}?'.format(
                    host, answer.address)))
        return fault('Nodes', text, 'is the robot on, and in this network? ping {}; on the robot: '
                     'export ROS_IP=ITS_ADDRESS'.format(answer.address or host))
    return ok('Nodes', ', '.join('{} answers in {:.0f} ms'.format(
        node, 1e3 * answer.round_trip) for node, answer in sorted(answers.items())))


class MasterName(NamedTuple):
    """The master of a node of the robot: the `uri` that the node tells, and its `address`, resolved
    here. `is_ours`: is this, with its port, the master that this terminal uses?"""

    node: str
    uri: str
    address: str
    is_ours: bool


def judge_names(names: Sequence[MasterName], master: str) -> Line:
    """Do the robot and this computer mean the same master? `master`: address of the one here."""
    for name in names:
        if not name.address:
            return warning('Names', '{} calls the master {}, a name that this computer cannot '
                           'resolve'.format(name.node, name.uri),
                           'use addresses, not names, in ROS_MASTER_URI on both sides')
        if not name.is_ours:
            return fault('Names', '{} calls the master {}, which is {} here, but the master is at '
                         '{}'.format(name.node, name.uri, name.address, master),
                         'compare /etc/hosts on both sides, or use addresses in place of names')
    if not names:
        return warning('Names', 'no node of the robot tells its master', 'call the doctor again')
    return ok('Names', 'both sides mean the same master')


class Driver(NamedTuple):
    """A node of this computer that publishes cmd_vel. Is the robot's node connected to it?"""

    node: str
    uri: str
    is_connected: bool


def judge_way_back(drivers: Optional[Sequence[Driver]], robot: str, here: Address,
                   robot_elsewhere: bool) -> Line:
    """Do commands of this computer reach the robot? `drivers` is None if the robot's node did not
    answer; `robot`: the node that hears cmd_vel; `here.way_out`: this computer's address on the way
    to the robot."""
    if drivers is None:
        return warning('Way back', '{} does not tell to whom it is connected'.format(robot),
                       'call the doctor again')
    lost = [driver for driver in drivers if not driver.is_connected]
    if lost:
        return fault('Way back', '{} cannot reach {} at {}: commands do not arrive'.format(
            robot, lost[0].node, lost[0].uri.rstrip('/')),
            'if sudo ufw status says active: sudo ufw allow from ROBOTS_ADDRESS; else '
            + here.advice)
    if drivers:
        return ok('Way back', '{} is connected to {}'.format(
            robot, ', '.join(driver.node for driver in drivers)))
    if not robot_elsewhere:
        return ok('Way back', 'the robot is on this computer')
    if here.resolved == here.way_out:
        if here.told == here.way_out:
            return ok('Way back', '{} is the address towards the robot; start a lab, then a '
                      'firewall would show'.format(here.told))
        return warning('Way back', 'the robot must resolve the name {}; that shows when a lab '
                       'runs here'.format(here.told), here.advice)
    return fault('Way back', 'the robot cannot reach {}: this computer is {} to it'.format(
        here.told, here.way_out or 'nowhere'), here.advice)


def judge_drivers(registered: Sequence[str], sent: Mapping[str, int], seconds: float,
                  gone: Sequence[str] = ()) -> Line:
    """Does at most one node drive? `registered`: nodes that publish cmd_vel; `gone`: registered
    nodes that do not answer; `sent`: {node: number of messages} in `seconds`."""
    driving = sorted(node for node, count in sent.items() if count)
    if len(driving) > 1:
        return fault('Drivers', '{} send commands at the same time: the robot obeys both in turn'
                     .format(' and '.join('{} ({:.0f}/s)'.format(node, sent[node] / seconds)
                                          for node in driving)), 'stop all but one of them')
    if gone:
        return warning('Drivers', '{} is registered to drive, but does not answer'.format(
            ' and '.join(sorted(gone))), 'if it has ended: rosnode cleanup')
    if driving:
        return ok('Drivers', '{} drives the robot'.format(driving[0]))
    if len(registered) > 1:    # the labs' own nodes give way to each other
        return ok('Drivers', '{} could drive the robot; none does now (if it jerks, call the '
                  'doctor at that time)'.format(', '.join(sorted(registered))))
    return ok('Drivers', (registered[0] + ' could drive the robot; it does not now') if registered
              else 'no node drives the robot')


def judge_stream(topic: str, count: int = 0, seconds: float = 0.0, gap: float = 0.0,
                 late: float = math.nan, problem: str = '', own_pause: float = 0.0,
                 robot_here: bool = False) -> Line:
    """Do the messages of a sensor come often and evenly enough to drive?

    `count` messages came in `seconds`; `late`: delay of the message after the `gap`, beyond that of
    the fastest message (nan if unknown); `problem`: '' or why the topic cannot be heard;
    `own_pause`: how long this computer did not let the doctor run; `robot_here`: does the robot run
    on this computer?
    """
    name = topic.rpartition('/')[2]
    if problem:
        return fault(name, '{} cannot be heard: {}'.format(topic, problem),
                     "a firewall, or the robot's ROS_IP? on the robot: export ROS_IP=ITS_ADDRESS")
    if not count:
        return fault(name, 'nothing came on {} for {:.1f} s'.format(topic, seconds),
                     "restart the robot's bringup; switch the robot's board off and on")
    rate = '{:.0f}/s'.format(count / seconds)
    if gap <= PAUSES:
        if count / seconds < FEW:
            return warning(name, 'only {} on {}: the robot will drive badly'.format(rate, topic),
                           'a bad WLAN? go nearer to its access point')
        return ok(name, '{}, never silent for more than {:.2f} s'.format(rate, gap))
    judge = fault if gap > GIVES_UP else warning
    effect = 'a drive is given up' if gap > GIVES_UP else 'the robot will pause'
    held = late > 0.5 * gap
    if held and robot_here or gap - own_pause <= PAUSES:
        return judge(name, '{}, but this computer held messages for {:.1f} s: {}'.format(
            rate, gap, effect), 'close other programs: it is too busy')
    if held:
        return judge(name, '{}, but your WLAN holds messages for {:.1f} s: {}'.format(
            rate, gap, effect), 'go nearer to the access point, use 5 GHz or a cable, '
            'switch off power saving (sudo iw dev wlan0 set power_save off)')
    whose = 'nothing came' if math.isnan(late) else 'the robot itself was silent'
    return judge(name, '{}, but {} for {:.1f} s: {}'.format(rate, whose, gap, effect),
                 "is the robot's computer busy, its battery low, its cable loose?")


def judge_gyro(problem: str, remedy: str, is_compared: bool) -> Line:
    """Does the gyro agree with the wheels? `problem` and `remedy` are those of a GyroWatch."""
    if problem:
        return fault('Gyro', problem, remedy)
    return ok('Gyro', 'it agrees with the wheels' if is_compared else
              'it cannot be compared with the wheels, whose joint_states do not come')


def judge_clock(least_delay: Optional[float] = None, round_trip: float = 0.0,
                date_offset: Optional[float] = None, stamps_are_zero: bool = False,
                simulated: bool = False, robot_here: bool = False) -> Line:
    """Is the robot's clock the same as this computer's?

    `least_delay`: least arrival (on our clock) minus stamp (on the robot's); None without stamps.
    `round_trip`: time for one question to the robot; the fastest message took at most this long.
    `date_offset`: the robot's clock minus ours, by the date of its answer, exact to a second; None
    without a date. `simulated`: does /use_sim_time hold? `robot_here`: is it this computer's clock?
    """
    if simulated:
        return ok('Clock', 'time is simulated (/use_sim_time): clocks do not matter')
    if stamps_are_zero:
        return warning('Clock', 'the stamps of the robot are zero: tf and recordings need them',
                       "restart the robot's bringup")
    offset, exact = date_offset, 1.0 + round_trip
    if least_delay is not None:
        offset, exact = 0.5 * round_trip - least_delay, max(0.5 * round_trip, 0.001)
    if offset is None:
        return warning('Clock', "the robot's clock cannot be seen: no stamp came, and no date",
                       'mend the lines above first')
    how = '(to {:.3g} s)'.format(exact)
    if abs(offset) <= max(CLOCK_OFF, exact):
        return ok('Clock', "the robot's clock is right within {:.3g} s".format(
            max(abs(offset), exact)))
    if robot_here and -CLOCK_WRONG <= offset < 0.0:
        return warning('Clock', 'messages of this computer are {:.1f} s old when they come'.format(
            -offset), 'close other programs: it is too busy')
    text = "the robot's clock is {:.1f} s {} {}".format(
        abs(offset), 'ahead' if offset > 0.0 else 'behind', how)
    remedy = ('on the robot: sudo chronyc makestep; without internet: ssh pi@ROBOT sudo date -s '
              '@$(date +%s); then start its nodes again')
    if abs(offset) <= CLOCK_WRONG:
        return warning('Clock', text + (': tf may refuse its transforms' if offset > 0.0 else
                                        ', or all its messages come so late'), remedy)
    return fault('Clock', text + ': tf refuses its transforms', remedy)
