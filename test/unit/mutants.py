"""Texts of students' nodes: right ones in several writings, and ones with a mistake. A text is a
right node's text with some lines replaced.

The mistakes bear the identifiers of tb3_labs.report.cause.diagnosis.
"""
import random
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from student_runs import Scene, drive_scene, pad_scene, text_of, turn_scene
from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.report.run_data import RunData

#: Replacements: (old text, new text); each old text is there.
Edits = Sequence[Tuple[str, str]]
TURN, DRIVE, PAD = 'turn', 'drive', 'pad'

#: Mistakes that can make the same run. With a yaw of 0 or 180 deg for ever, or within 0 to 6.3 and
#: 356.9 to 360, or with a goal of -80 or 440, the error stays about 90 deg: the turn never ends. A
#: robot that rotates its way wrongly by more than 10 deg drives on for ever, however it is wrong.
SAME = (
    {'heading_kept', 'quaternion_order', 'radians', 'goal_not_wrapped'},
    {'inverse_missing', 'not_rotated', 'imu_rotates'},
    {'heading_kept', 'quaternion_order', 'yaw_left_out'}, {'yaw_sign', 'degrees', 'sign', 'quaternion_order'},
    {'never_arrives', 'quaternion_order', 'inverse_missing', 'not_rotated', 'imu_rotates'},
    {'sign', 'quaternion_order', 'never_ends'},
)


class Node(NamedTuple):
    """A text; `right` is the same without its mistake, and the same text if it has none."""

    lab: str
    text: str
    right: str
    zero: bool              # does its scene declare (0, 0, 0) only?


def edited(text: str, edits: Edits) -> str:
    """Returns `text` with the replacements; ``ValueError`` if an old text is not there."""
    for old, new in edits:
        if old not in text:
            raise ValueError('not in the text: {!r}'.format(old))
        text = text.replace(old, new)
    return text


# The turn -----------------------------------------------------------------------------------------

def lines(first: str, number: int) -> str:
    """Lines of the right node, from the one that begins with `first`, by their number."""
    text = text_of('turtlebot_controller').splitlines(True)
    begin = [line.strip().startswith(first) for line in text].index(True)
    return ''.join(text[begin:begin + number])


GOAL_LOW, GOAL_HIGH = lines('if self.goal_yaw < 0', 3), lines('elif self.goal_yaw > 360', 2)
GOAL_BOTH = lines('if self.goal_yaw < 0', 4)
ERROR_HIGH, ERROR_LOW = lines('if yaw_err > 180', 3), lines('elif yaw_err < -180', 2)
ERROR_BOTH = lines('if yaw_err > 180', 4)
POSITIVE, NEGATIVE = lines('if 0 < ang_z', 4), lines('elif -self.MIN_ANG_Z', 4)
TURN_OVER = '                self.turning = False\n                ang_z = 0\n'
TURN_QUATERNION = lines('q = Quaternion', 2)
CONVERT = 'return 360 + yaw if yaw < 0 else yaw'
MATH = ('import rospy\n', 'import math\n\nimport rospy\n')
#: The letter decides the side, so the error needs no wrap.
BY_LETTER = [
    ('            if direction == "l":', '            self.direction = direction\n'
     '            if direction == "l":'),
    (ERROR_BOTH, '            yaw_err = abs(yaw_err)\n'),
    (POSITIVE + NEGATIVE, '            ang_z = max(self.MIN_ANG_Z, min(self.MAX_ANG_Z, ang_z))\n'
     '            if self.direction == "r":\n                ang_z = -ang_z\n')]

