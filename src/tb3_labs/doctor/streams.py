"""Judges drivers, silent sensors, the clock and the gyro by the messages of the robot's nodes.

Units: seconds, messages per second, degrees per minute, radians.
"""
import math
from statistics import mean
from typing import Mapping, Optional, Sequence, Tuple

from tb3_labs.doctor import Line, fault, ok, warning
from tb3_labs.supervision.timeouts import RESUME_TIME, SENSOR_TIMEOUT

#: Time for which the doctor listens [s].
LISTENING_TIME = 5.0
#: A larger offset of the robot's clock disturbs tf [s].
CLOCK_WARNING_OFFSET = 0.1
#: With a larger offset, nodes that use stamps do not work [s].
CLOCK_FAULT_OFFSET = 1.0
#: A larger drift disturbs a lab [deg/min].
MAX_DRIFT = 2.0
#: A node still works if it refuses at most this share of a sensor's messages.
TOLERATED_REFUSALS = 0.05
#: If a wheel turns by less than this while the doctor listens, the wheel stands still [rad].
STANDING_TURN = 0.005


def judge_drivers(sent: Mapping[str, int]) -> Line:
    """Does at most one node drive? `sent` is {node: number of its commands in LISTENING_TIME}."""
    if len(sent) > 1:
        drivers = ' and '.join(f'{node} ({count / LISTENING_TIME:.0f}/s)'
                               for node, count in sorted(sent.items()))
        return fault('Drivers', drivers + ' send commands at the same time: the robot obeys both '
                     'in turn', 'stop all but one of them')
    # several of the labs' nodes may publish cmd_vel, since only one of them drives at a time
    for node in sent:
        return ok('Drivers', f'{node} drives the robot')
    return ok('Drivers', 'no node drives the robot now; if it jerks, call the doctor at that time')


def judge_stream(topic: str, arrivals: Sequence[float] = (), ended: float = 0.0,
                 publisher: str = '') -> Line:
    """Do the messages of a sensor arrive evenly enough to drive? `arrivals` has the times of
    arrival [s]. `ended` is the time at which the doctor stopped listening [s]. `publisher` is a
    node that publishes `topic`, or ''."""
    name = topic.rpartition('/')[2]
    if not publisher:
        return fault(name, f'nobody publishes {topic}', "restart the robot's bringup, and "
                     'look at its first lines')
    if not arrivals:
        return fault(name, f'nothing came on {topic} for {LISTENING_TIME:.1f} s',
                     "restart the robot's bringup; switch the robot's board off and on")
    gap = max(later - earlier for earlier, later in zip(arrivals, [*arrivals[1:], ended]))
    rate = len(arrivals) / max(ended - arrivals[0], 0.1)
    if gap > SENSOR_TIMEOUT:
        make_line, effect = warning, 'the robot will pause'
        if gap > RESUME_TIME:
            make_line, effect = fault, 'a drive is given up'
        return make_line(name, f'{rate:.0f}/s, but silent for {gap:.1f} s: {effect}',
                         f'rostopic delay {topic}: if its max is as long, the WLAN (go nearer, '
                         'take 5 GHz or a cable) or a busy computer delays messages; otherwise the '
                         'robot is silent')
    return ok(name, f'{rate:.0f}/s, never silent for more than {gap:.2f} s')


def judge_refused(line: Line, reasons: Sequence[str], count: int) -> Line:
    """Returns the line on messages of a sensor that the labs' nodes refuse. `reasons` has a reason
    for each refused message, and `count` is the number of all messages. If no message was refused,
    returns `line`."""
    if not reasons:
        return line
    make_line = fault if len(reasons) > TOLERATED_REFUSALS * count else warning
    text = f'every node refuses {len(reasons)} of {count} messages: {reasons[0]}'
    return make_line(line.subject, text, 'stand the robot on its wheels; switch its board off and '
                     'on; if this line stays, the sensor is broken')


def judge_clock(least_delay: float) -> Line:
    """Does the robot's clock agree with this computer's clock? `least_delay` is the least time
    from a stamp (the robot's clock) to the arrival (this computer's clock) [s]."""
    if abs(least_delay) <= CLOCK_WARNING_OFFSET:
        return ok('Clock', f"the robot's clock is right within {CLOCK_WARNING_OFFSET} s")
    side, effect = 'behind', ', or all its messages come so late'
    if least_delay < 0.0:
        side, effect = 'ahead', ': tf may refuse its transforms'
    text = f"the robot's clock is {abs(least_delay):.1f} s {side}"
    remedy = ('on the robot: sudo chronyc makestep; without internet: ssh pi@ROBOT sudo date -s '
              '@$(date +%s); then start its nodes again')
    if abs(least_delay) > CLOCK_FAULT_OFFSET:
        return fault('Clock', text + ': tf refuses its transforms', remedy)
    return warning('Clock', text + effect, 'close other programs here and on the robot, wait 5 s; '
                   'if this line stays: ' + remedy)


# Gyro -------------------------------------------------------------------------------------------

def judge_gyro(problem: str, remedy: str, is_compared: bool) -> Line:
    """Does the gyro agree with the wheels? `problem` is the problem that a GyroMonitor found, or
    ''."""
    if problem:
        return fault('Gyro', problem, remedy)
    if not is_compared:
        return warning('Gyro', 'it cannot be compared with the wheels: joint_states, or stamps, '
                       'are missing', "restart the robot's bringup; turn with care, a wrong gyro "
                       'is not noticed')
    return ok('Gyro', 'it agrees with the wheels')


def judge_drift(drift: float, namespace: str = '/') -> Line:
    """Does the heading stay constant while the wheels stand still? `drift` is in [deg/min]."""
    text = f'{drift:+.1f} deg/min at rest'
    if abs(drift) > MAX_DRIFT:
        return warning('Drift', text + ': headings and goals will be off', 'calibrate the gyro of '
                       'the standing robot: rostopic pub -1 {}reset std_msgs/Empty'.format(
                           namespace))
    return ok('Drift', text)


def drift_of(imu: Sequence[Tuple[float, float]],
             wheels: Sequence[Tuple[float, float]]) -> Optional[float]:
    """Returns the slope of the yaw [deg/min]; None if the wheels turn, or if there are too few
    samples. `imu` has (stamp [s], yaw [rad]), and `wheels` has (left [rad], right [rad])."""
    if len(imu) < 12 or len(wheels) < 2:
        return None
    if any(max(angles) - min(angles) > STANDING_TURN for angles in zip(*wheels)):
        return None
    middle = mean(stamp for stamp, _ in imu)
    turns = [(stamp - middle, math.remainder(yaw - imu[0][1], 2.0 * math.pi)) for stamp, yaw in imu]
    # a short recording is divided by the spread of 2 s, so that its noise does not look like drift
    spread = max(sum(time * time for time, _ in turns), len(turns) / 3.0)
    return 60.0 * math.degrees(sum(time * turn for time, turn in turns) / spread)
