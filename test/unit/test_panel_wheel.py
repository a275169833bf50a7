"""One page drives, only while it is there, and nothing goes on by itself after a stop."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.panel.requests import Hand, Pad
from tb3_labs.panel.wheel import LatePad, MouseState, Wheel

REST, FULL, B = Pad(), Pad(forward=1.0, hold=True), Pad(b=True)
EMPTY = Hand()
#: A person presses later than what happened before, by this [s] at least.
TICK = 2.0 ** -20


class Room:
    """A wheel and its clock; what it says is collected. Times are sums of powers of two: exact."""

    def __init__(self):
        self.wheel = Wheel()
        self.now = 1000.0

    def hand(self, page, pad=None, mouse=None, lateness=0.0):
        self.wheel.on_hand(page, Hand(pad, mouse), self.now, lateness)

    def drive(self, page='A', pad=FULL, mouse=None):
        """`page` takes the wheel and grips; nothing of that is kept."""
        self.begin(page)
        self.hand(page, pad, mouse)
        self.said()

    def begin(self, page='A'):
        self.now += TICK
        self.wheel.begin(page, self.now, pressed=self.now)

    def give(self, page='A'):
        self.now += TICK
        self.wheel.give(page, self.now, pressed=self.now)

    def run(self, seconds):
        self.now += seconds
        self.wheel.update(self.now)

    def said(self):
        """(words, pads, mouse states) since the last call."""
        return self.wheel.take_words(), self.wheel.take_pads(), self.wheel.take_mouse()

    @property
    def words(self):
        return self.wheel.take_words()


@pytest.fixture
def room():
    return Room()


# -- one driver

def test_nobody_has_the_wheel_at_first(room):
    assert room.wheel.page is None and not room.wheel.gives and room.wheel.pad is None
    room.hand('A', FULL, (0.5, 0.5))
    room.run(10.0)
    assert room.said() == ([], [], []) and room.wheel.page is None
    assert room.wheel.take_news() == []


def test_of_several_pages_one_drives(room):
    room.drive('A')
    for ask in (room.begin, room.give):
        with pytest.raises(ValueError, match='another page drives'):
            ask('B')
    room.hand('B', FULL, (1.0, 1.0))
    assert room.said() == ([], [], []) and room.wheel.page == 'A' and not room.wheel.gives
    room.hand('A', REST)
    assert room.said() == ([], [LatePad(REST, 0.0)], [])


def test_pages_that_are_equal_are_not_the_same_page(room):
    first, second = [1], [1]
    room.begin(first)
    room.hand(second, FULL)
    room.wheel.let_go(second)
    room.wheel.gone(second)
    assert room.wheel.page is first and room.said() == ([], [], [])


def test_the_wheel_is_free_once_it_was_let_go(room):
    room.drive('A')
    room.wheel.let_go('B')
    assert room.wheel.page == 'A'
    room.wheel.let_go('A')
    assert room.wheel.page is None and room.wheel.pad is None
    room.begin('B')
    assert room.wheel.page == 'B' and room.wheel.take_news() == []


def test_a_page_may_begin_again_and_keeps_what_it_holds(room):
    room.give()
    room.hand('A', REST)
    room.begin('A')
    assert room.wheel.page == 'A' and room.wheel.gives and room.wheel.pad == REST
    assert room.words == [True]


# -- what the hands say

def test_a_pad_is_published_as_it_is_heard(room):
    room.drive(pad=None)
    pads = [REST, FULL, Pad(left=-0.5, a=True), REST]
    for lateness, pad in zip((0.0, 0.125, 0.25, 0.0625), pads):
        room.hand('A', pad, lateness=lateness)
    assert room.said() == (
        [], [LatePad(pads[0], 0.0), LatePad(pads[1], 0.125), LatePad(pads[2], 0.25),
             LatePad(pads[3], 0.0625)], [])


def test_a_mouse_is_active_while_it_is_held_and_released_once(room):
    room.drive(pad=None)
    for mouse in (None, (0.25, -1.0), (0.0, 0.0), None, None):
        room.hand('A', None, mouse)
    assert room.said() == ([], [], [MouseState(False), MouseState(True, 0.25, -1.0),
                                    MouseState(True, 0.0, 0.0), MouseState(False)])


def test_what_was_taken_is_not_said_again(room):
    room.give()
    room.hand('A', FULL, (0.5, 0.5))
    assert room.said() == ([True], [LatePad(FULL, 0.0)],
                           [MouseState(False), MouseState(True, 0.5, 0.5)])
    assert room.said() == ([], [], [])
    room.run(1.0)
    assert len(room.wheel.take_news()) == 1 and room.wheel.take_news() == []


def test_the_time_since_a_pad_is_heard(room):
    assert room.wheel.pad_heard_for(room.now) == 0.0
    room.drive(pad=None)
    assert room.wheel.pad_heard_for(room.now) == 0.0
    for elapsed in (0.0, 0.125, 0.25, 0.375):
        room.hand('A', REST)
        assert room.wheel.pad_heard_for(room.now) == elapsed
        room.run(0.125)
    room.hand('A', None)
    assert room.wheel.pad_heard_for(room.now) == 0.0
    room.hand('A', REST)
    assert room.wheel.pad_heard_for(room.now + 0.125) == 0.125


# -- silence

@pytest.mark.parametrize('silence, lost', [
    (0.25, False), (0.25 + 2.0 ** -30, True), (0.5, True), (3600.0, True)])
@pytest.mark.parametrize('heard_by', ['begin', 'hand', 'give'])
def test_a_page_is_lost_by_a_silence_of_more_than_a_quarter_of_a_second(
        room, silence, lost, heard_by):
    room.drive()
    room.run(0.125)
    {'begin': lambda: room.begin('A'), 'hand': lambda: room.hand('A', FULL),
     'give': room.give}[heard_by]()
    room.said()
    room.run(silence)
    assert (room.wheel.page is None) is lost
    assert room.said() == ([False] if lost and heard_by == 'give' else [], [], [])


def test_a_loss_releases_all_that_was_held_and_is_told_once(room):
    room.give()
    room.hand('A', FULL, (0.5, 0.5))
    room.said()
    room.run(0.5)
    assert room.said() == ([False], [], [MouseState(False)])
    assert room.wheel.pad is None and not room.wheel.gives
    news, = room.wheel.take_news()
    assert news.warning and news.text == (
        'The page that drives is silent for 0.5 s: robot stopped; '
        'grip a control of the page to drive again')
    room.run(10.0)
    room.wheel.gone('A')
    assert room.said() == ([], [], []) and room.wheel.take_news() == []


@pytest.mark.parametrize('hold', [
    lambda room: room.hand('A', FULL), lambda room: room.hand('A', None, (0.0, 0.0)),
    lambda room: room.give()])
def test_a_loss_is_told_if_anything_was_held(room, hold):
    room.drive(pad=None)
    hold(room)
    room.wheel.gone('A')
    assert [news.text.split(':')[0] for news in room.wheel.take_news()] == [
        'The page that drives has gone']


def test_a_loss_of_empty_hands_is_not_worth_telling(room):
    room.drive(pad=None)
    room.run(0.5)
    assert room.wheel.page is None and room.wheel.take_news() == []


@pytest.mark.parametrize('late, counts', [(0.25, True), (0.25 + 2.0 ** -30, False), (1.0, False)])
def test_a_message_that_was_delayed_for_as_long_does_not_count(room, late, counts):
    room.drive(pad=None)
    room.run(0.125)
    room.hand('A', FULL, (1.0, 1.0), late)
    assert (room.said() != ([], [], [])) is counts
    room.run(0.25)
    assert (room.wheel.page == 'A') is counts      # nor does it keep the wheel
    assert (room.wheel.pad == FULL) is counts


def test_a_silence_is_noticed_by_the_next_message_also_if_nobody_looked_at_the_clock(room):
    room.give()
    room.hand('A', FULL, (0.5, 0.5))
    room.said()
    room.now += 0.5
    room.hand('A', FULL, (0.5, 0.5))
    assert room.said() == ([False], [], [MouseState(False)]) and room.wheel.page is None


def test_a_lost_wheel_is_free_for_the_next_page_also_if_nobody_looked_at_the_clock(room):
    room.give('A')
    room.now += 0.5
    room.begin('B')
    assert room.wheel.page == 'B' and room.words == [True, False] and not room.wheel.gives


def test_a_giving_that_was_pressed_before_the_page_was_lost_does_not_count(room):
    room.give()
    pressed = room.now + 0.125
    room.run(0.5)
    with pytest.raises(ValueError, match='pressed before the robot was stopped'):
        room.wheel.give('A', room.now, pressed)
    room.give()
    assert room.words == [True, False, True]


def test_a_page_that_slept_drives_nothing_as_it_wakes(room):
    """Its old messages arrive at once, the first ones late, the last ones in time."""
    room.give()
    room.hand('A', FULL, (0.5, 0.5))
    room.run(5.0)
    room.said()
    for late in (4.9, 3.0, 1.0, 0.3, 0.2, 0.1, 0.0):
        room.hand('A', FULL, (1.0, 1.0), late)
    assert room.said() == ([], [], []) and room.wheel.page is None
    room.begin('A')
    room.hand('A', REST)
    assert room.said() == ([], [LatePad(REST, 0.0)], []) and not room.wheel.gives


# -- control

def test_control_is_given_once_by_any_number_of_requests(room):
    for _ in range(3):
        room.give()
    assert room.words == [True] and room.wheel.page == 'A'
    for _ in range(100):
        room.run(0.0625)
        room.hand('A')
    assert room.wheel.gives and room.words == []


@pytest.mark.parametrize('end', [
    lambda room: room.wheel.take('A', room.now), lambda room: room.wheel.on_taken(room.now),
    lambda room: room.wheel.stop('B', room.now), lambda room: room.wheel.let_go('A'),
    lambda room: room.wheel.gone('A'), lambda room: room.run(0.5),
    lambda room: room.hand('B', B)])
def test_what_was_taken_by_anybody_is_given_again_by_a_person_alone(room, end):
    room.give()
    room.hand('A', REST)
    end(room)
    assert room.words == [True, False] and not room.wheel.gives
    for _ in range(4):
        room.hand('A', REST)
        room.run(0.125)
    assert room.words == [] and not room.wheel.gives
    room.give()
    assert room.words == [True] and room.wheel.gives


def test_control_that_another_one_gave_is_taken_as_well(room):
    room.wheel.take('A', room.now)
    assert room.words == [False]
    room.wheel.stop('B', room.now)
    assert room.words == [False]


def test_what_another_node_took_is_no_news_for_a_page_that_gave_nothing(room):
    room.drive()
    room.wheel.on_taken(room.now)
    assert room.said() == ([], [], []) and room.wheel.page == 'A'


@pytest.mark.parametrize('end', ['let_go', 'gone'])
def test_a_page_that_gave_nothing_takes_nothing_as_it_goes(room, end):
    """Another page, or a pad, may have given control meanwhile."""
    room.drive()
    getattr(room.wheel, end)('A')
    assert room.words == []


def test_the_page_that_drives_takes_control_and_keeps_what_it_holds(room):
    room.give('A')
    room.hand('A', FULL, (0.5, 0.5))
    room.said()
    room.wheel.take('A', room.now)
    assert room.said() == ([False], [], [])
    assert room.wheel.page == 'A' and room.wheel.pad == FULL


@pytest.mark.parametrize('take', [lambda room: room.hand('B', B),
                                  lambda room: room.wheel.take('B', room.now)])
def test_take_and_b_of_another_page_stop_the_page_that_drives(room, take):
    room.give('A')
    room.hand('A', FULL, (0.5, 0.5))
    room.said()
    take(room)
    assert room.said() == ([False], [LatePad(B, 0.0)], [MouseState(True), MouseState(False)])
    room.hand('A', FULL, (0.5, 0.5))
    assert room.said() == ([], [], []) and room.wheel.page is None


# -- a giving that is older than a stop

STOPS = {
    'stop': lambda room: room.wheel.stop('B', room.now),
    'take': lambda room: room.wheel.take('B', room.now),
    'B': lambda room: room.hand('B', B),
    'False of another node': lambda room: room.wheel.on_taken(room.now),
    'loss of control': lambda room: [room.wheel.on_control(granted, room.now)
                                     for granted in (True, False)],
    'cancel': lambda room: room.wheel.on_stop(room.now)}


@pytest.mark.parametrize('stop', STOPS.values(), ids=list(STOPS))
def test_what_was_pressed_before_a_stop_does_not_count_after_it(room, stop):
    """It was held up on its way; another one has stopped the robot meanwhile."""
    pressed = room.now
    room.run(1.0)
    stop(room)
    room.said()
    room.run(0.9)
    for at in (pressed, pressed + 1.0):
        for ask in (room.wheel.begin, room.wheel.give):
            with pytest.raises(ValueError, match='pressed before the robot was stopped'):
                ask('A', room.now, at)
        with pytest.raises(ValueError, match='pressed before the robot was stopped'):
            room.wheel.check('A', at)
    assert room.said() == ([], [], []) and room.wheel.page is None
    room.wheel.give('A', room.now, pressed + 1.0 + TICK)
    assert room.words == [True] * 9      # with the renewals of 0.84 s, which show its age


def test_what_waited_in_a_page_while_it_stopped_the_robot_does_not_count(room):
    """A press may wait in the page, and STOP overtakes it."""
    pressed = room.now
    room.run(1.0)
    room.wheel.stop('A', room.now, pressed + 0.9)
    for at, counts in ((pressed, False), (pressed + 0.9, False), (pressed + 0.95, True)):
        if counts:
            room.wheel.give('A', room.now, at)
        else:
            with pytest.raises(ValueError, match='pressed before the robot was stopped'):
                room.wheel.give('A', room.now, at)


def test_a_stop_of_the_page_itself_is_older_than_what_comes_after_it(room):
    """It may have been slow, so that the next press is older than its arrival. Another's is not."""
    pressed = room.now
    room.run(0.125)
    for _ in range(2):
        room.wheel.stop('A', room.now)
        room.wheel.check('A', pressed)
    room.wheel.stop('B', room.now)
    room.wheel.stop('A', room.now + 0.125)
    for page in 'ABC':
        with pytest.raises(ValueError):
            room.wheel.check(page, room.now)
    room.wheel.check('A', room.now + TICK)


