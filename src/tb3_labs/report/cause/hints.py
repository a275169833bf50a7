"""The hints to a known mistake, one after another; the last one is the mistake with its evidence.

Each hint is folded, and the next one lies within it. So a teacher can hand out the page of a run,
and the student still has to find the mistake.
"""
import math
import re
from html import escape
from typing import Callable, Dict, List, NamedTuple, Optional

from tb3_labs.report.cause.diagnosis import DRIVE, PAD, TURN, Diagnosis
from tb3_labs.report.run_data import RunData


class Hint(NamedTuple):
    """A mistake in words: a node that `does` it; `look`: what to look at; the heading and the step
    of the sheet; the TODO of the skeleton; `tell`: what shows it, and no other mistake that moves
    a robot so."""

    does: str
    look: str
    heading: str
    step: int
    todo: str
    tell: str = ''


IMU_LAB, TRANSFORMATION_LAB = 'IMU lab', 'Transformation lab'
SHEETS = {TURN: IMU_LAB, DRIVE: TRANSFORMATION_LAB, PAD: TRANSFORMATION_LAB}
TURNS_STEP, POSE, STATES_STEP, RESET_STEP, THUMB_STEP = (
    '3. Lab: turn 90 and 180 degrees', '1. The local pose', '2. The four states', '3. The reset',
    '4. By thumb')
PUSH = 'Drive the robot forward by hand after a reset in another direction, and print local_x ' \
    'and local_y. Which of them shall grow?'
PUSHED = 'after a reset at 90 degrees in odom, half a metre ahead by hand: '
AFTER_RESET = 'Print local_x, local_y and local_yaw a second after a reset, at rest. Which three ' \
    'numbers do you expect?'
PRINT_YAW = 'Print the yaw that your node has, and turn the robot once around by hand. Over ' \
    'which range shall the number run, and which way?'
BY_HAND = 'the yaw that it prints while you turn the robot to the left by hand: '
LATE = 'turns by a heading that stays (it hears nothing, does not store it in self, takes ' \
    'another Euler angle) or comes late (its callback sleeps, or waits in input())'
HEARD = 'rosnode info NODE: does it listen to imu, and who publishes that topic?'
LAST_MESSAGE = 'rostopic echo /cmd_vel: which message shall be the last one of a movement?'
SLEEPS = Hint(
    'sends its commands too seldom (it sleeps in a callback or a loop, or its Timer is slow)',
    'rostopic hz /cmd_vel while the robot moves: how often does your node send a command, and how '
    'often shall it?', TURNS_STEP, 5, 'TODO 7')
