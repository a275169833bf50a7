"""ROS parameters read into the core's configurations.

Names, defaults, units and bounds stand in the configuration's fields and nowhere else. An invalid
value raises ``ValueError`` with one sentence that names the parameter, its value and the bounds.
:func:`tb3_labs.ros.node.run` turns it into one fatal line and an exit status.
"""
import os
from dataclasses import fields

import rospy

from tb3_labs.config import NOT_GIVEN, from_parameters
from tb3_labs.robot.turtlebot3 import model_called


def read_config(*kinds, of=None):
    """One instance of each configuration class in `kinds`, from the node's ``~`` parameters.

    A private parameter that belongs to none of them is most likely misspelt: a warning names it.
    The word "default" means "not given". So a launch file can pass on an argument that was not set,
    without a second copy of the number. `of` names another node, whose parameters are read.
    Raises ``ValueError`` for the first invalid value.
    """
    given = rospy.get_param(of or '~', {})
    known = set()
    configs = []
    for kind in kinds:
        known.update(item.name for item in fields(kind))
        try:
            configs.append(from_parameters(kind, given))
        except ValueError as problem:
            raise ValueError('parameter {}/{}'.format(of or rospy.get_name(), problem)) from None
    for name in () if of else sorted(set(given) - known - {'model'}):
        rospy.logwarn('parameter %s/%s is unknown and ignored; known here: %s',
                      rospy.get_name(), name, ', '.join(sorted(known)))
    return configs[0] if len(configs) == 1 else configs


def read_model():
    """The robot's numbers, by ``~model``, else by TURTLEBOT3_MODEL in the environment."""
    return model_called(rospy.get_param('~model', NOT_GIVEN), os.environ)


def use_up(name):
    """Delete the parameter `name`, if it is set: it was meant for this start of the node only."""
    if rospy.has_param(name):
        rospy.delete_param(name)
