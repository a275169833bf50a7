"""A test drive of the simulated robot in virtual time: the commissioning is tried on it, and the
page compares the real robot with the simulated one that has its numbers.

The tape measure and the mark on the floor are played by the true pose.
"""
import math
import random
from typing import Callable, Dict, Optional, Sequence, Tuple

from tb3_labs.commissioning.recording import Recording
from tb3_labs.commissioning.ride import Order, Phase, Ride
from tb3_labs.commissioning.steps import STEPS, Step
from tb3_labs.geometry.angles import difference
from tb3_labs.robot.samples import OdometrySample, WheelSample
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: Step of the virtual time [s].
STEP = 1.0 / 200.0
#: A person reads the mark and the tape measure to this: standard deviation [deg], [m].
READING = 1.0, 0.001
#: Time that the person needs before each step [s].
PATIENCE = 1.0


class Playground:
    """A simulated robot, its test drive, and its true motion."""

    def __init__(self, config: SimulatorConfig, steps: Sequence[Step] = STEPS,
                 watch: Callable[['Playground'], None] = lambda playground: None) -> None:
        self.robot, self.recording = Simulator(config), Recording()
        self.ride = Ride(self.recording, steps)
        self._watch, self._person = watch, random.Random(config.seed)
        #: The latest order, the true turn [rad] without jumps, and the true way in a straight line.
        self.order = Order()
        self.turned = 0.0
        self._before = (0.0, 0.0, 0.0)
        self._announced = 0.0
        #: {stamp of an odometry: (left, right) angle of the wheels [rad]}
        self._wheels: Dict[float, Tuple[float, float]] = {}

    def run(self) -> Recording:
        """Drive until everything is over; returns what was recorded."""
        while not self.ride.is_over:
            self.step()
        return self.recording

    def step(self) -> None:
        """Let one STEP pass."""
        robot, ride, yaw = self.robot, self.ride, self.robot.truth.yaw
        samples, sensors = robot.step_with_arrivals(STEP), robot.sensors
        self._wheels.setdefault(sensors.odometry_stamp, sensors.odometer.wheel_angles)
        for arrival, sample in samples:
            ride.hear(sample, arrival)
            if isinstance(sample, OdometrySample) and sample.stamp in self._wheels:
                ride.hear(WheelSample(sample.stamp, *self._wheels[sample.stamp]), arrival)
        self.turned += difference(robot.truth.yaw, yaw)
        self._watch(self)
        if ride.phase is Phase.ANNOUNCED and robot.now - self._announced > PATIENCE:
            self._before = robot.truth.x, robot.truth.y, self.turned
            ride.enter(robot.now)
        elif ride.phase is Phase.ASKING:
            ride.answer(self._read(), robot.now)
        if ride.phase is not Phase.ANNOUNCED:
            self._announced = robot.now
        self.order = ride.tick(robot.now)
        if self.order.reset:
            robot.reset()
        if self.order.command is not None:
            robot.command(*self.order.command)

    def _read(self) -> float:
        """The number that the person types."""
        x, y, turned = self._before
        if self.ride.step.name == 'rounds':
            over = math.degrees(self.turned - turned) - 3600.0
            return round(over + self._person.gauss(0.0, READING[0]))
        way = math.hypot(self.robot.truth.x - x, self.robot.truth.y - y)
        return round(100.0 * (way + self._person.gauss(0.0, READING[1])), 1)


def driven(config: SimulatorConfig, steps: Optional[Sequence[Step]] = None) -> Recording:
    """The recording of a test drive of a simulated robot."""
    return Playground(config, STEPS if steps is None else steps).run()
