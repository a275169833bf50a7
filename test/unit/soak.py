"""Hours of goals, turns and resets, many times faster than real: nothing may grow.

    python3 test/unit/soak.py [simulated hours, default 6] [seed]
"""
import gc
import math
import pathlib
import random
import sys
import time
from dataclasses import dataclass, field
from typing import List

from tb3_labs.control.driving import make_law
from tb3_labs.control.goal import DriveConfig
from tb3_labs.control.turning import TurnConfig, make_turn
from tb3_labs.geometry.angles import continuous, difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.controller import ControllerCore
from tb3_labs.nodes.move_to_goal import MoveToGoalCore
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig
from tb3_labs.supervision.arbitration import Driver

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / 'benchmark'))
from rollout import control, navigation, run    # noqa: E402

STEP = 0.1
#: Objects are counted after this number of tasks, when every history has been filled.
WARM = 6


@dataclass
class Soak:
    """The tasks and their results, in order."""

    drives: List[float] = field(default_factory=list)      # true distance to the goal [m]
    headings: List[float] = field(default_factory=list)    # true angle to the goal's [deg]
    turns: List[float] = field(default_factory=list)       # true angle off [deg]
    failures: List[str] = field(default_factory=list)
    objects: List[int] = field(default_factory=list)       # alive in Python, after each task


def soak(seconds, seed=1):
    """One robot, one node of each kind, in turns, for this number of simulated seconds."""
    chance, result = random.Random(seed), Soak()
    robot = Simulator(SimulatorConfig(imu_offset_deg=-105.5, command_latency=0.02, seed=seed))
    model = robot_model('burger')
    navigator = MoveToGoalCore(make_law(DriveConfig(), model), has_control=True)
    controller = ControllerCore(make_turn(TurnConfig(), model))
    hear_drive, hear_turn = navigation(robot, navigator), control(robot, controller)

    def hear(sample):
        hear_drive(sample)
        hear_turn(sample)
    while robot.now < seconds:
        run(robot, navigator, hear, 0.5)
        declared, goal = (Pose2(chance.uniform(-2, 2), chance.uniform(-2, 2),
                                chance.uniform(-math.pi, math.pi)) for _ in range(2))
        local_T_world = declared @ robot.truth.inverse()
        navigator.reset(declared, robot.now)
        run(robot, navigator, hear, 0.1)
        navigator.set_goal(goal)
        while navigator.status(robot.now).active:
            run(robot, navigator, hear, STEP)
        run(robot, navigator, hear, 0.5)
        here = local_T_world @ robot.truth
        result.drives.append(here.distance_to(goal))
        result.headings.append(abs(math.degrees(difference(here.yaw, goal.yaw))))
        if navigator.status(robot.now).failure:
            result.failures.append(navigator.status(robot.now).failure)

        angle, start = chance.choice((90.0, -90.0, 180.0)), robot.truth.yaw
        run(robot, controller, hear, 0.3)
        controller.ask(angle, robot.now)
        yaw = start
        while controller.driver is Driver.TURN:
            run(robot, controller, hear, STEP)
            yaw = continuous(robot.truth.yaw, yaw)
        run(robot, controller, hear, 0.5)
        turned = math.degrees(continuous(robot.truth.yaw, yaw) - start)
        # a drive followed the turn before: no error is carried over from it
        result.turns.append(abs(turned - angle))
        result.failures += [news.text for news in controller.take_news() if news.warning]
        navigator.take_news()
        if len(result.drives) >= WARM:
            gc.collect()
            result.objects.append(len(gc.get_objects()))
    return result


def main(hours, seed):
    """Soak and print."""
    begun = time.monotonic()
    result = soak(3600.0 * hours, seed)
    took = time.monotonic() - begun
    parts = 4
    print('{} drives and turns in {:.1f} simulated hours, {:.0f} times real time; {} failures'.format(
        len(result.drives), hours, 3600.0 * hours / took, len(result.failures)))
    for name, values, unit in (('drive', [1000.0 * value for value in result.drives], 'mm'),
                               ('heading', result.headings, 'deg'), ('turn', result.turns, 'deg'),
                               ('objects', result.objects, '')):
        size = max(1, len(values) // parts)
        print('{:8} worst of each quarter: {}'.format(name, ', '.join(
            '{:.6g} {}'.format(max(values[part * size:(part + 1) * size]), unit)
            for part in range(parts))))


if __name__ == '__main__':
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 6.0,
         int(sys.argv[2]) if len(sys.argv) > 2 else 1)
