#!/usr/bin/env python3
"""The effect of each rule of the approach: turns and drives with it, and without it.

A rule is switched off by a value without effect in ApproachConfig; the noise, an argument of each
step, by 0. Each pair of rows is one kind of robot, which makes the same motions with the rule
and without it. `off` is the true error of the heading or of the place; times are from the first
command to rest; `reversals` counts the changes of direction; `failed` counts turns that ended
outside the tolerance, and drives that were given up.

The rule `slowest` shows here only that it does no harm. Its use is small: without it a robot whose
estimate is bad comes to rest too late for test_approach.py. Motors that stick are not modelled.

Usage: rules.py [motions of each kind, default 40] [name of one rule]
"""
import math
import random
import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from unittest import mock

from rollout import drive, turns

from tb3_labs.control import driving, turning
from tb3_labs.control.approach import Approach
from tb3_labs.control.motor_response import Response
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: A turn with an error below this succeeded [deg]: the tolerance, and the effect of the drift.
NEAR_DEG = 0.4
#: Wrong estimate of a robot that is `known badly`: delay and lag [s].
BELIEVED = 0.3, 0.05
ROBOTS = {
    'as built': {},
    'late by chance': {},      # each robot by another latency
    'noisy IMU': {'imu_noise_deg': 0.15, 'gyro_noise': 0.02},
    'very noisy IMU': {'imu_noise_deg': 0.5, 'gyro_noise': 0.05},
    'busy network': NETWORKS['busy'],
    'bad network': NETWORKS['bad'],
    'slow + bad network': dict(NETWORKS['bad'], motor_lag=0.2),
    'known badly + bad': dict(NETWORKS['bad'], motor_lag=0.1),
}
#: For each rule: its value without effect, the motion, the robots on which it matters.
RULES = {
    'slowest': ({'slowest': 0.0}, 'turn', ['known badly + bad']),
    'close_enough': ({'close_enough': 0.0}, 'turn', ['as built', 'bad network']),
    'leave_alone': ({'leave_alone': 0.0}, 'turn', ['as built', 'bad network', 'noisy IMU']),
    'backwards_from': ({'backwards_from': 0.0}, 'drive', ['busy network', 'bad network']),
    'reversal_caution': ({'reversal_caution': 0.0}, 'turn', [
        'bad network', 'slow + bad network', 'known badly + bad']),
    'nudge_time': ({'nudge_time': 0.0}, 'drive', ['late by chance']),
    'noise': ({}, 'turn', ['noisy IMU', 'very noisy IMU']),
}
ROW = '{:17} {:6} {:19} {:8} {:>26} {:>15} {:>10} {:>7}'


class CountedApproach(Approach):
    """An Approach that counts its reversals, and may take `remaining` for exact."""

    def __init__(self, counts, exact, *args):
        super().__init__(*args)
        self._counts, self._exact, self._sign = counts, exact, 0.0

    def step(self, remaining, speed, fastest, dt, noise=0.0, age=0.0):
        """As an Approach's."""
        command = super().step(remaining, speed, fastest, dt, 0.0 if self._exact else noise, age)
        if command * self._sign < 0.0:
            self._counts.append(command)
        self._sign = command or self._sign
        return command


@contextmanager
def without(rule, counts, believed):
    """A context in which each approach works without `rule` (None: with all rules), and begins with
    the delay and lag `believed`; their reversals are counted in `counts`."""
    neutral = RULES[rule][0] if rule else {}
    with ExitStack() as stack:
        for module, name in ((turning, 'turning_approach'), (driving, 'driving_approach')):
            changed = partial(_changed, getattr(module, name), neutral)
            counted = partial(CountedApproach, counts, rule == 'noise')
            for attribute, value in ((name, changed), ('Approach', counted),
                                     ('Response', partial(Response, *believed))):
                stack.enter_context(mock.patch.object(module, attribute, value))
        yield


def _changed(make, neutral, *args):
    return replace(make(*args), **neutral)


def one_turn(degrees, robot):
    """A turn; it is asked for again while a stall of the network makes the robot refuse it."""
    for wait in (0.3, 0.6, 0.9, 1.2, 1.5):
        try:
            return turns([degrees], robot, wait=wait)[0]
        except ValueError:
            pass
    raise RuntimeError('no turn is possible on {}'.format(robot))


def two_turns(rng, robot, counts):
    """(off [deg], time [s], reversals, failed) of a large turn and a small one."""
    for size in (90.0, rng.uniform(1.0, 10.0)):
        counts.clear()
        asked = rng.choice((-1.0, 1.0)) * size
        turn = one_turn(asked, robot)
        off = abs(math.degrees(turn.turned) - asked)
        yield off, turn.time, len(counts), off > NEAR_DEG


def a_drive(rng, robot, counts):
    """(off [mm], time [s], reversals, failed) of a drive."""
    goal = Pose2(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-3.0, 3.0))
    result = drive(goal, robot)
    yield 1000.0 * result.distance_error, result.time, len(counts), not result.reached


def motions(axis, kind, rule, seed):
    """The results of one robot of a `kind` without a `rule`; None: with all rules."""
    rng, counts = random.Random(seed), []
    robot = SimulatorConfig(
        start_yaw_deg=rng.uniform(-180.0, 180.0), imu_offset_deg=rng.uniform(-180.0, 180.0),
        seed=seed, **ROBOTS[kind])
    if kind == 'late by chance':
        robot = replace(robot, command_latency=rng.uniform(0.0, 0.05),
                        sensor_latency=rng.uniform(0.0, 0.02))
    believed = BELIEVED if kind.startswith('known badly') else ()
    with without(rule, counts, believed):
        return list({'turn': two_turns, 'drive': a_drive}[axis](rng, robot, counts))


def in_words(axis, results):
    """A row's cells."""
    off, time, reversals, failed = zip(*results)
    off = sorted(off)
    middle, most, worst = (off[int(part * (len(off) - 1))] for part in (0.5, 0.95, 1.0))
    return ('{:.2f} / {:.2f} / {:.2f} {}'.format(
                middle, most, worst, {'turn': 'deg', 'drive': 'mm'}[axis]),
            '{:.2f} / {:.2f} s'.format(sum(time) / len(time), max(time)),
            '{:.2f}'.format(sum(reversals) / len(results)), sum(failed))


def main(number, rules):
    """Print the rows of each rule."""
    print(ROW.format('rule', 'motion', 'robot', '', 'off: half, 95 %, worst', 'mean, longest',
                     'reversals', 'failed'))
    with ProcessPoolExecutor() as pool:
        for rule in rules:
            _, axis, kinds = RULES[rule]
            for kind in kinds:
                for switched in (None, rule):
                    made = pool.map(partial(motions, axis, kind, switched), range(number))
                    results = [result for one in made for result in one]
                    print(ROW.format(rule, axis, kind, 'without' if switched else 'with',
                                     *in_words(axis, results)), flush=True)


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40, sys.argv[2:] or list(RULES))
