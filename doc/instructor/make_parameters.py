"""Writes the files `launch/params/NODE.yaml` from the settings of the nodes.

    python3 doc/instructor/make_parameters.py

The default, unit, bounds and meaning of a setting stand in the node's configuration, a dataclass of
`tb3_labs.config.setting`. For a new node, add a line to `NODES`.
`test/unit/test_parameters.py` compares the files with the texts that this command writes.
"""
import pathlib
import sys
from dataclasses import dataclass, fields
from typing import NamedTuple

import one_line_errors    # noqa: F401 (it changes how Python reports the errors below)
import yaml

from tb3_labs.config import NOT_GIVEN, Config, setting, valid_values_text
from tb3_labs.control.drive_law import DriveConfig
from tb3_labs.nodes.controller.turns import TurnConfig
from tb3_labs.nodes.gamepad.pad import PadConfig
from tb3_labs.nodes.move_to_goal.status import MoveToGoalConfig
from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.simulation.simulator_config import FIXED_FIELDS, SimulatorConfig

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARAMS = ROOT / 'launch' / 'params'
sys.path.insert(0, str(ROOT / 'scripts'))

from fake_turtlebot3 import FakeTurtlebot3Config    # noqa: E402 (the path is set before)


@dataclass(frozen=True)
class ModelConfig(Config):
    """The parameter that tb3_labs.ros.parameters.read_model reads."""

    model: str = setting(NOT_GIVEN, 'kind of TurtleBot3', choices=(NOT_GIVEN,) + tuple(MODELS))


#: gamepad.launch reads these settings from a file pad_NAME.yaml.
PAD_NUMBERS = tuple(yaml.safe_load((PARAMS / 'pad_handout.yaml').read_text(encoding='utf-8')))
#: A user types these settings as words after the node's name, so they are no parameters.
TYPED = ('has_control',)
#: {configuration that dynamic_reconfigure changes: fields that it cannot change}
LIVE = {DriveConfig: (), TurnConfig: (), SimulatorConfig: FIXED_FIELDS}


class NodeParameters(NamedTuple):
    """A node with settings."""

    name: str
    script: str
    launch_file: str
    configs: tuple           # the configurations that the node reads, beside ModelConfig
    arguments: tuple = ()    # the settings that are arguments of the launch file, beside model

    @property
    def settings(self):
        """Returns (field, is_live) for each setting. `is_live` is True if the setting may change
        while the node runs."""
        settings = {}
        for kind in (ModelConfig, *self.configs):
            for item in fields(kind):
                is_live = kind in LIVE and item.name not in LIVE[kind]
                # SimulatorConfig also has a model, which must not replace that of ModelConfig
                settings.setdefault(item.name, (item, is_live))
        return list(settings.values())


NODES = (
    NodeParameters('controller', 'turtlebot_controller.py', 'turn.launch', (TurnConfig,)),
    NodeParameters('move_to_goal', 'move2goal_tf.py', 'move2goal.launch',
                   (MoveToGoalConfig, DriveConfig)),
    NodeParameters('gamepad', 'gamepad.py', 'gamepad.launch', (PadConfig,)),
    NodeParameters('turtlebot3', 'fake_turtlebot3.py', 'fake_robot.launch',
                   (SimulatorConfig, FakeTurtlebot3Config),
                   ('start_yaw_deg', 'imu_offset_deg', 'mystery')))


def annotated_yaml(node):
    """Returns the text of launch/params/NODE.yaml with default, valid values and meaning of each
    parameter."""
    lines = [f'# {node.name} ({node.script}): all parameters: default, valid values, meaning. '
             '(live): dynparam sets it.',
             '# Made by `python3 doc/instructor/make_parameters.py`. Copy lines that you change '
             'to a file of',
             f'# your own: roslaunch tb3_labs {node.launch_file} params:=my.yaml',
             '# A line with # in front is an argument of the launch file; your file overrides it.']
    for item, is_live in node.settings:
        if item.name in TYPED:
            continue
        value = yaml.safe_dump({item.name: item.default}, default_flow_style=False).strip()
        if item.name in ('model', *node.arguments, *PAD_NUMBERS):
            value = '#' + value
        meaning = item.metadata['meaning']
        if is_live:
            meaning += ' (live)'
        lines.append(f'{value:<28} # {valid_values_text(item)}: {meaning}')
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    for each in NODES:
        (PARAMS / (each.name + '.yaml')).write_text(annotated_yaml(each), encoding='utf-8')
