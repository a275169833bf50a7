"""The words of one pad on `ctrl_relinq`: True gives the robot to move_to_goal, False takes it.

Units: seconds on a clock that never stands still and never goes back (`now`).
"""
import math
from typing import List

from tb3_labs.supervision.permission import LONGEST_LAPSE, RENEWAL

#: An answer of move_to_goal this soon after A may be older than A [s].
CROSSING = 0.3


class ControlWords:
    """Collects the words until the node takes them, since every press counts.

    The first word is False: a pad that has just started gives nothing.
    """

    def __init__(self) -> None:
        #: Has move_to_goal control by this pad's permission, which must be renewed?
        self.gives = False
        self._waiting = [False]
        self._given_at = -math.inf      # if move_to_goal has not answered since
        self._stopped_at = -math.inf    # time at which control was taken from move_to_goal

    def take(self) -> List[bool]:
        """The words since the last call, in order."""
        words, self._waiting = self._waiting, []
        return words

    def give(self, now: float, lateness: float) -> None:
        """True, by a press that was delayed by `lateness` [s].

        The renewals that were due since the press are added, so that they show its age.
        """
        self.gives, self._given_at = True, now
        self._waiting += [True] * (1 + int(lateness / RENEWAL))

    def stop(self, caused_at: float) -> None:
        """False, for any holder of control: the operator's press at `caused_at`, or the pad's loss.
        """
        self.gives = False
        self._stopped_at = max(self._stopped_at, caused_at)    # a late B is older than a loss
        self._waiting.append(False)

    def end(self) -> None:
        """False, if this pad gave control, and another node took it."""
        if self.gives:
            self.gives = False
            self._waiting.append(False)

    def stopped_by_others(self, now: float) -> None:
        """Another node took control from move_to_goal."""
        self._stopped_at = now

    def move_to_goal_has_control(self) -> None:
        """move_to_goal says that it has control, so it has heard the True."""
        self._given_at = -math.inf

    def crossed(self, now: float) -> bool:
        """May move_to_goal have said that it has no control before it heard of A?"""
        return now - self._given_at < CROSSING

    def too_late(self, now: float, lateness: float) -> bool:
        """Does a press of A that was delayed by `lateness` [s] no longer count?

        It is too old, or control was taken since.
        """
        return lateness > LONGEST_LAPSE or now - lateness < self._stopped_at
