"""Verdicts on observations that are made up, so that what really happened is known."""
import ast
import csv
import io
import math
import pathlib
import re
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest
import yaml

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking import drives, imu, move2goal, turn, turning
from tb3_labs.marking.course import Row, cells
from tb3_labs.marking.criteria import Criterion, Outcome, Place, judge
from tb3_labs.marking.figures import over_time, path
from tb3_labs.marking.labs import LABS
from tb3_labs.marking.life import tracebacks_before_the_end
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.marks_table import Table
from tb3_labs.marking.observation import NotOffered, Observation, Run, Stimulus
from tb3_labs.marking.page import feedback, overview
from tb3_labs.marking.points import points_of
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.ros.marking.gamepad import AXES, BUTTONS
from tb3_labs.ros.marking.pads import pad_called, pad_in_words
from tb3_labs.ros.marking.trial import SCRIPTS
from tb3_labs.ros.testing.bounded_text import BoundedText

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
TABLE = yaml.safe_load(
    (REPOSITORY / 'test' / 'marking' / 'points.yaml').read_text(encoding='utf-8'))


def stimulus(name, begin=0.0, end=2.0, **more):
    """Something that was done, for two seconds."""
    return Stimulus(name, begin, end, **more)


def observation(lab='turn', **parts):
    """Of a node that ran all the time."""
    return Observation(lab, 'lab2/node.py', runs=[Run(0.0, ready=0.5)], **parts)


def turned(degrees, typed='l', moved=True, rested=True, forward=0.0, rate=1.5):
    """A robot that turned by so much, from 3 rad on, within two seconds."""
    angle = math.radians(degrees)
    return observation(
        stimuli=[stimulus(typed, facts={'moved': moved, 'rested': rested})],
        truth=[[0.02 * k, 0.0, 0.0, 3.0 + angle * k / 100.0] for k in range(101)],
        commands=[[0.1, forward, math.copysign(rate, degrees)], [1.9, 0.0, 0.0]])


def outcomes(seen, lab='turn', parts=()):
    """name -> Outcome."""
    worth = points_of(lab, LABS[lab].criteria, TABLE)
    return {v.criterion.name: v.outcome for v in judge(LABS[lab].criteria, seen, worth, parts)}


# -- the tables

@pytest.mark.parametrize('lab', LABS)
def test_every_criterion_has_points_and_a_place_in_a_lab_sheet(lab):
    criteria = LABS[lab].criteria
    assert len({criterion.name for criterion in criteria}) == len(criteria)
    assert sum(points_of(lab, criteria, TABLE).values()) > 0
    for criterion in criteria:
        sheet = (REPOSITORY / 'doc' / criterion.where.sheet).read_text(encoding='utf-8')
        assert re.search(r'^#+ {}$'.format(re.escape(criterion.where.heading)), sheet, re.M)
        section = sheet.split('# ' + criterion.where.heading, 1)[1].split('\n## ')[0]
        assert not criterion.where.step or '\n{}. '.format(criterion.where.step) in section


def test_a_step_is_about_what_its_criteria_judge():
    """Those whose meaning names Ctrl+C or the mouse."""
    steps = [(criterion, word) for lab in LABS.values() for criterion in lab.criteria
             for word in ('Ctrl+C', 'mouse') if word in criterion.meaning and criterion.where.step]
    assert len(steps) > 8
    for criterion, word in steps:
        sheet = (REPOSITORY / 'doc' / criterion.where.sheet).read_text(encoding='utf-8')
        section = sheet.split('# ' + criterion.where.heading, 1)[1].split('\n## ')[0]
        step = re.split(r'\n\d\. ', section)[criterion.where.step]
        assert word in step, criterion.name


@pytest.mark.parametrize('change, words', [
    ({'left': -1}, 'left = -1'), ({'left': 'many'}, "left = 'many'"),
    ({'left': True}, 'left = True'), ({'left': math.nan}, 'left = nan'),
    ({'lfet': 1}, '"lfet"'), ({'extra': {'left': 1}}, '"left"'),
    ({'extra': 3}, 'section of its own')])
