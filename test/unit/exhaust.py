"""Every story of stops and grants, to a depth: does the robot ever move against the rule?

A story is a sequence of events: what persons do with pads, terminals, a mouse; messages that the
network holds up; nodes that sleep, wake, die and start; and times just below and above each limit
of the rule. The real cores run all stories, the shortest first. Stories that lead to the same state
are followed once. The oracle, which shares no code with the cores, judges each command.

    python3 test/unit/exhaust.py [seconds for each cast, default 120] [casts]
    python3 test/unit/exhaust.py walks [number for each cast, default 1000]    # long random stories

Units: seconds.
"""
import math
import pickle
import random
import sys
import time
from collections import deque
from concurrent.futures import ProcessPoolExecutor
from enum import Enum
from functools import lru_cache

from played_nodes import OVER, TICK
from played_pages import LatePages, TwoPages
from played_worlds import (
    BEGIN, LONG_AGO, NOTHING, Goals, GoneRobot, LatePad, LateRobot, LateTurns, MouseAndTurns,
    OnePad, Senders, TwoMice, TwoPads, Unheard, Wrong)
from tb3_labs.localization.contradiction import GyroWatch
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.supervision.freshness import Freshness
from tb3_labs.supervision.permission import _Grant

#: Times of a state that are longer ago than this make no difference; the second limit holds only while no older message
#: may be under way.
AGES = {'_back_at': 0.35, 'given_at': 0.35, '_heard_since': 0.35,
        '_since': 20.3, 'awaits': 20.3}
QUIET_AGES = dict(AGES, _stops=0.2, _stopped_at=0.2, _began_at=0.2, stopped_at=0.2,
                  cancelled_at=0.2, lost_at=0.2, rested_at=0.2)

#: Waits after which no story ends: 2.15 s include the moments of the shorter one, and after the longer one nothing
#: happens without a further event.
NOT_LAST = (1.95, 20.2)

#: After the first event, and after one of so many later, it is tried whether a person who asks again is obeyed.
LISTENED = 40

CASTS = (Senders, OnePad, LatePad, TwoPads, Goals, LateRobot, GoneRobot, TwoPages, LatePages,
         MouseAndTurns, TwoMice, LateTurns)


class Searched:
    """The result of a search."""

    def __init__(self):
        self.states = self.transitions = self.drives = self.depth = 0
        self.story, self.reason = None, ''


def search(kind, seconds=math.inf, depth=99):
    """Follow all stories of a World, the shortest first, until time or depth is reached, or the
    oracle objects."""
    found, until = Searched(), time.monotonic() + seconds
    first = kind()
    seen, frontier = {state_of(first)}, deque([((), pickle.dumps(first, -1))])
    while frontier and time.monotonic() < until:
        story, world = frontier.popleft()
        if len(story) == depth:
            break
        found.depth = len(story) + 1
        for number, (_, method, *details) in enumerate(kind.EVENTS):
            if found.depth == depth and method == 'let_pass' and details[0] in NOT_LAST:
                continue
            after = pickle.loads(world)
            after.drives = False
            try:
                if getattr(after, method)(*details) is NOTHING:
                    continue
                found.transitions += 1
                found.drives += after.drives
                if found.depth < depth:
                    state = state_of(after)
                    if state in seen:
                        continue
                    seen.add(state)
                    frontier.append((story + (number,), pickle.dumps(after, -1)))
                if not story or found.transitions % LISTENED == 0:
                    listens(after)
            except Wrong as wrong:
                found.story = [kind.EVENTS[k][0] for k in story + (number,)]
                found.reason = str(wrong)
                return found
        found.states = len(seen)
    return found


def listens(world):
    """Unheard is raised if a person who asks again is not obeyed. A plain story, which is as short, shows what
    else is wrong."""
    try:
        world.ask_anew()
    except Unheard:
        raise
    except Wrong:
        pass


#: Attributes that change with each step, and on which no decision depends.
IRRELEVANT = {'accepted', '_last_driver', 'count', 'doubts', 'attempt', 'drives', 'tremble',
              'law', '_law', '_localizer',
              'repeated_for', '_pace', '_stalls', '_settling', '_time', '_ended',
              '_is_new', 'reading', '_config', '_model', '_sent',
              '_tries_left', '_interrupted', 'begun', 'state', '_heading', '_asked', '_asked_by',
              '_last', '_read', 'world', '_news', '_told_holder', '_said_at', 'before', 'came_after_loss',
              '_heard_for', '_candidates',
              '_last_arrival', 'name', 'timeout', 'goal', '_refused', 'odometry', '_sources',
              '_window', '_readings', 'longest_gap', 'silent_for', '_orientation', '_rivals', '_open',
              '_answers', '_announcer', 'latest', '_door'}


