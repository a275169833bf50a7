"""The scripts of a checkoff: each part of a lab with a node that a person has started and types to.

The scripts are like those of the marking, with two differences: a turn begins at any heading, and
the person presses Ctrl+C. Headings are those of the IMU in [deg], 0 to 360.
"""
import math
import time
from typing import Iterable, Mapping, NamedTuple, Optional, Sequence, Set

import rospy
from sensor_msgs.msg import Imu

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.marking import gamepad as asked_gamepad
from tb3_labs.marking import imu as asked_imu
from tb3_labs.marking import move2goal as asked_move2goal
from tb3_labs.marking import ros_gamepad, ros_move2goal, ros_turn
from tb3_labs.marking import turn as asked_turn
from tb3_labs.marking.criteria import CTRL_C, SIGNAL, STOPPING, TOOK, TRACEBACK
from tb3_labs.marking.marks import GAMEPAD, IMU, MOVE2GOAL, TURN
from tb3_labs.marking.observation import CTRL_RELINQ
from tb3_labs.marking.observation import IMU as IMU_TOPIC
from tb3_labs.marking.observation import JOY, MOUSE_INFO, MOVED, WAS_MOVING, Stimulus
from tb3_labs.marking.ros_running_node import NO, YES
from tb3_labs.marking.ros_stage import PATIENCE, UNDER_WAY
from tb3_labs.marking.turn import LEFT, RIGHT
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_imu_sample

#: A turn across the jump of the heading ends at least this far beyond the jump [deg].
MARGIN = 20.0
#: The turns of the IMU lab, for each quadrant where they begin; turns across a jump need MARGIN.
BY_QUADRANT: Sequence[Mapping[str, str]] = (
    {LEFT: LEFT, RIGHT: 'r across 0'}, {LEFT: 'l across 180', RIGHT: RIGHT},
    {LEFT: LEFT, RIGHT: 'r across 180'}, {RIGHT: RIGHT})
#: A person types at most MOST_TURNS turns. After WITH_MARGIN of them MARGIN is no longer kept.
MOST_TURNS, WITH_MARGIN = 20, 5
#: A person types something, and the node answers, within this time together [s].
ANSWER = 4.0
#: A node ended in motion if it commanded a movement within this time before its end [s].
IN_MOTION = 0.5
#: The stick is held at this value, so that the robot turns slowly until Ctrl+C.
SLOWLY = 0.3
#: At the end the sticks rest in their middle, or the control stays taken, for this time [s].
RELEASE = 0.4


# ----- the order of the turns -----

class Next(NamedTuple):
    """The next turn to ask for: the letter to type, and the name of its stimulus.

    The name is '' if the turn only leads to the heading where another turn begins.
    """

    typed: str
    name: str


def next_turn(heading_deg: float, left: Iterable[str], margin: float = MARGIN,
              last: Optional[Next] = None) -> Optional[Next]:
    """Returns the next of the turns `left` (names of stimuli); None if there are none left.

    If none of them begins at this heading, it is a turn towards a heading where one begins.
    `last`: the turn before. If that one was only towards a heading, it is repeated, so that a
    robot that turns inexactly does not go to and fro.
    """
    wanted = set(left)
    if not wanted:
        return None
    begins = _begins(heading_deg, wanted, margin)
    if begins is not None:
        return begins
    if last is not None and not last.name:
        return last
    leads_right = _begins(heading_deg + 90.0, wanted, margin) is None and (
        _begins(heading_deg - 90.0, wanted, margin) is not None)
    return Next(RIGHT if leads_right else LEFT, '')


def _begins(heading_deg: float, wanted: Set[str], margin: float) -> Optional[Next]:
    """A wanted turn that begins at this heading; None if there is none."""
    quadrant, beyond = divmod(heading_deg % 360.0, 90.0)
    for typed, room in ((RIGHT, 90.0 - beyond), (LEFT, beyond)):
        name = BY_QUADRANT[int(quadrant) % 4].get(typed)
        if name in wanted and (name == typed or room >= margin):
            return Next(typed, name)
    return None


# ----- Ctrl+C by the person -----

