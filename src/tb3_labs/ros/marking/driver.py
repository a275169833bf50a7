"""Gives the robot to a node of the Transformation lab, and sees it drive."""
import rospy
from std_msgs.msg import Bool

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.drives import (ASTRAY, DRIVE_TIME, GOAL, GOAL_POSE, LOCAL_T_WORLD,
                                     REACTION)
from tb3_labs.marking.observation import MOVED, RESTED
from tb3_labs.marking.topics import CTRL_RELINQ
from tb3_labs.ros.marking.reset_caller import ResetCaller
from tb3_labs.ros.marking.waiting import wait_until

#: A robot that rests, and had no command for this time, has arrived [s].
ARRIVAL = 1.5
#: A drive has lasted this long before something happens to it [s].
WELL_UNDER_WAY = 0.7
#: A node lets the robot rest within this time after control was taken [s].
RESTS = 2.0


class Driver:
    """The person who gives the node control, and takes it; it is taken at first."""

    def __init__(self, stage):
        self._stage = stage
        self._control = rospy.Publisher(CTRL_RELINQ, Bool, queue_size=1, latch=True)
        # a node that hears nothing but True at once may take it for an old permission
        self.control(False)

    def control(self, given):
        """Give the robot to the node, or take it."""
        self._control.publish(given)

    def resets(self):
        """The ResetCaller of the node that runs."""
        return ResetCaller(self._stage.node.graph)

    @property
    def pose(self):
        """The robot's true pose, a Pose2."""
        return Pose2(*self._stage.recorder.pose)

    def drive(self, name, local_T_base=Pose2(), start=None):
        """The stimulus of a drive: control is given, until the robot arrived or goes astray.

        `local_T_base`: the robot's pose in the local frame when its true pose was `start`; None:
        the true pose now.
        """
        node, recorder, start = self._stage.node, self._stage.recorder, start or self.pose
        local_T_world = local_T_base @ start.inverse()
        facts = {GOAL_POSE: GOAL, MOVED: False, RESTED: False,
                 LOCAL_T_WORLD: [local_T_world.x, local_T_world.y, local_T_world.yaw]}
        with self._stage.stimulus(name, facts) as record:
            record.facts[MOVED] = self._stage.moves_after(lambda: self.control(True), REACTION)
            if record.facts[MOVED]:
                wait_until(lambda: not node.alive or recorder.rests(ARRIVAL)
                           or self.pose.distance_to(start) > ASTRAY, DRIVE_TIME)
                record.facts[RESTED] = recorder.rests(ARRIVAL)

    def start_driving(self):
        """Have the node drive; returns as Stage.set_in_motion().

        A node that runs and can be reset drives again after a reset; another is started anew.
        """
        return self._stage.set_in_motion(self._is_ready, lambda: self.control(True), REACTION,
                                         WELL_UNDER_WAY)

    def _is_ready(self):
        self.control(False)
        node = self._stage.node
        if not node.alive or not wait_until(self._stage.recorder.rests, RESTS):
            node.stop()
        else:
            caller = self.resets()
            if not caller.found or caller.call(Pose2()):
                node.stop()
        return node.alive
