"""Which page drives a robot by hand? One at a time: the page that *holds* it.

A page becomes the holder when a person grips something on it, unless another page holds the robot.
The holder sends the state of its pad and mouse (`Joy`) about 20 times a second. The rules are those
of a gamepad:

* A holder that is silent for more than `PAGE_TIMEOUT` is lost: the page was closed or hidden
  (browsers slow its timers then), or the network failed. Control that it gave is taken back. A page
  that comes back drives nothing by itself: a person must grip something again.
* A message that was delayed by more than `PAGE_TIMEOUT` counts only for its button B.
* "take", B and "stop" count from every page, whenever they arrive. If another page than
  the holder sends one of them, the holder is stopped too.
* A grip, a grant or the button A counts only if it was pressed after the last stop (by any page or
  node), and after the last loss.

A pad's messages are published as they come. If they stop, the node `gamepad` notices it itself.

Units: seconds on a clock that never stands still and never goes back (`now`).
"""
import math
from typing import Dict, List, NamedTuple, Optional, Set, Tuple

from tb3_labs.news import News, NewsDesk
from tb3_labs.panel.requests import Joy, Pad
from tb3_labs.supervision.permission import RENEWAL

#: A page that is silent for longer than this is lost [s].
PAGE_TIMEOUT = 0.25
#: A request that was delayed by more than this is rejected: nobody expects it any more [s].
LONGEST_DELAY = 2.0


class LatePad(NamedTuple):
    """The state of a pad, and the delay of its message beyond the usual one [s]."""

    pad: Pad
    lateness: float


class MouseState(NamedTuple):
    """The mouse as `mouse_info` has it."""

    active: bool
    x: float = 0.0
    y: float = 0.0


Stopped = Tuple[Optional[object], float]