def test_points_that_are_not_valid_are_refused(change, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        points_of('turn', turn.CRITERIA, {'turn': dict(TABLE['turn'], **change)})


def test_points_that_are_missing_are_refused():
    without = {name: points for name, points in TABLE['turn'].items() if name != 'right'}
    with pytest.raises(ValueError, match='right = None'):
        points_of('turn', turn.CRITERIA, {'turn': without})
    with pytest.raises(ValueError, match='no section "turn"'):
        points_of('turn', turn.CRITERIA, {'imu': {}})
    with pytest.raises(ValueError, match='no section "turn"'):
        points_of('turn', turn.CRITERIA, None)


def test_the_sheet_for_instructors_lists_every_part():
    sheet = (REPOSITORY / 'doc' / 'instructor' / 'marking.md').read_text(encoding='utf-8')
    table = sheet.split('## What is tried')[1]
    listed, lab = [], ''
    for line in re.findall(r'^\| (\w*) *\| ([\w ]+) \|', table, re.M)[1:]:
        lab = line[0] or lab
        listed.append((lab, line[1]))
    assert listed == [(name, part) for name, lab in LABS.items()
                      for part in SCRIPTS[name]]
    assert all(set(lab.parts) == set(SCRIPTS[name]) for name, lab in LABS.items())


# -- names

#: Spelled the same in core and bridge by chance; in the core a part, a column, an input, a mode.
BY_CHANCE = {'heading', 'name', 'reset', 'points', 'x', 'w', 'utf-8', ' and ', 'src', 'scripts', 'float32',
             'float64', 'bool'}


def parsed(folder):
    """The syntax trees of the modules in a folder, by file name."""
    return {path.name: ast.parse(path.read_text(encoding='utf-8'))
            for path in sorted((REPOSITORY / folder).glob('*.py'))}


def literals(tree):
    """The strings with letters in a module, but for docstrings."""
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    return [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)
            and isinstance(node.value, str) and id(node) not in docstrings
            and re.search('[a-z]', node.value)]


def named(tree):
    """The strings that a module gives to constants of its own: NAME = 'x', or A, B = 'x', 'y'."""
    values = [node.value for node in tree.body if isinstance(node, ast.Assign)]
    return {item.value for value in values for item in getattr(value, 'elts', [value])
            if isinstance(item, ast.Constant) and isinstance(item.value, str)}


def test_core_and_bridge_share_names_by_constants():
    core, bridge = ({text for tree in parsed(folder).values() for text in literals(tree)}
                    for folder in ('src/tb3_labs/marking', 'src/tb3_labs/ros/marking'))
    for program in ('scripts/mark.py', 'test/marking/check_lab.py'):
        bridge.update(literals(ast.parse((REPOSITORY / program).read_text(encoding='utf-8'))))
    assert core & bridge - BY_CHANCE == set()


@pytest.mark.parametrize('name, tree', parsed('src/tb3_labs/marking').items())
def test_a_string_that_has_a_name_stands_once(name, tree):
    assert [text for text in named(tree) if literals(tree).count(text) > 1] == [], name


@pytest.mark.parametrize('name, tree', parsed('src/tb3_labs/marking').items())
def test_public_functions_say_their_types(name, tree):
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
                 and not re.match('_(?!_)', node.name)]
    bare = ['{} of {}'.format(argument.arg, function.name) for function in functions
            for argument in function.args.args
            if argument.arg not in ('self', 'cls') and argument.annotation is None]
    assert bare + [function.name for function in functions if function.returns is None] == [], name


# -- turns

@pytest.mark.parametrize('degrees, met', [
    (90.0, True), (79.5, True), (100.5, True), (78.5, False), (101.5, False), (-90.0, False),
    (450.0, False), (-270.0, False), (0.0, False)])
def test_a_turn_to_the_left_is_counted_as_it_was_turned(degrees, met):
    missed = turning.left(turned(degrees))
    assert (missed == '') is met
    if missed and degrees:
        assert '{:.1f} degrees to the {}'.format(
            abs(degrees), 'left' if degrees > 0.0 else 'right') in missed


