#!/usr/bin/env python3
"""Is each mistake named? Plain nodes with one or two small changes are marked; the table shows what
the check says first, and where it sends the student.

    python3 test/benchmark/wrong_nodes.py                   all of them; 25 minutes on two cores
    python3 test/benchmark/wrong_nodes.py turn abs spin     those with one of these words in their name
    python3 test/benchmark/wrong_nodes.py --again FOLDER    the sentences anew, from the observations

A mistake is named if its words stand in the first two sentences: the first criterion that is not
met, and the hint. A right node must not lose a point.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NODES = {'imu': 'imu_sub.py', 'turn': 'plain_turtlebot_controller.py',
         'move2goal': 'plain_move2goal_tf.py', 'gamepad': 'plain_gamepad.py'}
PARTS = {'imu': 'heading', 'turn': 'turns', 'move2goal': 'drive,reset',
         'gamepad': 'sticks,buttons,no service'}
#: A right node has these words.
RIGHT = ''

TURNS = '        elif self.turning:\n            yaw_err'
IMU_END = '            self.curr_yaw = self.convert_yaw(yaw)'
LEFT, TO_RIGHT = 'self.goal_yaw = self.curr_yaw + 90', 'self.goal_yaw = self.curr_yaw - 90'
NO_GOAL_WRAP = [('if self.goal_yaw < 0:', 'if False:'), ('elif self.goal_yaw > 360:', 'elif False:')]
NO_ERROR_WRAP = [('if yaw_err > 180:', 'if False:'), ('elif yaw_err < -180:', 'elif False:')]
ORDER = ('imu.orientation.w, imu.orientation.x, imu.orientation.y,\n'
         '                           imu.orientation.z', 'imu.orientation.x, imu.orientation.y, '
         'imu.orientation.z, imu.orientation.w')
SIGN = ('yaw_err = self.goal_yaw - self.curr_yaw', 'yaw_err = self.curr_yaw - self.goal_yaw')
NO_ABS = ('if abs(yaw_err) < self.HDG_TOL', 'if yaw_err < self.HDG_TOL')
RADIANS = ('to_euler(degrees=True)', 'to_euler()')
MATH = ('import rospy\nfrom', 'import math\nimport time\nimport rospy\nfrom')
SPIN, INIT = '    rospy.spin()\n', "    rospy.init_node("

#: lab, name, changes, words (a regular expression) in the first two sentences, and where.
TABLE = [
    # -- the exercise
    ('imu', 'radians', [RADIANS], 'radians', 'step 3'),
    ('imu', 'roll', [('yaw = e[2]', 'yaw = e[0]')], 'roll', 'step 3'),
    ('imu', 'order', [ORDER], 'order of the four', 'step 3'),
    ('imu', 'not converted', [('return 360 + yaw if yaw < 0 else yaw', 'return yaw')], 'negative', 'step 3'),
    ('imu', 'sleeps', [('            self.printed_at = rospy', '            rospy.sleep(1.0)\n'
                        '            self.printed_at = rospy')], 'sleep', 'step 3'),
    ('imu', 'no spin', [(SPIN, '')], 'nothing kept the node running', 'step 2'),
    ('imu', 'no init_node', [(INIT, "    str(")], 'init_node', 'step 2'),
    ('imu', 'topic', [("Subscriber('imu'", "Subscriber('imu_data'")], '/imu_data, which nobody publishes', 'step 2'),
    ('imu', 'odom', [("Subscriber('imu', Imu", "Subscriber('odom', Odometry"), (
        'from sensor_msgs.msg import Imu', 'from nav_msgs.msg import Odometry')], 'listened to /odom', 'step 2'),
    ('imu', 'type', [("Subscriber('imu', Imu", "Subscriber('imu', Float32")], 'type', 'step 3'),
    ('imu', 'no self', [('def callback_imu(self, imu)', 'def callback_imu(imu)')], 'TypeError.*callback_imu', 'step 3'),
    ('imu', 'other words', [('"Current heading is %f degrees."', '"Heading: %f"')], "printed 'Heading: ", 'step 3'),
    ('imu', 'clockwise', [('return 360 + yaw if yaw < 0 else yaw', 'return -yaw if yaw < 0 else 360 - yaw')],
     'counts to the right', 'step 3'),
    ('imu', 'import', [('from squaternion import Quaternion', 'from squaternion import quaternion')],
     'ImportError.*line', 'step 2'),
    # -- the lab
    ('turn', 'raw_input', [('= input(', '= raw_input(')], "NameError: name 'raw_input'.*line", 'step'),
    ('turn', 'cmd_vel_mux', [("Publisher('cmd_vel'", "Publisher('cmd_vel_mux'")], '/cmd_vel_mux', 'step'),
    ('turn', 'no publish', [('        self.cmd.angular.z = ang_z\n        self.cmd_pub.publish(self.cmd)\n',
                            '        self.cmd.angular.z = ang_z\n')], 'nothing came on cmd_vel', 'step 5'),
    ('turn', 'angle in radians', [(LEFT, LEFT.replace('90', '1.57')), (TO_RIGHT, TO_RIGHT.replace('90', '1.57'))],
     'within the tolerance', 'step 5'),
    ('turn', 'timer', [('rospy.Duration(.1)', 'rospy.Duration(10)')], 'every 10 s', 'step 5'),
    ('turn', 'sign of the error', [SIGN], 'away from the goal', 'step 5'),
    ('turn', 'sleeps in the turn', [(TURNS, TURNS.replace('yaw_err', 'rospy.sleep(1.0)\n            yaw_err'))],
     'sleep', 'step 5'),
    ('turn', 'sleeps in callback_imu', [(IMU_END, '            rospy.sleep(0.5)\n' + IMU_END)], 'sleep', 'step 4'),
    ('turn', 'no abs', [NO_ABS], 'abs', 'step 6'),
    ('turn', 'turning never False', [('                self.turning = False\n                ang_z', '                ang_z')],
     'turning', 'step 5'),
    ('turn', 'goal without self', [(LEFT, LEFT[5:]), (TO_RIGHT, TO_RIGHT[5:])], 'self\\.goal_yaw', 'step 5'),
    ('turn', 'heading without self', [(IMU_END, IMU_END.replace('self.curr_yaw', 'curr_yaw'))],
     'self.curr_yaw', 'step 4'),
    ('turn', 'degrees twice', [MATH, ('yaw = q.to_euler(degrees=True)[2]',
                                      'yaw = math.degrees(q.to_euler(degrees=True)[2])')], 'degrees', 'step 4'),
    ('turn', 'heading in radians', [RADIANS], 'radians', 'step 4'),
    ('turn', 'roll', [('degrees=True)[2]', 'degrees=True)[0]')], 'third Euler', 'step 4'),
    ('turn', 'order', [ORDER], 'order of the four', 'step 4'),
    ('turn', 'error not wrapped', NO_ERROR_WRAP, 'shorter', 'step 5'),
    ('turn', 'nothing wrapped', NO_GOAL_WRAP + NO_ERROR_WRAP, 'ever come near it', 'step'),
    ('turn', 'swapped', [(LEFT, '#L'), (TO_RIGHT, LEFT), ('#L', TO_RIGHT)], 'right', 'step 5'),
    ('turn', 'no limit', [('elif ang_z > self.MAX_ANG_Z:', 'elif False:'), ('elif ang_z < -self.MAX_ANG_Z:', 'elif False:')],
     'up to 9.0 rad/s to the left and 9.0', 'step 5'),
    ('turn', 'no limit to the right', [('elif ang_z < -self.MAX_ANG_Z:', 'elif False:')], 'to the right', 'step 6'),
    ('turn', 'no zero', [('                self.turning = False\n                ang_z = 0\n', '                self.turning = False\n'
                          '                return\n')], 'zero|last one', 'step 5'),
    ('turn', 'no spin', [(SPIN, '')], 'nothing kept the node running', 'step'),
    ('turn', 'topic', [("Subscriber('imu'", "Subscriber('imu_data'")], '/imu_data, which nobody publishes', 'step'),
    ('turn', 'constant without self', [('ang_z = self.K_HDG', 'ang_z = K_HDG')], "NameError: name 'K_HDG'.*line", 'step'),
    ('turn', 'drives forward', [('        self.cmd.linear.x = 0\n        self.cmd.angular.z = ang_z',
                                '        self.cmd.linear.x = 0.1\n        self.cmd.angular.z = ang_z')],
     'm/s forward while turning', 'step 5'),
    ('turn', 'tolerance', [('HDG_TOL = 10', 'HDG_TOL = 30')], 'degrees short of the goal', 'step 5'),
    ('turn', 'linear', [('self.cmd.linear.x = 0\n        self.cmd.angular.z = ang_z',
                         'self.cmd.linear.x = ang_z\n        self.cmd.angular.z = 0')], 'linear', 'step 5'),
    ('turn', 'int', [('= input("Input l or r to turn 90 deg")', '= int(input("Input l or r to turn 90 deg"))')],
     'ValueError.*line', 'step'),
    ('turn', 'syntax', [('if direction == "l":', 'if direction == "l"')], 'SyntaxError.*line', 'step'),
    ('turn', 'says nothing', [('print("Error: valid inputs are l and r")', 'pass')], 'did not name both', 'step 6'),
    ('turn', 'nan', [('ang_z = self.K_HDG * yaw_err', 'ang_z = float("nan")')], 'not finite', 'step 5'),
    ('turn', 'type', [("Publisher('cmd_vel', Twist", "Publisher('cmd_vel', TwistStamped"), (
        'self.cmd = Twist()', 'self.cmd = TwistStamped()'), ('import Twist\n', 'import Twist, TwistStamped\n'), (
        '        self.cmd.linear.x = 0\n        self.cmd.angular.z = ang_z', '        self.cmd.twist.angular.z = ang_z')],
     'TwistStamped', 'step 5'),
    ('turn', 'order, sign', [ORDER, SIGN], 'curr_yaw|away', 'step'),
    ('turn', 'radians, no abs', [RADIANS, NO_ABS], 'radians', 'step'),
    ('turn', 'no abs, not wrapped', [NO_ABS] + NO_ERROR_WRAP, 'abs|wrap', 'step'),
    ('turn', 'sign, no limit', [SIGN, ('elif ang_z > self.MAX_ANG_Z:', 'elif False:')], 'away', 'step'),
    ('turn', 'swapped, 45', [(LEFT, '#L'), (TO_RIGHT, LEFT), ('#L', TO_RIGHT.replace('90', '45'))], 'to the right', 'step'),
    # -- the drive
    ('move2goal', 'old yaw', [('        self.initial_global_yaw = None\n        self.state', '        self.state')],
     'local_yaw', '3. The reset'),
    ('move2goal', 'global yaw', [('math.atan2(dy, dx) - self.local_yaw', 'math.atan2(dy, dx) - self.global_yaw'), (
        'self.local_yaw = self.normalize_angle(', 'self.global_yaw = global_yaw\n        self.local_yaw = self.normalize_angle('),
        ('        self.has_control = False\n', '        self.has_control = False\n        self.global_yaw = 0.0\n'),
        ('self.goal_yaw - self.local_yaw', 'self.goal_yaw - self.global_yaw')], 'local_yaw', 'The'),
    ('move2goal', 'state not reset', [("        self.state = 'ROTATE_TO_GOAL'\n        rospy.loginfo", '        rospy.loginfo')],
     'state', '3. The reset'),
    ('move2goal', 'sleeps in odom_callback', [('import math\nimport rospy', 'import math\nimport time\nimport rospy'), (
        '        global_x = msg', '        time.sleep(0.3)\n        global_x = msg')], 'sleep', 'pose'),
    ('move2goal', 'not rotated', [('self.local_x = cos * dx + sin * dy', 'self.local_x = dx'), (
        'self.local_y = -sin * dx + cos * dy', 'self.local_y = dy')], 'local_x|rotat', 'pose'),
    ('move2goal', 'no inverse', [('self.local_x = cos * dx + sin * dy', 'self.local_x = cos * dx - sin * dy'), (
        'self.local_y = -sin * dx + cos * dy', 'self.local_y = sin * dx + cos * dy')], 'local_x|rotat', 'pose'),
    ('move2goal', 'degrees', [('self.normalize_angle(global_yaw', 'self.normalize_angle(math.degrees(global_yaw)')], 'yaw', 'pose'),
    ('move2goal', 'not normalized', [('return math.atan2(math.sin(angle), math.cos(angle))', 'return angle')], 'error|angle', ''),
    ('move2goal', 'never gets control', [("Subscriber('ctrl_relinq'", "Subscriber('ctrl_relinquish'")],
     'does not listen to ctrl_relinq', 'four states'),
    ('move2goal', 'control upside down', [('self.has_control = relinq_msg.data', 'self.has_control = not relinq_msg.data')],
     'without having control', 'four states'),
    ('move2goal', 'drives at once', [('self.has_control = False', 'self.has_control = True')], 'without having control', 'four states'),
    ('move2goal', 'no service', [("        self.reset_service = rospy.Service('set_pose', SetInitialPose, self.set_pose_callback)\n", '')],
     'offers no service', '3. The reset'),
    ('move2goal', 'no answer', [('        return SetInitialPoseResponse()\n', '')], 'None|return', '3. The reset'),
    ('move2goal', 'other service', [("Service('set_pose'", "Service('setpose'")], 'setpose', ''),
    ('move2goal', 'sends at the goal', [(" or self.state == 'GOAL_REACHED'", '')], 'went on sending', 'four states'),
    ('move2goal', 'says nothing', [("                rospy.loginfo('Goal reached!')\n", '')], 'printed 0 times', 'four states'),
    ('move2goal', 'atan2', [('math.atan2(dy, dx)', 'math.atan2(dx, dy)')], 'atan2', 'four states'),
    ('move2goal', 'stays in the first state', [("                self.state = 'MOVE_FORWARD'\n", "                pass\n")],
     'never drove forward|state', 'four states'),
    ('move2goal', 'never arrives', [('            if distance > 0.15:', '            if True:')], 'MOVE_FORWARD|drove on', 'four states'),
    ('move2goal', 'attribute', [('distance = math.sqrt(dx ** 2 + dy ** 2)', 'distance = math.hypot(self.dx, dy)')],
     "AttributeError.*'dx'.*line", ''),
    ('move2goal', 'order', [('self.set_pose_callback)\n', 'self.set_pose_callback)\n'), (
        '        q = imu_msg.orientation\n        global_yaw = Quaternion(q.w, q.x, q.y, q.z)',
        '        q = imu_msg.orientation\n        global_yaw = Quaternion(q.x, q.y, q.z, q.w)')], 'yaw', 'pose'),
    ('move2goal', 'no init_node', [(INIT, '    str(')], 'init_node', ''),
    ('move2goal', 'says no pose', [("        rospy.loginfo(f'Local pose set to x={self.local_x}, y={self.local_y}, '\n"
                                   "                      f'yaw={self.local_yaw}.')\n", '')], 'Local pose set to', '3. The reset'),
    # -- the gamepad
    ('gamepad', 'no covariance', [('        request.pose.pose.covariance = [0.1] * 36\n', '')], 'covariance', ''),
    ('gamepad', 'other service', [("ServiceProxy('set_pose'", "ServiceProxy('setpose'")], 'setpose|another name', '4. By thumb'),
    ('gamepad', 'no False', [('            self.ctrl_pub.publish(False)\n', '            self.cmd_pub.publish(Twist())\n')],
     'after B nothing was published on ctrl_relinq', '4. By thumb'),
    ('gamepad', 'no True', [('            self.ctrl_pub.publish(True)\n', '')], 'after A nothing was published', '4. By thumb'),
    ('gamepad', 'drives on', [('        if self.has_control:', '        if True:')], 'while the robot was handed over', '4. By thumb'),
    ('gamepad', 'axes swapped', [('msg.axes[1]', 'msg.axes[#]'), ('msg.axes[3]', 'msg.axes[1]'), ('[#]', '[3]')],
     'm/s', '4. By thumb'),
    ('gamepad', 'sign', [('2.84 * msg.axes[3]', '-2.84 * msg.axes[3]')], 'right stick left it commanded.*-2.84', '4. By thumb'),
    ('gamepad', 'too fast', [('0.22 * msg.axes[1]', 'msg.axes[1]')], '1.00 m/s', '4. By thumb'),
    ('gamepad', 'index', [('msg.axes[3]', 'msg.axes[9]')], 'IndexError.*line', '4. By thumb'),
    ('gamepad', 'no orientation', [('        request.pose.pose.pose.orientation.z = math.sin(theta / 2.0)\n'
                                   '        request.pose.pose.pose.orientation.w = math.cos(theta / 2.0)\n', '')], 'length 1', '4. By thumb'),
    ('gamepad', 'other pose', [('(0.0, 0.0, 0.0)', '(1.0, 0.0, 0.0)')], 'another pose', '4. By thumb'),
    ('gamepad', 'button', [('msg.buttons[2]', 'msg.buttons[5]')], 'no reset service was called', '4. By thumb'),
    ('gamepad', 'topic', [("Publisher('ctrl_relinq'", "Publisher('ctrl_relinquish'")], '/ctrl_relinquish', '4. By thumb'),
    ('gamepad', 'waits for ever', [('wait_for_service(timeout=1.0)', 'wait_for_service()')], 'nothing was printed', '4. By thumb'),
    ('gamepad', 'says nothing', [("rospy.loginfo('Pose reset successfully.')", 'pass')], 'was not printed after Y', '4. By thumb'),
    ('gamepad', 'no queue', [("rospy.Subscriber('joy', Joy", "rospy.Subscriber('/joy_node', Joy")], '/joy_node', '4. By thumb'),
    # -- right nodes that do it in another way
    ('imu', 'as it is', [], RIGHT, ''),
    ('imu', 'modulo', [('return 360 + yaw if yaw < 0 else yaw', 'return yaw % 360')], RIGHT, ''),
    ('turn', 'as it is', [], RIGHT, ''),
    ('turn', 'asks in words', [('"Input l or r to turn 90 deg"', '"left or right? "')], RIGHT, ''),
    ('turn', 'within +-180', [('return 360 + yaw if yaw < 0 else yaw', 'return yaw')] + NO_GOAL_WRAP + [
        ('yaw_err = self.goal_yaw - self.curr_yaw', 'yaw_err = (self.goal_yaw - self.curr_yaw + 180) % 360 - 180')], RIGHT, ''),
    ('turn', 'goal not wrapped', NO_GOAL_WRAP, RIGHT, ''),      # the error is
    ('turn', 'half as fast', [('MAX_ANG_Z = 1.5', 'MAX_ANG_Z = 0.8')], RIGHT, ''),
    ('move2goal', 'as it is', [], RIGHT, ''),
    ('move2goal', 'slower', [('cmd.linear.x = 0.15', 'cmd.linear.x = 0.1')], RIGHT, ''),
    ('gamepad', 'as it is', [], RIGHT, ''),
    ('gamepad', 'latched', [("Publisher('ctrl_relinq', Bool, queue_size=1", "Publisher('ctrl_relinq', Bool, queue_size=1, latch=True")],
     RIGHT, ''),
]


def changed(lab, changes):
    """The text of the lab's plain node with these changes, each of a text that is there."""
    text = (ROOT / 'scripts' / NODES[lab]).read_text(encoding='utf-8')
    for old, new in changes:
        assert old in text, (lab, old)
        text = text.replace(old, new)
    return text.replace('tb3_labs.msg', 'lab2.msg')


