"""Computes the command of a turn or of the mouse. turns.NEXT_DRIVER says which of the two drives.

The time `now` [s] is on the receiver's clock. The time `steady_now` [s], and the `arrived_at` of an
IncomingMessage, are on a steady clock (:mod:`tb3_labs.nodes`). Requests for turns are in degrees.
All other angles are in radians. Speeds are in m/s.
"""
import math
from typing import Optional

from tb3_labs.control.commands import IDLE_SAMPLE_PERIOD, Pace
from tb3_labs.control.turning import PreciseTurn
from tb3_labs.localization.gyro_check import GyroMonitor
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.nodes.controller.mouse import Mice, MouseState
from tb3_labs.nodes.controller.turns import (
    NEXT_DRIVER, ActiveTurn, Driver, DriverEvent, Heading, accept_turn)
from tb3_labs.robot.samples import ImuSample, WheelSample, heading_jump_text, is_at_rest
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS, Twist2
from tb3_labs.supervision.events import IncomingMessage, LogQueue, Output, SenderRequests
from tb3_labs.supervision.motion_monitors import (
    Sensor, SensorMonitor, SensorStatus, StallMonitor)
from tb3_labs.supervision.timeouts import MAX_REPEAT_GAP, RESUME_TIME, SleepMonitor

REFUSAL_LOG_PERIOD = 1.0    # [s]
MAX_ANGLE_SLACK = 1e-9      # [rad], by which rounding may exceed the largest angle


