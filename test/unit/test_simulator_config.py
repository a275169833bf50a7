"""The settings of the simulated robot: at the start, while it runs, and invalid ones."""
from dataclasses import fields

import pytest
from simulated import QUIET, close, drive, switch

from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import FAULTS, STARTING, SimulatorConfig


def test_what_belongs_to_the_start_cannot_change_later():
    robot = Simulator()
    other = {'model': 'waffle', 'start_x': 1.0, 'start_y': 1.0, 'start_yaw_deg': 1.0,
             'imu_offset_deg': 1.0, 'cold_start': True, 'start_time': 2.0,
             'seed': 2}
    assert set(other) == set(STARTING)
    for name, value in other.items():
        with pytest.raises(ValueError, match=name):
            switch(robot, **{name: value})
    assert robot.config == SimulatorConfig()


@pytest.mark.parametrize('name', sorted(
    {item.name for item in fields(SimulatorConfig)} - set(STARTING) - set(FAULTS)
    - {'network_cut'}))
def test_physics_may_change_while_it_drives(name):
    """Nothing jumps: the motion so far is kept."""
    robot = Simulator(QUIET)
    drive(robot, 1.0, 0.1, 0.5)
    robot.step(0.013)   # between two ticks of the board
    truth = robot.truth
    value = getattr(robot.config, name)
    changed = (not value) if isinstance(value, bool) else 0.3 + value / 2.0 if value < 1 else 20.0
    changed = {'reset_pause': 1.0, 'stamp_step': 0.1}.get(name, changed)
    switch(robot, **{name: changed})
    assert close(robot.truth, truth, metres=1e-6, radians=1e-6)
    assert drive(robot, 1.0, 0.1, 0.5)
