"""Judges drivers, silent sensors, the clock and the gyro by the messages of the robot's nodes.

Units: seconds, messages per second, degrees per minute, radians.
"""
import math
from statistics import mean
from typing import Mapping, Optional, Sequence, Tuple

from tb3_labs.doctor import BRINGUP_REMEDY, Finding, fault, ok, warning
from tb3_labs.supervision.timeouts import RESUME_TIME, SENSOR_TIMEOUT

LISTENING_TIME = 5.0                # [s]
CLOCK_WARNING_OFFSET = 0.1          # [s] tf may refuse transforms if the offset is larger
CLOCK_FAULT_OFFSET = 1.0            # [s] nodes that use stamps fail if the offset is larger
MAX_DRIFT = 2.0                     # [deg/min] a faster drift disturbs a lab
MIN_RATE_TIME = 0.1                 # [s] a rate is measured over at least this time
MIN_IMU_SAMPLES = 12                # a drift is not measured with fewer samples
MIN_WHEEL_SAMPLES = 2               # a drift is not measured with fewer samples
#: The variance [s^2] of times that are spread evenly over 2 s.
MIN_TIME_VARIANCE = 2.0 ** 2 / 12.0
MAX_STANDING_ANGLE = 0.005          # [rad] a wheel that turns more does not stand still


def judge_drivers(command_counts: Mapping[str, int]) -> Finding:
    """Judges how many nodes drive. `command_counts` is {node: commands in LISTENING_TIME}."""
    drivers = ' and '.join(f'{node} ({count / LISTENING_TIME:.0f}/s)'
                           for node, count in sorted(command_counts.items()))
    if len(command_counts) > 1:
        return fault('Drivers', drivers + ' send commands at the same time: the robot obeys both '
                     'in turn', 'stop all but one of them')
    if drivers:
        return ok('Drivers', drivers + ' drives the robot')
    return ok('Drivers', 'no node drives the robot now; if it jerks, call the doctor at that time')


def judge_stream(topic: str, arrivals: Sequence[float] = (), listening_end: float = 0.0,
                 publisher: str = '') -> Finding:
    """Judges whether a sensor's messages come without long gaps. `arrivals` are the times [s] at
    which messages came before `listening_end` [s]. `publisher` publishes `topic`, or is ''."""
    _, _, name = topic.rpartition('/')
    if not publisher:
        return fault(name, f'nobody publishes {topic}', BRINGUP_REMEDY)
    if not arrivals:
        return fault(name, f'nothing came on {topic} for {LISTENING_TIME:.1f} s',
                     "restart the robot's bringup; switch the robot's board off and on")
    ends = [*arrivals[1:], listening_end]
    longest_gap = max(end - begin for begin, end in zip(arrivals, ends))
    rate = len(arrivals) / max(listening_end - arrivals[0], MIN_RATE_TIME)
    if longest_gap > SENSOR_TIMEOUT:
        text = f'{rate:.0f}/s, but silent for {longest_gap:.1f} s'
        remedy = (f'rostopic delay {topic}: if its max is as long, the WLAN (go nearer, take 5 GHz '
                  'or a cable) or a busy computer delays messages; otherwise the robot is silent')
        if longest_gap > RESUME_TIME:
            return fault(name, text + ': a drive is given up', remedy)
        return warning(name, text + ': the robot will pause', remedy)
    return ok(name, f'{rate:.0f}/s, never silent for more than {longest_gap:.2f} s')


def judge_clock(least_delay: float) -> Finding:
    """Judges whether the robot's clock agrees with this computer's clock. `least_delay` [s] is the
    least time from a message's stamp (robot's clock) to its arrival (this computer's clock)."""
    if abs(least_delay) <= CLOCK_WARNING_OFFSET:
        return ok('Clock', f"the robot's clock is right within {CLOCK_WARNING_OFFSET} s")
    if least_delay < 0.0:
        text = f"the robot's clock is {-least_delay:.1f} s ahead"
    else:
        text = f"the robot's clock is {least_delay:.1f} s behind, or all its messages come so late"
    remedy = ('on the robot: sudo chronyc makestep; without internet: ssh pi@ROBOT sudo date -s '
              '@$(date +%s); then start its nodes again')
    if abs(least_delay) > CLOCK_FAULT_OFFSET:
        return fault('Clock', text + ': tf refuses its transforms', remedy)
    return warning('Clock', text + ': tf may refuse its transforms', 'close other programs here '
                   'and on the robot, wait 5 s; if this line stays: ' + remedy)


def judge_gyro(problem: str, remedy: str, is_compared: bool) -> Finding:
    """Judges whether gyro and wheels agree. `problem` is what a GyroMonitor found, or ''."""
    if problem:
        return fault('Gyro', problem, remedy)
    if not is_compared:
        return warning('Gyro', 'it cannot be compared with the wheels: joint_states, or stamps, '
                       'are missing', "restart the robot's bringup; turn with care, a wrong gyro "
                       'is not noticed')
    return ok('Gyro', 'it agrees with the wheels')


def judge_drift(drift: float, namespace: str) -> Finding:
    """Judges whether the heading stays constant while the wheels stand. `drift` is in [deg/min]."""
    text = f'{drift:+.1f} deg/min at rest'
    if abs(drift) > MAX_DRIFT:
        return warning('Drift', text + ': headings and goals will be off', 'calibrate the gyro of '
                       f'the standing robot: rostopic pub -1 {namespace}reset std_msgs/Empty')
    return ok('Drift', text)


def drift_of(imu: Sequence[Tuple[float, float]],
             wheels: Sequence[Tuple[float, float]]) -> Optional[float]:
    """Returns the slope of the yaw [deg/min], or None if the wheels turn or samples are too few.
    `imu` is [(stamp [s], yaw [rad])]. `wheels` is [(left angle [rad], right angle [rad])]."""
    if len(imu) < MIN_IMU_SAMPLES or len(wheels) < MIN_WHEEL_SAMPLES:
        return None
    for angles in zip(*wheels):    # first of the left wheel, then of the right wheel
        if max(angles) - min(angles) > MAX_STANDING_ANGLE:
            return None
    mean_stamp = mean(stamp for stamp, _ in imu)
    _, first_yaw = imu[0]
    turns = [(stamp - mean_stamp, math.remainder(yaw - first_yaw, 2.0 * math.pi))
             for stamp, yaw in imu]
    # The slope of the least-squares line is sum(time * turn) / sum(time * time). In a recording
    # that is shorter than 2 s the divisor is increased, so that noise does not look like drift.
    divisor = max(sum(time * time for time, _ in turns), MIN_TIME_VARIANCE * len(turns))
    return 60.0 * math.degrees(sum(time * turn for time, turn in turns) / divisor)
