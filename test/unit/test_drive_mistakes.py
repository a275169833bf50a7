"""The first mistake of a node of the Transformation lab. The node is the plain node with changes."""
import re
from dataclasses import replace

import numpy as np
import pytest

from simulated_student_node import played
from tb3_labs.marking.labs.criteria import Outcome, Verdict
from tb3_labs.marking.labs.move2goal import CRITERIA
from tb3_labs.marking.marks import _find_first_mistake
from tb3_labs.marking.trial.from_bag import with_stimuli
from tb3_labs.marking.trial.observation import NodeProcess, Observation, Stimulus
from tb3_labs.recording.run_data import Numbers
from tb3_labs.watch.drive_mistakes import find_late_commands, find_unreset_state
from tb3_labs.watch.drive_pose import place_quantities
from tb3_labs.watch.drive_states import NodeFrame, StateInterval
from tb3_labs.watch.lab_mistakes import CHECKS
from tb3_labs.watch.mistake import NodeRun, find_first_mistake

X, Y = 'self.local_x = cos * dx + sin * dy', 'self.local_y = -sin * dx + cos * dy'
#: Wrong nodes: (the changes, texts in the sentence, the variable)
WRONG = {
    'place of the reset before': (
        [('        self.initial_global_x = None\n        self.initial_global_y = None\n'
          '        self.initial_global_yaw = None\n        self.state',
          '        self.initial_global_yaw = None\n        self.state')],
        r'after the reset at \d+ s initial_global_x stayed 0; .* when this was -0\.4\d+',
        'initial_global_x'),
    'yaw of the reset before': (
        [('        self.initial_global_yaw = None\n        self.state', '        self.state')],
        r'initial_global_yaw stayed 0\.3; .* when this was 2\.\d+', 'initial_global_yaw'),
    'theta not kept': (
        [('        dx = global_x -', '        self.initial_odom_yaw = Quaternion(q.w, q.x, q.y, q.z)'
          '.to_euler()[2]\n        dx = global_x -')],
        r'local_x followed the displacement since the reset, rotated by minus the present yaw[;,]', 'local_x'),
    'not rotated': ([(X, 'self.local_x = dx'), (Y, 'self.local_y = dy')],
                    r'local_x followed the displacement since the reset, not rotated[;,]',
                    'local_x'),
    'no inverse': ([(X, X.replace('+', '-')), (Y, Y.replace('-sin', 'sin'))],
                   r'followed the displacement since the reset, rotated by plus the yaw at the reset[;,]',
                   'local_x'),
    'not displaced': ([('dx = global_x - self.initial_global_x', 'dx = global_x'),
                       ('dy = global_y - self.initial_global_y', 'dy = global_y')],
                      r'the place in the odometry, not displaced, rotated', 'local_x'),
    'sign of the yaw': ([('(global_yaw - self.initial_global_yaw)',
                          '(self.initial_global_yaw - global_yaw)')],
                        r'local_yaw followed the yaw, mirrored since the reset[;,]', 'local_yaw'),
    'degrees': ([('self.normalize_angle(global_yaw', 'self.normalize_angle(math.degrees(global_yaw)')],
                r'local_yaw followed the yaw in degrees', 'local_yaw'),
    'order': ([('global_yaw = Quaternion(q.w, q.x, q.y, q.z)', 'global_yaw = Quaternion(q.x, q.y, q.z, q.w)')],
              r'initial_global_yaw followed the yaw .of the quaternion read in the order x, y, z, w',
              'initial_global_yaw'),
    'control': ([('self.has_control = relinq_msg.data', 'self.has_control = not relinq_msg.data')],
                r'after a True on ctrl_relinq has_control was False', 'has_control'),
    'control of another name': (
        [('self.has_control', 'self.allowed'), ('= relinq_msg.data', '= not relinq_msg.data')],
        r'after a False on ctrl_relinq \d+ commands moved the robot, and after a True none', ''),
    'control not read': ([('not self.has_control or ', '')],
                         r'ctrl_relinq became False, and \d+ commands came later', ''),
    'no zero': ([('            self.cmd_pub.publish(Twist())\n', '            pass\n')],
                r'ctrl_relinq became False, and the last command was linear.x 0.00, angular.z 0.29', ''),
    'state kept': ([("        self.state = 'ROTATE_TO_GOAL'\n        rospy", '        rospy')],
                   r'after the reset at \d+ s state stayed GOAL_REACHED; it should be ROTATE_TO_GOAL', 'state'),
    'goal': ([('self.goal_x = -0.61', 'self.goal_x = 0.61')], r'goal_x is 0.61; it should be -0.61', 'goal_x'),
    'atan2': ([('atan2(dy, dx)', 'atan2(dx, dy)')],
              r'in ROTATE_TO_GOAL angular.z was 0.3 x \(atan2\(dx, dy\) - local_yaw\); .* 0.3 x \(atan2\(dy, dx\)',
              'angular.z'),
    'not normalized': ([('return math.atan2(math.sin(angle), math.cos(angle))', 'return angle')],
                       r'- local_yaw, not normalized\);', 'angular.z'),
    'odometry by the IMU': ([('self.initial_odom_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]',
                              'self.initial_odom_yaw = self.initial_global_yaw')],
                            r'initial_odom_yaw followed the yaw of the IMU at the reset', 'initial_odom_yaw'),
    'other field': ([('cmd.angular.z = 0.3', 'cmd.angular.x = 0.3')],
                    r'in ROTATE_TO_GOAL angular.z was \+0.00 for an error of \+2.36 rad', 'angular.z'),
    'too fast': ([('cmd.linear.x = 0.15', 'cmd.linear.x = 0.5')], r'linear.x was 0.50, by the handout it is 0.15',
                 'linear.x'),
    'misspelt': ([("= 'MOVE_FORWARD'\n", "= 'MOVE_FOWARD'\n")], r'state became MOVE_FOWARD, which is none of',
                 'state'),
    'tolerance': ([('distance > 0.15', 'distance > 0.5')],
                  r'from MOVE_FORWARD to ROTATE_TO_FINAL at a distance of 0.(49|50) m; 0.15 is the tolerance',
                  'state'),
    'never arrives': ([('if distance > 0.15:', 'if True:')],
                      r'state stayed MOVE_FORWARD at a distance of 0.1', 'state'),
    'skipped': ([("self.state = 'ROTATE_TO_FINAL'\n", "self.state = 'GOAL_REACHED'\n")],
                r'from MOVE_FORWARD to GOAL_REACHED at a heading error of 2.\d+ rad', 'state'),
    'not silent': ([(" or self.state == 'GOAL_REACHED'", '')],
                   r'state became GOAL_REACHED, and \d+ commands came later', ''),
    'no zero at the goal': ([("'Goal reached!')\n", "'Goal reached!')\n                return\n")],
                            r'state became GOAL_REACHED, and the last command was .*: no zero followed', ''),
    'seldom': ([('Duration(0.1)', 'Duration(1.0)')], r'commands came every 1.0 s', '')}