def person_ends(stage, task, goodbye='', set_in_motion=None):
    """Have the person end the node by Ctrl+C.

    `task`: the words to the person; `goodbye`: the last line of the node; ``set_in_motion()`` is
    called before Ctrl+C. If the robot did not move then, the node is ended again. None: the robot
    need not move.
    """
    for name in CTRL_C:
        if not _ended(stage, name, task, goodbye, set_in_motion):
            return
        if set_in_motion is None or stage.observation.stimuli[-1].facts[WAS_MOVING]:
            return
        stage.node.person.tell('  The robot was not moving when the node ended.')


def _ended(stage, name, task, goodbye, set_in_motion):
    """Record the stimulus of a Ctrl+C. Returns False if the person does not press Ctrl+C.

    The moment of Ctrl+C is concluded from the node's last command, or from its end.
    """
    node, recorder = stage.node, stage.recorder
    answer = NO
    while answer == NO:
        if not node.start():    # it may have ended while the person answered
            return False
        if set_in_motion is not None:
            set_in_motion()
        asked, (characters, lines) = recorder.now, node.printed
        node.person.have(task)
        answer = YES if wait_until(lambda: not node.alive, PATIENCE) else node.person.asks(
            'The node still runs. Did you press Ctrl+C?')
    if answer != YES:
        return False
    ended = not node.alive
    time.sleep(UNDER_WAY)
    gone = node.runs[-1].end if ended else recorder.now
    moving = [at for at, linear, angular in recorder.commands_since(asked) if linear or angular]
    in_motion = bool(moving) and gone - moving[-1] < IN_MOTION
    begin = moving[-1] if in_motion else max(asked, gone - STOPPING)
    _ask_for_the_end(node, characters, goodbye if name == CTRL_C[0] else '', ended)
    stage.observation.stimuli.append(Stimulus(
        name, begin, recorder.now, node.text_since(characters), node.printed[1] - lines, ended,
        {WAS_MOVING: in_motion, TOOK: gone - begin if ended else None, SIGNAL: 0}))
    node.runs[-1].ended_by_itself = False
    stage.keep()
    return True


def _ask_for_the_end(node, characters, goodbye, ended):
    if goodbye and goodbye not in node.text_since(characters) and node.person.asks(
            'Did it print "{}"?'.format(goodbye)) == YES:
        node.attest(goodbye)
    if ended and node.person.asks('Did it end without a traceback in its terminal?') == NO:
        node.attest(TRACEBACK)


# ----- the scripts that differ from those of the marking -----

def imu_heading_deg():
    """Returns the IMU's heading, 0 to 360 [deg]. ``rospy.ROSException`` if the IMU is silent."""
    sample = to_imu_sample(rospy.wait_for_message(IMU_TOPIC, Imu, timeout=5.0))
    return math.degrees(sample.yaw) % 360.0


def turns(stage):
    """All turns, in the order of next_turn(); then an invalid input."""
    left, in_vain, step = set(asked_turn.EACH_TURN), 0, None
    for number in range(MOST_TURNS):
        if not stage.node.start():
            return
        step = next_turn(imu_heading_deg(), left, MARGIN if number < WITH_MARGIN else 0.0, step)
        if step is None or in_vain == 2:
            break
        left.discard(step.name)
        if step.name:
            ros_turn.try_turn(stage, step.name, step.typed)
            moved = stage.observation.stimuli[-1].facts[MOVED]
        else:
            stage.node.person.tell('  (This one leads to where the heading jumps.)')
            moved, _ = ros_turn.turn_once(stage, step.typed)
        in_vain = 0 if moved else in_vain + 1
    if not stage.node.start():
        return
    with stage.stimulus(asked_turn.NONSENSE):
        characters, _ = stage.node.printed
        stage.node.type(asked_turn.TYPED_NONSENSE)
        answered = wait_until(lambda: asked_turn.names_valid_inputs(
            stage.node.text_since(characters)), ANSWER)
        if not answered and stage.node.person.asks(
                'Did it answer by an error that names both valid inputs?') == YES:
            stage.node.attest('l, r')