#: Right writings, without the constants.
TURN_STYLES: List[Edits] = [
    [], [],
    [MATH, (ERROR_BOTH, '            yaw_err = math.radians(yaw_err)\n            yaw_err = '
            'math.degrees(math.atan2(math.sin(yaw_err), math.cos(yaw_err)))\n')],
    [(ERROR_BOTH, '            yaw_err = (yaw_err + 180) % 360 - 180\n')],
    [MATH, (ERROR_BOTH, '            yaw_err = math.fmod(yaw_err + 540, 360) - 180\n')],
    [(ERROR_BOTH, '            while yaw_err > 180:\n                yaw_err -= 360\n'
      '            while yaw_err < -180:\n                yaw_err += 360\n')],
    [(GOAL_BOTH, '            self.goal_yaw = self.goal_yaw % 360\n')],
    [(GOAL_BOTH, ''), (ERROR_BOTH, '            yaw_err = (yaw_err + 540) % 360 - 180\n')],
    [(CONVERT, 'return yaw'), (GOAL_BOTH, '')],
    [(POSITIVE + NEGATIVE, '            size = max(self.MIN_ANG_Z, min(self.MAX_ANG_Z, abs(ang_z)))'
      '\n            ang_z = size if yaw_err > 0 else -size\n')],
    [(TURN_OVER, TURN_OVER + '                self.cmd_pub.publish(Twist())\n')],
]


def turn_constants(source: random.Random) -> Edits:
    """Other gains, tolerances, limits and rhythms, with which the turn still ends."""
    gain, tolerance = source.uniform(0.05, 0.2), source.uniform(5.0, 10.0)
    tolerance = max(tolerance, 60.0 * gain)     # K * tolerance is the speed at the end
    return [('K_HDG = 0.1', 'K_HDG = {:.3f}'.format(gain)),
            ('HDG_TOL = 10', 'HDG_TOL = {:.1f}'.format(min(tolerance, 10.0))),
            ('MAX_ANG_Z = 1.5', 'MAX_ANG_Z = {:.2f}'.format(source.uniform(1.0, 1.5))),
            ('Duration(.1)', 'Duration({:.4f})'.format(source.choice((0.1, 0.05, 1.0 / 30.0))))]


# A goal that is not wrapped does no harm where the error is: the goal is in -90 to 450, the heading
# in 0 to 360, so the error is in -450 to 450, and one wrap by 360 makes it the short way's. Hence
# these two mistakes are seen only where the letter decides the side.
#: {mistake: (edits, edits that its right text has as well)}.
TURN_MISTAKES: Dict[str, Tuple[Edits, Edits]] = {
    'goal_not_wrapped/low': ([(GOAL_LOW, '            if self.goal_yaw > 360:\n')], BY_LETTER),
    'goal_not_wrapped/high': ([(GOAL_HIGH, '')], BY_LETTER),
    'error_not_wrapped/low': ([(ERROR_LOW, '')], []),
    'error_not_wrapped/high': ([(ERROR_HIGH, '            if yaw_err < -180:\n')], []),
    'error_not_wrapped': ([(ERROR_BOTH, '')], []),
    'goal_not_wrapped': ([(GOAL_BOTH, ''), (ERROR_BOTH, '')], []),
    'no_negative_clamp': ([(NEGATIVE, '')], []),
    'quaternion_order': ([(
        TURN_QUATERNION, '            q = Quaternion(imu.orientation.x, '
        'imu.orientation.y, imu.orientation.z, imu.orientation.w)\n')], []),
    'radians': ([('to_euler(degrees=True)', 'to_euler()')], []),
    'no_stop': ([(TURN_OVER, '                self.turning = False\n')], []),
    'sign': ([('self.goal_yaw - self.curr_yaw', 'self.curr_yaw - self.goal_yaw')], []),
    'never_ends': ([('if abs(yaw_err) < self.HDG_TOL', 'if abs(yaw_err) < 0')], []),
    'degrees_twice': ([MATH, ('self.convert_yaw(yaw)', 'self.convert_yaw(math.degrees(yaw))')], []),
    'sleeps': ([('        self.cmd.angular.z = ang_z\n        self.cmd_pub.publish(self.cmd)\n',
                 '        self.cmd.angular.z = ang_z\n        self.cmd_pub.publish(self.cmd)\n'
                 '        rospy.sleep(1)\n')], []),
}
#: Mistakes that a recording shows only if the letters are known.
BY_LETTERS: Dict[str, Edits] = {
    'no_abs': [('if abs(yaw_err) <', 'if yaw_err <')],
    'never_over': [(TURN_OVER, '                ang_z = 0\n')],
    'goal_kept': [('self.goal_yaw = self.curr_yaw +', 'goal_yaw = self.curr_yaw +'),
                  ('self.goal_yaw = self.curr_yaw -', 'goal_yaw = self.curr_yaw -')],
}

