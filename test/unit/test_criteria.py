"""A good node meets each criterion of each lab. Each changed node misses certain criteria."""
import copy
import math
from dataclasses import replace

import numpy as np
import pytest

from made_run import made, speeds_sent
from test_marking import observation, recording, stimulus
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.criteria import NOT_TRIED, Outcome, verdicts_of
from tb3_labs.marking.labs.ros_turn import mouse_fields
from tb3_labs.marking.marks import LABS
from tb3_labs.marking.trial.observation import NodeProcess, Observation, Stimulus
from tb3_labs.marking.trial.remarks import remarks_on, version_errors
from tb3_labs.recording.run_data import Commands

#: The output of a node that says goodbye, and then ends with a traceback.
CRASH = '''Bye
Traceback (most recent call last):
  File "/usr/lib/python3/dist-packages/rospy/timer.py", line 237, in run
    self._callback(TimerEvent())
  File "/home/ann/node.py", line 7, in f
    x
NameError: name 'x' is not defined
'''
#: A stimulus begins every SLOT [s], and lasts for LASTS [s].
SLOT, LASTS = 10.0, 8.0


def scene(*commands, truth=(), printed='', lines=1, died=False, **facts):
    """What is seen in a stimulus. `commands` are (time, linear, angular), `truth` are (time, x, y, yaw). Time 0 is
    the time at which the stimulus begins."""
    return dict(commands=commands, truth=truth, printed=printed, lines=lines, died=died,
                facts=facts)


def stopped(second, linear=0.2, angular=0.0, **more):
    """The node drives the robot, and stops it at `second` [s]."""
    return scene((0.01, linear, angular), (second, linear, angular), (second + 0.01, 0.0, 0.0),
                 **more)


def turn(degrees, rate=1.5, forward=0.0, moved=True, rested=True, **more):
    angle = math.radians(degrees)
    return scene((0.1, forward, math.copysign(rate, degrees)), (2.0, 0.0, 0.0),
                 truth=[(0.2 * k, 0.0, 0.0, 3.0 + 0.1 * k * angle) for k in range(11)],
                 moved=moved, rested=rested, **more)


def drive(x=-0.61, y=0.61, degrees=0.0, linear=0.2, angular=0.0, moved=True, rested=True):
    """A drive to a pose in the local frame. The origin of the world is at (1, 0) in this frame."""
    way = [(0.0, -1.0, 0.0, 0.0), (2.0, -2.0, 1.0, 1.0), (5.0, x - 1.0, y, math.radians(degrees))]
    return scene((0.1, linear, angular), (5.0, 0.0, 0.0), truth=way, moved=moved, rested=rested,
                 goal=[-0.61, 0.61, 0.0], local_T_world=[1.0, 0.0, 0.0])


def ctrl_c(*commands, printed='', took=0.4, signal=0, was_moving=True):
    return scene(*commands or [(0.49, 0.0, 0.0)], printed=printed, died=True, took=took,
                 signal=signal, was_moving=was_moving)


def reset(*commands, degrees=0.0, printed='Local pose set to x=0, y=0, yaw=0', **facts):
    """A reset, after which the robot turns by `degrees`."""
    return scene(*commands, printed=printed, truth=[(0.0, 0.0, 0.0, 0.0), (3.0, 0.1, 0.0, math.radians(degrees))],
                 **dict(dict(problem='', name='', was_moving=True, straight=True), **facts))


def called(calls=1, printed='Pose reset successfully', **facts):
    """The button Y calls the reset `calls` times."""
    return scene(printed=printed, calls=calls, **dict(dict(origin=True, unit=True, name='set_pose'), **facts))


def heading(*degrees):
    return ''.join('Current heading is {} degrees.\n'.format(number) for number in degrees)


