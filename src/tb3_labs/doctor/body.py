"""Judgements of the robot's body, by what its board publishes and prints: battery, motors,
firmware, calibration and restarts of the board, drift of the IMU.

The board's lines are those of serial_node on /rosout. A subscriber gets the last line at once, even
if it is old, and then the new ones. Units: volts, degrees, seconds.
Source: ROBOTIS OpenCR firmware 1.2.6 (turtlebot3_core.ino, turtlebot3_diagnosis.cpp).
"""
import math
from typing import Mapping, Optional, Sequence, Tuple

from tb3_labs.doctor.line import Line, fault, ok, warning
from tb3_labs.robot.turtlebot3 import CUT_OFF

#: A node with one of these in its name may be serial_node, which prints the board's lines.
SERIAL_NODES = 'core', 'serial', 'turtlebot3'
#: The topics of the board that tell of its body.
BODY_TOPICS = 'battery_state', 'sensor_state', 'firmware_version'
#: The firmware that the labs know.
FIRMWARE = '1.2.6'
#: {topic: the checksum of its message in ROS Noetic}.
CHECKSUMS = {'imu': '6a62c6daae103f4ff57a132d6f95cec2', 'odom': 'cd5e73d190d741a2f92e81eda573aca7',
             'joint_states': '3066dcd76a6cfaef579bd0f34173e9fd',
             'battery_state': '4ddae7f048e32fda22cac764685e3974'}
#: Below this the battery is nearly empty; below NO_BATTERY the board lives on USB alone [V].
NEARLY_EMPTY = 11.2
NO_BATTERY = 6.0
#: More drift than this disturbs a lab [deg/min].
DRIFTS = 2.0
#: The wheels stand if they turn by less than this while the doctor listens [rad].
STANDS = 0.005
START, END, RESET, CONNECTED = (
    'Start Calibration of Gyro', 'Calibration End', 'Reset Odometry', 'Connected to OpenCR')
FLASH = ('flash the board with the firmware of ROS Noetic (OPENCR_MODEL=burger_noetic, or '
         'waffle_noetic), then start the bringup again')


def judge_firmware(lines: Sequence[str], version: str, checksums: Optional[Mapping[str, str]] = None,
                   missing: Sequence[str] = (), is_there: bool = True) -> Optional[Line]:
    """Does the board have the firmware that the labs know? None if nothing is known of it.

    `lines`: printed by serial_node; `version`: '' if it was not heard; `checksums`: {topic: that of
    the publisher}; `missing`: topics that this firmware lacks; `is_there`: does the robot publish
    imu and odom?
    """
    text = '\n'.join(lines).lower()
    if 'checksum does not match' in text or missing:
        judge = warning if is_there else fault
        return judge('Firmware', "the board's messages have another definition than those of its "
                     'computer (checksum does not match){}'.format(
                         ': there is no ' + ', '.join(missing) if missing else ''), FLASH)
    if 'unable to sync with device' in text or not is_there and 'requesting topics' in text:
        return fault('Firmware', 'serial_node gets no answer from the board (unable to sync with '
                     'device): the firmware of ROS 2, or none', FLASH)
    if 'lost sync with device' in text:
        return fault('Firmware', 'serial_node has lost the board (lost sync with device)',
                     'is the board on, its USB cable firm? Then start the bringup again')
    for topic, checksum in sorted((checksums or {}).items()):
        if checksum not in ('', '*', CHECKSUMS.get(topic, checksum)):
            return fault('Firmware', '{} has another definition (md5 {}) than in ROS Noetic'.format(
                topic, checksum), "use ROS Noetic on the robot's computer; " + FLASH)
    if version and version != FIRMWARE:
        return warning('Firmware', 'version {}, but the labs know {}: limits and pauses may differ'
                       .format(version, FIRMWARE), FLASH)
    return ok('Firmware', 'version ' + version) if version else None


