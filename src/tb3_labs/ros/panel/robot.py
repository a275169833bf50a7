"""One robot as pages see and drive it: what is heard of it, the wheel, and what is sent to it."""
import threading

from tb3_labs.panel.picture import RobotView
from tb3_labs.panel.wheel import Wheel
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.panel.senders import Senders
from tb3_labs.ros.panel.watch import Watch

#: A pad that publishes `joy` beside the pages has been heard within this time [s].
OTHER_PAD = 0.5
#: Which nodes listen is looked at again after this time [s].
HEARD_FOR = 0.5
#: and after this time, if not all of them listen: they may be about to [s].
SOON = 0.1
#: A node that does not tell who holds the robot hears a pad that has been sent for so long [s].
PAD_IS_HEARD = 0.5


class Stop:
    """A stop on its way to the nodes that were connected when it was said. It is confirmed when it
    is written to each connection; a network that is cut may still lose it."""

    def __init__(self, hearers, written, done, nobody):
        """`hearers`: names of the nodes; `written()`: {connection: messages written to it}; `done`,
        `nobody`: the words for a page, if it is confirmed, and if there are no hearers."""
        self._hearers, self._written = ', '.join(sorted(hearers)), written
        self._done, self._nobody = done, nobody
        self._before = written()

    @property
    def is_confirmed(self):
        """Was it written to all?"""
        now = self._written()
        return bool(self._hearers) and all(
            now.get(link, 0) > count for link, count in self._before.items())

    def in_words(self):
        """(confirmed?, text) for the page."""
        if not self._hearers:
            return False, self._nobody
        if not self.is_confirmed:
            return False, 'a connection to {} takes nothing'.format(self._hearers)
        return True, self._done.format(self._hearers)


class PanelRobot:
    """The robot in namespace `name` ('': this node's own); with `control` it can be driven.

    `soon(job)` runs a job in the thread of the server, which alone calls these methods. None of
    them waits for the master: the `worker` does.
    """

    def __init__(self, name, control, soon, worker):
        self.name = name
        self.wheel = Wheel()
        self._prefix = name + '/' if name else ''
        self._soon = soon
        self._worker = worker
        self._lock = threading.Lock()    # guards the view
        self._view = RobotView()
        self._watch = Watch(self._prefix, self._view, self._lock, self._tell_wheel)
        # from the start, so that a stop needs no master
        self._senders = Senders(self._prefix) if control else None
        self._last_heard = {}            # what it answered last,
        self._heard_until = 0.0          # which holds until then [s]

    @property
    def prefix(self):
        """Its namespace with a slash, or ''."""
        return self._prefix

    def look(self, level):
        """Listen to what `level` needs (one of Watch), soon."""
        self._worker.put(lambda: self._watch.look(level))

    def picture(self, now):
        """The picture, with what can be asked for."""
        with self._lock:
            picture = self._view.picture(now)
        heard = self._heard(now)
        picture.update(can=heard, pad=self._pad_words(heard, now),
                       mouse='ready' if heard.get('mouse') else 'no node')
        return picture

    def summary(self, now):
        """The robot's line in the list."""
        with self._lock:
            return dict(self._view.summary(now), name=self.name)

    @property
    def past_count(self):
        """How often the trails got a new beginning."""
        return self._view.past_count

    def trails(self):
        """{'odom': points, 'local': points} driven so far."""
        with self._lock:
            return {'odom': list(self._view.trail_in_odom.points),
                    'local': list(self._view.trail_in_local.points)}

    # -- what a page asks for

    def begin(self, page, now, pressed):
        """A person grips something on `page`; ValueError as Wheel.begin()."""
        self.wheel.begin(page, now, pressed)
        self._worker.put(self._senders.read_pad_numbers)

    def hand(self, page, hand, now, lateness, pressed):
        """The state of what is gripped."""
        self.wheel.on_hand(page, hand, now, lateness, not self._is_driving(), pressed)
        if self.wheel.gives:
            self._senders.renew(now)

    def give(self, page, now, pressed):
        """Give control to move_to_goal."""
        if not self._senders.takers:
            raise ValueError('no node listens on ctrl_relinq: is move_to_goal running?')
        self.wheel.give(page, now, pressed)
        return 'control given'

    def turn(self, page, degrees, pressed):
        """Ask the controller for a turn."""
        if not self._senders.heard()['turn']:
            raise ValueError('no node listens on turn: is the controller running?')
        if self._is_driving():
            raise ValueError('move_to_goal drives: take control first')
        self.wheel.check(page, pressed)
        self._senders.turn(degrees)
        return 'asked for {:g} degrees'.format(degrees)

    def goal(self, page, place, pressed):
        """Send a goal."""
        if not self._senders.heard()['goal']:
            raise ValueError('no node listens on move_base_simple/goal: is move_to_goal running?')
        self.wheel.check(page, pressed)
        self._senders.goal(place)
        return 'goal sent: {:.2f} m, {:.2f} m, {:.0f} deg'.format(place.x, place.y, place.yaw_deg)

    def take(self, page, now, pressed):
        """Take control; the Stop on its way."""
        stop = Stop(self._senders.takers, self._senders.words_written, 'control taken',
                    'no node listens on ctrl_relinq: there is no control to take')
        self.wheel.take(page, now, pressed)
        self.flush(now)
        return stop

    def stop(self, page, now, pressed):
        """Everything to zero; the Stop on its way."""
        stop = Stop(self._senders.stoppable, self._senders.stop_written, 'STOP was sent to {}',
                    'no node hears it')
        self.wheel.stop(page, now, pressed)
        self.flush(now)
        self._senders.zero()
        return stop

    def flush(self, now):
        """Publish what the wheel says."""
        if self._senders is None:
            return
        for word in self.wheel.take_words():
            self._senders.say(word, now)
        for pad in self.wheel.take_pads():
            if not self._other_pad(now):
                self._senders.pad(pad)
        for state in self.wheel.take_mouse():
            self._senders.mouse(state)

    # -- in words

    def _tell_wheel(self, deed):
        """Call `deed(wheel, now)` in the thread of the server; from any thread."""
        def tell():
            now = steady_time()
            deed(self.wheel, now)
            self.flush(now)
        self._soon(tell)

    def _heard(self, now):
        """Senders.heard(), of half a second ago at most: it is asked for with each picture."""
        if self._senders is not None and now >= self._heard_until:
            # nothing is offered that could move the robot before the stops of others are heard
            self._last_heard = {what: heard and self._watch.hears_all
                                for what, heard in self._senders.heard().items()}
            self._heard_until = now + (HEARD_FOR if all(self._last_heard.values()) else SOON)
        return self._last_heard

    def _is_driving(self):
        with self._lock:
            return self._view.is_driving

    def _other_pad(self, now):
        """The name of another node that publishes `joy` now; '' if there is none."""
        with self._lock:
            age = self._view.age('joy', now)
            return self._view.latest('joy') if age is not None and age < OTHER_PAD else ''

    def _pad_words(self, heard, now):
        """The state of the page's pad; '' if none is gripped."""
        if self.wheel.pad is None:
            return ''
        if not heard.get('pad'):
            return 'no node'
        if self._other_pad(now):
            return 'other pad'
        with self._lock:
            holder = self._view.latest('holder')
        if holder is None:    # a node that does not tell
            return 'ready' if self.wheel.pad_heard_for(now) > PAD_IS_HEARD else 'connecting'
        return {'gamepad': 'ready', 'move_to_goal': 'held back'}.get(holder, 'connecting')