#: A node that reaches the limits, but meets every criterion.
GOOD = {
    'imu': {
        'at 50 degrees': scene(printed=heading(50.9, 49.1), heading_deg=50.0),
        'at 150 degrees': scene(printed=heading(150.0), heading_deg=150.0),
        'at 220 degrees': scene(printed=heading(220.0), heading_deg=220.0),
        'at 350 degrees': scene(printed=heading(0), heading_deg=359.5),
        'a hair below zero': scene(printed=heading('0.000000', '359.999999')),
        'a quaternion of zeros': scene(printed='not valid\n' + heading(57.9)),
        # the handout's code may print one more heading after its goodbye
        'Ctrl+C': ctrl_c(printed='Shutting down the IMU subscriber\n' + heading(1))},
    'turn': {
        'l': turn(90.9, forward=0.004), 'l across 180': turn(90.0), 'r across 180': turn(-89.1),
        'r': turn(-90.0, rate=1.504), 'r across 0': turn(-90.0), 'l across 0': turn(90.0),
        'nonsense': scene((0.1, 0.0, 0.0), printed='Not valid: type l or r.', lines=1000),
        'mouse not active': scene((0.1, 0.0, 0.0)), 'mouse up': scene((0.1, 0.549, 0.049)),
        'mouse near the middle': stopped(0.49), 'mouse left': scene((0.1, -0.049, 0.451)),
        'mouse half right and half down': scene((0.1, -0.399, -0.101)), 'mouse deactivated': stopped(0.49),
        'l beside the mouse': turn(90.0), 'mouse after a turn': scene((0.1, 0.451, 0.0)),
        'mouse in a turn': scene((0.1, 0.0, 1.5), (3.0, 0.5, 0.0), was_moving=True),
        'IMU silent': stopped(0.99, was_moving=True),
        'mouse silent': stopped(0.99, was_moving=True),
        'Ctrl+C': ctrl_c(printed='Controller exiting. Halting robot.\n')},
    'move2goal': {
        'without control': scene((0.1, 0.0, 0.0)),
        'first drive': drive(-0.61 + 0.019, degrees=-0.9, linear=-0.224, angular=-2.844),
        'at the goal': scene((0.49, 0.0, 0.0), printed='goal REACHED!\n'),
        'reset to the origin': reset(), 'second drive': drive(),
        'reset in a drive': reset(degrees=20.1), 'control taken': stopped(0.49, was_moving=True),
        'reset to another pose': scene(problem=''), 'drive from a declared pose': drive(),
        'drive with an offset IMU': drive(), 'odometry silent': stopped(0.99, was_moving=True),
        'Ctrl+C': ctrl_c()},
    'gamepad': {
        'left stick up': scene((0.1, 0.224, 0.049)),
        'left stick half up, right stick half right': scene((0.1, 0.057, -0.712)),
        'left stick down': scene((0.1, -0.151, 0.0)), 'right stick left': scene((0.1, 0.049, 1.51)),
        'right stick right': scene((0.1, 0.0, -2.844)), 'sticks let go': stopped(0.49),
        'A': scene(**{'relinquished': True, 'heard late': True}),
        'left stick up after A': scene(), 'B': scene(relinquished=False),
        'left stick up after B': scene((0.1, 0.2, 0.0)),
        'Y': called(printed='pose reset SUCCESSFULLY'),
        'Y without a service': scene((0.69, 0.2, 0.0), printed='no service'),
        'pad silent': stopped(0.99, was_moving=True), 'Ctrl+C': ctrl_c()}}


def observed(lab, **parts):
    """The Observation of a node that was ready. `parts` has what was seen in each stimulus."""
    seen, commands, truth = observation(lab), [], []
    for number, (name, said) in enumerate(parts.items()):
        begin, said = SLOT * (number + 1), copy.deepcopy(said)
        for rows, mine in ((said['commands'], commands), (said['truth'], truth)):
            mine += [[begin + row[0], *row[1:]] for row in rows]
        seen.stimuli.append(Stimulus(name, begin, begin + LASTS, said['printed'], said['lines'],
                                     said['died'], said['facts']))
    seen.recording = recording(commands, truth)
    seen.parts = [(part, 0.0) for part in LABS[lab].parts]
    return seen


def verdicts(lab, seen, parts=()):
    criteria = LABS[lab].criteria
    return verdicts_of(criteria, seen, {criterion.name: 1.0 for criterion in criteria}, parts)


def missed_verdicts(lab, seen):
    """Returns {name of the criterion: Verdict} of the missed criteria. A met criterion has no sentence."""
    judged = verdicts(lab, seen)
    assert all(isinstance(v.reason, str) and (v.reason == '') is (v.outcome is Outcome.MET)
               for v in judged)
    assert {v.outcome for v in judged} <= {Outcome.MET, Outcome.MISSED}
    return {v.criterion.name: v for v in judged if v.outcome is Outcome.MISSED}


def missed(lab, seen):
    return set(missed_verdicts(lab, seen))


@pytest.mark.parametrize('lab', LABS)
def test_a_good_node_meets_every_criterion(lab):
    assert missed(lab, observed(lab, **GOOD[lab])) == set()


def extended(printed):
    return 'Traceback (most recent call last):\n  File x\n{}\n'.format(printed)