def test_a_turn_to_the_right_is_one():
    assert turning.right(turned(-85.0, 'r')) == ''
    assert turning.right(turned(85.0, 'r')) != ''


def test_a_robot_that_does_not_rest_or_does_not_move_has_not_turned():
    assert 'still moving' in turning.left(turned(90.0, rested=False))
    assert 'did not turn' in turning.left(turned(0.0, moved=False))


def test_commands_while_turning():
    assert turning.clamped(turned(90.0)) == turning.on_the_spot(turned(90.0)) == ''
    assert '9.0 rad/s' in turning.clamped(turned(90.0, rate=9.0))
    assert '0.10 m/s' in turning.on_the_spot(turned(90.0, forward=0.1))


@pytest.mark.parametrize('answer, met', [
    ("x\nNot valid: use 'l' or 'r'.\n", True), ('Please type left or right', True), ('x\n', False),
    ('x\nnot a valid letter, really\n', False)])
def test_an_answer_names_the_valid_inputs(answer, met):
    seen = observation(stimuli=[stimulus('nonsense', printed=answer, lines=2)])
    assert (turning.answers_nonsense(seen) == '') is met


def test_an_answer_in_a_flood_is_not_seen():
    seen = observation(stimuli=[stimulus('nonsense', printed='l or r', lines=20000)])
    assert '20000 lines' in turning.answers_nonsense(seen)


# -- drives

@pytest.mark.parametrize('start', [Pose2(), Pose2(4.8, -0.3, 2.0)])
@pytest.mark.parametrize('end, place, heading', [
    (Pose2(-0.61, 0.61, 0.0), True, True), (Pose2(-0.61, 0.74, 0.04), True, True),
    (Pose2(-0.61, 0.79, 0.0), False, True), (Pose2(-0.61, 0.61, 0.1), True, False),
    (Pose2(-0.61, 0.61, 2.0 * math.pi + 0.04), True, True),
    (Pose2(0.61, -0.61, math.pi), False, False)])
def test_a_drive_is_judged_in_the_frame_it_began_in(start, end, place, heading):
    local_T_world = start.inverse()
    there = start @ end
    seen = observation('move2goal', stimuli=[stimulus('first drive', facts={
        'moved': True, 'rested': True, 'goal': drives.GOAL,
        'local_T_world': [local_T_world.x, local_T_world.y, local_T_world.yaw]})],
        truth=[[0.0, start.x, start.y, start.yaw], [2.0, there.x, there.y, there.yaw]])
    assert (move2goal.goal_place(seen) == '') is place
    assert (move2goal.goal_heading(seen) == '') is heading


# -- what was not seen

def test_a_node_that_ended_at_once_loses_all_and_is_told_why():
    seen = Observation('turn', 'lab2/node.py', runs=[Run(
        0.0, end=1.0, ended_by_itself=True, printed='Traceback ...\nNameError: imu\n')])
    assert set(outcomes(seen).values()) == {Outcome.MISSED}
    worth = points_of('turn', turn.CRITERIA, TABLE)
    for verdict in judge(turn.CRITERIA, seen, worth):
        assert "ended at once: 'NameError: imu'" in verdict.sentence and verdict.points == 0.0


def test_what_a_node_does_not_offer_is_not_offered():
    seen = observation(missing={'mouse up': 'it does not listen to mouse_info'},
                       stimuli=[stimulus('mouse not active')])
    results = outcomes(seen, parts=['mouse'])
    assert results['mouse_drives'] is Outcome.NOT_OFFERED
    assert set(results) == {'mouse_drives', 'mouse_dead_zone', 'mouse_off'}


def test_a_node_that_dies_of_a_stimulus_does_not_meet_it():
    seen = observation(stimuli=[stimulus('nonsense', died=True, printed="KeyError: 'l' or 'r'")])
    assert outcomes(seen)['answers_nonsense'] is Outcome.MISSED


