#!/usr/bin/env python3
"""Did a person permit each command? Random stories with real nodes: two gamepads, a terminal, a
student's node that latches, two pages, a mouse, turns, goals, cancels, resets; nodes that are
killed, started again and put to sleep, a network and a master that stall.

The judges are those of ledger_judge.py. The line that a bad story ends with plays it again:

    rostest tb3_labs ledger.test story:="[['press', 'pad 1', 'A'], ['let_pass', 0.5], ...]"
"""
import ast
import random

import rospy

from ledger_case import LedgerCase
from ledger_judge import PADS, judge, judge_controller
from node_case import run_as_node

#: Time from a person's action to the last command that it ends, also on a busy machine [s].
GRACE = 0.35
#: Acts of a bad story that are told, up to the command that nobody permitted.
TOLD = 15
NODES = PADS + ('mover', 'controller', 'panel')


def givings(chance):
    """All ways in which a person can make the robot move: lists of acts."""
    page = chance.randrange(2)
    return [[['press', pad, 'A']] for pad in PADS] + [
        [['hand', False, True]], [['student', False, True]],
        [['page', 1 - page, 'let go'], ['page', page, 'give']],
        [['mouse', 'centred'], ['let_pass', 0.1], ['mouse', 'moved']], [['turn', 300.0]],
        [['page', 1 - page, 'let go'], ['page', page, 'mouse']], [['page', page, 'turn']]]


def stops(chance):
    """All ways to stop it."""
    return [['press', pad, 'B'] for pad in PADS] + [
        ['page', chance.randrange(2), how] for how in ('take', 'stop', 'b')] + [
        ['hand', False], ['student', False], ['cancel']]


def deck(chance):
    """Everything that can happen, each once."""
    def page():
        return chance.randrange(2)

    def stop():
        return chance.choice(stops(chance))

    return stops(chance) + [
        ['student', 'again'], ['page', page(), 'let go'],
        ['page', page(), chance.choice(('silent', 'close'))], ['mouse', 'released'],
        ['mouse', 'silent'], ['plug', chance.choice(PADS)], ['goal', 'topic'], ['goal', 'action'],
        ['page', page(), 'goal'], ['goal_nowhere'], ['goal_again'], ['reset', 0.0, 0.0, 0.0],
        ['late', page(), 'give', chance.choice((0.8, 1.9)), stop()],
        ['late', page(), 'turn', chance.choice((0.8, 1.9)), ['page', page(), 'stop']],
        ['sleep', chance.sample(NODES, chance.randrange(1, len(NODES) + 1)),
         chance.choice((1.0, 3.0, 5.0)), chance.choice([stop(), ['let_pass', 0.1]])],
        ['stall', chance.choice((0.1, 0.3, 1.0))],
        ['master_stalls', *chance.choice(givings(chance)), ['goal_nowhere'], ['let_pass', 0.4],
         stop(), ['let_pass', 0.4], *chance.choice(givings(chance)), stop(), ['let_pass', 0.5]],
        ['start_again', chance.choice(PADS + ('student', 'controller'))],
        ['restart_mover', True], ['restart_mover', False]]


def story(chance):
    """The deck in any order; mostly the robot is made to move before each of it."""
    acts, cards = [], deck(chance)
    chance.shuffle(cards)
    for card in cards:
        if chance.random() < 0.7:
            if chance.random() < 0.3:
                acts.append(['goal', chance.choice(('topic', 'action'))])
            acts += chance.choice(givings(chance)) + [['let_pass', 0.3]]
        acts += [card, ['let_pass', chance.choice((0.05, 0.2, 0.4))]]
    return acts + [['let_pass', 0.6]]


def judged(history, grace):
    """[(time, reason)] of all commands that nobody had permitted."""
    return sorted(judge(history, grace) + judge_controller(history, grace))


class LedgerTest(LedgerCase):

    def test_nobody_drives_without_a_persons_leave(self):
        first = rospy.get_param('~seed', 1)
        told = ast.literal_eval(rospy.get_param('~story', '') or '[]')
        for seed in range(first, first + (1 if told else rospy.get_param('~stories', 1))):
            self.check(seed, told or story(random.Random(seed)))
        for what in ('driven', 'controlled'):
            commands = sum(entry[1] == what for entry in self.history)
            print('{}: {} commands'.format(what, commands))
            self.assertTrue(told or commands > 20)

    def check(self, seed, acts):
        played = []
        for act in acts:
            played.append((rospy.get_time(), act))
            self.play(act)
        history = sorted(self.history, key=lambda entry: entry[0])
        wrong = judged(history, GRACE)
        for at, reason in wrong:
            # a stop takes longer while the machine does not let the nodes run
            if (at, reason) in judged(history, GRACE + self.hiccups.since(at - 1.0, at)):
                self.fail(self.tale(seed, played, at, '{}; {} such commands, until {:.2f} s'.format(
                    reason, len(wrong), wrong[-1][0] - at)))
        for name, node in self.nodes.items():
            self.assertIsNone(node.status, '{} {}: {}'.format(seed, name, node.text[-2000:]))
            self.assertNotIn('Traceback', node.text)
        for name in PADS:
            self.thumbs[name].plugged = True

    def tale(self, seed, played, at, reason):
        """A bad story with its times, and as it can be played again."""
        before = [(begun, act) for begun, act in played if begun < at]
        lines = ['story {}:'.format(seed)] + [
            '{:7.2f} s: {}'.format(begun - at, act) for begun, act in before[-TOLD:]]
        heard = ['{:7.2f} s: {}'.format(entry[0] - at, entry[1:]) for entry in self.history
                 if at - 6.0 < entry[0] < at + 0.3 and entry[1] not in ('driven', 'controlled')
                 and (entry[1] != 'heard' or not entry[3])]
        return '\n'.join(lines + ['   0.00 s: it drives: ' + reason, 'history:'] + heard + [
            str([act for _, act in before])])


if __name__ == '__main__':
    run_as_node('ledger', LedgerTest)
