"""All limits of silences, delays, sleeps and motions without progress, for the nodes that drive.

`Freshness` finds a silent source by the arrival times of its messages. `Lateness` finds a delayed
message by its stamp. `SleepMonitor` finds a time in which this process slept: it was stopped or
swapped out, or its computer was suspended.

Units: seconds on the receiver's clock (`now`). Edge cases: A source without messages has an
infinite age. If the clock goes back, the age of the latest message is 0.
"""
import math
from collections import deque
from typing import Deque, Optional, Tuple

#: A motion does not continue by itself after a silence or a sleep that is longer than this. A grant
#: that the network delays for longer than this is ignored.
RESUME_TIME = 2.0

# -- a sensor, a pad or a mouse is silent

SENSOR_TIMEOUT = 0.22    # a sensor is lost after this silence, in which a fast robot drives 5 cm
#: A sensor is frozen if it repeats a reading for longer than this while the robot must move.
FROZEN_TIME = 0.6
ROBOT_START_TIMEOUT = 20.0    # nodes wait this long for a robot, whose board starts in up to 14 s
#: If a person types a turn before the robot is connected, the turn waits this long for the robot.
ROBOT_WAIT_TIMEOUT = 5.0
RESET_SILENCE = 1.0     # a reset silences the board for longer than this; it takes 2.6 s
INPUT_TIMEOUT = 0.25    # a pad, a page that drives or an active mouse is lost after this silence
#: If the robot is silent for longer than this, it may have started again with another clock.
LONG_SILENCE = 1.5
LONGEST_COUNTED_SILENCE = 5.0    # after a longer silence, no larger step of the odometry is allowed

# -- two samples are too far apart to be compared

MAX_GYRO_GAP = 0.15           # in a longer gap, the rate of turn may differ from both samples
MAX_WHEEL_GAP = 0.08          # in a longer gap, the rate of a moving wheel may change
MAX_INTERPOLATED_GAP = 0.3    # in a longer gap, the robot may not move evenly
#: The odometry replaces the IMU in a gap up to this length. No robot makes half a turn so quickly.
MAX_BRIDGED_GAP = 1.0

# -- a message is late, or repeats an earlier one

DELAY_WINDOW = 5.0    # the least delay is the delay of the fastest message within this time
#: `Lateness` counts a longer silence of a sender as a silence of this length.
MAX_RECEIVED_STEP = 0.1
MAX_SAMPLE_AGE = 0.1    # an older sample shows that the network has stalled
#: A message that arrives within this time after an event may have been sent before the event. An
#: event is a button press, a sleep, a node's start, or a pad's first message.
MAX_TRANSIT_TIME = 0.3
HAND_BACK_TIME = 0.15    # a pad that takes the robot back first waits until move_to_goal stops

# -- a person's permission

RENEWAL_PERIOD = 0.1
RENEWAL_TIMEOUT = 0.5    # after this time without a renewal, a grant is suspended
#: A reset that was requested longer ago than this is refused, because the robot may have moved.
MAX_RESET_AGE = 1.0
#: A sender that repeats a message sends it again within this time. If a sender was silent for
#: longer than this, its next message is a new request.
MAX_REPEAT_GAP = 2.0

# -- a motion makes no progress

#: The robot is stalled if commands to move bring it no nearer to its goal for this time.
STALL_TIME = 1.3
MAX_REST_TIME = 4.0    # a motion fails if its command is 0 for longer in one state

# -- this process sleeps, or its clock stands still

MIN_SLEEP_TIME = 1.0     # a longer time between two looks at the clock counts as a sleep
STANDSTILL_TIME = 0.3    # a simulated clock stands still if it does not change for this time
#: A node that may move its robot looks at the clock after this time without a message.
QUIET_TIME = 0.1
#: After QUIET_TIME, a node looks at the clock with this period until the next message.
CHECK_PERIOD = 0.02
#: If a node does not drive, it looks at the clock after a silence of this length, to find a sleep.
IDLE_PERIOD = 0.2


