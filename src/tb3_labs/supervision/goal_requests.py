"""Is the pose of a request valid? Is a goal accepted, and which goal does a cancel end?

Each goal replaces the previous goal, even a goal of another sender. A sender *repeats* a goal if it
sends the goal again within `SENDER_PAUSE`, perhaps with another stamp. The rules:

* A cancel ends the goal with the cancel's name, or all goals up to the cancel's stamp, or every
  goal.
* A repeated goal that was canceled or given up stays ended until the sender changes the goal, or
  pauses. If a goal was sent only once before its end, it is accepted again at once.
* A repetition of the present goal changes nothing.

Units: seconds on a clock that never stands still or goes back (`now`). Edge cases: A sleep of this
process is not a pause of a sender. A delay of `SENDER_PAUSE` on the network looks like a pause.
"""
import math
from dataclasses import dataclass
from enum import Enum
from typing import Any, Dict, NamedTuple, Optional

from tb3_labs.config import Config, setting
from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.supervision.events import Queue
from tb3_labs.supervision.timeouts import SENDER_PAUSE, Freshness, SleepMonitor

#: A typed coordinate is at most this far from 0, since a larger number may have a wrong unit [m].
MAX_DISTANCE = 100.0
MAX_YAW_DEG = 360.0     # a typed heading is at most a whole turn [deg]
#: The reason for rejecting a repeated goal that was ended before.
STAYS_ENDED = ('its sender repeats it since before it was ended: change it, or pause for '
               f'{SENDER_PAUSE:.0f} s')


@dataclass(frozen=True)
class TypedPose(Config):
    """A pose in the local frame that a person types, with the heading in degrees."""

    x: float = setting(0.0, 'in the local frame', 'm', -MAX_DISTANCE, MAX_DISTANCE)
    y: float = setting(0.0, 'in the local frame', 'm', -MAX_DISTANCE, MAX_DISTANCE)
    yaw_deg: float = setting(0.0, 'heading', 'deg', -MAX_YAW_DEG, MAX_YAW_DEG)

    @property
    def pose(self) -> Pose2:
        return Pose2(self.x, self.y, wrap(math.radians(self.yaw_deg)))


@dataclass(frozen=True)
class RequestedPose:
    """The pose of a goal or a reset, in ``local`` or in ``odom``, as its sender chose."""

    pose: Pose2
    in_odom: bool = False

    def in_local(self, odom_T_local: Optional[Pose2]) -> Pose2:
        """Returns this pose in ``local``. Raises ``ValueError`` if there is no local frame, or if
        the pose is too far away."""
        pose = self.pose
        if self.in_odom:
            if odom_T_local is None:
                raise ValueError('no local frame now: nothing was heard from imu and odom, or the '
                                 'pose is lost; give the pose in local')
            pose = odom_T_local.inverse() @ pose
        TypedPose(float(pose.x), float(pose.y))     # raises the error; it takes no float of numpy
        return pose


class GoalRequest(NamedTuple):
    """A goal as received."""

    goal: Any             # a pose and its frame
    sender: str = ''
    name: str = ''        # name in the GoalID, or ''
    stamp: int = 0        # stamp in the GoalID [ns, sender's clock], or 0
    client: Any = None    # receives the GoalAnswers

    def is_named_by(self, name: str, stamp: int) -> bool:
        """Does a cancel with this name and stamp [ns] mean this goal?"""
        if 0 < self.stamp <= stamp:
            return True
        if name:
            return self.name == name
        return not stamp    # a cancel without name and stamp means every goal


class GoalOutcome(Enum):
    """The decision about a goal, or the end of a goal."""

    ACCEPTED = 'accepted'
    REJECTED = 'rejected'
    REACHED = 'reached'
    GIVEN_UP = 'given up'
    CANCELED = 'canceled'


class GoalAnswer(NamedTuple):
    """An answer to the client of a goal."""

    request: GoalRequest
    outcome: GoalOutcome
    text: str


class SenderGoal:
    """The latest goal of one sender, and its repetitions since the last pause."""

    def __init__(self, request: GoalRequest) -> None:
        self.goal = request.goal
        self.latest = request
        self.source = Freshness('goal', SENDER_PAUSE)
        self.is_repeated = False    # was the goal sent more than once?
        self.is_ended = False       # does a repetition of the goal stay ended?

    def end(self) -> None:
        """End the repetitions of a goal that was canceled or given up."""
        if self.is_repeated:
            self.is_ended = True


class GoalRequests:
    """The present goal, and the latest goal of each sender."""

    def __init__(self, present: GoalRequest, sleep: SleepMonitor) -> None:
        #: The request of the goal that was accepted last.
        self.present = present
        self._sleep = sleep
        self._open: Optional[GoalRequest] = None    # the goal whose client waits for an answer
        #: The answers to the clients of goals, in order.
        self.answers: Queue[GoalAnswer] = Queue()
        self._sender_goals: Dict[str, SenderGoal] = {}    # by sender

    def note(self, request: GoalRequest, now: float) -> SenderGoal:
        """Take in a goal that arrives. Call this for each goal, even if it is then refused."""
        self._forget(now)
        sender_goal = self._sender_goal_of(request)
        if sender_goal is None:
            sender_goal = SenderGoal(request)
            self._sender_goals[request.sender] = sender_goal
        else:
            sender_goal.is_repeated = True
            sender_goal.latest = request
        sender_goal.source.received(now)
        return sender_goal

    def repeats_present(self, sender_goal: SenderGoal) -> bool:
        """Does the sender repeat the present goal?"""
        return sender_goal.is_repeated and sender_goal is self._sender_goal_of(self.present)

    def accept(self, request: GoalRequest) -> None:
        """Make `request` the present goal. Cancel the previous goal."""
        self.end(GoalOutcome.CANCELED, 'replaced by a newer goal')
        self.answers.append(GoalAnswer(request, GoalOutcome.ACCEPTED, 'driving'))
        self.present = request
        self._open = request

    def refuse(self, request: GoalRequest, reason: str) -> None:
        """Answer the client of `request` that the goal is rejected."""
        self.answers.append(GoalAnswer(request, GoalOutcome.REJECTED, reason))

    def end(self, outcome: GoalOutcome, text: str) -> None:
        """Answer the client of the present goal, if this client still waits."""
        if self._open is not None:
            self.answers.append(GoalAnswer(self._open, outcome, text))
            self._open = None

    def give_up(self, now: float) -> None:
        """Give up the present goal. A repetition does not start the drive again."""
        self._forget(now)
        sender_goal = self._sender_goal_of(self.present)
        if sender_goal is not None:
            sender_goal.end()

    def cancel(self, now: float, name: str = '', stamp: int = 0) -> bool:
        """Take in a cancel. Returns True if the cancel ends the present goal."""
        self._forget(now)
        for sender_goal in self._sender_goals.values():
            if sender_goal.latest.is_named_by(name, stamp):
                sender_goal.end()
        if not self.present.is_named_by(name, stamp):
            return False
        self.give_up(now)
        return True

    def _sender_goal_of(self, request: GoalRequest) -> Optional[SenderGoal]:
        sender_goal = self._sender_goals.get(request.sender)
        if sender_goal is None or sender_goal.goal != request.goal:
            return None
        return sender_goal

    def _forget(self, now: float) -> None:
        just_woke = now - self._sleep.woke_at <= SENDER_PAUSE
        self._sender_goals = {sender: goal for sender, goal in self._sender_goals.items()
                              if just_woke or goal.source.is_fresh(now)}