def observe(folder, rows, jobs):
    """Mark these nodes; the observations are in `folder`."""
    for lab in NODES:
        mine = [row for row in rows if row[0] == lab]
        for _, name, changes, _, _ in mine:
            place = folder / lab / 'submissions' / name
            place.mkdir(parents=True)
            (place / NODES[lab].replace('plain_', '')).write_text(changed(lab, changes), encoding='utf-8')
        if mine:
            subprocess.run(
                ['rosrun', 'tb3_labs', 'mark.py', str(folder / lab / 'submissions'), '--lab', lab, '-o',
                 str(folder / lab / 'marks'), '--parts', PARTS[lab], '--jobs', str(jobs)],
                check=True, stdout=sys.stderr)


def told(folder, lab, name):
    """(points lost, the first sentence, the hint, all remarks) of the check."""
    from tb3_labs.marking.labs.criteria import Outcome, judge
    from tb3_labs.marking.trial.evidence import remarks_on
    from tb3_labs.marking.shown_run import hint_in_a_line
    from tb3_labs.marking.marks import LABS, Marks, points_of, read_points
    from tb3_labs.marking.trial.observation import Observation
    seen = Observation.from_json((folder / lab / 'marks' / 'logs' / (name + '.json')).read_text())
    marks = Marks(name, seen.node, judge(LABS[lab].criteria, seen, points_of(lab, read_points(None)),
                                         PARTS[lab].split(',')), observation=seen)
    missed = [verdict.sentence for verdict in marks.graded if verdict.outcome is not Outcome.MET]
    return marks.worth - marks.points, (missed or [''])[0], hint_in_a_line(marks), remarks_on(seen)


