"""One page drives, only while it is there, and nothing goes on by itself after a stop."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.panel.requests import Joy, Pad
from tb3_labs.panel.holder import Holder, LatePad, MouseState

OLD = 'pressed before the robot was stopped'
REST, FULL, B = Pad(), Pad(forward=1.0, hold=True), Pad(b=True)
EMPTY = Joy()
#: A person presses later than what happened before, by this [s] at least.
TICK = 2.0 ** -20


class Room:
    """A holder and its clock. Times are sums of powers of two: exact."""

    def __init__(self):
        self.holder = Holder()
        self.now = 1000.0

    def joy(self, page, pad=None, mouse=None, lateness=0.0):
        self.holder.on_joy(page, Joy(pad, mouse), self.now, lateness)

    def drive(self, page='A', pad=FULL, mouse=None):
        """`page` becomes the holder and grips; the messages of that are dropped."""
        self.begin(page)
        self.joy(page, pad, mouse)
        self.said()

    def begin(self, page='A'):
        self.now += TICK
        self.holder.begin(page, self.now, pressed=self.now)

    def give(self, page='A'):
        self.now += TICK
        self.holder.give(page, self.now, pressed=self.now)

    def run(self, seconds):
        self.now += seconds
        self.holder.update(self.now)

    def said(self):
        """(grants, pads, mouse states) since the last call."""
        return self.holder.take_messages()

    @property
    def grants(self):
        return self.said()[0]


@pytest.fixture
def room():
    return Room()


# -- one driver

def test_of_several_pages_one_drives(room):
    room.drive('A')
    for ask in (room.begin, room.give):
        with pytest.raises(ValueError, match='another page drives'):
            ask('B')
    room.joy('B', Pad(1.0, 1.0, a=True, y=True, hold=True), (1.0, 1.0))
    assert room.said() == ([], [], []) and room.holder.page == 'A' and not room.holder.has_granted
    room.joy('A', REST, lateness=0.125)
    assert room.said() == ([], [LatePad(REST, 0.125)], [])
    room.holder.let_go('A')
    room.begin('B')
    assert room.holder.page == 'B' and room.holder.take_news() == []


# -- pad and mouse

def test_the_time_since_a_pad_is_heard(room):
    room.drive(pad=None)
    assert room.holder.pad_heard_for(room.now) == 0.0
    for pad, elapsed in ((REST, 0.0), (REST, 0.125), (REST, 0.25), (None, 0.0), (REST, 0.0)):
        room.joy('A', pad)
        assert room.holder.pad_heard_for(room.now) == elapsed
        room.run(0.125)


@pytest.mark.parametrize('drives, mouse_states', [
    ([True, False, True], [MouseState(False), MouseState(True, 0.0, 1.0), MouseState(False)]),
    ([False, True, True], [])])
def test_a_mouse_that_is_held_while_another_node_drives_must_be_gripped_anew(
        room, drives, mouse_states):
    room.begin()
    for mouse_drives in drives:
        room.holder.on_joy('A', Joy(mouse=(0.0, 1.0)), room.now, mouse_drives=mouse_drives)
    assert room.said()[2] == mouse_states
    for mouse in (None, (0.25, -1.0), (0.0, 0.0), None, None):
        room.joy('A', None, mouse)
    assert room.said()[2] == [MouseState(False), MouseState(True, 0.25, -1.0),
                              MouseState(True, 0.0, 0.0), MouseState(False)]


# -- silence

@pytest.mark.parametrize('silence, lost', [(0.25, False), (0.25 + 2.0 ** -30, True)])
@pytest.mark.parametrize('heard_by', ['begin', 'joy', 'give'])
def test_a_page_is_lost_by_a_silence_of_more_than_a_quarter_of_a_second(
        room, silence, lost, heard_by):
    room.drive()
    room.run(0.125)
    {'begin': lambda: room.begin('A'), 'joy': lambda: room.joy('A', FULL),
     'give': room.give}[heard_by]()
    room.said()
    room.run(silence)
    assert (room.holder.page is None) is lost
    assert room.said() == ([False] if lost and heard_by == 'give' else [], [], [])


def test_a_loss_releases_all_that_was_held_and_is_told_once(room):
    room.give()
    room.joy('A', FULL, (0.5, 0.5))
    room.said()
    room.run(0.5)
    assert room.said() == ([False], [], [MouseState(False)])
    assert room.holder.pad is None and not room.holder.has_granted
    news, = room.holder.take_news()
    assert news.warning and news.text == (
        'The page that drives is silent for 0.5 s: robot stopped; '
        'grip a control of the page to drive again')
    room.run(10.0)
    room.holder.gone('A')
    assert room.said() == ([], [], []) and room.holder.take_news() == []


@pytest.mark.parametrize('hold', [
    lambda room: room.joy('A', FULL), lambda room: room.joy('A', None, (0.0, 0.0)),
    lambda room: room.give(), None])
def test_a_loss_is_told_if_anything_was_held(room, hold):
    room.drive(pad=None)
    if hold:
        hold(room)
    room.holder.gone('A')
    assert [news.text.split(':')[0] for news in room.holder.take_news()] == [
        'The page that drives has gone'] * bool(hold)


def test_a_grant_that_was_pressed_before_the_page_was_lost_does_not_count(room):
    room.give()
    pressed = room.now + 0.125
    room.run(0.5)
    with pytest.raises(ValueError, match=OLD):
        room.holder.give('A', room.now, pressed)
    room.give()
    assert room.grants == [True, False, True]


@pytest.mark.parametrize('late, counts', [(0.25, True), (0.25 + 2.0 ** -30, False), (1.0, False)])
def test_a_message_that_was_delayed_for_as_long_does_not_count(room, late, counts):
    room.drive(pad=None)
    room.run(0.125)
    room.joy('A', FULL, (1.0, 1.0), late)
    assert (room.said() != ([], [], [])) is counts
    room.run(0.25)
    assert (room.holder.page == 'A') is counts      # nor does it keep the robot
    assert (room.holder.pad == FULL) is counts


def test_a_silence_is_noticed_by_the_next_message_also_if_nobody_looked_at_the_clock(room):
    room.give()
    room.joy('A', FULL, (0.5, 0.5))
    room.said()
    room.now += 0.5
    room.joy('A', FULL, (0.5, 0.5))
    assert room.said() == ([False], [], [MouseState(False)]) and room.holder.page is None
    room.give('A')
    room.now += 0.5
    room.begin('B')
    assert room.holder.page == 'B' and room.grants == [True, False]


# -- control

@pytest.mark.parametrize('end', [
    lambda room: room.holder.take('A', room.now), lambda room: room.holder.on_taken(room.now),
    lambda room: room.holder.stop('B', room.now), lambda room: room.holder.let_go('A'),
    lambda room: room.holder.gone('A'), lambda room: room.run(0.5),
    lambda room: room.joy('B', B)])
def test_control_that_was_taken_by_anybody_is_given_again_by_a_person_alone(room, end):
    room.give()
    room.joy('A', REST)
    end(room)
    assert room.grants == [True, False] and not room.holder.has_granted
    for _ in range(4):
        room.joy('A', REST)
        room.run(0.125)
    assert room.grants == [] and not room.holder.has_granted
    room.give()
    assert room.grants == [True] and room.holder.has_granted


@pytest.mark.parametrize('end', [
    lambda room: room.holder.let_go('A'), lambda room: room.holder.gone('A'),
    lambda room: room.holder.on_taken(room.now)])
def test_a_page_that_gave_nothing_takes_nothing(room, end):
    """Another page, or a pad, may have given control meanwhile."""
    room.drive()
    end(room)
    assert room.said() == ([], [], [])


def test_the_page_that_drives_takes_control_and_keeps_what_it_holds(room):
    """Also control that another one gave."""
    room.drive('A', FULL, (0.5, 0.5))
    room.holder.take('A', room.now)
    assert room.said() == ([False], [], [])
    assert room.holder.page == 'A' and room.holder.pad == FULL


# -- a press that is older than a stop

STOPS = {
    'stop': lambda room: room.holder.stop('B', room.now),
    'take': lambda room: room.holder.take('B', room.now),
    'B': lambda room: room.joy('B', B),
    'False of another node': lambda room: room.holder.on_taken(room.now),
    'loss of control': lambda room: [room.holder.on_control(granted, room.now)
                                     for granted in (True, False)],
    'cancel': lambda room: room.holder.on_stop(room.now)}


@pytest.mark.parametrize('stop', STOPS.values(), ids=list(STOPS))
def test_a_press_before_a_stop_does_not_count_after_it(room, stop):
    """It was held up on its way; another one has stopped the robot meanwhile."""
    pressed = room.now
    room.run(1.0)
    stop(room)
    room.said()
    room.run(0.9)
    for at in (pressed, pressed + 1.0):
        for ask in (room.holder.begin, room.holder.give):
            with pytest.raises(ValueError, match=OLD):
                ask('A', room.now, at)
        with pytest.raises(ValueError, match=OLD):
            room.holder.check('A', at)
    assert room.said() == ([], [], []) and room.holder.page is None
    room.holder.give('A', room.now, pressed + 1.0 + TICK)
    assert room.grants == [True] * 9      # with the renewals of 0.84 s, which show its age


def test_a_press_that_waited_in_a_page_while_it_stopped_the_robot_does_not_count(room):
    """A press may wait in the page, and STOP overtakes it."""
    pressed = room.now
    room.run(1.0)
    room.holder.stop('A', room.now, pressed + 0.9)
    with pytest.raises(ValueError, match=OLD):
        room.holder.give('A', room.now, pressed + 0.9)
    room.holder.give('A', room.now, pressed + 0.95)


def test_a_stop_of_the_page_itself_is_older_than_what_comes_after_it(room):
    """It may have been slow, so that the next press is older than its arrival. Another's is not."""
    pressed = room.now
    room.run(0.125)
    for _ in range(2):
        room.holder.stop('A', room.now)
        room.holder.check('A', pressed)
    room.holder.stop('B', room.now)
    room.holder.stop('A', room.now + 0.125)
    for page in 'ABC':
        with pytest.raises(ValueError):
            room.holder.check(page, room.now)
    room.holder.check('A', room.now + TICK)


