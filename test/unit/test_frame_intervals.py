"""Where an interval begins by the log and by local_pose, with and without tf, against known resets."""
import math
from dataclasses import replace

import numpy as np
import pytest
from known_motion import angle_between
from made_run import TIME, X, made, poses, reset_lines
from recorded_run import MISS, MISS_DEG, RESET, frame_at, in_degrees, run  # noqa: F401

from tb3_labs.recording.run_data import Poses
from tb3_labs.report.motion.drives import frame_interval_of
from tb3_labs.report.motion.resets_and_goals import frame_intervals


def resets(run):
    """The times after which the run's resets come, each within one interval of the odometry."""
    return [pytest.approx(interval.begin + 0.025, abs=0.026) for interval in frame_intervals(run)[1:]]


@pytest.mark.parametrize('has_tf', [True, False])
def test_a_reset_is_found_by_tf_and_by_local_pose(run, has_tf):
    run = run if has_tf else replace(run, frames=Poses.none())
    assert [RESET] == resets(run)
    for interval, time in zip(frame_intervals(run), (0.0, RESET)):
        place, yaw = frame_at(time)
        assert (interval.odom_T_local.x, interval.odom_T_local.y) == pytest.approx(
            (place.real, place.imag), abs=1e-6)
        assert angle_between(interval.odom_T_local.yaw, yaw) < 1e-6


# By hand ------------------------------------------------------------------------------------------

def shifted(metres, at=8.0, line=8.0):
    """Only local_pose jumps, while the robot stands. The log has a line on the jump."""
    return made(local_pose=poses(X + np.where(TIME > at - 0.01, metres, 0.0)),
                resets=reset_lines(line))


@pytest.mark.parametrize('line', [7.75, 8.0, 8.25])
def test_the_line_of_a_reset_may_come_a_moment_before_or_after_the_jump(line):
    """With 20 messages a second the interval begins halfway between the jump at 8.0 s and the message before."""
    before, after = frame_intervals(shifted(0.02, line=line))
    assert before.end == after.begin == pytest.approx(7.975)


def test_a_reset_that_moves_nothing_is_at_the_time_of_its_line():
    noise = 0.001 * np.random.RandomState(1).standard_normal(len(TIME))
    run = replace(shifted(0.0), local_pose=poses(X + noise))
    assert [interval.begin for interval in frame_intervals(run)][1:] == [pytest.approx(8.0, abs=0.06)]


def test_without_a_line_there_is_no_reset():
    run = shifted(0.5)
    assert len(frame_intervals(replace(run, resets=reset_lines()))) == 1
    # nor one that nothing in the recording follows or precedes
    late = run.local_pose.take(TIME > 8.1)
    assert len(frame_intervals(replace(run, local_pose=late))) == 1


def test_a_new_frame_is_in_force_from_a_twentieth_of_a_second_before_its_first_message():
    """With one message a second, halfway to the message before would be earlier."""
    slow = shifted(0.5)
    slow = replace(slow, local_pose=slow.local_pose.take(slice(None, None, 20)))
    before, after = frame_intervals(slow)
    assert (before.begin, before.end, after.end) == (-math.inf, after.begin, math.inf)
    assert after.begin == pytest.approx(7.95)


@pytest.mark.parametrize('begin, end, number', [
    (7.88, 9.0, 1), (7.87, 9.0, 0), (7.9, 8.0, 0), (7.97, 8.03, 1)])
def test_a_drive_belongs_to_the_reset_that_began_it(begin, end, number):
    """The reset at 7.975 s began a drive from up to 0.1 s before, unless the drive's end is nearer."""
    in_order = frame_intervals(shifted(0.5))
    assert frame_interval_of(in_order, begin, end) is in_order[number]


def test_local_is_placed_in_the_world_by_the_first_pose_of_an_interval():
    run = replace(shifted(0.5), ground_truth=poses(X + 2.0, 0.0 * X + 1.0))
    places = [(interval.local_T_world.x, interval.local_T_world.y) for interval in frame_intervals(run)]
    assert places == [pytest.approx((-2.0, -1.0)), pytest.approx((-1.5, -1.0))]
    assert [interval.odom_T_local.x for interval in frame_intervals(run)] == pytest.approx([0.0, -0.5])
    ended = replace(run, ground_truth=run.ground_truth.take(slice(100)))     # before the second reset
    assert [interval.local_T_world is None for interval in frame_intervals(ended)] == [False, True]