CHANGES = [
    # (lab, {stimulus: what is seen in place of GOOD, or a list of such scenes}, the criteria that each scene misses)
    ('imu', {'at 50 degrees': scene(printed=heading(50, 48.9), heading_deg=50.0)}, 'heading_right'),
    ('imu', {'at 350 degrees': [scene(printed=heading(-10.0), heading_deg=350.0),
     scene(printed=heading(359.95, 360.0), heading_deg=359.5)]}, 'from_0_to_360'),
    ('imu', {'at 150 degrees': scene(printed='150.0', heading_deg=150.0)}, 'prints_heading'),
    ('imu', {name: scene(printed='150.0', heading_deg=150.0) for name in GOOD['imu'] if name.startswith('at ')},
     'prints_heading heading_right from_0_to_360'),
    ('imu', {'Ctrl+C': [ctrl_c(printed='Bye'), ctrl_c(printed='Shutting down the IMU subscriber\n' + heading(1, 2))]},
     'says_goodbye'),
    ('imu', {'a hair below zero': [scene(), scene(printed=heading(0, 360.0, 1))]}, 'never_360'),
    ('imu', {'a quaternion of zeros': [scene(printed=extended('E') + heading(57)),
     scene(printed=heading(58.05, 55.95))]}, 'survives_nonsense'),

    ('turn', {'l': turn(91.05)}, 'within_1_deg'),
    ('turn', {'r across 0': turn(-100.9)}, 'within_1_deg'),
    # the first node does not wrap an error below -180; the second turns for a fixed time on a carpet
    ('turn', {'l across 0': [turn(-270.0), turn(0.7 * 90.0)]}, 'within_1_deg short_way'),
    ('turn', {'r': turn(-0.7 * 100.0)}, 'within_1_deg right'),
    # the node sends no zero, so that the robot's own timeout ends the turn
    ('turn', {'l': dict(turn(90.0), commands=[(0.1, 0.0, 0.5)])}, 'within_1_deg left'),
    ('turn', {'r across 0': turn(-101.1)}, 'within_1_deg short_way'),
    ('turn', {'r across 180': turn(-90.0, moved=False)}, 'within_1_deg short_way'),
    ('turn', {'r': turn(-90.0, rested=False)}, 'within_1_deg right'),
    ('turn', {'l': turn(-90.0)}, 'within_1_deg left'),
    ('turn', {'r': turn(-90.0, 1.506)}, 'clamped'),
    ('turn', {'l': turn(90.0, forward=-0.0053)}, 'on_the_spot'),
    ('turn', {'nonsense': [scene((0.1, 0.0, 0.1), printed='l, r'), scene(printed='l or r', lines=1001),
     scene(printed='left, please'), scene(printed='or r')]}, 'answers_nonsense'),
    ('turn', {'nonsense': scene(printed='Please type left or right')}, ''),
    ('turn', {'nonsense': scene(died=True, printed="KeyError: 'l' or 'r'")}, 'answers_nonsense'),
    ('turn', {'mouse up': [scene((0.1, 0.551, 0.0)), scene((0.1, 0.449, 0.0))]}, 'mouse_drives'),
    ('turn', {'mouse left': scene((0.1, 0.0, -0.5))}, 'mouse_drives'),
    ('turn', {'mouse half right and half down': [
        scene((0.1, -0.2, -0.099)), scene((0.1, -0.2, -0.401)),
        # two nodes that obey one way at a time, and a node that drives forward for a mouse that is down
        scene((0.1, 0.0, -0.2)), scene((0.1, -0.2, 0.0)), scene((0.1, 0.2, -0.2))]}, 'mouse_drives'),
    ('turn', {'mouse up': scene((0.1, 0.0, 0.0))}, 'mouse_drives mouse_dead_zone mouse_off'),
    ('turn', {'mouse near the middle': [stopped(0.51), scene()]}, 'mouse_dead_zone'),
    ('turn', {'mouse deactivated': [stopped(0.51), scene()]}, 'mouse_off'),
    ('turn', {'mouse not active': scene((0.1, 0.0, 0.1))}, 'mouse_off'),
    ('turn', {'l beside the mouse': turn(78.9)}, 'turn_beside_mouse'),
    ('turn', {'mouse after a turn': scene((0.1, 0.449, 0.5))}, 'mouse_after_turn'),
    ('turn', {'mouse in a turn': [scene((0.1, 0.5, 0.0), was_moving=False), scene((0.1, 0.0, 1.5), was_moving=True)]},
     'mouse_in_turn'),
    ('turn', {'mouse silent': [stopped(1.01, was_moving=True), scene((0.1, 0.2, 0.0), was_moving=True)]}, 'lost_mouse'),
    ('turn', {'IMU silent': [stopped(1.01, was_moving=True), stopped(0.5, was_moving=False)]}, 'lost_imu'),
    ('turn', {'Ctrl+C': ctrl_c(printed='Halting robot.')}, 'says_goodbye'),

    ('move2goal', {'without control': scene((0.1, 0.01, 0.0))}, 'waits'),
    ('move2goal', {'reset to the origin': reset((0.3, 0.0, 0.7), was_moving=False)}, 'waits'),
    ('move2goal', {'first drive': [drive(y=0.61 - 0.021), drive(degrees=1.05), drive(degrees=722.0)]}, 'exact'),
    ('move2goal', {'second drive': drive(x=-0.61 - 0.1711)}, 'exact second_place'),
    ('move2goal', {'first drive': drive(y=0.61 + 0.1711)}, 'exact goal_place'),
    ('move2goal', {'second drive': drive(degrees=-4.9)}, 'exact second_heading'),
    ('move2goal', {'first drive': drive(degrees=4.9)}, 'exact goal_heading'),
    ('move2goal', {'first drive': [drive(moved=False), drive(rested=False)]},
     'exact goal_place goal_heading silent_at_goal'),
    ('move2goal', {'at the goal': [scene(), scene(printed='Goal reached!\n' * 2)]}, 'says_reached'),
    ('move2goal', {'at the goal': scene((0.51, 0.0, 0.0), printed='Goal reached!')}, 'silent_at_goal'),
    ('move2goal', {'first drive': dict(drive(), commands=[(5.0, 0.0, 0.02)])}, 'silent_at_goal'),
    ('move2goal', {'second drive': [drive(linear=-0.2253), drive(angular=-2.8453)]}, 'within_limits'),
    ('move2goal', {'reset to the origin': reset(problem='no')},
     'resets second_place second_heading'),
    ('move2goal', {'reset to the origin': reset(name='/move_to_goal/set_pose')}, 'resets'),
    # the reset works at the goal alone; the reset fails; the node adds up its own commands
    ('move2goal', {'reset in a drive': [
        reset(degrees=19.0), reset(degrees=90.0, problem='no'), reset(degrees=90.0, straight=False)]}, 'resets'),
    ('move2goal', {'reset in a drive': reset(was_moving=False, straight=False)}, ''),
    ('move2goal', {'reset to the origin': reset(printed='done')}, 'says_reset'),
    ('move2goal', {'control taken': [stopped(0.51, was_moving=True), stopped(0.3, was_moving=False),
     scene(was_moving=True), scene((0.1, 0.2, 0.0), was_moving=True)]}, 'control_taken'),
    ('move2goal', {'reset to another pose': scene(problem='no')}, 'declared_pose'),
    ('move2goal', {'drive from a declared pose': drive(x=-0.43)}, 'declared_pose'),
    ('move2goal', {'drive with an offset IMU': [drive(x=-0.43), drive(degrees=5.0)]}, 'offset_imu'),
    ('move2goal', {'odometry silent': stopped(1.01, was_moving=True)}, 'lost_odometry'),

    ('gamepad', {'left stick up': [scene((0.1, 0.149, 0.0)), scene((0.1, 0.226, 0.0)), scene((0.1, 0.2, -0.051))]},
     'drives'),
    # half a stick is too slow, too fast, or without effect
    ('gamepad', {'left stick half up, right stick half right': [
        scene((0.1, 0.055, -1.0)), scene((0.1, 0.169, -1.0)), scene((0.1, 0.0, -1.0))]}, 'drives'),
    ('gamepad', {'left stick half up, right stick half right': [
        scene((0.1, 0.1, -0.71)), scene((0.1, 0.1, -2.14)), scene((0.1, 0.1, 1.0))]}, 'turns'),
    ('gamepad', {'left stick down': scene((0.1, 0.2, 0.0))}, 'drives'),
    ('gamepad', {'right stick left': scene((0.1, 0.0, 1.49))}, 'turns'),
    ('gamepad', {'right stick right': scene((0.1, 0.051, -2.0))}, 'turns'),
    ('gamepad', {'right stick right': scene((0.1, 0.0, 0.0))}, 'turns'),     # the left stick still drives
    ('gamepad', {'left stick half up, right stick half right': scene((0.1, 0.0, 0.0))}, 'drives turns lets_go'),
    # without a zero, the robot stops by its own timeout
    ('gamepad', {'sticks let go': [stopped(0.51), scene((0.05, 0.0, -1.0)), scene(), scene((0.6, 0.0, 0.0))]},
     'lets_go'),
    ('gamepad', {'A': scene(**{'relinquished': False, 'heard late': True})}, 'relinquishes silent_meanwhile regains'),
    ('gamepad', {'A': scene(**{'relinquished': None, 'heard late': False})},
     'relinquishes silent_meanwhile regains latched'),
    ('gamepad', {'left stick up after A': scene((0.1, 0.0, 0.0))}, 'silent_meanwhile'),
    ('gamepad', {'B': scene(relinquished=True)}, 'regains'),
    ('gamepad', {'left stick up after B': scene((0.1, 0.0, 0.0))}, 'regains'),
    ('gamepad', {'Y': called(0, name='')}, 'resets once'),
    ('gamepad', {'Y': called(2)}, 'once'),
    ('gamepad', {'Y': [called(unit=False), called(name='reset_pose'), called(name='set_local_pose')]}, 'resets'),
    ('gamepad', {'Y': [called(printed='Done', origin=False), called(
        printed='Done', origin=False, **{'not zero': [[], ['orientation.z is 1']]})]}, 'resets says_success'),
    ('gamepad', {'Y without a service': [scene((0.71, 0.2, 0.0), printed='no'),
     scene((0.1, 0.0, 0.0), printed='no')]}, 'not_blocked'),
    ('gamepad', {'Y without a service': [scene((0.1, 0.2, 0.0), printed=' \n'),
     scene((0.1, 0.2, 0.0), printed=extended('Error')),
     scene((0.1, 0.2, 0.0), printed='Pose reset successfully.')]}, 'says_why_not'),
    ('gamepad', {'pad silent': [stopped(1.01, was_moving=True), scene((0.1, 0.2, 0.0), was_moving=True)]}, 'lost_pad'),
    ('gamepad', {'Ctrl+C': [ctrl_c((0.51, 0.0, 0.0)), ctrl_c((0.1, 0.0, 0.1)), ctrl_c(was_moving=False)]},
     'stops_robot'),
]


