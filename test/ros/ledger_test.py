#!/usr/bin/env python3
"""Did a person permit each command? Random stories with real nodes: two gamepads, a hand, goals,
cancels, resets; pads unplugged, nodes killed, started again and put to sleep, a network that
stalls.

The judge is the ledger of test/unit/ledger.py.
"""
import os
import random
import signal
import sys

import rospy
import rostest
from actionlib_msgs.msg import GoalID
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseStamped, Twist
from std_msgs.msg import Bool, String

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.ros.rospy_internals import connection_of
from tb3_labs.ros.testing.observer import Observer
from tb3_labs.srv import ResetPose

HERE = os.path.dirname(os.path.realpath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, '..', 'unit')]
from ledger import OVER, judge    # noqa: E402
from node_case import STARTING, Node, NodeCase    # noqa: E402
from thumb import A, B, Thumb     # noqa: E402

PADS = ('pad 1', 'pad 2')
#: Time from a person's action to the last command that it ends, also on a busy machine [s].
GRACE = 0.35
#: A pad's word is said within this time of the press that caused it, unless its node sleeps [s].
PROMPT = 0.5
#: Time until a node that was just started has connected to all others [s].
CONNECTING = 2.0
ACTS = 10


class LedgerTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        cls.history, cls.presses = [], []      # (time, what, ...), (time, pad, button)
        cls.started = {}                       # pad: when its node was started last
        cls.seen = Observer()
        cls.seen.watch('goal_state', String, lambda message: message.data)
        cls.seen.watch('control_holder', String, lambda message: message.data)
        cls.seen.watch('cmd_vel', Twist, lambda message: cls.on_command(
            message, connection_of(message)['callerid']))
        cls.seen.watch('ctrl_relinq', Bool, lambda message: cls.on_word(
            message, connection_of(message)['callerid']))
        cls.hand = rospy.Publisher('ctrl_relinq', Bool, queue_size=10)
        cls.goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        cls.cancels = rospy.Publisher('move2goal/cancel', GoalID, queue_size=1)
        cls.thumbs = {'pad 1': Thumb('joy1'), 'pad 2': Thumb('joy2')}
        cls.robot = Client('turtlebot3', timeout=20.0)
        cls.nodes = {}
        for pad in PADS:
            cls.start_pad(pad)
        cls.start_mover()

    @classmethod
    def tearDownClass(cls):
        for node in cls.nodes.values():
            node.kill()

    # -- nodes

    @classmethod
    def start_mover(cls):
        # words that others have latched by now were said before it started
        last = {}
        for entry in cls.history:
            if entry[1] == 'heard':
                last[entry[2]] = entry[3]
        cls.note('mover started', [pad for pad in PADS if last.get(pad)])
        cls.seen.forget('goal_state')
        cls.nodes['mover'] = Node('move2goal_tf.py', '_goal_x:=90', '_max_angular:=0.3')
        cls.seen.wait_for('goal_state', lambda state: 'waiting for control' in state, STARTING)

    @classmethod
    def start_pad(cls, pad):
        number, cls.started[pad] = pad[-1], rospy.get_time()
        cls.nodes[pad] = Node('gamepad.py', '__name:=pad' + number, 'joy:=joy' + number,
                              'control_holder:=holder' + number)

    # -- the history

    @classmethod
    def note(cls, *what):
        cls.history.append((rospy.get_time(),) + what)

    @classmethod
    def on_command(cls, message, sender):
        if sender == '/move_to_goal' and (message.linear.x or message.angular.z):
            cls.note('driven')

    @classmethod
    def on_word(cls, message, sender):
        now, name = rospy.get_time(), {'/pad1': 'pad 1', '/pad2': 'pad 2'}.get(sender, 'hand')
        button = A if message.data else B
        pressed = [at for at, pad, which in cls.presses if pad == name and which == button]
        if pressed and (message.data or now - pressed[-1] < PROMPT):
            caused = pressed[-1]
        elif now - cls.started.get(name, 0.0) < CONNECTING:
            # a new gamepad's first False: no person said it, and move_to_goal hears it later than
            # this test if it connects later
            caused = 0.0
        else:
            caused = now
        cls.note('heard', name, message.data, 'pressed', caused)

    # -- what happens

    def press(self, chance, button):
        pad = chance.choice(PADS)
        self.presses.append((rospy.get_time(), pad, button))
        self.thumbs[pad].press(button)

    def hand_says(self, chance):
        self.hand.publish(chance.random() < 0.6)

    def plug(self, chance):
        thumb = self.thumbs[chance.choice(PADS)]
        thumb.plugged = not thumb.plugged

    def kill_pad(self, chance):
        pad = chance.choice(PADS)
        self.nodes[pad].kill()
        self.let_pass(chance.uniform(0.0, 1.0))
        self.start_pad(pad)

    def kill_mover(self, chance):
        self.nodes['mover'].kill()
        self.let_pass(0.2)
        self.start_mover()

    def sleep(self, chance):
        name, seconds = chance.choice(('mover',) + PADS), chance.choice((0.3, 1.0, 3.0))
        if name == 'mover' and seconds > OVER:
            self.note('mover sleeps', rospy.get_time() + seconds)
        self.nodes[name].send(signal.SIGSTOP)
        self.let_pass(0.5 * seconds)
        if name != 'mover' and chance.random() < 0.5:
            button = chance.choice((A, B))
            self.presses.append((rospy.get_time(), name, button))
            self.thumbs[name].press(button)
        self.let_pass(0.5 * seconds)
        self.nodes[name].send(signal.SIGCONT)

    def stall(self, chance):
        self.robot.update_configuration({'network_cut': True})
        self.let_pass(chance.choice((0.1, 0.3, 1.0)))
        self.robot.update_configuration({'network_cut': False})

    def goal(self, chance):
        self.note('goal')
        self.goals.publish(to_pose_stamped(Pose2(chance.uniform(20.0, 90.0), 0.0, 0.0), '', 0.0))

    def cancel(self, chance):
        self.cancels.publish(GoalID())
        self.note('cancelled')

    def reset(self, chance):
        rospy.ServiceProxy('reset_pose', ResetPose)(0.0, 0.0, 0.0)

    @property
    def acts(self):
        return {lambda chance: self.press(chance, A): 8, lambda chance: self.press(chance, B): 5,
                self.hand_says: 5, self.plug: 2, self.kill_pad: 1, self.kill_mover: 1,
                self.sleep: 3, self.stall: 2, self.goal: 3, self.cancel: 1, self.reset: 2}

    def test_nobody_drives_without_a_persons_leave(self):
        stories, seed = rospy.get_param('~stories', 3), rospy.get_param('~seed', 1)
        for story in range(seed, seed + stories):
            chance = random.Random(story)
            for act in chance.choices(list(self.acts), list(self.acts.values()), k=ACTS):
                act(chance)
                self.let_pass(chance.choice((0.05, 0.3, 0.7)))
            for thumb in self.thumbs.values():
                thumb.plugged = True
            self.let_pass(0.6)
            history = sorted(self.history, key=lambda entry: entry[0])
            wrong = judge(history, GRACE)
            for node in self.nodes.values():
                self.assertIsNone(node.status, node.text[-2000:])
                self.assertNotIn('Traceback', node.text)
            self.assertEqual(wrong[:3], [], 'story {}: {}'.format(
                story, [entry for entry in history if entry[1] != 'driven'
                        and abs(entry[0] - (wrong or [(0.0,)])[0][0]) < 6.0]))
        driven = sum(entry[1] == 'driven' for entry in self.history)
        print('{} stories, {} commands to drive'.format(stories, driven))
        self.assertGreater(driven, 5 * stories)


if __name__ == '__main__':
    rospy.init_node('ledger')
    rostest.rosrun('tb3_labs', 'ledger', LedgerTest)
