"""Turns the robot precisely on the spot and finds when a turn has settled.

A turn has settled when the samples show a robot at rest inside the tolerance. If the IMU is noisy,
more samples at rest are needed to know the remaining angle well.

Units: radians, seconds; counter-clockwise positive.
"""
import math
from typing import Optional

from tb3_labs.control.braking import Approach, ApproachConfig
from tb3_labs.control.commands import LawStep
from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.geometry.angles import difference, unwrap
from tb3_labs.robot.samples import is_at_rest
from tb3_labs.robot.turtlebot3 import CONTROL_RATE, Twist2

SETTLING_TIME = 0.03    # [s]; it is nearly one control period


class Settling:
    """Finds whether a robot has been at rest for `SETTLING_TIME`. Only times of measurements are
    compared, because one sample may be read several times."""

    def __init__(self) -> None:
        self.rest_began_at: Optional[float] = None    # [s]; None while the robot moves
        self._measured_at = 0.0                       # time [s] of the latest sample

    def update(self, is_resting: bool, measured_at: float) -> None:
        """Use the latest sample. `is_resting` is True if this sample shows a robot at rest."""
        if not is_resting:
            self.rest_began_at = None
        elif self.rest_began_at is None or measured_at < self.rest_began_at:
            self.rest_began_at = measured_at
        self._measured_at = measured_at

    @property
    def rested_for(self) -> float:
        """Time [s] from the first to the latest sample at rest; 0 while the robot moves."""
        if self.rest_began_at is None:
            return 0.0
        return self._measured_at - self.rest_began_at

    @property
    def has_settled(self) -> bool:
        return self.rested_for >= SETTLING_TIME


class PreciseTurn:
    """Turns as fast as the limits allow, in the requested direction. The turn ends when the robot
    has settled inside the tolerance."""

    period = 1.0 / CONTROL_RATE    # [s], the control period of the firmware
    MAX_ANGLE = 200.0 * math.pi    # the largest turn [rad]
    MAX_WAIT_AT_REST = 0.6         # [s]; a robot at rest waits no longer for samples of a noisy IMU
    #: The remaining angle is known well if its uncertainty is at most this share of the tolerance.
    MAX_UNCERTAINTY_SHARE = 0.35

    def __init__(self, max_rate: float, acceleration: float, tolerance: float,
                 response: MotorResponse) -> None:
        """The limits are `max_rate` [rad/s], `acceleration` [rad/s^2] and `tolerance` [rad]."""
        self._max_rate = max_rate
        self._tolerance = tolerance
        self._approach = Approach(ApproachConfig(
            period=self.period, acceleration=acceleration, deceleration=0.25 * acceleration,
            gain=24.0, min_speed=0.02, dead_band=0.0007, nudge_dead_band=0.5 * tolerance,
            nudge_time=self.period, measures_instant_speed=True), response)
        self.start(0.0, 0.0)

    def start(self, yaw: float, angle: float) -> None:
        """Turn a robot that rests at the heading `yaw` [rad] by `angle` [rad]."""
        self._goal_yaw = yaw + angle    # heading [rad] at the end of the turn
        self.remaining = angle          # the remaining angle [rad], perhaps many whole turns
        self._time = 0.0                # time [s] since the start
        self._settling = Settling()
        self._approach.start()

    def move_goal(self, angle: float) -> None:
        self._goal_yaw += angle
        self.remaining += angle
        self._approach.move_goal(angle)

    def aim(self, goal_yaw: float) -> None:
        """From now on, turn to the heading `goal_yaw` [rad] the short way round."""
        self._approach.move_goal(difference(goal_yaw, self._goal_yaw))
        self._goal_yaw = goal_yaw

    def step(self, yaw: float, rate: float, dt: float, age: float = 0.0,
             noise: float = 0.0) -> LawStep:
        """Returns the LawStep for a sample of `yaw` [rad] and `rate` [rad/s], which is `age` [s]
        old. `noise` [rad] is the yaw's standard deviation. The previous step was `dt` [s] ago."""
        self._time += dt
        self.remaining = unwrap(self._goal_yaw - yaw, self.remaining)
        command = self._approach.step(self.remaining, rate, max_speed=self._max_rate, dt=dt,
                                      noise=noise, age=age)
        is_resting = is_at_rest(0.0, rate) and self._approach.obeyed_only_stops(age)
        self._settling.update(is_resting, measured_at=self._time - age)
        if is_resting:
            self.remaining = self._approach.predicted_remaining.value
        return LawStep(Twist2(0.0, command), self.remaining,
                       is_finished=self._settling.has_settled and self._is_inside_tolerance())

    def _is_inside_tolerance(self) -> bool:
        # if the IMU is noisy, wait for more samples and then allow an error by the uncertainty
        uncertainty = self._approach.predicted_remaining.uncertainty
        if uncertainty <= self.MAX_UNCERTAINTY_SHARE * self._tolerance:
            return abs(self.remaining) <= self._tolerance
        return (self._settling.rested_for >= self.MAX_WAIT_AT_REST
                and abs(self.remaining) <= self._tolerance + uncertainty)
