"""Tries a node of a lab out, part by part."""
from tb3_labs.marking.labs import GAMEPAD, IMU, LABS, MOVE2GOAL, TURN
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.ros.marking import gamepad, imu, move2goal, turn
from tb3_labs.ros.marking.stage import Stage

#: lab -> part -> what is done, given a Stage
SCRIPTS = {IMU: imu.PARTS, TURN: turn.PARTS, MOVE2GOAL: move2goal.PARTS, GAMEPAD: gamepad.PARTS}


def try_out(lab, package, executable, parts=(), keep=lambda observation: None,
            pad=PadConfig(), tell=lambda words: None):
    """The Observation of a node, of these parts of its lab, or of all if none are given.

    `keep` is called with the Observation so far whenever a step was completed; `pad`: the numbers of
    the gamepad that is played; `tell` hears what is tried now, in words.
    """
    stage = Stage(lab, package, executable, LABS[lab].listens, keep, pad, tell)
    try:
        for name, act in SCRIPTS[lab].items():
            if not parts or name in parts:
                stage.begin(name)
                act(stage)
    except Exception as problem:
        # what was not tried must not look as if the node had failed it
        stage.observation.broken = '{}: {}'.format(type(problem).__name__, problem)
        stage.keep()
        raise
    finally:
        stage.node.stop()
        stage.witness.end()
    return stage.observation
