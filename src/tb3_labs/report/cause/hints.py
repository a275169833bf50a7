"""The hints to a known mistake, one after another; the last one is the mistake with its evidence.

Each hint is folded, and the next one lies within it. So a teacher can hand out the page of a run,
and the student still has to find the mistake.
"""
import math
from html import escape
from typing import List, NamedTuple, Optional

from tb3_labs.report.cause.diagnosis import DRIVE, PAD, TURN, Diagnosis
from tb3_labs.report.run_data import RunData


class Hint(NamedTuple):
    """A mistake in words: a node that `does` it; `look`: what to look at; the heading and the step
    of the sheet; the TODO of the skeleton."""

    does: str
    look: str
    heading: str
    step: int
    todo: str


IMU_LAB, TRANSFORMATION_LAB = 'IMU lab', 'Transformation lab'
SHEETS = {TURN: IMU_LAB, DRIVE: TRANSFORMATION_LAB, PAD: TRANSFORMATION_LAB}
TURNS_STEP, POSE, STATES_STEP, RESET_STEP, THUMB_STEP = (
    '3. Lab: turn 90 and 180 degrees', '1. The local pose', '2. The four states', '3. The reset',
    '4. By thumb')
PUSH = 'Drive the robot forward by hand after a reset in another direction, and print local_x ' \
    'and local_y. Which of them shall grow?'
AFTER_RESET = 'Print local_x, local_y and local_yaw a second after a reset, at rest. Which three ' \
    'numbers do you expect?'
PRINT_YAW = 'Print the yaw that your node has, and turn the robot once around by hand. Over ' \
    'which range shall the number run, and which way?'
HEARD = 'rosnode info NODE: does it listen to imu, and who publishes that topic? '
LAST_MESSAGE = 'rostopic echo /cmd_vel: which message shall be the last one of a movement?'
#: The hints, by lab and mistake.
HINTS = {
    (TURN, 'error_not_wrapped'): Hint(
        'does not wrap the error', 'The goal is 80, the heading 350. What is the error, and which '
        'way is the shorter one?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'error_not_wrapped_low'): Hint(
        'does not wrap an error below -180', 'What does your node do with an error of 270? And '
        'with -270?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'error_not_wrapped_high'): Hint(
        'does not wrap an error above 180', 'What does your node do with an error of -270? And '
        'with 270?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'nothing_wrapped'): Hint(
        'wraps neither the goal nor the error', 'The heading is 350. Which goal has l, and does '
        'the heading ever come near it?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'goal_not_wrapped_low'): Hint(
        'does not wrap a goal below 0', 'The heading is 40. Which goal has r, and does the heading '
        'ever come near it?', TURNS_STEP, 6, 'TODO 7'),
    (TURN, 'goal_not_wrapped_high'): Hint(
        'does not wrap a goal above 360', 'The heading is 330. Which goal has l, and does the '
        'heading ever come near it?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'no_negative_clamp'): Hint(
        'limits positive commands only', 'An error of -90 gives a command of -9. What do both '
        'limits make of it?', TURNS_STEP, 6, 'TODO 7'),
    (TURN, 'heading_kept'): Hint(
        'turns by a heading that hardly changes', HEARD + PRINT_YAW, TURNS_STEP, 4,
        'the subscriber, and TODO 6'),
    (TURN, 'swapped'): Hint(
        'turns right for l, and left for r', 'The heading is 100. Which goal has l, if the heading '
        'grows to the left?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'quaternion_order'): Hint(
        'reads the numbers of the quaternion in another order', PRINT_YAW, TURNS_STEP, 4, 'TODO 6'),
    (TURN, 'radians'): Hint('mixes radians and degrees', PRINT_YAW, TURNS_STEP, 4, 'TODO 6'),
    (TURN, 'no_stop'): Hint('sends no zero at the end', LAST_MESSAGE, TURNS_STEP, 5, 'TODO 7'),
    (DRIVE, 'inverse_missing'): Hint(
        'rotates the displacement by R in place of its inverse', PUSH, POSE, 3, 'TODO 4'),
    (DRIVE, 'not_rotated'): Hint('does not rotate the displacement', PUSH, POSE, 3, 'TODO 4'),
    (DRIVE, 'imu_rotates'): Hint(
        "rotates the displacement by the IMU's yaw", 'Compare the yaws of /imu and of /odom, while '
        'the robot stands. In which of the two frames was the displacement measured?', POSE, 4,
        'TODO 4'),
    (DRIVE, 'reference_kept'): Hint(
        'keeps its references at a reset', AFTER_RESET, RESET_STEP, 2, 'set_pose_callback'),
    (DRIVE, 'yaw_kept'): Hint(
        'keeps the reference of the yaw at a reset', AFTER_RESET, RESET_STEP, 2,
        'set_pose_callback, TODO 2 and 4'),
    (DRIVE, 'place_kept'): Hint(
        'keeps the reference of the place at a reset', AFTER_RESET, RESET_STEP, 2,
        'set_pose_callback and TODO 3'),
    (DRIVE, 'declared_lost'): Hint(
        'forgets the pose that a reset declares', 'Reset to x: 0.2, y: 0.3. Which numbers does '
        'your node have a second later?', 'Beyond the handout', 0, 'TODO 2 and 4, as an extra'),
    (DRIVE, 'no_local_frame'): Hint(
        'drives by odom in place of local, in one line or in all', 'Which variables does '
        'control_loop read in each line, and in which frame is the goal?', STATES_STEP, 0,
        'TODO 5'),
    (DRIVE, 'error_not_wrapped'): Hint(
        'does not wrap the angle', 'The goal is at 170 degrees, the heading is -170. What is the '
        'error, and which way is the shorter one?', STATES_STEP, 0, 'TODO 2 and 5'),
    (DRIVE, 'quaternion_order'): Hint(
        'reads the numbers of a quaternion in another order', PRINT_YAW, POSE, 2, 'TODO 2'),
    (DRIVE, 'heading_kept'): Hint(
        'turns by a heading that hardly changes', HEARD + PRINT_YAW, POSE, 2,
        'the subscriber, and TODO 2'),
    (DRIVE, 'degrees'): Hint(
        'mixes degrees and radians', PRINT_YAW, POSE, 2, 'the callbacks, and TODO 2'),
    (DRIVE, 'no_stop'): Hint(
        'sends no zero at the end', LAST_MESSAGE, STATES_STEP, 1, 'control_loop'),
    (PAD, 'two_senders'): Hint(
        'goes on sending while another node has control', 'rostopic echo /cmd_vel after A: do '
        'zeros come between the commands?', THUMB_STEP, 1, 'has_control'),
}
SECTION = '''<section id="hints"><h2>What went wrong</h2>
{}</section>'''
FOLDED = '<details{}><summary>{}</summary>\n<p>{}</p>\n{}</details>\n'
NONE_FITS = '<p>Some movements differ from those of the handout. No known mistake explains them: was ' \
    'the node ended in one of them, or started anew?</p>\n'