def mistake_of(run):
    return find_first_mistake(NodeRun(run), CHECKS['move2goal'])


@pytest.mark.parametrize('name', WRONG)
def test_a_wrong_node_is_named_by_its_first_mistake(name):
    changes, words, variable = WRONG[name]
    found = mistake_of(played(*changes))
    assert re.search(words, found.message), found
    assert found.variable == variable


@pytest.mark.parametrize('law, words', [
    ('self.goal_yaw - self.local_yaw', r'angular.z was 0.5 x \(goal_yaw in degrees - local_yaw\); by the handout'),
    ('math.radians(self.goal_yaw) - self.local_yaw', '')])
def test_a_goal_in_degrees_is_a_mistake_if_the_law_does_not_convert_it(law, words):
    run = played(('self.goal_yaw = 0.0', 'self.goal_yaw = 90.0'), ('self.goal_yaw - self.local_yaw', law))
    found = mistake_of(replace(run, goals=replace(run.goals, yaw=np.array([np.pi / 2.0]))))
    assert bool(words) == bool(found) and re.search(words, found.message if found else '')


OTHER_REFERENCES = ('self.initial_global_', 'self.first_'), ('self.initial_odom_yaw', 'self.first_theta')
FAR_AWAY = {'pose': (4.8, -0.3, 2.0), 'offset': -1.2}


@pytest.mark.parametrize('robot', [{'offset': 0.0}, FAR_AWAY, {'pose': (1.0, 2.0, -3.1), 'offset': 2.5}])
def test_a_right_node_is_not_accused(robot):
    assert mistake_of(played(**robot)) is None


@pytest.mark.parametrize('starts', [(0.0,), ()])
def test_a_right_node_that_is_read_late_is_not_accused(starts):
    run = played()
    assert mistake_of(replace(run, starts=starts, variables=run.variables.between(9.0, 99.0))) is None


def test_another_gain_is_no_mistake():
    run = played(('cmd.linear.x = 0.15', 'cmd.linear.x = 0.1'), ('0.3 * yaw_error', '0.6 * yaw_error'))
    assert mistake_of(run) is None


@pytest.mark.parametrize('changes', [
    [('self.local_', 'self.own_')],
    [('self.state', 'self.phase'), ('self.has_control', 'self.may')],
    OTHER_REFERENCES])
def test_a_node_with_other_names_is_not_accused(changes):
    assert mistake_of(played(*changes)) is None