@pytest.mark.parametrize('stop', [STOPS[name] for name in (
    'False of another node', 'loss of control', 'cancel')])
def test_a_that_was_pressed_before_a_stop_is_not_shown_until_it_is_pressed_anew(room, stop):
    """Also if it is still held."""
    room.drive('A', REST)
    pressed = room.now + TICK
    room.holder.on_joy('A', Joy(Pad(a=True)), room.now, pressed=pressed)
    room.now += 2 * TICK
    stop(room)
    for at in (pressed, pressed, room.now + 1.0):    # the last: of a page that tells no press
        room.holder.on_joy('A', Joy(Pad(a=True)), room.now, pressed=at)
    assert [late.pad for late in room.said()[1]] == [Pad(a=True), REST, REST, REST]
    news, = room.holder.take_news()
    assert news.warning and news.text == (
        'A was pressed before the robot was stopped: press it again')
    room.joy('A', REST)
    room.holder.on_joy('A', Joy(Pad(a=True)), room.now, pressed=room.now + TICK)
    assert room.said()[1][-1].pad.a
    room.holder.let_go('A')
    room.begin('B')
    room.holder.on_joy('B', Joy(Pad(a=True)), room.now, pressed=room.now + TICK)
    assert room.said()[1][-1].pad.a


def test_control_that_was_lost_by_itself_is_given_anew(room):
    """A node that hears True again and again does not count it as a new grant."""
    room.holder.on_control(False, room.now)    # it had none before
    room.holder.give('A', room.now, room.now)
    room.holder.on_control(True, room.now)
    room.joy('A')
    room.run(0.125)
    room.holder.on_control(False, room.now)
    room.joy('A')
    assert room.grants == [True]      # it may come back, if the network was slow
    room.give()
    assert room.grants == [False, True] and room.holder.has_granted
    room.give()
    assert room.grants == []
    for granted in (True, False, True):    # it was lost, and came back
        room.holder.on_control(granted, room.now)
    room.give()
    assert room.grants == []


