"""The diagnosis of a run: the known mistakes in closed form, and runs of mistaken nodes."""
import math
import random
import re
from pathlib import Path

import numpy as np
import pytest

from mutants import mistaken_node, scene_of
from right_runs import RIGHT, right_run
from student_runs import played, text_of, turn_scene
from test_marking import turned as robot_that_turned
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.feedback import diagnosis
from tb3_labs.marking.move2goal import GOAL_POSE, LOCAL_T_WORLD, SENSED
from tb3_labs.marking.observation import MOVED, RESTED, Observation, Run, Stimulus
from tb3_labs.report import hints
from tb3_labs.report.diagnosed_drives import Seen, apart, ghost
from tb3_labs.report.diagnosis import Diagnosis, diagnose
from tb3_labs.report.mistakes import LAWS, WAYS, Declared, Drive, Law, Way
from tb3_labs.report.movements import completed

DOC = Path(__file__).resolve().parents[2] / 'doc'
GOAL = Pose2(-0.61, 0.61, 0.0)
#: The robot stood at (0.8, 0.5), 100 degrees, when the frame was declared.
AT_RESET = Declared(Pose2(0.8, 0.5, math.radians(100.0)), math.radians(65.4))
OFFSET = AT_RESET.imu - AT_RESET.odom.yaw


def turned(law, heading, side):
    return math.degrees(law.turned(math.radians(heading), side, math.radians(0.1)))


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
    ('drive', 'no_stop', 1), ('turn', 'error_not_wrapped', 3), ('turn', 'no_negative_clamp', 1),
    ('pad', 'two_senders', 1)])
def test_the_mistake_of_a_run_is_found(lab, mistake, seed):
    run = completed(run_of(lab, mistake, seed))
    found = diagnose(run)
    assert (found.lab, found.mistake) == (lab, mistake)
    page = hints.section(found, run)
    assert ('--goal' in page) is (lab == 'drive')
    assert hints.HINTS[lab, mistake].does in re.sub(r'&#x27;', "'", page)
    assert page.index('Hint 1') < page.index('Hint 2') < page.index('Hint 3') < page.index(
        'The mistake')


@pytest.mark.parametrize('old, new', [('to_euler(degrees=True)', 'to_euler()'),
                                      ('self.curr_yaw = self.convert_yaw(yaw)', 'pass')])
def test_a_heading_that_never_changes_is_not_said_to_be_in_radians(old, new):
    text = text_of('turtlebot_controller').replace(old, new)
    found = diagnose(played(text, turn_scene(random.Random(1)), 1))
    assert found.mistake == 'heading_kept'
    assert 'hardly changes' in hints.section(found) and 'radians' not in hints.section(found)


@pytest.mark.parametrize('lab, kind', [(lab, kind) for lab in RIGHT for kind in RIGHT[lab]])
def test_a_right_node_is_not_accused_whatever_a_person_does(lab, kind):
    node, scene, goal = right_run(lab, kind, random.Random(lab + kind))
    found = diagnose(completed(played(node, scene, 1), goal))
    assert found.mistake == '' and hints.section(found) == ''


def test_a_run_that_no_mistake_explains_says_so():
    assert 'No known mistake explains' in hints.section(Diagnosis(None))


def test_each_mistake_has_a_hint_that_leads_to_a_step_of_the_sheet():
    assert {('drive', way.mistake) for way in WAYS[1:]} | {
        ('turn', law.mistake) for law in LAWS[2:]} <= set(hints.HINTS)
    for (lab, _), hint in hints.HINTS.items():
        text = (DOC / '{}.md'.format(hints.SHEETS[lab].lower().replace(' ', '_'))).read_text()
        part = text.split('\n## {}\n'.format(hint.heading))[1].split('\n## ')[0]
        assert not hint.step or re.search(r'^{}\. '.format(hint.step), part, re.MULTILINE), hint


# The page of a mark -------------------------------------------------------------------------------

def driven(way, last, start, begin):
    """A stimulus of a drive of the robot with this way, its true poses and its commands; ``odom``
    is the frame of the true poses, turned by 30 degrees."""
    drive = way.drive(last.odom, last, start, GOAL)
    times = tuple(begin + after for after in (0.0, 3.0, 9.0, 12.0))
    odom_T_true = Pose2(0.0, 0.0, math.radians(30.0))
    path = ghost([Seen(times, last.odom, drive, '', last.odom)], [drive]).seen_from(
        odom_T_true.inverse())
    true = Pose2(*(odom_T_true.inverse() @ last.odom).act([0.0, 0.0]),
                 last.odom.yaw - odom_T_true.yaw)
    local_T_true = last.pose @ true.inverse()
    facts = {GOAL_POSE: [GOAL.x, GOAL.y, GOAL.yaw], MOVED: True, RESTED: True,
             LOCAL_T_WORLD: [local_T_true.x, local_T_true.y, local_T_true.yaw],
             SENSED: [last.odom.x, last.odom.y, last.odom.yaw, last.imu]}
    # it rests before its end
    truth = [[float(time), *map(float, pose)] for time, *pose in zip(
        path.time, path.x, path.y, np.unwrap(path.yaw))] + [
            [begin + 14.0, float(path.x[-1]), float(path.y[-1]), float(np.unwrap(path.yaw)[-1])]]
    commands = [[begin + k / 10.0, 0.15 if 30 <= k < 90 else 0.0, 0.0 if 30 <= k < 90 else 0.3]
                for k in range(120)] + [[begin + 12.0, 0.0, 0.0]]
    return Stimulus('drive {}'.format(begin), begin, begin + 14.0, facts=facts), truth, commands


@pytest.mark.parametrize('name, moved, asked', [
    ('l', True, True), ('l', False, False), ('x', True, False)])
def test_a_mark_is_diagnosed_by_the_turns_that_were_asked_and_done(name, moved, asked):
    assert (diagnosis(robot_that_turned(45.0, name, moved)) != Diagnosis('')) is asked


@pytest.mark.parametrize('degrees, letter, mistake', [
    (90.0, 'l', ''), (-90.0, 'l', 'swapped'), (90.0, 'r', 'swapped'), (-90.0, 'r', '')])
def test_a_mark_knows_the_letters(degrees, letter, mistake):
    seen = robot_that_turned(degrees, letter)
    seen.commands[1:1] = [[k / 10.0, *seen.commands[0][1:]] for k in range(2, 19)]
    assert diagnosis(seen).mistake == mistake


@pytest.mark.parametrize('way', [way for way in WAYS if way.mistake in ('', 'place_kept')][:2])
def test_a_mark_says_which_mistake_fits_its_drives(way):
    start = Declared(Pose2(), OFFSET)
    parts = [driven(way, start, start, 1.0), driven(way, AT_RESET, start, 20.0)]
    seen = Observation('move2goal', 'lab7/node.py', [row for part in parts for row in part[2]],
                       [row for part in parts for row in part[1]], [part[0] for part in parts],
                       [Run(0.0, 0.5)])
    found = diagnosis(seen)
    assert found.mistake == way.mistake
    # the ghost drives on the true robot's way, in its frame
    if way.mistake:
        second = found.ghost.between(20.0, 40.0)
        assert second.points[-1] == pytest.approx(np.array(parts[1][1])[-1, 1:3], abs=0.01)
