"""The lab sheets hold every number that is graded, and what each criterion's pointer promises."""
import pathlib
import re
import sys
from dataclasses import replace

import pytest
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'test'))

import make_graded  # noqa: E402
from tb3_labs.marking.labs import LABS  # noqa: E402

POINTS = yaml.safe_load((ROOT / 'test' / 'marking' / 'points.yaml').read_text(encoding='utf-8'))
GOODBYE = 'by itself, without a traceback'
#: lab -> criterion -> words that a student must find at the place to which the criterion points.
KEY_WORDS = {
    'imu': {
        'starts': ['must listen to `imu`'],
        'prints_heading': ['Current heading is 0.000353 degrees.', 'prints the same line'],
        'heading_right': ['the order w, x, y, z', 'in degrees'],
        'from_0_to_360': ['from 0 up to 360'],
        'says_goodbye': ['Shutting down the IMU subscriber', 'nothing is printed',
                         'one more heading may follow'],
        'clean_exit': [GOODBYE],
        'never_360': ['360.000000 itself never shows'],
        'survives_nonsense': ['a quaternion of zeros']},
    'turn': {
        'starts': ['listens to `imu`'],
        'left': ['`l` turns 90 degrees to the left', 'within 10 degrees'],
        'right': ['`r` 90 to the right', 'within 10 degrees'],
        'short_way': ['wrapped', 'it jumps'],
        'clamped': ['no faster than 1.5 rad/s', '`MAX_ANG_Z` 1.5'],
        'on_the_spot': ['on the spot', '`linear.x` is 0'],
        'answers_nonsense': ['answers anything else by an error that names both'],
        'mouse_drives': ['drives forward', 'left half turns left', '0.5 m/s or 0.5 rad/s'],
        'mouse_dead_zone': ['Up to 0.25 from the middle it rests'],
        'mouse_off': ['Scroll **up** to stop at once'],
        'turn_beside_mouse': ['active in the middle `l` turns as usual'],
        'mouse_after_turn': ['after a turn it drives again'],
        'mouse_in_turn': ['keeps working next to the keyboard'],
        'stops_robot': ['Ctrl+C in the middle of a turn', 'sends zero velocity'],
        'says_goodbye': ['Controller exiting. Halting robot.'],
        'clean_exit': [GOODBYE],
        'within_1_deg': ['within 1 degree'],
        'lost_imu': ['IMU that falls silent in a turn stops the robot'],
        'lost_mouse': ['mouse that falls silent stops the robot']},
    'move2goal': {
        'starts': ['listens to `odom`'],
        'waits': ['does not move before it has control'],
        'goal_place': ['(-0.61, 0.61)', '0.15 m away'],
        'goal_heading': ['faces 0 degrees within 0.05 rad'],
        'says_reached': ['says `Goal reached!` once'],
        'silent_at_goal': ['sends nothing on `cmd_vel`'],
        'within_limits': ['0.22 m/s', '2.84 rad/s'],
        'resets': ['call `/set_pose`', '`rosservice call /reset_pose -- 0 0 0`'],
        'says_reset': ['Local pose set to x=..., y=..., yaw=...'],
        'second_place': ['(-0.61, 0.61)', 'the same task again from there'],
        'second_heading': ['face 0 degrees', 'in the new frame'],
        'control_taken': ['take it back in the middle, which stops it at once'],
        'clean_exit': [GOODBYE],
        'stops_robot': ['Ctrl+C in a drive sends zero velocity'],
        'exact': ['within 0.02 m and 1 degree'],
        'declared_pose': ['A declared pose need not be the origin'],
        'offset_imu': ['Odometry and IMU', 'differ by 140 degrees'],
        'lost_odometry': ['odometry that falls silent stops the robot']},
    'gamepad': {
        'starts': ['listens to `joy`'],
        'drives': ['left stick up and down', '0.22 m/s'],
        'turns': ['right stick left and right', '2.84 rad/s'],
        'lets_go': ['let go of the sticks', 'It stops'],
        'relinquishes': ['**A**', 'True on `ctrl_relinq`'],
        'silent_meanwhile': ['no velocity from the sticks'],
        'regains': ['**B**', 'False on `ctrl_relinq`', 'You drive again'],
        'resets': ['**Y**', '(0, 0, 0)', 'button 2'],
        'says_success': ['`Pose reset successfully.`'],
        'clean_exit': [GOODBYE],
        'says_why_not': ['says why the reset failed', 'there is no service'],
        'stops_robot': ['Ctrl+C sends zero velocity'],
        'not_blocked': ['sticks are not blocked'],
        'once': ['Y that is held is one call'],
        'latched': ['`ctrl_relinq` is latched'],
        'lost_pad': ['a pad that falls silent stops the robot']}}
