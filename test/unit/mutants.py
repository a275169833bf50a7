"""Texts of students' nodes: right ones, and ones with a mistake. A text is a right node's text with
some lines replaced, so the same mistake comes in several writings.

The known mistakes bear the identifiers of tb3_labs.report.diagnosis. `UNKNOWN` is none of them.
"""
import itertools
import random
from dataclasses import dataclass, replace
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy as np

from student_runs import Scene, drive_scene, pad_scene, text_of, turn_scene
from tb3_labs.geometry.angles import wrap_all
from tb3_labs.report.run_data import RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: Replacements: (old text, new text); each old text is there.
Edits = Sequence[Tuple[str, str]]
UNKNOWN = 'unknown'
TURN, DRIVE, PAD = 'turn', 'drive', 'pad'

#: Groups of mistakes whose recorded runs can be the same. A guess counts as right only if the other
#: mistake, played in the same scene, makes the same run (see `agree`, `same_commands`).
SAME_GROUPS = (
    # A yaw of 0 or 180 deg for ever, or within 0 to 6.3 and 356.9 to 360: the error stays about
    # +/-90 deg, so 0.1 * 90 = 9 is cut to 1.5 rad/s, and the turn never ends. A goal of -80 or 440:
    # the heading, 0 to 360, stays 80 deg or more away, 0.1 * 80 = 8 is cut to 1.5 rad/s, and the
    # turn never ends either. No further letter is read. So a first turn over 0 deg to the left is
    # the same with all but goal_not_wrapped_low, and to the right with all but the high one.
    (TURN, 'quaternion_order', 'radians', 'nothing_wrapped', 'goal_not_wrapped_low'),
    (TURN, 'quaternion_order', 'radians', 'nothing_wrapped', 'goal_not_wrapped_high'),
    # If only letters l, or only r, cross 0 deg, the other half of the wrap is never needed.
    (TURN, 'error_not_wrapped', 'error_not_wrapped_low'),
    (TURN, 'error_not_wrapped', 'error_not_wrapped_high'),
    # Where the robot stands still, its local place is right, and so is its first turn to the goal.
    # Then it drives straight on. If the displacement is rotated by an angle that is wrong by a, the
    # nearest it comes to the goal by its own count is 0.86 sin(a) m, or 0.86 m if a is above 90
    # deg. That is below 0.15 m only if a is below 10 deg. Else it drives on for ever, with all.
    (DRIVE, 'inverse_missing', 'not_rotated', 'imu_rotates'),
)
SAME = {(lab, frozenset(pair)) for lab, *group in SAME_GROUPS
        for pair in itertools.combinations(group, 2)}


@dataclass(frozen=True)
class Node:
    """A text; `right` is the same without its mistake, and the same text if it has none."""

    lab: str
    mistake: str            # identifier, '' or UNKNOWN
    words: str              # what it does wrongly
    text: str
    right: str
    zero: bool = True       # does its scene declare (0, 0, 0) only?
    constants: Edits = ()   # its own ones
    parts: Tuple[str, ...] = ()     # the known mistakes of which an unknown one is made


def edited(text: str, edits: Edits) -> str:
    """Returns `text` with the replacements; ``ValueError`` if an old text is not there."""
    for old, new in edits:
        if old not in text:
            raise ValueError('not in the text: {!r}'.format(old))
        text = text.replace(old, new)
    return text


# The turn -----------------------------------------------------------------------------------------

