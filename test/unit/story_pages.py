"""A world of pages of the panel, which drive by the DeadMan of one process.

Units: seconds.
"""
from reference_rule import OVER, HandRule
from story_nodes import StoryNode
from story_worlds import NOTHING, WAITING, World, held_up, sleeping
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.dead_man import DeadMan


class PageRule(HandRule):
    """A page names the stops that its person knew."""

    same_time = 0.0


class PanelNode(StoryNode):
    """The panel, as ros_control.py handles the requests of pages."""

    def __init__(self, world):
        super().__init__(world)
        self.core, self.command = DeadMan(), Twist2()
        self.rules = {page: PageRule(world.now) for page in 'ab'}
        self.core.begin(world.now)

    def on_joy(self, page, stops, stick, sent, first):
        """A message that was sent at `sent`; `stick`: None if nothing is held."""
        now = self.world.now
        self.rules[page].hear(now, bool(stick), self.at(sent))
        try:
            if stick is None:
                has_subscribers = self.core.let_go(page)
            else:
                has_subscribers = self.core.hold(page, stops, now, now - sent, first)
        except ValueError:
            return
        if has_subscribers:
            self.command = Twist2(stick or 0.0, 0.0)
        self.tick()

    def on_stop(self):
        for rule in self.rules.values():
            rule.stop(self.world.now)
        self.core.stop()

    def woke(self, slept_for):
        if slept_for > OVER:
            for rule in self.rules.values():
                rule.lose(self.world.now)

    def tick(self):
        if self.core.silence(self.world.now):
            self.on_stop()
        if self.core.page is None:
            self.command = Twist2()
        self.world.judge(self.command, self.rules.get(self.core.page))


class StoryPage:
    """A page, as pad.js: it sends the stick while a person holds it. A stop that it sees drops it."""

    def __init__(self, name):
        self.name, self.hidden, self.stick = name, False, None
        self.stops, self.is_new = 0, False

    def tick(self, world):
        """Send, then read the picture: a page that was frozen may do it in this order."""
        if self.stick is not None and not self.hidden:
            self.send(world)
            if self.stops != world.panel.core.stops:
                self.stick = None
                self.send(world)

    def send(self, world):
        world.panel.send(self.name, 'on_joy', self.name, self.stops, self.stick, world.now, self.is_new)
        self.is_new = False


class StoryPages(World):
    """Two pages that drive, and STOP of a third."""

    EVENTS = WAITING + sleeping('the panel', 0) + [('STOP', 'stop')] + [event for page in 'ab' for event in [
        ('page {} is pushed'.format(page), 'push', page), ('page {} is let go'.format(page), 'let_go', page),
        ('page {} is frozen'.format(page), 'hide', page, True), ('page {} goes on'.format(page), 'hide', page, False),
    ] + held_up('page ' + page, 0, page, 0.15)]

    UNDER_WAY = (0.06, 0.31, 2.15)

    def __init__(self):
        super().__init__()
        self.panel, self.pages = PanelNode(self), {page: StoryPage(page) for page in 'ab'}
        self.nodes = [self.panel]
        self.wait(1.0)

    def passed(self):
        for page in self.pages.values():
            page.tick(self)

    # -- events

    def push(self, name):
        """The first message shows a stick at rest."""
        page = self.pages[name]
        if page.stick is not None or page.hidden:
            return NOTHING
        page.stick, page.stops, page.is_new = 0.0, self.panel.core.stops, True
        page.send(self)
        page.stick = 1.0

    def let_go(self, name):
        page = self.pages[name]
        if page.stick is None or page.hidden:
            return NOTHING
        page.stick = None
        page.send(self)

    def stop(self):
        self.panel.send('stops', 'on_stop')

    def hide(self, name, hidden):
        if self.pages[name].hidden is hidden:
            return NOTHING
        self.pages[name].hidden = hidden

    def ask_anew(self):
        for name, page in self.pages.items():
            page.hidden = False
            self.let_go(name)
        self.calm()
        for name in self.pages:
            self.push(name)
            self.is_obeyed(0.3, 'page ' + name)
            self.let_go(name)
            self.wait(0.3)
