"""Finds the local frames of a node in the Transformation lab, and its own poses and states.

In this file a place (x, y) is the complex number x + iy, so a rotation is a product.
"""
from functools import lru_cache
from typing import Any, List, NamedTuple, Tuple

import numpy as np

from tb3_labs.geometry.arrays import index_at_or_before, wrap_all
from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG, MOVE_FORWARD, ROTATE_TO_GOAL, STATES
from tb3_labs.watch.mistake import MAX_READING_GAP, NodeRun
from tb3_labs.watch.variables import Series

POSE_TOLERANCE = 0.03           # [m, rad]
#: Values follow a formula if the formula is correct for at least this share of the values.
MIN_CORRECT_SHARE = 0.9
PROBE_DELAY = 0.1               # [s] within which the probe shows most changes
MAX_PROBE_DELAY = 0.4           # [s] within which the probe shows each change
REST_TIME_AFTER_START = 1.5     # [s]
#: {variable of the pose: references from which the node computes it}.
REFERENCES_OF = {
    'local_yaw': ('initial_global_yaw',), 'local_x': ('initial_global_x', 'initial_odom_yaw'),
    'local_y': ('initial_global_y', 'initial_odom_yaw')}
HANDOUT_GOAL = {'goal_x': GOAL_X, 'goal_y': GOAL_Y, 'goal_yaw': float(np.radians(GOAL_YAW_DEG))}


class NodeFrame(NamedTuple):
    """A local frame is in force from `begin` to `end` [s]. If a reset begins the frame, the reset
    declares the robot's place and yaw in the frame. At `begin`, `place` and `odometry_yaw` are the
    robot's pose by odometry, and `imu_yaw` is the robot's yaw by IMU."""

    begin: float
    declared_place: complex = 0j
    declared_yaw: float = 0.0
    is_reset: bool = False
    end: float = np.inf
    place: complex = np.nan
    odometry_yaw: float = np.nan
    imu_yaw: float = np.nan

    @property
    def clause(self) -> str:
        return f'after the reset at {self.begin:.0f} s ' if self.is_reset else ''


@lru_cache(maxsize=1)
def local_frames(node_run: NodeRun) -> List[NodeFrame]:
    """Returns the local frames of a run in order. A frame begins at each recorded start of the
    node, and at each recorded reset. Starts are recorded only in a trial."""
    recording = node_run.recording
    times = node_run.reading_times
    if not len(times) or not len(recording.odometry) or not len(recording.imu):
        return []
    declared = [NodeFrame(min(times[index_from(times, start)], start + REST_TIME_AFTER_START))
                for start in recording.starts]
    resets = recording.resets
    for time, x, y, yaw in zip(resets.arrival, resets.x, resets.y, resets.yaw):
        if time > times[0]:
            declared.append(NodeFrame(time, complex(x, y), yaw, is_reset=True))
    declared.sort(key=lambda frame: frame.begin)
    ends = [frame.begin for frame in declared[1:]] + [recording.duration + 1.0]
    frames = []
    for frame, end in zip(declared, ends):
        if not recording.starts:      # after a gap in the readings, the node may have started again
            end = min(end, node_run.last_reading_before_gap(frame.begin))
        odometry = recording.odometry.pose(index_from(recording.odometry.arrival, frame.begin))
        imu_yaw = recording.imu.yaw[index_from(recording.imu.arrival, frame.begin)]
        frames.append(frame._replace(end=end, place=complex(odometry.x, odometry.y),
                                     odometry_yaw=odometry.yaw, imu_yaw=imu_yaw))
    return frames


def index_from(times: np.ndarray, time: float) -> int:
    """Returns the index of the first of `times` that is not before `time`, or the last index."""
    return min(int(np.searchsorted(times, time)), len(times) - 1)


class NodePose(NamedTuple):
    """The poses in the node's own variables, with a value for each time. `to_goal` is the vector
    from the robot to the goal, a complex number [m]. The angles are in radians. A value is NaN if
    the node lacks the variable of the handout."""

    to_goal: np.ndarray
    yaw: np.ndarray
    goal_yaw: np.ndarray

    def error(self, state: str) -> np.ndarray:
        """Returns the error that the node reduces in a state: a distance [m], or an angle [rad]."""
        if state == MOVE_FORWARD:
            return np.abs(self.to_goal)
        target = np.angle(self.to_goal) if state == ROTATE_TO_GOAL else self.goal_yaw
        return np.abs(wrap_all(target - self.yaw))


