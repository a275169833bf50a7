"""Accuracy and time of drives and turns, in pure Python, judged by the robot's true pose.

The tables are drives, drives over networks, turns, and motions in which something fails. Robots, starts, offsets and
goals are drawn at random from a fixed seed. `at best` is, for a drive, the least time of any turn, straight line and
turn within the same limits (tb3_labs.control.goal_state); for a turn, its angle at 1.5 rad/s. The time of a turn ends
when the robot turns slower than 0.01 rad/s for good. `falsely` counts drives that were reported as reached while the
robot still moved, or was outside of the tolerance.

Usage: motions.py [number of drives of each kind, default 100]
"""
import itertools
import math
import random
import statistics
import sys
from concurrent.futures import ProcessPoolExecutor

from stops import setting, stop_of_a_drive, stop_of_a_turn
from rollout import drive, least_time, turns

from tb3_labs.control.goal_state import DRIVING, DriveConfig, GoalState
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

LAB_GOAL = Pose2(-0.61, 0.61, 0.0)
DRIVES = [('lab goal', {}, True), ('random goals', {}, False)]
DRIVE_ROW = '{:24} {:>7} {:>18} {:>16} {:>13} {:>14}'

#: Size of the turn [deg], latency of commands [s], lag of the motors [s].
TURNS = [(degrees, latency, lag)
         for latency, lag in ((0.05, 0.05), (0.0, 0.0)) for degrees in (90, 180)]
#: Headings at the start [deg]; both ways round from each.
TURN_STARTS = (0.0, 90.0, 179.0, -179.0)
#: Number of runs of each turn from each start.
TURN_REPEATS = 6
TURN_ROW = '{:>7} {:>8} {:>6}   {:>16} {:>15} {:>14} {:>16}'

#: Networks from quiet to bad, and an IMU that is slow.
ROBOTS_AFAR = [('quiet', {}), ('8 ms', NETWORKS['good']),
               ('15 ms, 20 stalls/min to 0.3 s', NETWORKS['busy']),
               ('30 ms, 40 stalls/min to 0.5 s', NETWORKS['bad']),
               ('IMU at 60 Hz', {'imu_rate': 60.0})]
NETWORK_ROW = '{:29} {:>12} {:>20} {:>21} {:>14} {:>8}'

#: Name, fault, and whether it also ends a turn by the IMU alone.
FAULTS = [('IMU silent', setting(imu_silent=True), True),
          ('odometry silent', setting(odom_silent=True), False),
          ('both silent', setting(imu_silent=True, odom_silent=True), True),
          ('IMU frozen', setting(imu_frozen=True), True),
          ('odometry frozen', setting(odom_frozen=True), False),
          ('motors off', setting(motors_off=True), True),
          ("the robot's own reset", Simulator.reset, True)]
FAULT_ROW = '{:24} {:>10} {:>10} {:>12} {:>12}'


def one_drive(job):
    """(least time [s], rollout.Drive) for a kind of drive and a seed."""
    (_, options, to_lab_goal), seed = job
    rng = random.Random(seed)
    robot = SimulatorConfig(
        start_x=rng.uniform(-5.0, 5.0), start_y=rng.uniform(-5.0, 5.0),
        start_yaw_deg=rng.uniform(-180.0, 180.0), imu_offset_deg=rng.uniform(-180.0, 180.0),
        command_latency=rng.uniform(0.0, 0.05), sensor_latency=rng.uniform(0.0, 0.02), seed=seed)
    goal = LAB_GOAL if to_lab_goal else Pose2(
        rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0), rng.uniform(-math.pi, math.pi))
    config = DriveConfig(**options)
    bound = least_time(Pose2(), goal, robot_model(robot.model), config.max_linear,
                       config.max_angular)
    return bound, drive(goal, robot, config)


def one_drive_afar(job):
    """rollout.Drive to the lab's goal over a network."""
    (_, settings), seed = job
    rng = random.Random(seed)
    yaw_deg, offset_deg = rng.uniform(-180.0, 180.0), rng.uniform(-180.0, 180.0)
    return drive(LAB_GOAL, SimulatorConfig(
        start_x=rng.uniform(-5.0, 5.0), start_y=rng.uniform(-5.0, 5.0), start_yaw_deg=yaw_deg,
        imu_offset_deg=offset_deg, seed=seed, **settings))


def is_said_falsely(result, config=DriveConfig()):
    """Did a node report a goal that it had not reached?"""
    return result.reached and not (
        result.rested and result.distance_error <= config.distance_tolerance
        and abs(math.degrees(result.angle_error)) <= config.angle_tolerance_deg)


