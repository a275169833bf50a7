"""The messages of the robot's nodes: who drives, silent sensors, the clock, and the gyro.

Units: seconds, messages per second, degrees per minute, radians.
"""
import math
from statistics import mean
from typing import Mapping, Optional, Sequence, Tuple

from tb3_labs.doctor import Line, fault, ok, warning
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.supervision.timeouts import RESUME_TIME, SENSOR_TIMEOUT

#: The doctor listens for this long [s].
LISTENING_TIME = 5.0
#: A clock that is off by more than CLOCK_OFF disturbs tf [s]. If it is off by more than
#: CLOCK_WRONG, nothing that uses stamps works [s].
CLOCK_OFF = 0.1
CLOCK_WRONG = 1.0
#: If the robot's computer is busy, the clock of its board is ahead by up to this [s].
BOARD_AHEAD = 0.25
#: More drift than this disturbs a lab [deg/min].
MOST_DRIFT = 2.0
#: A node still works without this share of a sensor's messages.
FEW_REFUSED = 0.05
#: The wheels stand if they turn by less than this while the doctor listens [rad].
STANDING_TURN = 0.005


def judge_drivers(sent: Mapping[str, int]) -> Line:
    """Does at most one node drive? `sent`: {node: number of its commands} in LISTENING_TIME."""
    if len(sent) > 1:
        return fault('Drivers', '{} send commands at the same time: the robot obeys both in turn'
                     .format(' and '.join('{} ({:.0f}/s)'.format(node, count / LISTENING_TIME)
                                          for node, count in sorted(sent.items()))),
                     'stop all but one of them')
    # several nodes may publish cmd_vel: the labs' nodes give way to each other
    return ok('Drivers', '{} drives the robot'.format(*sent) if sent else
              'no node drives the robot now; if it jerks, call the doctor at that time')


def judge_stream(topic: str, arrivals: Sequence[float] = (), ended: float = 0.0,
                 publisher: str = '') -> Line:
    """Do the messages of a sensor arrive evenly enough to drive? `arrivals`: their times; `ended`:
    the time until which the doctor listened; `publisher`: a node that publishes them, or ''."""
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
        judge, effect = warning, 'the robot will pause'
        if gap > RESUME_TIME:
            judge, effect = fault, 'a drive is given up'
        return judge(name, f'{rate:.0f}/s, but silent for {gap:.1f} s: {effect}',
                     'rostopic delay {}: if its max is as long, the WLAN (go nearer, take 5 GHz or '
                     'a cable) or a busy computer holds messages; else the robot'.format(topic))
    return ok(name, f'{rate:.0f}/s, never silent for more than {gap:.2f} s')


def judge_refused(line: Line, reasons: Sequence[str], count: int) -> Line:
    """Returns a line that says that the labs' nodes refuse messages of a sensor, or `line` if there
    are no `reasons`, one for each refused message of all `count` messages."""
    if not reasons:
        return line
    judge = fault if len(reasons) > FEW_REFUSED * count else warning
    return judge(line.subject, 'every node refuses {} of {} messages: {}'.format(
        len(reasons), count, reasons[0]), "stand the robot on its wheels; switch its board off and "
                 'on; if it stays, the sensor is broken')


def judge_clock(least_delay: float, round_trip: float = 0.0) -> Line:
    """Does the robot's clock agree with this computer's? `least_delay`: the least difference of
    arrival (this computer's clock) and stamp (the robot's clock). `round_trip`: time of a question
    to the robot and its answer; the fastest message needed at most this time."""
    offset, exact = 0.5 * round_trip - least_delay, max(0.5 * round_trip, 0.001)
    if abs(offset) <= max(CLOCK_OFF, exact):
        return ok('Clock', f"the robot's clock is right within {max(abs(offset), exact):.3g} s")
    if 0.0 < offset <= BOARD_AHEAD:
        return warning('Clock', 'the stamps are {:.2f} s ahead, as a loaded computer of the robot '
                       'sets the clock of its board: tf may refuse its transforms'.format(offset),
                       'close other programs on the robot, wait 5 s, and call the doctor again')
    text = "the robot's clock is {:.1f} s {} (to {:.3g} s)".format(
        abs(offset), 'ahead' if offset > 0.0 else 'behind', exact)
    remedy = ('on the robot: sudo chronyc makestep; without internet: ssh pi@ROBOT sudo date -s '
              '@$(date +%s); then start its nodes again')
    if abs(offset) > CLOCK_WRONG:
        return fault('Clock', text + ': tf refuses its transforms', remedy)
    return warning('Clock', text + (': tf may refuse its transforms' if offset > 0.0 else
                                    ', or all its messages come so late'),
                   'close other programs here and on the robot, wait 5 s; if it stays: ' + remedy)


# Gyro and wheels --------------------------------------------------------------------------------

def judge_wheels(topic: str, sender: str) -> Line:
    """Returns the line on a `topic` of joint states that has no wheels."""
    return fault('Wheels', '{}, as {} publishes it, has no {} and {}: the gyro cannot be '
                 'checked'.format(topic, sender, *WHEEL_JOINTS),
                 "let the robot's bringup publish it, and no other node")


def judge_gyro(problem: str, remedy: str, is_compared: bool) -> Line:
    """Does the gyro agree with the wheels? `problem` and `remedy` come from a GyroWatch."""
    if problem:
        return fault('Gyro', problem, remedy)
    if not is_compared:
        return warning('Gyro', 'it cannot be compared with the wheels: joint_states, or stamps, '
                       'are missing', "restart the robot's bringup; turn with care, a wrong gyro "
                       'is not noticed')
    return ok('Gyro', 'it agrees with the wheels')


def judge_drift(drift: float, namespace: str = '/') -> Line:
    """Does the heading stand while the wheels stand? `drift`: see :func:`drift_of`."""
    text = f'{drift:+.1f} deg/min at rest'
    if abs(drift) > MOST_DRIFT:
        return warning('Drift', text + ': headings and goals will be off', 'calibrate the gyro of '
                       'the standing robot: rostopic pub -1 {}reset std_msgs/Empty'.format(
                           namespace))
    return ok('Drift', text)


def drift_of(imu: Sequence[Tuple[float, float]],
             wheels: Sequence[Tuple[float, float]]) -> Optional[float]:
    """Returns the slope of the yaw [deg/min]; None if the wheels turn, or if there are too few
    samples. `imu`: (stamp [s], yaw [rad]); `wheels`: (left, right) [rad]."""
    if len(imu) < 12 or len(wheels) < 2 or any(
            max(angles) - min(angles) > STANDING_TURN for angles in zip(*wheels)):
        return None
    middle = mean(stamp for stamp, _ in imu)
    turns = [(stamp - middle, math.remainder(yaw - imu[0][1], 2.0 * math.pi)) for stamp, yaw in imu]
    # samples of less than 2 s are treated as if they were of 2 s: noise is not drift
    spread = max(sum(time * time for time, _ in turns), len(turns) / 3.0)
    return 60.0 * math.degrees(sum(time * turn for time, turn in turns) / spread)
