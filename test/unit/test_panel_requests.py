"""A message of a page is read exactly, or rejected with a reason."""
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.nodes.gamepad.pad import PadConfig
from tb3_labs.panel.requests import BrowserPad, HeldInputs, OpenPage, PageRequest, read_request
from tb3_labs.supervision.goal_requests import TypedPose

PAD = {'forward': 0.4, 'left': -0.1, 'a': False, 'y': False, 'hold': True}
GOAL = {'x': 1.0, 'y': -0.5, 'yaw_deg': 90}
#: {type: (fields of a valid message, value of the request)}
VALID = {
    'turn': ({'degrees': -90}, -90.0),
    'goal': (GOAL, TypedPose(1.0, -0.5, 90.0)), 'reset': (GOAL, TypedPose(1.0, -0.5, 90.0)),
    'joy': ({'pad': PAD, 'mouse': [0.25, -1], 'first': True},
            HeldInputs(BrowserPad(0.4, -0.1, hold=True), (0.25, -1.0), True)),
    'stop': ({}, None)}
#: Numbers of a message, and their bounds.
NUMBERS = [('turn', 'degrees', 360, 'deg'), ('goal', 'x', 100, 'm'), ('goal', 'y', 100, 'm'),
           ('goal', 'yaw_deg', 360, 'deg')]
BUTTONS = 'a', 'y', 'hold'


def text_of(kind, **changes):
    return json.dumps({**VALID[kind][0], 'type': kind, **changes})


def with_literal(kind, name, literal):
    """A message with any text in place of one value."""
    return text_of(kind, **{name: '@'}).replace('"@"', literal)


def pad_with(name, literal):
    return with_literal('joy', 'pad', json.dumps(dict(PAD, **{name: '@'})).replace('"@"', literal))


def refusal(text):
    with pytest.raises(ValueError) as caught:
        read_request(text)
    reason = str(caught.value)
    assert len(reason) < 300
    json.dumps(reason, allow_nan=False).encode()    # the reason goes back to the page
    return reason


@pytest.mark.parametrize('kind', VALID)
def test_each_type_is_read(kind):
    assert read_request(text_of(kind)) == PageRequest(kind, VALID[kind][1])


@pytest.mark.parametrize('button', BUTTONS)
def test_a_button_is_true_or_false(button):
    pad = {'forward': 0, 'left': 0, button: True}    # the message does not name the other buttons
    assert read_request(json.dumps({'type': 'joy', 'pad': pad})).value.pad == BrowserPad(**{button: True})
    for literal in '0', '1', 'null', '"true"':
        assert refusal(pad_with(button, literal)) == f'{button} is not valid: bool'


def test_a_message_may_have_an_id_a_time_and_a_number_of_stops():
    assert read_request(text_of('stop', id=7, t=86400.5, stops=3)) == PageRequest(
        'stop', id=7, sent_at=86400.5, known_stops=3)


@pytest.mark.parametrize('sent_at, lateness', [(99.5, 0.5), (100.1, 0.0), (0.0, 100.0), (-4e9, 4e9 + 100.0)])
def test_the_time_of_a_message_is_not_in_the_future(sent_at, lateness):
    assert PageRequest('stop', sent_at=sent_at).lateness(100.0) == lateness
    with pytest.raises(ValueError, match='t = 4000000000.0 is not valid: at most 100.0, which is now'):
        PageRequest('stop', sent_at=4e9).lateness(100.0)


@pytest.mark.parametrize('kind, name, most, unit', NUMBERS)
def test_bounds_are_closed(kind, name, most, unit):
    for sign in (1.0, -1.0):
        value = read_request(text_of(kind, **{name: sign * most})).value
        assert (value if kind == 'turn' else getattr(value, name)) == sign * most
        reason = refusal(text_of(kind, **{name: sign * (most + 0.001)}))
        assert reason == '{} = {} is not valid: a number from -{} to {} {}'.format(
            name, sign * (most + 0.001), most, most, unit)


@pytest.mark.parametrize('sign', [1, -1])
def test_sticks_and_mouse_reach_from_minus_one_to_one(sign):
    for name in ('forward', 'left'):
        assert getattr(read_request(pad_with(name, str(sign))).value.pad, name) == sign
        assert refusal(pad_with(name, str(1.001 * sign))).startswith(
            '{} = {} is not valid: a number from -1 to 1'.format(name, 1.001 * sign))
    for edge in ([sign, 0.5], [0.5, sign]):
        assert read_request(text_of('joy', mouse=edge)).value.mouse == tuple(edge)
        edge[edge.index(sign)] = 1.001 * sign
        assert refusal(text_of('joy', mouse=edge)).startswith('mouse = ')


@pytest.mark.parametrize('text', ['{"type": "joy", "pad": null, "mouse": null}', '{"type": "joy"}'])
def test_inputs_that_nobody_holds_are_null_or_missing(text):
    assert read_request(text) == PageRequest('joy', HeldInputs())


@pytest.mark.parametrize('literal, shown', [
    ('NaN', 'NaN'), ('-Infinity', '-Infinity'), ('1e400', 'Infinity'), ('true', 'true'),
    ('null', 'null'), ('"1"', '"1"'), ('[1]', '[1]'), ('{}', '{}'),
    ('-1' + '0' * 350, '-1' + '0' * 38)], ids=lambda text: text[:9])
