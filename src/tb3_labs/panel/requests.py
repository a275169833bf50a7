"""The messages of one page: its requests, read into the types below, and what is sent to it.

A request is a JSON object:

    {"type": "look", "robot": "robot3"}      show this robot; null: the list of all
    {"type": "begin"}                        a person grips a control of this page
    {"type": "joy", "pad": {...}, "mouse": [x, y]}     state of each now; null: not gripped
    {"type": "let go"}                       the person is done
    {"type": "give"}, {"type": "take"}       give control to move_to_goal, take it
    {"type": "stop"}                         everything to zero
    {"type": "turn", "degrees": 90}          left positive
    {"type": "goal", "x": 1, "y": 0, "yaw_deg": 0}     drive there, in local [m, deg]
    {"type": "reset", "x": 0, "y": 0, "yaw_deg": 0}    the robot is here, now, in local

"pad" is {"forward": -1..1, "left": -1..1, "a": bool, "b": bool, "y": bool, "hold": bool}; "mouse"
counts from the middle of its square to its edges, -1..1, x right, y up. Each may have an "id", a
whole number: the answer has it too. "t" is the time at which it was sent [s, the page's clock].
"pressed" is the time at which a person asked for it; in a "joy", the time at which A was pressed
[s, the panel's clock]. The page adds "now" of the last picture and the time since that picture.

Any other message raises ``ValueError`` with the invalid value, and the valid ones.
"""
import json
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

from tb3_labs.geometry.se2 import MAX_DISTANCE, MAX_YAW_DEG, TypedPose
from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.nodes.pad_config import PadConfig

#: A message with more characters is refused; the longest valid one has about 250. JSON of this
#: length is not nested too deeply for Python.
LONGEST = 500
#: The latest time of a clock [s since 1970].
LATEST = 1e12
#: A turn is at most this [deg].
MOST_DEGREES = 360.0
#: Numbers of axes and buttons of the most common pad: students' nodes may read any of them.
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
        """Returns (axes, buttons) of a sensor_msgs/Joy, numbered as the node `gamepad` reads them.
        Axes are from -1 to 1, forward and left positive. A page need not know any numbers."""
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
    """The pad and the mouse pad that a person grips on a page; None if not gripped."""

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


class Viewer:
    """One page; `send(text)` sends a message to it."""

    def __init__(self, send: Callable[[str], None]) -> None:
        #: The robot that it looks at; None for the list of robots.
        self.robot: Any = None
        #: Lines of the log that were not sent to it yet.
        self.lines: List[Dict[str, str]] = []
        self._send = send
        self._lateness = Lateness()

    def send(self, kind: str, **values: Any) -> None:
        """Send a message of this type."""
        self._send(json.dumps(dict(values, type=kind), allow_nan=False))

    def answer(self, request: Optional[Request], fulfilled: bool, text: str) -> None:
        """Answer `request` in words; `request` is None if it could not be read."""
        if request is not None and request.id is not None:
            self.send('answer', id=request.id, ok=fulfilled, text=text)
        elif not fulfilled:
            self.send('note', text=text, warning=True)

    def timed(self, request: Request, now: float) -> Request:
        """Returns `request` with its delay and the time of its press, on the clock of `now` [s].

        Without a time of the press, the press counts as made when the request was sent.
        """
        late = 0.0 if request.sent_at is None else self._lateness.of(request.sent_at, now)
        pressed = now - late if request.pressed is None else min(now - late, request.pressed)
        return request._replace(lateness=late, pressed=pressed)


def read_request(text: Union[str, bytes]) -> Request:
    """Returns the Request in a message. ``ValueError``, with the reason, if it is invalid."""
    if len(text) > LONGEST:
        raise ValueError('a message of {} characters is refused: at most {} are valid'.format(
            len(text), LONGEST))
    try:
        message = json.loads(text)
    except ValueError as problem:
        raise ValueError('a message is not JSON: {}'.format(problem)) from None
    if not isinstance(message, dict):
        raise ValueError('a message must be an object with "type"')
    kind = message.get('type')
    if not isinstance(kind, str) or kind not in READERS:
        raise _invalid('type', kind, 'one of ' + ', '.join(READERS))
    sent_at, pressed = (None if message.get(name) is None else _number(message, name, LATEST)
                        for name in ('t', 'pressed'))
    return Request(kind, READERS[kind](message), _id(message), sent_at, pressed)


def _id(message: Dict) -> Optional[int]:
    value = message.get('id')
    if value is not None and (isinstance(value, bool) or not isinstance(value, int)):
        raise _invalid('id', value, 'a whole number, or null')
    return value


def _look(message: Dict) -> Optional[str]:
    robot = message.get('robot')
    if robot is not None and not isinstance(robot, str):
        raise _invalid('robot', robot, 'a name, or null')
    return robot


def _pose(message: Dict) -> TypedPose:
    # the node refuses invalid poses too, but the page would not show its reason
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
    'turn': lambda message: _number(message, 'degrees', MOST_DEGREES, 'deg'),
    **dict.fromkeys(('begin', 'let go', 'give', 'take', 'stop'), lambda message: None)}


def _number(message: Dict, name: str, most: float, unit: str = '') -> float:
    """Returns the number called `name`: finite, from -`most` to `most`."""
    value = message.get(name)
    # the comparison is False for NaN, infinity, and integers that are too large for a float
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= most:
        valid = 'a number from {:g} to {:g} {}'.format(-most, most, unit)
        raise _invalid(name, value, valid.rstrip())
    return float(value)


def _flag(message: Dict, name: str) -> bool:
    value = message.get(name, False)
    if not isinstance(value, bool):
        raise _invalid(name, value, 'true or false')
    return value


def _invalid(name: str, value: Any, valid: str) -> ValueError:
    return ValueError('{} = {:.40} is not valid: {}'.format(name, json.dumps(value), valid))