@pytest.mark.parametrize('stop', [STOPS[name] for name in (
    'False of another node', 'loss of control', 'cancel')])
def test_a_that_was_pressed_before_a_stop_is_not_shown_until_it_is_pressed_anew(room, stop):
    """It may have waited in the page, or on its way."""
    room.drive('A', REST)
    pressed = room.now
    stop(room)
    for at in (pressed, pressed, room.now + 1.0):    # the last: of a page that tells no press
        room.wheel.on_hand('A', Hand(Pad(a=True)), room.now, pressed=at)
    assert room.said() == ([], [LatePad(REST, 0.0)] * 3, [])
    news, = room.wheel.take_news()
    assert news.warning and news.text == (
        'A was pressed before the robot was stopped: press it again')
    room.hand('A', REST)
    room.wheel.on_hand('A', Hand(Pad(a=True)), room.now, pressed=room.now + TICK)
    assert room.wheel.take_pads()[-1].pad.a


def test_a_that_is_still_held_at_a_stop_is_released(room):
    room.drive('A', REST)
    pressed = room.now + TICK
    room.wheel.on_hand('A', Hand(Pad(a=True)), room.now, pressed=pressed)
    room.now += 2 * TICK
    room.wheel.on_taken(room.now)
    room.wheel.on_hand('A', Hand(Pad(a=True)), room.now, pressed=pressed)
    assert [late.pad.a for late in room.wheel.take_pads()] == [True, False]


