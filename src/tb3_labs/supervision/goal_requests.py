"""Is a goal accepted, and which goal does a cancel end?

Each goal replaces the goal before it, whoever sent it. A sender *repeats* a goal when it sends the
goal again within `SENDER_PAUSE`, unchanged but for its stamp. The rules:

* A cancel ends the goal that it names, or each goal up to its stamp, or every goal.
* A goal that its sender had sent twice or more when a cancel ended it stays ended, until the sender
  changes it, or pauses. A goal that a person sends once again is accepted at once.
* The same holds when the drive to a repeated goal was given up: a repetition is not a new request.
* A repetition during the drive to this goal, or during the wait for sensors, changes nothing.

Units: seconds on a clock that never stands still and never goes back (`now`). Edge cases: a sleep
of this process is not a pause of a sender. A delay of `SENDER_PAUSE` on the network is a pause.
"""
from enum import Enum
from typing import Any, Dict, List, NamedTuple, Optional

from tb3_labs.supervision.timeouts import SENDER_PAUSE, Freshness, SleepWatch

#: The text of a goal that is rejected because its sender repeats it.
STAYS_ENDED = 'its sender repeats it since before it was ended'


class GoalRequest(NamedTuple):
    """A goal as it arrived."""

    goal: Any             # a pose and its frame; equal for goals that are unchanged
    sender: str = ''
    name: str = ''        # the GoalID's name; '' if it has none
    stamp: int = 0        # the GoalID's stamp [ns, sender's clock]; 0 if it has none
    client: Any = None    # the client gets the GoalAnswers

    def is_named_by(self, name: str, stamp: int) -> bool:
        """Does a cancel with this name and stamp mean this goal?"""
        if 0 < self.stamp <= stamp:
            return True
        return self.name == name if name else not stamp


class GoalOutcome(Enum):
    """The fate of a goal."""

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


class _Repetition:
    """One sender's unchanged goals without a pause between them."""

    def __init__(self, request: GoalRequest) -> None:
        self.goal, self.latest = request.goal, request
        self.source = Freshness('goal', SENDER_PAUSE)
        self.is_repeated = self.is_ended = self.was_logged = False

    def end(self) -> None:
        self.is_ended = self.is_ended or self.is_repeated


class GoalRequests:
    """The present goal, and the latest goal of each sender."""

    def __init__(self, present: GoalRequest, sleep: SleepWatch) -> None:
        #: The request of the goal that was accepted last.
        self.present = present
        self._sleep = sleep
        self._open: Optional[GoalRequest] = None    # its client waits for its end
        self._answers: List[GoalAnswer] = []
        self._repetitions: Dict[str, _Repetition] = {}    # by sender

    def note(self, request: GoalRequest, now: float) -> None:
        """Take in a goal. Call this for each goal, also for a goal that is refused."""
        self._forget(now)
        repetition = self._repetition_of(request)
        if repetition is None:
            repetition = self._repetitions[request.sender] = _Repetition(request)
        else:
            repetition.is_repeated, repetition.latest = True, request
        repetition.source.received(now)

    def stays_ended(self, request: GoalRequest) -> bool:
        """Does a goal that was just heard repeat a goal that was ended?"""
        repetition = self._repetition_of(request)
        return repetition is not None and repetition.is_ended

    def refusal_line(self, request: GoalRequest) -> str:
        """Returns the line for a goal that stays ended; '' after the first time."""
        repetition = self._repetition_of(request)
        if repetition is None or repetition.was_logged:
            return ''
        repetition.was_logged = True
        return (f'The goal that {request.sender or "a program"} repeats stays ended: it counts '
                f'again if it is changed, or after a pause of {SENDER_PAUSE:.0f} s')

    def is_repeated(self, request: GoalRequest) -> bool:
        """Does a goal that was just heard repeat the present goal?"""
        repetition = self._repetition_of(request)
        return repetition is not None and repetition.is_repeated and (
            repetition is self._repetition_of(self.present))

    def accept(self, request: GoalRequest) -> None:
        """Drive to the goal of `request` from now on."""
        self.end(GoalOutcome.CANCELED, 'replaced by a newer goal')
        self._answers.append(GoalAnswer(request, GoalOutcome.ACCEPTED, 'driving'))
        self.present = self._open = request

    def refuse(self, request: GoalRequest, reason: str) -> None:
        """Reject `request` with an answer to its client."""
        self._answers.append(GoalAnswer(request, GoalOutcome.REJECTED, reason))

    def end(self, outcome: GoalOutcome, text: str) -> None:
        """Answer the client of a drive that has ended, once."""
        if self._open is not None:
            self._answers.append(GoalAnswer(self._open, outcome, text))
            self._open = None

    def pop_answers(self) -> List[GoalAnswer]:
        """Returns the answers since the last call, in order."""
        answers, self._answers = self._answers, []
        return answers

    def give_up(self, now: float) -> None:
        """Give up the present goal: a repetition does not start it again."""
        self._forget(now)
        repetition = self._repetition_of(self.present)
        if repetition is not None:
            repetition.end()

    def cancel(self, now: float, name: str = '', stamp: int = 0) -> bool:
        """Take in a cancel. Returns True if it ends the present goal."""
        self._forget(now)
        for repetition in self._repetitions.values():
            if repetition.latest.is_named_by(name, stamp):
                repetition.end()
        is_named_by = self.present.is_named_by(name, stamp)
        if is_named_by:
            self.give_up(now)
        return is_named_by

    def _repetition_of(self, request: GoalRequest) -> Optional[_Repetition]:
        repetition = self._repetitions.get(request.sender)
        return repetition if repetition is not None and repetition.goal == request.goal else None

    def _forget(self, now: float) -> None:
        just_woke = now - self._sleep.woke_at <= SENDER_PAUSE
        self._repetitions = {sender: each for sender, each in self._repetitions.items()
                             if just_woke or each.source.is_fresh(now)}