def one_turn(job):
    """(error, overshoot, way left [deg], time over the least) of a kind of turn and a seed."""
    (degrees, latency, lag), (start, direction, seed) = job
    rng = random.Random(seed)
    robot = SimulatorConfig(
        start_yaw_deg=start, imu_offset_deg=rng.uniform(-180.0, 180.0), seed=seed,
        imu_drift_deg_per_min=rng.choice((-1.0, 1.0)), command_latency=latency, motor_lag=lag)
    turn, = turns([direction * degrees], robot, wait=0.3 + 0.1 * rng.random())
    left = degrees - abs(math.degrees(turn.turned))
    return (abs(left), math.degrees(turn.overshoot), left,
            turn.time / (math.radians(degrees) / 1.5))


def spread(words, values):
    """`words` with the median and the largest value, and between them, if there is a place, the one
    that 95 % do not exceed."""
    values = sorted(values)
    figures = [statistics.median(values), values[-1]]
    if words.count('{') == 3:
        figures.insert(1, values[int(0.95 * (len(values) - 1))])
    return words.format(*figures)


def drives_off(drives, places):
    """Cells: how far drives ended from their goals, and by which angle."""
    return (spread(' / '.join(places * ['{:.1f}']) + ' mm',
                   [1000.0 * drive.distance_error for drive in drives]),
            spread(' / '.join(places * ['{:.2f}']) + ' deg',
                   [abs(math.degrees(drive.angle_error)) for drive in drives]))


def rows_of_drives(pool, number):
    """The table of drives."""
    yield DRIVE_ROW.format('median / worst', 'arrived', 'distance off', 'heading off', 'time',
                           'times at best')
    for kind in DRIVES:
        results = pool.map(one_drive, [(kind, seed) for seed in range(number)])
        bounds, good = zip(*[(bound, result) for bound, result in results if result.reached])
        yield DRIVE_ROW.format(
            kind[0], '{}/{}'.format(len(good), number), *drives_off(good, 2),
            spread('{:.1f} / {:.1f} s', [drive.time for drive in good]),
            spread('{:.3f} / {:.3f}', [drive.time / bound for bound, drive in zip(bounds, good)]))


def rows_of_drives_afar(pool, number):
    """The table of drives over networks."""
    bound = least_time(Pose2(), LAB_GOAL, robot_model('burger'),
                       max_angular=DriveConfig().max_angular)
    yield '\n' + NETWORK_ROW.format('over a network', 'arrived', 'off', 'heading off', 'times at best',
                                    'falsely')
    for network in ROBOTS_AFAR:
        results = list(pool.map(one_drive_afar, [(network, seed) for seed in range(number)]))
        good = [result for result in results if result.reached]
        yield NETWORK_ROW.format(
            network[0], '{}/{}'.format(len(good), number),
            *drives_off(good, 3), spread('{:.3f} / {:.3f}', [drive.time / bound for drive in good]),
            sum(map(is_said_falsely, results)))


def rows_of_turns(pool):
    """The table of turns."""
    yield '\n' + TURN_ROW.format('deg', 'latency', 'lag', 'off', 'overshoot',
                                 'short by', 'times at best')
    cases = [(start, direction, seed) for seed, (start, direction, _) in enumerate(
        itertools.product(TURN_STARTS, (1.0, -1.0), range(TURN_REPEATS)))]
    for degrees, latency, lag in TURNS:
        off, overshoot, left, time = zip(*pool.map(
            one_turn, [((degrees, latency, lag), case) for case in cases]))
        yield TURN_ROW.format(
            degrees, '{:.0f} ms'.format(1000.0 * latency), '{:.0f} ms'.format(1000.0 * lag),
            spread('{:.2f} / {:.2f} deg', off), spread('{:.2f} / {:.2f}', overshoot),
            '{:.2f} deg'.format(statistics.median(left)), spread('{:.3f} / {:.3f}', time))


def rows_of_faults():
    """The table of motions that end by a fault."""
    yield '\n' + FAULT_ROW.format('worst of all states', 'zero after', 'rest after', 'driven on',
                                  'turned on')
    for name, fault, in_turns in FAULTS:
        stops = [stop_of_a_drive(GoalState[state], fault) for state in DRIVING]
        stops += [stop_of_a_turn(fault)] if in_turns else []
        yield FAULT_ROW.format(
            name, '{:.2f} s'.format(max(stop.to_zero for stop in stops)),
            '{:.2f} s'.format(max(stop.to_rest for stop in stops)),
            '{:.0f} mm'.format(1000.0 * max(stop.way for stop in stops)),
            '{:.0f} deg'.format(math.degrees(max(stop.turn for stop in stops))))


def main(number):
    """Drive, turn and print."""
    with ProcessPoolExecutor() as pool:
        for row in itertools.chain(
                rows_of_drives(pool, number), rows_of_drives_afar(pool, number),
                rows_of_turns(pool), rows_of_faults()):
            print(row, flush=True)


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