def changed(run, name, text_at, begin=-np.inf, end=np.inf):
    """The run with other texts of a variable from `begin` to `end`: ``text_at(time)``."""
    rows = run.variables
    chosen = (rows.name == name) & (rows.arrival >= begin) & (rows.arrival < end)
    texts = rows.value.copy()
    texts[chosen] = [text_at(time) for time in rows.arrival[chosen]]
    return replace(run, variables=replace(rows, value=texts))


@pytest.mark.parametrize('seconds, is_kept', [(0.0, True), (0.15, False)])
def test_a_state_that_a_reset_sets_back_for_a_moment_was_not_kept(seconds, is_kept):
    """A node with another mistake may find nothing to rotate, and drive forward at once."""
    run = played(*WRONG['state kept'][0])
    reset = run.resets.arrival[-1]
    run = changed(run, 'state', lambda time: 'ROTATE_TO_GOAL', reset, reset + seconds)
    run = replace(run, resets=run.resets.take(slice(-1, None)))
    assert any(find_unreset_state(NodeRun(run))) is is_kept


@pytest.mark.parametrize('is_over, words', [(True, ''), (False, 'ctrl_relinq became False, and the last command was')])
def test_a_node_that_has_ended_need_not_stop_when_control_is_taken(is_over, words):
    """Both recordings end in the first rotation, 0.5 s after the last reading of a node that has ended."""
    run = played()
    end = next(at for at, angular in zip(run.commands.arrival, run.commands.angular) if angular) + 1.0
    cut = replace(run, commands=run.commands.between(0.0, end), control=Numbers(
        *(np.append(column, number) for column, number in (
            (run.control.time, end + 0.1), (run.control.arrival, end + 0.1), (run.control.value, 0.0)))))
    late = run.variables.arrival > (end - 0.4 if is_over else end + 0.3)
    found = mistake_of(replace(cut, variables=run.variables.take(~late)))
    assert (found.message if found else '').startswith(words) and bool(found) is bool(words)


def test_commands_of_another_node_are_left_out():
    """Between the node's commands another node sends commands, as a gamepad that does not hand over."""
    run = played()
    sent, node = run.commands, str(run.variables.node[0])
    others = replace(sent, arrival=sent.arrival + 0.05, angular=1.0 - sent.angular)
    both = type(sent).joined([sent, others])
    order = np.argsort(both.arrival)
    mixed = replace(run, commands=both.take(order))
    assert mistake_of(mixed) is not None
    sender = np.where(order < len(sent), node, '/gamepad')
    known = replace(mixed, commands=replace(mixed.commands, sender=sender))
    assert find_first_mistake(NodeRun(known, node), CHECKS['move2goal']) is None


def test_a_node_that_sent_nothing_did_not_send_the_commands_of_another_node():
    """Only a gamepad drives: the node had no control."""
    run = played()
    node = str(run.variables.node[0])
    sent = replace(run.commands, sender=np.full(len(run.commands), '/gamepad'))
    taken = replace(run, commands=sent, control=Numbers(*np.array([[0.5], [0.5], [0.0]])))
    assert any(find_late_commands(NodeRun(taken)))
    assert not any(find_late_commands(NodeRun(taken, node)))


@pytest.mark.parametrize('changes, robot', [((), {}), (OTHER_REFERENCES, FAR_AWAY)])
def test_a_reset_that_is_not_in_the_log_begins_a_frame_that_is_not_known(changes, robot):
    run = played(*changes, **robot)
    run = replace(run, starts=(), variables=run.variables.between(0.5, 999.0))
    assert len(run.resets) and mistake_of(replace(run, resets=run.resets.take(slice(0, 0)))) is None


@pytest.mark.parametrize('starts', [(0.0,), ()])
def test_a_node_that_waits_for_the_odometry_after_a_reset_is_not_accused(starts):
    """The odometry is silent from 0.3 s before a reset on: the node gives no command."""
    run = played()
    at = float(run.resets.arrival[0])
    for name in ('local_x', 'local_y'):
        run = changed(run, name, lambda time: '0.0', at)
    end = at + 2.9
    assert mistake_of(replace(
        run, starts=starts, duration=at + 3.0, odometry=run.odometry.between(0.0, at - 0.3),
        commands=run.commands.between(0.0, at), **{part: getattr(run, part).between(0.0, end) for part in (
            'imu', 'resets', 'control', 'variables')})) is None


def test_a_node_that_was_not_there_has_not_heard_that_it_has_control():
    """The node is started after a True, and waits for another True."""
    run = played()
    end = float(run.control.arrival[run.control.value == 1.0][0]) - 0.1
    early = replace(run, starts=(), commands=run.commands.between(0.0, end), control=Numbers(
        *np.array([[0.001], [0.001], [1.0]])), variables=run.variables.between(0.01, end), duration=end)
    assert end > 1.0 and mistake_of(early) is None
    silent = replace(early, control=Numbers.none())      # nobody has published on ctrl_relinq
    assert mistake_of(silent) is None


