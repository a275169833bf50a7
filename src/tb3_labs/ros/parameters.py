"""ROS parameters read into the core's configurations.

Names, defaults, units and bounds stand in the configuration's fields and nowhere else. An unknown
name and an invalid value raise ``ValueError`` with one sentence. :func:`tb3_labs.ros.node.run`
turns it into one fatal line, and ends the node and its launch.
"""
import os
from dataclasses import fields

import rospy

from tb3_labs.config import NOT_GIVEN, from_parameters, nearest
from tb3_labs.robot.turtlebot3 import model_called


def read_config(*kinds, of=None):
    """One instance of each configuration class in `kinds`, from the node's ``~`` parameters.

    `of` names another node, whose parameters are read; its further ones are not looked at.
    Raises ``ValueError`` for the first parameter that is unknown or not valid.
    """
    given = rospy.get_param(of or '~', {})
    known = {item.name for kind in kinds for item in fields(kind)} | {'model'}
    for name in () if of else sorted(set(given) - known):
        raise ValueError('parameter {}/{} is unknown; {}'.format(
            rospy.get_name(), name, nearest(name, known)))
    try:
        configs = [from_parameters(kind, given) for kind in kinds]
    except ValueError as problem:
        raise ValueError('parameter {}/{}'.format(of or rospy.get_name(), problem)) from None
    return configs[0] if len(configs) == 1 else configs


def read_model():
    """The robot's numbers, by ``~model``, else by TURTLEBOT3_MODEL in the environment."""
    return model_called(rospy.get_param('~model', NOT_GIVEN), os.environ)


def use_up(name):
    """Delete the parameter `name`, if it is set: it was meant for this start of the node only."""
    if rospy.has_param(name):
        rospy.delete_param(name)
