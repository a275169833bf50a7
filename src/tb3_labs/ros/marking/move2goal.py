"""How a node of the Transformation lab is tried out."""
import math

import rospy
from std_msgs.msg import Empty

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking import move2goal as asked
from tb3_labs.marking.conduct import ODOM_SWITCH
from tb3_labs.marking.observation import WAS_MOVING
from tb3_labs.marking.move2goal import (CONTROL, DECLARED, DRIVE, LOST, OFFSET, PROBLEM, RESET,
                                        TAKES_EFFECT, TURNED, WATCHED)
from tb3_labs.ros.marking.driver import Driver
from tb3_labs.ros.marking.requests import ALL, UNIT
from tb3_labs.ros.marking.waiting import wait, wait_until

#: The heading before the robot's own reset [deg].
OFFSET_HEADING = 100.0
#: The robot's recalibration after `reset`, and a little more [s].
RECALIBRATION = 3.2
#: The pose that is declared to a node that takes any.
DECLARED_POSE = Pose2(0.2, 0.3, math.radians(90.0))
NO_SERVICE = 'it offers no service whose name has "reset" or "pose" in it'


def drive(stage):
    """Without control; the first drive, from where the odometry begins; silence at the goal."""
    driver = Driver(stage)
    start = driver.pose
    if not stage.node.start():
        return
    with stage.stimulus(asked.WITHOUT_CONTROL):
        wait(WATCHED)
    driver.drive(asked.FIRST_DRIVE, start=start)
    with stage.stimulus(asked.AT_GOAL):
        wait(WATCHED)


def reset(stage):
    """The robot is moved, the frame reset, the task done again."""
    driver = Driver(stage)
    if not stage.node.alive and not stage.node.start():
        return
    wait(0.3)
    stage.robot.face(stage.recorder.heading_deg + TURNED, seconds=4.0)
    caller = driver.resets()
    if not caller.found:
        stage.not_offered([asked.RESET_TO_ORIGIN, asked.SECOND_DRIVE], NO_SERVICE)
        return
    if _reset(stage, asked.RESET_TO_ORIGIN, caller, Pose2()):
        driver.drive(asked.SECOND_DRIVE)


def _reset(stage, name, caller, pose):
    """The stimulus of a reset to this pose; True if it succeeded."""
    with stage.stimulus(name) as record:
        record.facts[PROBLEM] = caller.call(pose)
        wait(TAKES_EFFECT)
    return not record.facts[PROBLEM]


def control(stage):
    """Control is taken in the middle of a drive; Ctrl+C in another."""
    driver = Driver(stage)
    moving = driver.start_driving()
    if moving is None:
        return
    with stage.stimulus(asked.CONTROL_TAKEN, {WAS_MOVING: moving}):
        driver.control(False)
        wait(WATCHED)
    stage.ctrl_c_in_motion(driver.start_driving)
    driver.control(False)


def declared(stage):
    """A reset to a pose that is not the origin."""
    driver = Driver(stage)
    if not stage.node.start():
        return
    caller = driver.resets()
    if not ALL <= caller.takes:
        stage.not_offered([asked.RESET_ELSEWHERE, asked.DECLARED_DRIVE],
                          'its reset takes no pose' if caller.found else NO_SERVICE)
        return
    # zero is zero in any unit, so that an unknown one does no harm
    pose = DECLARED_POSE if UNIT in caller.takes else Pose2(DECLARED_POSE.x, DECLARED_POSE.y, 0.0)
    if _reset(stage, asked.RESET_ELSEWHERE, caller, pose):
        driver.drive(asked.DECLARED_DRIVE, pose)


def offset(stage):
    """The robot's own `reset` zeroes the odometry and leaves the IMU as it is: they differ."""
    driver = Driver(stage)
    stage.node.stop()
    stage.robot.face(OFFSET_HEADING)
    board = rospy.Publisher('reset', Empty, queue_size=1)
    wait_until(board.get_num_connections, 5.0)
    board.publish()
    wait(RECALIBRATION)
    if not stage.node.start():
        return
    caller = driver.resets()
    if caller.found:
        caller.call(Pose2())
    driver.drive(asked.OFFSET_DRIVE)
    driver.control(False)


def lost(stage):
    """The odometry falls silent in the middle of a drive."""
    driver = Driver(stage)
    moving = driver.start_driving()
    if moving is None:
        return
    stage.sensor_falls_silent(asked.ODOMETRY_SILENT, moving, ODOM_SWITCH)
    driver.control(False)


PARTS = {DRIVE: drive, RESET: reset, CONTROL: control, DECLARED: declared, OFFSET: offset,
         LOST: lost}
