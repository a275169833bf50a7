"""The settings in the code, the files made from them, and the launch files agree."""
import ast
import re
import sys
import xml.etree.ElementTree as ET
from dataclasses import fields, replace

import pytest
import yaml
from roslaunch.arg_dump import get_args

from pages import PAGES, ROOT, by_name, commands
from tb3_labs.config import bounds_in_words
from tb3_labs.control.goal import DriveConfig
from tb3_labs.control.turning import TurnConfig
from tb3_labs.nodes.move_to_goal import MoveToGoalConfig
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.panel.panel_config import PanelConfig
from tb3_labs.simulation.simulator_config import SimulatorConfig

sys.path.insert(0, str(ROOT / 'test'))

import make_parameters  # noqa: E402

NODES = make_parameters.nodes()


def shown(item):
    """The default of an argument that stands for a parameter: as not given, with its value."""
    if item.name == 'model':
        return '($(optenv TURTLEBOT3_MODEL burger))'
    return '({})'.format(make_parameters.shown(item.default) or 'none')


def elements(node):
    """The launch file of a node, and in it the element of that node."""
    launch = ET.parse(str(ROOT / 'launch' / node.launch_file)).getroot()
    return launch, launch.find("node[@type='{}']".format(node.script))


def test_the_files_are_as_the_command_makes_them():
    for path, text in make_parameters.made().items():
        assert (ROOT / path).read_text(encoding='utf-8') == text, \
            path + ' is old: python3 test/make_parameters.py'


def row(item):
    """A field as in the page's tables, without the last column."""
    default = item.default
    if isinstance(default, bool):
        default = str(default).lower()
    elif isinstance(default, float):
        default = '{:g}'.format(default)
    return '| `{}` | {} | {} | {} |'.format(
        item.name, default, bounds_in_words(item), item.metadata['meaning'])


@pytest.mark.parametrize('kind', [
    MoveToGoalConfig, DriveConfig, TurnConfig, PadConfig, SimulatorConfig, PanelConfig])
def test_every_setting_stands_in_the_page_as_in_the_code(kind):
    lines = (ROOT / 'doc' / 'instructor' / 'parameters.md').read_text(encoding='utf-8').splitlines()
    assert [row(item) for item in fields(kind) if item.name != 'model'
            and not any(line.startswith(row(item)) for line in lines)] == []


def test_each_script_that_reads_settings_is_among_the_nodes():
    readers = {path.name for path in (ROOT / 'scripts').glob('*.py')
               if 'read_config(' in path.read_text(encoding='utf-8')}
    assert readers - {'demo.py'} == set(make_parameters.LAUNCH_FILES)


@pytest.mark.parametrize('node', NODES, ids=lambda node: node.name)
def test_a_file_holds_what_the_node_takes_without_it(node):
    text = (ROOT / 'launch' / 'params' / (node.name + '.yaml')).read_text(encoding='utf-8')
    values = yaml.safe_load(text)
    assert values == {item.name: item.default for item, _ in node.settings}
    for kind in node.configs:      # the same types too: no 1 where 1.0 is meant
        kind(**{name: values[name] for name in values if name in kind.__dataclass_fields__
                and not (name == 'model' and values[name] == 'default')})


@pytest.mark.parametrize('node', NODES, ids=lambda node: node.name)
def test_the_launch_file_offers_every_parameter_and_shows_its_default(node):
    launch, _ = elements(node)
    offered = {arg.get('name'): arg for arg in launch.findall('arg')}
    for item, _ in node.settings:
        argument = offered[node.argument(item)]
        assert argument.get('default') == shown(item)
        unit = item.metadata['unit']
        if item.name != 'model':       # the other nodes read the environment as well, and say so
            assert argument.get('doc') == item.metadata['meaning'] + (
                ' [{}]'.format(unit) if unit else '')


