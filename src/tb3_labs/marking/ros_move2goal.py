"""The scripts for a node of the Transformation lab."""
import math
import time

import rospy
from std_msgs.msg import Bool, Empty

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking import move2goal as asked
from tb3_labs.marking.move2goal import (
    ASTRAY, DRIVE_TIME, PROBLEM, REACTION, TAKES_EFFECT, TURNED, WATCHED)
from tb3_labs.marking.observation import (
    CTRL_RELINQ, GOAL_POSE, LOCAL_T_WORLD, LONGEST, MOVED, RESTED, WAS_MOVING)
from tb3_labs.marking.observation import RESET as ROBOTS_RESET
from tb3_labs.marking.ros_interface import ALL, UNIT, ResetCaller
from tb3_labs.marking.ros_robot import ODOM_SWITCH, RESTS
from tb3_labs.ros.clocks import wait_until

#: A robot has arrived if it rests and had no command to move for this time [s].
ARRIVAL = 1.5
#: The robot has this heading before its own `reset` [deg].
OFFSET_HEADING = 100.0
#: The robot recalibrates after its `reset` for less than this time [s].
RECALIBRATION = 3.2
#: The pose for the reset of a node that takes any pose.
DECLARED_POSE = Pose2(0.2, 0.3, math.radians(90.0))
#: The robot's own `reset` is published only while it rests.
MOVES = 'the robot did not come to rest, so that it could not be reset'
NO_SERVICE = 'it offers no service whose name has "reset" or "pose" in it'


class Control:
    """Gives control of the robot to the node, and takes it; at first it is taken."""

    def __init__(self, stage):
        self._stage = stage
        self._control = rospy.Publisher(CTRL_RELINQ, Bool, queue_size=1, latch=True)
        # a node may take a first True for an old permission: it hears False before
        self.give(False)

    def give(self, given):
        """Give control to the node (True), or take it (False)."""
        self._control.publish(given)

    def drive(self, name, local_T_base=Pose2(), start=None):
        """The stimulus of a drive: control is given; it ends if the robot has arrived or is astray.

        `local_T_base`: the robot's pose in the local frame when its true pose was `start`, or now.
        """
        node, recorder = self._stage.node, self._stage.recorder
        start = start or recorder.pose
        local_T_world = local_T_base @ start.inverse()
        facts = {GOAL_POSE: asked.GOAL, MOVED: False, RESTED: False,
                 LOCAL_T_WORLD: [local_T_world.x, local_T_world.y, local_T_world.yaw]}
        with self._stage.stimulus(name, facts) as record:
            record.facts[MOVED] = self._stage.moves_after(lambda: self.give(True), REACTION)
            if record.facts[MOVED]:
                wait_until(lambda: not node.alive or recorder.rests(ARRIVAL)
                           or recorder.pose.distance_to(start) > ASTRAY, DRIVE_TIME)
                record.facts[RESTED] = recorder.rests(ARRIVAL)

    def start_driving(self):
        """Have the node drive. Returns the same values as Stage.set_in_motion().

        A node that runs and can be reset drives again after a reset. Any other is started anew.
        """
        return self._stage.set_in_motion(self._is_ready, lambda: self.give(True), REACTION)

    def _is_ready(self):
        self.give(False)
        node = self._stage.node
        if not (node.alive and wait_until(self._stage.recorder.rests, RESTS)
                and reset_to_origin(node)):
            node.stop()
        return node.alive


def reset_to_origin(node):
    """Reset the node's frame, if the node offers it. Returns True if that succeeded."""
    caller = ResetCaller(node.graph)
    return bool(caller.found) and not caller.call(Pose2())


def drive(stage):
    """The node waits without control, drives from the odometry's origin, is silent at the goal."""
    control = Control(stage)
    start = stage.recorder.pose
    if not stage.node.start():
        return
    with stage.stimulus(asked.WITHOUT_CONTROL):
        time.sleep(WATCHED)
    control.drive(asked.FIRST_DRIVE, start=start)
    with stage.stimulus(asked.AT_GOAL):
        time.sleep(WATCHED)


def reset(stage):
    """The marker turns the robot, resets the frame, and has the node drive again."""
    control = Control(stage)
    if not stage.node.alive and not stage.node.start():
        return
    time.sleep(0.3)
    stage.robot.face(stage.recorder.heading_deg + TURNED)
    caller = ResetCaller(stage.node.graph)
    if not caller.found:
        stage.not_offered([asked.RESET_TO_ORIGIN, asked.SECOND_DRIVE], NO_SERVICE)
        return
    if _reset(stage, asked.RESET_TO_ORIGIN, caller, Pose2()):
        control.drive(asked.SECOND_DRIVE)


def _reset(stage, name, caller, pose):
    with stage.stimulus(name) as record:
        record.facts[PROBLEM] = caller.call(pose)[:LONGEST]
        time.sleep(TAKES_EFFECT)
    return not record.facts[PROBLEM]


def control_taken(stage):
    """Control is taken in the middle of a drive; then Ctrl+C in another."""
    control = Control(stage)
    moving = control.start_driving()
    if moving is None:
        return
    with stage.stimulus(asked.CONTROL_TAKEN, {WAS_MOVING: moving}):
        control.give(False)
        time.sleep(WATCHED)
    stage.ctrl_c_in_motion(control.start_driving)
    control.give(False)


def declared(stage):
    """The frame is reset to a pose that is not the origin; then the node drives."""
    control = Control(stage)
    if not stage.node.start():
        return
    caller = ResetCaller(stage.node.graph)
    if not ALL <= caller.takes:
        stage.not_offered([asked.RESET_ELSEWHERE, asked.DECLARED_DRIVE],
                          'its reset takes no pose' if caller.found else NO_SERVICE)
        return
    # a zero yaw is the same in any unit, so the unit may be unknown
    pose = DECLARED_POSE if UNIT in caller.takes else Pose2(DECLARED_POSE.x, DECLARED_POSE.y, 0.0)
    if _reset(stage, asked.RESET_ELSEWHERE, caller, pose):
        control.drive(asked.DECLARED_DRIVE, pose)


def offset(stage):
    """The robot's own `reset` sets the odometry to zero, not the IMU; then the node drives."""
    control = Control(stage)
    stage.node.stop()
    board = rospy.Publisher(ROBOTS_RESET, Empty, queue_size=1)
    wait_until(board.get_num_connections, 5.0)
    if not stage.robot.face(OFFSET_HEADING):
        stage.not_offered([asked.OFFSET_DRIVE], MOVES)
        return
    board.publish()
    time.sleep(RECALIBRATION)
    if stage.node.start():
        reset_to_origin(stage.node)
        control.drive(asked.OFFSET_DRIVE)
        control.give(False)


def lost(stage):
    """The odometry falls silent in the middle of a drive."""
    control = Control(stage)
    moving = control.start_driving()
    if moving is not None:
        stage.sensor_falls_silent(asked.ODOMETRY_SILENT, moving, ODOM_SWITCH)
        control.give(False)


PARTS = {asked.DRIVE: drive, asked.RESET: reset, asked.CONTROL: control_taken,
         asked.DECLARED: declared, asked.OFFSET: offset, asked.LOST: lost}
