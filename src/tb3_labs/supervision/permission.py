"""Is move_to_goal allowed to drive? A person gives the permission, and renewals only prolong it.

Each sender can give the permission by a True and end it by a False. The rules follow ISO 13850, by
which a stop holds until a person releases the machine again.

1. A *grant* is the first True of a sender, or its first True after its False. While a grant is
   valid, move_to_goal may drive the robot.
2. A sender can announce that it repeats True to renew its grant. Then its grant is not valid before
   the first renewal, so that a sender that dies after its first True cannot move the robot.
3. A False of any sender ends the grants of all senders.
4. If the renewals stop for `RENEWAL_TIMEOUT`, the grant is suspended. The next renewal restores the
   grant. After `RESUME_TIME` without a renewal, the grant ends.
5. A grant ends if the sensors were not fresh even once within `RESUME_TIME` after the True. If the
   sensors were never fresh since the start of this node, the time is `ROBOT_START_TIMEOUT`.
6. If this process sleeps for longer than `RESUME_TIME`, all grants end. A True that arrives just
   after a sleep gives no grant, because a stop may have been sent after the True.
7. A doubtful True (:mod:`tb3_labs.supervision.events`) gives no grant. A doubtful False is obeyed.
   A False that was latched before this node began to listen is ignored if no sender has a grant,
   because it must not end the grant of the parameter `has_control`.
8. If renewals arrive faster than one in each `RENEWAL_PERIOD`, the network has delayed them and the
   True before them. A grant ends if its True was delayed by more than `RESUME_TIME`. A grant also
   ends if its True was sent before another sender's False, or before this node started or woke.
"""
import math
from typing import Dict, Set

from tb3_labs.supervision.events import IncomingMessage, LogQueue, Novelty
from tb3_labs.supervision.timeouts import (
    RENEWAL_PERIOD, RENEWAL_TIMEOUT, RESUME_TIME, ROBOT_START_TIMEOUT, Freshness, SleepMonitor)

#: A renewal makes a grant valid if it arrives at least this time [s] after the first True. The
#: network may have delayed an earlier renewal together with the first True.
CONFIRMATION_TIME = 0.04
REMEDY = 'False, then True, gives it again'
STARTUP_SENDER = 'the start'    # sender of the grant that the parameter `has_control` gives


class _Grant:
    """The permission that one sender gave, and the renewals by this sender."""

    def __init__(self, now: float, has_renewals: bool) -> None:
        self.granted_at = now          # time [s] at which the True arrived
        self.latest_send_time = now    # the True was sent at this time [s] or earlier
        self.had_sensors = False       # the sensors were fresh at least once since the grant
        self._has_renewals = has_renewals
        self._renewed_for = 0.0        # time [s] from the grant to the latest renewal
        self._renewals = Freshness('control', RENEWAL_TIMEOUT)
        self._renewals.on_message(now)

    def renew(self, now: float) -> None:
        """Prolong the grant. A sender needs 2 s for 20 renewals. If 20 renewals arrive within 0.5 s
        after the True, the network has delayed the True by at least 1.5 s."""
        self._renewals.on_message(now)
        self._renewed_for = now - self.granted_at
        self.latest_send_time = self.granted_at
        # after RESUME_TIME, a sender whose clock runs fast would look delayed
        if self._has_renewals and self._renewed_for < RESUME_TIME:
            delay = RENEWAL_PERIOD * (self._renewals.count - 1) - self._renewed_for
            self.latest_send_time -= max(0.0, delay)

    def silent_for(self, now: float) -> float:
        """Returns the time [s] since the latest renewal; 0 if the sender does not renew."""
        return self._renewals.age(now) if self._has_renewals else 0.0

    def is_valid(self, now: float) -> bool:
        if not self._has_renewals:
            return True
        return self._renewed_for >= CONFIRMATION_TIME and self._renewals.is_fresh(now)


