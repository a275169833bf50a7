"""The heading of one IMU: whole turns, jumps, and the age of a sample."""
import math
import random

import pytest

from tb3_labs.geometry.angles import WHOLE_TURN
from tb3_labs.localization.sample_timing import SampleTiming, YawNoise
from tb3_labs.nodes.controller.turns import Heading
from tb3_labs.robot.samples import ImuSample, heading_jump
from timed_part import TimedPart


@pytest.mark.parametrize('turned, said', [
    (0.98, ''), (-0.98, ''), (1.02, '58 degrees'), (-1.02, '58 degrees'), (2.0 * math.pi, '')])
def test_more_than_a_radian_at_once_is_a_jump(turned, said):
    """A node that does not notice the jump drives on by a wrong heading."""
    jump = heading_jump(ImuSample(1.0, 3.0, 0.0),
                        ImuSample(1.1, math.remainder(3.0 + turned, WHOLE_TURN), 0.0))
    assert said in jump and bool(said) == bool(jump)
    assert heading_jump(None, ImuSample(1.1, 3.0, 0.0)) == ''


def test_the_heading_of_a_robot_at_rest_is_better_known_than_by_one_sample():
    """Yaws of +/-0.01 rad in turns, at rest; then it turns away, and the new yaw is used."""
    heading = TimedPart(Heading())
    for k in range(40):
        heading.on_imu(ImuSample(1.0 + 0.01 * k, 0.01 * (-1) ** k, 0.0), 0.01 * k)
    assert heading.yaw == -0.01
    assert heading.noise == pytest.approx(math.sqrt(2e-4))    # half the mean square of their steps
    assert heading.steady_yaw == pytest.approx(0.0, abs=0.001)
    heading.on_imu(ImuSample(1.5, 0.3, 3.0), 0.5)
    assert heading.steady_yaw == pytest.approx(0.3, abs=0.001)


def test_the_heading_at_rest_follows_a_drift():
    heading = TimedPart(Heading())
    for k in range(2000):    # 1 deg/min with noise of 0.1 deg, in steps of 0.03 s
        yaw = math.radians(0.03 * k / 60.0 + 0.1 * (-1) ** k)
        heading.on_imu(ImuSample(1.0 + 0.03 * k, yaw, 0.0), 0.03 * k)
    assert math.degrees(heading.steady_yaw) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize('noise_deg', [0.0, 0.005, 0.1, 0.3, 2.0])
@pytest.mark.parametrize('rate', [0.0, 0.1])
def test_the_noise_of_an_imu_is_measured_while_it_turns_slowly(noise_deg, rate):
    chance, noise, timing = random.Random(1), YawNoise(), SampleTiming()
    for k in range(400):
        time = 0.03 * k
        yaw = 3.0 + rate * time + math.radians(chance.gauss(0.0, noise_deg))
        noise.learn(timing.on_imu(
            ImuSample(1.0 + time, math.remainder(yaw, 2.0 * math.pi), rate), time))
    assert math.degrees(noise.deviation) == pytest.approx(noise_deg, rel=0.3, abs=1e-6)


@pytest.mark.parametrize('rates', [(0.3, 0.3), (0.0, 0.05)])     # fast, and unevenly slow
def test_only_a_robot_that_turns_slowly_and_evenly_shows_the_noise(rates):
    noise, timing = YawNoise(), SampleTiming()
    for k in range(20):
        noise.learn(timing.on_imu(
            ImuSample(1.0 + 0.01 * k, 0.02 * (k % 2), rates[k % 2]), 0.01 * k))
    assert noise.deviation == 0.0
