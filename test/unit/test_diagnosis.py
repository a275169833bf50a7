"""The diagnosis of a run: the known mistakes in closed form, and runs of mistaken nodes."""
import math
import random
import re
import tempfile
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from made_run import made
from mutants import BY_LETTERS, PARTIAL, edited, is_same, mistaken_node, right_node, scene_of
from pages import ROOT
from right_runs import RIGHT, right_run
from student_runs import played, text_of, turn_scene
from recorded_trial import recorded
from test_marking import trial_run, turned as robot_that_turned
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.labs.criteria import Outcome, Verdict
from tb3_labs.marking.shown_run import as_run, diagnosis
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.trial.observation import (
    GOAL_POSE, LOCAL_T_WORLD, MOVED, Observation, Run, Stimulus)
from tb3_labs.report.cause import hints
from tb3_labs.report.cause.diagnosed_drives import Seen, apart
from tb3_labs.report.cause.diagnosed_turns import LAWS, Law
from tb3_labs.report.cause.diagnosis import Diagnosis, diagnose
from tb3_labs.report.cause.mistakes import WAYS, Declared, Drive, Way
from tb3_labs.report.motion.movements import completed
from tb3_labs.report.run_data import LogLines, Values

GOAL = Pose2(-0.61, 0.61, 0.0)
#: The robot stood at (0.8, 0.5), 100 degrees, when the frame was declared.
AT_RESET = Declared(Pose2(0.8, 0.5, math.radians(100.0)), math.radians(65.4))


def turned(law, heading, side):
    return math.degrees(law.turned(math.radians(heading), side, math.radians(0.1))[0])


@pytest.mark.parametrize('heading, side, right, unwrapped', [
    (100.0, 1.0, 90.0, 90.0), (330.0, 1.0, 90.0, -270.0), (40.0, -1.0, -90.0, 270.0)])
def test_a_turn_whose_error_is_not_wrapped_goes_the_long_way_round(heading, side, right, unwrapped):
    assert turned(Law(), heading, side) == pytest.approx(right, abs=0.2)
    assert turned(Law(error_wraps=(False, False)), heading, side) == pytest.approx(
        unwrapped, abs=0.2)


def test_a_goal_of_420_degrees_is_never_reached():
    assert turned(Law(goal_wraps=(False, False), error_wraps=(False, False)), 330.0, 1.0) == math.inf


def test_the_right_drive_is_that_of_the_handout():
    """135 degrees, then sqrt(2) * 0.61 m less the 0.15 m at which it arrives, then back."""
    drive = Way().drive(AT_RESET.odom, AT_RESET, AT_RESET, GOAL, 1e-3)
    assert drive == pytest.approx((math.radians(135.0), 0.61 * math.sqrt(2.0) - 0.15,
                                   -math.radians(135.0)), abs=3e-3)


@pytest.mark.parametrize('way', [way for way in WAYS if way.mistake in (
    'inverse_missing', 'not_rotated', 'imu_rotates')])
def test_a_displacement_that_is_rotated_wrongly_never_comes_near(way):
    drive = way.drive(AT_RESET.odom, AT_RESET, AT_RESET, GOAL)
    assert drive.way == math.inf


@pytest.mark.parametrize('was, ended, ideal, metres', [
    ((2.0, 0.7, -2.0), '', (2.0, 0.7, -2.0), 0.0),
    ((2.0, 0.7, -2.0), '', (2.0, 1.0, -2.0), 0.6),                  # too short counts twice
    ((2.0, 1.0, -2.0), '', (2.0, 0.7, -2.0), 0.3),                  # too long, after the 0.15 m
    ((2.0, 0.8, -2.0), '', (2.0 - math.pi / 2.0, 0.8, -2.0), 0.8 * math.sqrt(2.0)),
    ((2.0, 0.7, -2.0), '', (2.0, 0.7, -1.5), 0.15),
    ((2.0, 0.7, -2.0), '', (2.0, math.inf, 0.0), 2.0),
    ((2.0, 0.5, 0.0), 'way', (2.0, 0.7, -2.0), 0.0),
    ((2.0, 1.0, 0.0), 'way', (2.0, 0.5, 0.0), 0.35),
    ((2.0, 0.7, -1.0), 'last', (2.0, 0.7, -2.0), 0.0),
    ((2.0, 0.7, -2.0), 'last', (2.0, 0.7, -1.0), 0.3),
    ((math.nan, 0.7, 0.0), '', (math.nan, math.nan, 0.0), 0.0),     # left and right
    ((math.nan, 0.7, 0.0), '', (2.0, 0.7, -2.0), 2.0),
    # without a way
    ((2.0, 0.0, -1.0), '', (2.0, 0.7, -1.0), 2.0),
    ((2.0, 0.0, -1.0), '', (1.5, 0.0, -1.5), 0.15), ((2.0, 0.0, 0.0), '', (1.5, 0.0, 1.0), 0.15),
    ((1.0, 0.0, 0.0), 'first', (2.0, 0.7, -2.0), 0.0), ((1.0, 0.0, 0.0), '', (1.0, 0.7, 0.0), 2.0),
    ((3.0, 0.0, 0.0), 'first', (math.inf, 0.0, 0.0), 0.0),          # a person ended it
    ((3.0, 0.0, 0.0), 'first', (-math.inf, 0.0, 0.0), 2.0),
    ((2.0, 0.0, 0.0), 'first', (math.inf, 0.0, 0.0), 2.0)])         # too early to tell
