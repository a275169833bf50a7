"""Runs of right nodes in which a person does what the sheets ask for, and more: nobody may be accused.
"""
import random
from dataclasses import replace
from typing import Tuple

import yaml

from mutants import DRIVE, PAD, TURN, edited, right_node, scene_of
from pages import ROOT
from student_runs import NEVER, Scene, Step, pad_scene
from tb3_labs.geometry.se2 import Pose2, TypedPose
from tb3_labs.report.motion.movements import LAB_GOAL

PADS = [yaml.safe_load(path.read_text())
        for path in sorted((ROOT / 'launch' / 'params').glob('pad_*.yaml'))]
#: The other goals of the sheets.
GOALS = (-1.5, 1.5, 0.0), (-3.0, 3.0, 0.0), (1.0, 1.0, 90.0)
FALSE, DECLARE = Step('control', False, 0.5, 2.0), Step('declare', (0.0, 0.0, 0.0), NEVER, 1.0)


def pushed(linear=0.0, angular=0.5, seconds=3.0):
    """rostopic pub -r, with timeout or Ctrl+C: no zero follows."""
    return [Step('drive', (linear, angular), NEVER, seconds), Step('drive', None, NEVER, 2.0)]


#: A mouse that trembles at the edge of its dead zone, drives, and is not active any more.
MOUSE = [Step('mouse', (0.24 + 0.02 * (number % 2), 0.1), NEVER, 0.04) for number in range(80)] + [
    Step('mouse', (-1.0, 0.5), NEVER, 3.0), Step('mouse', None, 1.0, 3.0)]
#: Actions before each letter, or before each grant; actions instead of it.
BEFORE = {'mouse': MOUSE, 'pushed': pushed(), 'section 6': [FALSE, *pushed(seconds=4.0), DECLARE],
          'reset of the robot': [Step('reset', None, NEVER, 4.0)],
          'silent': [Step('set', {'imu_silent': True, 'odom_silent': True}, NEVER, 0.1)]}
INSTEAD = {'mystery': pushed(0.1, 0.0, 20.0) + pushed(0.0, 1.0, 20.0),
           'arcs': 3 * [*pushed(0.1, 0.3), DECLARE]}
#: {lab: all kinds of its runs}.
RIGHT = {
    TURN: ('', 'tolerance of 2', 'ended', 'mystery', 'mouse', 'pushed', 'reset of the robot',
           'silent'),
    DRIVE: ('', 'another goal', 'ended', 'arcs', 'late', 'section 6', 'reset of the robot',
            'silent'),
    PAD: ('', 'no move_to_goal', 'taps', 'taps alone', 'control by hand')}


def right_run(lab: str, kind: str, source: random.Random) -> Tuple[str, Scene, Pose2]:
    """The text of a node, its scene, and the goal that the report is told."""
    made = right_node(lab, source)
    node, scene, goal = made.text, scene_of(made, source), LAB_GOAL
    if lab == PAD:
        return (*_of_a_pad(node, kind, source), goal)
    steps = [each for step in scene.steps for each in (BEFORE.get(kind, []) if step.what in (
        'type', 'control') and step.value is not False else []) + [step]]
    if kind in INSTEAD:
        steps, node = steps[:1] + INSTEAD[kind], '' if kind == 'mystery' else node
    elif kind == 'mouse':
        scene = replace(scene, devices=('mouse_info',))
    elif kind == 'tolerance of 2':
        node = right_node(lab, random.Random(2)).text.replace('HDG_TOL = 10', 'HDG_TOL = 2')
    elif kind == 'another goal':
        goal = TypedPose(*source.choice(GOALS)).pose
        node = edited(node, [('goal_x = -0.61', 'goal_x = {}'.format(goal.x)),
                             ('goal_y = 0.61', 'goal_y = {}'.format(goal.y)),
                             ('goal_yaw = 0.0', 'goal_yaw = {}'.format(goal.yaw))])
    elif kind == 'late':    # the node is started when the robot was driven elsewhere
        steps[:0] = by_hand = pushed() + pushed(0.1, source.uniform(-0.2, 0.2))
        scene = replace(scene, late=0.5 + sum(step.patience for step in by_hand))
    elif kind == 'ended':   # by Ctrl+C in a movement; the recording goes on
        steps[-1] = steps[-1]._replace(pause=NEVER, patience=source.uniform(0.4, 3.0))
        scene = replace(scene, after=6.0)
    return node, replace(scene, steps=tuple(steps)), goal


def _of_a_pad(node, kind, source):
    """A node and a scene with the numbers of any pad, and X beside them."""
    pad = source.choice(PADS)
    a, b, y = numbers = [pad[name + '_button'] for name in ('relinquish', 'regain', 'reset')]
    node = edited(node, [('buttons[0]', 'buttons[A]'), ('buttons[1]', 'buttons[B]'),
                         ('buttons[2]', 'buttons[%d]' % y), ('[A]', '[%d]' % a), ('[B]', '[%d]' % b),
                         ('axes[3]', 'axes[%d]' % pad['angular_axis'])])
    scene = pad_scene(source, (a, b, y, min(set(range(4)) - set(numbers))))
    first, taps = scene.steps[:4], 16 * [Step('joy', ((), 0.4, source.choice((0.0, 0.6))), NEVER, 0.2),
                                         Step('joy', ((), 0.0, 0.0), NEVER, 0.2)]
    steps = {'taps': [*scene.steps, *taps], 'taps alone': [*first[:2], *taps], 'control by hand': [
        *first, Step('wait', None, NEVER, 1.0), Step('control', True, NEVER, 20.0)]}
    return node, replace(scene, steps=tuple(steps.get(kind, scene.steps)),
                         other='' if kind == 'no move_to_goal' else scene.other)
