"""A world of pages of the panel, which are pads of a gamepad node, a real pad, and move_to_goal.

Units: seconds.
"""
from oracle import HandOracle, PageOracle
from played_nodes import OVER, TICK, Pad, Process
from played_worlds import MOVER, NOTHING, WAITING, Labs, Wrong, held_up, sleeping
from tb3_labs.supervision.holder import Holder
from tb3_labs.supervision.page_grip import Grip

#: A page sends once in this time; A is shown once the node has heard the page for the second.
PERIOD, HEARD = 2 * TICK, 0.45
#: A grip of a pad that is not ready within this time is dropped.
READY_WITHIN = 1.0


class HandOnPage(HandOracle):
    """Judges a stick on a page: it must also have rested, by the page's messages that reached the panel."""

    page = None

    def objection(self, now):
        if self.page and self.page.rested_at is None:
            return 'nobody let go of the page since it was stopped'
        return super().objection(now)


class PagePad(Pad):
    """The gamepad node that hears the pages, by the panel."""

    def __init__(self, world, name):
        self.giver, self.by_page = None, PageOracle()
        super().__init__(world, name)
        self.plugged = False             # it has no pad of its own
        self.oracle = HandOnPage(world.now)

    def on_page(self, page, button, stick, at, stamp):
        self.oracle.page = self.world.panel.oracles.get(page)
        gave = self.core.messages.grants
        self.on_joy(button, stick, at, stamp)
        if self.core.messages.grants and not gave:
            self.giver = page
            self.by_page.gave(self.world.now)
        elif page == self.giver:
            self.by_page.hear(self.world.now, at)

    def say_word(self, word, at):
        if word and at is None and self.by_page.objection():
            raise Wrong(self.by_page.objection())
        super().say_word(word, at)


class Panel(Process):
    """The panel, as ros_control.py handles the requests of pages."""

    name = 'panel'

    def __init__(self, world):
        super().__init__(world)
        self.core = Grip()
        self.oracles = {page: HandOracle(world.now) for page in 'ab'}

    def on_joy(self, page, held, button, stick, at, stops, sent, first):
        now, oracle = self.world.now, self.oracles[page]
        oracle.hear(now, stick != 0.0, self.at(sent))
        if not held:
            if self.core.let_go(page):
                self.show(page, None, 0.0, sent, now)
            return
        try:
            if self.core.hold(page, stops, now, now - sent, first):
                self.show(page, button, stick, at, sent)
        except ValueError:
            pass

    def on_stop(self, page, at):
        self.stop(self.at(at))

    def stop(self, at):
        """The messages of ros_control.py: False, B, and a pad that is let go."""
        self.world.tell(self.name, False, at)
        self.show(None, 1, 0.0, at, self.world.now)
        self.show(None, None, 0.0, self.world.now, self.world.now)
        self.on_taken()

    def on_taken(self):
        """Another node, or this one, has stopped the robot."""
        for oracle in self.oracles.values():
            oracle.stop(self.world.now)
        if self.core.page is not None:
            self.show(None, None, 0.0, self.world.now, self.world.now)
        self.core.stop()

    def on_control(self, granted):
        if not granted:
            self.on_taken()

    def show(self, page, button, stick, at, stamp):
        self.world.pads[0].send('panel', 'on_page', page, button, stick, at, stamp)

    def woke(self, slept_for):
        if slept_for > OVER:
            for oracle in self.oracles.values():
                oracle.lose(self.world.now)

    def tick(self):
        if self.asleep_since is None and self.core.silence(self.world.now):
            self.stop(self.world.now)