def turn_shutdown(stage):
    """Ctrl+C in a turn."""
    person_ends(stage, 'In the terminal of your node: type l, then Enter, and press Ctrl+C at '
                'once, while it turns.', asked_turn.GOODBYE, lambda: None)


def heading(stage):
    """The marker turns the robot, and the node prints the heading; then Ctrl+C."""
    if not stage.node.start():
        return
    person = stage.node.person
    person.tell('  The robot turns on the spot now: keep clear of it.')
    for name, degrees in asked_imu.STANDS.items():
        stage.robot.face(stage.recorder.heading_deg
                         + difference_degrees(degrees, imu_heading_deg()))
        with stage.stimulus(name, {asked_imu.HEADING_DEG: imu_heading_deg()}):
            characters, _ = stage.node.printed
            if not wait_until(lambda: asked_imu.headings(stage.node.text_since(characters)), 1.0):
                said = person.number('Which heading does your node print now?')
                if said:
                    stage.node.attest('Current heading is {} degrees'.format(said))
    person_ends(stage, 'Press Ctrl+C in the terminal of your node.', asked_imu.GOODBYE)


def drive(stage):
    """The node's frame is reset at the robot's pose, if the node can; then as in the marking."""
    ros_move2goal.Control(stage)
    if not stage.node.start():
        return
    if ros_move2goal.reset_to_origin(stage.node):
        stage.node.person.tell('  The frame was reset here. The robot drives about a metre now: '
                               'keep clear of it.')
    ros_move2goal.drive(stage)


def control(stage):
    """Control is taken in a drive; the person presses Ctrl+C in another drive."""
    ros_move2goal.control_taken(stage, lambda set_in_motion: person_ends(
        stage, 'Press Ctrl+C in the terminal of your node, while the robot drives.',
        set_in_motion=set_in_motion))


def buttons(stage):
    """All is as in the marking, but Ctrl+C comes while the robot turns on the spot."""
    ros_gamepad.buttons(stage, lambda pad: person_ends(
        stage, 'Press Ctrl+C in the terminal of your node, while the robot turns.',
        set_in_motion=lambda: pad.push(left=SLOWLY)))


# ----- letting go -----

def release_mouse(stage):
    """Make the mouse inactive."""
    mouse = ros_turn.mouse_of(stage, [])
    if mouse is not None:
        mouse.hold(None)


def release_pad(stage):
    """Let the sticks go to their middle."""
    with ros_gamepad.HeldPad(stage.pad):
        time.sleep(RELEASE)


def release_control(stage):
    """Take the control from the node."""
    ros_move2goal.Control(stage)
    time.sleep(RELEASE)


#: lab -> part -> its script, given a Stage
PARTS = {
    IMU: {asked_imu.HEADING: heading},
    TURN: {asked_turn.TURNS: turns, asked_turn.MOUSE: ros_turn.mouse,
           asked_turn.BOTH: ros_turn.both, asked_turn.SHUTDOWN: turn_shutdown},
    MOVE2GOAL: {asked_move2goal.DRIVE: drive, asked_move2goal.RESET: ros_move2goal.reset,
                asked_move2goal.CONTROL: control, asked_move2goal.DECLARED: ros_move2goal.declared},
    GAMEPAD: {asked_gamepad.STICKS: ros_gamepad.sticks, asked_gamepad.BUTTONS: buttons,
              asked_gamepad.NO_SERVICE: ros_gamepad.no_service,
              asked_gamepad.LOST: ros_gamepad.lost},
}
#: (lab, part) -> the topic that this program publishes there; no other program may.
PLAYED = {(TURN, asked_turn.MOUSE): MOUSE_INFO, (TURN, asked_turn.BOTH): MOUSE_INFO}
PLAYED.update({(lab, part): topic for lab, topic in ((MOVE2GOAL, CTRL_RELINQ), (GAMEPAD, JOY))
               for part in PARTS[lab]})
#: topic -> the function that lets go of it, given a Stage
RELEASES = {MOUSE_INFO: release_mouse, JOY: release_pad, CTRL_RELINQ: release_control}
