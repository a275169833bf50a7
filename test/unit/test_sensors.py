"""The simulated IMU alone, in closed form."""
import math

import pytest

from tb3_labs.simulation.imu import ImuModel, TurnCurve


def imu(offset=0.0, **how):
    model = ImuModel(0.0, offset, 1)
    model.configure(**dict(dict(yaw_noise=0.0, turn_rate_noise=0.0, drift=0.0, sample_age=0.0), **how))
    return model


def test_offset_and_drift_add_up_in_the_yaw_and_the_drift_in_the_rate():
    model = imu(0.5, drift=0.01)
    model.add_motion(20.0, TurnCurve(0.3, 0.1, 0.0, 0.0))
    sample, later = model.measure([20.0, 21.0])
    assert (sample.stamp, sample.yaw, sample.yaw_rate) == pytest.approx((20.0, 1.0, 0.11))
    assert (later.stamp, later.yaw, later.yaw_rate) == pytest.approx((21.0, 1.11, 0.11))
    model.add_motion(21.0, TurnCurve(0.0, 0.0, 0.0, 0.0))
    model.configure(0.0, 0.0, -0.02, 0.0)   # it drifts the other way from then on
    model.add_motion(23.0, TurnCurve(0.0, 0.0, 0.0, 0.0))
    assert model.measure([23.0])[0].yaw == pytest.approx(0.5 + 0.21 - 0.04)


def test_yaw_and_rate_are_older_than_the_stamp_by_the_lag_over_several_motions():
    model = imu(sample_age=0.08)
    for since, yaw, rate in ((0.1, 0.0, 1.0), (0.13, 0.03, -2.0), (0.16, -0.03, 0.0)):
        model.add_motion(since, TurnCurve(yaw, rate, 0.0, 0.0))
    assert [(sample.yaw, sample.yaw_rate)
            for sample in model.measure([0.05, 0.17, 0.20, 0.22, 0.26])] == [
        pytest.approx(pair, abs=1e-12)
        for pair in ((0.0, 0.0), (0.0, 0.0), (0.02, 1.0), (0.01, -2.0), (-0.03, 0.0))]


@pytest.mark.parametrize('yaw, said', [
    (math.pi, math.pi), (-math.pi, math.pi), (3.0 * math.pi, math.pi), (3.2, 3.2 - 2.0 * math.pi),
    (-3.2, 2.0 * math.pi - 3.2), (2.0 * math.pi, 0.0), (100.0, 100.0 - 32.0 * math.pi)])
def test_the_yaw_is_in_its_half_open_circle(yaw, said):
    model = imu()
    model.add_motion(0.0, TurnCurve(yaw, 0.0, 0.0, 0.0))
    sample, = model.measure([0.0])
    assert sample.yaw == pytest.approx(said, abs=1e-12) and -math.pi < sample.yaw <= math.pi


@pytest.mark.parametrize('rate, how, shown', [
    (0.0, {'turn_rate_noise': 0.001}, 0.0), (0.00319, {}, 0.0), (-0.00319, {}, 0.0),
    (0.0032, {}, 0.0032), (-0.0032, {}, -0.0032), (0.0, {'drift': 0.002}, 0.002)])
def test_the_gyros_dead_zone_is_3_steps_of_2000_deg_s_over_16_bit(rate, how, shown):
    """3 steps are 0.1831 deg/s, or 0.003196 rad/s. The dead zone does not change the yaw."""
    model = imu(**how)
    model.add_motion(0.0, TurnCurve(0.0, rate, 0.0, 0.0))
    for sample in model.measure([0.01 * k for k in range(500)]):
        assert sample.yaw_rate == pytest.approx(shown, abs=1e-15)
        assert sample.yaw == pytest.approx((rate + how.get('drift', 0.0)) * sample.stamp)