class Page:
    """A page: pad.js sends the controls that a person holds on it."""

    def __init__(self, name):
        self.name, self.hidden, self.stops = name, False, None    # None: nothing is held
        self.stick, self.pressed, self.gives = 0.0, None, False
        self.since = self.next = self.seen = self.ready_at = 0
        self.is_ready = self.is_open = self.is_new = False    # the first message shows a stick at rest

    def hold(self, now):
        if self.stops is None:
            self.stops, self.since, self.next = self.seen, now, now
            self.is_open, self.is_new = False, True
        self.ready_at = now

    def tick(self, world):
        """Send, then read the picture: a page that was frozen may do it in this order."""
        if self.hidden:
            return
        now = world.now + 1e-9
        if self.stops is not None and now >= self.next:
            self.send(world)
        self.seen = world.panel.core.stops
        self.is_ready = world.pads[0].core.holder is Holder.GAMEPAD
        self.ready_at = world.now if self.is_ready else self.ready_at
        if self.stops is not None and (self.stops != self.seen or (
                self.stick and now - self.ready_at > READY_WITHIN)):
            self.drop(world)

    def send(self, world):
        self.next = world.now + PERIOD
        shown, at = self.pressed is not None and world.now - self.since >= HEARD, world.now
        if shown:
            at, self.pressed, self.gives = self.pressed, None, True
        stick, self.is_open = self.stick if self.is_open else 0.0, self.is_ready
        first, self.is_new = self.is_new, False
        world.panel.send(self.name, 'on_joy', self.name, True, 0 if shown else None, stick, at,
                         self.stops, world.now, first)
        if not (self.stick or self.pressed is not None or self.gives):
            self.drop(world)

    def drop(self, world):
        self.stops, self.stick, self.pressed, self.gives = None, 0.0, None, False
        world.panel.send(self.name, 'on_joy', self.name, False, None, 0.0, world.now, None,
                         world.now, False)


class TwoPages(Labs):
    """Two pages that drive, STOP of a third, a real pad, and a terminal."""

    PADS = 2
    EVENTS = WAITING + sleeping('the panel', 3) + sleeping('move_to_goal', 0) + [
        ('STOP on page c', 'stop', 'c'), ('A of the pad', 'press', 1, 0),
        ('B of the pad', 'press', 1, 1)] + [
        event for event in MOVER if event[1] in ('cancel', 'by_terminal')] + [
        event for page in 'ab' for event in [
            ('the stick of page {} is pushed'.format(page), 'push_on', page, 1.0),
            ('the stick of page {} is let go'.format(page), 'push_on', page, 0.0),
            ('A on page {}'.format(page), 'press_on', page),
            ('B or STOP on page {}'.format(page), 'stop', page),
            ('page {} is frozen'.format(page), 'hide', page, True),
            ('page {} goes on'.format(page), 'hide', page, False)] + held_up('page ' + page, 3, page)]

    def __init__(self):
        self.pages, self.panel = {page: Page(page) for page in 'ab'}, None
        super().__init__()
        self.panel = Panel(self)
        self.pads = [PagePad(self, 'pad 0'), self.pads[1], self.panel]
        self.nodes = [self.mover] + self.pads
        self.start_sender('panel')
        self.wait(1.0)

    @property
    def actors(self):
        return super().actors + list(self.pages.values())

    def passed(self):
        for page in self.pages.values() if self.panel else ():
            page.tick(self)

    def push_on(self, name, stick):
        page = self.pages[name]
        if page.stick == stick or page.hidden:
            return NOTHING
        page.stick = stick
        if stick:
            page.hold(self.now)

    def press_on(self, name):
        page = self.pages[name]
        if page.hidden or page.pressed is not None:
            return NOTHING
        page.hold(self.now)
        page.pressed = self.now

    def stop(self, name):
        page = self.pages.get(name)
        if page and page.hidden:
            return NOTHING
        self.panel.send(name, 'on_stop', name, self.now)
        if page:
            page.drop(self)

    def hide(self, name, hidden):
        if self.pages[name].hidden is hidden:
            return NOTHING
        self.pages[name].hidden = hidden

    def ask_anew(self):
        for page in self.pages.values():
            page.hidden = False
        self.calm()
        self.goal()
        for name in self.pages:
            self.stop('c')
            self.wait(0.5)
            self.push_on(name, 1.0)
            self.is_obeyed(1.0, 'the stick of page ' + name)
            self.push_on(name, 0.0)
            self.wait(0.3)
            self.press_on(name)
            self.is_obeyed(1.0, 'A of page ' + name)


class LatePages(TwoPages):
    """The same pages behind a network that holds messages up, without sleeps"""

    EVENTS = [event for event in TwoPages.EVENTS
              if event[1] in ('hide', 'push_on', 'press_on', 'stop')
              or event[1] == 'let_pass' and event[2] in (0.31, 2.15)
              or event[1] == 'hold_up' and event[4] == 1.95]
