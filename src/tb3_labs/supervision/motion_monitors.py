"""Is a motion allowed to continue? The sensors must work, and the robot must obey its commands.

A sensor is lost if its messages stop. It is frozen if its driver hangs and repeats one reading
while the robot moves. A robot is stalled if commands bring it no nearer to its goal.

The remaining travel is in radians or metres. All times are in seconds, on the same clock as `now`.
"""
import math
from enum import Enum
from typing import Optional

from tb3_labs.supervision.timeouts import (
    FROZEN_TIME, MAX_REST_TIME, RESUME_TIME, ROBOT_START_TIMEOUT, SENSOR_TIMEOUT, STALL_TIME,
    Freshness)

NO_MOTION = 'the robot does not move although it is told to (stuck, or motors off?)'
UNCHECKED_GYRO = 'gyro and wheels are not compared yet: the robot must rest for a second'
#: If a command is faster than these [m/s, rad/s], the readings of the sensors must change.
MIN_VISIBLE_SPEED = 0.02
MIN_VISIBLE_TURN_RATE = 0.1
#: The robot makes progress only if its remaining travel becomes less by at least this [m or rad].
STALL_STEP = 0.004
#: The robot has missed its goal if the remaining travel grows again by more than this [m or rad].
#: If the network stalls for a short time, a robot overshoots by less than this.
MAX_RETREAT = 0.8


class SensorStatus(Enum):
    """The status of the sensors during a motion."""

    FRESH = 'the robot may move'
    SILENT = 'the robot must stand'
    RECOVERED = 'the sensors are fresh again after a short silence, in which the robot stood'
    TIMED_OUT = 'the silence was too long: the robot may be anywhere, and the motion ends'


class Sensor(Freshness):
    def __init__(self, name: str) -> None:
        super().__init__(name, SENSOR_TIMEOUT)
        self.reading: object = None     # content of the latest message, without the stamp
        self.repeated_for = 0.0         # time [s] since the reading should have changed
        self.longest_gap = 0.0          # longest time [s] between two messages during a motion
        self._changed_at = math.inf     # time [s] of the latest change; infinite before a change

    def on_message(self, now: float, reading: object = None) -> float:
        silence = super().on_message(now)
        if self.count > 2:    # the gap after the first message is the calibration of the gyro
            self.longest_gap = max(self.longest_gap, silence)
        if reading != self.reading:
            self.reading = reading
            self._changed_at = now
        return silence

    def update_repetition(self, must_change: bool, now: float) -> None:
        """Update `repeated_for`. `must_change` is True while the robot is told to move."""
        if not must_change or self._changed_at > now:    # the clock may have gone back
            self._changed_at = now
        self.repeated_for = now - self._changed_at

    def forget_motion(self) -> None:
        """Forget the silences and repetitions so far, because a new motion will begin."""
        self.longest_gap = 0.0
        self.repeated_for = 0.0
        self._changed_at = math.inf

    def adapt_to_clock(self, now: float) -> None:
        """Move the latest arrival to `now` if the clock went back behind this arrival."""
        if self._received_at is not None:
            self._received_at = min(self._received_at, now)


