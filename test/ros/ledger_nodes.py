#!/usr/bin/env python3
"""The nodes of the stories of ledger.test, and the history of what persons did, of what nodes said,
and of the commands, for the judges of ledger_judge.py."""
import actionlib
import rospy
from actionlib_msgs.msg import GoalID
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseAction
from std_msgs.msg import Bool, Float64

from tb3_labs.ros.rospy_internals import connection_of

from ledger_judge import PADS
from drive_case import DriveCase
from node_case import STARTING, Node
from panel_page import Page, address_of
from thumb import Mouse, Thumb

#: A pad's word is said within this time of the press that caused it, unless its node sleeps [s].
PROMPT = 0.5
#: Time until a node that was just started has connected to all others [s].
CONNECTING = 2.0
#: move_to_goal takes the first word of a sender that latches for an old one, if it comes within
#: 0.3 s of its connection [s].
NEW = 0.4
SENDERS = {'/pad1': 'pad 1', '/pad2': 'pad 2', '/panel': 'panel', '/student': 'student'}


class LedgerNodes(DriveCase):
    """The nodes, the persons, and the history [(time, what, details...)] for the judges."""

    @classmethod
    def setUpClass(cls):
        cls.history, cls.presses = [], []      # (time, what, ...), (time, who, 'A' or 'B')
        cls.started, cls.asleep = {}, set()    # {node: when it was started last}, nodes
        cls.cancelled_at = 0.0
        super().setUpClass()
        cls.turns = rospy.Publisher('turn', Float64, queue_size=5)
        cls.cancels = rospy.Publisher('move2goal/cancel', GoalID, queue_size=1)
        cls.thumbs = {'pad 1': Thumb('joy1'), 'pad 2': Thumb('joy2')}
        cls.pointer = Mouse()
        cls.robot = Client('turtlebot3', timeout=20.0)
        cls.nodes = {'panel': Node('panel.py')}
        for name in PADS + ('student', 'controller'):
            cls.start_again(name)
        cls.start_mover(False)
        cls.action = actionlib.SimpleActionClient('move2goal', MoveBaseAction)
        cls.action.action_client.pub_goal.impl.enable_latch()    # as `rostopic pub` would
        cls.address = address_of(cls.nodes['panel'])
        cls.pages = [Page(cls.address), Page(cls.address)]
        cls.wait_until_heard(cls.turns, cls.pointer.publisher)
        for page in cls.pages:
            page.wait_until(lambda page=page: all(
                page.latest.get('picture', {}).get('can', {}).get(kind)
                for kind in ('goal', 'control', 'turn', 'mouse')), STARTING, 'all nodes')

    @classmethod
    def watch(cls):
        cls.seen.watch('local_pose', PoseStamped)
        cls.seen.watch('cmd_vel', Twist, cls.on_command)
        cls.seen.watch('ctrl_relinq', Bool, cls.on_word)

    @classmethod
    def tearDownClass(cls):
        for node in cls.nodes.values():
            node.kill()

    # -- nodes

    @classmethod
    def start_mover(cls, granted):
        # words that others have latched by now were said before it started
        last = {entry[2]: entry[3] for entry in cls.history if entry[1] == 'heard' and (
            entry[0] > cls.started.get(entry[2], 0.0))}
        cls.note('mover started', [who for who, word in last.items() if word and who != 'hand'],
                 granted)
        cls.seen.forget('local_pose')
        cls.nodes['mover'] = Node('move2goal_tf.py', '_goal_x:=90', '_max_angular:=0.3',
                                  *['_has_control:=true'] * granted)
        # its last subscriptions; before them it hears no stop
        cls.seen.wait_for('local_pose', seconds=STARTING)
        cls.wait_until_heard(cls.cancels, cls.goals)
        connected = rospy.get_time()
        cls.seen.wait_until(lambda: rospy.get_time() > connected + NEW)

    @classmethod
    def start_again(cls, name):
        """Kill and start a gamepad, the controller or the student's node."""
        if name in cls.nodes:
            cls.nodes[name].kill()
        cls.started[name] = rospy.get_time()
        if name == 'controller':
            cls.note('controller started')
            cls.nodes[name] = Node('turtlebot_controller.py')
        elif name == 'student':
            cls.nodes[name] = Node('latching_sender.py', terminal=True)
        else:
            cls.nodes[name] = Node('gamepad.py', '__name:=pad' + name[-1],
                                   'joy:=joy' + name[-1], 'control_holder:=holder' + name[-1])

    # -- the history

    @classmethod
    def note(cls, *what, at=None):
        cls.history.append((rospy.get_time() if at is None else at,) + what)

    @classmethod
    def on_command(cls, message):
        sender = connection_of(message)['callerid']
        if message.linear.x or message.angular.z:
            cls.note({'/move_to_goal': 'driven', '/controller': 'controlled'}.get(sender, sender))

    @classmethod
    def on_word(cls, message):
        now, name = rospy.get_time(), SENDERS.get(connection_of(message)['callerid'], 'hand')
        pressed = {button: max([at for at, who, which in cls.presses if (who, which) == (
            name, button)], default=0.0) for button in 'AB'}
        caused = pressed['A' if message.data else 'B']
        if name == 'panel' and not message.data:
            caused = max(pressed.values())     # its first True comes after a False
        if not (caused and (message.data or now - caused < PROMPT)):
            # a new gamepad's first False: no person said it, and move_to_goal hears it later than
            # this test if it connects later
            is_first = name in PADS and now - cls.started[name] < CONNECTING
            caused = 0.0 if is_first else now
        cls.note('heard', name, message.data, caused)

    def stop(self, *through, what='stopped'):
        """A person says stop; it counts at once if the nodes that it goes through are awake."""
        now = rospy.get_time()
        if not self.asleep & set(through) and all(
                now - self.started.get(node, 0.0) > CONNECTING for node in through):
            self.note(what)