#: The hints, by lab and mistake.
HINTS = {
    (TURN, 'error_not_wrapped'): Hint(
        'does not wrap the error', 'The goal is 80, the heading 350. What is the error, and which '
        'way is the shorter one? And from 10 to 280?', TURNS_STEP, 5, 'TODO 7',
        'yaw_err, printed in the turn that goes the long way round: it is beyond 180 or -180'),
    (TURN, 'goal_not_wrapped'): Hint(
        'wraps neither the goal nor the error', 'The heading is 350. Which goal has l, and does '
        'the heading ever come near it? Which goal has r at 40?', TURNS_STEP, 5, 'TODO 7',
        'goal_yaw after a letter: it is below 0 or above 360'),
    (TURN, 'no_negative_clamp'): Hint(
        'limits positive commands only', 'An error of -90 gives a command of -9. What do both '
        'limits make of it?', TURNS_STEP, 6, 'TODO 7', 'ang_z after r: it is 0.5 or more'),
    (TURN, 'no_clamp'): Hint(
        'does not limit its commands', 'An error of 90 gives a command of 9. What do both limits '
        'make of it?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'heading_kept'): Hint(
        LATE, HEARD, TURNS_STEP, 4, 'the subscriber, and TODO 6',
        BY_HAND + 'it stays, or follows late'),
    (TURN, 'swapped'): Hint(
        'turns right for l, and left for r', 'The heading is 100. Which goal has l, if the heading '
        'grows to the left?', TURNS_STEP, 5, 'TODO 7',
        'goal_yaw after l: it is 90 less than the heading'),
    (TURN, 'quaternion_order'): Hint(
        'reads the numbers of the quaternion in another order', PRINT_YAW, TURNS_STEP, 4, 'TODO 6',
        BY_HAND + 'it falls, or stays although the node hears the IMU'),
    (TURN, 'radians'): Hint(
        'mixes radians and degrees', PRINT_YAW, TURNS_STEP, 4, 'TODO 6',
        BY_HAND + 'it grows, but never beyond 6.3; or the goal is 1.57 from it'),
    (TURN, 'sign'): Hint(
        'takes the error with the wrong sign, and so turns away from its goal', 'The heading is '
        '100, the goal is 190. What is yaw_err, and to which side does a positive command turn?',
        TURNS_STEP, 5, 'TODO 7', BY_HAND + 'it grows, as it shall, but the robot does not turn to '
        'the side that was typed'),
    (TURN, 'never_ends'): Hint(
        'does not end its turn within HDG_TOL, and goes to and fro about its goal', 'Print '
        'yaw_err. When is it less than HDG_TOL, and what does your node do then?', TURNS_STEP, 5,
        'TODO 3 and 7', 'the side to which the robot turns: it is the one that was typed'),
    (TURN, 'goal_kept'): Hint(
        'turns to the same heading after each letter', 'Print self.goal_yaw after each letter. '
        'Which line changes it, and is that the same variable?', TURNS_STEP, 5, 'TODO 7',
        'self.goal_yaw after l: it is still 0'),
    (TURN, 'degrees_twice'): Hint(
        'converts a yaw in degrees to degrees again', PRINT_YAW, TURNS_STEP, 4, 'TODO 6',
        BY_HAND + 'it runs by 57 for each degree'),
    (TURN, 'no_abs'): Hint(
        'takes each turn to the right for finished', 'After r the error is -90. Is that less than '
        'HDG_TOL?', TURNS_STEP, 6, 'TODO 7'),
    (TURN, 'never_over'): Hint(
        'never ends its first turn, so it never asks again', 'Print self.turning. When shall it '
        'become False?', TURNS_STEP, 5, 'TODO 7'),
    (TURN, 'sleeps'): SLEEPS,
    (DRIVE, 'sleeps'): SLEEPS._replace(heading=STATES_STEP, step=1, todo='control_loop'),
    (DRIVE, 'state_kept'): Hint(
        'stays in its last state at a reset', 'Print self.state after a reset. From which state '
        'shall it start again?', RESET_STEP, 1, 'set_pose_callback'),
    (TURN, 'no_stop'): Hint('sends no zero at the end', LAST_MESSAGE, TURNS_STEP, 5, 'TODO 7'),
    (DRIVE, 'inverse_missing'): Hint(
        'rotates the displacement by R in place of its inverse', PUSH, POSE, 3, 'TODO 4',
        PUSHED + 'local_x is -0.5'),
    (DRIVE, 'not_rotated'): Hint(
        'does not rotate the displacement', PUSH, POSE, 3, 'TODO 4',
        PUSHED + 'local_y is 0.5, local_x is 0'),
    (DRIVE, 'imu_rotates'): Hint(
        "rotates the displacement by the IMU's yaw", 'Compare the yaws of /imu and of /odom, while '
        'the robot stands. In which of the two frames was the displacement measured?', POSE, 4,
        'TODO 4', PUSHED + 'the same wrong numbers as after a reset at 0 degrees'),
    (DRIVE, 'reference_kept'): Hint(
        'keeps its references at a reset', AFTER_RESET, RESET_STEP, 2, 'set_pose_callback',
        'local_x, local_y and local_yaw a second after a reset elsewhere: they are not the '
        'declared ones'),
    (DRIVE, 'yaw_kept'): Hint(
        'keeps the reference of the yaw at a reset', AFTER_RESET, RESET_STEP, 2,
        'set_pose_callback, TODO 2 and 4',
        'local_yaw a second after a reset at another heading: it is not the declared one'),
    (DRIVE, 'place_kept'): Hint(
        'keeps the reference of the place at a reset', AFTER_RESET, RESET_STEP, 2,
        'set_pose_callback and TODO 3',
        'local_x and local_y a second after a reset elsewhere: they are not the declared ones'),
    (DRIVE, 'declared_lost'): Hint(
        'forgets the pose that a reset declares', 'Reset to x: 0.2, y: 0.3. Which numbers does '
        'your node have a second later?', 'Beyond the handout', 0, 'TODO 2 and 4, as an extra',
        'local_x, local_y and local_yaw a second after such a reset: all are 0'),
    (DRIVE, 'no_local_frame'): Hint(
        'drives by odom in place of local, in one line or in all', 'Which variables does '
        'control_loop read in each line, and in which frame is the goal?', STATES_STEP, 0, 'TODO 5',
        'local_x, local_y and local_yaw a second after a reset at another heading: they are '
        'right, but control_loop reads other variables'),
    (DRIVE, 'error_not_wrapped'): Hint(
        'does not wrap the angle', 'The goal is at 170 degrees, the heading is -170. What is the '
        'error, and which way is the shorter one?', STATES_STEP, 0, 'TODO 2 and 5',
        'yaw_error in the turn that goes the long way round: it is beyond 3.14'),
    (DRIVE, 'quaternion_order'): Hint(
        'reads the numbers of a quaternion in another order', PRINT_YAW, POSE, 2, 'TODO 2',
        BY_HAND + 'it falls, or stays although the node hears the IMU'),
    (DRIVE, 'heading_kept'): Hint(
        LATE, HEARD, POSE, 2, 'the subscriber, and TODO 2', BY_HAND + 'it stays, or follows late'),
    (DRIVE, 'degrees'): Hint(
        'mixes degrees and radians', PRINT_YAW, POSE, 2, 'the callbacks, and TODO 2',
        BY_HAND + 'it runs beyond 3.2'),
    (DRIVE, 'yaw_sign'): Hint(
        'takes local_yaw with the wrong sign', PRINT_YAW, POSE, 2, 'TODO 2', BY_HAND + 'it falls'),
    (DRIVE, 'atan2'): Hint(
        'calls atan2(dx, dy) in place of atan2(dy, dx)', 'The goal is 0.61 m behind the robot and '
        '0.61 m to its left: at 135 degrees. Which angle has your node?', STATES_STEP, 0,
        'control_loop', 'math.atan2 in control_loop: is dy its first argument?'),
    (DRIVE, 'sign'): Hint(
        'takes the error with the wrong sign, and so turns away from its goal', 'The goal is at '
        '135 degrees, the heading is 0. What is yaw_error, and to which side does a positive '
        'command turn?', STATES_STEP, 0, 'control_loop', BY_HAND + 'it grows, as it shall'),
    (DRIVE, 'never_arrives'): Hint(
        'does not end MOVE_FORWARD near its goal, or sees it late (a sleep in odom_callback)',
        'Print distance in MOVE_FORWARD. At which distance shall the state change?', STATES_STEP, 0,
        'control_loop', 'distance, printed in MOVE_FORWARD: it falls below 0.15, and the state '
        'stays; or it comes late'),
    (DRIVE, 'yaw_left_out'): Hint(
        'leaves its heading out of the error of the first turn', 'Which error has a robot that '
        'faces its goal?', STATES_STEP, 0, 'control_loop', BY_HAND + 'it grows, as it shall'),
    (DRIVE, 'no_stop'): Hint(
        'sends no zero at the end', LAST_MESSAGE, STATES_STEP, 1, 'control_loop'),
    (PAD, 'two_senders'): Hint(
        'goes on sending while another node has control', 'rostopic echo /cmd_vel after A: do '
        'zeros come between the commands?', THUMB_STEP, 1, 'has_control'),
}
#: Words of a log line that quotes an exception, and where its last line number is.
RAISED, LINE_NUMBER = ('Traceback (most recent call last)', 'bad callback'), re.compile(
    r'^ *File ".*", line (\d+)', re.MULTILINE)
