"""Judgements of the robot's body, by what its board publishes and prints: battery, motors,
firmware, calibration and restarts of the board, drift of the IMU.

The board's lines are those of serial_node on /rosout. A subscriber gets the last line at once, even
if it is old, and then the new ones. Units: volts, degrees, seconds.
Source: ROBOTIS OpenCR firmware 1.2.6 (turtlebot3_core.ino, turtlebot3_diagnosis.cpp).
"""
import math
from statistics import mean, stdev
from typing import Mapping, Optional, Sequence, Tuple

from tb3_labs.doctor.line import Line, fault, ok, warning
from tb3_labs.robot.turtlebot3 import CUT_OFF

#: A node with one of these in its name may be serial_node, which prints the board's lines.
SERIAL_NODES = 'core', 'serial', 'turtlebot3'
#: The topics on which the board reports the state of the robot's body.
BODY_TOPICS = 'battery_state', 'sensor_state', 'firmware_version'
#: The firmware that the labs know.
FIRMWARE = '1.2.6'
#: {topic: the checksum of its message in ROS Noetic}.
CHECKSUMS = {'imu': '6a62c6daae103f4ff57a132d6f95cec2', 'odom': 'cd5e73d190d741a2f92e81eda573aca7',
             'joint_states': '3066dcd76a6cfaef579bd0f34173e9fd',
             'battery_state': '4ddae7f048e32fda22cac764685e3974'}
#: Below this the battery is nearly empty; below NO_BATTERY only USB powers the board [V].
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


def judge_firmware(lines: Sequence[str], version: str, checksums: Mapping[str, str],
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
    if 'sync with device' in text or not is_there and 'requesting topics' in text:
        return fault('Firmware', 'serial_node gets no answer (unable to sync with device): the '
                     'board is off, or has the firmware of ROS 2',
                     'switch it on; if that is not enough, ' + FLASH)
    for topic, checksum in sorted(checksums.items()):
        if checksum not in ('', '*', CHECKSUMS.get(topic, checksum)):
            return fault('Firmware', '{} has another definition (md5 {}) than in ROS Noetic'.format(
                topic, checksum), "use ROS Noetic on the robot's computer; " + FLASH)
    if version and version != FIRMWARE:
        return warning('Firmware', 'version {}, but the labs know {}: limits and pauses may differ'
                       .format(version, FIRMWARE), FLASH)
    return ok('Firmware', 'version ' + version) if version else None


def judge_board(lines: Sequence[str]) -> Optional[Line]:
    """Did the board start, or calibrate its gyro, while the doctor listened? `lines`: the last
    one from before, and all later ones. None if no line tells it."""
    marks = [mark for line in lines for mark in (START, END, RESET, CONNECTED) if mark in line]
    if not marks:
        return None
    if marks[-1] in (START, CONNECTED):
        return warning('Board', 'it calibrates its gyro now',
                       'let the robot stand still for 10 s, then call the doctor again')
    if len(marks) > 1:
        return warning('Board', 'it {} meanwhile: odometry begins anew'.format(
            'was reset' if RESET in marks else 'restarted'), 'declare its pose anew; {}'.format(
                'who sent the reset?' if RESET in marks else
                'is the battery charged, are power switch and USB cable firm?'))
    return ok('Board', 'its gyro is calibrated')


def judge_battery(voltage: float) -> Line:
    """Is the battery charged? `voltage`: the lowest heard [V]; nan if none was heard."""
    if math.isnan(voltage):
        return warning('Battery', 'its voltage did not come', 'call the doctor again')
    text = '{:.1f} V'.format(voltage)
    if voltage < NO_BATTERY:
        return fault('Battery', text + ': the board runs on USB alone, and the motors are off',
                     'plug the battery in, and switch the board on')
    if voltage < NEARLY_EMPTY:
        judge = fault if voltage < CUT_OFF else warning
        return judge('Battery', '{}: below {:.1f} V the board cuts the motors'.format(
            text, CUT_OFF), 'charge or change the battery')
    return ok('Battery', text)


def judge_motors(torque: Optional[bool], namespace: str = '/') -> Line:
    """Is the motors' torque on? None: no sensor_state came."""
    if torque is None:
        return fault('Motors', 'they do not answer (no sensor_state)',
                     'charge the battery; look at their cables; switch the board off and on')
    if not torque:
        return fault('Motors', 'their torque is off: the robot does not move',
                     'rostopic pub -1 {}motor_power std_msgs/Bool true'.format(namespace))
    return ok('Motors', 'their torque is on')


def judge_drift(drift: Optional[float], error: float = 0.0, namespace: str = '/') -> Line:
    """Does the heading stand while the wheels stand? `drift`, `error`: by drift_of."""
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
    part = len(imu) // 4
    if part < 3 or len(wheels) < 2 or any(
            max(angles) - min(angles) > STANDS for angles in zip(*wheels)):
        return None, 0.0
    first, last = ([math.degrees(math.remainder(yaw - imu[0][1], 2.0 * math.pi))
                    for _, yaw in quarter] for quarter in (imu[:part], imu[-part:]))
    minutes = max(imu[-part][0] - imu[0][0], 0.01) / 60.0
    noise = max(stdev(first), stdev(last)) * math.sqrt(2.0 / part)
    return (mean(last) - mean(first)) / minutes, 2.0 * noise / minutes