# The drive ----------------------------------------------------------------------------------------

NONES = '''        self.initial_global_x = None
        self.initial_global_y = None
        self.initial_global_yaw = None
        self.state'''
STATE = '        self.state'
LOCAL_X, LOCAL_Y = 'self.local_x = cos * dx + sin * dy', 'self.local_y = -sin * dx + cos * dy'
LOCAL_YAW = 'self.normalize_angle(global_yaw - self.initial_global_yaw)'
TAKE_YAW = 'self.initial_odom_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]'
SET_YAW = 'self.local_yaw = self.normalize_angle('
ODOM_END = '\n    def ctrl_relinq_callback'
IMU_YAW = '        global_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]'
#: The global pose as Lab 6 has it, which the handout replaces.
KEPT = [(IMU_YAW, IMU_YAW + '\n        self.yaw = global_yaw'),
        ('global_y = msg.pose.pose.position.y\n',
         'global_y = msg.pose.pose.position.y\n        self.x, self.y = global_x, global_y\n'),
        ('        self.local_x = 0.0\n',
         '        self.x = self.y = self.yaw = 0.0\n        self.local_x = 0.0\n')]
WRAP = 'return math.atan2(math.sin(angle), math.cos(angle))'
BEARING = 'self.normalize_angle(math.atan2(dy, dx) - self.local_yaw)'
FINAL_SPEED = 'cmd.angular.z = 0.5 * yaw_error'
TAKEN_STATE = "        self.state = 'ROTATE_TO_GOAL'\n        rospy.loginfo("
AT_GOAL = "                rospy.loginfo('Goal reached!')\n"
FORWARD = 'cmd.linear.x = 0.15'
PLACE_NONE = '        self.initial_global_x = None\n        self.initial_global_y = None\n'
YAW_NONE = '        self.initial_global_yaw = None\n'
#: The declared pose counts, also if it is not zero.
HONOURING = [
    ("self.has_control = False\n        self.cmd_pub", "self.has_control = False\n"
     "        self.start_x = self.start_y = self.start_yaw = 0.0\n        self.cmd_pub"),
    ('        self.local_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]\n',
     '        self.local_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]\n'
     '        self.start_x, self.start_y = self.local_x, self.local_y\n'
     '        self.start_yaw = self.local_yaw\n'),
    (LOCAL_YAW, LOCAL_YAW[:-1] + ' + self.start_yaw)'),
    (LOCAL_Y, LOCAL_Y + '''
        x, y, yaw = self.local_x, self.local_y, self.start_yaw
        self.local_x = self.start_x + math.cos(yaw) * x - math.sin(yaw) * y
        self.local_y = self.start_y + math.sin(yaw) * x + math.cos(yaw) * y''')]
NUMPY = ('import math\n', 'import math\n\nimport numpy as np\n')
CONSTANT_SPEED = [(FINAL_SPEED, 'cmd.angular.z = math.copysign(0.4, yaw_error)')]

DRIVE_STYLES: List[Edits] = [
    [], [],
    [(WRAP, 'return math.remainder(angle, 2 * math.pi)')],
    [(WRAP, 'turn = 2 * math.pi\n        '
      'return math.fmod(math.fmod(angle, turn) + 1.5 * turn, turn) - math.pi')],
    [(WRAP, 'while angle > math.pi:\n            angle -= 2 * math.pi\n        '
      'while angle < -math.pi:\n            angle += 2 * math.pi\n        return angle')],
    [NUMPY, (LOCAL_X, 'R = np.array([[cos, -sin], [sin, cos]])\n        '
             'self.local_x, self.local_y = R.T @ np.array([dx, dy])'),
     ('        ' + LOCAL_Y + '\n', '')],
    [(FORWARD, 'cmd.linear.x = min(0.15, max(0.05, 0.4 * distance))')],
    [(FORWARD, FORWARD + '\n                cmd.angular.z = 0.5 * '
      + BEARING)],
    [(AT_GOAL, AT_GOAL + '                self.cmd_pub.publish(cmd)\n')],
    [(FINAL_SPEED, 'cmd.angular.z = math.copysign(max(0.1, min(1.0, abs(yaw_error))), yaw_error)')],
]