@pytest.mark.parametrize('changes', [
    [('self.goal_x = -0.61', 'self.target_x = 0.5'), ('self.goal_x', 'self.target_x')],
    [('self.goal_yaw = 0.0', 'self.goal_yaw = 90.0'), ('(self.goal_yaw', '(math.radians(self.goal_yaw)')]])
def test_a_goal_of_another_name_or_in_degrees_is_no_mistake(changes):
    assert mistake_of(replace(played(*changes), starts=(), goals=played().goals.take(slice(0, 0)))) is None


@pytest.mark.parametrize('seconds, accused', [(0.1, False), (2.0, True)])
def test_a_reset_soon_after_the_goal_begins_the_next_drive(seconds, accused, monkeypatch):
    """The commands of a rotation come right after a GOAL_REACHED of these seconds."""
    run = played()
    at = float(run.commands.arrival[run.commands.angular != 0.0][5])
    node_run = NodeRun(replace(run, control=Numbers.none()))
    intervals = [StateInterval('GOAL_REACHED', at, at + seconds, '', None, None)]
    monkeypatch.setattr('tb3_labs.watch.drive_mistakes.state_intervals', lambda node_run: intervals)
    assert any(find_late_commands(node_run)) is accused


def test_one_more_state_that_the_node_leaves_by_itself_is_no_mistake():
    more = [("if self.state == 'ROTATE_TO_GOAL':", "if self.state == 'AIMED':\n            self.ticks += 1\n"
             "            self.state = 'MOVE_FORWARD' if self.ticks % 15 == 0 else 'AIMED'\n"
             "        elif self.state == 'ROTATE_TO_GOAL':"),
            ("self.state = 'MOVE_FORWARD'\n        elif", "self.state = 'AIMED'\n        elif"),
            ('self.has_control = False', 'self.has_control = False\n        self.ticks = 0')]
    run = played(*more)
    assert 'AIMED' in run.variables.value and mistake_of(run) is None


#: The frame of all samples of a run.
WHOLE = NodeFrame(-np.inf, position=0j, odometry_yaw=0.0, imu_yaw=0.0)


def following(run, name, quantity, axis, delay=0.0):
    """The run with a variable that is the place of a quantity along this axis."""
    value = axis(quantity.value)
    return changed(run, name, lambda time: repr(float(value[max(np.searchsorted(quantity.time, time - delay) - 1, 0)])))


def test_a_place_that_comes_late():
    run = played()
    right = next(place_quantities(run.odometry, WHOLE))
    assert 'local_x came up to 2.0 s late' in mistake_of(following(run, 'local_x', right, np.real, 2.0)).message


def test_a_trial_has_its_resets_by_its_calls_and_after_one_that_failed_the_frame_is_unknown():
    run = played()
    first = run.resets.take(slice(0, 1))
    seen = Observation(
        'move2goal', 'lab7_tf/move2goal_tf.py', run, processes=[NodeProcess(0.0), NodeProcess(70.0)],
        stimuli=[Stimulus('second drive', 61.0, 65.0)], reset_calls=[
            [first.arrival[0] + 0.05, [0.0, 0.0, 0.0], ''], [50.0, [0.2, 0.3, 1.0], ''],
            [60.0, [0.0, 0.0, 0.0], 'it was refused']])
    shown = with_stimuli(replace(run, resets=first), seen)
    assert shown.resets.arrival.tolist() == [first.arrival[0], 50.0]
    assert (shown.resets.x.tolist(), shown.resets.y.tolist()) == ([0.0, 0.2], [0.0, 0.3])
    assert len(shown.control) == len(run.control)
    assert not len(shown.variables.between(60.0, 70.0)) and len(shown.variables.between(70.0, 71.0))


@pytest.mark.parametrize('parts, is_told', [
    ([], True), ([('drive', 0.0)], True), ([('offset', 0.0)], False), ([('drive', 0.0), ('offset', 900.0)], True),
    ([('offset', 0.0), ('drive', 900.0)], False), ([('offset', 0.0), ('drive', 1.0)], True)])
def test_only_parts_that_lost_points_are_searched_for_the_mistake(parts, is_told):
    changes, words, _ = WRONG['never arrives']
    verdicts = [Verdict(criterion, Outcome.MISSED, 'so', 1.0) for criterion in CRITERIA if not criterion.is_extra]
    found = _find_first_mistake(Observation('move2goal', 'lab7_tf/a.py', played(*changes), parts), verdicts)
    assert bool(found and re.search(words, found.message)) is is_told