def section(found: Diagnosis, run: Optional[RunData] = None) -> str:
    """Returns the HTML of the hints; '' for a run that is right. `run`: if its goal is not known."""
    if found.mistake == '':
        return ''
    goal = ''
    if run is not None and 'goals' in run.derived and found.lab == DRIVE:
        goal = '<p>The goal was taken to be ({:g}, {:g}). If it was another one, give it by --goal.' \
            '</p>\n'.format(run.goals.x[0], run.goals.y[0])
    if found.mistake is None:
        return SECTION.format(NONE_FITS + goal)
    hint = HINTS[found.lab, found.mistake]
    evidence = ' '.join(map(escape, sentences(found)))
    link = ' <a href="#t={:.1f}">Watch it</a>'.format(found.moment)
    folded = FOLDED.format(' id="mistake"', 'The mistake', evidence + link, '')
    for title, words in reversed([('Hint 1: what to look at', hint.look),
                                  ('Hint 2: where it is explained', _place(found.lab, hint)),
                                  ('Hint 3: where to change it', hint.todo + '.')]):
        folded = FOLDED.format('', title, escape(words), folded)
    return SECTION.format(
        '<p>Open one hint, then try again before you open the next.</p>\n' + goal + folded)


def in_a_line(found: Diagnosis) -> str:
    """The first two hints in a line; '' if no mistake is known."""
    if not found.mistake:
        return ''
    hint = HINTS[found.lab, found.mistake]
    return 'A known mistake moves a robot so. {} See: {}'.format(
        hint.look, _place(found.lab, hint))


def _place(lab: str, hint: Hint) -> str:
    return '{}, section "{}"{}.'.format(
        SHEETS[lab], hint.heading, ', step {}'.format(hint.step) if hint.step else '')


def sentences(found: Diagnosis) -> List[str]:
    """The mistake and its evidence, as sentences."""
    def does(mistake):
        return HINTS[found.lab, mistake].does

    words = ['The robot moved as one whose node {}.'.format(does(found.mistake))]
    near, right, far = found.apart
    if math.isfinite(near):
        words.append('It was {} from the movement of such a robot, and {} from a right one.'.format(
            *(_amount(apart, found.lab) for apart in (near, right))))
    if found.also:
        words.append('The same movement has a node that {}.'.format(
            ', or one that '.join(map(does, found.also))))
    if math.isfinite(far):
        words.append('The next likely mistake is {} from it: a node that {}.'.format(
            _amount(far, found.lab), does(found.other)))
    if found.besides:
        words.append('Besides, the node {}.'.format(does(found.besides)))
    return words


def _amount(apart: float, lab: str) -> str:
    """A distance in words: metres of a way, or an angle of a turn."""
    if lab == TURN:
        angle = math.degrees(apart)
        return '{:.0f} degrees'.format(angle) if angle < 720.0 else 'whole turns'
    return '{:.0f} cm'.format(math.ceil(100.0 * apart)) if apart < 2.0 else 'more than 2 m'