GOAL_LOW = '''            if self.goal_yaw < 0:
                self.goal_yaw = self.goal_yaw + 360
            elif self.goal_yaw > 360:
'''
NO_GOAL_LOW = '            if self.goal_yaw > 360:\n'
GOAL_HIGH = '''            elif self.goal_yaw > 360:
                self.goal_yaw = self.goal_yaw - 360
'''
GOAL_BOTH = GOAL_LOW + GOAL_HIGH.split('\n', 1)[1]
ERROR_HIGH = '''            if yaw_err > 180:
                yaw_err = yaw_err - 360
            elif yaw_err < -180:
'''
NO_ERROR_HIGH = '            if yaw_err < -180:\n'
ERROR_LOW = '''            elif yaw_err < -180:
                yaw_err = yaw_err + 360
'''
ERROR_BOTH = ERROR_HIGH + ERROR_LOW.split('\n', 1)[1]
POSITIVE = '''            if 0 < ang_z < self.MIN_ANG_Z:
                ang_z = self.MIN_ANG_Z
            elif ang_z > self.MAX_ANG_Z:
                ang_z = self.MAX_ANG_Z
'''
NEGATIVE = '''            elif -self.MIN_ANG_Z < ang_z < 0:
                ang_z = -self.MIN_ANG_Z
            elif ang_z < -self.MAX_ANG_Z:
                ang_z = -self.MAX_ANG_Z
'''
TURN_OVER = '                self.turning = False\n                ang_z = 0\n'
TURN_QUATERNION = '''Quaternion(imu.orientation.w, imu.orientation.x, imu.orientation.y,
                           imu.orientation.z)'''
O_XYZW = 'Quaternion(imu.orientation.x, imu.orientation.y, imu.orientation.z, imu.orientation.w)'
O_WZYX = 'Quaternion(imu.orientation.w, imu.orientation.z, imu.orientation.y, imu.orientation.x)'
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
TURN_MISTAKES: Dict[str, List[Tuple[str, Edits, Edits]]] = {
    'goal_not_wrapped_low': [
        ('no branch for a goal below 0', [(GOAL_LOW, NO_GOAL_LOW)], BY_LETTER),
        ('goal below 0: minus 360', [('self.goal_yaw + 360', 'self.goal_yaw - 360')], BY_LETTER),
        ('wraps only goals below -360', [('self.goal_yaw < 0', 'self.goal_yaw < -360')],
         BY_LETTER)],
    'goal_not_wrapped_high': [
        ('no branch for a goal above 360', [(GOAL_HIGH, '')], BY_LETTER),
        ('goal above 360: plus 360', [('self.goal_yaw - 360', 'self.goal_yaw + 360')], BY_LETTER),
        ('wraps only goals above 720', [('self.goal_yaw > 360', 'self.goal_yaw > 720')],
         BY_LETTER)],
    'error_not_wrapped_low': [
        ('no branch for an error below -180', [(ERROR_LOW, '')], []),
        ('wraps only errors below -360', [('yaw_err < -180', 'yaw_err < -360')], []),
        ('error below -180: if inside of the branch above 180',
         [('            elif yaw_err < -180:\n                yaw_err = yaw_err + 360',
           '                if yaw_err < -180:\n                    yaw_err = yaw_err + 360')], []),
        ('min() on one side', [(ERROR_BOTH, '            yaw_err = yaw_err - 360 * '
                                '(yaw_err > 180)\n')], [])],
    'error_not_wrapped_high': [
        ('no branch for an error above 180', [(ERROR_HIGH, NO_ERROR_HIGH)], []),
        ('wraps only errors above 360', [('yaw_err > 180', 'yaw_err > 360')], []),
        ('a while on one side', [(ERROR_BOTH, '            while yaw_err < -180:\n'
                                  '                yaw_err += 360\n')], [])],
    'error_not_wrapped': [
        ('error as it is', [(ERROR_BOTH, '')], []),
        ('fmod by 360 changes nothing', [MATH, (
            ERROR_BOTH, '            yaw_err = math.fmod(yaw_err, 360)\n')], []),
        ('wraps only beyond 360', [('yaw_err > 180', 'yaw_err > 360'),
                                   ('yaw_err < -180', 'yaw_err < -360')], []),
        ('goal by %, error as it is', [
            (ERROR_BOTH, ''), (GOAL_BOTH, '            self.goal_yaw %= 360\n')], [])],
    'nothing_wrapped': [
        ('goal and error as they are', [(GOAL_BOTH, ''), (ERROR_BOTH, '')], []),
        ('goal and error by fmod(720)', [MATH, (GOAL_BOTH, ''), (
            ERROR_BOTH, '            yaw_err = math.fmod(yaw_err, 720)\n')], []),
        ('heading -180 to 180, goal and error as they are', [
            (CONVERT, 'return yaw'), (GOAL_BOTH, ''), (ERROR_BOTH, '')], [])],
    'no_negative_clamp': [
        ('no branches for negative speeds', [(NEGATIVE, '')], []),
        ('min() for the upper limit only', [
            (POSITIVE + NEGATIVE, '            ang_z = min(ang_z, self.MAX_ANG_Z)\n')], []),
        ('pseudo-code as it stands: a negative speed becomes +MIN', [
            (NEGATIVE, ''), ('0 < ang_z < self.MIN_ANG_Z', 'ang_z < self.MIN_ANG_Z')], [])],
    'quaternion_order': [
        ('Quaternion(x, y, z, w)', [(TURN_QUATERNION, O_XYZW)], []),
        ('Quaternion(w, z, y, x)', [(TURN_QUATERNION, O_WZYX)], []),
        ('roll for yaw', [('to_euler(degrees=True)[2]', 'to_euler(degrees=True)[0]')], [])],
    'radians': [
        ('to_euler() gives radians', [('to_euler(degrees=True)', 'to_euler()')], []),
        ('math.radians of the heading', [MATH, (
            'self.curr_yaw = self.convert_yaw(yaw)',
            'self.curr_yaw = math.radians(self.convert_yaw(yaw))')], []),
        ('goal = heading +/- pi / 2', [MATH, ('self.curr_yaw + 90', 'self.curr_yaw + math.pi / 2'),
                                       ('self.curr_yaw - 90', 'self.curr_yaw - math.pi / 2')], [])],
    'no_stop': [
        ('the last speed is sent at the end', [
            (TURN_OVER, '                self.turning = False\n')], []),
        ('nothing is sent at the end',
         [(TURN_OVER, '                self.turning = False\n                return\n')], []),
        ('the speed is set to 0 after it was sent', [
            (TURN_OVER, '                self.turning = False\n'),
            ('        self.cmd_pub.publish(self.cmd)\n\n    def shutdownhook',
             '        self.cmd_pub.publish(self.cmd)\n        self.cmd.angular.z = 0\n\n'
             '    def shutdownhook')], [])],
}

