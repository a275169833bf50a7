#!/usr/bin/env python3
"""Events of the stories of ledger.test: acts of persons, the machine and the network."""
import json
import os
import signal
import time

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID
from move_base_msgs.msg import MoveBaseGoal

from latching_sender import break_connections
from ledger_nodes import LedgerNodes
from panel_page import Page
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped
from thumb import A, B

#: actionlib remembers a goal for this long after its end [s].
REMEMBERED = 5.2
#: The mouse: active, x, y.
PLACES = {'moved': (True, 0.0, 0.8), 'centred': (True, 0.0, 0.0), 'released': (False, 0.0, 0.0)}


class LedgerCase(LedgerNodes):
    """The acts of a story: lists of a method's name and its arguments."""

    # -- persons

    def press(self, pad, button):
        self.presses.append((rospy.get_time(), pad, button))
        if button == 'B' and self.thumbs[pad].plugged:
            self.stop(pad)
        self.thumbs[pad].press({'A': A, 'B': B}[button])

    def plug(self, pad):
        self.thumbs[pad].plugged = not self.thumbs[pad].plugged

    def hand(self, *words):
        """A person at a terminal says these."""
        for word in words:
            if not word:
                self.stop()
            self.control.publish(word)

    def student(self, *words):
        """A student's node, which latches, says these."""
        for word in words:
            if word is False:
                self.stop('student')
            elif word == 'again':
                self.started['student'] = rospy.get_time()    # it connects anew
            self.nodes['student'].type(str(word))

    def mouse(self, place):
        self.pointer.plugged = place != 'silent'
        if self.pointer.plugged:
            self.pointer.state = PLACES[place]
        self.note('mouse', 'mouse', place)

    def turn(self, degrees):
        self.note('turn', rospy.get_time())
        self.turns.publish(degrees)

    def goal(self, how):
        self.note('goal')
        if how == 'action':
            self.action.send_goal(MoveBaseGoal(to_pose_stamped(Pose2(70.0), '', 0.0)))
        else:
            self.go_to(Pose2(80.0))

    def goal_nowhere(self):
        """A goal comes in a frame that nobody knows."""
        self.go_to(Pose2(80.0), 'nowhere')

    def cancel(self):
        self.cancelled_at = rospy.get_time()
        self.note('cancelled')
        self.cancels.publish(GoalID())

    def goal_again(self):
        """The last action goal, which is latched, comes by a new connection."""
        goal = max([at for at, what, *_ in self.history if what == 'goal'], default=0.0)
        if goal < self.cancelled_at:
            self.let_pass(max(0.0, self.cancelled_at + REMEMBERED - rospy.get_time()))
        break_connections(self.action.action_client.pub_goal)

    # -- persons at pages

    def page(self, number, what):
        if self.pages[number].closed.is_set():
            self.pages[number] = Page(self.address)
        page = self.pages[number]
        if what == 'give':
            self.presses.append((rospy.get_time(), 'panel', 'A'))
            page.send('give')
            page.hold()
        elif what in ('take', 'stop', 'b'):
            self.presses.append((rospy.get_time(), 'panel', 'B'))
            self.stop('panel', what='all stopped' if what == 'stop' else 'stopped')
            if what == 'b':
                page.send('joy', pad={'forward': 0, 'left': 0, 'b': True}, mouse=None)
            page.send('joy', pad=None, mouse=None) if what == 'b' else page.send(what)
        elif what == 'mouse':
            for place in ('released', 'moved'):    # a new grip
                self.note('mouse', 'page %d' % number, place)
            page.send('begin')
            page.hold(mouse=[0.0, 0.8])
        elif what == 'let go':
            self.note('mouse', 'page %d' % number, 'released')
            page.fall_silent()
            page.send('let go')
        elif what == 'turn':
            self.note('turn', rospy.get_time())
            page.send('turn', degrees=300.0)
        elif what == 'goal':
            self.note('goal')
            page.send('goal', x=60.0, y=0.0, yaw_deg=0.0)
        else:
            self.note('mouse', 'page %d' % number, 'silent')
            page.fall_silent() if what == 'silent' else page.close()

    def late(self, number, what, seconds, *between):
        """A page says this, which the network delays; other acts come between."""
        pressed = rospy.get_time()
        text = {'type': what, 't': time.time(), 'degrees': 300.0}
        if what == 'give':
            self.presses.append((pressed, 'panel', 'A'))
        self.spend(seconds, between)
        if what == 'turn':
            self.note('turn', pressed)
        self.pages[number].send_text(json.dumps(text))
        self.pages[number].hold()

    # -- machine and network

    def sleep(self, names, seconds, *between):
        """Nodes sleep, and meanwhile other acts happen."""
        begun = rospy.get_time()
        self.asleep |= set(names)
        for name in names:
            self.nodes[name].send(signal.SIGSTOP)
        self.spend(seconds, between)
        for name in names:
            self.nodes[name].send(signal.SIGCONT)
        self.asleep -= set(names)
        for name in {'mover', 'controller'} & set(names):
            self.note(name + ' sleeps', rospy.get_time(), at=begun)

    def stall(self, seconds):
        """The robot's network stands still."""
        self.robot.update_configuration({'network_cut': True})
        self.let_pass(seconds)
        self.robot.update_configuration({'network_cut': False})

    def master_stalls(self, *between):
        """The master does not answer; acts happen before it does again."""
        master = rosgraph.Master(rospy.get_name()).getPid()
        os.kill(master, signal.SIGSTOP)
        self.spend(0.0, between)
        os.kill(master, signal.SIGCONT)

    def restart_mover(self, granted):
        """move_to_goal is killed and started again, perhaps with has_control:=true."""
        self.nodes['mover'].kill()
        self.let_pass(0.2)
        self.start_mover(granted)

    # -- stories

    def play(self, act):
        """Let one act happen."""
        getattr(self, act[0])(*act[1:])

    def spend(self, seconds, acts):
        """Let time pass, and in the middle of it let acts happen."""
        begun = rospy.get_time()
        self.let_pass(0.5 * seconds)
        for act in acts:
            self.play(act)
        self.let_pass(begun + seconds - rospy.get_time())