def test_what_move_to_goal_repeats_is_no_stop(room):
    """It latches has_control: a new connection hears it again."""
    pressed = room.now
    room.run(0.125)
    room.wheel.on_control(False, room.now)
    room.wheel.on_control(False, room.now)
    room.wheel.check('A', pressed)


def test_control_that_was_lost_by_itself_is_given_anew(room):
    """A node that hears True again and again does not count it as a new giving."""
    room.give()
    room.wheel.on_control(True, room.now)
    room.hand('A')
    room.run(0.125)
    room.wheel.on_control(False, room.now)
    room.hand('A')
    assert room.words == [True]      # it may come back, if the network was slow
    room.give()
    assert room.words == [False, True] and room.wheel.gives
    room.give()
    assert room.words == []


# -- the button B

def test_b_counts_once_for_each_press(room):
    room.drive('A')
    for pad in (B, B, Pad(b=True, forward=1.0), REST, FULL, B, None, B, B):
        room.hand('B', pad)
    assert room.words == [False] * 3


def test_b_counts_although_nobody_has_the_wheel(room):
    room.hand('B', B)
    assert room.said() == ([False], [], [MouseState(True), MouseState(False)])


@pytest.mark.parametrize('button', ['a', 'y', 'hold'])
def test_no_other_button_of_such_a_page_counts(room, button):
    room.give('A')
    room.hand('B', Pad(**{button: True}), (1.0, 1.0))
    assert room.said() == ([True], [], []) and room.wheel.gives


