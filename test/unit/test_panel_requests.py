"""A message of a page is read exactly, or rejected with a reason; nothing else can happen."""
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.geometry.se2 import TypedPose
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.panel.requests import Joy, Pad, Request, Viewer, read_request

PAD = {'forward': 0.4, 'left': -0.1, 'a': False, 'b': True, 'y': False, 'hold': True}
GOAL = {'x': 1.0, 'y': -0.5, 'yaw_deg': 90}
#: By type: the fields of a valid message.
VALID = {
    'look': {'robot': 'robot3'}, 'seen': {'n': 20}, 'begin': {}, 'let go': {}, 'give': {},
    'take': {}, 'stop': {}, 'joy': {'pad': PAD, 'mouse': [0.25, -1]}, 'turn': {'degrees': -90},
    'goal': GOAL, 'reset': GOAL}
#: Numbers as a hostile page writes them.
NO_NUMBERS = ['NaN', 'Infinity', '-Infinity', '1e400', '-1e400', '-1' + '0' * 1800, 'true', 'null',
              '"1"', '[1]', '{}']
#: A number, its type, and its bound.
NUMBERS = [('turn', 'degrees', 360), ('goal', 'x', 100), ('goal', 'y', 100),
           ('goal', 'yaw_deg', 360), ('reset', 'x', 100)]


def short(value):
    """The name of a case."""
    return repr(value)[:24]


def text_of(kind, **changes):
    return json.dumps(dict(VALID[kind], type=kind, **changes))


def with_literal(kind, name, literal):
    """A message with any text in place of one value."""
    return text_of(kind, **{name: '@'}).replace('"@"', literal)


def pad_with(name, literal):
    return '{"type": "joy", "pad": %s}' % json.dumps(dict(PAD, **{name: '@'})).replace(
        '"@"', literal)


def refusal(text):
    with pytest.raises(ValueError) as caught:
        read_request(text)
    reason = str(caught.value)
    assert len(reason) < 300
    json.dumps(reason, allow_nan=False).encode()    # it goes back to the page
    return reason


# -- what is valid

@pytest.mark.parametrize('kind, value', [
    ('look', 'robot3'), ('seen', 20), ('begin', None), ('let go', None), ('give', None),
    ('take', None), ('stop', None), ('turn', -90.0), ('goal', TypedPose(1.0, -0.5, 90.0)),
    ('reset', TypedPose(1.0, -0.5, 90.0)),
    ('joy', Joy(Pad(0.4, -0.1, False, True, False, True), (0.25, -1.0)))])
def test_each_type_is_read(kind, value):
    assert read_request(text_of(kind)) == Request(kind, value, None, None)


def test_all_types_are_tested():
    known = refusal('{"type": "fly"}').split('known: ')[1].split(', ')
    assert sorted(known) == sorted(VALID)


@pytest.mark.parametrize('button', ['a', 'b', 'y', 'hold'])
def test_each_button_is_itself(button):
    pad = {'forward': 0, 'left': 0, button: True}    # the others are not named
    value = read_request(json.dumps({'type': 'joy', 'pad': pad})).value.pad
    assert [name for name in ('a', 'b', 'y', 'hold') if getattr(value, name)] == [button]


def test_any_message_may_have_an_id_its_time_in_milliseconds_and_that_of_the_press():
    request = read_request(text_of('give', id=7, t=1722945600123.25, pressed=86400.125))
    assert request.id == 7 and request.pressed == 86400.125
    assert request.sent_at == pytest.approx(1722945600.12325, abs=1e-6)


@pytest.mark.parametrize('number', [0, 1, 10 ** 12])
def test_whole_numbers_from_zero(number):
    assert read_request(text_of('begin', id=number)).id == number
    assert read_request(text_of('seen', n=number)).value == number


@pytest.mark.parametrize('kind, name, most', NUMBERS)
def test_bounds_are_closed(kind, name, most):
    for sign in (1.0, -1.0):
        value = read_request(text_of(kind, **{name: sign * most})).value
        assert (value if kind == 'turn' else getattr(value, name)) == sign * most
        reason = refusal(text_of(kind, **{name: sign * (most + 0.001)}))
        assert reason == '{} = {} is not valid: a number from -{} to {} {}'.format(
            name, sign * (most + 0.001), most, most, 'm' if most == 100 else 'deg')


