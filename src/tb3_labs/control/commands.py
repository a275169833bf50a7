"""Finds when a control law must give a command and remembers the commands.

In one step, a control law reads the latest samples and gives one command. A law has one step in
each control period (turtlebot3.CONTROL_RATE), because the robot obeys one new command in each
period. A `Pace` finds when the next step is due. A command reaches the motors after the *delay*.

Units: radians or metres for travel, radians or metres per second for speeds, seconds for times.
"""
from collections import deque
from typing import NamedTuple, Optional

from tb3_labs.geometry.angles import clamp
from tb3_labs.robot.turtlebot3 import Twist2

#: Each step after the first is due earlier by this time [s], as a sample may be up to 5 ms late.
STEP_LEAD_TIME = 0.0035
IDLE_SAMPLE_PERIOD = 0.036    # [s]; a node that does not drive reads one sample in this time
COMMAND_MEMORY_TIME = 1.4     # [s]; no delay and no age of a sample is longer


class LawStep(NamedTuple):
    """The command that a control law gives in one step."""

    command: Twist2
    remaining: float         # remaining travel [m or rad]
    is_finished: bool        # the robot has reached the goal of the law


class Pace:
    """Finds when the next step is due. The mean time between two steps is one `period` [s]."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._next_step_at = 0.0
        self._last_step_at: Optional[float] = None

    @property
    def is_running(self) -> bool:
        """Returns True if a step was taken since the last restart."""
        return self._last_step_at is not None

    def is_due(self, now: float) -> bool:
        has_clock_gone_back = now < self._next_step_at - 2.0 * self._period
        return now >= self._next_step_at or has_clock_gone_back

    def idle_time(self, now: float) -> float:
        """Returns the time [s] until the next step is due. No sample is needed before."""
        return clamp(self._next_step_at - now, 0.0, 2.0 * self._period)

    def step(self, now: float) -> float:
        """Take a step. Returns the time [s] since the previous step; one period if this is the
        first step after a restart."""
        last = self._last_step_at
        self._last_step_at = now
        if last is None:
            self._next_step_at = now + self._period - STEP_LEAD_TIME
            return self._period
        self.skip(now)
        return max(0.0, now - last)

    def skip(self, now: float) -> None:
        """Skip a step that was due, so that the next step is due one period later."""
        self._next_step_at = clamp(
            self._next_step_at + self._period, now + 0.5 * self._period, now + self._period)

    def restart(self) -> None:
        """Let the next step be the first, because the robot rests or another node drives."""
        self._last_step_at = None


class _SentCommand(NamedTuple):
    start: float      # start [s] of the period in which the robot obeys the command
    command: float
    travel: float     # travel [m or rad] of all commands before this command


class CommandHistory:
    """The commands since the start of an approach. All earlier commands count as stops."""

    def __init__(self, period: float) -> None:
        """The robot obeys each command for one `period` [s]."""
        self._period = period
        self._sent_commands = deque([_SentCommand(-COMMAND_MEMORY_TIME, 0.0, 0.0)])
        self.now = 0.0              # time [s] since the start
        self.period_start = 0.0     # start [s] of the period in which the robot obeys a new command
        self.command = 0.0          # the latest command
        self.first_command = 0.0    # 0 before the first command
        self._changed_at = 0.0

    @property
    def unchanged_for(self) -> float:
        return self.now - self._changed_at

    def advance(self, dt: float) -> None:
        self.now += dt
        # round to the nearest start of a period, because a step may be a little early or late
        self.period_start = round(self.now / self._period) * self._period

    def send(self, command: float) -> None:
        """Remember the command for the period that begins now."""
        if len(self._sent_commands) == 1:    # no command was sent yet
            self.first_command = command
        if command != self.command:
            self._changed_at = self.now
        self.command = command
        travel = self.commanded_travel(self.period_start)
        self._sent_commands.append(_SentCommand(self.period_start, command, travel))
        while self._sent_commands[1].start < self.now - COMMAND_MEMORY_TIME:    # forget the first
            self._sent_commands.popleft()

    def commanded_travel(self, until: float) -> float:
        """Returns the travel commanded until the time `until` [s]."""
        latest = self._command_at(until)
        return latest.travel + latest.command * (until - latest.start)

    def travel_under_way(self, delay: float) -> float:
        """Returns the travel of the commands that were sent less than `delay` [s] ago."""
        since = min(self.now - delay, self.period_start)
        return self.commanded_travel(self.period_start) - self.commanded_travel(since)

    def command_at_motors(self, delay: float) -> float:
        """Returns the command that reaches the motors now; 0 before the first command."""
        return self._command_at(self.now - delay).command

    def sent_only_stops_since(self, time: float) -> bool:
        return not any(sent.command for sent in self._sent_commands if sent.start >= time)

    def _command_at(self, time: float) -> _SentCommand:
        """Returns the command at `time` [s], or the oldest command if `time` is too early."""
        for sent in reversed(self._sent_commands):
            if sent.start <= time:
                return sent
        return self._sent_commands[0]
