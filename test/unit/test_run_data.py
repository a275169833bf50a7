"""Samples and poses as arrays: yaws at any time, and products of poses."""
import math

import numpy as np
import pytest

from made_run import imu_samples

from tb3_labs.geometry.angles import WHOLE_TURN
from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import Poses


def test_a_yaw_is_interpolated_across_half_a_turn():
    times, yaws = np.array([0.0, 1.0, 2.0]), np.array([3.0, -3.0, -2.0])
    for samples in (imu_samples(times, times, yaws, 0.0 * times), Poses(times, times, times, times, yaws)):
        assert samples.yaw_at([0.5, 1.0, 2.0]) == pytest.approx(
            [math.pi, WHOLE_TURN - 3.0, WHOLE_TURN - 2.0])
        assert samples.yaw_at([-5.0, 9.0]) == pytest.approx([3.0, WHOLE_TURN - 2.0])


# Poses as arrays give the results of Pose2 ---------------------------------------------------------------

A = [Pose2(1.0, -2.0, 0.5), Pose2(0.3, 4.0, 3.0), Pose2(-1.0, 0.0, -2.8)]
B = [Pose2(0.1, 0.2, 1.0), Pose2(-3.0, 1.0, 0.7), Pose2(2.0, 2.0, -0.9)]


def arrays(these, time=(1.0, 2.0, 4.0)):
    time = np.array(time)
    return Poses(time, time, *np.array([(pose.x, pose.y, pose.yaw) for pose in these]).T)


def assert_are(poses, expected):
    for k, pose in enumerate(expected):
        assert (poses.x[k], poses.y[k]) == pytest.approx((pose.x, pose.y))
        assert wrap_all(poses.yaw[k] - pose.yaw) == pytest.approx(0.0, abs=1e-12)
        assert -math.pi <= poses.yaw[k] < math.pi


def test_products_inverses_and_parents_of_many_poses():
    assert_are(arrays(A) @ arrays(B), [a @ b for a, b in zip(A, B)])
    assert_are(arrays(A).inverse(), [a.inverse() for a in A])
    assert_are(arrays(A).in_parent(B[0]), [B[0] @ a for a in A])
    assert np.array_equal((arrays(A) @ arrays(B)).time, [1.0, 2.0, 4.0])


@pytest.mark.parametrize('time, share, pair', [
    (1.5, 0.5, (0, 1)), (3.5, 0.75, (1, 2)), (0.0, 0.0, (0, 1)), (9.0, 1.0, (1, 2)),
    (2.0, 0.0, (1, 2))])
def test_a_pose_between_two(time, share, pair):
    here, (before, after) = arrays(A).pose_at(time), (A[k] for k in pair)
    assert (here.x, here.y) == pytest.approx((before.x + share * (after.x - before.x),
                                              before.y + share * (after.y - before.y)))
    turned = float(wrap_all(after.yaw - before.yaw))
    assert float(wrap_all(here.yaw - before.yaw - share * turned)) == pytest.approx(0.0, abs=1e-9)
