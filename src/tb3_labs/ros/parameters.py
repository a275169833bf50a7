"""ROS parameters read into the core's configurations.

Names, defaults, units and bounds stand in the configuration's fields and nowhere else. An invalid
value raises ``ValueError`` with one sentence that names the parameter, its value and the bounds.
:func:`tb3_labs.ros.node.run` turns it into one fatal line and an exit status.
"""
import os
from dataclasses import fields

import rospy

from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, robot_model

#: The value that a launch file passes on for an argument that was not given.
NOT_GIVEN = 'default'


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
        names = [item.name for item in fields(kind)]
        known.update(names)
        try:
            configs.append(kind(**{
                name: given[name] for name in names if given.get(name, NOT_GIVEN) != NOT_GIVEN}))
        except ValueError as problem:
            raise ValueError('parameter {}/{}'.format(of or rospy.get_name(), problem)) from None
    for name in () if of else sorted(set(given) - known - {'model'}):
        rospy.logwarn('parameter %s/%s is unknown and ignored; known here: %s',
                      rospy.get_name(), name, ', '.join(sorted(known)))
    return configs[0] if len(configs) == 1 else configs


def read_model():
    """The robot's numbers, by ``~model``, else by TURTLEBOT3_MODEL in the environment."""
    return model_called(rospy.get_param('~model', NOT_GIVEN))


def model_called(name):
    """The robot's numbers; `name` is a model, or NOT_GIVEN. ``ValueError`` for an unknown one."""
    return robot_model(os.environ.get('TURTLEBOT3_MODEL') or DEFAULT_MODEL
                       if name == NOT_GIVEN else name)