class Permission:
    """The permission that follows from the messages of all senders."""

    def __init__(self, has_control: bool, log: LogQueue) -> None:
        self._has_new_grant = False    # a grant was given since the latest pop_new_grant()
        self._sensor_problem = 'no sensors yet'
        self._longest_wait = ROBOT_START_TIMEOUT    # time [s] that a grant waits for sensors
        self._grants: Dict[str, _Grant] = {}        # by sender
        if has_control:
            self._grants[STARTUP_SENDER] = _Grant(math.nan, has_renewals=False)
        self._last_value: Dict[str, bool] = {}    # latest message of each sender
        self._stopped_at: Dict[str, float] = {}   # time [s] of each sender's latest False
        self._refused_senders: Set[str] = set()    # senders whose refused True was logged
        self._now = math.nan           # time [s] of the latest update
        self._began_at = math.nan      # time [s] of the first update, or of the end of a long sleep
        self.sleep = SleepMonitor()
        self._log = log

    @property
    def has_valid_grant(self) -> bool:
        """Returns True if a grant was valid at the latest :meth:`update`."""
        return any(grant.is_valid(self._now) for grant in self._grants.values())

    @property
    def has_grant(self) -> bool:
        """Returns True if a valid or suspended grant exists."""
        return bool(self._grants)

    def pop_new_grant(self) -> bool:
        """Returns True if a grant was given since the previous call."""
        has_new_grant = self._has_new_grant
        self._has_new_grant = False
        return has_new_grant

    def set_sensor_problem(self, sensor_problem: str) -> None:
        """Store the problem of the sensors, or '', for the next :meth:`update`."""
        self._sensor_problem = sensor_problem
        if not sensor_problem:
            self._longest_wait = RESUME_TIME
            for grant in self._grants.values():
                grant.had_sensors = True

    def on_message(self, message: 'IncomingMessage[bool]') -> None:
        now = message.arrived_at
        sender = message.sender
        self.update(now)
        if message.novelty is Novelty.RESTARTED:    # another process had this name before
            self._last_value.pop(sender, None)
            self._grants.pop(sender, None)
        was_true = self._last_value.get(sender, False)
        self._last_value[sender] = message.content

        if not message.content:
            self._on_stop(message)
        elif sender in self._grants:
            self._grants[sender].renew(now)
            self._end_if_delayed(sender, self._grants[sender])
        elif message.novelty.is_doubtful:
            self._refuse(sender, 'it was given before this node could hear it')
        elif self.sleep.reason_to_refuse:
            self._refuse(sender, self.sleep.reason_to_refuse)
        elif not was_true:
            self._grants[sender] = _Grant(now, has_renewals=message.has_renewals)
            self._refused_senders.discard(sender)
            self._has_new_grant = True
        elif not self.has_grant:
            self._refuse(sender, 'True was said before')

    def _on_stop(self, message: 'IncomingMessage[bool]') -> None:
        now = message.arrived_at
        granting_senders = self._grants.keys() - {STARTUP_SENDER}
        if message.novelty is Novelty.OLD and not granting_senders:    # rule 7
            return
        self._stopped_at = {sender: time for sender, time in self._stopped_at.items()
                            if now - time <= RESUME_TIME}
        self._stopped_at[message.sender] = now
        self._grants = {}
        self._refused_senders.discard(message.sender)

    def _refuse(self, sender: str, reason: str) -> None:
        """Log a refusal only once, because the sender may repeat True for ever."""
        if sender not in self._refused_senders:
            self._refused_senders.add(sender)
            self._log.warn(f'Control from {sender} does not count: {reason}. {REMEDY}')

    def update(self, now: float) -> None:
        """Apply rules 4 to 6. Call this several times a second, and before a grant is used."""
        self._now = now
        if math.isnan(self._began_at):    # this is the first update
            self._began_at = now
            for grant in self._grants.values():
                grant.granted_at = now    # the grant of `has_control`

        self.sleep.update(now)
        if self.sleep.slept_for > RESUME_TIME:
            self._began_at = now
            if self._grants:
                self._grants = {}
                self._log.warn('Control is gone: ' + self.sleep.as_text())

        for sender, grant in list(self._grants.items()):
            waited_for = now - grant.granted_at
            if not grant.had_sensors and waited_for > self._longest_wait:
                self._end(sender, f'{self._sensor_problem} for {self._longest_wait:.0f} s (is the '
                                  'robot running?)')
            elif grant.silent_for(now) > RESUME_TIME:
                self._end(sender, f'it was silent for {grant.silent_for(now):.1f} s')

    def _end_if_delayed(self, sender: str, grant: _Grant) -> None:
        """Apply rule 8 to a grant that was just renewed."""
        delay = grant.granted_at - grant.latest_send_time
        stops_of_others = [time for other, time in self._stopped_at.items() if other != sender]
        if delay > RESUME_TIME:
            self._end(sender, f'the network delayed it by more than {RESUME_TIME:.0f} s')
        elif grant.latest_send_time < self._began_at:
            self._end(sender, 'it was given before this node started, or woke')
        elif any(grant.latest_send_time < stopped_at for stopped_at in stops_of_others):
            self._end(sender, 'it was taken while the network delayed it')

    def _end(self, sender: str, reason: str) -> None:
        self._log.warn(f'Control from {sender} is gone: {reason}. {REMEDY}')
        self._refused_senders.add(sender)    # this warning is enough, so do not log a refusal too
        del self._grants[sender]
