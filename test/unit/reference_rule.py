"""Who may move the robot? The rules know the acts of persons, and share no code with the nodes.

The rule: after a person's stop no command but zero, until a person's next grant. A message that is repeated, renewed or
late, and a node that wakes up or restarts, give nothing.

Units: seconds; `at` is the time of a person's action, `now` the time at which a node hears of it.
"""
import math

#: Actions that are nearer in time have no order [s]: a renewal has its grant's age in tenths.
SAME_TIME = 0.15
#: If a sender that renews is silent for longer than the first, the robot must stand; after the second its grant is
#: void. A grant that took longer to arrive was never accepted [s].
SUSPENDED, OVER = 0.6, 2.1
#: A grant or goal is void if the robot does not come within the first; within the second if it was never there. Before
#: a motion, gyro and wheels must have been compared at rest for the third [s].
ROBOT, FIRST_ROBOT, COMPARED = 2.1, 20.1, 0.9
#: A pad that is silent for this long is lost [s].
LOST = 0.3


class GoalRule:
    """Judges move_to_goal. Its start is a stop."""

    def __init__(self, now):
        self.grants = {}            # sender: time of its last renewal; None: it does not renew
        self.stopped_at = now        # the person's last stop
        self.cancelled_at = None     # None: the goal was not cancelled
        # A sender, or 'goal': when it was asked for, or when the goal had its robot last. Missing: a
        # grant that had its robot, or a goal that is void.
        self.awaits = {'goal': now}
        self.robot_at = None         # when the robot was there; None: it was never there

    def hear(self, now, sender, word, at=None, renews=False):
        """A True or False arrives; `at` is None if no person sent it."""
        if now - (self.grants.get(sender) or now) > OVER:
            del self.grants[sender]
        if not word:
            self.grants = {}
            self.stopped_at = max(self.stopped_at, now if at is None else at)
        elif sender in self.grants or (
                at is not None and at > self.stopped_at - SAME_TIME and now - at <= OVER):
            if sender not in self.grants:
                self.ask(now, sender)
                self.ask(now, 'goal')
            self.grants[sender] = now if renews else None

    def ask(self, now, what):
        """A person asks for a motion, which needs the robot."""
        if what == 'goal' or self.robot_at is None or now - self.robot_at > LOST:
            self.awaits[what] = now

    def look(self, now, is_there):
        """To be called in each moment: do the sensors' messages arrive?"""
        patience = FIRST_ROBOT if self.robot_at is None else ROBOT
        for what in [what for what, since in self.awaits.items() if now - since > patience]:
            del self.awaits[what]
            self.grants.pop(what, None)
        if is_there:
            self.robot_at = now
            self.awaits = {'goal': now} if 'goal' in self.awaits else {}

    def cancel(self, at):
        self.cancelled_at = at

    def goal(self, now, at):
        """The robot must now drive to a goal that was sent at `at`."""
        if (self.cancelled_at is None or at > self.cancelled_at - SAME_TIME) and now - at <= OVER:
            self.cancelled_at = None
            self.ask(now, 'goal')

    def slept(self, now):
        """The node did not run for too long, which is a stop."""
        self.grants, self.stopped_at = {}, now

    def objection(self, now):
        """Returns the reason why the robot must not be driven, or ''."""
        if self.cancelled_at is not None:
            return 'its goal was cancelled'
        if 'goal' not in self.awaits:
            return 'the robot was not there for so long that its goal is void'
        if not self.grants:
            return 'nobody gave it since the last stop'
        if all(heard is not None and now - heard > SUSPENDED for heard in self.grants.values()):
            return 'all who gave it have fallen silent'
        return ''


class HandRule:
    """Judges what is driven by a stick: it must be there, and have rested since it was lost, or since the node slept
    or started."""

    def __init__(self, now):
        self.heard_at = now          # when the stick's last message was heard, and
        self.pushed = False          # what it said
        self.lost_at = now           # the last loss
        self.stopped_at = -math.inf  # the last stop of another node
        self.rested_at = None        # when it rested last, by its own clock; None: not since then

    def hear(self, now, pushed, at):
        """A message that was sent at `at`."""
        if now - at > LOST or now - self.heard_at > LOST:
            self.lose(now)
        self.heard_at, self.pushed = now, pushed
        if not pushed and at >= self.lost_at - LOST:
            self.rested_at = at
        if pushed and at < self.stopped_at - SAME_TIME:
            self.lose(now)

    def stop(self, now):
        """Another node stopped the robot: what is pushed now must be let go."""
        self.stopped_at = now
        if self.pushed:
            self.lose(now)

    def lose(self, now):
        self.lost_at, self.rested_at = now, None

    def objection(self, now):
        if now - self.heard_at > LOST:
            return 'it is not there'
        if not self.pushed:
            return 'it is at rest'
        return '' if self.rested_at is not None else 'nobody let it go since it was lost'
