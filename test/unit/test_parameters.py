"""The settings in the code, the files that are made from them, and the launch files agree."""
import ast
import re
import sys
import xml.etree.ElementTree as ET
from dataclasses import fields, replace

import pytest
import rospy
import yaml

from pages import PAGES, ROOT, by_name, commands
from tb3_labs.nodes.gamepad.pad import PadConfig
from tb3_labs.ros.parameters import read_config

import make_parameters

LAB_NODES = make_parameters.NODES
every_node = pytest.mark.parametrize('node', LAB_NODES, ids=lambda node: node.name)


def test_the_files_are_those_that_the_command_makes():
    for node in LAB_NODES:
        path = make_parameters.PARAMS / (node.name + '.yaml')
        assert path.read_text(encoding='utf-8') == make_parameters.annotated_yaml(node), \
            f'{path} is old: python3 doc/instructor/make_parameters.py'


def source_of(node):
    """The file that reads the settings: the ROS side in the node's room, or the script."""
    side = ROOT / 'src/tb3_labs/nodes' / node.name / 'ros_node.py'
    return side if side.exists() else ROOT / 'scripts' / node.script


def test_each_node_that_reads_settings_is_in_the_list():
    places = [*(ROOT / 'scripts').glob('*.py'), *ROOT.glob('src/tb3_labs/nodes/*/ros_*.py')]
    readers = {path for path in places if 'read_config(' in path.read_text(encoding='utf-8')}
    others = {ROOT / 'scripts/demo.py', ROOT / 'scripts/panel.py'}    # these scripts have no file of parameters
    assert readers - others == set(map(source_of, LAB_NODES))


@pytest.mark.parametrize('given', [5, True, [1, 2], 'text'])
def test_a_value_in_place_of_a_nodes_parameters_is_refused(given, monkeypatch):
    """`rosparam set /gamepad 5`."""
    monkeypatch.setattr(rospy, 'get_param', lambda *_: given)
    with pytest.raises(ValueError, match='^parameter /unnamed = .* is not valid: the name of the node'):
        read_config(PadConfig)


@pytest.mark.parametrize('word, valid', [
    ('dead_zone:=0.2', '_dead_zone:=VALUE'), ('dead_zone', '_NAME:=VALUE'), ('_dead_zone=0.2', '_NAME:=VALUE')])
def test_a_word_that_rospy_would_ignore_is_refused(word, valid, monkeypatch):
    monkeypatch.setattr(rospy, 'get_param', lambda *_: {})
    monkeypatch.setattr(sys, 'argv', ['gamepad.py', word])
    with pytest.raises(ValueError, match='^' + word + ' is not an argument; .*' + valid):
        read_config(PadConfig)
    monkeypatch.setattr(sys, 'argv', ['gamepad.py', '_dead_zone:=0.2', 'joy:=joy2', '__ns:=robot3'])
    assert read_config(PadConfig) == PadConfig()


@every_node
def test_a_launch_file_starts_a_node_with_the_defaults_of_the_node(node):
    """Arguments, the pad's file and the YAML file have each parameter once, with its type."""
    launch = ET.parse(str(ROOT / 'launch' / node.launch_file)).getroot()
    given = {arg.get('name'): yaml.safe_load(arg.get('default'))
             for arg in launch.findall('arg') if arg.get('name') in ('model', *node.arguments)}
    assert given.pop('model') == '$(optenv TURTLEBOT3_MODEL burger)'
    text = ET.tostring(launch, 'unicode')
    for name in ('model', *node.arguments):
        assert re.search(r"{0}: '?\$\(arg {0}\)".format(name), text), name
    if '$(arg pad_file)' in text:
        given.update(yaml.safe_load((make_parameters.PARAMS / 'pad_handout.yaml').read_text()))
    values = yaml.safe_load((make_parameters.PARAMS / (node.name + '.yaml')).read_text(encoding='utf-8'))
    assert not set(values) & set(given)
    given.update(values)
    assert given == {item.name: item.default for item, _ in node.settings
                     if item.name not in ('model', *make_parameters.TYPED)}
    for kind in node.configs:
        kind(**{name: given[name] for name in given if name in kind.__dataclass_fields__})


@pytest.mark.parametrize('path', sorted((ROOT / 'launch' / 'params').glob('pad_*.yaml')),
                         ids=lambda path: path.stem)
def test_a_pads_file_has_all_numbers_of_a_pad(path):
    assert tuple(yaml.safe_load(path.read_text(encoding='utf-8'))) == make_parameters.PAD_NUMBERS


@every_node
def test_a_node_has_live_parameters_exactly_if_it_has_live_settings(node):
    source = source_of(node).read_text(encoding='utf-8')
    offers = any(isinstance(part, ast.Call) and getattr(part.func, 'id', '') == 'LiveSettings'
                 for part in ast.walk(ast.parse(source)))
    assert any(live for _, live in node.settings) == offers


def set_by(command):
    """Yields (node, {name: value}) for each parameter that a command of a page sets."""
    nodes = {node.name: node for node in LAB_NODES}
    for name, parameter, value in re.findall(r'dynparam set /(\w+) (\w+) (\S+)', command):
        assert dict((item.name, live) for item, live in nodes[name].settings)[parameter], command
        yield nodes[name], {parameter: yaml.safe_load(value)}
    file, = re.findall(r'tb3_labs (\w+\.launch)', command) or ['fake_robot.launch']
    for robot, text in re.findall(r'\b(robot_)?set:="([^"]*)"', command):
        own = [node for node in LAB_NODES if node.launch_file == file]
        yield nodes['turtlebot3'] if robot else own[0], yaml.safe_load(text)


@by_name(PAGES)
def test_the_pages_set_valid_values(page):
    for command in commands(page):
        for node, values in set_by(command):
            kinds = {item.name: kind for kind in node.configs for item in fields(kind)}
            for name, value in values.items():
                replace(kinds[name](), **{name: value})
