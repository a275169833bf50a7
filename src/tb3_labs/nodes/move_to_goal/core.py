"""Everything that `move_to_goal` decides: pose, permission and command; see :mod:`tb3_labs.nodes`.

The robot moves only while this node has control, both sensors are fresh, gyro and wheels agree, the
pose is known, and the goal is not reached. A grant or goal is void if the sensors are not there
soon.

Units: seconds on the receiver's clock (`now`), metres, radians; poses in the local frame.
"""
import math
from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

from tb3_labs.config import Config, setting
from tb3_labs.control.driving import PreciseLaw
from tb3_labs.control.goal_machine import GoalMachine
from tb3_labs.control.goal_state import DriveStatus
from tb3_labs.control.motor_response import Response
from tb3_labs.control.speed_laws import LONGEST_IDLE, Pace, Twist2
from tb3_labs.geometry.se2 import MAX_DISTANCE, MAX_YAW_DEG, AskedPose, Pose2, TypedPose
from tb3_labs.localization.contradiction import GyroWatch
from tb3_labs.localization.door import Door
from tb3_labs.localization.localizer import Fix, Localizer, Reset
from tb3_labs.localization.odometry_jumps import POSE_LOST, EncoderWatch
from tb3_labs.nodes.output import Output
from tb3_labs.robot.samples import ImuSample, OdometrySample, WheelSample
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS
from tb3_labs.supervision.events import Event, News, NewsDesk
from tb3_labs.supervision.goal_requests import GoalRequest, GoalRequests
from tb3_labs.supervision.lost_or_stalled import SURELY_DRIVES, SURELY_TURNS, SensorWatch, Sight
from tb3_labs.supervision.permission import Permission

#: Another node that commands a motion for longer than this while this one drives fights it [s].
RIVAL = 0.3


class GoalStaysEnded(ValueError):
    """A goal is refused because its sender repeats it."""


@dataclass(frozen=True)
class MoveToGoalConfig(Config):
    """The settings that `move_to_goal` begins with."""

    goal_x: float = setting(-0.61, 'first goal, in the local frame', 'm',
                            -MAX_DISTANCE, MAX_DISTANCE)
    goal_y: float = setting(0.61, 'first goal, in the local frame', 'm',
                            -MAX_DISTANCE, MAX_DISTANCE)
    goal_yaw_deg: float = setting(0.0, 'heading at the first goal', 'deg',
                                  -MAX_YAW_DEG, MAX_YAW_DEG)
    has_control: bool = setting(False, 'may drive from the start, without ctrl_relinq')

    @property
    def goal(self) -> Pose2:
        """The first goal as a Pose2 in local."""
        return TypedPose(self.goal_x, self.goal_y, self.goal_yaw_deg).pose


@dataclass(frozen=True)
class DriveOutput(Output):
    """What move_to_goal wants done now."""

    #: Was a step of the drive taken, or control gained or lost? Then the status may be new.
    acts: bool = False
    #: Resets that are over.
    resets: Sequence[Reset] = ()
    #: A new Fix, if there is one.
    fix: Optional[Fix] = None
    #: A drive that has ended: its request, and the failure or ''.
    end: Optional[Tuple[GoalRequest, str]] = None


