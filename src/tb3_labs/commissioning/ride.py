"""The test drive itself: it goes through the steps, and stops at once if it must.

    ride = Ride(recording, STEPS)
    ride.enter(now)                    # the person has read ride.words, and pressed Enter
    ride.hear(sample, now)             # each sample
    order = ride.tick(now)             # often: the command to send, or None

Everything ends with zero by a key, a sensor that is silent, a robot that does not follow, and a box
around the place where it began, by odometry.

Units: seconds, metres, radians; `now` is on the clock of the arrivals.
"""
import math
from enum import Enum
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from tb3_labs.commissioning.recording import Mark, Recording
from tb3_labs.commissioning.steps import PERIOD, STEPS, Part, Step
from tb3_labs.geometry.angles import difference
from tb3_labs.robot.samples import ImuSample, OdometrySample

#: Half the side of the box around the start [m].
BOX = 0.8
#: A robot follows a command within this time [s] by at least FOLLOWED [m], [rad].
FOLLOWS_WITHIN, FOLLOWED = 1.6, (0.02, 0.1)
#: After a silence the sensors are heard for this long, to learn whether they come back [s].
LISTENING = 6.0
#: Reasons of an end.
KEY, WALL, SLOW = 'a key was pressed', 'it reached the wall of its box', 'it was too slow'
STOOD = 'this computer stood still'
LOST, STANDS = 'nothing came from ', 'it did not follow the command'
FROZEN = 'the same values came again and again from '
#: If this program did not run for this long, the robot has stopped by itself: the drive ends [s].
STALLED = 1.0
#: A sensor whose values do not change for this long in a movement is frozen [s].
UNCHANGED = 0.7


class Phase(Enum):
    """The thing that the ride waits for."""

    ANNOUNCED = 'Enter'
    RUNNING = 'the end of a step'
    ASKING = 'a number'
    LISTENING = 'sensors that were silent'
    OVER = 'nothing'


class Order(NamedTuple):
    """The messages to send: a command (forward speed, rate of turn) or None; `reset`, if True."""

    command: Optional[Tuple[float, float]] = None
    reset: bool = False