#: Each criterion's limits in the sheet, by hand: lab -> criterion -> numbers, in their order.
NUMBERS = {
    'imu': {'starts': '15', 'prints_heading': '1.5', 'heading_right': '1', 'says_goodbye': '1',
            'clean_exit': '5', 'survives_nonsense': '0.9'},
    'turn': {'left': '10 1 3 8', 'clamped': '0.005', 'answers_nonsense': '1 1000',
             'mouse_drives': '0.8 0.45 0.55 0.10 0.40 0.6 0.05', 'mouse_dead_zone': '0.2 -0.2 0.5',
             'mouse_off': '0.5', 'mouse_after_turn': '0.45 0.8', 'mouse_in_turn': '4',
             'stops_robot': '0.5', 'lost_imu': '1', 'lost_mouse': '1'},
    'move2goal': {'waits': '1.5', 'goal_place': '0.15 0.02 4 50 3', 'goal_heading': '0.05 2.9 2',
                  'silent_at_goal': '0.5', 'within_limits': '0.005', 'resets': '3',
                  'says_reset': '0.5', 'control_taken': '0.5'},
    'gamepad': {'drives': '0.15 0.225 0.8 0.05 0.25 0.75', 'turns': '1.5 2.845 0.8 0.05',
                'lets_go': '0.5', 'relinquishes': '1', 'silent_meanwhile': '0.8',
                'regains': '1 0.8', 'resets': '2.5', 'says_why_not': '2.5', 'not_blocked': '0.7'}}
EVERY = [(lab, criterion) for lab in LABS for criterion in LABS[lab].criteria]


def read(sheet):
    return (ROOT / 'doc' / sheet).read_text(encoding='utf-8')


def text_at(place):
    """The text of a place in a sheet, on one line: a section up to the next, or one step of it."""
    found = re.search(r'^#+ {}\n(.*?)(?=^#+ |\Z)'.format(re.escape(place.heading)),
                      read(place.sheet), re.M | re.S)
    assert found, place
    text = found.group(1)
    if place.step:
        step = re.search(r'^{}\. (.*?)(?=^\d+\. |\Z)'.format(place.step), text, re.M | re.S)
        assert step, place
        text = step.group(1)
    return ' '.join(text.split())


def row(lab, criterion):
    """The cells of a criterion in the sheet's table of its lab: name, asked, limits, points."""
    table = read(criterion.where.sheet).split('<!-- {}: '.format(lab))[1].split('\n\n')[1]
    rows = [[cell.strip() for cell in line.strip('|').split('|')] for line in table.splitlines()]
    found, = [cells for cells in rows if cells[0] == '`{}`'.format(criterion.label)]
    return found


@pytest.mark.parametrize('sheet', sorted({criterion.where.sheet for _, criterion in EVERY}))
def test_the_sheets_have_the_tables_of_the_code(sheet):
    assert make_graded.with_tables(read(sheet)) == read(sheet)


@pytest.mark.parametrize('lab, criterion', EVERY, ids=lambda item: getattr(item, 'label', item))
def test_every_criterion_its_points_and_its_numbers_stand_in_the_sheet(lab, criterion):
    points = POINTS[lab]['extra' if criterion.extra else criterion.name]
    _, asked, limits, worth = row(lab, criterion)
    assert float(worth) == (points[criterion.name] if criterion.extra else points)
    assert asked == criterion.meaning
    if criterion.name in NUMBERS[lab]:
        assert re.findall(r'-?\d+(?:\.\d+)?', limits) == NUMBERS[lab][criterion.name].split()


def test_the_tables_follow_the_code(monkeypatch):
    left = LABS['turn'].criteria[1]
    monkeypatch.setitem(LABS, 'turn', LABS['turn']._replace(
        criteria=[replace(left, limits='within 4711 degrees') if criterion is left else criterion
                  for criterion in LABS['turn'].criteria]))
    assert 'within 4711 degrees | 3 |' in make_graded.with_tables(read('imu_lab.md'))


@pytest.mark.parametrize('lab, criterion', EVERY, ids=lambda item: getattr(item, 'label', item))
def test_every_pointer_leads_to_what_it_takes(lab, criterion):
    there = text_at(criterion.where)
    assert [words for words in KEY_WORDS[lab][criterion.name] if words not in there] == []


def test_the_open_todos_that_the_sheets_show_are_those_of_the_skeletons():
    skeletons = ''.join(path.read_text(encoding='utf-8') for path in sorted(
        (ROOT / 'doc' / 'skeletons').glob('*/src/*')))
    shown = [line.strip() for sheet in ('imu_lab.md', 'transformation_lab.md')
             for line in read(sheet).splitlines() if re.match(r' *TODO \d+ is open', line)]
    assert len(shown) > 3 and [line for line in shown if line not in skeletons] == []


def test_every_question_has_an_answer():
    answers = read('instructor/teaching.md').split('## Answers')[1]
    for lab, sheet in (('IMU', 'imu_lab.md'), ('Transformation', 'transformation_lab.md')):
        questions = read(sheet).split('## Questions')[1].split('\n## ')[0]
        assert re.findall(r'^\d+\.', questions, re.M) == re.findall(
            r'^\d+\.', answers.split(lab + ' lab:')[1].split(' lab:')[0], re.M)


def test_there_are_key_words_for_every_criterion_and_no_other():
    assert {lab: set(words) for lab, words in KEY_WORDS.items()} == {
        lab: {criterion.name for criterion in LABS[lab].criteria} for lab in LABS}
