"""How a node of the IMU lab is tried out."""
from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.marking import mouse as on_mouse
from tb3_labs.marking.conduct import IMU_SWITCH
from tb3_labs.marking.mouse import AT_LAST, HELD
from tb3_labs.marking.observation import MOVED, RESTED, WAS_MOVING
from tb3_labs.marking.turn import BOTH, IMU_SILENT, LOST, MOUSE, SHUTDOWN, TURNS
from tb3_labs.marking.turning import ANSWER, LEFT, NONSENSE, REACTION, TURN_TIME, TYPED_NONSENSE
from tb3_labs.marking.turning import TURNS as EACH_TURN
from tb3_labs.ros.marking.mouse import mouse_of
from tb3_labs.ros.marking.waiting import wait, wait_until

#: A robot farther than this off the heading where a turn should begin is set right [deg].
ASTRAY = 25.0
#: Where the robot should be when nonsense is typed [deg]: after the last turn.
LAST_HEADING = -50.0
#: A turn has lasted this long before something happens to it [s].
WELL_UNDER_WAY = 0.3
#: A node that commanded no movement for this time does not turn any more [s].
QUIET = 0.4


def turns(stage):
    """Five turns, each begun near its own heading whatever became of the last one; nonsense."""
    for name, turn in EACH_TURN.items():
        if not _begin_at(stage, turn.begins_deg):
            return
        try_turn(stage, name, turn.typed)
    if _begin_at(stage, LAST_HEADING):
        with stage.stimulus(NONSENSE):
            stage.node.type(TYPED_NONSENSE)
            wait(ANSWER)


def _begin_at(stage, heading):
    """Is there a node that waits for input, and a robot at rest near this heading [deg]? Both are
    brought about if need be."""
    astray = abs(difference_degrees(stage.recorder.heading_deg, heading)) > ASTRAY
    if stage.node.alive and stage.recorder.rests() and not astray:
        return True
    stage.node.stop()
    if astray:
        stage.robot.face(heading)
    return stage.node.start()


def try_turn(stage, name, typed):
    """Type it, and wait until the robot rests again."""
    with stage.stimulus(name, {MOVED: False, RESTED: False}) as record:
        record.facts[MOVED] = stage.moves_after(lambda: stage.node.type(typed), REACTION)
        record.facts[RESTED] = wait_until(
            lambda: not stage.node.alive or stage.recorder.rests(QUIET),
            TURN_TIME if record.facts[MOVED] else 0.0)


def mouse(stage):
    """The mouse alone, before any key was pressed."""
    hand = mouse_of(stage, on_mouse.ALONE) if stage.node.start() else None
    if hand is None:
        return
    with hand:
        with stage.stimulus(on_mouse.NOT_ACTIVE):
            hand.at(0.0, 1.0, active=False)
            wait(HELD)
        hand.at(0.0, 0.0)
        wait(0.2)
        for name, place in on_mouse.PLACES.items():
            with stage.stimulus(name):
                hand.at(*place)
                wait(HELD)
        hand.at(0.0, 1.0)
        wait(0.4)
        with stage.stimulus(on_mouse.DEACTIVATED):
            hand.at(0.0, 1.0, active=False)
            wait(1.0)


def both(stage):
    """Turns beside an active mouse, the mouse after a turn and in the middle of one."""
    runs = _is_idle(stage) or stage.node.start()
    hand = mouse_of(stage, on_mouse.BESIDE_TURNS) if runs else None
    if hand is None:
        return
    with hand:
        hand.at(0.0, 0.0)
        wait(0.3)
        try_turn(stage, on_mouse.TURN_BESIDE, LEFT)
        with stage.stimulus(on_mouse.AFTER_TURN):
            hand.at(0.0, 1.0)
            wait(HELD)
        hand.at(0.0, 0.0)
        wait_until(stage.recorder.rests, 2.0)
        moving = stage.moves_after(lambda: stage.node.type(LEFT), REACTION)
        wait(WELL_UNDER_WAY)
        with stage.stimulus(on_mouse.IN_TURN, {WAS_MOVING: moving}) as record:
            hand.at(0.0, 1.0)
            wait_until(lambda: on_mouse.drives_forward(
                stage.recorder.commands_since(record.begin)), AT_LAST)
        hand.at(0.0, 0.0, active=False)
        wait(0.2)


def _is_idle(stage):
    """Does the node run, and has it let the robot rest?"""
    return stage.node.alive and wait_until(lambda: stage.recorder.rests(QUIET), 1.0)


def _in_a_turn(stage):
    """Have the node turn; returns as Stage.set_in_motion()."""
    return stage.set_in_motion(lambda: _is_idle(stage), lambda: stage.node.type(LEFT), REACTION,
                               WELL_UNDER_WAY)


def shutdown(stage):
    """Ctrl+C in the middle of a turn."""
    stage.ctrl_c_in_motion(lambda: _in_a_turn(stage))


def lost(stage):
    """The mouse falls silent while it drives, the IMU in a turn."""
    if not stage.node.start():
        return
    hand = mouse_of(stage, [on_mouse.SILENT])
    if hand is not None:
        with hand:
            hand.at(0.0, 0.0)
            wait(0.3)
            moving = stage.moves_after(lambda: hand.at(0.0, 1.0), 0.5)
            wait(WELL_UNDER_WAY)
            stage.falls_silent(on_mouse.SILENT, moving, hand.silence)
            hand.at(0.0, 0.0, active=False)
            wait(0.3)
    moving = _in_a_turn(stage)
    if moving is not None:
        stage.sensor_falls_silent(IMU_SILENT, moving, IMU_SWITCH)


PARTS = {TURNS: turns, MOUSE: mouse, BOTH: both, SHUTDOWN: shutdown, LOST: lost}