def each_change():
    for lab, change, misses in CHANGES:
        (name, scenes), *_ = change.items()
        for seen in scenes if isinstance(scenes, list) else [scenes]:
            yield lab, dict(change, **{name: seen}), misses


@pytest.mark.parametrize('lab, change, lost', each_change())
def test_a_change_misses_these_criteria_and_no_others(lab, change, lost):
    assert set(change) <= set(GOOD[lab])
    seen = observed(lab, **dict(GOOD[lab], **change))
    found = missed_verdicts(lab, seen)
    assert set(found) == set(lost.split())
    # the link "Watch it" leads to a changed stimulus
    changed = {each.begin for each in seen.stimuli if each.name in change}
    assert {each.moment for each in found.values()} <= changed


def test_each_criterion_is_missed_by_a_change():
    """Other tests are about a node that does not start, or does not end well."""
    for lab in LABS:
        missing = {name for row in CHANGES if row[0] == lab for name in row[2].split()}
        assert {c.name for c in LABS[lab].criteria} - missing <= {'starts', 'clean_exit', 'stops_robot'}


def test_one_drive_is_enough_to_see_its_speeds():
    """The second drive was not reached in time."""
    parts = {name: said for name, said in GOOD['move2goal'].items() if name != 'second drive'}
    seen = observed('move2goal', **parts)
    untried = [each for each in verdicts('move2goal', seen) if each.criterion.name in ('second_place', 'exact')]
    assert [(each.outcome, each.moment) for each in untried] == [(Outcome.MISSED, None)] * 2
    assert 'within_limits' not in missed('move2goal', seen)


