"""Writes the files `launch/params/NODE.yaml` from the settings of the nodes.

    python3 doc/instructor/make_parameters.py

The default, unit, bounds and meaning of a setting stand in the node's configuration, a dataclass of
`tb3_labs.config.setting`. A new node is a new line in `NODES`.
`test/unit/test_parameters.py` compares the files with this command.
"""
import importlib.util
import pathlib
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, fields

import yaml

from tb3_labs.config import NOT_GIVEN, Config, bounds_text, setting
from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.simulation.simulator_config import FIXED_FIELDS

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: The nodes with settings: (name, script, launch file, classes that the script reads).
NODES = (
    ('controller', 'turtlebot_controller.py', 'turn.launch', ('TurnConfig',)),
    ('move_to_goal', 'move2goal_tf.py', 'move2goal.launch',
     ('MoveToGoalConfig', 'DriveConfig')),
    ('gamepad', 'gamepad.py', 'gamepad.launch', ('PadConfig',)),
    ('turtlebot3', 'fake_turtlebot3.py', 'fake_robot.launch',
     ('SimulatorConfig', 'FakeTurtlebot3Config')),
    ('panel', 'panel.py', 'panel.launch', ('PanelConfig',)),
)
#: configuration that dynamic_reconfigure changes -> fields that dynamic_reconfigure cannot change
LIVE = {'DriveConfig': (), 'TurnConfig': (), 'SimulatorConfig': FIXED_FIELDS}


@dataclass(frozen=True)
class ModelConfig(Config):
    """The parameter that tb3_labs.ros.parameters.read_model reads."""

    model: str = setting(NOT_GIVEN, 'kind of TurtleBot3', choices=(NOT_GIVEN,) + tuple(MODELS))


class NodeParameters:
    """The configurations that a node reads, and the element of the launch file that starts it."""

    def __init__(self, name, script, launch_file, kinds):
        self.name, self.script, self.launch_file = name, script, launch_file
        #: The file that reads the settings. This is the ROS side in the node's room, or the script.
        self.source = ROOT / 'src/tb3_labs/nodes' / name / 'ros_node.py'
        if not self.source.exists():
            self.source = ROOT / 'scripts' / script
        spec = importlib.util.spec_from_file_location(name + '_source', str(self.source))
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        self.configs = [getattr(module, kind) for kind in kinds]
        if hasattr(module, 'read_model'):
            self.configs.insert(0, ModelConfig)
        self.launch = ET.parse(str(ROOT / 'launch' / launch_file)).getroot()
        #: The text of the element that starts the node, a node or an include of launch/nodes.
        self.element = next(ET.tostring(item, 'unicode') for item in self.launch if name in (
            item.get('name'), *(part.get('value') for part in item.findall('arg'))))

    @property
    def settings(self):
        """(field, may it change while the node runs?) for each parameter."""
        found = {}
        for kind in self.configs:
            for item in fields(kind):
                live = kind.__name__ in LIVE and item.name not in LIVE[kind.__name__]
                found.setdefault(item.name, (item, live))    # the robot's own model comes second
        return list(found.values())

    @property
    def arguments(self):
        """The parameters that are arguments of the launch file."""
        return re.findall(r"(\w+): '?\$\(arg \1\)", self.element)

    @property
    def typed(self):
        """The settings that a user types as words after the node. They are no parameters."""
        return re.findall(r'_(\w+):=\$\(arg \1\)', self.element)

    @property
    def pad(self):
        """The parameters that the launch file reads from the file of a gamepad's numbers."""
        if '$(arg pad_file)' not in self.element:
            return []
        path = ROOT / 'launch' / 'params' / 'pad_handout.yaml'
        return list(yaml.safe_load(path.read_text(encoding='utf-8')))


def nodes():
    """Returns the NodeParameters of all NODES."""
    return [NodeParameters(*each) for each in NODES]


def annotated_yaml(node):
    """Returns the text of launch/params/NODE.yaml with default, valid values and meaning of each
    parameter."""
    lines = [f'# {node.name} ({node.script}): all parameters: default, valid values, meaning. '
             '(live): dynparam sets it.',
             '# Made by `python3 doc/instructor/make_parameters.py`. Copy lines that you change '
             'to a file of',
             f'# your own: roslaunch tb3_labs {node.launch_file} params:=my.yaml',
             '# A line with # in front is an argument of the launch file; your file overrides it.']
    for item, live in node.settings:
        if item.name in node.typed:
            continue
        value = yaml.safe_dump({item.name: item.default}, default_flow_style=False).strip()
        if item.name in node.arguments + node.pad:
            value = '#' + value
        meaning = item.metadata['meaning'] + (' (live)' if live else '')
        lines.append(f'{value:<28} # {bounds_text(item)}: {meaning}')
    return '\n'.join(lines) + '\n'


def made():
    """Returns path -> text for all files."""
    return {f'launch/params/{node.name}.yaml': annotated_yaml(node)
            for node in nodes() if '$(arg params)' in node.element}


if __name__ == '__main__':
    for path, text in made().items():
        (ROOT / path).write_text(text, encoding='utf-8')