class Freshness:
    """Remembers when the latest message of one source arrived."""

    def __init__(self, name: str, timeout: float = SENSOR_TIMEOUT) -> None:
        self.name = name
        self.timeout = timeout
        self.count = 0    # number of valid messages so far
        self._received_at: Optional[float] = None

    def on_message(self, now: float) -> float:
        """Store the arrival of a valid message. Returns the silence [s] before this message."""
        silence = self.age(now)
        self._received_at = now
        self.count += 1
        return silence

    def age(self, now: float) -> float:
        """Returns the time [s] since the latest message; infinite before the first message."""
        if self._received_at is None:
            return math.inf
        return max(0.0, now - self._received_at)

    def is_fresh(self, now: float) -> bool:
        return self.age(now) <= self.timeout

    def silence_text(self, now: Optional[float] = None) -> str:
        """Returns a text such as 'no imu yet' or 'no imu', and with `now` 'no imu for 1.2 s'."""
        if self._received_at is None:
            return f'no {self.name} yet'
        return f'no {self.name}' if now is None else f'no {self.name} for {self.age(now):.1f} s'


class SleepMonitor:
    """Finds a sleep of this process, which is a long time between two looks at the clock."""

    def __init__(self) -> None:
        self.start(math.nan)

    def start(self, now: float) -> None:
        """Begin to watch the clock at `now`. Sleeps before `now` are forgotten."""
        self.slept_for = 0.0    # length [s] of the sleep that the latest update found, or 0
        #: True just after a sleep. Messages may then be old, so only stops are obeyed.
        self.is_waking = False
        self.woke_at = -math.inf    # time [s] at which the latest sleep ended
        self._looked_at = now       # time [s] of the latest look at the clock; NaN before the first

    def update(self, now: float) -> None:
        """Look at the clock. Call this several times a second, and before a message is used."""
        gap = now - self._looked_at
        self._looked_at = now
        self.slept_for = 0.0
        if gap > MIN_SLEEP_TIME:    # False for NaN
            self.slept_for = gap
            self.woke_at = now
        self.is_waking = now - self.woke_at < MAX_TRANSIT_TIME

    @property
    def reason_to_refuse(self) -> str:
        """The reason why a motion or a reset is refused now, or ''."""
        return 'it may have been asked for while this node did not run' if self.is_waking else ''

    def as_text(self) -> str:
        """Returns 'this node did not run for 3.2 s' if the latest update found a sleep, else ''."""
        return f'this node did not run for {self.slept_for:.1f} s' if self.slept_for else ''


class Lateness:
    """Finds the extra delay of a message, beyond the usual delay of its sender. The usual delay is
    the least delay in the latest `DELAY_WINDOW` seconds in which the sender sent messages."""

    def __init__(self) -> None:
        self._least_delay = WindowMinimum()
        self._received_for = 0.0    # time [s] in which the sender sent messages
        self._sender = Freshness('the sender')

    def on_message(self, stamp: float, arrival: float) -> float:
        """Returns the extra delay [s] of a message. `stamp` is on the sender's clock [s]; 0 for a
        message without a stamp, whose extra delay is 0."""
        if stamp <= 0.0:
            return 0.0
        silence = self._sender.on_message(arrival)
        self._received_for += min(silence, MAX_RECEIVED_STEP)
        self._least_delay.add(self._received_for, arrival - stamp)
        assert self._least_delay.value is not None
        return arrival - stamp - self._least_delay.value


class WindowMinimum:
    """The least value of the latest `DELAY_WINDOW` seconds."""

    def __init__(self) -> None:
        #: The (time, value) pairs that are or may become the least, in order of time and of value.
        self._candidates: Deque[Tuple[float, float]] = deque()
        self.value: Optional[float] = None    # the least value; None before the first value

    def add(self, time: float, value: float) -> None:
        """Add a value and drop the old values. If `time` goes back, old values are kept longer."""
        candidates = self._candidates
        while candidates and candidates[-1][1] >= value:
            candidates.pop()
        candidates.append((time, value))
        while candidates[0][0] < time - DELAY_WINDOW:
            candidates.popleft()
        self.value = candidates[0][1]
