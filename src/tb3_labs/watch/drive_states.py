"""The drives of a run as the node of the Transformation lab had them: its local frames, the pose by
its own variables, the times in which it has control, and its states with their commands.

A local frame begins at each start of the node and at each reset. Places are complex numbers here,
x + iy, so that a rotation is a product.
"""
from typing import List, NamedTuple, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG, MOVE_FORWARD, ROTATE_TO_GOAL, STATES
from tb3_labs.watch.broken_link import LONGEST_READING_GAP, NodeRun
from tb3_labs.watch.variables import Series

#: A pose is right within POSE_TOLERANCE [m], [rad]. A law is kept if RIGHT_SHARE of the values are
#: right.
POSE_TOLERANCE, RIGHT_SHARE = 0.03, 0.9
#: A variable is read at most LONGEST_LAG after its cause, most changes within SHORT_LAG [s].
LONGEST_LAG, SHORT_LAG = 0.4, 0.1
#: A robot rests for this time after its node was started [s].
REST_TIME = 1.5
#: A jump is a reset if there are at most two others within this time before and after it [s].
JUMP_WINDOW = 1.0
#: The variables of the pose, and the references that each of them uses.
REFERENCES_OF = {
    'local_yaw': ('initial_global_yaw',), 'local_x': ('initial_global_x', 'initial_odom_yaw'),
    'local_y': ('initial_global_y', 'initial_odom_yaw')}
REFERENCES = 'initial_global_x', 'initial_global_y', 'initial_odom_yaw', 'initial_global_yaw'
#: The goal [m], [rad].
GOAL = {'goal_x': GOAL_X, 'goal_y': GOAL_Y, 'goal_yaw': float(np.radians(GOAL_YAW_DEG))}


class Frame(NamedTuple):
    """A local frame: its begin and end [s], the declared place and yaw, whether a reset began it,
    and the odometry's place and yaw and the IMU's yaw at its begin, NaN if they are unknown."""

    begin: float
    end: float
    declared_place: complex
    declared_yaw: float
    is_reset: bool
    place: complex
    odometry_yaw: float
    imu_yaw: float

    @property
    def words(self) -> str:
        return f'after the reset at {self.begin:.0f} s ' if self.is_reset else ''


def frames(node_run: NodeRun) -> List[Frame]:
    """Returns the frames of a run, in their order."""
    run = node_run.run
    if not node_run.variables or not len(run.odometry) or not len(run.imu):
        return []
    times = next(iter(node_run.variables.values())).time
    first_readings = times[np.searchsorted(times, run.starts or times[:1]).clip(max=len(times) - 1)]
    begins = [(min(first, start + REST_TIME), 0j, 0.0, False)
              for first, start in zip(first_readings, run.starts or times[:1])]
    begins += [(reset, complex(x, y), yaw, True) for reset, x, y, yaw in zip(
        run.resets.arrival, run.resets.x, run.resets.y, run.resets.yaw) if reset > times[0]]
    unknown = [] if run.starts else unknown_begins(node_run, [each[0] for each in begins])
    begins = sorted(begins + [(begin, 0j, 0.0, False) for begin in unknown])
    found: List[Frame] = []
    for values, end in zip(begins, [each[0] for each in begins[1:]] + [run.duration + 1.0]):
        begin = values[0]
        odometry, imu = (
            samples.take(min(np.searchsorted(samples.arrival, begin), len(samples) - 1))
            for samples in (run.odometry, run.imu))
        frame = Frame(begin, end, *values[1:], complex(odometry.x, odometry.y), odometry.yaw,
                      imu.yaw)
        if not run.starts and (not found or begin in unknown):
            # the node may have begun this frame before the recording: its own references are taken
            x, y, odometry_yaw, imu_yaw = (
                np.nan if each is None else each.at(begin + LONGEST_LAG) if found else each.value[0]
                for each in map(node_run.find, REFERENCES))
            frame = frame._replace(place=complex(x, y), odometry_yaw=odometry_yaw, imu_yaw=imu_yaw)
        found.append(frame)
    return found


def unknown_begins(node_run: NodeRun, known: List[float]) -> List[float]:
    """Returns the times at which a frame began for a reason that was not recorded: the node was
    started again, or a reset was not in the log. Then its references or its pose jumped."""
    read = node_run.reading_times
    begins = list(read[1:][np.diff(read) > LONGEST_READING_GAP])
    for name in (*REFERENCES, *REFERENCES_OF):
        series = node_run.find(name)
        if series is None:
            continue
        jumps = series.changes if name in REFERENCES else jumps_of(node_run, series)
        # a variable that jumps again and again is a mistake
        begins += list(jumps[np.searchsorted(jumps, jumps + JUMP_WINDOW)
                             - np.searchsorted(jumps, jumps - JUMP_WINDOW) <= 3])
        is_none = series.text == 'None'
        begins += list(series.time[1:][is_none[1:] != is_none[:-1]])
    found: List[float] = []
    for begin in sorted(begins):
        is_known = (np.abs(np.subtract(known, begin)) <= 2.0 * LONGEST_LAG).any()
        if not is_known and begin - SHORT_LAG > max(found, default=-np.inf):
            found.append(float(begin) - SHORT_LAG)
    return found