#: A page shows this many different exceptions, and of each this many characters.
MOST_ERRORS, LONGEST_ERROR = 5, 300
#: The skeletons' nodes name each TODO that they meet.
OPEN_TODO = re.compile(r'TODO \d+ is open')
SAID = '<p><b>{}</b> <a href="#t={:.1f}">Watch it</a></p>'
SECTION = '''<section id="hints"><h2>{}</h2>
{}</section>'''
FOLDED = '<details{}><summary>{}</summary>\n<p>{}</p>\n{}</details>\n'
NONE_FITS = '<p>Some movements differ from those of the handout. No known mistake explains them: ' \
    'was the node ended in one of them, started anew, or is its task another one?</p>\n'


def said_by_node(run: RunData) -> str:
    """HTML of what the node itself told of its faults: exceptions, each once, and open TODOs."""
    log = run.log
    errors: Dict[str, List[float]] = {}
    for time, text in zip(log.time, log.texts):
        if any(word in text for word in RAISED):
            at = LINE_NUMBER.findall(text)
            words = text.strip().splitlines()[-1] + (' (line {})'.format(at[-1]) if at else '')
            errors.setdefault(words, []).append(float(time))
    parts = [SAID.format(escape('An exception came {}: {}.'.format(
        'once' if len(times) == 1 else '{} times'.format(len(times)), words[:LONGEST_ERROR])),
        times[0]) for words, times in list(errors.items())[:MOST_ERRORS]]
    todos = [(float(time), found.group()) for time, text in zip(log.time, log.texts)
             for found in [OPEN_TODO.match(text)] if found]
    if todos:
        parts.append(SAID.format('The node said: {}.'.format(', '.join(dict.fromkeys(
            words for _, words in todos))), todos[0][0]))
    return '\n'.join(parts)