@pytest.mark.parametrize('sign', [1, -1])
def test_sticks_and_mouse_reach_from_minus_one_to_one(sign):
    for name in ('forward', 'left'):
        assert getattr(read_request(pad_with(name, str(sign))).value.pad, name) == sign
        assert refusal(pad_with(name, str(1.001 * sign))).startswith(
            '{} = {} is not valid: a number from -1 to 1'.format(name, 1.001 * sign))
    for edge in ([sign, 0.5], [0.5, sign]):
        assert read_request(text_of('joy', mouse=edge)).value.mouse == tuple(edge)
        edge[edge.index(sign)] = 1.001 * sign
        assert 'mouse = {} is not valid: a number from -1 to 1'.format(1.001 * sign) in refusal(
            text_of('joy', mouse=edge))


# -- what is refused

@pytest.mark.parametrize('literal', NO_NUMBERS, ids=short)
def test_a_value_that_is_not_a_number_of_this_size_is_refused(literal):
    texts = {name: with_literal(kind, name, literal) for kind, name, _ in NUMBERS}
    texts.update(forward=pad_with('forward', literal), left=pad_with('left', literal),
                 mouse=with_literal('joy', 'mouse', '[%s, 0]' % literal))
    for name, text in texts.items():
        if literal in ('NaN', 'Infinity', '-Infinity'):    # Python's reader alone takes them
            assert refusal(text) == 'a message is not JSON: {} is not a number'.format(literal)
        else:
            reason = refusal(text)
            assert reason.startswith(name + ' = ') and 'not valid: a number from -' in reason


@pytest.mark.parametrize('literal, shown', [
    ('true', 'true'), ('"far"', '"far"'), ('null', 'null'), ('[1]', '[1]'), ('1e400', 'Infinity'),
    ('1e300', '1e+300'), ('1' + '0' * 400, '1' + '0' * 36 + '...')], ids=short)
def test_a_refusal_names_field_value_and_what_is_valid(literal, shown):
    assert refusal(with_literal('goal', 'x', literal)) == (
        'x = {} is not valid: a number from -100 to 100 m'.format(shown))


def test_a_field_that_is_missing_is_refused():
    for text in '{"type": "turn"}', '{"type": "seen"}', '{"type": "joy", "pad": {"left": 0}}':
        assert ' = null is not valid' in refusal(text)


@pytest.mark.parametrize('text, request_', [
    ('{"type": "look", "robot": null}', Request('look')), ('{"type": "look"}', Request('look')),
    ('{"type": "joy", "pad": null, "mouse": null}', Request('joy', Joy())),
    ('{"type": "joy"}', Request('joy', Joy()))])
def test_nothing_gripped_and_no_robot_are_null_or_missing(text, request_):
    assert read_request(text) == request_


@pytest.mark.parametrize('literal', [
    '-1', '1.0', '1000000000001', 'true', '"7"', '[7]', '1' + '0' * 1900], ids=short)
@pytest.mark.parametrize('kind, name', [('seen', 'n'), ('begin', 'id')])
def test_a_value_that_is_not_a_whole_number_is_refused(kind, name, literal):
    reason = refusal(with_literal(kind, name, literal))
    assert reason.startswith(name + ' = ') and reason.endswith('not valid: a whole number from 0')


@pytest.mark.parametrize('name', ['t', 'pressed'])
def test_a_value_that_is_not_a_time_is_refused(name):
    for literal in 'true', '"7"', '1e16':
        assert refusal(with_literal('begin', name, literal)).startswith(name + ' = ')


@pytest.mark.parametrize('literal', ['0', '1', 'null', '"true"'])
@pytest.mark.parametrize('button', ['a', 'b', 'y', 'hold'])
def test_a_button_is_true_or_false(button, literal):
    assert refusal(pad_with(button, literal)) == '{} = {} is not valid: true or false'.format(
        button, literal)


