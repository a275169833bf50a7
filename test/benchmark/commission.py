"""The commissioning against simulated robots whose truth is known: are its errors true, its faults named?

    python3 test/benchmark/commission.py --runs 200 [--first 1] [--loop] [--keys]

A third of the robots have one fault each. Told are the share of each number within its stated error (and the mean
of that error), faults that were not named, healthy robots that were accused, and robots that left the box of 0.8 m by
their true pose. --loop: each healthy robot's YAML is loaded, and that robot measured again. Units: SI, degrees.
"""
import argparse
import math
import random
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

from tb3_labs.commissioning.estimates import WAIT, estimates
from tb3_labs.commissioning.findings import FAULT, findings
from tb3_labs.commissioning.page import settings
from tb3_labs.commissioning.ride import KEY
from tb3_labs.commissioning.twin import Playground, driven
from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, robot_model
from tb3_labs.simulation.firmware import motor_speeds
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import HOSTS, SimulatorConfig

MODEL = robot_model('burger')
#: {kind of fault: the keys by which it is named}
FAULTS = {
    'motors_off': {'motors'}, 'imu_silent': {'lost_imu'}, 'odom_silent': {'lost_odom'},
    'imu_frozen': {'imu_frozen'}, 'odom_frozen': {'odom_frozen'},
    'dropouts': {'dropouts', 'lost_imu', 'lost_odom', 'lost_imu_odom'}, 'serial_dead': {'lost_imu_odom'},
    'board_off': {'lost_imu_odom'}, 'network_cut': {'lost_imu_odom'}, 'stalls': {'stalls', 'longest_stall'},
    'gyro_bias': {'imu_drift_deg_per_min'}, 'drift': {'imu_drift_deg_per_min'},
    'mismatch': {'wheel_mismatch'}, 'slip': {'wheel_radius'},
    'separation': {'wheel_separation', 'top_turn'}, 'lag': {'motor_lag'},
    'command_latency': {'turn_delay', 'drive_delay'}, 'sensor_latency': {'sample_delay', 'turn_delay'},
}
#: Faults that begin in the middle of the drive [s].
LATE = ('imu_silent', 'odom_silent', 'imu_frozen', 'odom_frozen', 'serial_dead', 'board_off', 'network_cut',
        'motors_off')


def truth(number):
    """(kind of fault or '', settings at the start, settings of the fault, its begin [s])."""
    source = random.Random('commission {}'.format(number))
    draw = source.uniform
    mismatch = draw(-0.012, 0.012)
    given = dict(HOSTS[source.choice(['laptop', 'pi'])], **NETWORKS[source.choice(list(NETWORKS))])
    given.update(
        seed=number, imu_offset_deg=draw(-180.0, 180.0), imu_drift_deg_per_min=draw(-4.0, 4.0),
        start_yaw_deg=draw(-180.0, 180.0), imu_noise_deg=draw(0.002, 0.02), motor_lag=draw(0.02, 0.14),
        wheel_mismatch=mismatch, wheel_radius=0.033 * draw(0.98, 1.02), wheel_separation=0.16 * draw(0.96, 1.04),
        reset_pause=draw(2.4, 2.8))
    if source.random() < 2.0 / 3.0:
        return '', SimulatorConfig(**given), {}, math.inf
    kind, sign = source.choice(list(FAULTS)), source.choice([-1.0, 1.0])
    begin = draw(30.0, 120.0) if kind in LATE else 0.0
    fault = {'dropouts': dict(dropouts_per_min=draw(8.0, 30.0)),
             'stalls': dict(stalls_per_min=30.0, longest_stall=draw(0.9, 1.5)),
             'gyro_bias': dict(gyro_bias_deg=sign * draw(1.0, 40.0)),
             'drift': dict(imu_drift_deg_per_min=sign * draw(9.0, 60.0)),
             'mismatch': dict(wheel_mismatch=sign * draw(0.03, 0.08)),
             'slip': dict(slip=draw(0.1, 0.4)),
             'separation': dict(wheel_separation=0.16 * (1.0 + sign * draw(0.12, 0.3))),
             'lag': dict(motor_lag=draw(0.25, 0.6)), 'command_latency': dict(command_latency=draw(0.3, 1.0)),
             'sensor_latency': dict(sensor_latency=draw(0.2, 0.6))}.get(kind, {kind: True})
    return kind, SimulatorConfig(**given), fault, begin


#: A robot of the slowest network and the largest lag stands within this time after a key [s].
SETTLED = 4.5


class Watch:
    """Changes the robot at the begin of its fault, and watches its true place."""

    def __init__(self, fault, begin):
        self._fault, self._begin, self.farthest, self._home = fault, begin, 0.0, None

    def __call__(self, playground):
        robot = playground.robot
        if self._fault and robot.now >= self._begin:
            robot.configure(replace(robot.config, **self._fault))
            self._fault = {}
        self._home = self._home or robot.truth
        self.farthest = max(self.farthest, abs(robot.truth.x - self._home.x), abs(robot.truth.y - self._home.y))