def test_a_robot_that_was_never_turned_or_driven_is_not_within_limits():
    still = scene((0.1, 0.0, 0.0), moved=False, rested=True)
    parts = {name: still for name in stimuli.TURN_STIMULI}
    assert {'clamped', 'on_the_spot'} <= missed('turn', observed('turn', **parts))
    none = {name: scene(moved=False, rested=True) for name in ('first drive', 'second drive')}
    assert 'within_limits' in missed('move2goal', observed('move2goal', **none))


@pytest.mark.parametrize('processes, misses_start, words', [
    ([], True, 'never started'), ([NodeProcess(0.0)], True, 'never listened'),
    ([NodeProcess(0.0, needed_topic='imu')], True, 'never came to rospy.init_node()'),
    ([NodeProcess(0.0, needed_topic='imu', nodes=['/n'], subscribed_topics=['/odom'])], True, 'listened to /odom'),
    ([NodeProcess(0.0, end=1.0, ended_by_itself=True, status=0, printed='Bye')], True, 'nothing kept the node'),
    ([NodeProcess(0.0, end=1.0, ended_by_itself=True, status=1, printed=CRASH)], True,
     "at once: \"NameError: name 'x' is not defined (line 7, in f)\""),
    ([NodeProcess(0.0, silent_topics=['/imu_data'])], True, 'listens to /imu_data, which nobody publishes'),
    ([NodeProcess(0.0, end=1.0, ended_by_itself=True, printed='x\nEnd\n\n')], True, "at once: 'End'"),
    ([NodeProcess(0.0, ready=0.5, end=9.0, ended_by_itself=True)], False, 'printed nothing'),
    ([NodeProcess(0.0), NodeProcess(1.0, ready=1.5)], True, 'the time was up'),
    ([NodeProcess(0.0, ready=0.5), NodeProcess(1.0, ready=1.5)], False, 'the time was up')])