def drive_constants(source: random.Random) -> Edits:
    """Other gains, tolerances, speeds and rhythms, with which the drive still ends. The motors need
    0.0105 rad/s to turn at all, so gain times tolerance is more."""
    turn, final = source.uniform(0.15, 0.6), source.uniform(0.25, 1.0)
    edits = [('cmd.angular.z = 0.3 * yaw_error', 'cmd.angular.z = {:.3f} * yaw_error'.format(turn)),
             ('0.5 * yaw_error', '{:.3f} * yaw_error'.format(final)),
             (FORWARD, 'cmd.linear.x = {:.3f}'.format(source.uniform(0.1, 0.2))),
             ('Duration(0.1)', 'Duration({:.4f})'.format(source.choice((0.1, 0.05, 1.0 / 30.0))))]
    tolerance = max(source.uniform(0.02, 0.1), 0.014 / min(turn, final))
    return edits + [('abs(yaw_error) > 0.05', 'abs(yaw_error) > {:.3f}'.format(tolerance))]


XYZW = 'Quaternion(q.x, q.y, q.z, q.w)'
DRIVE_MISTAKES: Dict[str, Tuple[Edits, Edits]] = {
    'inverse_missing': ([(LOCAL_X, 'self.local_x = cos * dx - sin * dy'),
                         (LOCAL_Y, 'self.local_y = sin * dx + cos * dy')], []),
    'not_rotated': ([(LOCAL_X, 'self.local_x = dx'), (LOCAL_Y, 'self.local_y = dy')], []),
    'imu_rotates': ([(TAKE_YAW, 'self.initial_odom_yaw = self.yaw')] + KEPT, []),
    'reference_kept': ([(NONES, STATE)], []),
    'yaw_kept': ([(NONES, PLACE_NONE + STATE)], []),
    'place_kept': ([(NONES, YAW_NONE + STATE)], []),
    'declared_lost': ([('self.start_x, self.start_y = self.local_x, self.local_y', 'pass'),
                       ('self.start_yaw = self.local_yaw', 'pass')], HONOURING),
    'no_local_frame': ([
        (ODOM_END, '        self.local_x, self.local_y = global_x, global_y\n        '
         'self.local_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]\n' + ODOM_END),
        (SET_YAW, SET_YAW.replace('local_yaw', 'unused'))], []),
    'error_not_wrapped': ([(WRAP, 'return angle')], []),
    'quaternion_order': ([
        (IMU_YAW, IMU_YAW.replace('Quaternion(q.w, q.x, q.y, q.z)', XYZW))], []),
    'degrees': ([(IMU_YAW, IMU_YAW.replace('to_euler()', 'to_euler(degrees=True)'))], []),
    'no_stop': ([(AT_GOAL, AT_GOAL + '                return\n')], CONSTANT_SPEED),
    'yaw_sign': ([('global_yaw - self.initial_global_yaw', 'self.initial_global_yaw - global_yaw')], []),
    'atan2': ([('math.atan2(dy, dx)', 'math.atan2(dx, dy)')], []),
    'sign': ([('0.3 * yaw_error', '-0.3 * yaw_error')], []),
    'never_arrives': ([('if distance > 0.15', 'if True')], []),
    'yaw_left_out': ([('math.atan2(dy, dx) - self.local_yaw', 'math.atan2(dy, dx)')], []),
    'state_kept': ([(TAKEN_STATE, '        rospy.loginfo(')], []),
}
#: TODO 5 in three of its four lines. The text after the stroke is not a part of the identifier.
PARTIAL = {'no_local_frame/' + name: ([(line, line.replace('local_', ''))] + KEPT, []) for name, line in (
    ('x', 'self.goal_x - self.local_x'), ('y', 'self.goal_y - self.local_y'),
    ('course', 'math.atan2(dy, dx) - self.local_yaw'),
    ('final', 'self.goal_yaw - self.local_yaw'))}