class SensorMonitor:
    """Finds lost and frozen sensors among the sensors of a motion."""

    def __init__(self, *sensors: Sensor) -> None:
        self._sensors = sensors
        self.status = SensorStatus.SILENT    # RECOVERED lasts for one update
        self.reason_to_stand = ''            # '' if the robot may move
        self.silent_for = 0.0                # length [s] of the latest silence of a motion
        self._longest_wait = ROBOT_START_TIMEOUT    # time [s] that a motion waits for sensors
        self._silent_since = math.inf    # start [s] of the silence; infinite until the next update
        self._were_ready = False         # all sensors were ready at the latest update

    def request_motion(self) -> None:
        """Begin to wait for the sensors, because a resting robot is asked to move."""
        self._silent_since = math.inf
        self.forget_motion()

    def update(self, now: float, needs_comparison: bool = False) -> None:
        """Update `status` and `reason_to_stand`. Call this often, and at each step of a drive.
        `needs_comparison` is True if a motion must wait until gyro and wheels were compared."""
        for sensor in self._sensors:
            sensor.adapt_to_clock(now)
        self._silent_since = min(self._silent_since, now)    # the clock may have gone back
        silent_for = now - self._silent_since
        is_late = silent_for > self._longest_wait

        # after its first message a TurtleBot3 calibrates its gyro for 2.6 s, and must not move
        have_sent_twice = all(sensor.count > 1 for sensor in self._sensors)
        are_ready = have_sent_twice and self.are_fresh(now)
        became_ready = are_ready and not self._were_ready
        self._were_ready = are_ready
        may_move = are_ready and not needs_comparison

        if may_move or became_ready:    # the next silence is counted from the latest messages
            self._silent_since = now - max(sensor.age(now) for sensor in self._sensors)
            self._longest_wait = RESUME_TIME
        self._update_reason(are_ready, may_move, now)
        self._update_status(may_move, silent_for, is_late)

    def _update_reason(self, are_ready: bool, may_move: bool, now: float) -> None:
        if may_move:
            self.reason_to_stand = ''
        elif are_ready:
            self.reason_to_stand = UNCHECKED_GYRO
        elif not self.reason_to_stand:    # a second lost sensor does not change the reason
            self.reason_to_stand = self.problem_text(now)

    def _update_status(self, may_move: bool, silent_for: float, is_late: bool) -> None:
        longest_gap = max(sensor.longest_gap for sensor in self._sensors)
        if is_late:
            self.status = SensorStatus.TIMED_OUT
            self.silent_for = silent_for
        elif not may_move:
            self.status = SensorStatus.SILENT
            self.silent_for = silent_for
        elif longest_gap > SENSOR_TIMEOUT:
            self.status = SensorStatus.RECOVERED
            self.silent_for = longest_gap
        else:
            self.status = SensorStatus.FRESH
        if may_move and self.status is not SensorStatus.FRESH:
            self.forget_motion()

    def forget_motion(self) -> None:
        self.reason_to_stand = ''
        for sensor in self._sensors:
            sensor.forget_motion()

    def problem_text(self, now: float, with_age: bool = False) -> str:
        """Returns a text about the silent sensors; '' while all sensors are fresh."""
        if self.are_fresh(now):
            return ''
        # a sensor that is silent for half of its timeout is probably lost
        silent = [sensor for sensor in self._sensors if sensor.age(now) > 0.5 * sensor.timeout]
        time_for_age = now if with_age else None
        return ', '.join(sensor.silence_text(time_for_age) for sensor in silent)

    def frozen_text(self) -> str:
        """Returns a text about the sensors that are frozen; '' if all sensors work."""
        problem = 'repeats one reading though the robot is told to move (its driver hangs?)'
        return ' and '.join(f'{sensor.name} {problem}' for sensor in self._sensors
                            if sensor.repeated_for > FROZEN_TIME)

    def are_fresh(self, now: float) -> bool:
        return all(sensor.is_fresh(now) for sensor in self._sensors)


class DriveSensors(SensorMonitor):
    """The two sensors of a drive, whose readings must change while the robot moves."""

    def __init__(self) -> None:
        self.imu = Sensor('imu')
        self.odometry = Sensor('odom')
        super().__init__(self.imu, self.odometry)
        self.last_command = (0.0, 0.0)    # forward speed [m/s], and rate of turn [rad/s]

    def forget_motion(self) -> None:
        super().forget_motion()
        self.last_command = (0.0, 0.0)

    def update_repetitions(self, has_odometry_turned: bool, now: float) -> None:
        """Find readings that did not change although `last_command` moves the robot. If the yaw of
        the odometry changes, the IMU must also change, because the odometry uses the IMU's yaw."""
        linear, angular = self.last_command
        must_drive = abs(linear) > MIN_VISIBLE_SPEED
        must_turn = abs(angular) > MIN_VISIBLE_TURN_RATE
        imu_must_change = must_turn or (must_drive and has_odometry_turned)
        self.imu.update_repetition(imu_must_change, now)
        self.odometry.update_repetition(must_drive or must_turn, now)


class StallMonitor:
    """Finds a robot that is stalled, in one state of a drive or in one turn."""

    def __init__(self) -> None:
        self._least_remaining: Optional[float] = math.inf    # [m or rad]; None after a silence
        self._stalled_for = 0.0    # time [s] without progress
        self._rested_for = 0.0     # time [s] for which the command was 0

    def forget_least_remaining(self) -> None:
        """Call this after a silence of the sensors. A larger remaining travel is then no stall. The
        time without progress is kept, so that a bad network cannot hide a stalled robot."""
        self._least_remaining = None

    def update(self, remaining: float, is_at_rest: bool, dt: float, must_move: bool = True) -> str:
        """Returns a text about the robot's problem, or ''. `remaining` is the remaining travel [m
        or rad]. The previous update was `dt` [s] ago. `is_at_rest` is True if the samples show a
        robot at rest. `must_move` is True if the command tells the robot to move."""
        if not must_move:
            self._rested_for += dt
            if self._rested_for <= MAX_REST_TIME:
                return ''
            return 'the robot does not settle although it is told to rest (a noisy IMU?)'

        remaining = abs(remaining)
        if self._least_remaining is None:
            self._least_remaining = remaining
        if remaining <= self._least_remaining - STALL_STEP:
            self._least_remaining = remaining
            self._stalled_for = 0.0
        else:
            self._stalled_for += dt
        is_near_least_remaining = remaining <= self._least_remaining + MAX_RETREAT
        if is_near_least_remaining and self._stalled_for <= STALL_TIME:
            return ''
        if is_at_rest:
            return NO_MOTION
        return 'the robot moves, but no longer nearer to its goal: it has missed it'