def test_how_far_a_drive_is_from_an_ideal_one(was, ended, ideal, metres):
    seen = Seen((0.0, 1.0, 2.0, 3.0), Pose2(), Drive(*was), ended, Pose2())
    assert apart(seen, Drive(*ideal)) == pytest.approx(metres, abs=1e-9)


def run_of(lab, mistake, seed):
    source = random.Random(seed)
    node = mistaken_node(lab, mistake, source)
    return played(node.text, scene_of(node, source), seed)


@pytest.mark.parametrize('lab, mistake, seed', [
    ('drive', 'place_kept', 1), ('drive', 'declared_lost', 1), ('drive', 'no_local_frame', 1),
    ('drive', 'no_stop', 1), ('drive', 'state_kept', 0), ('turn', 'error_not_wrapped', 3),
    ('turn', 'no_negative_clamp', 1), ('turn', 'degrees_twice', 1), ('turn', 'sleeps', 1),
    ('pad', 'two_senders', 1)])
def test_the_mistake_of_a_run_is_found(lab, mistake, seed):
    run = completed(run_of(lab, mistake, seed))
    found = diagnose(run)
    assert (found.lab, found.mistake) == (lab, mistake)
    page = hints.section(found, run)
    assert ('--goal' in page) is (lab == 'drive')
    assert hints.HINTS[lab, mistake].does in re.sub(r'&#x27;', "'", page)
    assert hints.HINTS[lab, mistake].look in hints.in_a_line(found)
    assert page.index('Hint 1') < page.index('Hint 2') < page.index('Hint 3') < page.index(
        'The mistake')


SEEN_LATE = ['Duration(.1)', 'Duration({})']
ONCE = ['            ang_z = self.K_HDG * yaw_err\n', '''            self.cmd.angular.z = 1.5 if yaw_err > 0 else -1.5
            for _ in range({}):
                self.cmd_pub.publish(self.cmd)
                rospy.sleep({})
            yaw_err, ang_z = 0, 0
''']


@pytest.mark.parametrize('change, numbers', [
    (SEEN_LATE, (0.5,)), (SEEN_LATE, (0.7,)), (SEEN_LATE, (1.0,)), (SEEN_LATE, (2.0,)),
    (ONCE, (1, 1.05)), (ONCE, (10, 0.1)), (ONCE, (5, 0.1))])
@pytest.mark.parametrize('knows_letters', [True, False])
def test_the_end_of_a_turn_that_a_node_did_not_watch_is_no_evidence_of_its_law(change, numbers, knows_letters):
    text = edited(text_of('turtlebot_controller'), [(change[0], change[1].format(*numbers))])
    for seed in range(3):
        run = played(text, turn_scene(random.Random(seed)), seed, knows_letters)
        assert diagnose(completed(run)).mistake in ('sleeps', '', None)


@pytest.mark.parametrize('mistake', BY_LETTERS)
def test_a_mark_knows_by_the_letters_which_turns_are_missing(mistake):
    text = edited(text_of('turtlebot_controller'), BY_LETTERS[mistake])
    run = played(text, turn_scene(random.Random(1)), 1, knows_letters=True)
    assert diagnose(run).mistake == mistake
    found = diagnose(replace(run, letters=Values.none()))
    assert not found.mistake or mistake in found.causes


def test_of_several_mistakes_that_move_a_robot_in_the_same_way_none_is_preferred():
    """An error with the wrong sign, and a heading that falls where it shall grow; one that stays."""
    for mistake, causes in [('sign', {'sign', 'quaternion_order', 'never_ends'}), (
            'quaternion_order', {'heading_kept', 'quaternion_order', 'radians'})]:
        found = diagnose(run_of('turn', mistake, 1))
        assert set(found.causes) == causes
        said, line = ' '.join(hints.sentences(found)), hints.in_a_line(found)
        for cause in found.causes:
            hint = hints.HINTS['turn', cause]
            assert said.count(hint.does) == 2 and hint.tell in said and hint.look in line
            assert hint.todo in hints.section(found)
        assert not re.search(r'\d degrees|cm|2 m', said)


