"""Decides if the pose of a request is valid, if a goal is accepted, and which goal is canceled.

Each goal replaces the previous goal, even a goal of another sender. A sender may repeat a goal
(:mod:`tb3_labs.supervision.events`), perhaps with another stamp. The rules:

1. A cancel with a name ends the goal with this name. A cancel with a stamp ends all goals whose
   stamp is not later. A cancel without name and stamp ends every goal.
2. If a repeated goal was canceled or given up, its later repetitions are refused.
3. A repetition of the current goal changes nothing.
"""
import math
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple, Optional

from tb3_labs.config import Config, setting
from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.supervision.events import Queue, SenderRequest, SenderRequests
from tb3_labs.supervision.timeouts import MAX_REPEAT_GAP, SleepMonitor

#: The largest coordinate [m] that a person may type. A larger number is probably in a wrong unit.
MAX_COORDINATE = 100.0
MAX_YAW_DEG = 360.0     # the largest heading [deg] that a person may type
#: A goal with this stamp [ns] is older than every goal that a sender has stamped.
EARLIEST_STAMP = 1
STAYS_ENDED = ('its sender repeats it since before it was ended: change it, or pause for '
               f'{MAX_REPEAT_GAP:.0f} s')


@dataclass(frozen=True)
class TypedPose(Config):
    """A pose in the local frame that a person types, with the heading in degrees."""

    x: float = setting(0.0, 'in the local frame', 'm', -MAX_COORDINATE, MAX_COORDINATE)
    y: float = setting(0.0, 'in the local frame', 'm', -MAX_COORDINATE, MAX_COORDINATE)
    yaw_deg: float = setting(0.0, 'heading', 'deg', -MAX_YAW_DEG, MAX_YAW_DEG)

    @property
    def pose(self) -> Pose2:
        return Pose2(self.x, self.y, wrap(math.radians(self.yaw_deg)))


@dataclass(frozen=True)
class RequestedPose:
    """The pose of a goal or a reset, in ``local`` or in ``odom``."""

    pose: Pose2
    is_in_odom: bool = False

    def to_local(self, odom_T_local: Optional[Pose2]) -> Pose2:
        """Returns this pose in ``local``. Raises ``ValueError`` if there is no local frame, or if
        the pose is too far away."""
        pose = self.pose
        if self.is_in_odom:
            if odom_T_local is None:
                raise ValueError('no local frame now: nothing was heard from imu and odom, or the '
                                 'pose is lost; give the pose in local')
            pose = odom_T_local.inverse() @ pose
        place = TypedPose(float(pose.x), float(pose.y))    # a Config refuses numpy's floats
        return Pose2(place.x, place.y, pose.yaw)


class GoalRequest(NamedTuple):
    goal: Optional[RequestedPose]    # None for the goal in the node's parameters
    sender: str = ''
    name: str = ''        # name in the GoalID, or ''
    stamp: int = 0        # stamp in the GoalID [ns, sender's clock], or 0
    client: Any = None    # the node sends the GoalAnswers to this client

    def is_canceled_by(self, name: str, stamp: int) -> bool:
        """Returns True if a cancel with this `name` and `stamp` [ns] ends this goal."""
        if 0 < self.stamp <= stamp:
            return True
        if name:
            return self.name == name
        return not stamp    # a cancel without name and stamp ends every goal


class GoalOutcome(Enum):
    """The decision about a goal, or the end of a goal."""

    ACCEPTED = 'accepted'
    REJECTED = 'rejected'
    REACHED = 'reached'
    GIVEN_UP = 'given up'
    CANCELED = 'canceled'


class GoalAnswer(NamedTuple):
    request: GoalRequest
    outcome: GoalOutcome
    text: str


class GoalRequests:
    """The current goal, and the latest goal of each sender."""

    def __init__(self, sleep: SleepMonitor) -> None:
        # a cancel with any stamp ends the first goal, which comes from the node's parameters
        self.current_request = GoalRequest(None, stamp=EARLIEST_STAMP)
        self._open_request: Optional[GoalRequest] = None    # a goal whose client waits for its end
        self.answers: Queue[GoalAnswer] = Queue()
        self._sleep = sleep
        self._sender_goals = SenderRequests(sleep)

    def on_goal(self, request: GoalRequest, now: float) -> SenderRequest:
        """Store the latest goal of a sender. Call this even for a refused goal."""
        sender_request = self._sender_goals.on_request(request.sender, request.goal, now)
        sender_request.message = request
        return sender_request

    def pose_of(self, request: GoalRequest, sender_request: SenderRequest,
                odom_T_local: Optional[Pose2]) -> Pose2:
        """Returns the goal's pose in ``local``. Raises ``ValueError`` to refuse the goal."""
        if self._sleep.reason_to_refuse:
            raise ValueError(self._sleep.reason_to_refuse + ': send it again')
        if sender_request.is_ended:
            raise ValueError(STAYS_ENDED)
        assert request.goal is not None
        return request.goal.to_local(odom_T_local)

    def repeats_current(self, sender_request: SenderRequest) -> bool:
        return sender_request.is_repeated and self._is_current(sender_request)

    def accept(self, request: GoalRequest) -> None:
        """Make `request` the current goal. Cancel the previous goal."""
        self.answer_client(GoalOutcome.CANCELED, 'replaced by a newer goal')
        self.answers.append(GoalAnswer(request, GoalOutcome.ACCEPTED, 'driving'))
        self.current_request = request
        self._open_request = request

    def refuse(self, request: GoalRequest, reason: str) -> None:
        self.answers.append(GoalAnswer(request, GoalOutcome.REJECTED, reason))

    def answer_client(self, outcome: GoalOutcome, text: str) -> None:
        """Answer the client of the current goal, if this client still waits."""
        if self._open_request is not None:
            self.answers.append(GoalAnswer(self._open_request, outcome, text))
            self._open_request = None

    def end_repetitions(self) -> None:
        """From now on, refuse repetitions of the current goal."""
        self._sender_goals.end_repetitions(self._is_current)

    def cancel(self, name: str = '', stamp: int = 0) -> bool:
        """Refuse repetitions of all goals that a cancel with this `name` and `stamp` [ns] ends.
        Returns True if the cancel ends the current goal."""
        def is_canceled(sender_request: SenderRequest) -> bool:
            return sender_request.message.is_canceled_by(name, stamp)
        self._sender_goals.end_repetitions(is_canceled)
        if not self.current_request.is_canceled_by(name, stamp):
            return False
        self.end_repetitions()
        return True

    def _is_current(self, sender_request: SenderRequest) -> bool:
        current = self.current_request
        return sender_request is self._sender_goals.find(current.sender, current.goal)