def test_b_of_two_pages_counts_for_each_of_them(room):
    """A page whose connection is held up may never tell that its B was released."""
    room.hand('B', B)
    room.give('A')
    room.said()
    room.hand('C', B)
    assert room.words == [False] and not room.wheel.gives
    room.hand('B', B)
    room.hand('C', B)
    assert room.words == []


def test_b_counts_after_a_page_released_it_while_it_had_the_wheel(room):
    room.hand('B', B)
    room.begin('B')
    room.hand('B', REST)
    room.wheel.let_go('B')
    room.give('A')
    room.said()
    room.hand('B', B)
    assert room.words == [False]


def test_b_that_is_held_through_a_loss_is_not_pressed_again(room):
    room.drive('A', B)
    room.run(0.5)
    room.give('C')
    room.hand('A', B)
    assert room.words == [True] and room.wheel.gives
    room.hand('A', REST)
    room.hand('A', B)
    assert room.words == [False]


def test_b_of_a_page_that_left_is_forgotten(room):
    room.hand('B', B)
    room.wheel.gone('B')
    room.said()
    room.hand('B', B)
    assert room.words == [False]


def test_b_of_the_page_with_the_wheel_takes_control_although_no_node_may_hear_its_pad(room):
    """Its pad is not sent while another pad publishes, and the node gamepad may not run."""
    room.give('A')
    for pad in (REST, B, B, REST):
        room.hand('A', pad)
    assert room.said() == ([True, False], [LatePad(pad, 0.0) for pad in (REST, B, B, REST)], [])
    assert room.wheel.page == 'A' and not room.wheel.gives


