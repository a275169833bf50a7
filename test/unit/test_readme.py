"""The README's tables of settings against the configurations: the same number stands in both."""
import pathlib
from dataclasses import fields

import pytest

from tb3_labs.config import bounds_in_words
from tb3_labs.control.driving import DriveConfig
from tb3_labs.control.turning import TurnConfig
from tb3_labs.nodes.move_to_goal import MoveToGoalConfig
from tb3_labs.nodes.pad import PadConfig
from tb3_labs.simulation.simulator import SimulatorConfig

README = pathlib.Path(__file__).resolve().parents[2] / 'README.md'


def row(item):
    """A field as the README's tables show it."""
    default = item.default
    if isinstance(default, bool):
        default = str(default).lower()
    elif isinstance(default, float):
        default = '{:g}'.format(default)
    return '| `{}` | {} | {} | {} |'.format(
        item.name, default, bounds_in_words(item), item.metadata['meaning'])


@pytest.mark.parametrize('kind', [
    MoveToGoalConfig, DriveConfig, TurnConfig, PadConfig, SimulatorConfig])
def test_every_setting_stands_in_the_readme_as_in_the_code(kind):
    lines = README.read_text(encoding='utf-8').splitlines()
    assert [row(item) for item in fields(kind) if row(item) not in lines] == []