# -- the button B

def test_b_counts_once_for_each_press_although_no_page_holds_the_robot(room):
    for pad in (B, B, Pad(b=True, forward=1.0), REST, FULL, B, None, B, B):
        room.joy('B', pad)
    assert room.said() == ([False] * 3, [], [MouseState(True), MouseState(False)] * 3)


def test_b_of_two_pages_counts_for_each_of_them(room):
    """A page whose connection is held up may never tell that its B was released."""
    room.joy('B', B)
    room.give('A')
    room.said()
    room.joy('C', B)
    assert room.grants == [False] and not room.holder.has_granted
    room.joy('B', B)
    room.joy('C', B)
    assert room.grants == []


def test_b_that_is_held_through_a_loss_is_not_pressed_again_until_its_page_has_left(room):
    room.drive('A', B)
    room.run(0.5)
    room.give('C')
    room.joy('A', B)
    assert room.grants == [True] and room.holder.has_granted
    room.holder.gone('A')
    room.joy('A', B)
    assert room.grants == [False]


def test_b_of_the_holder_takes_control_although_no_node_may_hear_its_pad(room):
    """Its pad is not sent while another pad publishes, and the node gamepad may not run."""
    room.give('A')
    for pad in (REST, B, B, REST):
        room.joy('A', pad)
    assert room.said() == ([True, False], [LatePad(pad, 0.0) for pad in (REST, B, B, REST)], [])
    assert room.holder.page == 'A' and not room.holder.has_granted


