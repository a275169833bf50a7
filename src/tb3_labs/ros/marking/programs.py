"""The texts of programs that a node is compared with."""
from pathlib import Path

import rospkg

from tb3_labs.handout.skeletons import FOLDER, programs
from tb3_labs.marking.conduct import NODE_TEXT
from tb3_labs.marking.labs import LABS

#: Where this package has nodes, or what a student might take for one.
FOLDERS = ('scripts', 'src/tb3_labs/nodes', 'test/ros/student_nodes')


def node_texts(logs):
    """Student -> the program of the node, from the folder of the logs."""
    return {path.name[:-len(NODE_TEXT)]: path.read_text(errors='replace')
            for path in sorted(Path(logs).glob('*' + NODE_TEXT))}


def own_programs():
    """Name -> program of this package, as far as its sources are here."""
    place = _place()
    return {'tb3_labs/{}/{}'.format(folder, path.name): path.read_text(errors='replace')
            for folder in FOLDERS for path in sorted((place / folder).glob('*.py'))}


def given_programs():
    """The programs of the skeletons, which everybody was given."""
    folder = _place() / FOLDER
    return [program for lab in LABS if (folder / lab).is_dir() for program in programs(folder / lab)]


def _place():
    return Path(rospkg.RosPack().get_path('tb3_labs'))