@pytest.mark.parametrize('facts, printed, words', [
    ({'took': 0.8, 'signal': 0}, 'bye\n', ''), ({'took': None, 'signal': 0}, '', 'still running'),
    ({'took': 0.8, 'signal': 2}, '', ''), ({'took': 0.8, 'signal': 6}, '', 'signal 6'),
    ({'took': 0.8, 'signal': 0}, 'Traceback (most recent call last):\n  x\nKeyError: 3\n',
     'KeyError: 3'),
    ({'took': 0.8, 'signal': 0}, '[ERROR] [17.2]: Traceback (most recent call last):\n  x\n', 'traceback')])
def test_a_clean_exit(facts, printed, words):
    """At the first Ctrl+C, or at one that is tried again."""
    clean_exit, = [c for c in turn.CRITERIA if c.name == 'clean_exit']
    this = dict(died=True, printed=printed, facts=facts)
    good = stimulus('Ctrl+C', died=True, printed='bye', facts={'took': 0.8, 'signal': 0})
    for stimuli in ([stimulus('Ctrl+C', **this)], [good, stimulus('Ctrl+C again', 3.0, 5.0, **this)]):
        missed = clean_exit.judge(observation(stimuli=stimuli))
        assert words in missed and bool(missed) is bool(words)


@pytest.mark.parametrize('name, printed, said', [
    ('l', 'Traceback (most recent call last):\n  x\nKeyError: 3\n', "during \"l\": 'KeyError: 3'"),
    ('l', 'ValueError: that was no number', ''),
    ('Ctrl+C', 'Traceback (most recent call last):\n  x\nKeyError: 3\n', ''),
    ('l', 'Traceback (most recent call last):\nrospy.exceptions.ROSException: '
     'publish() to a closed topic\n', '')])
def test_a_traceback_before_the_end_is_told(name, printed, said):
    told = tracebacks_before_the_end(stimulus(name, printed=printed))
    assert len(told) == bool(said) and said in ''.join(told)


@pytest.mark.parametrize('commands, met', [
    ([[0.1, 0.0, 1.5], [0.2, 0.0, 0.0]], True), ([[0.1, 0.0, 1.5]], False), ([], False),
    ([[0.1, 0.0, 1.5], [0.9, 0.0, 0.0]], False),            # the turn was over then
    ([[0.1, 0.0, 1.5], [5.1, 0.0, 0.0]], True),             # at the second try
    ([[0.2, 0.0, 0.0], [0.25, 0.0, 1.5]], True)])           # overtaken by another thread
def test_a_zero_is_sent_at_ctrl_c(commands, met):
    seen = observation(commands=commands, stimuli=[
        stimulus('Ctrl+C', died=True, facts={'was_moving': True}),
        stimulus('Ctrl+C again', 5.0, 6.0, died=True, facts={'was_moving': True})])
    stops_robot, = [c for c in turn.CRITERIA if c.name == 'stops_robot']
    assert (stops_robot.judge(seen) == '') is met


def test_an_observation_comes_back_from_its_file():
    seen = turned(90.0)
    assert Observation.from_json(seen.to_json()) == seen


def test_the_longest_gap_in_what_the_robot_said():
    assert observation(truth=[[t, 0, 0, 0] for t in (0.0, 0.02, 0.52, 0.54)]).longest_gap == (
        pytest.approx(0.5))
    assert observation().longest_gap == 0.0


# -- what the handout itself does costs nothing

@pytest.mark.parametrize('after, words', [
    ('', ''), ('Current heading is 12.000000 degrees.\n', ''),     # its flag is set after the line
    ('Current heading is 12.000000 degrees.\n' * 2, '2 headings were printed after')])
def test_one_heading_may_follow_the_goodbye(after, words):
    printed = 'Current heading is 1.0 degrees.\n' * 3 + 'Shutting down the IMU subscriber\n' + after
    seen = observation('imu', stimuli=[stimulus('Ctrl+C', died=True, printed=printed)])
    missed = imu.says_goodbye(seen)
    assert words in missed and bool(missed) is bool(words)