def truths(config):
    """{number: its true value} of a robot without a fault."""
    radius, apart = config.wheel_radius * (1.0 - 0.5 * config.wheel_mismatch), config.wheel_separation
    same = ('imu_rate', 'odom_rate', 'imu_drift_deg_per_min', 'imu_noise_deg', 'imu_offset_deg', 'stamp_step',
            'sensor_latency', 'sensor_jitter', 'stalls_per_min', 'motor_lag', 'wheel_mismatch', 'reset_pause')
    true = {name: getattr(config, name) for name in same}
    if config.stalls_per_min:
        true['longest_stall'] = config.longest_stall
    seen = sample_delay(config)
    told = config.command_latency + config.command_jitter + WAIT + seen
    speed, turn = motor_speeds(0.4, 0.0, MODEL)[1], motor_speeds(0.0, 3.5, MODEL)[1]
    drive = told + config.wheel_lag
    true.update(
        wheel_radius=radius, wheel_separation=apart, turn_delay=told + config.yaw_lag, drive_delay=drive,
        turn_lag=config.motor_lag, drive_lag=config.motor_lag, imu_after_wheels=config.yaw_lag - config.wheel_lag,
        top_speed=speed * MODEL.wheel_radius, gyro_scale=1.0, time_out=COMMAND_TIMEOUT,
        wrap=2.0 * math.pi * config.odom_rate,
        top_turn=2.0 * turn * radius / apart, braking=speed * MODEL.wheel_radius * (drive + config.motor_lag))
    return true


def sample_delay(config):
    """The median delay of a sample, without the errors of the stamps and without stalls."""
    robot, delays = Simulator(replace(config, stamp_step=0.0, stalls_per_min=0.0)), []
    while robot.now < 5.0:
        delays += [robot.now - sample.stamp for sample in robot.step(0.001)]
    return sorted(delays)[len(delays) // 2] - 0.0005


def off(name, value, true):
    return difference_degrees(value, true) if name == 'imu_offset_deg' else value - true


def run(job):
    """(number, kind of fault, keys of the FAULTs, {number: (error, stated error)}, farthest [m], the same of the loop,
    missing numbers, why it ended)."""
    number, loop = job
    kind, config, fault, begin = truth(number)
    watch = Watch(fault, begin)
    recording = Playground(config, watch=watch).run()
    found = estimates(recording, MODEL)
    keys = [line.key for line in findings(recording, found, MODEL) if line.verdict == FAULT]
    errors = {} if kind else {name: (off(name, found[name].value, true), found[name].error)
                              for name, true in truths(config).items() if name in found}
    missing = [] if kind else sorted(set(truths(config)) - set(found))
    again = {}
    if loop and not kind and not keys:
        twin = estimates(driven(SimulatorConfig(**dict(settings(found, MODEL), seed=number + 5000))), MODEL)
        again = {name: (off(name, twin[name].value, found[name].value), twin[name].error + found[name].error)
                 for name in errors if name in twin}
    return number, kind, keys, errors, watch.farthest, again, missing, recording.ended


def fastest_after_key(number):
    """(moment of a key [s], fastest motion from SETTLED [s] after it on): wheels' rim speed [m/s], of any robot."""
    _, config, fault, begin = truth(number)
    moment, watch, fastest = random.Random('key {}'.format(number)).uniform(2.0, 165.0), Watch(fault, begin), 0.0

    def look(playground):
        watch(playground)
        if playground.robot.now >= moment:
            playground.ride.end(KEY, moment)
    playground = Playground(config, watch=look)
    playground.run()
    settled = playground.robot.now + SETTLED
    while playground.robot.now < settled + 6.0:
        playground.step()
        if playground.robot.now > settled:
            speed, turn = playground.robot.true_velocity
            fastest = max(fastest, abs(speed) + MODEL.half_track * abs(turn))
    return moment, fastest


def table(title, errors):
    print(title)
    for name, pairs in errors.items():
        within = sum(abs(error) <= stated for error, stated in pairs)
        print('  {:22s} {:5.1f} % of {:3d}   stated {:.5g}   root mean square {:.5g}   mean {:+.5g}'.format(
            name, 100.0 * within / len(pairs), len(pairs), sum(stated for _, stated in pairs) / len(pairs),
            math.sqrt(sum(error ** 2 for error, _ in pairs) / len(pairs)),
            sum(error for error, _ in pairs) / len(pairs)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--runs', type=int, default=200)
    parser.add_argument('--first', type=int, default=1)
    parser.add_argument('--loop', action='store_true')
    parser.add_argument('--keys', action='store_true', help='only: a key at a random moment of each drive')
    given = parser.parse_args()
    if given.keys:
        with ProcessPoolExecutor(2) as pool:
            moved = [(number, *found) for number, found in enumerate(pool.map(
                fastest_after_key, range(given.first, given.first + given.runs)), given.first) if found[1] > 0.001]
        print('{} drives ended by a key, {} moved after it: {}'.format(given.runs, len(moved), moved))
        return
    errors, loops, counts = defaultdict(list), defaultdict(list), defaultdict(int)
    with ProcessPoolExecutor(2) as pool:
        for number, kind, keys, own, farthest, again, missing, ended in pool.map(
                run, [(number, given.loop) for number in range(given.first, given.first + given.runs)]):
            counts['faulty' if kind else 'healthy'] += 1
            for name, pair in own.items():
                errors[name].append(pair)
            for name, pair in again.items():
                loops[name].append(pair)
            if missing:
                print('{}: missing {} {}'.format(number, missing, ended))
            if kind and not set(keys) & FAULTS[kind]:
                counts['not named'] += 1
                print('{}: {} was not named: {} {}'.format(number, kind, keys, ended))
            if not kind and keys:
                counts['accused'] += 1
                print('{}: healthy, but {} {}'.format(number, keys, ended))
            if farthest > 0.8:
                counts['out of the box'] += 1
                print('{}: {:.2f} m from its start ({})'.format(number, farthest, kind))
    print(', '.join('{}: {}'.format(*item) for item in counts.items()))
    table('Against the truth, within the stated error:', errors)
    if given.loop:
        table('The loop, both errors together:', loops)


if __name__ == '__main__':
    main()
