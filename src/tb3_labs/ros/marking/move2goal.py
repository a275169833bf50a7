"""How a node of the Transformation lab is tried out."""
import math

import rospy
from std_msgs.msg import Bool, Empty

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.move2goal import ASTRAY, DRIVE_TIME, GOAL
from tb3_labs.ros.marking.reset_caller import ResetCaller

LISTENS = 'odom'
#: A node that has not begun to move by then does not [s].
REACTION = 4.0
#: A robot that rested for so long without a command has arrived [s].
ARRIVAL = 1.5
#: So long in a drive, before something happens to it [s].
WELL_UNDER_WAY = 0.7
#: What a robot recalibrates after `reset` [s], and a little.
RECALIBRATION = 3.2
#: The pose that is declared where a node takes any.
DECLARED = Pose2(0.2, 0.3, math.radians(90.0))
NO_SERVICE = 'it offers no service whose name has "reset" or "pose" in it'


class Trial:
    """One node, its permission, its reset service."""

    def __init__(self, stage):
        self.stage = stage
        self._control = rospy.Publisher('ctrl_relinq', Bool, queue_size=1, latch=True)
        # a node that hears of nothing but True at once may take it for what was said before it came
        self.control(False)

    def control(self, given):
        """Give the robot to the node, or take it."""
        self._control.publish(given)

    def resets(self):
        """The ResetCaller of the node that runs."""
        return ResetCaller(self.stage.graph.services())

    @property
    def pose(self):
        """Where the robot truly is, a Pose2."""
        return Pose2(*self.stage.pose)

    def drive(self, name, local_T_base=Pose2(), start=None):
        """Give control, wait until the robot has arrived, or will not; `local_T_base`: where it
        was in the local frame when it truly was at `start`; None: now."""
        stage, start = self.stage, start or self.pose
        local_T_world = local_T_base @ start.inverse()
        with stage.stimulus(name, goal=GOAL, moved=False, rested=False, local_T_world=[
                local_T_world.x, local_T_world.y, local_T_world.yaw]) as record:
            self.control(True)
            record.facts['moved'] = stage.wait_until(
                lambda: stage.moves(record.begin) or not stage.alive, REACTION)
            if record.facts['moved']:
                stage.wait_until(lambda: not stage.alive or self._has_arrived()
                                 or self.pose.distance_to(start) > ASTRAY, DRIVE_TIME)
                record.facts['rested'] = self._has_arrived()

    def _has_arrived(self):
        return self.stage.rests() and not self.stage.moves(self.stage.now - ARRIVAL)

    def start_driving(self):
        """Have a node drive. True in the middle of it, False if it does not, None if there is no
        node. One that runs and can be reset drives again after a reset."""
        return self.stage.set_in_motion(self._is_ready, lambda: self.control(True), REACTION,
                                        WELL_UNDER_WAY)

    def _is_ready(self):
        self.control(False)
        stage = self.stage
        if not stage.alive or not stage.wait_for_rest(2.0):
            stage.stop()
        else:
            caller = self.resets()
            if not caller.found or caller.call(Pose2()):
                stage.stop()
        return stage.alive


def drive(stage):
    """Without control; the first drive, from where the odometry begins; silence at the goal."""
    trial = Trial(stage)
    start = trial.pose
    if not stage.start():
        return
    with stage.stimulus('without control'):
        stage.wait(1.5)
    trial.drive('first drive', start=start)
    with stage.stimulus('at the goal'):
        stage.wait(1.5)


def reset(stage):
    """The robot is moved, the frame reset, the task done again."""
    trial = Trial(stage)
    trial.control(False)
    if not stage.alive and not stage.start():
        return
    stage.wait(0.3)
    stage.face(stage.heading_deg + 100.0, seconds=4.0)
    caller = trial.resets()
    if not caller.found:
        for name in ('reset', 'second drive'):
            stage.not_offered(name, NO_SERVICE)
        return
    with stage.stimulus('reset', problem='') as record:
        record.facts['problem'] = caller.call(Pose2())
        stage.wait(0.5)
    if not record.facts['problem']:
        trial.drive('second drive')


def control(stage):
    """Control is taken in the middle of a drive; Ctrl+C in another."""
    trial = Trial(stage)
    moving = trial.start_driving()
    if moving is None:
        return
    with stage.stimulus('control taken', was_moving=moving):
        trial.control(False)
        stage.wait(1.5)
    stage.ctrl_c_in_motion(trial.start_driving)
    trial.control(False)


def declared(stage):
    """A reset to a pose that is not zero."""
    trial = Trial(stage)
    trial.control(False)
    if not stage.start():
        return
    caller = trial.resets()
    names = 'reset to another pose', 'drive from a declared pose'
    if not {'x', 'y', 'yaw'} <= caller.takes:
        for name in names:
            stage.not_offered(name, 'its reset takes no pose' if caller.found else NO_SERVICE)
        return
    # where the unit of the yaw is not known, zero is zero in any
    pose = DECLARED if 'unit' in caller.takes else Pose2(DECLARED.x, DECLARED.y, 0.0)
    with stage.stimulus(names[0], problem='') as record:
        record.facts['problem'] = caller.call(pose)
        stage.wait(0.5)
    if not record.facts['problem']:
        trial.drive(names[1], pose)


def offset(stage):
    """The robot's own `reset` zeroes the odometry and leaves the IMU as it is: they differ."""
    trial = Trial(stage)
    stage.stop()
    trial.control(False)
    stage.face(100.0)
    board = rospy.Publisher('reset', Empty, queue_size=1)
    stage.wait_until(board.get_num_connections, 5.0)
    board.publish()
    stage.wait(RECALIBRATION)
    if not stage.start():
        return
    caller = trial.resets()
    if caller.found:
        caller.call(Pose2())
    trial.drive('drive with an offset IMU')
    trial.control(False)


def lost(stage):
    """The odometry falls silent in the middle of a drive."""
    trial = Trial(stage)
    moving = trial.start_driving()
    if moving is None:
        return
    stage.silence('odometry silent', 'odom_silent', moving)
    trial.control(False)


PARTS = {'drive': drive, 'reset': reset, 'control': control, 'declared': declared,
         'offset': offset, 'lost': lost}
