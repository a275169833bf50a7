"""Everything that was heard from one robot, as the picture that a page draws.

A picture is a JSON object. Poses are [x m, y m, yaw rad], null if nothing was heard:

    "odom", "local"      pose of the robot in odom, and in local (as its node believes)
    "frame"              pose of the frame local, in odom
    "truth"              true pose of a simulated robot, in odom
    "goal"               pose of the goal, in local; "tolerance" [m]
    "distance", "angle"  to the goal [m], and off its heading [deg], as the node publishes them
    "state", "phase"     the words of `goal_state`; their kind: driving, reached, waiting, stopped,
                         gave up, or ''
    "has_control"        may move_to_goal drive?
    "holder"             the node that may drive, in words
    "driver", "command"  the node whose commands move the robot now, and [v m/s, w rad/s]
    "heading_deg"        by the IMU, 0 to 360
    "ages"               {source: time since its last message [s]; 0: it is not silent}
    "epoch"              how often the frame local was declared, as far as it was seen
    "page"               the page that drives the robot: "", "this" or "other"
    "stops"              number of stops so far; see tb3_labs.supervision.page_grip
    "can"                {request: does any node listen to it?}
    "pad"                "ready", or why the pad of a page does not drive

NaN and infinite numbers are null too: JSON does not have them, but any node may publish them.

Units in the code: metres, radians; arrivals in seconds on one clock (`now`).
"""
import math
from typing import Any, Dict, List, Optional, Tuple

from tb3_labs.control.goal_state import DRIVING, GAVE_UP, STOPPED, WAITING, GoalState
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import OdometrySample
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A point is added to a trail after this distance [m].
TRAIL_STEP = 0.02
#: If a trail has more points than this, every second point is dropped.
MOST_POINTS = 1000
#: If the frame local moves by more than this, it was declared anew [m], [rad].
FRAME_STEP = 0.001, math.radians(0.1)
#: If the odometry jumps by more than this, it was zeroed, and the frame follows it [m], [rad].
ODOMETRY_JUMP = 0.2, math.radians(60.0)
#: If the pose in local jumps by more than this, it was declared [m], [rad]: no robot moves that far
#: between two messages.
LOCAL_JUMP = 0.1, math.radians(30.0)
#: Truth and odometry that are farther apart in time than this are not compared [s].
SAME_PICTURE = 0.3
#: Ages below this are shown as 0 [s]: streams are read only a few times a second, so a small age
#: says nothing about the robot.
READ_WITHIN = 0.3
#: A robot that is slower than this stands, by its odometry [m/s] or [rad/s].
STANDS_BELOW = 0.02
#: Sources whose ages a picture has.
SOURCES = ('imu', 'odom')

Point = Tuple[float, float]


class Trail:
    """The robot's path in one frame [m], thinned and bounded."""

    def __init__(self) -> None:
        self.points: List[Point] = []

    def add(self, pose: Pose2) -> None:
        """Add the place of the robot, if it has moved by `TRAIL_STEP`."""
        if self.points and pose.distance_to(Pose2(*self.points[-1])) < TRAIL_STEP:
            return
        self.points.append((round(pose.x, 3), round(pose.y, 3)))
        if len(self.points) > MOST_POINTS:
            self.points = self.points[::2]