def state_of(world):
    """A number that is the same for worlds in the same state: times are relative to now."""
    ages = QUIET_AGES if world.is_quiet else AGES
    return hash(tuple(_state(actor, world.now, ages) for actor in world.actors))


def _state(value, now, ages, oldest=LONG_AGO):
    if isinstance(value, float):
        if math.isnan(value):
            return 'NaN'     # which equals not even itself
        if abs(value) > BEGIN / 2.0:
            value = max(-oldest, min(oldest, round(value - now, 3)))
        return value
    if value is None or isinstance(value, (int, str, bytes)):
        return value
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, (list, tuple, deque)):
        return tuple([_state(item, now, ages, oldest) for item in value])
    if isinstance(value, (set, frozenset)):
        return tuple(sorted(map(str, value)))
    if isinstance(value, dict):
        return tuple(sorted((str(key), _state(item, now, ages, oldest))
                            for key, item in value.items()))
    if isinstance(value, Freshness) and value.age(now) < 2.0 * TICK:
        return 'fresh'
    if isinstance(value, _Grant):
        return (value.has_robot or _state(value.given_at, now, ages, 20.3),
                value._renews and (_state(now - value.silent_for(now), now, ages),
                                   _state(value.sent_before, now, ages), value._heard_for > OVER))
    if isinstance(value, GyroWatch):
        return value.problem(), value.is_checked or (
            round(value._rested_for, 2), round(value._alone_for, 2))
    attributes = vars(value)
    return tuple([_state(attributes[name], now, ages, ages.get(name, LONG_AGO))
                  for name in _relevant(type(value), tuple(attributes))])


@lru_cache(maxsize=None)
def _relevant(kind, names):
    copies = {'_grants'} if kind is MoveToGoalCore else set()
    return [name for name in sorted(names) if name not in IRRELEVANT | copies]


def walk(kind, seed, length=30):
    """One long random story; the Searched."""
    found, world, chance = Searched(), kind(), random.Random(seed)
    story, deeds = [], sorted({method for _, method, *_ in kind.EVENTS})
    while len(story) < length:
        deed = chance.choice(deeds)    # otherwise most events would be waits and sleeps
        event, method, *details = chance.choice([each for each in kind.EVENTS if each[1] == deed])
        world.drives = False
        try:
            if getattr(world, method)(*details) is not NOTHING:
                pause = chance.choice((0.0, 0.06, 0.31, 0.7))
                story.append('{}; {} s pass'.format(event, pause))
                world.wait(pause)
                found.drives += world.drives
        except Wrong as wrong:
            found.story, found.reason = story + [event], str(wrong)
            return found
    return found


def walks(kind, number):
    """Random stories until one is wrong; the Searched of the last."""
    for seed in range(number):
        found = walk(kind, seed)
        if found.story:
            break
    return found


def told(found):
    """A Searched in words."""
    text = '{0.states} states, {0.transitions} transitions ({0.drives} moved the robot), all stories ' \
           'of {1} events'.format(found, found.depth - 1)
    if found.story:
        text += '\n    WRONG: {}: {}'.format('; '.join(found.story), found.reason)
    return text


if __name__ == '__main__':
    WALKS = sys.argv[1:2] == ['walks']
    WORDS = sys.argv[1 + WALKS:]
    MUCH = float(WORDS[0]) if WORDS else 1000 if WALKS else 120.0
    KINDS = [kind for kind in CASTS if kind.__name__ in (WORDS[1:] or kind.__name__)]
    with ProcessPoolExecutor() as pool:
        RESULTS = list(pool.map(walks if WALKS else search, KINDS,
                                [int(MUCH) if WALKS else MUCH] * len(KINDS)))
    for KIND, FOUND in zip(KINDS, RESULTS):
        print('{}: {}'.format(KIND.__doc__.rstrip('.'), told(FOUND)))
    sys.exit(any(found.story for found in RESULTS))