@pytest.mark.parametrize('kind, name, valid, literals', [
    ('joy', 'pad', 'an object, or null', ['1', 'true', '[]', '""', '0', 'false']),
    ('joy', 'mouse', '[x, y], or null', ['1', 'true', '"ab"', '[]', '[0.5]', '[0, 0, 0]', 'false']),
    ('look', 'robot', 'a name, or null', ['3', 'true', '["robot3"]', '0', 'false'])])
def test_a_value_of_another_kind_is_refused(kind, name, valid, literals):
    for literal in literals:
        assert refusal('{{"type": "{}", "{}": {}}}'.format(kind, name, literal)) == (
            '{} = {} is not valid: {}'.format(name, literal, valid))


@pytest.mark.parametrize('literal', [
    '"fly"', '""', '"Stop"', 'null', '["stop"]', '"\\ud800"', '"' + 1800 * 'x' + '"'], ids=short)
def test_a_type_that_is_unknown_is_refused_with_those_that_are_known(literal):
    reason = refusal('{"type": %s}' % literal)
    assert reason.startswith('type {}'.format(literal[:36])) and 'known: look, joy' in reason


@pytest.mark.parametrize('text', ['[]', '"stop"', '1', 'null'])
def test_a_message_is_an_object(text):
    assert refusal(text) == 'a message must be an object with "type"'


@pytest.mark.parametrize('text', ['', 'stop', '{"type": "stop"', '\ud800', b'\xff'])
def test_a_text_that_is_not_json_is_refused(text):
    """A page may send bytes, too."""
    assert refusal(text).startswith('a message is not JSON: ')
    assert read_request(b'{"type": "stop"}').kind == 'stop'


def test_the_longest_message():
    text = '{"type": "stop"}'
    assert read_request(text + ' ' * (2000 - len(text))).kind == 'stop'
    assert refusal(text + ' ' * (2001 - len(text))) == (
        'a message of 2001 characters is refused: at most 2000 are valid')


@pytest.mark.parametrize('text', [
    '%s', '{"type": %s}', '{"type": "look", "robot": %s}', '{"type": "seen", "n": %s}',
    '{"type": "stop", "id": %s}', '{"type": "stop", "t": %s}', '{"type": "turn", "degrees": %s}',
    '{"type": "joy", "pad": %s}', '{"type": "joy", "mouse": %s}',
    '{"type": "joy", "mouse": [0, %s]}',
    '{"type": "joy", "pad": {"forward": 0, "left": 0, "a": %s}}'])
def test_a_message_as_deep_as_its_length_allows(text):
    """The depth at which Python's reader, its writer or repr() gives up depends on the caller."""
    for depth in (1, 500, *range(900, 971, 2)):
        refusal(text % ('[' * depth + ']' * depth))


# -- its pad, as the node gamepad was started

def test_with_the_handouts_numbers():
    """Axis 1 drives, axis 3 turns; A, B and Y are the buttons 0, 1 and 2."""
    axes, buttons = Pad(0.5, -0.25, a=True, y=True).as_joy(PadConfig())
    assert axes == [0.0, 0.5, 0.0, -0.25, 0.0, 0.0, 0.0, 0.0]
    assert buttons == [1, 0, 1] + [0] * 8
    assert set(map(type, buttons)) == {int}        # as sensor_msgs/Joy has them


@pytest.mark.parametrize('button, number', [('a', 4), ('b', 9), ('y', 0), ('hold', 7)])
def test_each_button_has_the_number_of_its_function(button, number):
    config = PadConfig(relinquish_button=4, regain_button=9, reset_button=0, hold_button=7)
    _, buttons = Pad(**{button: True}).as_joy(config)
    assert [number for number, state in enumerate(buttons) if state] == [number]
    assert Pad(hold=True).as_joy(PadConfig()) == Pad().as_joy(PadConfig())    # no button of its own


@pytest.mark.parametrize('linear, angular, button', [
    (31, 0, 3), (0, 31, 10), (8, 9, 11), (7, 6, 31)])
def test_axes_and_buttons_of_any_number(linear, angular, button):
    config = PadConfig(linear_axis=linear, angular_axis=angular, regain_button=button)
    axes, buttons = Pad(0.5, -0.25, b=True).as_joy(config)
    assert len(axes) == max(8, linear + 1, angular + 1) and len(buttons) == max(11, button + 1)
    assert {number: axis for number, axis in enumerate(axes) if axis} == {
        linear: 0.5, angular: -0.25}
    assert buttons.index(1) == button and sum(buttons) == 1


