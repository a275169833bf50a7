"""Only a person gives a permission. Renewals only prolong a permission, and a stop stays a stop."""
import pytest

from tb3_labs.supervision.events import IncomingMessage, LogQueue, Novelty, NoveltyFinder, SenderConnection
from tb3_labs.supervision.permission import Permission
from tb3_labs.supervision.timeouts import RENEWAL_PERIOD, SleepMonitor


class PermissionSenders:
    """Persons, and pads that renew, send to one permission. Time passes in ticks of 10 ms."""

    def __init__(self):
        self.log_queue = LogQueue()
        self.permission = Permission(False, self.log_queue)
        self.now = 1000.0
        self.renewing = set()
        self.sensor_problem = ''
        self._next = {}

    def receive(self, sender, value, novelty=Novelty.NEW, has_renewals=False):
        self.permission.on_message(IncomingMessage(value, self.now, sender, novelty, has_renewals))

    def send(self, sender, value):
        """Send a True or False of a person, or of a pad, whose name begins with 'pad'."""
        has_renewals = sender.startswith('pad')
        self.receive(sender, value, has_renewals=has_renewals)
        if has_renewals:
            self.renewing.discard(sender)
            if value:
                self.renewing.add(sender)
            self._next[sender] = self.now + RENEWAL_PERIOD

    def run(self, seconds):
        """Let time pass. Returns True if the robot might be driven at any moment of this time."""
        might = False
        for _ in range(round(seconds / 0.01)):
            self.now += 0.01
            for sender in sorted(self.renewing):
                if self.now >= self._next[sender]:
                    self._next[sender] = self.now + RENEWAL_PERIOD
                    self.receive(sender, True, has_renewals=True)
            self.permission.update(self.now)
            self.permission.set_sensor_problem(self.sensor_problem)
            might = might or self.permission.has_valid_grant
        return might

    def at_once(self, times, sender='pad'):
        """Let this number of True of a pad arrive at once, as after a stall of the network."""
        for _ in range(times):
            self.receive(sender, True, has_renewals=True)

    def give_anew(self, sender):
        """Send a False and a True. Returns whether the robot may be driven then."""
        self.send(sender, False)
        self.send(sender, True)
        return self.run(0.25)

    def warned(self, words):
        return any(words in line.text and line.is_warning for line in self.log_queue.pop_all())


@pytest.fixture
def senders():
    senders = PermissionSenders()
    senders.run(15.0)
    return senders


def test_a_repeated_true_gives_no_grant(senders):
    senders.send('hand', True)
    senders.send('pad', False)
    for _ in range(5):
        senders.send('hand', True)
        assert not senders.run(0.6)
    assert senders.warned('hand does not count: True was said before. False, then True')
    senders.send('another hand', True)
    assert senders.run(0.25)


@pytest.mark.parametrize('after, granted', [(0.03, False), (0.05, True)])
def test_a_grant_holds_after_a_later_renewal(senders, after, granted):
    senders.send('pad', True)
    senders.now += after
    senders.at_once(1)
    assert senders.permission.has_valid_grant is granted


@pytest.mark.parametrize('silence, revives', [(0.6, True), (1.9, True), (2.2, False)])
def test_renewals_restore_a_grant_only_after_a_short_silence(senders, silence, revives):
    senders.send('pad', True)
    senders.run(1.0)
    senders.renewing.clear()
    senders.run(silence)
    assert not senders.permission.has_valid_grant
    senders.renewing.add('pad')
    assert senders.run(5.0) is revives
    assert senders.warned('Control from pad is gone: it was silent for') is not revives
    if not revives:
        senders.send('pad', True)       # only a renewal
        assert not senders.run(0.25)
        assert senders.give_anew('pad')


def test_an_ignored_grant_that_is_renewed_is_logged_once(senders):
    senders.now += 10.0                # no update meanwhile
    senders.at_once(40)                # delayed, then delivered at once
    senders.renewing.add('pad')
    senders._next['pad'] = senders.now
    assert not senders.run(5.0)
    refusals = [line.text for line in senders.log_queue.pop_all() if 'count' in line.text]
    assert len(refusals) == 1 and 'while this node did not run' in refusals[0]
    assert senders.give_anew('pad')