def test_an_exception_and_open_todos_stand_once_above_the_rest():
    text = 'bad callback: <f>\nTraceback (most recent call last):\n  File "a.py", line 8, in f\n' \
        "NameError: name 'raw_input' is not defined\n"
    time, lines = np.arange(9.0), [text] * 6 + ['TODO 2 is open: x', 'TODO 4 is open', 'hello']
    page = hints.said_by_node(made(log=LogLines(time, time, *np.array(
        [('error', '/node', line) for line in lines], dtype=object).T)))
    assert page.count('An exception came 6 times: NameError: name &#x27;raw_input&#x27; is not '
                      'defined (line 8).') == 1 and '#t=0.0' in page
    assert 'The node said: TODO 2 is open, TODO 4 is open.' in page and 'hello' not in page


@pytest.mark.parametrize('lab, kind', [(lab, kind) for lab in RIGHT for kind in RIGHT[lab]])
def test_a_right_node_is_not_accused_whatever_a_person_does(lab, kind):
    node, scene, goal = right_run(lab, kind, random.Random(lab + kind))
    found = diagnose(completed(played(node, scene, 1), goal))
    assert found.mistake == '' and hints.section(found) == '' == hints.in_a_line(found)


def test_a_run_that_no_mistake_explains_says_so():
    assert 'No known mistake explains' in hints.section(Diagnosis(None))


def test_each_mistake_has_a_hint_that_leads_to_a_step_of_the_sheet():
    assert {('drive', way.mistake) for way in WAYS[1:]} | {
        ('turn', law.mistake) for law in LAWS[2:]} <= set(hints.HINTS)
    for (lab, _), hint in hints.HINTS.items():
        text = (ROOT / 'doc' / '{}.md'.format(hints.SHEETS[lab].lower().replace(' ', '_'))).read_text()
        part = text.split('\n## {}\n'.format(hint.heading))[1].split('\n## ')[0]
        assert not hint.step or re.search(r'^{}\. '.format(hint.step), part, re.MULTILINE), hint


# The page of a mark -------------------------------------------------------------------------------

def as_marked(run):
    """The Observation of a played run of drives: what the marker would have recorded of it."""
    frames = [(0.0, Pose2())] + [(time, run.resets.pose(k)) for k, time in enumerate(run.resets.time)]
    given = np.flatnonzero(run.control.value)
    ends = [*run.control.time, run.duration]
    seen = Observation('move2goal', 'lab7/node.py', runs=[Run(0.0, 0.5)], run=run)
    for k in given:
        begin = float(run.control.time[k])
        at, declared = [frame for frame in frames if frame[0] <= begin][-1]
        local = declared @ run.ground_truth.at(at).inverse()
        seen.stimuli.append(Stimulus('drive', begin, float(ends[k + 1]), facts={
            MOVED: True, GOAL_POSE: [GOAL.x, GOAL.y, GOAL.yaw],
            LOCAL_T_WORLD: [local.x, local.y, local.yaw]}))
    return seen


@pytest.mark.parametrize('mistake', [
    'no_local_frame', *PARTIAL, 'degrees', 'place_kept', 'quaternion_order', ''])
def test_a_mark_and_a_report_say_the_same_also_of_partial_mends(mistake):
    source = random.Random(3)
    node = mistaken_node('drive', mistake, source) if mistake else right_node('drive', source)
    run = played(node.text, scene_of(node, source), 5)
    found, seen = diagnose(completed(run)), as_marked(run)
    marked = diagnose(as_run(seen))
    assert marked.mistake == found.mistake
    assert is_same(mistake.split('/')[0], found.mistake)
    if mistake and found.ghost.length:      # in the robot's odom
        assert marked.ghost.points[0] == pytest.approx(found.ghost.points[0], abs=0.02)


def test_a_node_that_never_heard_a_sensor_is_not_diagnosed():
    with tempfile.TemporaryDirectory() as folder:
        seen = recorded(folder + '/trial.bag', robot_that_turned(200.0))
    criterion = SimpleNamespace(extra=False)
    marks = Marks('', verdicts=[Verdict(criterion, Outcome.MISSED, 'it turned', 1.0)], observation=seen)
    assert diagnosis(as_run(seen), marks) != Diagnosis('')
    seen.runs[0].unheard = ['/imu_data']
    assert diagnosis(as_run(seen), marks) == Diagnosis('')
    assert seen.deaf == 'it listens to /imu_data, which nobody publishes'


@pytest.mark.parametrize('name, asked', [('l', True), ('x', False)])
def test_a_mark_is_diagnosed_by_the_turns_that_were_asked_for(name, asked):
    assert (diagnose(trial_run(robot_that_turned(45.0, name))).mistake != '') is asked


@pytest.mark.parametrize('degrees, letter, mistake', [
    (90.0, 'l', ''), (-90.0, 'l', 'swapped'), (90.0, 'r', 'swapped'), (-90.0, 'r', '')])
def test_a_mark_knows_the_letters(degrees, letter, mistake):
    seen = robot_that_turned(degrees, letter)
    seen.commands[1:1] = [[k / 10.0, *seen.commands[0][1:]] for k in range(2, 19)]
    assert diagnose(trial_run(seen)).mistake == mistake
