"""The steps of the test drive: what the person reads, and the commands that follow.

A step is a list of parts. A part is one command that is held for a time, or until the robot has
turned or driven so far. All movements end where they began; the heading may differ.

Units: seconds, metres, radians. Turns come first, since they need no space: they show a motor that
is off, and a sensor that is frozen, before the robot drives.
"""
import math
from typing import List, NamedTuple, Sequence, Tuple

#: Names of the parts that are evaluated.
REST, TURN, FAST_TURN, DRIVE, FAST_DRIVE = 'rest', 'turn', 'fast turn', 'drive', 'fast drive'
BEFORE_SILENCE, SILENCE, ROUND, ROUNDS = 'before silence', 'silence', 'round', 'rounds'
METRE, BACK, RESET, LATE = 'metre', 'back', 'reset', 'late'
#: Speeds of the steps whose answer is measured [rad/s], [m/s].
TURNING, DRIVING = 1.5, 0.15
#: Commands that are faster than any TurtleBot3 [rad/s], [m/s].
TOO_FAST_TURN, TOO_FAST = 3.5, 0.4
#: Lengths of the tape measure's movements [rad], [m].
TEN_ROUNDS, ONE_METRE = 20.0 * math.pi, 1.0
#: The numbers that a person can read there: the mark is missed by less than one round [deg], and
#: wheels that slip, or of another size, still drive between half and one and a half metres [cm].
ONE_ROUND, ABOUT_A_METRE = (-360.0, 360.0), (50.0, 150.0)
#: Period of the board, and of the commands [s].
PERIOD = 1.0 / 30.0


class Part(NamedTuple):
    """One command; `seconds` is its length, or its longest length if it ends by `reach`."""

    name: str
    linear: float = 0.0
    angular: float = 0.0
    seconds: float = 1.0
    reach: float = 0.0          # ends when this was driven [m], or turned [rad]; 0: by the time
    silent: bool = False        # no command is sent at all
    resets: bool = False        # the board's `reset` is sent at the start
    once: bool = False          # the command is sent only once


class Step(NamedTuple):
    """`words` is the announcement; `question` asks for a number afterwards, '' for none."""

    name: str
    words: str
    parts: Sequence[Part]
    question: str = ''
    low: float = -math.inf          # of the valid answers, in `unit`
    high: float = math.inf
    unit: str = ''
    longest_silence: float = 0.7    # a sensor that is silent for longer is lost [s]

    def number(self, text: str) -> float:
        """The answer in a line that was typed. Raises ValueError with the line for the person."""
        try:
            number = float(text.strip().replace(',', '.'))
        except ValueError:
            number = math.nan
        if not self.low <= number <= self.high:
            raise ValueError('{!r} is not valid: type a number from {:g} to {:g} [{}], or only '
                             'Enter'.format(text.strip(), self.low, self.high, self.unit))
        return number


def _pause(number: int = 0) -> Part:
    """A rest. The rests of eight `number`s spread the commands evenly over the board's period."""
    return Part('', seconds=1.0 + (number % 8) * PERIOD / 8.0)


def _there_and_back(name: str, linear: float, angular: float, seconds: float,
                    pairs: int) -> Tuple[Part, ...]:
    parts: List[Part] = []
    for number in range(2 * pairs):
        sign = -1.0 if number % 2 else 1.0
        parts += [Part(name, sign * linear, sign * angular, seconds), _pause(number + 1)]
    return tuple(parts)


STEPS: Tuple[Step, ...] = (
    Step(REST, 'The robot rests for 25 s. Do not touch it.', (Part(REST, seconds=25.0),)),
    Step('turns', 'It turns left and right on the spot, eight times, for 20 s.',
         _there_and_back(TURN, 0.0, TURNING, 1.2, 4)),
    Step('fast turns', 'It turns as fast as it can, left and right, for 5 s.',
         _there_and_back(FAST_TURN, 0.0, TOO_FAST_TURN, 1.5, 1)),
    Step('drives', 'It drives 20 cm forwards and back, four times, for 20 s.',
         _there_and_back(DRIVE, DRIVING, 0.0, 1.4, 4)),
    Step('fast drives', 'It drives as fast as it can, 40 cm forwards and back, for 6 s.',
         _there_and_back(FAST_DRIVE, TOO_FAST, 0.0, 1.9, 1)),
    Step('silence', 'It drives 30 cm forwards, is told nothing more and must stop by itself; then '
         'the same backwards.', tuple(part for sign in (1.0, -1.0) for part in (
             Part(BEFORE_SILENCE, sign * DRIVING, seconds=1.2),
             Part(SILENCE, seconds=2.0, silent=True)))),
    Step('round', 'It turns once around, slowly, for 14 s.',
         (Part(ROUND, angular=0.5, seconds=20.0, reach=2.0 * math.pi), _pause())),
    Step('rounds', 'Mark on the floor where the front points. The robot turns ten times to the '
         'left, for 35 s.',
         (Part(ROUNDS, angular=2.0, seconds=60.0, reach=TEN_ROUNDS), _pause(), _pause()),
         'By how many degrees has it turned too far (too little: with a minus)?',
         *ONE_ROUND, 'degrees'),
    Step('back', 'It drives half a metre back.',
         (Part(BACK, -DRIVING, seconds=8.0, reach=0.5 * ONE_METRE), _pause())),
    Step('metre', 'Mark where a wheel touches the floor. The robot drives 1 m forwards.',
         (Part(METRE, DRIVING, seconds=14.0, reach=ONE_METRE), _pause(), _pause()),
         'How many cm did that wheel drive, by the tape measure?', *ABOUT_A_METRE, 'cm'),
    Step('home', 'It drives half a metre back.',
         (Part(BACK, -DRIVING, seconds=8.0, reach=0.5 * ONE_METRE), _pause())),
    Step('reset', 'The board is reset. Do not touch the robot. After 3 s it turns by some degrees, '
         'late.', (Part('', seconds=1.0), Part(RESET, seconds=0.5, resets=True),
                   Part(LATE, angular=0.5, seconds=7.0, once=True), _pause()),
         longest_silence=9.0),
)
#: {name of a step: Step}, in order.
BY_NAME = {step.name: step for step in STEPS}
