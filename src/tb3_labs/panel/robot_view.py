"""Makes a picture of one robot from its latest messages. A page draws the picture.

A picture is a JSON object. A pose is [x m, y m, yaw rad], or null if the pose is not known:

    "odom", "local"      pose of the robot in odom, and in local. If no node publishes local, the
                         panel computes local from the odometry and a log line "Local pose set to"
    "frame"              pose of the frame local, in odom
    "truth"              true pose of a simulated robot, in odom
    "goal"               pose of the goal, in local
    "distance", "angle"  distance to the goal [m], and heading of the goal minus heading of the
                         robot [deg]
    "state", "phase"     the text of `goal_state`, and its kind: driving, reached, waiting, stopped,
                         gave up, or ''
    "has_control"        may move_to_goal drive?
    "driver", "command"  the node whose commands move the robot now, and [v m/s, w rad/s]
    "heading_deg"        heading by the IMU, 0 to 360
    "ages"               {sensor: time [s] since the last message}
    "inside"             a list of {"node", "values": [[name, text]]}: the variables that watch.py
                         publishes
    "page"               the page that drives the robot: "", "this" or "other"
    "stops"              number of stops so far; see tb3_labs.supervision.dead_man
    "pad"                "ready", or why the pad of a page does not drive

If a node publishes NaN or infinity, a picture contains null, because JSON has no such numbers.

Units in the code: metres and radians. Times of arrival and `now` are in seconds on the same clock.
"""
import math
from typing import Any, Dict, Iterable, List, Optional, Tuple

from tb3_labs.control.goal_state import DRIVING, GAVE_UP, STOPPED, WAITING, GoalState
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import OdometrySample
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.watch.printed_pose import declared_pose

#: A larger jump between two odometry messages shows that the odometry was reset.
MAX_POSITION_JUMP = 0.2         # [m]
MAX_YAW_JUMP = math.radians(60.0)
#: If the stamps of true pose and odometry differ by more [s], the true pose is not extrapolated.
MAX_TRUTH_DELAY = 0.3
#: Below this speed and this rate of turn [m/s, rad/s], a robot stands still.
STANDSTILL_SPEED = 0.02
#: If a node has been silent for a longer time [s], a page does not show the node's variables.
VARIABLES_TIMEOUT = 2.0


