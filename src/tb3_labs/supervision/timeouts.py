"""How old are the messages of a node? A source may be silent, a message late, the process asleep.

The arrivals of messages show that their source is silent (:class:`Freshness`). Their stamps show a
delay (:class:`Lateness`). A process sleeps when it is stopped, swapped out, or its computer is
suspended: a long time between two looks at the clock is a sleep (:class:`SleepWatch`).

The table below has every limit of a silence, a delay or a sleep by which a node that drives
decides. The robot's own limits are in robot/turtlebot3.py.

Units: seconds on the receiver's clock (`now`). Edge cases: a source that was never heard has an
infinite age. If the clock goes back, the last message is treated as just received. Otherwise it
would be treated as fresh for too long.
"""
import math
from collections import deque
from typing import Deque, Optional, Tuple

# -- a sensor, a pad or a mouse is silent

#: A sensor that is silent for longer than this is lost; at full speed it is a way of 5 cm.
SENSOR_TIMEOUT = 0.22
#: A sensor that repeats a reading for longer than this, in spite of commands to move, is frozen. A
#: slow network and slow motors delay the motion by less.
FROZEN_TIME = 0.6
#: A reading that is repeated for no longer than this needs no check: no new sample was due.
SHORT_REPETITION = 0.05
#: A motion continues by itself after a silence of the sensors of at most this length. A grant, a
#: goal or a turn is void if it is followed by a longer silence.
RESUME_TIME = 2.0
#: The same limit before the first message of a robot: its board needs up to 14 s to start.
ROBOT_START = 20.0
#: A turn that is typed before the robot is connected waits this long for the robot.
ROBOT_WAIT = 5.0
#: While the board resets (firmware: 2.6 s), it is silent for longer than this.
RESET_SILENCE = 1.0
#: A pad, or a page that drives, is lost if it is silent for longer than this.
PAD_TIMEOUT = 0.25
#: An active mouse that is silent for longer than this is lost.
MOUSE_TIMEOUT = 0.2
#: The odometry may show a displacement that grows with its silence; after this silence, any.
LONGEST_SILENCE = 5.0

# -- two samples are too far apart to be compared

#: Gyro samples: the rate between them is unknown.
GYRO_GAP = 0.15
#: Wheel samples: the motion between them is unknown.
WHEEL_GAP = 0.3
#: Samples of moving wheels: only the mean rate is known; samples were lost, as on a busy computer.
MEAN_ONLY = 0.08
#: Samples of one sensor: the motion between them is not interpolated.
MAX_GAP = 0.3
#: The odometry bridges a gap of the IMU up to this: it is shorter than half a turn of the robot.
MAX_BRIDGE = 1.0
#: Samples of an IMU do not show its noise if they are farther apart than this.
NOISE_GAP = 0.1

# -- the sender's clock

#: A clock that goes back by less than this is being corrected. One that goes back more was set.
SMALL_STEP = 0.1
#: A stamp that is this far ahead of its arrival belongs to a new clock.
CLOCK_STEP = 1.0
#: A message after a silence of all sources of this length belongs to a new clock.
LONG_SILENCE = 1.5
#: A source that is off by a clock step for longer than this does not have a clock.
MAX_OFF = 1.0
#: A source whose stamps went back does not have a clock if they catch up later than this.
MAX_BEHIND = 0.5

# -- a message is late, or repeats an earlier one

#: The least delay is taken over the messages of this time.
DELAY_WINDOW = 5.0
#: Each message adds at most this time to the time for which its sender was heard.
RECEIVED_BEFORE = 0.1
#: The delay of a pad's messages is known this long after the first one.
LATENESS_KNOWN_AFTER = 0.3
#: A sample of this age, or a silence of this length, shows that the network stalls.
LONGEST_AGE = 0.1
#: A sender that repeats a message does so within this time.
REPEATS_WITHIN = 2.0
#: A message that was latched before a node began to listen arrives within this time.
LATCHED_WITHIN = 0.3
#: A message of move_to_goal this soon after a press of A may be older than the press.
CROSSING = 0.3
#: After taking the robot back the pad waits until move_to_goal has stopped.
HAND_BACK = 0.15

# -- a person's permission

#: Time from one renewal of a permission to the next.
RENEWAL = 0.1
#: A renewal that comes later than this after the grant confirms the grant. An earlier renewal may
#: have been delayed together with the grant: it does not show that the sender is alive.
CONFIRMATION = 0.04
#: A grant whose renewals stop is suspended after this silence.
LAPSE = 0.5
#: A grant expires after this silence.
LONGEST_LAPSE = 2.0
#: A True that was sent longer ago than this is ignored.
OLDEST_GRANT = 2.0
#: A reset that was requested longer ago than this is ignored: it would declare another place.
OLDEST_RESET = 1.0
#: After this silence a sender of goals or turns has paused: it may ask for the same again.
SENDER_PAUSE = 2.0

