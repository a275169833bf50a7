#!/usr/bin/env python3
"""Writes the files made from the nodes' settings: `doc/instructor/parameters.md`, `launch/params/NODE.yaml`.

    python3 test/make_parameters.py

A setting's default, unit, bounds and meaning stand in one place, the dataclass made of
`tb3_labs.config.setting` that the node reads. A new node is one more line in `LAUNCH_FILES`.
`test/unit/test_parameters.py` compares the files with this command.
"""
import pathlib
from dataclasses import dataclass, fields

import yaml

from tb3_labs.config import NOT_GIVEN, Config, bounds_in_words, setting
from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.ros.launching.node_source import NodeSource
from tb3_labs.simulation.simulator_config import STARTING

ROOT = pathlib.Path(__file__).resolve().parents[1]
#: The nodes with settings, and the launch file that offers all of them as arguments.
LAUNCH_FILES = {
    'imu_sub.py': 'imu_sub.launch',
    'turtlebot_controller.py': 'turn.launch',
    'mouse_client.py': 'turn.launch',
    'move2goal_tf.py': 'move2goal.launch',
    'gamepad.py': 'gamepad.launch',
    'fake_turtlebot3.py': 'fake_robot.launch',
    'panel.py': 'panel.launch',
}
#: Arguments of launch files with other names than the parameter: {(node, parameter): name}.
ARGUMENTS = {('mouse', 'rate'): 'mouse_rate'}
#: Configurations that dynamic_reconfigure offers, and their fields that it does not.
LIVE = {'DriveConfig': (), 'TurnConfig': (), 'SimulatorConfig': STARTING}
#: Marks live parameters in the YAML files.
LIVE_MARK = ' (live)'


@dataclass(frozen=True)
class ModelConfig(Config):
    """The parameter of tb3_labs.ros.parameters.read_model."""

    model: str = setting(NOT_GIVEN, 'kind of TurtleBot3', choices=(NOT_GIVEN,) + tuple(MODELS))


HEAD = """\
# Parameters of all nodes

`python3 test/make_parameters.py` makes this page from the settings in the code. Edit the settings.

Each parameter can be given in four ways. If two of them differ, the lower one holds.

| way | example |
|---|---|
| the package's file, `launch/params/NODE.yaml` | loaded by each launch file; holds the defaults |
| a file of your own | `roslaunch tb3_labs move2goal.launch sim:=true params:=my.yaml` |
| an argument of the launch file | `roslaunch tb3_labs move2goal.launch sim:=true max_linear:=0.1` |
| while the node runs, where *live* says yes | `dynparam set /move_to_goal max_linear 0.1` |

A file of your own holds only the lines that differ: copy them from the package's file. If a launch
file starts several nodes, the others have files, too: `move_to_goal_params:=`,
`turtlebot3_params:=`, `mouse_params:=`. Each launch file except `classroom.launch` passes every
argument on to the files that it includes: `roslaunch tb3_labs turn.launch sim:=true slip:=0.1`.

`roslaunch --ros-args tb3_labs FILE` lists a launch file's own arguments. A default in parentheses
counts as not given: your file goes before it. A launch file refuses unknown arguments, and values
out of bounds, before anything starts. A node names unknown parameters in a warning at its start.

`dynparam` is on the PATH of `scripts/setup.sh`'s shell; in a workspace of your own it is
`rosrun tb3_labs dynparam.py`. Its settings last as long as the node.

The model `default` is `TURTLEBOT3_MODEL` in the environment, else burger.
"""


class Node:
    """A script's node, with the configurations that it reads."""

    def __init__(self, script):
        self.script = script
        self.launch_file = LAUNCH_FILES[script]
        source = NodeSource((ROOT / 'scripts' / script).read_text(encoding='utf-8'))
        self.name = source.name
        self.configs = source.has_model * [ModelConfig] + source.configs

    @property
    def settings(self):
        """(field, may it change while the node runs?) of each parameter."""
        found = {}
        for kind in self.configs:
            for item in fields(kind):
                live = kind.__name__ in LIVE and item.name not in LIVE[kind.__name__]
                found.setdefault(item.name, (item, live))    # the robot's own model comes second
        return list(found.values())

    def argument(self, item):
        """The parameter's name in the launch file."""
        return ARGUMENTS.get((self.name, item.name), item.name)


def nodes():
    """All nodes of LAUNCH_FILES."""
    return [Node(script) for script in LAUNCH_FILES]


def shown(value):
    """A default as the tables show it."""
    if isinstance(value, bool):
        return str(value).lower()
    return '{:g}'.format(value) if isinstance(value, float) else str(value)


def table(node):
    """The node's part of doc/instructor/parameters.md."""
    lines = ['', '## {}'.format(node.name), '',
             '`scripts/{}`, started by `launch/{}`; file `launch/params/{}.yaml`.'.format(
                 node.script, node.launch_file, node.name), '',
             '| parameter | default | valid | meaning | live |', '|---|---|---|---|---|']
    for item, live in node.settings:
        lines.append('| `{}` | {} | {} | {} | {} |'.format(
            item.name, shown(item.default), bounds_in_words(item), item.metadata['meaning'],
            'yes' if live else 'no'))
    for item, _ in node.settings:
        if node.argument(item) != item.name:
            lines += ['', 'The launch file calls `{}` `{}`.'.format(
                item.name, node.argument(item))]
    return '\n'.join(lines) + '\n'


def annotated_yaml(node):
    """launch/params/NODE.yaml: each default, and beside it the valid values and the meaning."""
    own_file = node.argument(node.settings[0][0]) == node.settings[0][0].name
    lines = ['# {} ({}): all parameters: default, valid values, meaning.'.format(
                 node.name, node.script),
             '# Made by `python3 test/make_parameters.py`. Copy lines that you change to a file of',
             '# your own: roslaunch tb3_labs {} {}:=my.yaml'.format(
                 node.launch_file, 'params' if own_file else node.name + '_params')]
    if node.name == 'gamepad':
        lines.append('# Axes and buttons of other pads: pad_*.yaml beside this file (pad:=xbox).')
    for item, live in node.settings:
        value = yaml.safe_dump({item.name: item.default}, default_flow_style=False).strip()
        lines.append('{:<28} # {}: {}{}'.format(value, bounds_in_words(item),
                                                item.metadata['meaning'], LIVE_MARK * live))
    return '\n'.join(lines) + '\n'


def made():
    """{path: text} of all files."""
    files = {'doc/instructor/parameters.md': HEAD + ''.join(table(node) for node in nodes())}
    files.update({'launch/params/{}.yaml'.format(node.name): annotated_yaml(node)
                  for node in nodes()})
    return files


if __name__ == '__main__':
    for path, text in made().items():
        (ROOT / path).write_text(text, encoding='utf-8')
