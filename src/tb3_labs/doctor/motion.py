"""Does the robot move, and do its readings change, while a node tells it to move?"""
import math
from typing import Iterable, Optional, Tuple, Union

from tb3_labs.doctor import BRINGUP_REMEDY, Finding, fault
from tb3_labs.doctor.streams import MAX_STANDING_ANGLE
from tb3_labs.robot.samples import ImuSample, OdometrySample, Sample, WheelSample
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, Twist2
from tb3_labs.supervision.motion_monitors import (
    MIN_VISIBLE_SPEED, MIN_VISIBLE_TURN_RATE, NO_MOTION, DriveSensors, Sensor)
from tb3_labs.supervision.timeouts import SENSOR_TIMEOUT, STALL_TIME


def judge_motion(samples: Iterable[Tuple[float, Union[Sample, Twist2]]]) -> Optional[Finding]:
    """Returns the first problem of a robot that is told to move, or None. `samples` is [(time of
    arrival [s], sample or command)]. While a sensor is silent, the robot is not judged, because
    then the commands may not arrive either."""
    sensors, wheels = DriveSensors(), Sensor('joint_states')
    command, commanded_at = Twist2(), -math.inf
    odometry_yaw, has_odometry_turned = math.nan, False
    for now, sample in samples:
        if isinstance(sample, ImuSample):
            sensors.imu.on_message(now, sample.yaw)
        elif isinstance(sample, OdometrySample):
            has_odometry_turned = sample.pose.yaw != odometry_yaw
            odometry_yaw = sample.pose.yaw
            sensors.odometry.on_message(now, (sample.pose, sample.linear, sample.angular))
        elif isinstance(sample, WheelSample):
            wheels.on_message(now, _without_jitter((sample.left, sample.right), wheels.reading))
        else:
            command, commanded_at = sample, now

        if not (sensors.are_fresh(now) and wheels.is_fresh(now)):
            sensors.forget_motion()
            wheels.forget_motion()

        # a command must turn the wheels, and turning wheels must change the other sensors
        must_move = now - commanded_at <= COMMAND_TIMEOUT and _is_visible(command)
        wheels.update_repetition(must_move, now)
        do_wheels_turn = must_move and wheels.repeated_for <= SENSOR_TIMEOUT
        sensors.last_command = command if do_wheels_turn else Twist2()
        sensors.update_repetitions(has_odometry_turned, now)
        if wheels.repeated_for > STALL_TIME:
            return fault('Motion', NO_MOTION, 'free the wheels; look at battery and torque: '
                         'rostopic echo /diagnostics; switch the robot off and on')
        if sensors.frozen_text():
            return fault('Motion', sensors.frozen_text(),
                         BRINGUP_REMEDY + "; switch the robot's board off and on")
    return None


def _is_visible(command):
    """Returns True if the sensors of a robot that follows the command must change."""
    return abs(command.linear) > MIN_VISIBLE_SPEED or abs(command.angular) > MIN_VISIBLE_TURN_RATE


def _without_jitter(angles, previous):
    """Returns the wheels' `angles` [rad]. Returns the `previous` angles if no wheel has turned by
    more than MAX_STANDING_ANGLE, because a standing wheel also jitters."""
    has_turned = previous is None or any(
        abs(angle - before) > MAX_STANDING_ANGLE for angle, before in zip(angles, previous))
    return angles if has_turned else previous