@pytest.mark.parametrize('word', [True, False])
def test_a_waking_node_ignores_a_true_and_obeys_a_false(senders, word):
    senders.send('hand', True)
    senders.run(1.0)
    senders.now += 5.0
    senders.receive('another hand', word)
    assert not senders.permission.has_valid_grant and not senders.run(5.0)
    assert senders.warned('it may have been asked for while this node did not run') is word
    senders.send('a third hand', True)
    assert senders.run(0.25)


@pytest.mark.parametrize('late, counts', [(0.0, True), (1.8, True), (2.5, False)])
def test_a_grant_that_the_network_delayed_for_long_is_ignored(senders, late, counts):
    """The delayed True arrives together with the renewals that were sent after it."""
    senders.send('pad', True)
    senders.at_once(int(late / RENEWAL_PERIOD))
    assert senders.run(3.0) is counts
    assert senders.warned('delayed it by more than 2 s') is not counts


@pytest.mark.parametrize('was_there, comes_after, stands', [
    (True, 1.9, True), (True, 2.2, False), (False, 19.8, True), (False, 20.2, False)])
def test_a_grant_is_void_if_the_sensors_stay_silent(senders, was_there, comes_after, stands):
    senders.sensor_problem = 'no imu'
    if not was_there:
        senders.permission = Permission(True, senders.log_queue)
    if was_there:
        senders.send('pad', True)
    senders.run(comes_after)
    senders.sensor_problem = ''
    senders.run(3.0)
    assert senders.permission.has_valid_grant is stands
    told = 'Control from {} is gone: no imu for {} s'.format(
        *('pad', 2) if was_there else ('the start', 20))
    assert senders.warned(told) is not stands
    assert senders.give_anew('pad')


@pytest.mark.parametrize('slept', [True, False])
def test_a_grant_from_before_the_start_or_the_waking_of_a_node_is_ignored(senders, slept):
    """The True arrives when this node has been awake for a while."""
    if slept:
        senders.now += 3.0               # no update meanwhile
    else:
        senders.permission = Permission(False, senders.log_queue)
    assert not senders.run(0.5)
    senders.send('pad', True)
    senders.at_once(8)                   # pressed 0.8 s ago
    assert not senders.run(3.0) and senders.warned('before this node started, or woke')


@pytest.mark.parametrize('late, stopper, counts', [
    (0.0, 'hand', True), (1.5, 'hand', False), (1.5, 'pad', True)])
def test_a_false_ends_a_delayed_grant_of_another_sender(
        senders, late, stopper, counts):
    """A False of the same sender came before the True, in order."""
    senders.receive(stopper, False)
    senders.run(0.01)
    senders.send('pad', False)
    senders.send('pad', True)
    senders.at_once(round(late / RENEWAL_PERIOD))
    assert senders.run(3.0) is counts
    assert senders.warned('it was taken while the network delayed it') is not counts


def test_a_false_from_before_the_node_keeps_the_grant_at_the_start():
    """The sender's False was older than the start with control."""
    senders = PermissionSenders()
    senders.permission = Permission(True, senders.log_queue)
    senders.receive('pad', False, Novelty.OLD, has_renewals=True)
    assert senders.run(1.0) and senders.permission.has_valid_grant
    assert senders.log_queue.pop_all() == []


@pytest.mark.parametrize('stands, novelty', [
    (False, Novelty.REPEATED), (False, Novelty.LATCHED), (False, Novelty.OLD), (True, Novelty.LATCHED),
    (True, Novelty.OLD)])
def test_a_doubtful_true_is_ignored_and_a_doubtful_false_stops(senders, stands, novelty):
    """The message may be old, or the first of a sender that was connected all the time."""
    if stands:
        senders.send('hand', True)
    senders.receive('student', True, novelty)
    senders.receive('student', True)      # it repeats itself
    assert senders.run(0.5) is stands
    senders.receive('student', False, novelty)
    assert not senders.permission.has_valid_grant and not senders.run(5.0)
    assert senders.give_anew('student')


def test_a_restarted_sender_may_give_a_grant_again(senders):
    """A pad that died while it gave is started again, and A is pressed."""
    senders.send('pad', True)
    assert senders.run(1.0) and senders.permission.pop_new_grant()
    senders.renewing.clear()
    senders.run(3.0)
    senders.receive('pad', True, Novelty.RESTARTED, has_renewals=True)
    senders.renewing.add('pad')
    assert senders.run(0.25) and senders.permission.pop_new_grant()