def node_poses(node_run: NodeRun, times: np.ndarray) -> NodePose:
    """Returns the NodePose at these times. In a trial, a missing goal is the handout's goal."""
    default_goal = HANDOUT_GOAL if node_run.recording.starts else {}
    values = {}
    units = {}
    for name in (*REFERENCES_OF, *HANDOUT_GOAL):
        series = node_run.variable(name)
        values[name] = np.full(len(times), default_goal.get(name, np.nan))
        units[name] = 1.0
        if series is not None:
            values[name] = np.interp(times, series.time, series.value)
            units[name] = unit_of(series)
    to_goal = values['goal_x'] - values['local_x'] + 1j * (values['goal_y'] - values['local_y'])
    return NodePose(to_goal, yaw=values['local_yaw'] * units['local_yaw'],
                    goal_yaw=values['goal_yaw'] * min(units['local_yaw'], units['goal_yaw']))


def unit_of(series: Series) -> float:
    """Returns the size [rad] of a yaw's unit. The unit is a degree if any value exceeds 7."""
    return np.pi / 180.0 if (np.abs(series.value) > 7.0).any() else 1.0


def readings_with_control(node_run: NodeRun, readings: Series, seconds: float) -> Series:
    """Returns the `readings` at which the node has control and also had control `seconds` earlier.
    The variable has_control, or else ctrl_relinq, shows the control; without both, returns all."""
    control = node_run.recording.control
    series = node_run.boolean_variable('has_control')
    time, value = control.arrival, control.value
    if series is not None:
        time, value = series.time, series.value
    if not len(time):
        return readings
    index_earlier = index_at_or_before(time, readings.time - seconds)
    had_control = (index_earlier >= 0) & (value[index_earlier] == 1.0)
    has_control = value[index_at_or_before(time, readings.time)] == 1.0
    return readings.take(had_control & has_control)


def control_intervals(node_run: NodeRun) -> List[Tuple[float, float, float]]:
    """Returns (time [s], time of the next message [s], value) of each message on ctrl_relinq."""
    control = node_run.recording.control
    ends = np.append(control.arrival[1:], node_run.recording.duration)
    return list(zip(control.arrival, ends, control.value))


class StateInterval(NamedTuple):
    """An interval in which the node is in one state and has control. `begin` and `end` are the
    times [s] of the first and the last reading in this state. An unknown `next_state` is ''.
    `pose` is the NodePose at the times of the `commands`."""

    state: str
    begin: float
    end: float
    next_state: str
    commands: Any       # Commands
    pose: NodePose


@lru_cache(maxsize=1)
def state_intervals(node_run: NodeRun) -> List[StateInterval]:
    """Returns the StateIntervals in order; [] if `state` never has a state of the handout."""
    series = node_run.variable('state')
    if series is None or not set(series.text) & set(STATES):
        return []
    # a new frame, a message on ctrl_relinq, and a gap in the readings also end an interval
    frame_begins = [frame.begin for frame in local_frames(node_run)]
    cuts = np.array([*frame_begins, *node_run.recording.control.arrival])
    gaps = series.time[1:][np.diff(series.time) > MAX_READING_GAP]
    edges = np.unique([*series.changes, *cuts, *gaps, node_run.recording.duration])
    intervals = []
    for begin, end in zip(edges[:-1], edges[1:]):
        readings = readings_with_control(node_run, series.between(begin, end), seconds=0.0)
        errors = node_poses(node_run, readings.time).error(ROTATE_TO_GOAL)
        if np.isnan(errors).all():
            continue
        is_cut = end in gaps or (np.abs(cuts - end) <= PROBE_DELAY).any()
        next_state = ''
        if end in series.changes and not is_cut:
            next_state = series.text_at(end)
        first, last = readings.time[0], readings.time[-1]
        arrival = node_run.commands.arrival
        is_within = (arrival > first - PROBE_DELAY / 2.0) & (arrival <= last)
        commands = node_run.commands.take(is_within)
        intervals.append(StateInterval(
            state=str(readings.text[-1]), begin=first, end=last, next_state=next_state,
            commands=commands, pose=node_poses(node_run, commands.arrival)))
    return intervals