class Ride:
    """One test drive. Not safe to call from two threads at once."""

    def __init__(self, recording: Recording, steps: Sequence[Step] = STEPS) -> None:
        self._recording, self._steps = recording, list(steps)
        self.phase = Phase.ANNOUNCED
        self._number = 0
        self._parts: List[Part] = []        # the parts of the step that are left
        self._part: Optional[Part] = None
        self._begun = self._sent = 0.0
        self._ticked = math.inf
        self._told: Optional[Part] = None   # the latest part that moves the robot
        self._told_at = 0.0                 # when the robot was last looked at, and its motion then
        self._moved, self._looked = (0.0, 0.0, 0.0), False
        self._listens_until = math.inf
        self._heard: Dict[str, float] = {}      # when a sensor's latest sample came,
        self._changed: Dict[str, float] = {}    # and the latest one that was not the same
        self._imu_yaw = self._odom_yaw = self._way = 0.0    # continuous
        self._place: Optional[OdometrySample] = None
        self._home: Optional[Tuple[float, float]] = None
        self._at_begin = (0.0, 0.0, 0.0)

    @property
    def step(self) -> Step:
        """The step that is announced or driven."""
        return self._steps[min(self._number, len(self._steps) - 1)]

    @property
    def is_over(self) -> bool:
        """Is everything done?"""
        return self.phase is Phase.OVER

    # Events ---------------------------------------------------------------------------------------

    def hear(self, sample: Any, now: float) -> None:
        """A sample has arrived."""
        if self.is_over:
            return
        self._recording.add(sample, now)
        if isinstance(sample, ImuSample):
            if difference(sample.yaw, self._imu_yaw):
                self._changed['imu'] = now
            self._imu_yaw += difference(sample.yaw, self._imu_yaw)
            self._heard['imu'] = now
        elif isinstance(sample, OdometrySample):
            before, self._place = self._place, sample
            if before is None or before.pose != sample.pose:
                self._changed['odom'] = now
            self._odom_yaw += difference(sample.pose.yaw, self._odom_yaw)
            self._heard['odom'] = now
            if before is not None and not self._is_resetting:
                self._way += math.copysign(before.pose.distance_to(sample.pose), sample.linear)
            if self._home is None or self._is_resetting:
                self._home = sample.pose.x, sample.pose.y

    def enter(self, now: float) -> None:
        """The person begins the step that is announced."""
        if self.phase is Phase.ANNOUNCED:
            self.phase, self._parts = Phase.RUNNING, list(self.step.parts)
            self._heard = {'imu': now, 'odom': now}
            self._next_part(now)

    def answer(self, number: Optional[float], now: float) -> None:
        """The person typed a number; None: there is no answer."""
        if self.phase is Phase.ASKING:
            if number is not None:
                self._recording.answers[self.step.name] = number
            self._next_step()

    def end(self, reason: str, now: float) -> None:
        """End everything: from now on the command is zero."""
        if self.phase in (Phase.OVER, Phase.LISTENING):
            return
        self._recording.ended = '{}: {}'.format(self.step.name, reason)
        self.phase = Phase.OVER
        if reason.startswith(LOST):
            self._recording.lost = reason[len(LOST):]
            self.phase, self._listens_until = Phase.LISTENING, now + LISTENING

    # Time passes ----------------------------------------------------------------------------------

    def tick(self, now: float) -> Order:
        """Returns what is to be sent now. Call it at least every 10 ms."""
        if self.phase is Phase.RUNNING and now > self._ticked + STALLED:
            self.end(STOOD, now)
        self._ticked = now
        order = self._tick(now)
        if order.command is not None and self.phase is Phase.RUNNING:
            self._recording.told.append((now,) + order.command)
        return order

    def _tick(self, now: float) -> Order:
        if self.phase is Phase.RUNNING:
            problem = self._problem(now)
            if problem:
                self.end(problem, now)
            elif self._is_done(now):
                marks = self._recording.marks
                marks[-1] = marks[-1]._replace(end=now)
                self._next_part(now)
        if self.phase is Phase.LISTENING and now >= self._listens_until:
            self.phase = Phase.OVER
        part = self._part
        if self.phase is not Phase.RUNNING or part is None:
            return Order((0.0, 0.0))
        if self._sent < self._begun:        # the first tick of a part
            self._sent = now
            return Order(None if part.silent else (part.linear, part.angular), part.resets)
        if now < self._sent + PERIOD - 1e-6 or part.silent or part.once:
            return Order()
        self._sent += PERIOD if now < self._sent + 2.0 * PERIOD else now - self._sent
        return Order((part.linear, part.angular))

    @property
    def _is_resetting(self) -> bool:
        return self.phase is Phase.RUNNING and self.step.name == 'reset'

    @property
    def _motion(self) -> Tuple[float, float, float]:
        return self._way, self._imu_yaw, self._odom_yaw

    def _problem(self, now: float) -> str:
        """The reason why everything must end now; '' if there is none."""
        silences = {name: now - at for name, at in self._heard.items()}
        limit = self.step.longest_silence
        if max(silences.values()) > limit:
            return LOST + ' and '.join(name for name in silences if silences[name] > 0.8 * limit)
        assert self._part is not None
        if self._place is not None and self._home is not None and not self._is_resetting:
            x, y = self._place.pose.x - self._home[0], self._place.pose.y - self._home[1]
            if max(abs(x), abs(y)) > BOX:
                return WALL
        return self._standing(now)

    def _standing(self, now: float) -> str:
        """The problem of a robot that does not follow, or seems not to; '' if there is none."""
        told, part = self._told, self._part
        if told is None or part is None or now < self._begun + FOLLOWS_WITHIN and part is told:
            return ''
        if self._looked and part is not told:
            return ''       # it is at the end of a long part
        names = ['odom', 'imu'] if told.angular else ['odom']
        frozen = [name for name in names if now - self._changed.get(name, now) > UNCHANGED]
        if now < self._told_at + FOLLOWS_WITHIN:
            return FROZEN + frozen[0] if frozen and part is told else ''
        moved = [b - a for a, b in zip(self._moved, self._motion)]
        self._told_at, self._moved, self._looked = now, self._motion, True
        if told.linear:
            slow = moved[0] * math.copysign(1.0, told.linear) < FOLLOWED[0]
            return '' if not slow else FROZEN + frozen[0] if frozen else STANDS
        still = [name for name, turn in (('imu', moved[1]), ('odom', moved[2]))
                 if turn * math.copysign(1.0, told.angular) < FOLLOWED[1]]
        return STANDS + (', by ' + still[0] if len(still) == 1 else '') if still else ''

    def _is_done(self, now: float) -> bool:
        part = self._part
        assert part is not None
        if part.reach:
            way, turned, _ = (abs(b - a) for a, b in zip(self._at_begin, self._motion))
            if (way if part.linear else turned) >= part.reach:
                return True
            if now >= self._begun + part.seconds:
                self.end(SLOW, now)
            return False
        return now >= self._begun + part.seconds - 1e-6

    def _next_part(self, now: float) -> None:
        if self.phase is not Phase.RUNNING:
            return
        if not self._parts:
            self._part = None
            self.phase = Phase.ASKING if self.step.question else Phase.ANNOUNCED
            if not self.step.question:
                self._next_step()
            return
        part = self._part = self._parts.pop(0)
        self._begun, self._sent, self._at_begin = now, -math.inf, self._motion
        self._recording.marks.append(
            Mark(self.step.name, part.name, now, math.nan, part.linear, part.angular))
        if (part.linear or part.angular) and not part.once:
            self._told, self._told_at, self._moved = part, now, self._motion
            self._looked = False

    def _next_step(self) -> None:
        self._number += 1
        self.phase = Phase.ANNOUNCED if self._number < len(self._steps) else Phase.OVER