@pytest.mark.parametrize('late', [0.3, 2.0, 100.0])
def test_b_counts_however_late_it_is(room, late):
    room.give('A')
    room.hand('A', Pad(forward=1.0, b=True), (1.0, 1.0), late)
    assert room.said() == ([True, False], [], []) and not room.wheel.gives
    room.hand('A', Pad(b=True), lateness=late)
    assert room.words == []


# -- stop

@pytest.mark.parametrize('pad', [None, FULL])
@pytest.mark.parametrize('mouse', [None, (1.0, 1.0)])
@pytest.mark.parametrize('gives', [True, False])
def test_a_stop_ends_everything(room, pad, mouse, gives):
    room.drive('A', pad, mouse)
    if gives:
        room.give()
    room.said()
    room.wheel.stop('B', room.now)
    words, pads, mouse_states = room.said()
    assert words == [False]
    # the pad rests and takes the robot; an active mouse that is released also gives a turn up
    assert pads == ([] if pad is None else [LatePad(Pad(0.0, 0.0, b=True), 0.0)])
    assert mouse_states == [MouseState(True, 0.0, 0.0), MouseState(False, 0.0, 0.0)]
    assert room.wheel.page is None and room.wheel.pad is None and not room.wheel.gives


def test_nothing_goes_on_after_a_stop_until_a_person_grips(room):
    room.give()
    room.hand('A', FULL, (1.0, 1.0))
    room.wheel.stop('B', room.now)
    room.said()
    for _ in range(20):
        room.hand('A', FULL, (1.0, 1.0))
        room.run(0.0625)
        assert room.said() == ([], [], []) and room.wheel.page is None
    room.begin('A')
    room.hand('A', FULL)
    assert room.said() == ([], [LatePad(FULL, 0.0)], []) and not room.wheel.gives


