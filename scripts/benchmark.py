#!/usr/bin/env python3
"""How well and how fast a drive to a goal is, in pure Python, judged by the robot's true pose.

Prints one table: both laws beside each other, on the same robots, starts, offsets and goals, all
drawn at random from a fixed seed. `at best` is the least time of any drive by a turn, a straight
line and a turn within the same limits (see tb3_labs.rollout.time_bound).

Usage: benchmark.py [number of drives, default 100]
"""
import math
import random
import statistics
import sys
from concurrent.futures import ProcessPoolExecutor

from tb3_labs.drive_laws import DriveConfig
from tb3_labs.rollout import drive, time_bound
from tb3_labs.se2 import Pose2
from tb3_labs.simulator import SimulatorConfig
from tb3_labs.turtlebot3 import robot_model

LAB_GOAL = Pose2(-0.61, 0.61, 0.0)
KINDS = [('precise, lab goal', {}, True),
         ('precise, random goals', {}, False),
         ('precise, may reverse', {'allow_reverse': True}, False),
         ("handout's law, lab goal", {'law': 'lab'}, True)]
ROW = '{:24} {:>7} {:>18} {:>16} {:>13} {:>14}'


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
    bound = time_bound(Pose2(), goal, robot_model(robot.model), config.max_linear,
                       config.max_angular, config.allow_reverse)
    return bound, drive(goal, robot, config)


def median_and_worst(values):
    """(median, largest)."""
    return statistics.median(values), max(values)


def main(drives):
    """Drive and print."""
    print(ROW.format('median / worst', 'arrived', 'distance off', 'heading off', 'time',
                     'times at best'))
    with ProcessPoolExecutor() as pool:
        for kind in KINDS:
            results = list(pool.map(one_drive, [(kind, seed) for seed in range(drives)]))
            good = [(bound, result) for bound, result in results if result.reached]
            print(ROW.format(
                kind[0], '{}/{}'.format(len(good), drives),
                '{:.1f} / {:.1f} mm'.format(*median_and_worst(
                    [1000.0 * d.distance_error for _, d in good])),
                '{:.2f} / {:.2f} deg'.format(*median_and_worst(
                    [abs(math.degrees(d.angle_error)) for _, d in good])),
                '{:.1f} / {:.1f} s'.format(*median_and_worst([d.time for _, d in good])),
                '{:.3f} / {:.3f}'.format(*median_and_worst(
                    [d.time / bound for bound, d in good]))), flush=True)


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