class RobotView:
    """The latest value of each kind that was heard from one robot, and its trails."""

    def __init__(self) -> None:
        self._latest: Dict[str, Any] = {}          # kind: value
        self._arrivals: Dict[str, float] = {}      # kind: its arrival
        self._commands: Dict[str, Tuple[float, float, float]] = {}   # sender: arrival, v, w
        self._odom_at_frame: Optional[Pose2] = None
        self._is_estimate = False        # is the frame estimated, not heard?
        self._epoch = 0
        self.trail_in_odom = Trail()
        self.trail_in_local = Trail()

    # -- input

    def hear(self, kind: str, value: Any, now: float) -> None:
        """Store `value` as the latest of its `kind`: a kind in :meth:`picture`, or 'origin' (pose
        of odom in world), 'truth' (pose in world, stamp [s]), 'imu' (yaw [rad])."""
        self._latest[kind], self._arrivals[kind] = value, now

    def hear_odometry(self, sample: OdometrySample, now: float) -> None:
        """Store a sample of the odometry."""
        last = self.latest('odom')
        if last is not None and _moved(last.pose, sample.pose, ODOMETRY_JUMP):
            self.trail_in_odom = Trail()
        self.trail_in_odom.add(sample.pose)
        self.hear('odom', sample, now)

    def hear_local(self, pose: Pose2, stamp: float, now: float) -> None:
        """Store the robot's `pose` in local, as its node believes, with its `stamp` [s].

        If the pose jumps and the odometry does not, the frame was declared anew. The message with
        the frame comes a moment later; until then the frame is computed from the odometry.
        """
        last, odom, frame = (self.latest(kind) for kind in ('local', 'odom', 'frame'))
        if last and odom and frame and _moved(last[0], pose, LOCAL_JUMP) and (
                _moved(odom.pose, frame @ pose, LOCAL_JUMP)):
            self._declare(odom.pose @ pose.inverse(), now)
            self._is_estimate = True
        self.trail_in_local.add(pose)
        self.hear('local', (pose, stamp), now)

    def hear_frame(self, frame: Pose2, now: float) -> None:
        """Store the pose of local in odom. A new declaration begins a new trail."""
        last, odom = self.latest('frame'), self.latest('odom')
        followed_odometry = (odom and self._odom_at_frame
                             and _moved(self._odom_at_frame, odom.pose, ODOMETRY_JUMP))
        if last and _moved(last, frame, FRAME_STEP) and not (
                self._is_estimate or followed_odometry):
            self._declare(frame, now)
        self._is_estimate = False
        self._odom_at_frame = odom and odom.pose
        self.hear('frame', frame, now)

    def _declare(self, frame: Pose2, now: float) -> None:
        self._epoch += 1
        self.trail_in_local = Trail()
        self.hear('frame', frame, now)

    def hear_command(self, sender: str, linear: float, angular: float, now: float) -> None:
        """Store the speed [m/s] and the rate of turn [rad/s] that `sender` commands."""
        self._commands[sender] = now, linear, angular

    # -- output

    def latest(self, kind: str) -> Any:
        """The latest value of a kind, or None."""
        return self._latest.get(kind)

    def age(self, kind: str, now: float) -> Optional[float]:
        """Time since the last message of a kind [s]; None before the first one."""
        return now - self._arrivals[kind] if kind in self._arrivals else None

    @property
    def is_driving(self) -> bool:
        """Does move_to_goal drive the robot to its goal now?"""
        return bool(self.latest('has_control')) and self.phase == 'driving'

    @property
    def phase(self) -> str:
        """The kind of the words of `goal_state`; '' if they are not known."""
        state = self.latest('state') or ''
        if state in DRIVING:
            return 'driving'
        if state == GoalState.GOAL_REACHED.name:
            return 'reached'
        return next((word for word in (WAITING, STOPPED, GAVE_UP) if state.startswith(word)), '')

    def unstopped(self, since: float) -> str:
        """Returns why the stop at `since` [s] is not confirmed yet, in words; '' if the robot
        stands, and move_to_goal has no control."""
        odom = self.latest('odom')
        if self.latest('has_control'):
            return 'move_to_goal does not answer'
        if odom is None or self._arrivals['odom'] <= since:
            return 'the robot does not answer'
        return '' if abs(odom.linear) < STANDS_BELOW and abs(odom.angular) < STANDS_BELOW else (
            'the robot still moves')

    def driver(self, now: float) -> str:
        """The node whose commands move the robot, or ''."""
        moving = [(at, sender) for sender, (at, linear, angular) in self._commands.items()
                  if now - at <= COMMAND_TIMEOUT and (linear or angular)]
        return max(moving)[1] if moving else ''

    def holder(self, now: float) -> str:
        """The node that may drive, in words."""
        if self.latest('has_control'):
            return 'move_to_goal (it has control)'
        return self.driver(now) or self.latest('holder') or 'nobody'

    def picture(self, now: float) -> Dict[str, Any]:
        """The picture, without the entries that differ from page to page."""
        driver, heading = self.driver(now), self.latest('imu')
        (shown, stamp), local = self._in_odom(), self.latest('local')
        return {
            'odom': _numbers(shown), 'local': _numbers(local and local[0]),
            'frame': _numbers(self.latest('frame')),
            'truth': _numbers(self._truth_in_odom(stamp)), 'goal': _numbers(self.latest('goal')),
            'tolerance': _rounded(self.latest('tolerance'), 6),
            'distance': _rounded(self.latest('distance'), 4),
            'angle': _rounded(self.latest('angle'), 4),
            'state': self.latest('state') or '', 'phase': self.phase,
            'has_control': self.latest('has_control'), 'holder': self.holder(now),
            'driver': driver,
            'command': [_rounded(number) for number in self._commands[driver][1:]] if driver
            else None,
            'heading_deg': _rounded(
                None if heading is None else round(math.degrees(heading) % 360.0, 1) % 360.0),
            'ages': {source: self._silence(source, now) for source in SOURCES},
            'epoch': self._epoch}

    def _silence(self, kind: str, now: float) -> Optional[float]:
        age = self.age(kind, now)
        return 0.0 if age is not None and age <= READ_WITHIN else _rounded(age)

    def _in_odom(self) -> Tuple[Optional[Pose2], Optional[float]]:
        """Returns (the robot's pose in odom, its stamp [s]) by the latest message, odom or local.

        Each odometry brings a pose in local, so the odometry can be read less often.
        """
        odom, frame, local = (self.latest(kind) for kind in ('odom', 'frame', 'local'))
        if frame and local and (odom is None or self._arrivals['local'] > self._arrivals['odom']):
            return frame @ local[0], local[1]
        return (odom.pose, odom.stamp) if odom else (None, None)

    def _truth_in_odom(self, shown: Optional[float]) -> Optional[Pose2]:
        """Returns the true pose in odom at the time `shown` [s] of the pose that is shown, to
        compare the two while the robot moves."""
        origin, truth = self.latest('origin'), self.latest('truth')
        if origin is None or truth is None:
            return None
        (pose, stamp), odom = truth, self.latest('odom')
        if odom is not None and shown is not None and abs(stamp - shown) < SAME_PICTURE:
            ahead = stamp - shown
            pose = pose @ Pose2(ahead * odom.linear, 0.0, ahead * odom.angular).inverse()
        return origin.inverse() @ pose


def _moved(before: Pose2, after: Pose2, step: Tuple[float, float]) -> bool:
    return (before.distance_to(after) > step[0]
            or abs(difference(after.yaw, before.yaw)) > step[1])


def _numbers(pose: Optional[Pose2]) -> Optional[List[float]]:
    return None if pose is None else [round(pose.x, 4), round(pose.y, 4), round(pose.yaw, 5)]


def _rounded(number: Optional[float], digits: int = 3) -> Optional[float]:
    """Returns the number rounded; None for NaN and infinity, 0.0 for -0.0: the - would be shown."""
    return None if number is None or not math.isfinite(number) else round(number, digits) + 0.0
