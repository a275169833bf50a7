"""Accuracy and time of drives and turns, in pure Python, judged by the robot's true pose.

The rows are those of measured.md and failures.md. Robots, starts, offsets and goals are drawn at random from a fixed
seed. The shortest time of a drive is the time of a turn, a straight line and a turn within the same limits. The
shortest time of a turn is its angle at 1.5 rad/s. A motion ends when the robot stays slower than 0.001 m/s and
0.01 rad/s. `falsely` is the number of drives that the node reported as reached while the robot still moved, or was
outside of the tolerance.

Usage: motions.py [number of drives of each kind, default 100]
"""
import math
import random
import statistics
import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import product

from stops import setting, stop_of_a_drive, stop_of_a_turn
from rollout import drive, least_time, turns

from tb3_labs.control.drive_law import DriveConfig
from tb3_labs.control.goal_state import DRIVING, GoalState
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

CONFIG, BURGER = DriveConfig(), robot_model('burger')
LAB_GOAL = Pose2(-0.61, 0.61, 0.0)
#: (name, settings of the robot or None for random delays of up to 70 ms, is the goal the lab's?)
DRIVES = [('to the goal of the lab', None, True), ('to random goals', None, False),
          ('over the network busy', NETWORKS['busy'], True), ('over the network bad', NETWORKS['bad'], True)]
#: Latency of commands and lag of the motors in a turn [s].
SLOW = {'command_latency': 0.05, 'motor_lag': 0.05}
#: Each turn begins at each of these headings [deg], in both directions, TURN_REPEATS times.
TURN_STARTS = 0.0, 90.0, 179.0, -179.0
TURN_REPEATS = 6
#: (name, fault, does the fault also end a turn by the IMU alone?)
FAULTS = [('IMU silent', setting(imu_silent=True), True),
          ('odometry silent', setting(odom_silent=True), False),
          ('both silent', setting(imu_silent=True, odom_silent=True), True),
          ('IMU frozen', setting(imu_frozen=True), True),
          ('odometry frozen', setting(odom_frozen=True), False),
          ('motors off', setting(motors_off=True), True),
          ("the robot's own reset", Simulator.reset, True)]
MOTION_ROW = '{:24} {:>8} {:>8} {:>16} {:>17} {:>14}'
FAULT_ROW = '{:24} {:>10} {:>10} {:>12} {:>12}'


def one_drive(job):
    """Returns (shortest time [s], rollout.Drive) of a kind of drive and a seed."""
    (_, settings, is_to_lab_goal), seed = job
    rng = random.Random(seed)
    if settings is None:
        settings = dict(command_latency=rng.uniform(0.0, 0.05), sensor_latency=rng.uniform(0.0, 0.02))
    robot = SimulatorConfig(
        start_x=rng.uniform(-5.0, 5.0), start_y=rng.uniform(-5.0, 5.0), start_yaw_deg=rng.uniform(-180.0, 180.0),
        imu_offset_deg=rng.uniform(-180.0, 180.0), seed=seed, **settings)
    goal = LAB_GOAL if is_to_lab_goal else Pose2(
        rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0), rng.uniform(-math.pi, math.pi))
    return least_time(Pose2(), goal, BURGER, CONFIG.max_linear, CONFIG.max_angular), drive(goal, robot, CONFIG)


def is_said_falsely(made):
    """Did a node report a goal that it had not reached?"""
    is_there = made.distance_error <= CONFIG.distance_tolerance and abs(
        math.degrees(made.angle_error)) <= CONFIG.angle_tolerance_deg
    return made.reached and not (made.rested and is_there)


def one_turn(job):
    """Returns (error [deg], time over the shortest time) of a turn [deg], its start [deg] and a seed."""
    degrees, start, seed = job
    rng = random.Random(seed)
    robot = SimulatorConfig(
        start_yaw_deg=start, imu_offset_deg=rng.uniform(-180.0, 180.0), seed=seed,
        imu_drift_deg_per_min=rng.choice((-1.0, 1.0)), **SLOW)
    turn, = turns([degrees], robot, wait=0.3 + 0.1 * rng.random())
    return abs(math.degrees(turn.turned) - degrees), turn.time / (math.radians(abs(degrees)) / 1.5)


def spread(form, values):
    """Returns the median and the largest value."""
    return form.format(statistics.median(values), max(values))


def rows_of_motions(pool, number):
    """Yields the table of measured.md."""
    yield MOTION_ROW.format('median / worst', 'arrived', 'falsely', 'place', 'heading', 'time/shortest')
    for kind in DRIVES:
        name, _, _ = kind
        made = list(pool.map(one_drive, [(kind, seed) for seed in range(number)]))
        good = [(least, each) for least, each in made if each.reached]
        yield MOTION_ROW.format(
            name, len(good), sum(is_said_falsely(each) for _, each in made),
            spread('{:.1f} / {:.1f} mm', [1000.0 * each.distance_error for _, each in good]),
            spread('{:.2f} / {:.2f} deg', [abs(math.degrees(each.angle_error)) for _, each in good]),
            spread('{:.2f} / {:.2f}', [each.time / least for least, each in good]))
    for degrees in 90.0, 180.0:
        turns_and_starts = product(TURN_STARTS, (degrees, -degrees), range(TURN_REPEATS))
        cases = [(turn, start, seed) for seed, (start, turn, _) in enumerate(turns_and_starts)]
        made = list(pool.map(one_turn, cases))
        yield MOTION_ROW.format('turns by {:.0f} deg'.format(degrees), len(cases), '', '',
                                spread('{:.2f} / {:.2f} deg', [error for error, _ in made]),
                                spread('{:.2f} / {:.2f}', [time for _, time in made]))


def rows_of_faults():
    """Yields the table of motions that end by a fault: the worst of all states."""
    yield '\n' + FAULT_ROW.format('the worst', 'zero after', 'rest after', 'driven on', 'turned on')
    for name, fault, is_in_turns in FAULTS:
        stops = [stop_of_a_drive(GoalState[state], fault) for state in DRIVING]
        stops += [stop_of_a_turn(fault)] if is_in_turns else []
        yield FAULT_ROW.format(
            name, '{:.2f} s'.format(max(stop.to_zero for stop in stops)),
            '{:.2f} s'.format(max(stop.to_rest for stop in stops)),
            '{:.0f} mm'.format(1000.0 * max(stop.way for stop in stops)),
            '{:.0f} deg'.format(math.degrees(max(stop.turn for stop in stops))))


def main(number=100):
    """Drive, turn and print. `number` is the number of drives of each kind."""
    with ProcessPoolExecutor() as pool:
        for row in rows_of_motions(pool, number):
            print(row, flush=True)
    for row in rows_of_faults():
        print(row, flush=True)


if __name__ == '__main__':
    _, *words = sys.argv
    main(*map(int, words))