#: (words, edits, the known mistakes that it is made of).
TURN_UNKNOWN: List[Tuple[Any, ...]] = [
    ('gain of the wrong sign', [('K_HDG = 0.1', 'K_HDG = -0.1')]),
    ('abs() of the error', [('ang_z = self.K_HDG * yaw_err', 'ang_z = self.K_HDG * abs(yaw_err)')]),
    ('tolerance 45 deg', [('HDG_TOL = 10', 'HDG_TOL = 45')]),
    ('turns 45 deg', [('curr_yaw + 90', 'curr_yaw + 45'), ('curr_yaw - 90', 'curr_yaw - 45')]),
    ('l and r exchanged', [('curr_yaw + 90', 'curr_yaw + 0 - 90.0'),
                           ('curr_yaw - 90\n', 'curr_yaw + 90\n')]),
    ('no upper limit', [('MAX_ANG_Z = 1.5', 'MAX_ANG_Z = 100')]),
    ('drives forward in the turn', [
        ('self.cmd.linear.x = 0\n        self.cmd.angular.z = ang_z',
         'self.cmd.linear.x = 0.1\n        self.cmd.angular.z = ang_z')]),
    ('limit 0.3 rad/s', [('MAX_ANG_Z = 1.5', 'MAX_ANG_Z = 0.3'), ('MIN_ANG_Z = 0.5',
                                                                  'MIN_ANG_Z = 0.2')]),
    ('goal is 90 or 270 deg, wherever it stands', [('self.curr_yaw + 90', '90'),
                                                   ('self.curr_yaw - 90', '270')]),
    ('turns 120 deg', [('curr_yaw + 90', 'curr_yaw + 120'), ('curr_yaw - 90', 'curr_yaw - 120')]),
    ('error not wrapped, and no stop', [(ERROR_BOTH, ''), ('                ang_z = 0\n', '')],
     'error_not_wrapped', 'no_stop'),
    ('no limit on the right, and no stop', [(NEGATIVE, ''), ('                ang_z = 0\n', '')],
     'no_negative_clamp', 'no_stop'),
    ('error always positive, by %', [(ERROR_BOTH, '            yaw_err = yaw_err % 360\n')]),
]

# The drive ----------------------------------------------------------------------------------------

