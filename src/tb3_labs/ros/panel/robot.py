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


class PanelRobot:
    """The robot in namespace `name` ('': this node's own). `soon(job)` runs a job in the thread of
    the server, which alone calls these methods."""

    def __init__(self, name, soon):
        self.name = name
        self.wheel = Wheel()
        self._prefix = name + '/' if name else ''
        self._soon = soon
        self._lock = threading.Lock()    # guards the view
        self._view = RobotView()
        self._watch = Watch(self._prefix, self._view, self._lock)
        self._senders = None             # until a page that may drive looks at it
        self._last_heard = {}            # what it answered last,
        self._heard_until = 0.0          # which holds until then [s]

    @property
    def prefix(self):
        """Its namespace with a slash, or ''."""
        return self._prefix

    def look(self, level, control):
        """Listen to what `level` needs (one of Watch); with `control` be ready to drive."""
        self._watch.look(level)
        if control and self._senders is None:
            self._senders = Senders(self._prefix, lambda: self._soon(self._on_taken))

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

    def begin(self, page, now):
        """A person grips something on `page`; ValueError if another page has the wheel."""
        self.wheel.begin(page, now)
        self._senders.read_pad_numbers()

    def hand(self, page, hand, now, lateness):
        """The state of what is gripped."""
        self.wheel.on_hand(page, hand, now, lateness, mouse_drives=not self._is_driving())
        if self.wheel.gives:
            self._senders.renew(now)

    def give(self, page, now):
        """Give control to move_to_goal."""
        if not self._senders.heard()['control']:
            raise ValueError('no node listens on ctrl_relinq: is move_to_goal running?')
        self.wheel.give(page, now)
        return 'control given'

    def turn(self, degrees):
        """Ask the controller for a turn."""
        if not self._senders.heard()['turn']:
            raise ValueError('no node listens on turn: is the controller running?')
        if self._is_driving():
            raise ValueError('move_to_goal drives: take control first')
        self._senders.turn(degrees)
        return 'asked for {:g} degrees'.format(degrees)

    def goal(self, place):
        """Send a goal."""
        if not self._senders.heard()['goal']:
            raise ValueError('no node listens on move_base_simple/goal: is move_to_goal running?')
        self._senders.goal(place)
        return 'goal sent: {:.2f} m, {:.2f} m, {:.0f} deg'.format(place.x, place.y, place.yaw_deg)

    def stop(self):
        """Everything to zero."""
        self.wheel.stop()
        self.flush(steady_time())
        self._senders.zero()

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

    def _on_taken(self):
        self.wheel.on_taken()
        self.flush(steady_time())

    def _heard(self, now):
        """Senders.heard(), of half a second ago at most: it is asked for with each picture."""
        if self._senders is not None and now >= self._heard_until:
            self._last_heard = self._senders.heard()
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