@pytest.mark.parametrize('lab', LABS)
def test_a_node_of_which_nothing_was_seen_misses_all_but_its_start(lab, processes, misses_start, words):
    judged = verdicts(lab, Observation(lab, 'lab/node.py', processes=processes))
    met = {v.criterion.name for v in judged if v.outcome is Outcome.MET}
    assert met == (set() if misses_start else {'starts'})
    first, *others = [v.reason for v in judged if v.points == 0.0]
    assert words in first and set(others) == {NOT_TRIED}


def test_the_sentence_says_how_far_the_robot_truly_turned():
    unseen = {'r across 0': scene(moved=True, rested=True)}
    seen = observed('turn', **dict(GOOD['turn'], l=turn(70.0), r=turn(-110.0), **unseen))
    said = {v.criterion.name: v.reason for v in verdicts('turn', seen)}
    assert '70.0 degrees to the left' in said['left'] and '20.0 degrees short' in said['left']
    assert '110.0 degrees to the right' in said['right']
    assert '20.0 degrees beyond' in said['right'] and '10 are allowed' in said['right']
    assert '1 are allowed' in said['within_1_deg'] and '0.0 degrees' in said['short_way']


def test_parts_are_those_of_the_lab():
    assert LABS['turn'].read_parts(' mouse,turns, ') == ['mouse', 'turns']
    assert LABS['turn'].read_parts('') == []
    assert LABS['turn'].read_parts(','.join(LABS['turn'].parts)) == LABS['turn'].parts
    with pytest.raises(ValueError, match='heading'):
        LABS['turn'].read_parts('mouse,heading')


@pytest.mark.parametrize('name', stimuli.TURN_STIMULI)
def test_turns_across_180_and_0_degrees_cross_them_and_no_others_do(name):
    turn = stimuli.TURN_STIMULI[name]
    begin, end = turn.begins_deg, turn.begins_deg + turn.requested_deg
    crossed = [jump for jump in (0, 180) if min(begin, end) - 20.0 < jump < max(begin, end) + 20.0]
    assert crossed == [jump for jump in (0, 180) if turn.crossing == 'across {}'.format(jump)]
    assert turn.crossing in name


def missed_of(lab, name, seen):
    """Returns the Reason of the criterion `name`; '' if the criterion is met."""
    criterion, = [criterion for criterion in LABS[lab].criteria if criterion.name == name]
    return criterion.judge(seen)


@pytest.mark.parametrize('end, place, heading', [
    (Pose2(-0.61, 0.74, 0.04), True, True), (Pose2(-0.61, 0.79, 0.0), False, True),
    (Pose2(-0.61, 0.61, 0.1), True, False)])
def test_a_drive_is_judged_in_the_frame_it_began_in(end, place, heading):
    start = Pose2(4.8, -0.3, 2.0)
    local_T_world, there = start.inverse(), start @ end
    seen = observation('move2goal', stimuli=[stimulus('first drive', facts={
        'moved': True, 'rested': True, 'goal': stimuli.GOAL,
        'local_T_world': [local_T_world.x, local_T_world.y, local_T_world.yaw]})],
        truth=[[0.0, start.x, start.y, start.yaw], [2.0, there.x, there.y, there.yaw]])
    assert (missed_of('move2goal', 'goal_place', seen) == '') is place
    assert (missed_of('move2goal', 'goal_heading', seen) == '') is heading


BY_SIGN = {'mouse_drives', 'mouse_after_turn', 'mouse_in_turn'}


@pytest.mark.parametrize('backward, client, misses', [
    ('up half after in', 0, set()), ('', 0, set()), ('', 1, set()), ('', -1, set()),
    # the direction of the mouse is known from the submission's own client
    ('up half after in', 1, BY_SIGN), ('up half after in', -1, BY_SIGN),
    # the node is not consistent
    ('up', 0, BY_SIGN), ('up half', 0, BY_SIGN - {'mouse_drives'}), ('half', 0, {'mouse_drives'}),
    ('after', 0, {'mouse_after_turn'}), ('in', 1, {'mouse_in_turn'})])
def test_up_drives_forward_or_consistently_backward_if_the_client_is_not_known(backward, client, misses):
    names = dict(up='mouse up', half='mouse half right and half down', after='mouse after a turn',
                 **{'in': 'mouse in a turn'})
    parts = copy.deepcopy(GOOD['turn'])
    for name in map(names.get, backward.split()):
        parts[name]['commands'] = [(at, -linear, angular) for at, linear, angular in parts[name]['commands']]
    seen = observed('turn', **parts)
    seen.mouse_y_sign = client
    assert missed('turn', seen) == misses


