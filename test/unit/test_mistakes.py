"""Each mistake has a name: the sentences of the labs on what was seen, and the table of wrong nodes,
whose sentences the benchmark writes."""
import re
import runpy

import numpy as np
import pytest

from pages import ROOT
from test_criteria import GOOD, heading, observed, scene, turn, verdicts
from test_marking import marks_of
from tb3_labs.marking.labs.imu import STANDS
from tb3_labs.marking.labs.turn import EACH_TURN
from tb3_labs.marking.labs.turn_hints import ITS_HEADING, last_hint, remarks_on_turns
from tb3_labs.marking.marks import LABS
from tb3_labs.marking.shown_run import own_hint, shown

WRONG_NODES = runpy.run_path(str(ROOT / 'test' / 'benchmark' / 'wrong_nodes.py'))
ROWS = WRONG_NODES['read_table']()
#: A place of the table is a part of one of these.
PLACES = ''.join((ROOT / 'doc' / name).read_text(encoding='utf-8')
                 for name in ('imu_lab.md', 'transformation_lab.md'))


def signed(degrees):
    return (degrees + 180.0) % 360.0 - 180.0


def printing(prints):
    """The sentence on a node that prints `prints` of a heading [deg]: one or several numbers."""
    parts = {name: scene(printed=heading(*np.atleast_1d(prints(degrees))), heading_deg=degrees)
             for name, degrees in STANDS.items()}
    return LABS['imu'].hint(observed('imu', **dict(GOOD['imu'], **parts)))


@pytest.mark.parametrize('prints, words', [
    (lambda yaw: [yaw] * 20, ''), (lambda yaw: np.radians(signed(yaw)), 'radians'),
    (lambda yaw: np.radians(signed(yaw)) % 360.0, 'radians'), (lambda yaw: 0.7, 'roll or the pitch'),
    (lambda yaw: 180.0, 'order of the four numbers w, x, y, z'), (signed, 'a negative one is not'),
    (lambda yaw: signed(yaw) + 360.0, 'adds 360 to each'), (lambda yaw: abs(signed(yaw)), '(abs)'),
    (lambda yaw: signed(yaw) + 180.0, '180 degrees too large'), (lambda yaw: 360.0 - yaw, 'to the right'),
    (lambda yaw: np.degrees(signed(yaw)) + 360.0 * (yaw > 180.0), 'degrees to degrees again'),
    (lambda yaw: yaw - 7.0, 'a sleep in'), (lambda yaw: [yaw - 7.0, yaw], 'a sleep in')])
def test_the_numbers_of_a_heading_name_its_mistake(prints, words):
    said = printing(prints)
    assert words in said and bool(said) is bool(words)


def test_a_heading_at_the_start_alone_is_told():
    parts = {name: scene(heading_deg=degrees) for name, degrees in STANDS.items()}
    seen = observed('imu', **dict(GOOD['imu'], **parts))
    seen.runs[0].printed = heading(3.0)
    assert any('it printed 1 at its start, and then none' in each.seen for each in verdicts('imu', seen))


def turning(**parts):
    return observed('turn', **dict({name: GOOD['turn'][name] for name in EACH_TURN}, **parts))


def all_turns(made):
    """An observation of turns, each made of its WatchedTurn."""
    return turning(**{name: made(each) for name, each in EACH_TURN.items()})


def still(number, printed='l\nInput'):
    return scene(*[(0.1 * k, 0.0, 0.0) for k in range(1, number + 1)], moved=False, rested=True, printed=printed)


def to(degrees):
    """A turn that ends at a heading, of (a letter's side, the heading where it began) [deg]."""
    return lambda each: turn(signed(degrees(each) - each.begins_deg) or 0.1)


def slow(each):
    """The robot turns round by commands that come every second."""
    return scene(*[(float(k), 0.0, 1.5) for k in range(8)], (7.9, 0.0, 0.0), moved=True, rested=False,
                 truth=[(0.0, 0.0, 0.0, 0.0), (7.9, 0.0, 0.0, 11.0)])