def test_a_heading_after_no_goodbye_is_no_goodbye():
    seen = observation('imu', stimuli=[stimulus(
        'Ctrl+C', died=True, printed='Current heading is 1.0 degrees.\n')])
    assert 'was not printed at Ctrl+C' in imu.says_goodbye(seen)


def test_full_marks_ask_for_nothing_that_the_handouts_leave_open():
    """The handout waits 1 s in the gamepad's callback, and halts the robot in the IMU lab alone."""
    extra = {(lab, c.name) for lab in LABS for c in LABS[lab].criteria if c.extra}
    assert {('gamepad', 'not_blocked'), ('gamepad', 'stops_robot'), ('gamepad', 'once'),
            ('gamepad', 'latched'), ('move2goal', 'stops_robot'), ('move2goal', 'declared_pose'),
            ('move2goal', 'offset_imu')} <= extra
    assert ('turn', 'stops_robot') not in extra


# -- pads

def test_a_pad_is_played_by_the_numbers_that_the_launch_file_loads():
    assert pad_called('handout') == PadConfig()
    xbox = pad_called('xbox')
    assert (xbox.linear_axis, xbox.angular_axis, xbox.relinquish_button, xbox.regain_button,
            xbox.reset_button) == (1, 3, 0, 1, 3)
    assert pad_in_words('f310_d') == ('The pad was "f310_d": axis 1 drives, axis 2 turns; button 1 '
                                      'is A, 2 is B, 3 is Y.')


def test_the_sticks_and_buttons_of_every_pad_are_there():
    for path in (REPOSITORY / 'launch' / 'params').glob('pad_*.yaml'):
        pad = pad_called(path.name[4:-5])
        assert max(pad.linear_axis, pad.angular_axis) < AXES
        assert max(pad.relinquish_button, pad.regain_button, pad.reset_button) < BUTTONS


VALID_PADS = ', '.join(sorted(
    path.name[4:-5] for path in (REPOSITORY / 'launch' / 'params').glob('pad_*.yaml')))


@pytest.mark.parametrize('name', ['xbocks', '', '../gamepad', 'handout.yaml'])
def test_an_unknown_pad_is_one_line_with_the_valid_ones(name):
    with pytest.raises(ValueError) as problem:
        pad_called(name)
    assert str(problem.value) == 'there is no pad {!r}; valid: {}'.format(name, VALID_PADS)
    assert 'f310_x, handout, ps4, xbox' in VALID_PADS


AMONG = 'the marks would lie among the submissions; give a folder beside them'


@pytest.mark.parametrize('words, line', [
    (['--lab', 'gamepad', '--pad', 'xbocks'], "there is no pad 'xbocks'; valid: " + VALID_PADS),
    (['--lab', 'turn', '--pad', 'xbox'], '--pad is for --lab gamepad alone'),
    (['--lab', 'turn', '-o', 'in'], '-o in: ' + AMONG), (['--lab', 'turn', '-o', 'in/x/y'],
                                                        '-o in/x/y: ' + AMONG)])
def test_mark_refuses_in_one_line(tmp_path, words, line):
    (tmp_path / 'in' / 'bobby').mkdir(parents=True)
    done = subprocess.run([sys.executable, str(REPOSITORY / 'scripts' / 'mark.py'), 'in', '-o',
                           'out'] + words, cwd=str(tmp_path), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, universal_newlines=True)
    assert (done.returncode, done.stdout) == (2, 'mark.py: {}\n'.format(line))
    assert [path.name for path in tmp_path.iterdir()] == ['in']


# -- text, files, pages

@pytest.mark.parametrize('pieces', [['a' * 5] * 3, ['b' * 50], ['c'] * 45, ['ab\n' * 9] * 9])
def test_bounded_text_keeps_head_and_tail(pieces):
    text, whole = BoundedText(kept=10), ''
    for piece in pieces:
        before = len(whole)
        text.append(piece)
        whole += piece
        assert text.length == len(whole) and text.lines == whole.count('\n')
        assert whole.endswith(text.since(before)[-10:])
        assert len(str(text)) < 100
        assert str(text) == whole or (
            str(text).startswith(whole[:10]) and str(text).endswith(whole[-10:]))