HERE = SenderConnection('/a', 'http://a:1', connected_at=100.0)


@pytest.mark.parametrize('present, connection, now, novelty', [
    ([], HERE, 100.1, Novelty.NEW),                              # rostopic pub -1
    (['/a'], HERE, 101.9, Novelty.REPEATED),                     # rostopic pub -r 5, which runs from before the start
    (['/a'], HERE, 102.1, Novelty.NEW),                          # a person types
    (['/a'], HERE._replace(connected_at=150.0), 151.9, Novelty.REPEATED),     # connected late
    (['/a'], HERE._replace(has_renewals=True, is_latched=True), 100.4, Novelty.REPEATED),
    (['/a'], HERE._replace(has_renewals=True, is_latched=True), 102.1, Novelty.NEW),
    (['/a'], HERE._replace(is_latched=True), 100.2, Novelty.OLD),
    (['/a'], HERE._replace(connected_at=150.0, is_latched=True), 150.1, Novelty.LATCHED),
    (['/a'], HERE._replace(is_latched=True), 160.0, Novelty.LATCHED)])
def test_the_first_message_of_a_sender_may_be_older_than_the_node(present, connection, now, novelty):
    novelty_finder = NoveltyFinder(present, 100.0)
    assert novelty_finder.find(connection, now) is novelty
    assert novelty_finder.find(connection, now) is Novelty.NEW


@pytest.mark.parametrize('change, now, novelty', [
    ({}, 200.2, Novelty.REPEATED), ({}, 203.0, Novelty.NEW), ({'is_latched': True}, 203.0, Novelty.LATCHED),
    ({'process': 'http://a:2'}, 200.2, Novelty.REPEATED),        # it is respawned, and repeats True
    ({'process': 'http://a:2'}, 203.0, Novelty.RESTARTED),
    ({'process': 'http://a:2', 'has_renewals': True, 'is_latched': True}, 200.2, Novelty.RESTARTED)])
def test_after_a_lost_connection_or_a_restart_of_the_sender(change, now, novelty):
    novelty_finder = NoveltyFinder([], 100.0)
    novelty_finder.find(HERE, 101.0)
    assert novelty_finder.find(HERE._replace(connected_at=200.0, **change), now) is novelty


@pytest.mark.parametrize('stamp, clock, novelty', [
    (7.0, 9.0, Novelty.SAME_STAMP), (7.1, 9.0, Novelty.NEW), (0.0, 9.0, Novelty.NEW),
    (7.0, 8.0, Novelty.NEW)])      # two messages within one step of a simulated clock, or while it stands
def test_a_repeated_stamp_shows_a_repeated_message(stamp, clock, novelty):
    novelty_finder = NoveltyFinder([], 100.0)
    novelty_finder.find(HERE, 101.0, 7.0 if stamp else 0.0, 8.0)
    novelty_finder.find(HERE._replace(sender='/b'), 101.0, 5.0, 8.0)
    assert novelty_finder.find(HERE, 101.1, stamp, clock) is novelty
    latching = HERE._replace(connected_at=150.0, is_latched=True)
    assert novelty_finder.find(latching, 151.0, stamp, 10.0) is Novelty.LATCHED


# A process that slept: this is noticed when it next reads the clock, and once ----------------------

@pytest.mark.parametrize('gap, slept', [(0.0, 0.0), (1.0, 0.0), (1.25, 1.25), (3600.0, 3600.0),
                                        (-50.0, 0.0)])
def test_a_long_gap_is_found_as_a_sleep_once(gap, slept):
    watch = SleepMonitor()
    watch.update(10.0)
    assert watch.slept_for == 0.0 and watch.as_text() == ''
    watch.start(100.0)          # no clock was needed before the start
    assert watch.slept_for == 0.0 and not watch.is_waking
    watch.update(100.0 + gap)
    assert watch.slept_for == slept and watch.is_waking is bool(slept)
    watch.update(100.25 + gap)
    assert watch.slept_for == 0.0 and watch.is_waking is bool(slept)
    watch.update(100.375 + gap)
    assert not watch.is_waking
