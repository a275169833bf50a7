"""Every story of stops and grants, to a depth: does the robot ever move against the rule?

A story is a sequence of events: what persons do with pads and terminals; messages that the
network holds up; nodes that sleep, wake, die and start; and times just below and above each limit
of the rule. The real cores run all stories, the shortest first. The rule, which shares no code
with the cores, judges each command.

    python3 test/unit/story_search.py [seconds for each cast, default 120] [casts]

Units: seconds.
"""
import math
import pickle
import re
import sys
import time
from collections import deque
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple, Tuple

from story_worlds import NOTHING, GoneRobot, LateRobot, OnePad, TwoPads, Unheard, World, Wrong


class Cast(NamedTuple):
    """A world, the events that happen in it, and the events before the stories begin."""

    world: type
    events: str                       # a pattern of their words
    begin: Tuple[str, ...] = ()
    depth: int = 2                    # of the stories in the suite

    def chosen(self):
        """The events: (words, method, arguments)."""
        return [event for event in self.world.EVENTS if re.fullmatch(self.events, event[0])]

    def begun(self):
        world = self.world()
        for words in self.begin:
            (_, method, *details), = [event for event in world.EVENTS if event[0] == words]
            getattr(world, method)(*details)
        return world


#: Waits after which no story ends: longer ones include their moments.
NOT_LAST = (1.95, 20.2)
#: After one of so many transitions, it is tried whether a person who asks again is obeyed.
LISTENED = 150

GAVE = ('A of pad 0',)
CASTS = {
    'terminals': Cast(World, 'move_to_goal.*|.* says .*|rostopic.*|(a|every) goal.*|the pose.*|(0.[345]|1|2).* pass'),
    'goals': Cast(World, '.* goal.*|the program.*|the pose.*|.* terminal says.*|(0.31|2.15) s pass',
                  ('a new terminal says True',), 3),
    'a cancelled goal': Cast(World, 'every goal.*|a goal is sent|.* for 1.95 s.*|the program ends|2.15 s pass',
                             ('a new terminal says True', 'a program begins to repeat a goal', '0.26 s pass'), 4),
    'a sleep': Cast(World, '.* is stopped.* requests.*|.* sent|.* True|the pose.*|2.15 s pass', depth=3),
    'a pad': Cast(OnePad, '.* pad 0.*|.* is stopped .* requests.*|a .* (True|False)|move_to_goal is k.*|.*goal is.*'
                  '|the pose.*|(0.06|0.29|0.31|0.52|2.15) s pass'),
    'a pad that gave': Cast(OnePad, '.* pad 0.*|.* is stopped .* sensors.*|.* terminal .*'
                            '|(0.06|0.26|0.29|0.31|0.52|2.15) s pass', GAVE),
    'a late pad': Cast(OnePad, 'the (net|stick).*|[AB] of.*|(0.31|2.15) s pass', depth=3),
    'restarts': Cast(OnePad, 'move_to_goal is .*d started.*|[AB] of.*|the node.*|2.15 s pass', depth=3),
    'two pads': Cast(TwoPads, '.* pad [01]|.* (True|False)|(0.29|0.52|2.15) s pass', GAVE),
    'a robot that goes': Cast(GoneRobot, 'the robot.*|move_to_goal is k.*|a .*goal.*|a new.*|[ABY] of.*|.* pass', GAVE),
    'a robot that comes': Cast(LateRobot, 'the robot.*|move_to_goal is k.*|a goal.*|a new.*|[AB] of.*|.* pass',
                               (*GAVE, 'the robot is switched on')),
}
#: In the first cast of each world, it is tried after each first event, too.
FIRST_CASTS = {cast.world: cast for cast in reversed(list(CASTS.values()))}.values()


class Searched:
    """The result of a search."""

    def __init__(self):
        self.transitions = self.drives = self.depth = 0
        self.story, self.reason = None, ''

    def __str__(self):
        return '{0.transitions} transitions ({0.drives} moved the robot), up to {0.depth} events{1}'.format(
            self, '\n    WRONG: {}: {}'.format('; '.join(self.story), self.reason) if self.story else '')


def search(cast, seconds=math.inf, depth=99):
    """Follow all stories of a Cast, the shortest first, until time or depth is reached, or the rule objects."""
    found, until = Searched(), time.monotonic() + seconds
    frontier = deque([((), pickle.dumps(cast.begun(), -1))])
    while frontier and time.monotonic() < until and len(frontier[0][0]) < depth:
        story, world = frontier.popleft()
        found.depth = len(story) + 1
        for event in cast.chosen():
            words, method, *details = event
            # the times of two waits add up, and nothing is judged after a last one but what the longest shows
            if method == 'let_pass' and (found.depth == depth and details[0] in NOT_LAST or (
                    story and story[-1] > words and story[-1].endswith(' s pass'))):
                continue
            after = pickle.loads(world)
            after.drives = False
            try:
                if getattr(after, method)(*details) is NOTHING:
                    continue
                found.transitions += 1
                found.drives += after.drives
                if found.depth < depth:
                    frontier.append((story + (words,), pickle.dumps(after, -1)))
                if not story and cast in FIRST_CASTS or found.transitions % LISTENED == 0:
                    listens(after)
            except Wrong as wrong:
                found.story, found.reason = story + (words,), str(wrong)
                return found
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


if __name__ == '__main__':
    SECONDS, NAMES = float((sys.argv[1:] or [120])[0]), sys.argv[2:] or list(CASTS)
    with ProcessPoolExecutor() as pool:
        RESULTS = list(pool.map(search, map(CASTS.get, NAMES), [SECONDS] * len(NAMES)))
    for name, result in zip(NAMES, RESULTS):
        print('{}: {}'.format(name, result))
    sys.exit(any(result.story for result in RESULTS))
