"""Defects of the rule, put back or made up: does the search find each, and by which story?

    python3 test/unit/defects.py [words of its name]
"""
import math
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from unittest import mock

from exhaust import search, told, walks
from played_pages import LatePages, TwoPages
from played_worlds import LatePad, MouseAndTurns, OnePad, Senders
from tb3_labs.control.goal_machine import GoalMachine
from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.nodes import mouse, pad
from tb3_labs.nodes.controller import ControllerCore
from tb3_labs.nodes.gamepad import GamepadCore
from tb3_labs.nodes.mouse import Mouse
from tb3_labs.nodes.pad import PadListener
from tb3_labs.panel.holder import Holder
from tb3_labs.supervision import permission
from tb3_labs.supervision.permission import Permission, SleepWatch

TOLD, ON_MOUSE, HEAR = Permission.told, ControllerCore.on_mouse, PadListener.hear
RESTART = GoalMachine.restart


def false_of_old(self, granted, now, sender='', renews=False, is_doubtful=False, is_old=False):
    TOLD(self, granted, now, sender, renews, is_doubtful, is_old or (is_doubtful and not granted))


def believing(self, granted, now, sender='', renews=False, *_doubts):
    TOLD(self, granted, now, sender, renews)


def forgetful(self, *details):
    self._said.clear()
    TOLD(self, *details)


def selfish(self, granted, now, sender='', *details):
    others = {} if granted else {name: giving for name, giving in self._grants.items()
                                 if name != sender}
    TOLD(self, granted, now, sender, *details)
    self._grants.update(others)


def heard_first(self, active, x, y, now, *details):
    self._sleep.start(now)
    self.mouse.source.heard(now)
    ON_MOUSE(self, active, x, y, now, *details)


def only_falling(self, stamp, arrival):
    self.least = min(getattr(self, 'least', 1e9), arrival - stamp)
    return arrival - stamp - self.least


def always_in_time(self, *details):
    return HEAR(self, *details)._replace(lateness=0.0)


def sleepless(self, now):
    self.slept_for, self.is_waking = 0.0, False


def give_at_once(self, page, now, pressed):
    self.begin(page, now, math.inf)
    if not self.has_granted:
        self.has_granted = True
        self._grants.append(True)


def never_cancelled(self):
    self.cancelled = False
    RESTART(self)


def stops_of_nobody(self, sender, giving, now):
    return 'silent' if giving.silent_for(now) > permission.LONGEST_LAPSE else ''


#: Name: (the world, its object or module, the attribute, what stands there in its place).
DEFECTS = {
    'a first False that is latched is thrown away': (Senders, Permission, 'told', false_of_old),
    'the mouse is heard before anybody looks at the gap': (
        MouseAndTurns, ControllerCore, 'on_mouse', heard_first),
    'the usual delay only ever falls': (OnePad, Lateness, 'of', only_falling),
    'a latched True gives control': (Senders, Permission, 'told', believing),
    'a repetition gives control': (Senders, Permission, 'told', forgetful),
    'a False takes only what its own sender gave': (Senders, Permission, 'told', selfish),
    'a sleep is not noticed': (Senders, SleepWatch, 'update', sleepless),
    'a reset brings a cancelled goal back': (Senders, GoalMachine, 'restart', never_cancelled),
    'a giver may be silent for 5 s': (OnePad, permission, 'LAPSE', 5.0),
    'a giver that was silent for long comes back': (OnePad, permission, 'LONGEST_LAPSE', 60.0),
    'a late giving is compared with no stop': (LatePad, Permission, '_objection', stops_of_nobody),
    'a late press counts': (LatePad, PadListener, 'hear', always_in_time),
    'a pad may be silent for 9 s': (LatePad, pad, 'PAD_TIMEOUT', 9.0),
    'a stick that is pushed is ready': (OnePad, GamepadCore, '_is_ready', lambda *_: True),
    'a mouse may be silent for 9 s': (MouseAndTurns, mouse, 'MOUSE_TIMEOUT', 9.0),
    'a late giving of a page is compared with no stop': (
        LatePages, Holder, 'give', give_at_once),
    'a page that is silent is not lost': (LatePages, Holder, 'update', lambda *_: None),
    'control that was lost by itself is given without a word': (
        TwoPages, Holder, 'on_control', lambda *_: None),
    'a mouse is never lost': (MouseAndTurns, Mouse, 'lose', lambda *_: None),
}


def look_for(name, seconds):
    """Search with this defect in place, and if need be by long stories; the Searched."""
    kind, *where = DEFECTS[name]
    with mock.patch.object(*where):
        found = search(kind, seconds)
        return found if found.story else walks(kind, 300)


def report(name):
    """Look for one defect; (was it found?, its story in words)."""
    begun = time.monotonic()
    found = look_for(name, 100.0)
    return bool(found.story), '{} ({:.0f} s): {}'.format(name, time.monotonic() - begun, told(found))


if __name__ == '__main__':
    NAMES = [name for name in DEFECTS if ' '.join(sys.argv[1:]) in name]
    MISSED = 0
    with ProcessPoolExecutor() as pool:
        for IS_FOUND, TEXT in pool.map(report, NAMES):
            MISSED += not IS_FOUND
            print(TEXT, flush=True)
    sys.exit(MISSED)