def main():
    parser = argparse.ArgumentParser(description='How many mistakes does the check name?')
    parser.add_argument('words', nargs='*', help='only nodes with one of these words in lab or name')
    parser.add_argument('--jobs', type=int, default=2, help='nodes at a time (2)')
    parser.add_argument('--again', type=Path, help='a folder of observations')
    given = parser.parse_args()
    rows = [row for row in TABLE if not given.words or any(
        word in row[0] + ' ' + row[1] for word in given.words)]
    folder = given.again or Path(tempfile.mkdtemp(prefix='wrong_nodes_'))
    if not given.again:
        observe(folder, rows, given.jobs)
    named, wrong, accused = 0, 0, 0
    for lab, name, _, words, place in rows:
        if not os.path.exists(str(folder / lab / 'marks' / 'logs' / (name + '.json'))):
            print('not observed:', lab, name)
            continue
        lost, first, hint, remarks = told(folder, lab, name)
        said = '\n      '.join(filter(None, [first, hint] + ([] if lost else remarks)))
        if words == RIGHT:
            accused += lost > 0
            found = not lost
        else:
            wrong += 1
            found = bool(re.search(words, said, re.DOTALL)) and place in said
            named += found
        print('{} {}: {}, {:g} points lost\n      {}'.format('ok  ' if found else 'MISS', lab, name, lost, said))
    print('{} of {} mistakes are named; {} right nodes are accused. The observations: {}'.format(
        named, wrong, accused, folder))


if __name__ == '__main__':
    main()