def test_a_stop_is_said_although_nobody_drives_and_each_time(room):
    for _ in range(2):
        room.wheel.stop('B', room.now)
        assert room.said() == ([False], [], [MouseState(True), MouseState(False)])


# -- whatever comes

PAGES = st.sampled_from('ABC')
PADS = st.sampled_from([None, REST, FULL, B, Pad(a=True)])
AGES = st.sampled_from([0.0, 0.0, 0.1, 1.0])    # of a press
STEPS = st.lists(st.one_of(
    st.tuples(st.sampled_from(['begin', 'give']), PAGES, AGES),
    st.tuples(st.sampled_from(['let_go', 'gone', 'take', 'stop']), PAGES),
    st.tuples(st.just('hand'), PAGES, PADS, st.sampled_from([None, (0.5, 0.5)]),
              st.sampled_from([0.0, 0.0, 0.25, 0.3, 4.0]), AGES),
    st.tuples(st.sampled_from(['on_taken', 'on_stop'])),
    st.tuples(st.just('on_control'), st.booleans()),
    st.tuples(st.just('wait'), st.sampled_from([0.0625, 0.125, 0.25, 0.3, 5.0]), st.booleans())),
    max_size=25)


class Story:
    """Pages that do anything, and a witness who knows the rules, not the wheel."""

    def __init__(self):
        self.wheel, self.now = Wheel(), 1000.0
        self.driver, self.heard_at = None, 0.0    # the page that a person gave the wheel, last heard
        self.given = self.lost = False            # by whom the witness saw it, and not taken since
        self.stops, self.b_down, self.has_control = {None: 0.0}, set(), None
        self.last_word, self.mouse_is_active = None, False

    def tell(self, step):
        self.now += TICK
        kind, rest = step[0], step[1:]
        if self.driver is not None and self.now - self.heard_at > 0.25 and kind != 'wait':
            self.stops[None] = max(self.stops[None], self.heard_at + 0.25)
            self.lose()
            self.wheel.update(self.now)
        refused, age = False, rest[-1] if kind in ('begin', 'give', 'hand') else 0.0
        pressed = self.now - age
        is_stop = self.is_stop(kind, rest)
        if kind == 'wait':
            self.now += rest[0]
            if rest[1]:
                self.wheel.update(self.now)
        elif kind == 'hand':
            page, pad, mouse, late, _ = rest
            self.wheel.on_hand(page, Hand(pad, mouse), self.now, late, pressed=pressed)
            if page == self.driver and late <= 0.25:
                self.heard_at = self.now
        elif kind in ('begin', 'give'):
            try:
                getattr(self.wheel, kind)(rest[0], self.now, pressed)
            except ValueError:
                refused = True
            assert refused is (self.driver not in (None, rest[0])
                               or pressed <= self.stopped_by_others(rest[0]))
            if not refused:
                self.driver, self.heard_at = rest[0], self.now
        elif kind in ('let_go', 'gone'):
            getattr(self.wheel, kind)(*rest)
        else:
            getattr(self.wheel, kind)(*rest, self.now)
        if is_stop:
            self.stops[rest[0] if kind in ('take', 'stop', 'hand') else None] = self.now
        ends = kind == 'stop' or (is_stop and kind in ('take', 'hand') and rest[0] != self.driver)
        self.judge(kind, rest, refused, ends, pressed, is_stop)
        if ends or kind in ('let_go', 'gone') and rest[0] == self.driver:
            self.lose()

    def stopped_by_others(self, page):
        return max(at for other, at in self.stops.items() if other != page)

    def is_stop(self, kind, rest):
        """Does this step stop the robot? The presses of B are counted."""
        if kind == 'gone':
            self.b_down.discard(rest[0])
        if kind == 'on_control':
            had_control, self.has_control = self.has_control, rest[0]
            return had_control and not rest[0]
        if kind != 'hand':
            return kind in ('take', 'stop', 'on_taken', 'on_stop')
        was_down = rest[0] in self.b_down
        (self.b_down.add if rest[1] is not None and rest[1].b else self.b_down.discard)(rest[0])
        return rest[0] in self.b_down and not was_down

    def lose(self):
        self.driver, self.given = None, False

    def judge(self, kind, rest, refused, ends, pressed, is_stop):
        may_give = kind == 'give' and not refused and (not self.given or self.lost)
        words, pads, mouse = (self.wheel.take_words(), self.wheel.take_pads(),
                              self.wheel.take_mouse())
        # a person's word and the renewals since, and no word without one
        assert words.count(True) == may_give * (1 + int((self.now - pressed) / 0.1))
        assert not any(late.pad.a and pressed <= self.stopped_by_others(rest[0]) for late in pads)
        if kind == 'on_control' and (is_stop or rest[0]) or may_give:
            self.lost = bool(is_stop)
        for word in words:
            self.last_word = self.given = word
        if not ends:
            drives = kind == 'hand' and rest[0] == self.driver and rest[3] <= 0.25
            assert not pads or drives
            assert drives or not any(state.active for state in mouse)
        for state in mouse:
            self.mouse_is_active = state.active
        if self.wheel.page is None:
            assert self.last_word is not True and not self.wheel.gives and self.wheel.pad is None
            assert not self.mouse_is_active
        else:
            assert self.wheel.page == self.driver
            assert self.wheel.gives is self.given