# -- what is sent to a page, and its pace

def viewer_of(sent=0):
    """A page to which that many pictures were sent; its messages are kept."""
    messages = []
    viewer = Viewer(lambda text: messages.append(json.loads(text)), lambda: None)
    viewer.messages = messages
    for _ in range(sent):
        viewer.send_picture({'odom': None})
    return viewer


def test_pictures_are_numbered_from_one():
    assert viewer_of(3).messages == [
        {'type': 'picture', 'odom': None, 'n': number} for number in (1, 2, 3)]


@pytest.mark.parametrize('seen', [0, 1, 20])
def test_it_is_dropped_60_pictures_after_the_one_that_it_has_seen(seen):
    viewer = viewer_of(20)
    for number in (seen, 0):    # an older report takes nothing back
        viewer.has_seen(number)
    while viewer.sent < seen + 59:
        viewer.send_picture({})
        assert not viewer.is_too_slow
    viewer.send_picture({})
    assert viewer.is_too_slow
    viewer.has_seen(seen + 1)
    assert not viewer.is_too_slow


def test_a_picture_that_was_not_sent_cannot_be_seen():
    viewer = viewer_of(20)
    with pytest.raises(ValueError, match='picture 21 was not sent yet: the last one is 20'):
        viewer.has_seen(21)
    for _ in range(40):
        viewer.send_picture({})
    assert viewer.is_too_slow        # the invalid report does not count


def test_a_number_that_json_does_not_have_is_never_sent():
    with pytest.raises(ValueError):
        viewer_of().send('picture', heading_deg=math.nan)


def test_answers_have_the_number_of_their_request():
    viewer = viewer_of()
    viewer.answer(Request('stop', id=7), True, 'done')
    viewer.answer(Request('stop'), True, 'done')    # without a number nobody waits for it
    viewer.answer(Request('stop'), False, 'why')
    viewer.answer(None, False, 'unreadable')
    assert viewer.messages == [
        {'type': 'answer', 'id': 7, 'ok': True, 'text': 'done'},
        {'type': 'note', 'text': 'why', 'warning': True},
        {'type': 'note', 'text': 'unreadable', 'warning': True}]


def test_a_request_is_pressed_when_it_was_sent_or_earlier():
    """The page's clock is 500 s ahead of the panel's."""
    viewer = viewer_of()
    assert viewer.timed(Request('stop', sent_at=600.0), 100.0).pressed == 100.0
    late = viewer.timed(Request('give', sent_at=601.0), 101.5)
    assert (late.lateness, late.pressed) == (0.5, 101.0)
    assert viewer.timed(Request('give', sent_at=602.0, pressed=90.0), 102.0).pressed == 90.0
    assert viewer.timed(Request('give', sent_at=603.0, pressed=999.0), 103.0).pressed == 103.0
    assert viewer.timed(Request('give'), 104.0) == Request('give', pressed=104.0)


# -- whatever comes

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
    | st.integers(0, 3).map(lambda power: 10 ** (310 * power)),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(list(PAD)) | st.text(max_size=3), inner, max_size=4), max_leaves=6)
MESSAGES = st.fixed_dictionaries({'type': st.sampled_from(sorted(VALID))}).flatmap(
    lambda message: st.dictionaries(
        st.sampled_from(['id', 't', *VALID[message['type']]]), JSON, max_size=4).map(
            lambda fields: dict(VALID[message['type']], **fields, **message)))


def is_valid(value):
    """No number of a request is infinite or NaN."""
    if isinstance(value, tuple):
        return all(is_valid(part) for part in value)
    return not isinstance(value, float) or math.isfinite(value)


def check(text):
    try:
        request = read_request(text)
    except ValueError as problem:
        assert str(problem)
    else:
        assert isinstance(request, Request) and request.kind in VALID and is_valid(request)


@given(st.text() | MESSAGES.map(json.dumps))
def test_any_text_gives_a_request_or_a_reason(text):
    check(text)
