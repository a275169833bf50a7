"""The heading of one IMU: whole turns, jumps, and the age of a sample."""
import math

import pytest

from tb3_labs.localization.heading import Heading
from tb3_labs.robot.samples import ImuSample


def test_before_the_first_sample_there_is_no_heading_and_no_jump():
    heading = Heading()
    assert heading.yaw is None and heading.rate == heading.noise == 0.0
    assert heading.jump_to(ImuSample(1.0, 3.0, 0.0)) == ''


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_the_yaw_goes_on_over_whole_turns(sign):
    heading = Heading()
    for step in range(101):    # 10 rad, in steps of 0.1
        yaw = math.remainder(sign * 0.1 * step, 2.0 * math.pi)
        heading.on_imu(ImuSample(0.01 * step, yaw, sign * 10.0), 0.01 * step)
    assert heading.yaw == pytest.approx(sign * 10.0)
    assert heading.rate == sign * 10.0


def test_a_jump_is_told_before_the_sample_is_taken_in():
    heading = Heading()
    heading.on_imu(ImuSample(1.0, 3.1, 0.0), 1.0)
    assert heading.jump_to(ImuSample(1.1, -3.1, 0.0)) == ''      # across 180 degrees
    assert '92 degrees' in heading.jump_to(ImuSample(1.1, 1.5, 0.0))
    assert heading.yaw == 3.1


@pytest.mark.parametrize('turned, jumps', [
    (0.98, False), (-0.98, False), (1.02, True), (-1.02, True), (2.0 * math.pi, False)])
def test_more_than_a_radian_at_once_is_a_jump(turned, jumps):
    """A node that does not see it drives on by a heading that is not the robot's."""
    heading = Heading()
    heading.on_imu(ImuSample(1.0, 3.0, 0.0), 1.0)
    assert (heading.jump_to(ImuSample(1.1, 3.0 + turned, 0.0)) != '') is jumps


@pytest.mark.parametrize('clock_ahead', [0.0, 0.8, -300.0])
def test_the_age_counts_from_the_measurement_by_the_least_delay(clock_ahead):
    heading = Heading()
    for sent, delay in ((1.0, 0.004), (1.1, 0.0), (1.2, 0.1)):
        heading.on_imu(ImuSample(1000.0 + sent + clock_ahead, 0.0, 0.0), 1000.0 + sent + delay)
    assert heading.age(1001.31) == pytest.approx(0.11)
    assert heading.age(1000.0) == 0.0      # a clock that went back


def test_the_noise_of_a_sample_is_known():
    """Yaws of +/-0.01 rad in turns: half the mean square of their differences is 2e-4."""
    heading = Heading()
    for k in range(20):
        heading.on_imu(ImuSample(1.0 + 0.01 * k, 0.01 * (-1) ** k, 0.0), 0.01 * k)
    assert heading.noise == pytest.approx(math.sqrt(2e-4))


def test_the_heading_of_a_robot_at_rest_is_better_known_than_by_one_sample():
    """Yaws of +/-0.01 rad in turns, at rest; then it turns away, and the new yaw counts."""
    heading = Heading()
    for k in range(40):
        heading.on_imu(ImuSample(1.0 + 0.01 * k, 0.01 * (-1) ** k, 0.0), 0.01 * k)
    assert heading.yaw == -0.01
    assert heading.steady_yaw == pytest.approx(0.0, abs=0.001)
    heading.on_imu(ImuSample(1.5, 0.3, 3.0), 0.5)
    assert heading.steady_yaw == pytest.approx(0.3, abs=0.001)


def test_the_heading_at_rest_follows_a_drift():
    heading = Heading()
    for k in range(2000):    # 1 deg/min with noise of 0.1 deg, in steps of 0.03 s
        yaw = math.radians(0.03 * k / 60.0 + 0.1 * (-1) ** k)
        heading.on_imu(ImuSample(1.0 + 0.03 * k, yaw, 0.0), 0.03 * k)
    assert math.degrees(heading.steady_yaw) == pytest.approx(1.0, abs=0.03)