class RobotView:
    """Keeps the latest value of each entry of one robot."""

    def __init__(self) -> None:
        self._latest: Dict[str, Any] = {}          # {entry: value}
        self._arrivals: Dict[str, float] = {}      # {entry: time of arrival}
        # {sender: (time of arrival, forward speed, rate of turn)}
        self._commands: Dict[str, Tuple[float, float, float]] = {}
        # {node: (time of arrival, [[name, text]])}
        self._variables: Dict[str, Tuple[float, List[List[str]]]] = {}
        # the pose of local in odom, used if no node publishes `local`
        self._computed_odom_T_local: Optional[Pose2] = None

    def on_message(self, entry: str, value: Any, now: float) -> None:
        """Store `value` as the latest value of `entry`. `entry` is an entry of the picture, or
        'origin' (the pose of odom in world), 'imu' (the yaw [rad]) or 'holder' (the text of
        control_holder). The value of 'truth' is (the true pose in world, its stamp [s])."""
        self._latest[entry] = value
        self._arrivals[entry] = now

    def on_odometry(self, sample: OdometrySample, now: float) -> None:
        """Store the sample. A reset of the odometry makes the computed pose of local wrong."""
        last = self.latest('odom')
        if last is not None:
            moved = last.pose.distance_to(sample.pose)
            turned = abs(difference(sample.pose.yaw, last.pose.yaw))
            if moved > MAX_POSITION_JUMP or turned > MAX_YAW_JUMP:
                self._computed_odom_T_local = None
        self.on_message('odom', sample, now)

    def on_log_line(self, text: str) -> None:
        """If the log line declares the robot's pose in local, compute the pose of local in odom."""
        declared = declared_pose(text)
        odom = self.latest('odom')
        if declared and odom:
            self._computed_odom_T_local = odom.pose @ declared.inverse()

    def on_command(self, sender: str, linear: float, angular: float, now: float) -> None:
        self._commands[sender] = now, linear, angular

    def on_variables(self, node: str, values: Iterable[Tuple[str, str]], now: float) -> None:
        self._variables[node] = now, [[name, text] for name, text in values]

    def latest(self, entry: str) -> Any:
        return self._latest.get(entry)

    @property
    def is_driving(self) -> bool:
        """move_to_goal now drives the robot to a goal."""
        return bool(self.latest('has_control')) and self.phase == 'driving'

    @property
    def phase(self) -> str:
        state = self.latest('state') or ''
        if state in DRIVING:
            return 'driving'
        if state == GoalState.GOAL_REACHED.name:
            return 'reached'
        for word in (WAITING, STOPPED, GAVE_UP):
            if state.startswith(word):
                return word
        return ''

    def stop_problem(self, since: float) -> Optional[str]:
        """Returns the reason why the stop at `since` [s] is not confirmed yet, or None."""
        odom = self.latest('odom')
        if self.latest('has_control'):
            return 'move_to_goal does not answer'
        if odom is None or self._arrivals['odom'] <= since:
            return 'the robot does not answer'
        is_standing = abs(odom.linear) < STANDSTILL_SPEED and abs(odom.angular) < STANDSTILL_SPEED
        return None if is_standing else 'the robot still moves'

    def driving_node(self, now: float) -> str:
        """Returns the node whose commands move the robot, or '' if no node moves the robot."""
        moved_at = {sender: arrived_at
                    for sender, (arrived_at, linear, angular) in self._commands.items()
                    if now - arrived_at <= COMMAND_TIMEOUT and (linear or angular)}
        return max(moved_at, key=lambda sender: moved_at[sender], default='')

    def picture(self, now: float) -> Dict[str, Any]:
        """Returns the picture without "page", "stops" and "pad"."""
        driver = self.driving_node(now)
        odom = self.latest('odom')
        local, frame = self._local_and_frame()
        goal = self.latest('goal')
        distance, angle_deg = None, None
        if goal and local:
            distance = local.distance_to(goal)
            angle_deg = math.degrees(difference(goal.yaw, local.yaw))
        poses = {'odom': odom.pose if odom else None, 'local': local, 'frame': frame,
                 'truth': self._truth_in_odom(), 'goal': goal}
        return {
            **{entry: _pose_numbers(pose) for entry, pose in poses.items()},
            'distance': _rounded(distance, 4), 'angle': _rounded(angle_deg, 4),
            'state': self.latest('state') or '', 'phase': self.phase,
            'has_control': self.latest('has_control'), 'driver': driver,
            'command': self._command_of(driver), 'heading_deg': _heading_deg(self.latest('imu')),
            'ages': {'imu': self._age('imu', now), 'odom': self._age('odom', now)},
            'inside': [{'node': node, 'values': values}
                       for node, (arrived_at, values) in sorted(self._variables.items())
                       if now - arrived_at <= VARIABLES_TIMEOUT]}

    def _local_and_frame(self) -> Tuple[Optional[Pose2], Optional[Pose2]]:
        """Returns (the robot's pose in local, the pose of local in odom)."""
        local, frame = self.latest('local'), self.latest('frame')
        is_published = bool(local or frame)
        if is_published or not self._computed_odom_T_local:
            return local, frame
        local_T_odom = self._computed_odom_T_local.inverse()
        return local_T_odom @ self.latest('odom').pose, self._computed_odom_T_local

    def _command_of(self, driver: str) -> Optional[List[Optional[float]]]:
        if not driver:
            return None
        _, linear, angular = self._commands[driver]
        return [_rounded(linear), _rounded(angular)]

    def _age(self, sensor: str, now: float) -> Optional[float]:
        return _rounded(now - self._arrivals[sensor]) if sensor in self._arrivals else None

    def _truth_in_odom(self) -> Optional[Pose2]:
        """Returns the true pose in odom at the odometry's stamp, so that a page can compare true
        pose and odometry while the robot moves."""
        origin = self.latest('origin')
        truth = self.latest('truth')
        if origin is None or truth is None:
            return None
        pose, stamp = truth
        odom = self.latest('odom')
        if odom is not None and abs(stamp - odom.stamp) < MAX_TRUTH_DELAY:
            delay = stamp - odom.stamp
            motion = Pose2(delay * odom.linear, 0.0, delay * odom.angular)
            pose = pose @ motion.inverse()
        return origin.inverse() @ pose


def _pose_numbers(pose: Optional[Pose2]) -> Optional[List[float]]:
    if pose is None or not math.isfinite(pose.x + pose.y + pose.yaw):
        return None
    return [round(pose.x, 4), round(pose.y, 4), round(pose.yaw, 5)]


def _heading_deg(yaw: Optional[float]) -> Optional[float]:
    """Returns the heading from 0 to 359.9 degrees. 359.96 degrees become 0.0, not 360.0."""
    if yaw is None:
        return None
    tenths = round(math.degrees(yaw) % 360.0, 1)
    return _rounded(tenths % 360.0)


def _rounded(number: Optional[float], digits: int = 3) -> Optional[float]:
    """Returns the rounded number. Returns None for NaN and infinity, and 0.0 for -0.0."""
    if number is None or not math.isfinite(number):
        return None
    return round(number, digits) + 0.0
