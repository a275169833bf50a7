"""Finds the local frames of a node in the Transformation lab, and the node's poses and states.

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
PROBE_DELAY = 0.1       # the probe shows most changes of a variable within this time [s]
MAX_PROBE_DELAY = 0.4   # the probe shows every change of a variable within this time [s]
#: The first command of a state may come up to this time [s] before the probe shows the state.
MAX_COMMAND_LEAD = PROBE_DELAY / 2.0
REST_TIME_AFTER_START = 1.5     # the robot rests at least this time [s] after the node starts
#: {variable of the local pose: references, which a node sets at a reset to compute the variable}.
REFERENCES_OF = {
    'local_yaw': ('initial_global_yaw',), 'local_x': ('initial_global_x', 'initial_odom_yaw'),
    'local_y': ('initial_global_y', 'initial_odom_yaw')}
HANDOUT_GOAL = {'goal_x': GOAL_X, 'goal_y': GOAL_Y, 'goal_yaw': float(np.radians(GOAL_YAW_DEG))}


class NodeFrame(NamedTuple):
    """A frame ``local`` that is valid from `begin` to `end` [s]. If a reset begins the frame, the
    reset declares the robot's place and yaw in the frame. `position` and `odometry_yaw` are the
    robot's pose at `begin` by the odometry. `imu_yaw` is the robot's yaw at `begin` by the IMU."""

    begin: float
    declared_position: complex = 0j
    declared_yaw: float = 0.0
    is_reset: bool = False
    end: float = np.inf
    position: complex = np.nan
    odometry_yaw: float = np.nan
    imu_yaw: float = np.nan

    @property
    def clause(self) -> str:
        return f'after the reset at {self.begin:.0f} s ' if self.is_reset else ''


@lru_cache(maxsize=1)
def local_frames(node_run: NodeRun) -> List[NodeFrame]:
    """Returns the local frames of a run in order, each with its end and the robot's pose."""
    recording = node_run.recording
    if not len(node_run.reading_times) or not len(recording.odometry) or not len(recording.imu):
        return []
    declared = declared_frames(node_run)
    ends = [frame.begin for frame in declared[1:]] + [recording.duration + 1.0]
    frames = []
    for frame, end in zip(declared, ends):
        if not recording.starts:      # after a gap in the readings, the node may have started again
            end = min(end, node_run.last_reading_before_gap(frame.begin))
        odometry = recording.odometry.pose(index_from(recording.odometry.arrival, frame.begin))
        imu_yaw = recording.imu.yaw[index_from(recording.imu.arrival, frame.begin)]
        frames.append(frame._replace(end=end, position=complex(odometry.x, odometry.y),
                                     odometry_yaw=odometry.yaw, imu_yaw=imu_yaw))
    return frames


def declared_frames(node_run: NodeRun) -> List[NodeFrame]:
    """Returns a NodeFrame for each recorded start of the node, and for each recorded reset, in
    order. Only a trial records the starts. The node must have readings."""
    times = node_run.reading_times
    frames = []
    for start in node_run.recording.starts:
        first_reading = times[index_from(times, start)]
        frames.append(NodeFrame(min(first_reading, start + REST_TIME_AFTER_START)))
    resets = node_run.recording.resets
    for time, x, y, yaw in zip(resets.arrival, resets.x, resets.y, resets.yaw):
        if time > times[0]:
            frames.append(NodeFrame(time, complex(x, y), yaw, is_reset=True))
    return sorted(frames, key=lambda frame: frame.begin)


def index_from(times: np.ndarray, time: float) -> int:
    """Returns the index of the first of `times` that is not before `time`, or the last index."""
    return min(int(np.searchsorted(times, time)), len(times) - 1)


class NodePose(NamedTuple):
    """The robot's pose and the goal in the node's own variables, with a value for each time.
    `to_goal` is the vector from the robot to the goal, as a complex number [m]. The angles are in
    radians. If the node lacks a variable of the handout, the values that need it are NaN."""

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
            units[name] = radians_per_unit(series)
    to_goal = values['goal_x'] - values['local_x'] + 1j * (values['goal_y'] - values['local_y'])
    # a goal_yaw of a few degrees looks like radians, but local_yaw shows that the node uses degrees
    goal_unit = min(units['local_yaw'], units['goal_yaw'])
    return NodePose(to_goal, yaw=values['local_yaw'] * units['local_yaw'],
                    goal_yaw=values['goal_yaw'] * goal_unit)


def radians_per_unit(series: Series) -> float:
    """Returns the factor that converts a yaw to radians. A value above 7 must be in degrees."""
    return np.pi / 180.0 if (np.abs(series.value) > 7.0).any() else 1.0


def readings_with_control(node_run: NodeRun, readings: Series, seconds: float) -> Series:
    """Returns the `readings` at which the node has control and also had control `seconds` earlier.
    The node's variable has_control shows when the node has control. Without this variable, the
    messages on ctrl_relinq show it. Without messages, all readings are returned."""
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
    """Returns (arrival [s], arrival of the next message [s], value) of each ctrl_relinq message."""
    control = node_run.recording.control
    ends = np.append(control.arrival[1:], node_run.recording.duration)
    return list(zip(control.arrival, ends, control.value))


class StateInterval(NamedTuple):
    """An interval in which the node is in one state and has control. `begin` and `end` are the
    times [s] of the first and the last reading in this state. `next_state` is '' if it is not
    known. `pose` is the NodePose at the times of the `commands`."""

    state: str
    begin: float
    end: float
    next_state: str
    commands: Any       # Commands
    pose: NodePose


@lru_cache(maxsize=1)
def state_intervals(node_run: NodeRun) -> List[StateInterval]:
    """Returns the StateIntervals in order, or [] if `state` never has a state of the handout."""
    series = node_run.variable('state')
    if series is None or not set(series.text) & set(STATES):
        return []
    # a new frame, a message on ctrl_relinq, and a gap in the readings also end an interval
    frame_begins = [frame.begin for frame in local_frames(node_run)]
    interruptions = np.array([*frame_begins, *node_run.recording.control.arrival])
    gap_ends = series.time[1:][np.diff(series.time) > MAX_READING_GAP]
    edges = np.unique(
        [*series.changes, *interruptions, *gap_ends, node_run.recording.duration])

    intervals = []
    for begin, end in zip(edges[:-1], edges[1:]):
        readings = readings_with_control(node_run, series.between(begin, end), seconds=0.0)
        errors = node_poses(node_run, readings.time).error(ROTATE_TO_GOAL)
        if np.isnan(errors).all():      # the node has no control, or lacks a variable of the pose
            continue
        is_interrupted = end in gap_ends or (np.abs(interruptions - end) <= PROBE_DELAY).any()
        ends_by_change = end in series.changes and not is_interrupted
        next_state = series.text_at(end) if ends_by_change else ''
        intervals.append(state_interval(node_run, readings, next_state))
    return intervals


def state_interval(node_run: NodeRun, readings: Series, next_state: str) -> StateInterval:
    """Returns the StateInterval of successive `readings` of the variable `state`."""
    begin, end = readings.time[0], readings.time[-1]
    arrival = node_run.commands.arrival
    commands = node_run.commands.take((arrival > begin - MAX_COMMAND_LEAD) & (arrival <= end))
    return StateInterval(
        state=str(readings.text[-1]), begin=begin, end=end, next_state=next_state,
        commands=commands, pose=node_poses(node_run, commands.arrival))