def marks_of(student, seen):
    worth = points_of('turn', turn.CRITERIA, TABLE)
    return Marks(student, 'lab2/node.py', judge(turn.CRITERIA, seen, worth), ['A "remark", <b>.'],
                 seen)


class Strict(HTMLParser):
    """Fails where an element is not closed; keeps the words."""

    def __init__(self, text):
        super().__init__()
        self.open, self.words, self.tags = [], '', []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag not in ('meta', 'img'):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words += data


def test_pages_show_what_students_write_as_text():
    seen = turned(81.0)
    seen.runs[0].printed = '<script>alert("x")</script> & so on\n'
    page = Strict(feedback(marks_of('<i>Bobby</i>', seen), 'IMU lab'))
    assert '<script>alert("x")</script> & so on' in page.words and 'script' not in page.tags
    assert '<i>Bobby</i>' in page.words and 'A "remark", <b>.' in page.words
    assert page.tags.count('img') == 1
    whole = Strict(overview([marks_of('<i>Bobby</i>', seen)], 'IMU lab', ['a b.html']))
    assert '<i>Bobby</i>' in whole.words and 'i' not in whole.tags


def test_the_figure_over_time_shows_heading_commands_stimuli_and_starts():
    seen = turned(90.0)
    seen.stimuli += [stimulus('x', 2.01, 3.0), stimulus('y', 2.02, 2.5)]
    seen.runs.append(Run(1.5))
    figure = over_time(seen)
    heading, angular, linear = figure.axes
    turn_of, commands = np.array(seen.truth), np.array(seen.commands)
    assert heading.lines[0].get_xydata() == pytest.approx(
        np.column_stack([turn_of[:, 0], np.degrees(turn_of[:, 3])]))
    for axes, column in ((angular, 2), (linear, 1)):
        assert axes.lines[0].get_xydata() == pytest.approx(commands[:, [0, column]])
    for axes in figure.axes:
        assert [line.get_xdata()[0] for line in axes.lines[1:]] == [0.0, 1.5]
        # a polygon, or a rectangle since matplotlib 3.9
        spans = [patch.get_patch_transform().transform_path(patch.get_path()).vertices[:, 0]
                 for patch in axes.patches]
        assert np.array([[xs.min(), xs.max()] for xs in spans]) == pytest.approx(
            np.array([[0.0, 2.0], [2.01, 3.0], [2.02, 2.5]]))
    assert linear.get_xlim() == (0.0, 2.0)
    assert [text.get_text() for text in heading.texts] == ['l', 'x', 'y']
    places = [text.xyann[0] for text in heading.texts]
    assert places[:2] == pytest.approx([0.0, 1.005]) and places[2] - places[1] > 0.02


def test_the_figure_of_a_node_that_did_nothing_is_empty():
    figure = over_time(observation())
    assert [len(axes.lines) for axes in figure.axes] == [1, 1, 1]       # when it was started
    assert figure.axes[2].get_xlim() == (0.0, 1.0)
    assert path(observation()) is None


