"""Reads the parameters of a node when the node starts."""
import os
import sys
from dataclasses import fields

import rospy

from tb3_labs.config import NOT_GIVEN, from_parameters, spelling_hint
from tb3_labs.robot.turtlebot3 import model_of_environment, robot_model


def read_config(*config_types, of=None, typed=()):
    """Returns an instance of each of `config_types`. The values come from the node's ``~``
    parameters, and from `typed`. Raises ``ValueError`` for an unknown or invalid parameter. If `of`
    names another node, the values come from that node, and unknown parameters are ignored."""
    node = of or rospy.get_name()
    given = rospy.get_param(node, {})
    if not isinstance(given, dict):
        raise ValueError(f'parameter {node} = {given!r} is not valid: the name of the node holds '
                         'its parameters')
    given.update(typed)
    known = {item.name for config_type in config_types for item in fields(config_type)} | {'model'}
    if of is None:
        for word in sys.argv[1:]:
            name, has_value, _ = word.partition(':=')
            if name in known or not has_value:    # rospy renames a topic, or ignores `word`
                shown = name if has_value else 'NAME'
                raise ValueError(f'{word} is not an argument; a parameter is given by '
                                 f'_{shown}:=VALUE (--help tells more)')
        for name in sorted(set(given) - known):
            raise ValueError(f'parameter {node}/{name} is unknown; {spelling_hint(name, known)}')
    try:
        configs = [from_parameters(config_type, given) for config_type in config_types]
    except ValueError as problem:
        raise ValueError(f'parameter {node}/{problem}') from None
    return configs[0] if len(configs) == 1 else configs


def read_model():
    """Returns the RobotModel of the parameter ``~model``, else of the variable TURTLEBOT3_MODEL."""
    name = rospy.get_param('~model', NOT_GIVEN)
    if name == NOT_GIVEN:
        return model_of_environment(os.environ)
    return robot_model(name)
