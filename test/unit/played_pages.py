"""A world of two pages of the panel, a student's gamepad, and move_to_goal.

Units: seconds.
"""
from oracle import PageOracle
from played_nodes import RENEWAL_PERIOD, Process
from played_worlds import MOVER, NOTHING, WAITING, Labs, Wrong, held_up, sleeping
from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.panel.holder import LONGEST_DELAY, Holder
from tb3_labs.panel.requests import Joy

#: A page's clock, beside the panel's.
CLOCK = 55.0


class Panel(Process):
    """The panel, as its script handles the requests of pages."""

    name = 'panel'

    def __init__(self, world):
        super().__init__(world)
        self.core = Holder()
        self.lateness = {page: Lateness() for page in 'ab'}
        self.oracles = {page: PageOracle() for page in 'ab'}
        self.said_at = 0.0

    def on_request(self, page, kind, at, sent):
        now = self.world.now
        lateness = self.lateness[page].of(sent + CLOCK, now)
        pressed = min(at, now - lateness)
        oracle = self.oracles[page]
        oracle.hear(now, at)
        try:
            if kind == 'joy':
                self.core.on_joy(page, Joy(), now, lateness)
                if self.core.has_granted and now - self.said_at >= RENEWAL_PERIOD - 1e-6:
                    if oracle.objection():
                        raise Wrong(oracle.objection())
                    self.say(True, None)
            elif kind == 'stop':
                self.core.stop(page, now, pressed)
            elif kind == 'take':
                self.core.take(page, now, pressed)
            elif kind == 'let go':
                self.core.let_go(page)
            elif now - pressed <= LONGEST_DELAY:
                self.core.give(page, now, pressed)
                oracle.gave(now)
        except ValueError:
            return
        self.flush(at)

    def on_control(self, granted):
        self.core.on_control(granted, self.world.now)
        self.flush(self.world.now)

    def on_taken(self):
        self.core.on_taken(self.world.now)
        self.flush(self.world.now)

    def woke(self, slept_for):
        pass

    def tick(self):
        if self.asleep_since is None:
            self.core.update(self.world.now)
            self.flush(self.world.now)

    def flush(self, at):
        for word in self.core.take_messages()[0]:
            self.say(word, at)
        self.core.take_news()

    def say(self, word, at):
        self.said_at = self.world.now
        self.world.tell(self.name, word, True, at)


class TwoPages(Labs):
    """Two pages of a panel, and a student's gamepad that latches."""

    EVENTS = WAITING + MOVER + sleeping('the panel', 1) + [
        ('the student says True', 'student', True), ('the student says False', 'student', False)] + [
        event for page in 'ab' for event in [
            ('page {} gives control'.format(page), 'ask', page, 'give'),
            ('page {} takes control'.format(page), 'ask', page, 'take'),
            ('STOP on page {}'.format(page), 'ask', page, 'stop'),
            ('page {} lets go'.format(page), 'ask', page, 'let go'),
            ('page {} is hidden'.format(page), 'hide', page, True),
            ('page {} is shown'.format(page), 'hide', page, False)] + held_up('page ' + page, 1, page)]

    def __init__(self):
        self.hidden = set()
        self.panel = None
        super().__init__()

    def start_mover(self, has_control):
        super().start_mover(has_control)
        self.panel = self.panel or Panel(self)
        self.pads = [self.panel]
        self.nodes = [self.mover, self.panel]

    def ask(self, page, kind):
        self.panel.send(page, 'on_request', page, kind, self.now, self.now)

    def hide(self, page, hidden):
        if (page in self.hidden) is hidden:
            return NOTHING
        (self.hidden.add if hidden else self.hidden.discard)(page)

    def passed(self):
        """A page repeats the state of what is gripped."""
        for page in 'ab':
            if page not in self.hidden and self.panel.core.page == page:
                self.ask(page, 'joy')

    def ask_anew(self):
        self.hidden.clear()
        self.calm()
        self.goal()
        for page in 'ab':
            for kind in ('stop', 'give'):
                self.ask(page, kind)
                self.wait(0.1)
            self.is_obeyed(0.3, 'page ' + page)


class LatePages(TwoPages):
    """The same pages behind a network that holds messages up, without sleeps and restarts"""

    EVENTS = [event for event in TwoPages.EVENTS
              if event[1] == 'hide' or event[1] == 'ask' and event[3] in ('give', 'stop')
              or event[1] == 'let_pass' and event[2] in (0.31, 2.15)
              or event[1] == 'hold_up' and event[4] == 1.95]