def section(found: Diagnosis, run: Optional[RunData] = None) -> str:
    """Returns the HTML of the hints; '' if the run is right. `run`: if its goal is not known."""
    if found.mistake == '':
        return ''
    goal = ''
    if run is not None and 'goals' in run.derived and found.lab == DRIVE:
        goal = '<p>The goal was taken to be ({:g}, {:g}). If it was another one, give it by ' \
            '--goal.</p>\n'.format(run.goals.x[0], run.goals.y[0])
    if found.mistake is None:
        return SECTION.format('Not as in the handout', NONE_FITS + goal)
    evidence = ' '.join(map(escape, sentences(found)))
    link = ' <a href="#t={:.1f}">Watch it</a>'.format(found.moment)
    folded = FOLDED.format(' id="mistake"', 'The mistake' if len(found.causes) == 1 else
                           'The mistakes', evidence + link, '')
    for title, of_hint in reversed([
            ('Hint 1: what to look at', lambda hint: hint.look),
            ('Hint 2: where it is explained', lambda hint: _place(found.lab, hint)),
            ('Hint 3: where to change it', lambda hint: hint.todo + '.')]):
        folded = FOLDED.format('', title, escape(_each(found, of_hint)), folded)
    return SECTION.format('What went wrong', '<p>Open one hint, then try again before you open the '
                          'next.</p>\n' + goal + folded)


def in_a_line(found: Diagnosis) -> str:
    """The mistake, and what to look at, in a line; '' if no mistake is known."""
    if not found.mistake:
        return ''
    return '{} {} See: {}'.format(
        sentences(found)[0], _each(found, lambda hint: hint.look),
        _each(found, lambda hint: _place(found.lab, hint)))


def _each(found: Diagnosis, words: Callable[[Hint], str]) -> str:
    """The words of the hints to all mistakes that fit, each once."""
    return ' '.join(dict.fromkeys(words(HINTS[found.lab, cause]) for cause in found.causes))


def _place(lab: str, hint: Hint) -> str:
    return '{}, section "{}"{}.'.format(
        SHEETS[lab], hint.heading, ', step {}'.format(hint.step) if hint.step else '')


def sentences(found: Diagnosis) -> List[str]:
    """The mistake and its evidence, as sentences. Of several mistakes that move a robot in the same
    way none is preferred: each has what would show it."""
    def does(mistake):
        return HINTS[found.lab, mistake].does

    words = ['The robot moved as one whose node {}.'.format(
        ', or '.join(map(does, found.causes)))]
    near, right, far = found.apart
    if len(found.causes) > 1:
        words.append('These move a robot in the same way: look at each.')
        words += ['One that {}? Look at {}.'.format(
            does(cause), HINTS[found.lab, cause].tell) for cause in found.causes]
    elif math.isfinite(near):
        words.append('It was {} from the movement of such a robot, and {} from a right one.'.format(
            *(_amount(apart, found.lab) for apart in (near, right))))
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
        return '{:.0f} degrees'.format(angle) if angle < 330.0 else 'whole turns'
    return '{:.0f} cm'.format(math.ceil(100.0 * apart)) if apart < 2.0 else 'more than 2 m'
