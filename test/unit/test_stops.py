"""The time and the true place of the stop for each fault, in each state of a drive and in a turn."""
import pytest
from stops import ROBOT, setting, stop_of_a_drive, stop_of_a_turn

from tb3_labs.control.goal_state import DRIVING, GoalState
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.supervision.timeouts import FROZEN_TIME

FASTEST, MAX_TURN_RATE = 0.2108, 1.5     # [m/s], [rad/s]
#: Time from a zero command to rest: its delay, the firmware's period, five times the motors' lag.
COASTING = ROBOT.command_latency + 1.0 / 30.0 + 5.5 * ROBOT.motor_lag
SILENCE = 0.3
#: Longest time from the begin of a stall to its notice [s], as required.
STUCK = 2.0


def stops(fault):
    """(motion, Stop) for every motion that needs the failing part."""
    for state in DRIVING:
        yield state, stop_of_a_drive(GoalState[state], fault)
    yield 'turn', stop_of_a_turn(fault, degrees=179.0)


def assert_stands(stop, within):
    assert stop.to_zero <= within
    assert stop.to_rest <= within + COASTING
    assert stop.way <= FASTEST * (within + COASTING)
    assert stop.turn <= MAX_TURN_RATE * (within + COASTING)


@pytest.mark.parametrize('lost', [('imu',), ('odom',), ('imu', 'odom')])
def test_silence(lost):
    for motion, stop in stops(setting(**{name + '_silent': True for name in lost})):
        if motion == 'turn' and 'imu' not in lost:
            assert stop.reason == ''          # a turn by the IMU needs no odometry
            continue
        assert_stands(stop, SILENCE)
        assert all('no ' + name in stop.reason for name in lost if motion != 'turn'), (motion, stop)


@pytest.mark.parametrize('lost', ['imu', 'odom'])
def test_a_frozen_sensor(lost):
    for motion, stop in stops(setting(**{lost + '_frozen': True})):
        if motion == 'turn' and lost == 'odom':
            continue
        # a step, twice, and samples that are under way
        assert_stands(stop, FROZEN_TIME + 0.04 + 0.04 + 0.05)
        assert 'repeats one reading' in stop.reason, (motion, stop)


def test_motors_that_do_nothing():
    for motion, stop in stops(setting(motors_off=True)):
        assert stop.to_zero <= STUCK, (motion, stop)
        assert stop.way <= FASTEST * COASTING and stop.turn <= MAX_TURN_RATE * COASTING
        assert 'does not move' in stop.reason


def test_wheels_that_spin_without_turning_the_robot():
    for motion, stop in stops(setting(slip=1.0)):
        if motion != 'MOVE_FORWARD':     # there the wheels' odometry shows a drive
            assert stop.to_zero <= STUCK and 'does not move' in stop.reason, (motion, stop)


def test_the_robots_own_reset():
    """While the board is busy, the motors run on: no zero command reaches them."""
    for motion, stop in stops(Simulator.reset):
        assert stop.to_zero <= SILENCE
        assert ROBOT.reset_pause < stop.to_rest <= 2.6 + 1.0 / 30.0 + COASTING