NONES = '''        self.initial_global_x = None
        self.initial_global_y = None
        self.initial_global_yaw = None
        self.state'''
STATE = '        self.state'
DRIVE_COS = 'cos, sin = math.cos(self.initial_odom_yaw), math.sin(self.initial_odom_yaw)'
LOCAL_X, LOCAL_Y = 'self.local_x = cos * dx + sin * dy', 'self.local_y = -sin * dx + cos * dy'
LOCAL_YAW = 'self.normalize_angle(self.global_yaw - self.initial_global_yaw)'
TAKE_YAW = 'self.initial_odom_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]'
SET_YAW = 'self.local_yaw = self.normalize_angle('
ODOM_END = '\n    def ctrl_relinq_callback'
IMU_YAW = 'self.global_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]'
WRAP = 'return math.atan2(math.sin(angle), math.cos(angle))'
BEARING = 'self.normalize_angle(math.atan2(dy, dx) - self.local_yaw)'
FINAL = 'self.normalize_angle(self.goal_yaw - self.local_yaw)'
FINAL_SPEED = 'cmd.angular.z = 0.5 * yaw_error'
AT_GOAL = "                rospy.loginfo('Goal reached!')\n"
FORWARD = 'cmd.linear.x = 0.15'
PLACE_NONE = '        self.initial_global_x = None\n        self.initial_global_y = None\n'
YAW_NONE = '        self.initial_global_yaw = None\n'
STATE_END = "        elif self.state == 'GOAL_REACHED':\n            return\n"
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
#: Some students keep the yaw's reference by itself.
YAW_APART = [('            ' + TAKE_YAW + '\n', '            if self.initial_odom_yaw is None:\n'
              '                ' + TAKE_YAW + '\n')]

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
#: {mistake: list of (words, edits, edits that its right text has as well)}.
DRIVE_MISTAKES: Dict[str, List[Tuple[str, Edits, Edits]]] = {
    'inverse_missing': [
        ('R for its inverse', [(LOCAL_X, 'self.local_x = cos * dx - sin * dy'),
                               (LOCAL_Y, 'self.local_y = sin * dx + cos * dy')], []),
        ('the inverse of minus the yaw', [(DRIVE_COS, 'cos, sin = math.cos(-self.initial_odom_yaw),'
                                           ' math.sin(-self.initial_odom_yaw)')], []),
        ('R @ d by numpy', [NUMPY, (
            LOCAL_X, 'R = np.array([[cos, -sin], [sin, cos]])\n        '
            'self.local_x, self.local_y = R @ np.array([dx, dy])'), (LOCAL_Y, 'pass')], [])],
    'not_rotated': [
        ('local = displacement', [(LOCAL_X, 'self.local_x = dx'), (LOCAL_Y, 'self.local_y = dy')],
         []),
        ('rotated by 0', [(DRIVE_COS, 'cos, sin = 1.0, 0.0')], []),
        ("rotated by a yaw that is always 0", [
            (DRIVE_COS, 'yaw = 0.0\n        cos, sin = math.cos(yaw), math.sin(yaw)')], [])],
    'imu_rotates': [
        ("the IMU's first yaw rotates", [
            (DRIVE_COS, 'if self.initial_global_yaw is None:\n            return\n        '
             'cos, sin = math.cos(self.initial_global_yaw), math.sin(self.initial_global_yaw)')],
         []),
        ("the IMU's yaw at the first odometry rotates", [
            (TAKE_YAW, 'self.initial_odom_yaw = self.global_yaw')], []),
        ("IMU's yaw minus local yaw rotates", [
            (DRIVE_COS, 'yaw = self.initial_global_yaw or 0.0\n        '
             'cos, sin = math.cos(yaw), math.sin(yaw)')], [])],
    'reference_kept': [
        ('no reference is forgotten', [(NONES, STATE)], []),
        ('forgets variables of other names', [(NONES, NONES.replace('initial_global', 'initial'))],
         []),
        ('forgets local variables', [(NONES, NONES.replace('self.initial', 'initial'))], [])],
    'yaw_kept': [
        ("the IMU's reference is kept", [(NONES, PLACE_NONE + STATE)], []),
        ("the yaws' references are kept", [(NONES, PLACE_NONE + STATE), *YAW_APART], []),
        ("the IMU's reference is assigned to a local name", [
            (NONES, PLACE_NONE + '        initial_global_yaw = None\n' + STATE)], [])],
    'place_kept': [
        ("the odometry's references are kept", [(NONES, YAW_NONE + STATE)], []),
        ("only x and y are kept", [
            (NONES, '        self.initial_odom_yaw = None\n        self.initial_global_yaw = None\n'
             + STATE),
            ('        if self.initial_global_x is None:\n            self.initial_global_x',
             '        if self.initial_odom_yaw is None:\n            ' + TAKE_YAW + '\n'
             '        if self.initial_global_x is None:\n            self.initial_global_x')], []),
        ("x and y are forgotten under other names", [
            (NONES, PLACE_NONE.replace('initial_global', 'initial') + YAW_NONE + STATE)], [])],
    'declared_lost': [
        ("the handout's own: the next sample overwrites", [
            ('self.start_x, self.start_y = self.local_x, self.local_y', 'pass'),
            ('self.start_yaw = self.local_yaw', 'pass')], HONOURING),
        ('the start is always 0', [
            ('self.start_x, self.start_y = self.local_x, self.local_y', 'self.start_x = '
             'self.start_y = 0.0'), ('self.start_yaw = self.local_yaw', 'self.start_yaw = 0.0')],
         HONOURING),
        ('the start is kept in local names', [
            ('self.start_x, self.start_y = self', 'start_x, start_y = self'),
            ('self.start_yaw = self.local_yaw', 'start_yaw = self.local_yaw')], HONOURING)],
    'no_local_frame': [
        ('local pose = odometry', [
            (ODOM_END, '        self.local_x, self.local_y = self.global_x, self.global_y\n        '
             'self.local_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]\n' + ODOM_END),
            (SET_YAW, SET_YAW.replace('local_yaw', 'unused'))], []),
        ("control_loop takes the odometry's pose", [
            ('self.goal_x - self.local_x', 'self.goal_x - self.global_x'),
            ('self.goal_y - self.local_y', 'self.goal_y - self.global_y'),
            (BEARING, BEARING.replace('local', 'odom')), (FINAL, FINAL.replace('local', 'odom')),
            ('        self.global_x = msg', '        self.odom_yaw = Quaternion(q.w, q.x, q.y, q.z)'
             '.to_euler()[2]\n        self.global_x = msg')], []),
        ("the odometry's place, the IMU's heading", [
            (ODOM_END, '        self.local_x, self.local_y = self.global_x, self.global_y\n'
             + ODOM_END),
            (SET_YAW, 'self.local_yaw = self.global_yaw\n        ' + SET_YAW.replace(
                'local_yaw', 'unused'))], [])],
    'error_not_wrapped': [
        ('normalize_angle does nothing', [(WRAP, 'return angle')], []),
        ('fmod by 2 pi, which keeps -2 pi to 2 pi', [
            (WRAP, 'return math.fmod(angle, 2 * math.pi)')], []),
        ('the two errors are not wrapped', [(BEARING, BEARING[len('self.normalize_angle'):]),
                                            (FINAL, FINAL[len('self.normalize_angle'):])],
         HONOURING),
        ('the yaw is not wrapped, nor the errors', [
            ('self.normalize_angle(', '(')], [])],
    'quaternion_order': [
        ('Quaternion(x, y, z, w) of the IMU', [(IMU_YAW, IMU_YAW.replace(
            'Quaternion(q.w, q.x, q.y, q.z)', XYZW))], []),
        ('Quaternion(w, z, y, x) of the IMU', [(IMU_YAW, IMU_YAW.replace(
            'q.x, q.y, q.z', 'q.z, q.y, q.x'))], []),
        ('Quaternion(x, y, z, w) of IMU and odometry', [
            (IMU_YAW, IMU_YAW.replace('Quaternion(q.w, q.x, q.y, q.z)', XYZW)),
            (TAKE_YAW, TAKE_YAW.replace('Quaternion(q.w, q.x, q.y, q.z)', XYZW))], [])],
    'degrees': [
        ("the IMU's yaw in degrees", [(IMU_YAW, IMU_YAW.replace('to_euler()',
                                                                'to_euler(degrees=True)'))], []),
        ('the local yaw in degrees', [
            (SET_YAW, SET_YAW.replace('= ', '= math.degrees(1.0) * '))], []),
        ('both yaws in degrees', [
            (IMU_YAW, IMU_YAW.replace('to_euler()', 'to_euler(degrees=True)')),
            (TAKE_YAW, TAKE_YAW.replace('to_euler()', 'to_euler(degrees=True)'))], [])],
    'no_stop': [
        ('nothing is sent at the end of a turn at 0.4 rad/s', [
            (AT_GOAL, AT_GOAL + '                return\n')], CONSTANT_SPEED),
        ('the last speed is sent at the end', [
            (AT_GOAL, AT_GOAL + '                cmd.angular.z = math.copysign(0.4, yaw_error)\n')],
         CONSTANT_SPEED),
        ('the last speed is sent for ever', [
            (STATE_END, STATE_END.replace('return', 'cmd = self.last')),
            (FINAL_SPEED, FINAL_SPEED + '\n                self.last = cmd')], [])],
}

