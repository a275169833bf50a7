"""How a node of the IMU lab is tried out."""
import rospy

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.marking.turn import BESIDE_MOUSE, NONSENSE, TURN_TIME, TURNS
from tb3_labs.msg import MouseController
from tb3_labs.ros.marking.hand import Hand

LISTENS = 'imu'
#: A node that has not begun to move by then does not [s].
REACTION = 3.0
#: Farther off the heading where a turn should begin than this, the robot is set right [deg].
ASTRAY = 25.0
#: So long in a turn, before something happens to it [s].
WELL_UNDER_WAY = 0.3


def turns(stage):
    """Five turns, each begun near its own heading whatever became of the one before; nonsense."""
    for name, (typed, _, heading) in TURNS.items():
        if not _begin_at(stage, heading):
            return
        _turn(stage, name, typed)
    if _begin_at(stage, -50.0):
        with stage.stimulus('nonsense'):
            stage.type(NONSENSE)
            stage.wait(1.5)


def _begin_at(stage, heading):
    """A node that waits for input, and a robot that rests near this heading [deg]."""
    astray = abs(difference_degrees(stage.heading_deg, heading)) > ASTRAY
    if stage.alive and stage.rests() and not astray:
        return True
    stage.stop()
    if astray:
        stage.face(heading)
    return stage.start()


def _turn(stage, name, typed):
    """Type it, and wait until the robot rests again."""
    with stage.stimulus(name, moved=False, rested=False) as record:
        stage.type(typed)
        record.facts['moved'] = stage.wait_until(
            lambda: stage.moves(record.begin) or not stage.alive, REACTION)
        record.facts['rested'] = stage.wait_until(
            lambda: not stage.alive or stage.rests() and not stage.moves(stage.now - 0.4),
            TURN_TIME if record.facts['moved'] else 0.0)


class Mouse:
    """The hand on the mouse of a node that listens to mouse_info, by that node's own message."""

    def __init__(self, stage):
        self._kind = stage.graph.kind_of('mouse_info') or MouseController
        self._hand = Hand('mouse_info', self._kind)

    def at(self, x, y, active=True):
        """Hold it there: x to the right, y up, -1 to 1."""
        message = self._kind()
        message.header.stamp = rospy.Time.now()
        message.status.data = active
        message.xPos, message.yPos = x, y
        self._hand.hold(message)

    def silence(self):
        """Pull its plug."""
        self._hand.hold(None)

    close = property(lambda self: self._hand.close)


def _mouse_of(stage, *names):
    """The Mouse of a node; None, and these stimuli cannot be, if it does not listen to one."""
    if not stage.graph.listens_to('mouse_info'):
        reason = 'it does not listen to mouse_info'
    else:
        mouse = Mouse(stage)
        try:
            mouse.at(0.0, 0.0, active=False)
            stage.wait(0.5)
            return mouse
        except AttributeError as problem:
            reason = 'its message on mouse_info has other fields: {}'.format(problem)
        mouse.close()
    for name in names:
        stage.not_offered(name, reason)
    return None


def mouse(stage):
    """The mouse alone, before any key was pressed."""
    if not stage.start():
        return
    pointer = _mouse_of(stage, 'mouse not active', 'mouse up', 'mouse near the middle',
                        'mouse left', 'mouse half right', 'mouse deactivated')
    if pointer is None:
        return
    with stage.stimulus('mouse not active'):
        pointer.at(0.0, 1.0, active=False)
        stage.wait(0.7)
    pointer.at(0.0, 0.0)
    stage.wait(0.3)
    for name, place in (('mouse up', (0.0, 1.0)), ('mouse near the middle', (0.2, -0.2)),
                        ('mouse left', (-1.0, 0.0)), ('mouse half right', (0.6, 0.0))):
        with stage.stimulus(name):
            pointer.at(*place)
            stage.wait(1.0)
    pointer.at(0.0, 1.0)
    stage.wait(0.4)
    with stage.stimulus('mouse deactivated'):
        pointer.at(0.0, 1.0, active=False)
        stage.wait(1.2)
    pointer.close()


def both(stage):
    """Turns beside an active mouse, the mouse after a turn and in the middle of one."""
    if not _is_idle(stage) and not stage.start():
        return
    pointer = _mouse_of(stage, BESIDE_MOUSE, 'mouse after a turn', 'mouse in a turn')
    if pointer is None:
        return
    pointer.at(0.0, 0.0)
    stage.wait(0.5)
    _turn(stage, BESIDE_MOUSE, 'l')
    with stage.stimulus('mouse after a turn'):
        pointer.at(0.0, 1.0)
        stage.wait(1.0)
    pointer.at(0.0, 0.0)
    stage.wait_for_rest(2.0)
    begun = stage.now
    stage.type('l')
    moving = stage.wait_until(lambda: stage.moves(begun) or not stage.alive, REACTION)
    stage.wait(WELL_UNDER_WAY)
    with stage.stimulus('mouse in a turn', was_moving=moving) as record:
        pointer.at(0.0, 1.0)
        stage.wait_until(lambda: any(entry[1] > 0.4 for entry in
                                     stage.commands_since(record.begin)), 4.0)
    pointer.at(0.0, 0.0, active=False)
    stage.wait(0.2)
    pointer.close()


def _is_idle(stage):
    """Does the node run, and has it let the robot rest?"""
    return stage.alive and stage.wait_for_rest(1.0) and not stage.moves(stage.now - 0.4)


def _in_a_turn(stage):
    """Have the node turn, which runs if need be. True in the middle of the turn, False if it does
    not turn, None if it does not run."""
    return stage.set_in_motion(lambda: _is_idle(stage), lambda: stage.type('l'), REACTION,
                               WELL_UNDER_WAY)


def shutdown(stage):
    """Ctrl+C in the middle of a turn."""
    stage.ctrl_c_in_motion(lambda: _in_a_turn(stage))


def lost(stage):
    """The mouse falls silent while it drives, the IMU in a turn."""
    if not stage.start():
        return
    pointer = _mouse_of(stage, 'mouse silent')
    if pointer is not None:
        pointer.at(0.0, 0.0)
        stage.wait(0.3)
        begun = stage.now
        pointer.at(0.0, 1.0)
        stage.wait(0.5)
        with stage.stimulus('mouse silent', was_moving=stage.moves(begun)):
            pointer.silence()
            stage.wait(2.0)
        pointer.at(0.0, 0.0, active=False)
        stage.wait(0.3)
        pointer.close()
    moving = _in_a_turn(stage)
    if moving is not None:
        stage.silence('IMU silent', 'imu_silent', moving)


PARTS = {'turns': turns, 'mouse': mouse, 'both': both, 'shutdown': shutdown, 'lost': lost}
