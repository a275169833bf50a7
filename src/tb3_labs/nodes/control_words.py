"""The words of one pad on `ctrl_relinq`: True gives the robot to move_to_goal, False takes it.

Units: seconds on a clock that never stands still and never goes back (`now`).
"""
import math
from typing import List

from tb3_labs.supervision.permission import LONGEST_LAPSE, RENEWAL

#: An answer of move_to_goal this soon after A may be older than A [s].
CROSSING = 0.3


class ControlWords:
    """Every press counts, so the words are collected until the node takes them.

    The first word is False: a pad that has just started gives nothing.
    """

    def __init__(self) -> None:
        #: Has move_to_goal control by this pad's permission, which must be renewed?
        self.gives = False
        self._waiting = [False]
        self._given_at = -math.inf      # and move_to_goal has not been heard since
        self._stopped_at = -math.inf    # when somebody took control from move_to_goal

    def take(self) -> List[bool]:
        """The words since the last call, in order."""
        words, self._waiting = self._waiting, []
        return words

    def give(self, now: float, lateness: float) -> None:
        """True, by a press that was held up for `lateness` [s].

        With the renewals that it would have sent since the press: so its age shows.
        """
        self.gives, self._given_at = True, now
        self._waiting += [True] * (1 + int(lateness / RENEWAL))

    def stop(self, caused_at: float) -> None:
        """False, whoever has control: the operator's press at `caused_at`, or the loss of the pad.
        """
        self.gives, self._stopped_at = False, caused_at
        self._waiting.append(False)

    def end(self) -> None:
        """Somebody else took what this pad gave, if it gave: False."""
        if self.gives:
            self.gives = False
            self._waiting.append(False)

    def stopped_by_others(self, now: float) -> None:
        """Somebody else took control from move_to_goal."""
        self._stopped_at = now

    def move_to_goal_has_control(self) -> None:
        """move_to_goal says so: it has heard of what was given."""
        self._given_at = -math.inf

    def crossed(self, now: float) -> bool:
        """May move_to_goal, which says now that it has no control, not yet have heard of A?"""
        return now - self._given_at < CROSSING

    def too_late(self, now: float, lateness: float) -> bool:
        """Does a press of A that was held up for `lateness` [s] no longer count?

        It is too old, or somebody took control since.
        """
        return lateness > LONGEST_LAPSE or now - lateness < self._stopped_at