DRIVE_UNKNOWN: List[Tuple[Any, ...]] = [
    ('x and y of the goal exchanged', [('self.goal_x - ', 'self.goal_y + 0 - '),
                                       ('dy = self.goal_y - ', 'dy = self.goal_x - ')]),
    ("sign of the goal's y", [('self.goal_y = 0.61', 'self.goal_y = -0.61')]),
    ("sign of the goal's x", [('self.goal_x = -0.61', 'self.goal_x = 0.61')]),
    ('atan2(dx, dy)', [('math.atan2(dy, dx)', 'math.atan2(dx, dy)')]),
    ('gain of the first turn of the wrong sign', [('0.3 * yaw_error', '-0.3 * yaw_error')]),
    ('gain of the final turn of the wrong sign', [('0.5 * yaw_error', '-0.5 * yaw_error')]),
    ('abs() of the final error', [('0.5 * yaw_error', '0.5 * abs(yaw_error)')]),
    ('drives backwards', [(FORWARD, 'cmd.linear.x = -0.15')]),
    ('tolerance 0.5 m', [('distance > 0.15', 'distance > 0.5')]),
    ('tolerance 45 deg', [('abs(yaw_error) > 0.05', 'abs(yaw_error) > 0.785')]),
    ('final heading 90 deg', [('self.goal_yaw = 0.0', 'self.goal_yaw = math.pi / 2')]),
    ('stops after MOVE_FORWARD', [
        ("self.state = 'ROTATE_TO_FINAL'", "self.state = 'GOAL_REACHED'")]),
    ('does not turn to the goal', [("self.state = 'ROTATE_TO_GOAL'", "self.state = 'MOVE_FORWARD'"),
                                   ('distance > 0.15', 'self.local_x > -0.61 + 0.15')]),
    ('drives forward in the turn', [('cmd.angular.z = 0.3 * yaw_error',
                                     'cmd.angular.z = 0.3 * yaw_error\n                '
                                     'cmd.linear.x = 0.05')]),
    ('goal 0.8 m', [('self.goal_x = -0.61', 'self.goal_x = -0.8'),
                    ('self.goal_y = 0.61', 'self.goal_y = 0.8')]),
    ('displacement plus the start', [('dx = self.global_x - ', 'dx = self.global_x + ')]),
    ('not rotated, and the yaw is kept', [(DRIVE_COS, 'cos, sin = 1.0, 0.0'),
                                          (NONES, PLACE_NONE + STATE)],
     'not_rotated', 'yaw_kept'),
    ('R for its inverse, and the place is kept', [
        (LOCAL_X, 'self.local_x = cos * dx - sin * dy'), (NONES, YAW_NONE + STATE),
        (LOCAL_Y, 'self.local_y = sin * dx + cos * dy')], 'inverse_missing', 'place_kept'),
    ('the IMU rotates, and errors are not wrapped', [
        (TAKE_YAW, 'self.initial_odom_yaw = self.global_yaw'), (WRAP, 'return angle')],
     'imu_rotates', 'error_not_wrapped'),
    ('y mirrored', [(LOCAL_Y, 'self.local_y = sin * dx - cos * dy')]),
]