def test_an_invalid_number_is_refused(literal, shown):
    """Python reads NaN and infinity, which JSON does not have."""
    texts = {name: with_literal(kind, name, literal) for kind, name, _, _ in NUMBERS}
    texts.update({'t': with_literal('turn', 't', literal)} if literal != 'null' else {})
    texts.update({name: pad_with(name, literal) for name in ('forward', 'left')})
    texts['mouse'] = with_literal('joy', 'mouse', '[%s, 0]' % literal)
    for name, text in texts.items():
        assert refusal(text).startswith('{} = {} is not valid: a number from -'.format(name, shown))
    assert ' = null is not valid' in refusal('{"type": "turn"}')


@pytest.mark.parametrize('kind, name, literals', [
    *[('turn', name, ['1.0', 'true', '"7"', '[7]', 'NaN']) for name in ('id', 'stops')],
    ('joy', 'first', ['1', '0', 'null', '"true"']), ('joy', 'pad', ['1', 'true', '[]', '""', '0', 'false']),
    ('joy', 'mouse', ['1', 'true', '"ab"', '[]', '[0.5]', '[0, 0, 0]', 'false'])])
def test_a_value_of_a_wrong_type_is_refused(kind, name, literals):
    for literal in literals:
        assert refusal(with_literal(kind, name, literal)).startswith(f'{name} is not valid: ')


@pytest.mark.parametrize('text', [
    *['{"type": %s}' % literal for literal in ('"fly"', '""', '"Stop"', 'null', '["stop"]', '"\\ud800"')],
    '[]', '"stop"', 'null', '', '{"type": "stop"', '\ud800', b'\xff'])
def test_a_text_without_a_known_type_is_refused(text):
    assert 'is not valid: an object with a known "type"' in refusal(text)


@pytest.mark.parametrize('literal', ['NaN', '1e400', '"now"', '[7]', '{}', 'true', '-1', '4e9'])
@pytest.mark.parametrize('name', ['id', 't', 'stops', 'more'])
def test_a_stop_with_other_invalid_fields_is_a_stop(name, literal):
    assert read_request('{"type": "stop", "%s": %s}' % (name, literal)).type == 'stop'


def test_the_longest_message():
    text = '{"type": "stop"}'
    assert read_request(text + ' ' * (500 - len(text))).type == 'stop'
    assert refusal(text + ' ' * (501 - len(text))) == (
        'a message of 501 characters is refused: at most 500 are valid')


OWN = dict(relinquish_button=4, regain_button=9, reset_button=0, hold_button=7)


@pytest.mark.parametrize('pad, config, axes, buttons, sizes', [
    # the handout has no hold button
    (BrowserPad(0.5, -0.25, a=True, y=True), {}, {1: 0.5, 3: -0.25}, {0, 2}, (8, 11)),
    (BrowserPad(hold=True), {}, {}, set(), (8, 11)),
    *[(BrowserPad(**{button: True}), OWN, {}, {number}, (8, 11))
      for button, number in (('a', 4), ('b', 9), ('y', 0), ('hold', 7))],
    (BrowserPad(0.5, -0.25, b=True), dict(linear_axis=31, angular_axis=0, regain_button=10),
     {31: 0.5, 0: -0.25}, {10}, (32, 11)),
    (BrowserPad(0.5, -0.25, b=True), dict(linear_axis=7, angular_axis=8, regain_button=11),
     {7: 0.5, 8: -0.25}, {11}, (9, 12))])
def test_a_pad_is_a_joy_with_the_numbers_of_its_functions(pad, config, axes, buttons, sizes):
    shown, states = pad.as_joy(PadConfig(**config))
    assert {number: value for number, value in enumerate(shown) if value} == axes
    assert {number for number, state in enumerate(states) if state} == buttons
    assert (len(shown), len(states)) == sizes and set(map(type, states)) == {int}    # as in Joy


def test_nan_is_never_sent():
    with pytest.raises(ValueError):
        OpenPage(print).send('picture', heading_deg=math.nan)


def test_answers_have_the_number_of_their_request():
    messages = []
    page = OpenPage(lambda text: messages.append(json.loads(text)))
    page.answer(PageRequest('stop', id=7), True, 'done')
    page.answer(PageRequest('stop'), True, 'done')    # without a number nobody waits for the answer
    page.answer(PageRequest('stop'), False, 'why')
    page.answer(None, False, 'unreadable')
    assert messages == [
        {'type': 'answer', 'id': 7, 'ok': True, 'text': 'done'},
        {'type': 'refused', 'text': 'why'}, {'type': 'refused', 'text': 'unreadable'}]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
    | st.just(10 ** 310),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(list(PAD)) | st.text(max_size=3), inner, max_size=4), max_leaves=6)
MESSAGES = st.sampled_from(sorted(VALID)).flatmap(lambda kind: st.dictionaries(
    st.sampled_from(['id', 't', 'stops', *VALID[kind][0]]), JSON, max_size=4).map(
        lambda fields: text_of(kind, **fields)))


def is_valid(value):
    """Is each number of a request finite?"""
    if isinstance(value, tuple):
        return all(is_valid(part) for part in value)
    return not isinstance(value, float) or math.isfinite(value)


@given(st.text() | MESSAGES)
def test_any_text_gives_a_request_or_a_reason(text):
    try:
        request = read_request(text)
    except ValueError as error:
        assert str(error)
    else:
        assert isinstance(request, PageRequest) and request.type in VALID and is_valid(request)