@pytest.mark.parametrize('path', sorted((ROOT / 'launch').glob('*.launch')), ids=lambda path: path.stem)
def test_what_counts_as_not_given_shows_a_default_of_a_node(path):
    valid = {}
    for node in NODES:
        for item, _ in node.settings:
            valid.setdefault(node.argument(item), set()).add(shown(item))
    for arg in ET.parse(str(path)).getroot().findall('arg'):
        if (arg.get('default') or '').startswith('('):
            words = {'user': '(as in ~/.ssh/config)', 'prefix': '(by ROS_NAMESPACE)',
                     'multi_robot_name': '(by ROS_NAMESPACE)'}.get(arg.get('name'), '(none)')
            assert arg.get('default') in valid.get(arg.get('name'), {words}), arg.get('name')
        assert 'default' not in (arg.get('default'), arg.get('value'))


@pytest.mark.parametrize('path', sorted((ROOT / 'launch').glob('*.launch')), ids=lambda path: path.stem)
def test_roslaunch_lists_an_argument_as_required_only_if_it_is(path, monkeypatch):
    monkeypatch.delenv('ROS_NAMESPACE', raising=False)
    monkeypatch.delenv('DISPLAY', raising=False)
    required = [name for name, (_, default) in get_args([str(path)]).items() if not default]
    assert required == (['robot'] if path.stem == 'robot' else [])


@pytest.mark.parametrize('node', NODES, ids=lambda node: node.name)
def test_the_launch_file_hands_on_what_was_given_and_nothing_else(node):
    _, element = elements(node)
    handed = {param.get('name'): (param.get('value'), param.get('unless'))
              for param in element.findall('param')}
    assert handed == {item.name: ('$(arg {})'.format(node.argument(item)),
                                  "$(eval str({}).startswith('('))".format(node.argument(item)))
                      for item, _ in node.settings}
    # later ones win: the package's file, one's own, then the arguments
    tags = [child.tag for child in element]
    assert tags == sorted(tags, key=lambda tag: tag != 'rosparam')
    files = [child.get('file') for child in element.findall('rosparam')]
    assert files[0] == '$(find tb3_labs)/launch/params/{}.yaml'.format(node.name)
    assert files[-1] in ('$(arg params)', '$(arg {}_params)'.format(node.name))


@pytest.mark.parametrize('path', sorted((ROOT / 'launch' / 'params').glob('pad_*.yaml')),
                         ids=lambda path: path.stem)
def test_a_pads_file_holds_parameters_of_the_gamepad(path):
    gamepad = next(node for node in NODES if node.name == 'gamepad')
    values = yaml.safe_load(path.read_text(encoding='utf-8'))
    assert set(values) <= {item.name for item, _ in gamepad.settings}
    if path.stem == 'pad_handout':     # the handout's numbering is the node's own
        defaults = {item.name: item.default for item, _ in gamepad.settings}
        assert values == {name: defaults[name] for name in values}


def test_what_may_change_while_it_runs_is_what_the_nodes_offer():
    """Only a script with LiveSettings has live parameters, and each such script has some."""
    for node in NODES:
        source = (ROOT / 'scripts' / node.script).read_text(encoding='utf-8')
        offers = any(isinstance(part, ast.Call) and getattr(part.func, 'id', '') == 'LiveSettings'
                     for part in ast.walk(ast.parse(source)))
        assert any(live for _, live in node.settings) == offers, node.name


@by_name(PAGES)
def test_dynparam_sets_what_is_live_to_what_is_valid(page):
    nodes = {node.name: node for node in make_parameters.nodes()}
    for command in commands(page):
        for name, parameter, value in re.findall(r'dynparam set /(\w+) (\w+) (\S+)', command):
            node = nodes[name]
            assert parameter in {item.name for item, live in node.settings if live}, command
            kind = next(kind for kind in node.configs if parameter in kind.__dataclass_fields__
                        and kind is not make_parameters.ModelConfig)
            replace(kind(), **{parameter: yaml.safe_load(value)})