DRIVE_MISTAKES.update(PARTIAL)

# The gamepad --------------------------------------------------------------------------------------

PAD_MISTAKES: Dict[str, Tuple[Edits, Edits]] = {
    'two_senders': ([('        if self.has_control:\n', '        if True:\n')], []),
}
PAD_STYLES: List[Edits] = [
    [], [('        elif msg.buttons[1]:', '        if msg.buttons[1]:')],
    [('0.22 * msg', '0.15 * msg'), ('2.84 * msg', '1.5 * msg')]]

# All ----------------------------------------------------------------------------------------------

FILES = {TURN: 'turtlebot_controller', DRIVE: 'move2goal_tf', PAD: 'gamepad'}
MISTAKES = {TURN: TURN_MISTAKES, DRIVE: DRIVE_MISTAKES, PAD: PAD_MISTAKES}
STYLES = {TURN: TURN_STYLES, DRIVE: DRIVE_STYLES, PAD: PAD_STYLES}
CONSTANTS: Dict[str, Callable[[random.Random], Edits]] = {
    TURN: turn_constants, DRIVE: drive_constants, PAD: lambda source: []}
#: The share of the texts with a mistake that have other constants, too.
OWN_CONSTANTS = 0.3


def known() -> List[Tuple[str, str]]:
    return [(lab, mistake) for lab, mistakes in MISTAKES.items() for mistake in mistakes]


def is_same(mistake: str, guess: Optional[str]) -> bool:
    """Is it the mistake, or one that can make the same run?"""
    return guess == mistake or any({guess, mistake} <= group for group in SAME)


def right_node(lab: str, source: random.Random) -> Node:
    """A right node: the given one, or a varied one."""
    zero = lab != DRIVE or source.random() < 0.5
    style = source.choice(STYLES[lab])
    honours = lab == DRIVE and (not zero or source.random() < 0.5)
    if honours and any(LOCAL_Y in old for old, _ in style):
        style = []
    constants = CONSTANTS[lab](source) if source.random() < 0.7 else ()
    text = _with_constants(
        edited(text_of(FILES[lab]), [*(HONOURING if honours else []), *style]), constants)
    return Node(lab, text, text, zero)


def mistaken_node(lab: str, mistake: str, source: random.Random) -> Node:
    edits, base = MISTAKES[lab][mistake]
    zero = lab != DRIVE or base is not HONOURING and source.random() < 0.5
    if lab == DRIVE and base is not HONOURING and not zero:
        base = [*HONOURING, *base]
    right = edited(text_of(FILES[lab]), base)
    constants = CONSTANTS[lab](source) if source.random() < OWN_CONSTANTS else ()
    return Node(lab, _with_constants(edited(right, edits), constants),
                _with_constants(right, constants), zero)


def _with_constants(text, constants):
    for old, new in constants:      # a line that the writing has replaced keeps its number
        text = text.replace(old, new)
    return text


def scene_of(node: Node, source: random.Random) -> Scene:
    """A scene in which the node can show what it does."""
    if node.lab == TURN:
        return turn_scene(source)
    return drive_scene(source, node.zero) if node.lab == DRIVE else pad_scene(source)


def agree(one: RunData, other: RunData) -> bool:
    """Are the two runs the same: path within 3 cm, heading within 5 deg, the same resets and end?
    """
    first, second = one.ground_truth, other.ground_truth
    length = min(len(first), len(second))
    if abs(one.duration - other.duration) > 1.0 or len(one.resets) != len(other.resets):
        return False
    if len(one.resets) and np.abs(one.resets.time - other.resets.time).max() > 0.5:
        return False
    apart = np.hypot(first.x[:length] - second.x[:length], first.y[:length] - second.y[:length])
    turned = np.abs(wrap_all(first.yaw[:length] - second.yaw[:length]))
    return bool(apart.max() < 0.03 and turned.max() < np.radians(5.0))