def jumps_of(node_run: NodeRun, series: Series) -> np.ndarray:
    """Returns the times at which a variable of the pose had changed by more than its sensor."""
    is_yaw = 'yaw' in series.name
    samples = node_run.run.imu if is_yaw else node_run.run.odometry
    steps = np.diff(series.value) * (unit_of(series) if is_yaw else 1.0)
    went = np.hypot(np.diff(samples.x), np.diff(samples.y)) if not is_yaw else np.abs(
        wrap_all(np.diff(samples.yaw)))
    way = np.interp(series.time, samples.arrival, np.append(0.0, np.cumsum(went)))
    way_before = np.interp(series.time - LONGEST_LAG, series.time, way) if len(way) else way
    steps = np.abs(wrap_all(steps) if is_yaw else steps)
    return series.time[1:][steps > 2.0 * POSE_TOLERANCE + way[1:] - way_before[:-1]]


class Pose(NamedTuple):
    """By the node's own variables at some times: the vector to the goal (complex), the yaw and the
    yaw of the goal [rad]; NaN without the handout's variables."""

    to_goal: np.ndarray
    yaw: np.ndarray
    goal_yaw: np.ndarray

    def error(self, state: str) -> np.ndarray:
        """The error that a state removes: of the heading [rad], or a distance [m]."""
        if state == MOVE_FORWARD:
            return np.abs(self.to_goal)
        target = np.angle(self.to_goal) if state == ROTATE_TO_GOAL else self.goal_yaw
        return np.abs(wrap_all(target - self.yaw))


def own_pose(node_run: NodeRun, times: np.ndarray) -> Pose:
    """Returns the Pose at each time. In a trial a goal that is not shown is that of the lab."""
    known = GOAL if node_run.run.starts else {}
    value, unit = {}, {}
    for name in (*REFERENCES_OF, *GOAL):
        series = node_run.find(name)
        unit[name] = 1.0 if series is None else unit_of(series)
        value[name] = np.full(len(times), known.get(name, np.nan)) if series is None else \
            np.interp(times, series.time, series.value)
    to_goal = value['goal_x'] - value['local_x'] + 1j * (value['goal_y'] - value['local_y'])
    return Pose(to_goal, value['local_yaw'] * unit['local_yaw'],
                value['goal_yaw'] * min(unit['local_yaw'], unit['goal_yaw']))


def unit_of(series: Series) -> float:
    """Returns the unit of a yaw's numbers [rad]: numbers beyond a turn are degrees."""
    return np.pi / 180.0 if np.nan_to_num(np.abs(series.value)).max(initial=0.0) > 7.0 else 1.0


def part_with_control(node_run: NodeRun, part: Series, seconds: float = LONGEST_LAG) -> Series:
    """Returns the part of a variable in which the node has had control for these seconds, by its
    own has_control, else by ctrl_relinq, which it may not have heard; without both all of it."""
    control, own = node_run.run.control, node_run.flag('has_control')
    time, value = (control.arrival, control.value) if own is None else (own.time, own.value)
    if not len(time):
        return part
    now, before = (np.searchsorted(time, part.time - each, 'right') - 1 for each in (0.0, seconds))
    return part.take((before >= 0) & (value[now] == 1.0) & (value[before] == 1.0))


def control_intervals(node_run: NodeRun) -> List[Tuple[float, float, float]]:
    """Returns (begin, end, value) of each message on ctrl_relinq."""
    control = node_run.run.control
    ends = np.append(control.arrival[1:], node_run.run.duration)
    return list(zip(control.arrival, ends, control.value))


class StateInterval(NamedTuple):
    """The time in one state with control: the first and the last reading in it [s], and the state
    after it, '' if it is not known. Arrays with a value for each command: its time, linear.x,
    angular.z, and the own Pose."""

    state: str
    begin: float
    end: float
    after: str
    time: np.ndarray
    linear: np.ndarray
    angular: np.ndarray
    pose: Pose


def state_intervals(node_run: NodeRun) -> List[StateInterval]:
    """Returns the StateIntervals of a run, in their order; [] without the handout's variables."""
    series, found, sent = node_run.find('state'), [], node_run.commands
    if series is None or not set(series.text) & set(STATES):
        return []
    cuts = [*(each.begin for each in node_run.cached(frames)), *node_run.run.control.arrival]
    gaps = series.time[1:][np.diff(series.time) > LONGEST_READING_GAP]
    edges = np.unique([*series.changes, *cuts, *gaps, node_run.run.duration])
    for begin, end in zip(edges[:-1], edges[1:]):
        part = part_with_control(node_run, series.between(begin, end), 0.0)
        error = own_pose(node_run, part.time).error(ROTATE_TO_GOAL)
        if np.isnan(error).all():
            continue
        is_change = end in series.changes and end not in gaps and (
            np.abs(np.subtract(cuts, end)) > SHORT_LAG).all()
        commands = sent.take((sent.arrival > part.time[0] - SHORT_LAG / 2.0) & (
            sent.arrival <= part.time[-1]))
        found.append(StateInterval(
            str(part.text[-1]), part.time[0], part.time[-1],
            series.text_at(end) if is_change else '', commands.arrival, commands.linear,
            commands.angular, own_pose(node_run, commands.arrival)))
    return found