@given(STEPS)
def test_whatever_pages_do_nothing_goes_on_without_a_person(steps):
    story = Story()
    for step in steps:
        story.tell(step)
    for page in 'ABC':
        story.tell(('gone', page))
    assert story.wheel.page is None and story.last_word is not True and not story.mouse_is_active


def test_a_mouse_that_is_held_while_another_node_drives_must_be_gripped_anew():
    wheel = Wheel()
    wheel.begin('page', 0.0, pressed=0.0)
    wheel.on_hand('page', Hand(mouse=(0.0, 1.0)), 0.05, mouse_drives=False)
    wheel.on_hand('page', Hand(mouse=(0.0, 1.0)), 0.10)    # nobody else drives any more
    assert wheel.take_mouse() == []
    wheel.on_hand('page', Hand(), 0.15)
    wheel.on_hand('page', Hand(mouse=(0.0, 1.0)), 0.20)
    assert wheel.take_mouse() == [MouseState(False), MouseState(True, 0.0, 1.0)]


def test_a_mouse_that_drives_is_released_when_another_node_begins_to_drive():
    wheel = Wheel()
    wheel.begin('page', 0.0, pressed=0.0)
    wheel.on_hand('page', Hand(mouse=(0.0, 1.0)), 0.05)
    wheel.on_hand('page', Hand(mouse=(0.0, 1.0)), 0.10, mouse_drives=False)
    wheel.on_hand('page', Hand(mouse=(0.0, 1.0)), 0.15)
    assert wheel.take_mouse() == [MouseState(False), MouseState(True, 0.0, 1.0), MouseState(False)]