class MoveToGoalCore:
    """Localizer, goal machine and permission of one robot."""

    def __init__(self, law: PreciseLaw, has_control: bool = False,
                 response: Optional[Response] = None,
                 gyro: Optional[GyroWatch] = None) -> None:
        """`response`: the known delays of this robot; `law` and this node improve it."""
        self._response = response or Response()
        self._door = Door()
        self.imu, self.odometry = self._door.imu, self._door.odometry
        self._localizer = Localizer(self._door.clock)
        self._machine = GoalMachine(law)
        self._news = NewsDesk()
        self._permission = Permission(has_control, self._news.tell)
        self._requests = GoalRequests(GoalRequest(None, stamp=1), self._permission.sleep)
        self._may_drive = has_control      # the permission at the last update
        self._had_control = False          # at the last tick
        self._grants = 0                   # number of grants at the last update
        self._pace = Pace(law.period)
        self._sensors = SensorWatch(self.imu, self.odometry)
        self._odometry_turned = False      # did its yaw change at the last sample?
        self._gyro = gyro or GyroWatch(MODELS[DEFAULT_MODEL])
        self._encoders = EncoderWatch()
        self._sent = Twist2()
        self._ended = 0                    # number of the last attempt that take_end returned
        self._given_up = 0                 # number of the last attempt that was given up
        self._rivals: Dict[str, float] = {}    # since when another node drives, too
        self._over: List[Reset] = []       # resets that are over

    # -- what comes in

    def on_imu(self, sample: ImuSample, now: float, sends_wheels: bool = False) -> None:
        heard = self._door.hear_imu(sample, now)
        self._gyro.on_imu(heard, sends_wheels)
        self._localizer.on_imu(heard)
        self._look_at_localizer()

    def on_odometry(self, sample: OdometrySample, now: float) -> None:
        before = self.odometry.reading
        heard = self._door.hear_odometry(sample, now)
        self._odometry_turned = before is None or before[0].yaw != sample.pose.yaw
        self._encoders.on_odometry(sample)
        self._localizer.on_odometry(heard)
        self._look_at_localizer()

    def on_wheels(self, sample: WheelSample) -> None:
        """Take in a sample of the wheels, if the robot sends them: they only check IMU
        and odometry."""
        self._gyro.on_wheels(sample)
        self._encoders.on_wheels(sample)

    def on_command(self, sender: str, linear: float, angular: float, now: float) -> None:
        """Another node commands the robot, which may move now. It is told of if it does so while
        this node drives; a command that crosses a grant is not worth a line."""
        if not (linear or angular):
            return
        self._localizer.driven_at = now
        if self._sent == Twist2():
            self._rivals.clear()
        elif now - self._rivals.setdefault(sender, now) > RIVAL:
            self._rivals[sender] = math.inf    # it is told once
            self._news.tell('{} drives the robot, too: stop one of the two (False on ctrl_relinq '
                            'stops this one)'.format(sender or 'another program'), warning=True)

    def set_law(self, law: PreciseLaw) -> None:
        """Drive by another law from now on; a present drive begins anew."""
        self._machine.law = law
        self._pace = Pace(law.period)
        if self._machine.active:
            self._machine.restart()

    def set_goal(self, goal: Pose2) -> None:
        """Replace the goal."""
        self._machine.set_goal(goal)
        self._begin_anew()

    def hear_goal(self, request: GoalRequest, now: float) -> None:
        """A goal has arrived, which :meth:`on_goal` may accept; `now` as in permission.Permission.
        """
        self.update_control(now)    # finds a sleep: the goal may be older than that
        self._requests.hear(request, now)

    def on_goal(self, request: GoalRequest) -> None:
        """Drive to the AskedPose of a goal that was heard, unless it repeats the present one.

        Raises ``ValueError`` with the reason of a refusal; it is a GoalStaysEnded if `request`
        repeats a goal that was ended.
        """
        requests, machine = self._requests, self._machine
        if self._permission.sleep.is_waking:
            raise ValueError('it may have been sent while this node did not run: send it again')
        if requests.stays_ended(request):
            line = requests.tell(request)
            if line:
                self._news.tell(line, warning=True)
            raise GoalStaysEnded('its sender repeats it since before it was ended')
        goal = request.goal.in_local(self.odom_T_local)
        if not (machine.active and machine.goal == goal and requests.is_repeated(request)):
            self.set_goal(goal)
        requests.accept(request)

    def on_cancel(self, now: float, name: str = '', stamp: int = 0) -> bool:
        """A person or program cancels goals, see GoalRequest. Returns True if this ends the drive.
        """
        is_meant = self._requests.cancel(now, name, stamp)
        if is_meant:
            self._machine.cancel()
            self._pause()
        return is_meant

    def reset(self, asked: AskedPose, now: float) -> Reset:
        """Declare that the robot is at `asked` now. The Reset shows when this is done.

        Raises ``ValueError`` if a sensor is not fresh.
        """
        problem = self._sensors.problem(now, with_age=True)
        if problem:
            raise ValueError('{}: is the robot running?'.format(problem))
        return self._localizer.reset(asked, now, self._response.sample_delay)

    def begin_control(self, now: float) -> None:
        """From now on senders of control can be heard; `now` as in permission.Permission."""
        self._permission.begin(now)

    def told_control(self, word: 'Event[bool]') -> None:
        """A sender gives control, or takes it."""
        self._permission.told(word)
        self.update_control(word.at)

    def update_control(self, now: float) -> None:
        """Check whether the permission still holds, also before a goal is set; `now` as in
        permission.Permission."""
        permission, machine = self._permission, self._machine
        permission.update(now)
        before, self._may_drive = self._may_drive, permission.granted
        given, self._grants = permission.count > self._grants, permission.count
        if given and (machine.failure or not before):
            # the robot may have been driven elsewhere meanwhile
            if machine.failure or machine.active:
                machine.restart()
            self._begin_anew()
        elif self._may_drive and not before:
            machine.interrupt()
        elif before and not self._may_drive:
            self._pause()
        if machine.failure and machine.attempt != self._given_up:
            self._given_up = machine.attempt
            self._requests.give_up(now)

    # -- what comes out, once

    def tick(self, now: float, steady: float, steps: bool = True) -> DriveOutput:
        """Look at the clocks, and return what is to be done; to be called after each message, and
        while there is none.

        `steady`: as `now` in permission.Permission; `steps`: may the drive take its step? After a
        message of the odometry it waits for the next sample of the IMU, which is fresher.
        """
        self.update_control(steady)
        changed, self._had_control = self._had_control is not self.has_control, self.has_control
        is_due = steps and self.due(now)
        command = self.command(now) if is_due else None
        acts = is_due or changed
        return DriveOutput(
            command, acts and command is None, self.take_news(), self.watched, acts,
            self.take_resets(), self.take_fix(), self.take_end() if steps else None)

    def take_news(self) -> List[News]:
        return self._news.take()

    def take_fix(self) -> Optional[Fix]:
        return self._localizer.take_fix()

    def take_resets(self) -> List[Reset]:
        """The resets that are over."""
        over, self._over = self._over, []
        return over

    def take_end(self) -> Optional[Tuple[GoalRequest, str]]:
        """(request, failure) of a drive that has ended; `failure` is '' at the goal. Else None."""
        machine = self._machine
        if machine.goal is None or machine.active or machine.attempt == self._ended:
            return None
        self._ended = machine.attempt
        return self._requests.present, machine.failure

    def command(self, now: float) -> Optional[Twist2]:
        self._look_at_sensors(now)
        refusal = POSE_LOST if self._localizer.is_lost else self._contradiction()
        if not (self.has_control and self._machine.active):
            self._pause()
        elif refusal:
            self._machine.give_up(refusal)
            self._pause()
        elif self._sensors.sight not in (Sight.SILENT, Sight.LATE):
            motion = self._localizer.motion(now)
            if motion is not None:
                dt = self._pace.step(now)
                self._look_at_readings(dt)
                command = self._machine.step(motion, dt)
                self._sent = command or Twist2()
                if self._sent != Twist2():
                    self._localizer.driven_at = now
                return command
        self._pace.skip(now)
        return None

    # -- state

    @property
    def has_control(self) -> bool:
        """May this node drive?"""
        return self._permission.granted

    @property
    def control_stands(self) -> bool:
        """Was control given, and not taken back? Its sender may be silent for a moment."""
        return self._permission.stands

    @property
    def odom_T_local(self) -> Optional[Pose2]:
        """The pose of ``local`` in the odometry's frame; None before the first fix."""
        return self._localizer.odom_T_local

    @property
    def imu_minus_odometry(self) -> Optional[float]:
        """The IMU's yaw minus the odometry's when the frame was declared [rad]."""
        frame = self._localizer.frame
        return None if frame is None else frame.imu_minus_odometry

    def status(self, now: float) -> DriveStatus:
        machine, problem = self._machine, self._sensors.problem(now) or self._contradiction()
        failure = POSE_LOST if self._localizer.is_lost else machine.failure
        return DriveStatus(
            machine.state, machine.goal,
            machine.law.distance_tolerance, machine.attempt, machine.begun,
            machine.active and not failure, failure, failure or machine.last_failure,
            self._sensors.hold_reason, self.has_control, problem)

    def pose(self, now: float) -> Optional[Pose2]:
        """The robot's pose in local at this moment; None if it is not known (yet)."""
        motion = self._localizer.motion(now)
        return None if motion is None else motion.pose

    def errors(self, pose: Pose2) -> Tuple[float, float]:
        """(distance [m], angle [rad]) by which `pose` misses the goal."""
        return self._machine.errors(pose)

    @property
    def watched(self) -> bool:
        return self._permission.stands and self._machine.active

    def due(self, now: float) -> bool:
        """Is a command due? At the law's own rate, and whenever a sensor is lost."""
        return self._pace.due(now) or not self._sensors.are_fresh(now)

    def idle_for(self, now: float) -> float:
        if self._localizer.has_resets:
            return 0.0
        driving = self.has_control and self._machine.active
        return self._pace.idle_for(now) if driving else LONGEST_IDLE

    # -- the drive

    def _contradiction(self) -> str:
        return self._gyro.problem() or self._encoders.problem()

    def _look_at_sensors(self, now: float) -> None:
        sensors = self._sensors
        sensors.update(now, self._gyro.is_checked)
        self._permission.look(sensors.problem(now))
        if sensors.sight is not Sight.FRESH:
            self._pace.pause()
        if sensors.sight is Sight.BACK_SOON:
            self._machine.interrupt()
        elif sensors.sight is Sight.LATE and self._permission.stands and self._machine.active:
            self._machine.give_up('{} for {:.1f} s'.format(
                sensors.hold_reason or 'sensors were silent', sensors.silent_for))

    def _look_at_readings(self, dt: float) -> None:
        """Give up if a sensor repeats a reading that the last command must have changed."""
        drives = abs(self._sent.linear) > SURELY_DRIVES
        turns = abs(self._sent.angular) > SURELY_TURNS
        # The odometry's yaw is the IMU's: if it turns, the IMU must change.
        self.imu.look(turns or (drives and self._odometry_turned), dt)
        self.odometry.look(drives or turns, dt)
        if self._sensors.frozen():
            self._machine.give_up(self._sensors.frozen())

    def _pause(self) -> None:
        """The robot stands, or another node drives it: the next command counts as the first."""
        self._pace.pause()
        self._sensors.pause()
        self._sent = Twist2()

    def _begin_anew(self) -> None:
        """A motion was asked for, which begins from standing."""
        self._pause()
        self._sensors.ask()

    def _look_at_localizer(self) -> None:
        """Give up a drive in which a sensor jumped; begin it anew after a reset."""
        for jump in self._localizer.take_jumps():
            if jump.outcome:
                self._news.tell('{}: {}'.format(jump.text[0].upper() + jump.text[1:], jump.outcome),
                                warning=True)
            if self._localizer.is_lost and self._machine.active:
                self._machine.give_up(POSE_LOST)
            elif self._permission.stands and self._machine.begun and self._machine.active:
                self._machine.give_up(jump.text)
        over = self._localizer.take_resets()
        self._over += over
        if any(reset.done for reset in over):
            self._machine.restart()
            self._begin_anew()
