"""Reads the parameters of a node when the node starts."""
import os
import sys
from dataclasses import fields
from itertools import chain

import rospy

from tb3_labs.config import NOT_GIVEN, from_parameters, spelling_hint
from tb3_labs.robot.turtlebot3 import model_of_environment, robot_model


def read_config(*config_types, other_node=None, typed_values=()):
    """Returns an instance of each of `config_types`. The values come from the node's ``~``
    parameters, and from `typed_values`. Raises ``ValueError`` for an unknown or invalid parameter.
    If `other_node` is given, reads the parameters of that node and ignores unknown parameters."""
    node = other_node or rospy.get_name()
    values = rospy.get_param(node, {})
    if not isinstance(values, dict):
        raise ValueError(f'parameter {node} = {values!r} is not valid: the name of the node holds '
                         'its parameters')
    values.update(typed_values)
    if other_node is None:
        known_names = {item.name for item in chain(*map(fields, config_types))} | {'model'}
        _refuse_wrong_words(known_names)
        for name in sorted(set(values) - known_names):
            remedy = spelling_hint(name, known_names)
            raise ValueError(f'parameter {node}/{name} is unknown; {remedy}')
    try:
        configs = [from_parameters(config_type, values) for config_type in config_types]
    except ValueError as error:
        raise ValueError(f'parameter {node}/{error}') from None
    return configs[0] if len(configs) == 1 else configs


def _refuse_wrong_words(known_names):
    """Refuse a typed parameter without the _ before its name, and a word without `:=`."""
    for word in sys.argv[1:]:
        name, separator, _ = word.partition(':=')
        if name in known_names or not separator:
            shown_name = name if separator else 'NAME'
            raise ValueError(f'{word} is not an argument; a parameter is given by '
                             f'_{shown_name}:=VALUE (--help tells more)')


def read_model():
    """Returns the RobotModel of the parameter ``~model``, else of the variable TURTLEBOT3_MODEL."""
    name = rospy.get_param('~model', NOT_GIVEN)
    if name == NOT_GIVEN:
        return model_of_environment(os.environ)
    return robot_model(name)
