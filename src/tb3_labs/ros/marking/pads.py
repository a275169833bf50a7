"""The numbers of the known gamepads: launch/params/pad_NAME.yaml, as gamepad.launch loads them."""
from pathlib import Path

import rospkg
import yaml

from tb3_labs.nodes.pad_config import PadConfig

#: The pad that is played if none is named.
HANDOUT = 'handout'
FILE = 'pad_{}.yaml'


def pad_called(name):
    """The PadConfig of a pad; ``ValueError`` with the valid names for an unknown one."""
    folder = Path(rospkg.RosPack().get_path('tb3_labs')) / 'launch' / 'params'
    before, after = FILE.split('{}')
    known = sorted(path.name[len(before):-len(after)] for path in folder.glob(FILE.format('*')))
    if name not in known:
        raise ValueError('there is no pad {!r}; valid: {}'.format(name, ', '.join(known)))
    return PadConfig(**yaml.safe_load((folder / FILE.format(name)).read_text(encoding='utf-8')))


def pad_in_words(name):
    """A sentence: the pad, and the numbers of its sticks and buttons."""
    pad = pad_called(name)
    return 'The pad was "{}": axis {} drives, axis {} turns; button {} is A, {} is B, {} is Y.'.format(
        name, pad.linear_axis, pad.angular_axis, pad.relinquish_button, pad.regain_button,
        pad.reset_button)
