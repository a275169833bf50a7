"""A stop stays a stop on real nodes, with hands, pads, sleeping processes and closed terminals.

In each test the robot stands although a sender repeated, woke up or reconnected, and drives again when a person asks.
"""
import itertools
import os
import pty
import select
import signal
import subprocess
import tempfile
import termios

import rospy
from actionlib_msgs.msg import GoalID
from move_base_msgs.msg import MoveBaseActionGoal
from std_msgs.msg import Bool, Float64, String

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.supervision.timeouts import MAX_REPEAT_GAP, MAX_TRANSIT_TIME

from masters import process_of
from drive_case import DriveCase
from node_case import STARTING, ZERO, NodeProgram, TestProgram, path_of
from thumb import A, B, Thumb, WithThumb

#: Time from a stop to the last command that moves the robot [s].
PROMPT = 0.25
#: An event did not set a robot in motion that stands this long after it [s]: a process that wakes reads waiting
#: messages within 0.3 s (timeouts.MAX_TRANSIT_TIME).
PATIENCE = 0.4
#: After a sleep of this length a process does not go on by itself [s].
TOO_LONG = 2.2
#: Longest time from a wake-up to a command that was begun before the sleep [s].
UNDER_WAY = 0.1


class StopsTest(WithThumb, DriveCase):
    """A move_to_goal that a test leaves behind serves the next test that asks for one."""

    mover = None

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.watch_data(String, 'control_holder')
        cls.actions = rospy.Publisher('move2goal/goal', MoveBaseActionGoal, queue_size=1)
        cls.cancels = rospy.Publisher('move2goal/cancel', GoalID, queue_size=1)
        cls.thumb = Thumb()

    @classmethod
    def tearDownClass(cls):
        cls.mover.kill()

    def setUp(self):
        self.thumb.sticks(0.0, 0.0)
        for topic in ('cmd_vel', 'goal_state', 'control_holder'):
            self.observer.forget(topic)

    def tearDown(self):
        self.control.publish(False)

    def move_to_goal(self):
        """A node with a goal far away, without control."""
        if self.mover is None or self.mover.status is not None:
            return self.start_move_to_goal()
        self.observer.forget('goal_state')
        self.drive_far()
        self.wait_for_state('waiting for control')
        return self.mover

    def start_move_to_goal(self):
        """As move_to_goal(), but the node starts now."""
        type(self).mover = NodeProgram('move2goal_tf.py', '_goal_x:=90', '_max_angular:=0.3')
        self.wait_for_state('waiting for control', seconds=STARTING)
        self.wait_for_subscriber(self.control, self.goals, self.actions, self.cancels)
        return self.mover

    def end_move_to_goal(self):
        """From now on no node hears the topics of move_to_goal, and no parameter of it is left."""
        if self.mover:
            self.mover.kill()
        self.wait_until_unheard({self.control: Bool(False), self.cancels: GoalID()})
        self.forget_parameters('move_to_goal')
        self.observer.forget('goal_state')

    def wait_until_turns_are_heard(self):
        """Wait until a controller hears `turns`. The controller was there before, so it accepts the first turn."""
        self.wait_until_hears('controller', 'imu')
        self.turns = rospy.Publisher('turn', Float64, queue_size=5)
        self.addCleanup(self.turns.unregister)
        self.wait_for_subscriber(self.turns)

    def student(self):
        """A student's node that has a terminal."""
        student = self.start('latching_sender.py', terminal=True)
        student.wait_for('connected')
        return student

    def gamepad(self):
        node = self.start('gamepad.py')
        self.observer.wait_for('control_holder', lambda holder: holder == 'gamepad', STARTING)
        return node

    def let_it_drive(self, give):
        """Call give(), which gives control, and wait until the robot moves."""
        start = self.observer.latest('ground_truth')
        self.observer.forget('cmd_vel')
        give()
        self.wait_until_it_moves(start)

    def drive_far(self):
        self.go_to(Pose2(90.0))

    def by_pad(self):
        self.thumb.press(A)

    def is_stopped(self, since, within=PROMPT):
        """No command moves the robot for PATIENCE, except within `within` [s] after `since`."""
        self.let_pass(PATIENCE)
        late = [at - since for at, command in self.observer.all('cmd_vel', since + within)
                if command != ZERO and at - since > within + self.hiccups.since(since, at)]
        self.assertEqual(late, [], 'commands after the stop')

    def stands_after_sleep(self, node):
        """A node sleeps for TOO_LONG. When the process continues, it may send a command from before its sleep. A zero
        must follow at once."""
        node.send(signal.SIGSTOP)
        self.let_pass(TOO_LONG)
        node.send(signal.SIGCONT)
        woke = rospy.get_time()
        self.is_stopped(woke, UNDER_WAY)
        sent = [command for _, command in self.observer.all('cmd_vel', woke)]
        self.assertTrue(not sent or sent[-1] == ZERO, sent)
        node.wait_for('this node did not run for')

    def test_the_first_word_of_a_sender_that_latches_is_a_stop_and_its_last_gives_once(self):
        """The sender was connected all the time, and had sent no permission, so its False is not an old one. But a True
        that a new connection repeats is an old one, as is the goal that it latched before."""
        self.end_move_to_goal()
        student = self.student()
        student.type('goal')
        student.wait_for('said', STARTING)
        node = self.start_move_to_goal()
        node.wait_for('/move2goal/goal: a message of /student from before this node could hear it')
        self.let_it_drive(self.give_control)
        self.let_pass(MAX_TRANSIT_TIME)
        said = rospy.get_time()
        student.type('False')
        self.is_stopped(said)
        self.let_it_drive(lambda: student.type('True'))
        taken = rospy.get_time()
        self.control.publish(False)
        self.is_stopped(taken)
        student.type('again')
        node.wait_for('Control from /student does not count: it was given before this node could hear it')
        self.is_stopped(rospy.get_time(), 0.0)

    def test_a_permission_that_waits_on_the_parameter_server_gives_none(self):
        """A launch that ended at once, a refused start, or rosparam may leave the parameter. A later start waits."""
        self.end_move_to_goal()
        refused = self.start('move2goal_tf.py', '_goal_x:=900', '_has_control:=true')
        self.assertEqual(refused.wait(STARTING), 1)
        rospy.delete_param('move_to_goal/goal_x')
        without = self.start('move2goal_tf.py', 'has_control:=true')
        without.wait_for('has_control:=true is not an argument')
        without.end()
        rospy.set_param('move_to_goal/has_control', True)
        self.start_move_to_goal()
        self.is_stopped(rospy.get_time(), 0.0)

    def test_a_launch_gives_control_to_one_start_only(self):
        """roslaunch repeats a node's arguments if it starts the node again (respawn)."""
        self.end_move_to_goal()
        file = tempfile.NamedTemporaryFile('w', suffix='.launch')
        self.addCleanup(file.close)
        file.write('<launch><node pkg="tb3_labs" type="move2goal_tf.py" name="move_to_goal" output='
                   '"screen" respawn="true" args="_goal_x:=90 _has_control:=true"/></launch>')
        file.flush()
        for kills in 1, 0:       # each launch is a person's act
            launch = TestProgram(['roslaunch', '--disable-title', '--skip-log-check', file.name])
            try:
                launch.wait_for('MOVE_FORWARD', STARTING)
                self.assertFalse(rospy.has_param('move_to_goal/has_control'))
                for _ in range(kills):
                    self.observer.forget('goal_state')
                    os.kill(process_of('move_to_goal'), signal.SIGKILL)
                    launch.wait_for('This launch gave control before', STARTING)
                    self.wait_for_state('waiting for control', seconds=STARTING)
                    self.rest()
                    self.is_stopped(rospy.get_time(), 0.0)
            finally:
                launch.end(seconds=40.0)

    def test_a_tap_on_b_while_messages_are_held_up(self):
        """After the sleep the gamepad node gets the press of B and its end at once."""
        self.move_to_goal()
        pad = self.gamepad()
        self.let_it_drive(self.by_pad)
        pad.send(signal.SIGSTOP)
        self.thumb.press(B)
        pad.send(signal.SIGCONT)
        self.is_stopped(rospy.get_time())

    def test_a_cancel_without_a_name_ends_any_goal_for_good(self):
        """A goal that its sender repeats stays ended. If a person sends the same goal once again, it is accepted."""
        node, number = self.move_to_goal(), itertools.count()

        def send(_=None):
            goal = MoveBaseActionGoal(goal_id=GoalID(id=str(next(number))))
            goal.goal.target_pose = to_pose_stamped(Pose2(90.0), 'local', 0.0)
            self.actions.publish(goal)
        send()
        self.let_it_drive(self.give_control)
        self.cancel()
        self.wait_for_state('gave up: canceled')
        self.declare()
        self.is_stopped(rospy.get_time(), 0.0)
        self.let_it_drive(send)
        self.cancel()
        self.let_pass(MAX_REPEAT_GAP + 0.1)
        repeating = rospy.Timer(rospy.Duration(0.3), send)
        self.addCleanup(repeating.shutdown)
        self.observer.wait_for('cmd_vel', lambda command: command != ZERO)
        self.let_pass(0.6)
        self.cancel()
        self.declare()
        self.let_pass(MAX_REPEAT_GAP)
        self.is_stopped(rospy.get_time(), 0.0)
        self.assertIn('repeats it since before it was ended', node.text)

    def cancel(self):
        """Cancel every goal. The robot must stand."""
        asked = rospy.get_time()
        self.cancels.publish(GoalID())
        self.is_stopped(asked)

    def test_two_nodes_that_drive_at_one_time_are_named(self):
        """Two move_to_goal drive to one goal."""
        first = self.move_to_goal()
        second = self.start('move2goal_tf.py', '_goal_x:=90', '__name:=second')
        self.observer.wait_until(lambda: self.control.get_num_connections() == 2, STARTING, 'both')
        self.wait_until_hears('second', 'odom')
        self.let_pass(1.5)        # in which the second compares gyro and wheels at rest
        self.let_it_drive(self.give_control)
        first.wait_for('/second drives the robot, too: stop one of the two')
        second.wait_for('/move_to_goal drives the robot, too: stop one of the two')

    def test_nodes_that_slept_wait_for_a_new_request(self):
        mover = self.move_to_goal()
        self.let_it_drive(self.give_control)
        self.stands_after_sleep(mover)
        self.let_it_drive(self.give_control)
        mover.end()
        controller = self.start('turtlebot_controller.py')
        controller.wait_for('and Enter', STARTING)
        self.wait_until_turns_are_heard()
        self.let_it_drive(lambda: self.turns.publish(3600.0))
        self.stands_after_sleep(controller)

    def test_a_terminal_that_is_closed_ends_a_node_with_a_zero(self):
        self.end_move_to_goal()
        for executable in ('move2goal_tf.py', 'turtlebot_controller.py'):
            terminal, process = run_in_terminal(executable)
            self.addCleanup(process.kill)
            if executable == 'move2goal_tf.py':
                self.wait_for_subscriber(self.control)
                self.closed_send_goal_cancels()
                self.let_it_drive(self.drive_far)
            else:
                self.wait_until_turns_are_heard()
                self.let_it_drive(lambda: os.write(terminal, b'3600\n'))
            closed = rospy.get_time()
            os.close(terminal)
            self.assertEqual(process.wait(STARTING), 0)
            self.is_stopped(closed)

    def closed_send_goal_cancels(self):
        """Close the terminal of send_goal.py. move_to_goal keeps control."""
        self.let_it_drive(self.give_control)
        terminal, process = run_in_terminal('send_goal.py', '90', '0', '0')
        self.addCleanup(process.kill)
        self.assertTrue(select.select([terminal], [], [], STARTING)[0], 'no state is printed')
        closed = rospy.get_time()
        os.close(terminal)
        self.assertEqual(process.wait(STARTING), 1)
        self.wait_for_state('gave up: canceled')
        self.is_stopped(closed)

    def test_a_blocked_terminal_delays_no_drive_and_no_stop(self):
        self.end_move_to_goal()
        node = self.start('move2goal_tf.py', '_goal_x:=90', terminal=True)
        self.wait_for_state('waiting for control', seconds=STARTING)
        self.wait_for_subscriber(self.control, self.goals)
        node.type('\x13')     # Ctrl+S
        for _ in range(2):
            self.drive_far()
            self.let_it_drive(self.give_control)
            said = rospy.get_time()
            self.control.publish(False)
            self.is_stopped(said)
        self.assertNotIn('MOVE_FORWARD', node.text)
        node.type('\x11')     # Ctrl+Q
        node.wait_for('MOVE_FORWARD')
        # a node prints its last lines after its last zero
        self.let_it_drive(self.give_control)
        node.type('\x13')
        asked = rospy.get_time()
        node.send(signal.SIGTERM)
        self.is_stopped(asked)
        self.assertEqual(self.observer.latest('cmd_vel'), ZERO)
        node.type('\x11')
        self.assertEqual(node.wait(STARTING), 0)


def run_in_terminal(executable, *arguments):
    """Starts a node in a new terminal. Returns (the other side of the terminal, the process)."""
    ours, theirs = pty.openpty()

    def own_it():
        os.setsid()
        import fcntl
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    process = subprocess.Popen([path_of(executable)] + list(arguments), stdin=theirs, stdout=theirs,
                               stderr=theirs, preexec_fn=own_it)
    os.close(theirs)
    return ours, process
