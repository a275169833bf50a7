"""Can a node be started by ``rosrun PACKAGE FILE``? If not, what is to be typed?"""
import difflib
from pathlib import Path

import rospkg
from roslib.packages import find_node

#: Where a node's file is looked for in a package; links are followed.
DEPTHS = '*', '*/*', '*/*/*'
#: This number of files is named.
MOST_NAMES = 5


def place_of(package, executable):
    """The path of the file that rosrun would start.

    ``ValueError`` with the reason, and what to type, if there is none.
    """
    packs = rospkg.RosPack()
    try:
        folder = Path(packs.get_path(package))
    except rospkg.ResourceNotFound:
        raise ValueError('there is no package {} in this terminal{}; build its workspace, and type: '
                         'source devel/setup.bash'.format(
                             package, _near(package, packs.list()))) from None
    found = find_node(package, executable, packs)
    if found:
        return found[0]
    files = [path for depth in DEPTHS for path in sorted(folder.glob(depth)) if path.is_file()]
    for path in files:
        if path.name == executable:
            raise ValueError('{0} is not executable, so rosrun cannot start it; type: chmod +x {0}'
                             .format(path))
    names = [path.name for path in files if path.suffix == '.py']
    raise ValueError('there is no {} in the package {}, {}{}'.format(
        executable, package, folder, _near(executable, names) or '; there are: {}'.format(
            ', '.join(sorted(set(names))[:MOST_NAMES]) or 'no Python files')))


def _near(name, known):
    near = difflib.get_close_matches(name, sorted(known), 1)
    return ', near it: ' + near[0] if near else ''