def test_the_figure_of_the_drives_is_in_their_local_frames():
    """The second one's frame stands at (1, 2) in the world, turned by 90 degrees."""
    local = Pose2(1.0, 2.0, math.pi / 2.0).inverse()
    frames = [[0.0, 0.0, 0.0], [local.x, local.y, local.yaw]]
    seen = observation('move2goal', truth=[
        [0.0, 0.0, 0.0, 0.0], [0.5, 2.0, 0.0, 0.1], [1.0, 3.0, 0.5, 0.5],
        [5.0, 1.0, 2.0, 0.0], [6.0, 1.0, 3.0, 2.0]],
        stimuli=[stimulus('first', 0.0, 1.0, facts={'goal': drives.GOAL,
                                                    'local_T_world': frames[0]}),
                 stimulus('none', 1.5, 2.0),
                 stimulus('second', 5.0, 6.0, facts={'goal': [4.0, 5.0, 0.0],
                                                     'local_T_world': frames[1]})])
    axes, = path(seen).axes
    first, star, second, other_star, origin = (line.get_xydata() for line in axes.lines)
    assert first == pytest.approx(np.array([[0.0, 0.0], [2.0, 0.0], [3.0, 0.5]]))
    assert second == pytest.approx(np.array([[0.0, 0.0], [1.0, 0.0]]), abs=1e-9)
    assert star[0] == pytest.approx((-0.61, 0.61)) and other_star[0] == pytest.approx((4.0, 5.0))
    assert origin[0] == pytest.approx((0.0, 0.0))
    for arrow, end, facing in zip(axes.texts, ((3.0, 0.5), (1.0, 0.0)), (0.5, 2.0 - math.pi / 2.0)):
        tip = np.array(arrow.xy) - end
        assert arrow.xyann == pytest.approx(end, abs=1e-9)
        assert math.atan2(tip[1], tip[0]) == pytest.approx(facing)


def test_a_page_without_an_observation_says_why():
    marks = Marks('Bobby', verdicts=[], remarks=['There is no node.'])
    page = Strict(feedback(marks, 'IMU lab'))
    assert 'There is no node.' in page.words and 'img' not in page.tags
    assert not marks.failed


def test_what_could_not_be_judged_is_no_zero():
    verdicts = verdicts_of_everything(LABS['turn'])
    bad = Marks('Bobby', 'lab2/n.py', verdicts, ['The marking machine lacks cv2.'], failed=True)
    good = Marks('Ann', 'lab2/n.py', verdicts)
    page = Strict(feedback(bad, 'IMU lab')).words
    assert 'Not judged.' in page and 'lacks cv2' in page and ' of 30 points' not in page
    every = Strict(overview([bad, good], 'IMU lab', ['Bobby.html', 'Ann.html'])).words
    assert '2 submissions, 1 not judged. Median 0 of 30 points.' in every
    assert 'not judged' in every and '0 / 30' in every
    alone = Strict(overview([bad], 'IMU lab', ['Bobby.html'])).words
    assert '1 submission, 1 not judged. The last' in alone
    rows = list(csv.DictReader(io.StringIO(Table().renewed([bad, good], []))))
    assert [row['points'] for row in rows] == ['', '0']
    assert {rows[0][name] for name in ('starts', 'left', 'extra_within_1_deg')} == {''}
    assert {rows[1][name] for name in ('starts', 'left')} == {'0'}
    assert cells([Row('code', 25.0), Row('demonstration', 25.0)], bad, {'demonstration': '20'}) == [
        '', '20', '']


def verdicts_of_everything(lab):
    """The verdicts on a node of which nothing was seen."""
    return judge(lab.criteria, Observation('turn', 'lab2/n.py'),
                 points_of('turn', lab.criteria, TABLE))


def test_the_table_of_marks():
    def never(seen):
        raise NotOffered('no')
    here = Place('imu_lab.md', 'Lab')
    criteria = [Criterion('one', '', 'one', here, lambda seen: ''),
                Criterion('two', '', 'two', here, never),
                Criterion('more', '', 'more', here, lambda seen: '', extra=True),
                Criterion('free', '', 'free', here, lambda seen: '', extra=True),
                Criterion('freer', '', 'freer', here, lambda seen: 'no', extra=True)]
    verdicts = judge(criteria, observation(),
                     {'one': 1.5, 'two': 2, 'more': 0.5, 'free': 0, 'freer': 0})
    text = Table().renewed([Marks('Bobby', 'lab2/n.py', verdicts, ['Hm.'], late='Late.')], [])
    row, = csv.DictReader(io.StringIO(text))
    assert row == {'student': 'Bobby', 'points': '2', 'of': '3.5', 'one': '1.5', 'two': '0',
                   'extra_more': '0.5', 'extra_free': 'yes', 'extra_freer': 'no',
                   'node': 'lab2/n.py', 'late': 'yes', 'remarks': 'Late. Hm.'}