# The gamepad --------------------------------------------------------------------------------------

RESET_BUTTON = 'if msg.buttons[2]'
PAD_MISTAKES: Dict[str, List[Tuple[str, Edits, Edits]]] = {
    'wrong_button': [('resets by button {} ({})'.format(number, name), [
        (RESET_BUTTON, 'if msg.buttons[{}]'.format(number))], [])
        for number, name in ((0, 'A'), (1, 'B'), (3, 'X'))],
    'two_senders': [
        ('sends always', [('        if self.has_control:\n', '        if True:\n')], []),
        ('does not note that it gave up control', [
            ('self.has_control = False\n            self.ctrl',
             'has_control = False\n            self.ctrl')], []),
        ('sends while a stick rests, too', [
            ('if self.has_control:\n', 'if self.has_control or not msg.axes[1]:\n')], [])],
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
    """All known mistakes: (lab, identifier)."""
    return [(lab, mistake) for lab, mistakes in MISTAKES.items() for mistake in mistakes]


def right_node(lab: str, source: random.Random) -> Node:
    """A right node: the given one, or a varied one."""
    zero = lab != DRIVE or source.random() < 0.5
    style = source.choice(STYLES[lab])
    honours = lab == DRIVE and (not zero or source.random() < 0.5)
    if honours and any(LOCAL_Y in old for old, _ in style):
        style = []
    edits = [*(HONOURING if honours else []), *style]
    text = edited(text_of(FILES[lab]), edits)
    constants = CONSTANTS[lab](source) if source.random() < 0.7 else ()
    text = _with_constants(text, constants)
    return Node(lab, '', 'right', text, text, zero, constants)


def mistaken_nodes(lab: str, mistake: str, source: random.Random) -> List[Node]:
    """One node for each writing of the mistake."""
    return [_mistaken(lab, mistake, words, edits, base, source)
            for words, edits, base in MISTAKES[lab][mistake]]


def nodes_like(node: Node, mistake: str) -> List[Node]:
    """The nodes that have another `mistake`, with the constants of `node`, for its scene."""
    nodes = []
    for words, edits, base in MISTAKES[node.lab].get(mistake, ()):
        if base is not HONOURING and not node.zero:
            base = [*HONOURING, *base]
        text = _with_constants(edited(edited(text_of(FILES[node.lab]), base), edits),
                               node.constants)
        nodes.append(Node(node.lab, mistake, words, text, text, node.zero, node.constants))
    return nodes


def unknown_node(source: random.Random) -> Node:
    """A node with a mistake, or two, that is none of the known ones."""
    lab, (words, edits, *parts) = source.choice(
        [(TURN, item) for item in TURN_UNKNOWN] + [(DRIVE, item) for item in DRIVE_UNKNOWN])
    return replace(_mistaken(lab, UNKNOWN, words, edits, [], source), parts=tuple(parts))


def _mistaken(lab, mistake, words, edits, base, source):
    zero = lab != DRIVE or base is not HONOURING and source.random() < 0.5
    if lab == DRIVE and base is not HONOURING and not zero:
        base = [*HONOURING, *base]
    right = edited(text_of(FILES[lab]), base)
    text = edited(right, edits)
    constants = CONSTANTS[lab](source) if source.random() < OWN_CONSTANTS else ()
    return Node(lab, mistake, words, _with_constants(text, constants),
                _with_constants(right, constants), zero, constants)


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


def same_commands(one: RunData, other: RunData) -> bool:
    """Are the commands in force the same nearly all the time?"""
    if not len(one.commands) or not len(other.commands):
        return len(one.commands) == len(other.commands)
    at = np.arange(0.0, min(one.duration, other.duration), 0.05)
    speeds = []
    for run in (one, other):
        last = np.searchsorted(run.commands.time, at, side='right') - 1
        age = at - run.commands.time[last.clip(0)]
        speeds.append([np.where((last >= 0) & (age < COMMAND_TIMEOUT), values[last.clip(0)], 0.0)
                       for values in (run.commands.linear, run.commands.angular)])
    apart = np.abs(np.array(speeds[0]) - np.array(speeds[1])).max(axis=0)
    return bool((apart > 0.05).mean() < 0.05)