class Holder:
    """The holder of one robot. Any object can identify a page."""

    def __init__(self) -> None:
        #: The page that holds the robot, or None.
        self.page: Optional[object] = None
        #: Has this page given control to move_to_goal? Control must be renewed then.
        self.has_granted = False
        #: The last state of this page's pad; None if the pad is not gripped.
        self.pad: Optional[Pad] = None
        self._pad_since = 0.0          # time of the pad's first message
        self._heard_at = 0.0
        self._mouse_active = False
        self._mouse_refused = False    # True: the mouse counts again once it was let go
        self._b_pressed: Set[int] = set()    # id() of each page on which B is pressed
        self._a_refused = False        # True: A counts again once it was released
        # (page or None, time) of the last stop, and of the last stop by a different page or node
        self._stops: Tuple[Stopped, Stopped] = ((None, -math.inf),) * 2
        self._own_stops: Dict[int, float] = {}    # id() of a page: press time of its last stop
        self._has_control: Optional[bool] = None    # by the last message of move_to_goal
        self._lost = False             # did move_to_goal lose control that this page gave?
        self._grants: List[bool] = []
        self._pads: List[LatePad] = []
        self._mouse: List[MouseState] = []
        self._news = NewsDesk()

    # -- input

    def begin(self, page: object, now: float, pressed: float) -> None:
        """Make `page` the holder: a person gripped something on it at `pressed`. ``ValueError`` if
        another page holds the robot, or if :meth:`check` refuses."""
        self.update(now)
        if self.page not in (None, page):
            raise ValueError('another page drives: it must let go first, or be stopped')
        self.check(page, pressed)
        self.page, self._heard_at = page, now

    def check(self, page: object, pressed: float) -> None:
        """``ValueError`` if `pressed`, the time of a request of `page`, is before the last stop."""
        if self._is_old(page, pressed):
            raise ValueError('this was pressed before the robot was stopped: press it again')

    def on_joy(self, page: object, joy: Joy, now: float, lateness: float = 0.0,
               mouse_drives: bool = True, pressed: float = math.inf) -> None:
        """Take in the state of the pad and the mouse of `page`, delayed by `lateness` [s].

        If `mouse_drives` is False, another node drives: a mouse that is gripped meanwhile must be
        gripped anew. `pressed`: the time at which A was pressed, if A is pressed.
        """
        self.update(now)
        if self._is_press_of_b(page, joy.pad):
            # the holder's B counts here too: perhaps no node hears its pad
            self.take(page, now, now - lateness)
        if page is not self.page or lateness > PAGE_TIMEOUT:
            return
        self._heard_at = now
        self._hear_pad(self._without_old_a(page, joy.pad, pressed), now, lateness)
        self._hear_mouse(joy.mouse, mouse_drives)

    def give(self, page: object, now: float, pressed: float) -> None:
        """Give control to move_to_goal; ``ValueError`` as in :meth:`begin`."""
        self.begin(page, now, pressed)
        if self._lost:
            self._end_grant()    # control must be given anew
        self._lost = False
        if not self.has_granted:
            self.has_granted = True
            # the grant, and the renewals that were due since `pressed`: they show its age
            self._grants += [True] * (1 + int((now - pressed) / RENEWAL))

    def take(self, page: object, now: float, pressed: float = -math.inf) -> None:
        """`page` takes control from move_to_goal, even if another page gave it. Another page that
        holds the robot is stopped. `pressed`: see :meth:`stop`."""
        if page is self.page:
            self._take(page, now, pressed)
        else:
            self.stop(page, now, pressed)

    def on_stop(self, now: float) -> None:
        """Another node stopped the robot, and did not change who has control."""
        self._stopped(None, now)

    def on_taken(self, now: float) -> None:
        """Another node took control: the grant of the holder is over."""
        self._stopped(None, now)
        self._end_grant()

    def on_control(self, granted: bool, now: float) -> None:
        """move_to_goal says whether it has control now."""
        if self._has_control and not granted:
            self._lost = True
            self._stopped(None, now)
        elif granted:
            self._lost = False
        self._has_control = granted

    def stop(self, page: object, now: float, pressed: float = -math.inf) -> None:
        """Stop the robot and release everything; any `page` may ask for it.

        `pressed`: time of this press, on the clock of the page's other presses. A press from before
        this stop may arrive after it.
        """
        if self.pad is not None:
            self._pads.append(LatePad(Pad(b=True), 0.0))
        # deactivating an active mouse also ends a turn
        self._mouse += [MouseState(True), MouseState(False)]
        self._mouse_active = False
        self._take(page, now, pressed)
        self._drop()

    def let_go(self, page: object) -> None:
        """The person at `page` has let go of everything."""
        if page is self.page:
            self._release()

    def gone(self, page: object) -> None:
        """The connection to `page` has ended."""
        self._b_pressed.discard(id(page))
        self._own_stops.pop(id(page), None)
        if page is self.page:
            self._lose('The page that drives has gone')

    def update(self, now: float) -> None:
        """Notice a silent holder. Call this repeatedly while a page holds the robot."""
        if self.page is not None and now - self._heard_at > PAGE_TIMEOUT:
            self._stopped(None, self._heard_at + PAGE_TIMEOUT)
            self._lose('The page that drives is silent for {:.1f} s'.format(now - self._heard_at))

    # -- output

    def pad_heard_for(self, now: float) -> float:
        """Returns for how long the pad has been heard [s]; 0 if no pad is gripped."""
        return now - self._pad_since if self.pad is not None else 0.0

    def take_messages(self) -> Tuple[List[bool], List[LatePad], List[MouseState]]:
        """Returns the messages since the last call, in three lists: for `ctrl_relinq` (True gives
        control, False takes it), for the pad, and for the mouse."""
        messages = self._grants, self._pads, self._mouse
        self._grants, self._pads, self._mouse = [], [], []
        return messages

    def take_news(self) -> List[News]:
        """The News since the last call."""
        return self._news.take()

    # -- the pad and the mouse

    def _is_press_of_b(self, page: object, pad: Optional[Pad]) -> bool:
        """Is this a new press of B on `page`? Each page is looked at by itself: a page with delayed
        messages must not hide the B of another page."""
        was_pressed = id(page) in self._b_pressed
        if pad is None or not pad.b:
            self._b_pressed.discard(id(page))
            return False
        self._b_pressed.add(id(page))
        return not was_pressed

    def _without_old_a(self, page: object, pad: Optional[Pad], pressed: float) -> Optional[Pad]:
        """`pad`, with A released if it was pressed before the last stop."""
        if pad is None or not pad.a:
            self._a_refused = False
            return pad
        if self._is_old(page, pressed) and not self._a_refused:
            self._a_refused = True
            self._news.tell('A was pressed before the robot was stopped: press it again',
                            warning=True)
        return pad._replace(a=False) if self._a_refused else pad

    def _hear_pad(self, pad: Optional[Pad], now: float, lateness: float) -> None:
        if pad is not None:
            if self.pad is None:
                self._pad_since = now
            self._pads.append(LatePad(pad, lateness))
        self.pad = pad

    def _hear_mouse(self, mouse: Optional[Tuple[float, float]], drives: bool) -> None:
        self._mouse_refused = mouse is not None and (self._mouse_refused or not drives)
        if mouse is not None and not self._mouse_refused:
            if not self._mouse_active:
                self._mouse.append(MouseState(False))    # a new mouse must begin inactive
            self._mouse_active = True
            self._mouse.append(MouseState(True, *mouse))
        elif self._mouse_active:
            self._release_mouse()

    def _release_mouse(self) -> None:
        self._mouse_active = False
        self._mouse.append(MouseState(False))

    def _lose(self, reason: str) -> None:
        held = self.has_granted or self._mouse_active or self.pad is not None
        self._release()
        if held:
            self._news.tell(reason + ': robot stopped; grip a control of the page to drive again',
                            warning=True)

    def _stopped(self, page: Optional[object], now: float) -> None:
        last, before = self._stops
        now = max(now, last[1])    # a loss may be noticed after a later stop
        self._stops = (page, now), before if page is last[0] else last

    def _is_old(self, page: object, pressed: float) -> bool:
        """Is `pressed` before the last stop? The page's own stop is compared by the time of its
        press, since both messages may have been slow."""
        last, before = self._stops
        by_others = (before if page is last[0] else last)[1]
        return pressed <= max(by_others, self._own_stops.get(id(page), -math.inf))

    def _take(self, page: object, now: float, pressed: float) -> None:
        self._stopped(page, now)
        self._own_stops[id(page)] = max(pressed, self._own_stops.get(id(page), -math.inf))
        self.has_granted = False
        self._grants.append(False)

    def _release(self) -> None:
        if self._mouse_active:
            self._release_mouse()
        self._end_grant()
        self._drop()

    def _end_grant(self) -> None:
        if self.has_granted:
            self.has_granted = False
            self._grants.append(False)

    def _drop(self) -> None:
        self.page = self.pad = None
        self._a_refused = False
