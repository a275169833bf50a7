"""The ledger: did a person permit each command of a story?

A simple second implementation of the rule of who may drive (doc/instructor/nodes.md). It shares no
code with the first. A story is a history [(time, what, details...)], sorted by time; each judge
returns [(time, reason)] of the commands that nobody had permitted.

Units: seconds.
"""

PADS = ('pad 1', 'pad 2')
#: Those who must renew a permission that they gave.
RENEWING = PADS + ('panel',)
#: Events that are nearer in time have no order.
SAME_TIME = 0.15
#: The silences after which a giver's permission is suspended, and ends.
SUSPENDED, OVER = 0.5, 2.0


class Ledger:
    """For one run of move_to_goal: the actions of persons that have arrived.

    `old`: senders that had said True before; `granted`: it was started with control; `grace`: a
    stop takes effect within this time [s].
    """

    def __init__(self, started_at, old, granted, grace):
        self.grace = grace
        # (giver, when a person caused it)
        self.givings = [('its start', started_at)] if granted else []
        self.stop = started_at         # the time at which the latest stop was caused,
        self.stop_arrived = -1.0       # and at which it arrived, or will
        self.said = dict.fromkeys(old, True)      # latched before it started
        self.heard = {}                # pad: time at which it was heard last
        self.cancelled = False
        self.asleep_until = -1.0

    def hear(self, now, sender, word, caused_at):
        """A word on ctrl_relinq."""
        silent_for, self.heard[sender] = now - self.heard.get(sender, now), now
        before, self.said[sender] = self.said.get(sender, False), word
        if sender in RENEWING and silent_for > OVER:
            self.givings = [(giver, at) for giver, at in self.givings if giver != sender]
        if not word:
            self.stopped(caused_at, now)
        elif not before:
            self.givings.append((sender, caused_at))

    def stopped(self, caused_at, now):
        """A person's stop, heard now, or when the node wakes."""
        self.stop = max(self.stop, caused_at)
        self.stop_arrived = max(now, self.asleep_until)

    def slept(self, now, until):
        """The node sleeps from now until then."""
        self.asleep_until = until
        if until - now > OVER:
            self.stopped(until, until)

    def objection(self, now):
        """'' or the reason why the robot must not be driven at `now`."""
        if now - self.stop_arrived <= self.grace:
            return ''
        if self.cancelled:
            return 'its goal was cancelled'
        leave = [(giver, at) for giver, at in self.givings if at > self.stop - SAME_TIME]
        if not leave:
            return 'nobody gave it since the last stop'
        silent = [giver in RENEWING and now - self.heard[giver] > SUSPENDED + self.grace
                  for giver, _ in leave]
        return 'all who gave it have fallen silent' if all(silent) else ''


def judge(history, grace):
    """The commands of move_to_goal."""
    ledger, wrong = Ledger(history[0][0], [], False, grace), []
    for now, what, *details in history:
        if what == 'driven':
            objection = ledger.objection(now)
            if objection:
                wrong.append((now, objection))
        elif what == 'heard':
            ledger.hear(now, *details)
        elif what in ('stopped', 'all stopped'):
            ledger.stopped(now, now)
        elif what == 'mover started':
            ledger = Ledger(now, *details, grace)
        elif what == 'mover sleeps':
            ledger.slept(now, details[0])
        elif what == 'goal':
            ledger.cancelled = False
        elif what == 'cancelled':
            ledger.cancelled, ledger.stop_arrived = True, max(now, ledger.asleep_until)
    return wrong


def judge_controller(history, grace):
    """The commands of controller: it drives by a turn that a person asked for, or by a mouse that a
    person moved away from the middle, since the last stop, sleep or start. The mouse of a page may
    be refused there; then it ends no turn."""
    wrong = []
    leave, ready = set(), set()      # sources that permit it, and mice that were seen at rest
    active = set()                   # mice
    stop = ended = -1.0              # the last STOP; the end of all that permitted a command
    asleep_until = -1.0
    for now, what, *details in history:
        if what == 'controlled' and not leave and now - ended > grace:
            wrong.append((now, 'nobody asked for it since the last stop'))
        elif what == 'turn' and details[0] > stop:
            leave.add('turn')
        elif what == 'mouse':
            source, place = details
            if place == 'moved':
                leave |= ready & {source}
            else:
                leave.discard(source)
                ready = ready - {source} if place == 'silent' else ready | {source}
            if place == 'released' and source in active and source == 'mouse':
                leave.discard('turn')
            active = active | {source} if place in ('moved', 'centred') else active - {source}
            ended = max(now, asleep_until)
        elif what == 'all stopped':
            leave, ready, stop, ended = set(), set(), now, max(now, asleep_until)
        elif what == 'controller started':
            leave, ready, ended = set(), set(), now
        elif what == 'controller sleeps':
            asleep_until = details[0]
            if asleep_until - now > OVER:
                leave, ready, ended = set(), set(), asleep_until
    return wrong