class ControllerCore:
    """Turns a robot by the yaw of its IMU and drives it by a mouse."""

    def __init__(self, law: PreciseTurn, gyro: Optional[GyroMonitor] = None) -> None:
        self._timing = SampleTiming()
        self.imu = Sensor('imu')
        self.driver = Driver.NOBODY
        self._driver_at_last_tick = Driver.NOBODY
        self._law = law
        self._pace = Pace(law.period)
        self._heading = Heading()
        self._sensors = SensorMonitor(self.imu)
        self._gyro = gyro or GyroMonitor(MODELS[DEFAULT_MODEL])
        self._sleep = SleepMonitor()
        self._turn: Optional[ActiveTurn] = None    # None after its result was logged
        self._log = LogQueue()
        self.mice = Mice(self._log)
        self._turn_requests = SenderRequests(self._sleep)
        self._refusal_logged_at = -math.inf
        self._mouse_command_is_due = False

    # -- inputs

    def on_imu(self, sample: ImuSample, now: float, sends_wheels: bool = False) -> None:
        timed = self._timing.on_imu(sample, now)
        self.imu.on_message(now, sample.yaw)
        jump = heading_jump_text(timed.previous_sample, sample)
        if jump and self.driver is Driver.TURN:
            self._change_driver(DriverEvent.TURN_OVER, jump)
        self._gyro.on_imu(timed, sends_wheels)
        self._heading.on_imu(timed)
        if self.driver is Driver.TURN:
            return
        self._sensors.update(now, self._gyro.needs_comparison)
        if is_at_rest(0.0, self._heading.yaw_rate):
            self._log_result(now)

    def on_wheels(self, sample: WheelSample) -> None:
        self._gyro.on_wheels(sample)

    def on_mouse(self, message: 'IncomingMessage[MouseState]') -> None:
        self._update_sleep_and_mice(message.arrived_at)
        stop_reason = self.mice.on_message(message)
        if stop_reason:
            self._release_mouse(stop_reason)
        elif self.mice.is_active:
            is_centred = self.mice.twist == Twist2()
            event = DriverEvent.MOUSE_CENTRED if is_centred else DriverEvent.MOUSE_MOVED
            self._mouse_command_is_due = True
            self._change_driver(event, 'the mouse took over')

    def on_turn(self, request: 'IncomingMessage[float]', now: float) -> None:
        """Turn by the angle [deg] that another node requests, unless accept_turn() refuses it."""
        self._update_sleep_and_mice(request.arrived_at)
        if accept_turn(self._turn_requests, request, self._sleep.is_waking):
            self._request_or_log(request, now)
        else:
            self._log_refusal('cannot turn: this turn only repeats an earlier turn; pause for '
                              f'{MAX_REPEAT_GAP:.0f} s, then ask again', request.arrived_at)

    def on_typed(self, request: 'IncomingMessage[float]', now: float) -> None:
        """Turn by an angle [deg] that a person typed. A person may type the same turn again."""
        self._update_sleep_and_mice(request.arrived_at)
        self._refusal_logged_at = -math.inf
        self._request_or_log(request, now)

    def _request_or_log(self, request: 'IncomingMessage[float]', now: float) -> None:
        try:
            self.request_turn(request.content, now)
        except ValueError as error:
            self._log_refusal(str(error), request.arrived_at)

    def _log_refusal(self, text: str, steady_now: float) -> None:
        if steady_now - self._refusal_logged_at >= REFUSAL_LOG_PERIOD:
            self._refusal_logged_at = steady_now
            self._log.warn(text)

    def request_turn(self, degrees: float, now: float) -> None:
        """Turn by `degrees`, left positive. A request during a turn adds `degrees` to the goal of
        this turn. If the request is refused, raises ``ValueError`` with the reason."""
        angle = math.radians(degrees)
        turn = self._turn
        if turn is not None and self.driver is Driver.TURN:
            self._refuse_impossible_turn(turn.remaining(self._heading.yaw) + angle, now)
            self._law.move_goal(angle)
            turn.move_goal(angle)
        else:
            self._refuse_impossible_turn(angle, now)
            turn = self._begin_turn(angle, now)
        self._log.add(f'Turning {round(math.degrees(turn.requested), 6):g} degrees')
        self._change_driver(DriverEvent.TURN_REQUESTED)

    def _update_sleep_and_mice(self, steady_now: float) -> None:
        """Give up a turn after a sleep of this process. Stop the robot if a mouse is lost."""
        self._sleep.update(steady_now)
        if self._sleep.slept_for > RESUME_TIME:
            self._turn_requests.end_repetitions()
            if self.driver is Driver.TURN:
                self._change_driver(DriverEvent.TURN_OVER, self._sleep.as_text())
        stop_reason = self.mice.lose_if_silent(steady_now, has_slept=self._sleep.slept_for > 0.0)
        if stop_reason:
            self._mouse_command_is_due = True
            self._release_mouse(stop_reason)

    def set_law(self, law: PreciseTurn) -> None:
        """From now on use another control law. An active turn keeps its goal."""
        self._law = law
        self._pace = Pace(law.period)
        if self._turn is not None and self.driver is Driver.TURN:
            self._turn.stall = StallMonitor()
            self._start_law(self._turn)

    # -- outputs

    def tick(self, now: float, steady_now: float) -> Output:
        self._update_sleep_and_mice(steady_now)
        command = self._next_command(now) if self._is_command_due(now) else None
        is_new_driver = self.driver is not self._driver_at_last_tick
        self._driver_at_last_tick = self.driver
        return Output(command, must_stop_first=is_new_driver, log_lines=self._log.pop_all(),
                      needs_fast_ticks=self.driver is not Driver.NOBODY or self.mice.is_active)

    def _is_command_due(self, now: float) -> bool:
        if self._mouse_command_is_due:
            return True
        if self.driver is not Driver.TURN:
            return False
        return self._pace.is_due(now) or not self._sensors.are_fresh(now)

    def problem_text(self, now: float) -> str:
        return self._sensors.problem_text(now) or self._gyro.problem_text()

    def idle_time(self, now: float) -> float:
        return self._pace.idle_time(now) if self.driver is Driver.TURN else IDLE_SAMPLE_PERIOD

    def _next_command(self, now: float) -> Twist2:
        self._mouse_command_is_due = False
        if self.driver is Driver.MOUSE:
            return self.mice.twist
        turn = self._turn
        if turn is not None and self.driver is Driver.TURN:
            self._update_sensors(turn, now)
            if self._sensors.status in (SensorStatus.FRESH, SensorStatus.RECOVERED):
                return self._turn_step(turn, now)
        return Twist2()

    # -- turns

    def _refuse_impossible_turn(self, angle: float, now: float) -> None:
        if math.isnan(angle) or abs(angle) > self._law.MAX_ANGLE + MAX_ANGLE_SLACK:
            max_degrees = round(math.degrees(self._law.MAX_ANGLE))
            raise ValueError(f'cannot turn by {math.degrees(angle):g} degrees: a number from '
                             f'-{max_degrees} to {max_degrees}')
        if self._sleep.reason_to_refuse:
            raise ValueError(f'cannot turn: {self._sleep.reason_to_refuse}; ask again')
        if self.driver is Driver.MOUSE:
            raise ValueError('cannot turn: the mouse is driving; move it to the middle of the '
                             'screen, or scroll up, then ask again')
        problem = self._sensors.problem_text(now, with_age=True)
        if problem:
            raise ValueError(f'cannot turn: {problem} (is the robot running?)')
        conflict = self._gyro.problem_text()
        if conflict:
            raise ValueError(f'cannot turn: {conflict}')

    def _begin_turn(self, angle: float, now: float) -> ActiveTurn:
        self._log_result(now)
        self._turn = ActiveTurn(angle, self._heading.resting_yaw.value, now)
        self._sensors.request_motion()
        self._start_law(self._turn)
        return self._turn

    def _start_law(self, turn: ActiveTurn) -> None:
        self._law.start(self._heading.yaw, turn.remaining(self._heading.yaw))
        self._pace.restart()

    def _update_sensors(self, turn: ActiveTurn, now: float) -> None:
        sensors = self._sensors
        sensors.update(now, self._gyro.needs_comparison)
        if sensors.status is SensorStatus.SILENT:
            if self._pace.is_running:
                self._log.warn('Stopped: ' + sensors.reason_to_stand)
            self._pace.restart()
        elif sensors.status is SensorStatus.RECOVERED:
            self._log.add('Going on: the IMU is back')
            turn.stall.forget_least_remaining()
            self._start_law(turn)
        elif sensors.status is SensorStatus.TIMED_OUT:
            reason = sensors.reason_to_stand or 'the IMU was silent'
            self._change_driver(DriverEvent.TURN_OVER, f'{reason} for {sensors.silent_for:.1f} s')

    def _turn_step(self, turn: ActiveTurn, now: float) -> Twist2:
        heading = self._heading
        imu = self._timing.imu
        assert imu is not None
        dt = self._pace.step(now)
        step = self._law.step(
            heading.yaw, heading.yaw_rate, dt, imu.age(now), heading.noise.deviation)
        self.imu.update_repetition(must_change=True, now=now)
        failure = self._sensors.frozen_text() or self._gyro.problem_text()
        if not failure and not step.is_finished:
            robot_rests = is_at_rest(0.0, heading.yaw_rate)
            must_move = step.command != Twist2()
            failure = turn.stall.update(step.remaining, robot_rests, dt, must_move)
        if failure or step.is_finished:
            turn.remaining_at_end = step.remaining
            self._change_driver(DriverEvent.TURN_OVER, failure)
            return Twist2()
        return step.command

    def _log_result(self, now: float) -> None:
        if self._turn is not None:
            self._log.add(self._turn.result_text(now))
            self._turn = None

    # -- who drives

    def _release_mouse(self, reason: str) -> None:
        self._log.add(reason.capitalize())
        self._change_driver(DriverEvent.MOUSE_RELEASED, reason)

    def _change_driver(self, event: DriverEvent, reason: str = '') -> None:
        """Change the driver after `event`, if NEXT_DRIVER says so. An event with a `reason` gives
        up an active turn. It also ends the repetitions of all requests."""
        if reason:
            self._turn_requests.end_repetitions()
        previous_driver = self.driver
        if (previous_driver, event) not in NEXT_DRIVER:
            return
        self.driver = NEXT_DRIVER[previous_driver, event]
        if reason and previous_driver is Driver.TURN and self._turn is not None:
            remaining = self._turn.remaining(self._heading.yaw)
            self._log.warn(f'Turn given up {abs(math.degrees(remaining)):.0f} degrees before its '
                           f'end: {reason}')
            self._turn = None