def judge_board(lines: Sequence[str]) -> Optional[Line]:
    """Did the board start, or calibrate its gyro, meanwhile? `lines`: the last one of before, and
    those since. None if they tell nothing of it."""
    marks = [mark for line in lines for mark in (START, END, RESET, CONNECTED) if mark in line]
    if not marks:
        return None
    if marks[-1] in (START, CONNECTED):
        return warning('Board', 'it calibrates its gyro now',
                       'let the robot stand still for 10 s, then call the doctor again')
    if RESET in marks and len(marks) > 1:
        return warning('Board', 'it was reset meanwhile: odometry begins anew',
                       'declare its pose anew before it drives to a goal')
    if len(marks) > 1:
        return warning('Board', 'it restarted meanwhile: odometry and IMU begin anew',
                       'is the battery charged, the power switch and the USB cable firm? Let it '
                       'stand still, then declare its pose anew')
    return ok('Board', 'its gyro is calibrated')


def judge_battery(voltage: float) -> Line:
    """Is the battery charged? `voltage`: the lowest heard [V]; nan if none was heard."""
    if math.isnan(voltage):
        return warning('Battery', 'its voltage did not come', 'call the doctor again')
    text = '{:.1f} V'.format(voltage)
    if voltage < NO_BATTERY:
        return fault('Battery', text + ': the board lives on USB alone, and the motors are off',
                     'plug the battery in, and switch the board on')
    if voltage < CUT_OFF:
        return fault('Battery', '{}: below {:.1f} V the board cuts the motors'.format(
            text, CUT_OFF), 'charge or change the battery')
    if voltage < NEARLY_EMPTY:
        return warning('Battery', '{}: at {:.1f} V the board cuts the motors'.format(
            text, CUT_OFF), 'charge or change the battery soon')
    return ok('Battery', text)


def judge_motors(torque: Optional[bool], namespace: str = '/', has_power: bool = True) -> Line:
    """Do the motors hold their torque? None: no sensor_state came; `has_power`: is the battery's
    voltage high enough for the motors?"""
    if torque is None:
        return fault('Motors', 'they do not answer (no sensor_state)',
                     "look at their cables; switch the board off and on" if has_power else
                     'mend the battery first')
    if not torque:
        return fault('Motors', 'their torque is off: the robot does not move',
                     'rostopic pub -1 {}motor_power std_msgs/Bool true'.format(namespace))
    return ok('Motors', 'their torque is on')


def judge_drift(drift: Optional[float], error: float = 0.0, namespace: str = '/') -> Line:
    """Does the heading stand while the wheels stand? `drift` and its `error` (two standard errors)
    [deg/min]; None: the robot did not stand, or its wheels are not known."""
    if drift is None:
        return ok('Drift', 'the robot moved, so drift cannot be seen')
    text = '{:+.1f} deg/min at rest'.format(drift)
    if abs(drift) - error > DRIFTS:
        return warning('Drift', text + ': headings and goals will be off', 'calibrate the gyro of '
                       'the standing robot: rostopic pub -1 {}reset std_msgs/Empty'.format(
                           namespace))
    return ok('Drift', text)


def drift_of(imu: Sequence[Tuple[float, float]],
             wheels: Sequence[Tuple[float, float]]) -> Tuple[Optional[float], float]:
    """Returns (drift, two standard errors) [deg/min] of the yaw; `imu`: (stamp [s], yaw [rad]);
    `wheels`: (left, right) [rad]. None in place of the drift if the wheels turn, or if there are
    too few samples."""
    if len(imu) < 10 or len(wheels) < 2 or any(
            max(angles) - min(angles) > STANDS for angles in zip(*wheels)):
        return None, 0.0
    times = [stamp - imu[0][0] for stamp, _ in imu]
    yaws = [math.remainder(yaw - imu[0][1], 2.0 * math.pi) for _, yaw in imu]
    count, mean = len(imu), sum(times) / len(imu)
    spread = sum((time - mean) ** 2 for time in times)
    if spread <= 0.0:
        return None, 0.0
    slope = sum((time - mean) * yaw for time, yaw in zip(times, yaws)) / spread
    level = sum(yaws) / count
    rest = sum((yaw - level - slope * (time - mean)) ** 2 for time, yaw in zip(times, yaws))
    per_minute = math.degrees(60.0)
    return per_minute * slope, 2.0 * per_minute * math.sqrt(rest / (count - 2) / spread)
