"""Tries a node of a lab out, part by part."""
from typing import NamedTuple

from tb3_labs.marking.labs import LABS
from tb3_labs.ros.marking import gamepad, imu, move2goal, turn
from tb3_labs.ros.marking.stage import Stage


class Script(NamedTuple):
    """What is done to the nodes of a lab."""

    listens: str      # the topic a node must listen to in order to be ready
    parts: dict       # name -> what is done, given a Stage


SCRIPTS = {
    'imu': Script(imu.LISTENS, imu.PARTS),
    'turn': Script(turn.LISTENS, turn.PARTS),
    'move2goal': Script(move2goal.LISTENS, move2goal.PARTS),
    'gamepad': Script(gamepad.LISTENS, gamepad.PARTS),
}


def try_out(lab, package, executable, parts=(), keep=lambda observation: None):
    """The Observation of a node, of these parts of its lab or of all.

    ``ValueError`` for a lab or a part that there is not. `keep` is called with what there is of
    the Observation, whenever a step was completed.
    """
    if lab not in LABS:
        raise ValueError('there is no lab {!r}: {}'.format(lab, ', '.join(LABS)))
    script = SCRIPTS[lab]
    for part in parts:
        if part not in script.parts:
            raise ValueError('lab {} has no part {!r}: {}'.format(lab, part,
                                                                ', '.join(script.parts)))
    stage = Stage(lab, package, executable, script.listens, keep)
    try:
        for name, act in script.parts.items():
            if not parts or name in parts:
                act(stage)
    finally:
        stage.stop()
    return stage.observation