@pytest.mark.parametrize('seen, words', [
    (turning(), ''),
    (all_turns(lambda each: still(1)), 'self.turning True after the letter, and is the angle'),
    (all_turns(lambda each: still(30)), 'which field of the Twist'),
    (all_turns(lambda each: still(1, 'l\nError: l or r\nInput')), "is answered by 'Error: l or r'"),
    (turning(**{name: still(1) for name in EACH_TURN if name[0] == 'r'}), 'negative error is less'),
    # and l across 0, without a wrap
    (turning(**{name: still(1) for name in EACH_TURN if name[0] == 'r' or name == 'l across 0'}),
     'negative error is less'),
    (turning(**{'r across 0': still(1)}), ''),
    (turning(**{name: still(30) for name in EACH_TURN if name != 'l'}), 'does turning become False'),
    (all_turns(to(lambda each: 0.0)), 'is the goal of the letter stored in self.goal_yaw'),
    (all_turns(to(lambda each: each.asked_deg)), 'does the goal count from self.curr_yaw'),
    (all_turns(lambda each: turn(2.0 * each.asked_deg)), 'one of 180 degrees'),
    (all_turns(lambda each: turn(each.asked_deg / 2.0)), 'one of 45 degrees'),
    # a fixed time, not a letter's angle: it turns less where the wheels slip by 0.3
    *[(all_turns(lambda each, size=size: turn(size * each.asked_deg * (1.0 - each.slip))),
       'by {:.0f} degrees, and by {:.0f} where the wheels slip: .*after a time'.format(90.0 * size, 63.0 * size))
      for size in (0.5, 1.0, 1.5)],
    (observed('turn', **{name: turn(EACH_TURN[name].asked_deg / 2.0) for name in (
        'r', 'r across 180', 'r across 0')}), ''),
    (all_turns(lambda each: turn(-each.asked_deg)), 'It turns to the other side'),
    (all_turns(lambda each: turn(-each.asked_deg, rested=False)), 'is the error goal minus heading'),
    (all_turns(lambda each: turn(each.asked_deg + 12.0, rested=False)), 'goes on to and fro'),
    (all_turns(slow), 'commands come every 1.0 s')])
def test_turns_name_their_mistake(seen, words):
    said = LABS['turn'].hint(seen)
    assert re.search(words, said) and bool(said) is bool(words)


def test_a_node_that_never_asked_for_a_letter_is_told_of_its_timer():
    seen = turning(l=still(0, 'l\n'))
    assert LABS['turn'].hint(seen) == ''
    seen.runs[0].printed = 'l\n'
    assert 'every 10 s' in LABS['turn'].hint(seen)


def test_what_costs_nothing_is_a_remark():
    asks = dict(GOOD['turn'], l=turn(90.0, printed='l\nl or r?'))
    for printed, number in (('x\nl or r?', 1), ('x\nError: l or r\nl or r?', 0), ('x\nError: l or r', 0)):
        said = remarks_on_turns(observed('turn', **dict(asks, nonsense=scene(printed=printed))))
        assert len(said) == number and all('no error' in each for each in said)
    assert 'every 1.0 s' in remarks_on_turns(all_turns(slow))[0]


def test_a_heading_is_asked_for_if_both_sides_are_wrong_and_nothing_explains_it():
    wrong = all_turns(lambda each: turn(-20.0 if each.typed == 'l' else -170.0))
    assert LABS['turn'].hint(wrong) == '' and last_hint(wrong).startswith(ITS_HEADING)
    assert last_hint(turning()) == '' == last_hint(turning(l=turn(70.0)))


def test_a_page_has_no_last_hint_beside_one_that_explains():
    swapped = all_turns(lambda each: turn(-each.asked_deg))
    marks = marks_of('', swapped)
    assert 'to the other side' in own_hint(marks) and own_hint(marks, is_last=True).startswith(ITS_HEADING)
    assert ITS_HEADING[:40] not in shown(marks)


# The table of wrong nodes -------------------------------------------------------------------------

def test_the_table_has_the_nodes_of_the_four_labs():
    assert len({(row['lab'], row['name']) for row in ROWS}) == len(ROWS)
    wrong = [row for row in ROWS if row['words']]
    assert len(wrong) >= 60 and len(ROWS) - len(wrong) >= 8
    assert sum(', ' in row['name'] for row in wrong) >= 10      # two mistakes at once
    assert sum(WRONG_NODES['is_named'](row, row['check']) for row in wrong) >= 0.9 * len(wrong)


@pytest.mark.parametrize('lab', WRONG_NODES['NODES'])
def test_each_node_can_be_made_and_each_place_is_in_a_sheet(lab):
    for row in (row for row in ROWS if row['lab'] == lab):
        assert row['changes'] == [] or WRONG_NODES['changed'](row) != WRONG_NODES['changed'](
            dict(row, changes=[]))
        step = re.match(r'step ?(\d?)', row['place'])
        assert re.search(r'^{}\. '.format(step.group(1) or r'\d') if step else '^#.*' + re.escape(
            row['place']), PLACES, re.MULTILINE), row['place']
        re.compile(row['words'])