@pytest.mark.parametrize('late', [0.3, 100.0])
def test_b_counts_however_late_it_is(room, late):
    room.give('A')
    room.joy('A', Pad(forward=1.0, b=True), (1.0, 1.0), late)
    assert room.said() == ([True, False], [], []) and not room.holder.has_granted
    room.joy('A', Pad(b=True), lateness=late)
    assert room.grants == []


# -- stop

@pytest.mark.parametrize('pad', [None, FULL])
@pytest.mark.parametrize('gives', [True, False])
@pytest.mark.parametrize('stop', ['stop', 'take', 'B'])
def test_a_stop_take_and_b_of_another_page_end_everything(room, pad, gives, stop):
    """The pad rests and takes the robot; an active mouse that is released also gives a turn up."""
    room.drive('A', pad, (1.0, 1.0))
    if gives:
        room.give()
    room.said()
    STOPS[stop](room)
    assert room.said() == ([False], [LatePad(B, 0.0)] if pad else [],
                           [MouseState(True), MouseState(False)])
    assert room.holder.page is None and room.holder.pad is None and not room.holder.has_granted
    room.joy('A', FULL, (0.5, 0.5))
    assert room.said() == ([], [], [])


# -- whatever comes

PAGES = st.sampled_from('ABC')
PADS = st.sampled_from([None, REST, FULL, B, Pad(a=True)])
AGES = st.sampled_from([0.0, 0.0, 0.1, 1.0])    # of a press
STEPS = st.lists(st.one_of(
    st.tuples(st.sampled_from(['begin', 'give']), PAGES, AGES),
    st.tuples(st.sampled_from(['let_go', 'gone', 'take', 'stop']), PAGES),
    st.tuples(st.just('on_joy'), PAGES, PADS, st.sampled_from([None, (0.5, 0.5)]),
              st.sampled_from([0.0, 0.0, 0.25, 0.3, 4.0]), AGES),
    st.tuples(st.sampled_from(['on_taken', 'on_stop'])),
    st.tuples(st.just('on_control'), st.booleans()),
    st.tuples(st.just('wait'), st.sampled_from([0.0625, 0.125, 0.25, 0.3, 5.0]))), max_size=25)


def tell(holder, now, kind, *details):
    """One step of a story, at `now`. Returns whether it may give control, and whether its pad and
    mouse may drive."""
    driver = holder.page
    if kind == 'on_joy':
        page, pad, mouse, late, age = details
        holder.on_joy(page, Joy(pad, mouse), now, late, pressed=now - age)
        return False, page == driver and late <= 0.25
    if kind in ('begin', 'give'):
        page, age = details
        try:
            getattr(holder, kind)(page, now, now - age)
        except ValueError:
            return False, False
        assert driver in (None, page)
        return kind == 'give', False
    if kind in ('let_go', 'gone'):
        getattr(holder, kind)(*details)
    elif kind != 'wait':
        getattr(holder, kind)(*details, now)
    return False, False


@given(STEPS)
def test_nothing_goes_on_without_a_person_whatever_pages_do(steps):
    """The stories of exhaust.py also know which press is older than which stop."""
    holder, now = Holder(), 1000.0
    is_granted = mouse_is_active = False
    for step in steps + [('gone', page) for page in 'ABC']:
        now += step[1] if step[0] == 'wait' else TICK
        holder.update(now)
        may_give, may_drive = tell(holder, now, *step)
        grants, pads, mouse_states = holder.take_messages()
        assert may_give or True not in grants
        assert may_drive or {late.pad for late in pads} <= {B}
        assert may_drive or not any(state.x or state.y for state in mouse_states)
        is_granted = ([is_granted] + grants)[-1]
        mouse_is_active = ([mouse_is_active] + [state.active for state in mouse_states])[-1]
        assert holder.has_granted is is_granted
        if holder.page is None:
            assert not is_granted and not mouse_is_active and holder.pad is None
    assert holder.page is None