# -- this process sleeps, or its clock stands

#: A longer time between two looks at the clock is a sleep. A busy machine pauses for less.
LONGEST_GAP = 1.0
#: Messages within this time after a sleep may be as old as the sleep. Their order is not known,
#: since each topic is read by its own thread.
WAKING = 0.3
#: A simulated clock that does not change for this long stands still.
STANDSTILL = 0.3
#: While a node may move its robot, it looks at the clock when no message came for this long. It is
#: half the shortest timeout.
QUIET_TIME = 0.1
#: After this silence the node looks at the clock with this period, until the next message.
CHECK_PERIOD = 0.02
#: A node that does not drive looks at the clock if no message came for this long, to find a sleep.
IDLE_PERIOD = 0.2


class Freshness:
    """Remembers when the last message of one source arrived."""

    def __init__(self, name: str, timeout: float = SENSOR_TIMEOUT) -> None:
        self.name = name
        self.timeout = timeout
        #: Number of valid messages so far.
        self.count = 0
        self._received_at: Optional[float] = None

    def received(self, now: float) -> float:
        """Take in a valid message. Returns the silence before it [s]."""
        silence, self._received_at = self.age(now), now
        self.count += 1
        return silence

    def age(self, now: float) -> float:
        """Returns the time since the last message; infinite before the first."""
        age = math.inf if self._received_at is None else now - self._received_at
        return age if age > 0.0 else 0.0

    def is_fresh(self, now: float) -> bool:
        """True while the last message is at most `timeout` old."""
        return self.age(now) <= self.timeout

    @property
    def silence(self) -> str:
        """The text for a source that is not fresh: 'no imu', or 'no imu yet'."""
        return f'no {self.name} yet' if self._received_at is None else f'no {self.name}'

    def silence_with_age(self, now: float) -> str:
        """Returns the text of `silence` with its duration: 'no imu for 1.2 s'."""
        age = self.age(now)
        return self.silence if math.isinf(age) else f'{self.silence} for {age:.1f} s'


class SleepWatch:
    """Did this process sleep? Looks at the clock for one node."""

    def __init__(self) -> None:
        #: Length of the sleep that the last update found [s]; 0 if it found none.
        self.slept_for = 0.0
        #: True if arriving messages may be as old as a sleep. Then only a stop is obeyed.
        self.is_waking = False
        #: The end of the last sleep [s].
        self.woke_at = -math.inf
        self._looks = Freshness('look at the clock', LONGEST_GAP)

    def update(self, now: float) -> None:
        """Look at the clock. Call this several times a second, and before a message is used."""
        gap = self._looks.received(now)
        self.slept_for = gap if LONGEST_GAP < gap < math.inf else 0.0
        if self.slept_for:
            self.woke_at = now
        self.is_waking = now - self.woke_at < WAKING

    def start(self, now: float) -> None:
        """Ignore the time until now."""
        self.slept_for, self.is_waking, self.woke_at = 0.0, False, -math.inf
        self._looks.received(now)

    @property
    def doubt(self) -> str:
        """The reason why a request that moves the robot, or its frame, is ignored now; or ''."""
        return 'it may have been asked for while this node did not run' if self.is_waking else ''

    def as_text(self) -> str:
        """Returns the sleep that the last update found: '' or 'this node did not run for 3.2 s'."""
        return f'this node did not run for {self.slept_for:.1f} s' if self.slept_for else ''


class Lateness:
    """The delay of a single message beyond the usual delay of its sender. The usual delay is the
    least delay in the last `DELAY_WINDOW` seconds for which the sender was heard. If the sender's
    clock was set, or runs faster, its new time is used after `DELAY_WINDOW` seconds.
    """

    def __init__(self) -> None:
        self._least = Least()
        self._received_for = 0.0
        self._last = Freshness('the sender')

    def of(self, stamp: float, arrival: float) -> float:
        """Returns the extra delay [s] of a message of this stamp [sender's clock] and arrival."""
        self._received_for += min(self._last.received(arrival), RECEIVED_BEFORE)
        self._least.add(self._received_for, arrival - stamp)
        assert self._least.value is not None
        return arrival - stamp - self._least.value


class Least:
    """The least of the values of the last `DELAY_WINDOW` seconds."""

    def __init__(self) -> None:
        #: (time, value); each value is less than all after it.
        self._candidates: Deque[Tuple[float, float]] = deque()
        #: None before the first value.
        self.value: Optional[float] = None

    def add(self, time: float, value: float) -> None:
        """Take in a value. A `time` before the latest one is treated as the latest one."""
        candidates = self._candidates
        while candidates and candidates[-1][1] >= value:
            candidates.pop()
        candidates.append((time, value))
        while candidates[0][0] < time - DELAY_WINDOW:
            candidates.popleft()
        self.value = candidates[0][1]
