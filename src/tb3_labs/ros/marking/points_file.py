"""The points of each criterion, as an instructor sets them."""
from pathlib import Path

import rospkg
import yaml

from tb3_labs.command_line import reason


def points_file():
    """This package's file with the points of each criterion."""
    return Path(rospkg.RosPack().get_path('tb3_labs')) / 'test' / 'marking' / 'points.yaml'


def read_points(path):
    """The table in a file of points, which is this package's if `path` is None.

    ``ValueError`` with the reason if it cannot be read.
    """
    path = path or points_file()
    try:
        with open(str(path), encoding='utf-8') as file:
            return yaml.safe_load(file)
    except OSError as problem:
        raise ValueError('the points, {}, cannot be read: {}'.format(
            path, problem.strerror)) from None
    except (UnicodeDecodeError, yaml.YAMLError) as problem:
        raise ValueError('the points, {}, are no YAML: {}'.format(
            path, reason(problem))) from None