@pytest.mark.parametrize('way, seconds, words', [
    (3.1, 8.0, 'after 8 s, more than 3 m from its start'), (1.0, 50.0, 'after 50 s, the limit')])
def test_a_drive_without_an_end_says_which_limit_ended_it(way, seconds, words):
    facts = drive(rested=False)['facts']
    seen = observation('move2goal', stimuli=[stimulus('first drive', 0.0, seconds, facts=facts)],
                       truth=[[0.0, 0.0, 0.0, 0.0], [seconds, way, 0.0, 0.0]])
    for name in ('goal_place', 'goal_heading'):
        assert words in missed_of('move2goal', name, seen)


def test_what_a_node_does_not_offer_is_not_offered():
    seen = observed('turn', **{'mouse not active': scene()})
    seen.not_offered['mouse up'] = 'it does not listen to mouse_info'
    judged = {v.criterion.name: v.outcome for v in verdicts('turn', seen, parts=['mouse'])}
    assert judged['mouse_drives'] is Outcome.NOT_OFFERED
    assert set(judged) == {'mouse_drives', 'mouse_dead_zone', 'mouse_off'}


#: Exceptions that rospy raises if a callback publishes while the node ends.
CLOSED = extended('rospy.exceptions.ROSException: publish() to a closed topic') + extended(
    'ValueError: I/O operation on closed file.\n\nDuring handling of the above exception, another '
    'exception occurred:\n') + extended('rospy.exceptions.ROSException: topic was closed during publish()')


@pytest.mark.parametrize('end, words', [
    (ctrl_c(printed='bye\n', signal=2), ''), (ctrl_c(signal=15), ''), (ctrl_c(printed=CLOSED), ''),
    (ctrl_c(took=None), 'still running'), (ctrl_c(signal=9), 'signal 9'),
    (ctrl_c(printed=extended('KeyError: 3')), 'KeyError: 3'),
    (ctrl_c(printed=CLOSED + extended('KeyError: 3')), 'KeyError: 3'),
    (ctrl_c(printed='[ERROR] [17.2]: ' + extended('cut off here')), 'traceback')])
def test_a_clean_exit(end, words):
    """`end` is seen at the first Ctrl+C, or at the second."""
    first, again = {'Ctrl+C': end, 'Ctrl+C again': ctrl_c()}, {'Ctrl+C': ctrl_c(), 'Ctrl+C again': end}
    for parts, number in (first, 1), (again, 2):
        verdict = next(each for each in verdicts('turn', observed('turn', **parts))
                       if each.criterion.name == 'clean_exit')
        assert words in verdict.reason and bool(verdict.reason) is bool(words)
        assert not words or verdict.moment == SLOT * number


@pytest.mark.parametrize('name, printed, said', [
    ('l', extended('KeyError: 3'), "during \"l\": 'KeyError: 3'"), ('l', CLOSED, ''),
    ('l', 'ValueError: that was no number', ''), ('Ctrl+C', extended('KeyError: 3'), '')])
def test_a_traceback_before_the_end_is_told(name, printed, said):
    told = remarks_on(observation(stimuli=[stimulus(name, printed=printed)]))
    assert len(told) == bool(said) and said in ''.join(told)


@pytest.mark.parametrize('first, second, met', [
    (ctrl_c((0.1, 0.0, 1.5)), ctrl_c((0.1, 0.0, 1.5)), False),
    (ctrl_c((0.1, 0.0, 1.5)), ctrl_c((0.1, 0.0, 0.0)), True),
    # a command of another thread follows the zero
    (ctrl_c((0.2, 0.0, 0.0), (0.25, 0.0, 1.5)), ctrl_c((0.1, 0.0, 1.5)), True)])
def test_one_zero_at_ctrl_c_is_enough(first, second, met):
    seen = observed('turn', **{'Ctrl+C': first, 'Ctrl+C again': second})
    assert (missed_of('turn', 'stops_robot', seen) == '') is met


@pytest.mark.parametrize('message, fields, taken', [
    # the message of the handout
    ('std_msgs/Header header, std_msgs/Bool status, float32 xPos, float32 yPos', 'status xPos yPos', ''),
    # the flag has another name; a text comes before it, and another number after it
    ('string name, bool activestatus, float32 zPos, float64 xPos, float64 yPos', 'activestatus xPos yPos', 'status'),
    # x and y in another order are matched by their names
    ('float32 y, float32 x, bool ok, bool status', 'status x y', 'xPos yPos'),
    ('float32 y_pos, float32 x_pos, bool flag', 'flag x_pos y_pos', 'status xPos yPos'),
    # no field has a usual name
    ('std_msgs/Float32 a, float32 b, float32 n, std_msgs/Bool c', 'c a b', 'status xPos yPos')])
