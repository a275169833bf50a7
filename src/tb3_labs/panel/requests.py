"""Requests of a page: one JSON object a message, read into one of the types below.

    {"type": "look", "robot": "robot3"}      show this robot; null: the list of all
    {"type": "seen", "n": 20}                picture 20 was drawn
    {"type": "begin"}                        a person grips a control of this page
    {"type": "joy", "pad": {...}, "mouse": [x, y]}     the present state of what is gripped, or null
    {"type": "let go"}                       the person is done
    {"type": "give"}, {"type": "take"}       give control to move_to_goal, take it
    {"type": "stop"}                         everything to zero
    {"type": "turn", "degrees": 90}          left positive
    {"type": "goal", "x": 1, "y": 0, "yaw_deg": 0}     drive there, in local [m, deg]
    {"type": "reset", "x": 0, "y": 0, "yaw_deg": 0}    the robot is here, now, in local

"pad" is {"forward": -1..1, "left": -1..1, "a": bool, "b": bool, "y": bool, "hold": bool}; "mouse"
counts from the middle of its square to its edges, -1..1, x right, y up. Each may have an "id", a
whole number: the answer has it too. "t" is the time at which it was sent [ms, the page's clock].
"pressed" is the time at which a person asked for it, and in a "joy" the time of the press of A
[s, the panel's clock]: "now" of the last picture, and the time since that picture came.

Any other message raises ``ValueError`` with the reason: the invalid value, and the valid ones.
"""
import json
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

from tb3_labs.geometry.se2 import MAX_DISTANCE, MAX_YAW_DEG, TypedPose
from tb3_labs.nodes.pad_config import PadConfig

#: A message with more characters is refused; the longest valid one has about 200.
LONGEST = 2000
#: The latest time of a clock [ms since 1970].
LATEST = 1e15
#: A turn is at most this [deg].
MOST_DEGREES = 360.0
#: Axes and buttons of the most common pad: nodes of students may look at any of them.
AXES, BUTTONS = 8, 11


class Pad(NamedTuple):
    """The pad of a page: sticks from -1 to 1, forward and left positive; buttons pressed."""

    forward: float = 0.0
    left: float = 0.0
    a: bool = False
    b: bool = False
    y: bool = False
    hold: bool = False

    def as_joy(self, config: PadConfig) -> Tuple[List[float], List[int]]:
        """(axes, buttons) of a sensor_msgs/Joy with the numbers of the node `gamepad`: axes from -1
        to 1, forward and left positive. So a page needs no numbers of any make of pad."""
        axes = [0.0] * max(AXES, 1 + config.linear_axis, 1 + config.angular_axis)
        axes[config.linear_axis] = self.forward
        axes[config.angular_axis] = self.left
        functions = {config.relinquish_button: self.a, config.regain_button: self.b,
                     config.reset_button: self.y}
        if config.has_hold:
            functions[config.hold_button] = self.hold
        buttons = [0] * max(BUTTONS, 1 + max(functions))
        for number, pressed in functions.items():
            buttons[number] = int(pressed)
        return axes, buttons


class Joy(NamedTuple):
    """What a person grips on a page; None: not gripped."""

    pad: Optional[Pad] = None
    mouse: Optional[Tuple[float, float]] = None


class Request(NamedTuple):
    """One message of a page."""

    kind: str
    value: Any = None              # see the readers below
    id: Optional[int] = None
    sent_at: Optional[float] = None    # [s, the page's clock]; None: unknown
    pressed: Optional[float] = None    # [s, the panel's clock]; None: unknown
    lateness: float = 0.0          # its delay beyond the usual one [s]


def read_request(text: Union[str, bytes]) -> Request:
    """The Request in a message; ``ValueError`` with the reason."""
    if len(text) > LONGEST:
        raise ValueError('a message of {} characters is refused: at most {} are valid'.format(
            len(text), LONGEST))
    try:
        # NaN and Infinity are not JSON, but Python's reader takes them
        message = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as problem:
        raise ValueError('a message is not JSON: {}'.format(problem)) from None
    if not isinstance(message, dict):
        raise ValueError('a message must be an object with "type"')
    kind = message.get('type')
    reader = READERS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        raise ValueError('type {} is unknown; known: {}'.format(_short(kind), ', '.join(READERS)))
    given, sent, pressed = (message.get(name) for name in ('id', 't', 'pressed'))
    return Request(str(kind), reader(message),
                   None if given is None else _whole(message, 'id'),
                   None if sent is None else _number(message, 't', LATEST) / 1000.0,
                   None if pressed is None else _number(message, 'pressed', LATEST))


def _look(message: Dict) -> Optional[str]:
    robot = message.get('robot')
    if robot is not None and not isinstance(robot, str):
        raise _invalid('robot', robot, 'a name, or null')
    return robot


def _pose(message: Dict) -> TypedPose:
    # the node refuses others as well, but the page would not show its reason
    return TypedPose(
        _number(message, 'x', MAX_DISTANCE, 'm'), _number(message, 'y', MAX_DISTANCE, 'm'),
        _number(message, 'yaw_deg', MAX_YAW_DEG, 'deg'))


def _joy(message: Dict) -> Joy:
    pad, mouse = message.get('pad'), message.get('mouse')
    if pad is not None and not isinstance(pad, dict):
        raise _invalid('pad', pad, 'an object, or null')
    if mouse is not None and not (isinstance(mouse, list) and len(mouse) == 2):
        raise _invalid('mouse', mouse, '[x, y], or null')
    return Joy(
        None if pad is None else Pad(
            _number(pad, 'forward', 1.0), _number(pad, 'left', 1.0),
            *[_flag(pad, button) for button in ('a', 'b', 'y', 'hold')]),
        None if mouse is None else (_number({'mouse': mouse[0]}, 'mouse', 1.0),
                                    _number({'mouse': mouse[1]}, 'mouse', 1.0)))


#: By type: the reader of a message's value.
READERS: Dict[str, Callable[[Dict], Any]] = {
    'look': _look, 'joy': _joy, 'goal': _pose, 'reset': _pose,
    'seen': lambda message: _whole(message, 'n'),
    'turn': lambda message: _number(message, 'degrees', MOST_DEGREES, 'deg'),
    **dict.fromkeys(('begin', 'let go', 'give', 'take', 'stop'), lambda message: None)}


def _number(message: Dict, name: str, most: float, unit: str = '') -> float:
    """A finite number, of at most this size."""
    value = message.get(name)
    # NaN and infinity fail the comparison; a whole number of 400 digits is too large for a float
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= most:
        valid = 'a number from {:g} to {:g} {}'.format(-most, most, unit)
        raise _invalid(name, value, valid.rstrip())
    return float(value)


def _whole(message: Dict, name: str) -> int:
    value = message.get(name)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 10 ** 12:
        raise _invalid(name, value, 'a whole number from 0')
    return value


def _flag(message: Dict, name: str) -> bool:
    value = message.get(name, False)
    if not isinstance(value, bool):
        raise _invalid(name, value, 'true or false')
    return value


def _invalid(name: str, value: Any, valid: str) -> ValueError:
    return ValueError('{} = {} is not valid: {}'.format(name, _short(value), valid))


def _short(value: Any) -> str:
    """`value` as a page writes it, cut if it is long."""
    try:
        text = json.dumps(value)
    except RecursionError:    # the reader can take a little more depth than the writer
        return 'a value that is nested too deeply'
    return text if len(text) <= 40 else text[:37] + '...'


def _no_number(name: str) -> None:
    raise ValueError('{} is not a number'.format(name))