def test_fields_are_matched_by_name_else_by_type_and_position(message, fields, taken):
    own = dict(zip(('status', 'xPos', 'yPos'), fields.split()))
    assert mouse_fields(fields_of(message)) == (fields.split(), [
        'Your {} was taken for {}.'.format(own[name], name) for name in taken.split()])


def fields_of(message):
    """Returns [(name, type)] for the fields of a message."""
    return [tuple(reversed(field.split())) for field in message.split(', ') if field]


@pytest.mark.parametrize('message', [
    'float32 xPos, float32 yPos', 'bool status, float32 xPos', 'bool status, int32 xPos, int32 yPos', ''])
def test_a_message_without_a_flag_or_two_numbers_holds_no_mouse(message):
    with pytest.raises(ValueError, match='its message has no flag and two numbers, but'):
        mouse_fields(fields_of(message))


# ----- what was seen in place of a movement -----

@pytest.mark.parametrize('printed, publishes, commands, odd, words', [
    (CRASH, {'/cmd_vel': 'geometry_msgs/Twist'}, [], [],
     'an exception had stopped it, "NameError: name \'x\' is not defined (line 7, in f)"'),
    ('', {'/cmd_vel': 'geometry_msgs/TwistStamped'}, [], [], 'as geometry_msgs/TwistStamped'),
    ('', {'/cmd_vel_mux': 'geometry_msgs/Twist'}, [], [], 'not publish cmd_vel, but /cmd_vel_mux'),
    ('', {'/cmd_vel': 'geometry_msgs/Twist'}, [], [], 'nothing came on cmd_vel, and it printed nothing'),
    ('Input?', {'/cmd_vel': 'geometry_msgs/Twist'}, [[t, 0.0, 0.0] for t in (1.0, 5.0, 9.0)], [],
     "nothing came on cmd_vel, and it printed 'Input?'"),
    ('', {}, [[11.0, 0.0, 0.0]], [], 'did not turn: only zeros came on cmd_vel'),
    ('', {}, [], [[11.0, 'nan m/s and 0 rad/s']] * 3, '3 of its commands were not finite numbers, such as nan')])
def test_a_robot_that_did_not_turn_is_explained(printed, publishes, commands, odd, words):
    seen = observed('turn', l=turn(0.0, moved=False, printed=printed))
    seen.processes[0].published_topics, seen.processes[0].printed = publishes, printed
    seen.recording, seen.not_finite = recording(commands), odd
    assert 'the robot did not turn: ' in missed_of('turn', 'left', seen)
    assert words in missed_of('turn', 'left', seen)


def test_a_speed_that_no_wheel_follows_is_told():
    at, zero = np.arange(10.0, 18.0), np.zeros(8)
    seen = observed('gamepad', **{stimuli.LEFT_STICK_UP: scene(*((t, 0.0, 0.0) for t in np.arange(8.0)))})
    assert missed_of('gamepad', 'drives', seen) == \
        'with the left stick up nothing was commanded: only zeros came on cmd_vel'
    seen.recording = made(commands=replace(speeds_sent(at, at, zero, zero), sideways=zero + 0.22))
    assert missed_of('gamepad', 'drives', seen) == 'with the left stick up neither linear.x nor angular.z ' \
        'was commanded: linear.y was 0.22 in its commands on cmd_vel'


def test_nothing_is_said_that_the_truth_contradicts():
    seen = observed('turn', l=turn(424.0, moved=False))
    seen.recording = replace(seen.recording, commands=Commands.none())
    seen.not_finite = [[11.0, 'nan m/s and 1.5 rad/s']]
    seen.omitted_counts = {'commands that are not finite numbers': 1}
    assert 'after l it turned 424.0 degrees to the left: 1 of its commands' in missed_of('turn', 'left', seen)
    assert remarks_on(seen) == [
        '1 commands that are not finite numbers came on cmd_vel: they are not recorded, and not judged.']


@pytest.mark.parametrize('line, told', [
    ("AttributeError: module 'numpy' has no attribute 'float'.", True),
    ("ImportError: cannot import name 'quat2euler' from 'squaternion' (/usr/x.py)", True),
    ("AttributeError: 'Thread' object has no attribute 'isAlive'", True),
    ("ModuleNotFoundError: No module named 'beside'", True),
    ("AttributeError: 'Controller' object has no attribute 'x'", False), ('[INFO] AttributeError', False)])
def test_an_error_that_another_machine_may_not_have_is_told_to_the_instructor(line, told):
    seen = observation()
    seen.processes[0].printed = 'Traceback:\n  x\n{}\n'.format(line)
    assert [line in said for said in version_errors(seen)] == [True] * told
