"""What is done at the bench for each part of a lab, and how it is let go of afterwards.

Where it can be, it is the script of the marking itself. A turn that the marking begins at a heading
of its own choice is begun here wherever the robot stands.
"""
import rospy
from std_msgs.msg import Bool

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking import gamepad as asked_gamepad
from tb3_labs.marking import imu as asked_imu
from tb3_labs.marking import move2goal as asked_move2goal
from tb3_labs.marking import turn as asked_turn
from tb3_labs.marking.bench import MARGIN, next_turn
from tb3_labs.marking.labs import GAMEPAD, IMU, MOVE2GOAL, TURN
from tb3_labs.marking.observation import MOVED
from tb3_labs.marking.topics import CTRL_RELINQ, JOY, MOUSE_INFO
from tb3_labs.marking.turning import NONSENSE, TURN_TIME, TYPED_NONSENSE, names_valid_inputs
from tb3_labs.marking.turning import TURNS as EACH_TURN
from tb3_labs.ros.marking import gamepad, move2goal, turn
from tb3_labs.ros.marking.driver import Driver
from tb3_labs.ros.marking.gamepad import Pad
from tb3_labs.ros.marking.mouse import Mouse
from tb3_labs.ros.marking.waiting import wait, wait_until

#: A person turns no more often than this; after so many turns the margin is given up.
MOST_TURNS, WITH_MARGIN = 20, 5
#: A person has typed something, and the node has answered, within this time [s].
ANSWER = 4.0
#: What was held is let go of for this time [s].
RELEASE = 0.4


def turns(stage):
    """The turns, by the shortest way through all headings where they jump; nonsense."""
    left, in_vain, step = set(EACH_TURN), 0, None
    for number in range(MOST_TURNS):
        if not stage.node.start():
            return
        step = next_turn(stage.heading_deg(), left,
                         MARGIN if number < WITH_MARGIN else 0.0, step)
        if step is None or in_vain == 2:
            break
        left.discard(step.name)
        if not step.name:
            stage.person.tell('  (This one leads to where the heading jumps.)')
        moved = _turn(stage, step)
        in_vain = 0 if moved else in_vain + 1
    if stage.node.start():
        _nonsense(stage)


def _turn(stage, step):
    """One turn, recorded or not; did the robot move?"""
    if step.name:
        turn.try_turn(stage, step.name, step.typed)
        return stage.observation.stimuli[-1].facts[MOVED]
    moved = stage.moves_after(lambda: stage.node.type(step.typed), turn.REACTION)
    wait_until(lambda: not stage.node.alive or stage.recorder.rests(turn.QUIET),
               TURN_TIME if moved else 0.0)
    return moved


def _nonsense(stage):
    with stage.stimulus(NONSENSE):
        characters, _ = stage.node.printed
        stage.node.type(TYPED_NONSENSE)
        if not wait_until(lambda: names_valid_inputs(stage.node.text_since(characters)), ANSWER):
            if stage.person.confirms('Did it answer by an error that names both valid inputs?'):
                stage.node.attest('l, r')


def turn_shutdown(stage):
    """Ctrl+C by the person, in a turn."""
    stage.ended_in_motion('In the terminal of your node: type l, then Enter, and press Ctrl+C at '
                          'once, while it turns.', lambda: None, asked_turn.GOODBYE)


def heading(stage):
    """The robot is turned, the node only says where it looks; Ctrl+C."""
    if not stage.node.start():
        return
    stage.person.tell('  The robot turns on the spot now: keep clear of it.')
    for name, degrees in asked_imu.STANDS.items():
        stage.robot.face(stage.recorder.heading_deg
                         + difference_degrees(degrees, stage.heading_deg()))
        with stage.stimulus(name, {asked_imu.HEADING_DEG: stage.heading_deg()}):
            characters, _ = stage.node.printed
            if not wait_until(lambda: asked_imu.headings(stage.node.text_since(characters)), 1.0):
                said = stage.person.number('Which heading does your node print now?')
                if said:
                    stage.node.attest('Current heading is {} degrees'.format(said))
    stage.ended(asked_imu.GOODBYE)


def drive(stage):
    """The frame is reset where the robot stands, if the node can; then as in the marking."""
    driver = Driver(stage)
    if not stage.node.start():
        return
    caller = driver.resets()
    if caller.found:
        caller.call(Pose2())
        stage.person.tell('  The frame was reset here. The robot drives about a metre now: keep '
                          'clear of it.')
    move2goal.drive(stage)


def control(stage):
    """Control is taken in a drive; Ctrl+C by the person in another."""
    move2goal.control(stage)
    driver = Driver(stage)
    stage.ended_in_motion('Press Ctrl+C in the terminal of your node, while the robot drives.',
                          driver.start_driving)


def buttons(stage):
    """As in the marking; then Ctrl+C by the person, while the robot turns on the spot."""
    gamepad.buttons(stage)
    if stage.node.start():
        with Pad() as pad:
            stage.ended_in_motion('Press Ctrl+C in the terminal of your node, while the robot '
                                  'turns.', lambda: pad.sticks(0.0, 0.3))


def release_mouse(stage):
    """Nothing holds the mouse any more."""
    try:
        mouse = Mouse(stage.node.graph)
    except AttributeError:
        return
    with mouse:
        mouse.at(0.0, 0.0, active=False)
        mouse.wait_until_heard()


def release_pad(stage):
    """The sticks are in their middle."""
    with Pad():
        wait(RELEASE)


def release_control(stage):
    """The node has no control."""
    publisher = rospy.Publisher(CTRL_RELINQ, Bool, queue_size=1, latch=True)
    publisher.publish(False)
    wait(RELEASE)


#: lab -> part -> what is done, given a BenchStage
PARTS = {
    IMU: {asked_imu.HEADING: heading},
    TURN: {asked_turn.TURNS: turns, asked_turn.MOUSE: turn.mouse, asked_turn.BOTH: turn.both,
           asked_turn.SHUTDOWN: turn_shutdown},
    MOVE2GOAL: {asked_move2goal.DRIVE: drive, asked_move2goal.RESET: move2goal.reset,
                asked_move2goal.CONTROL: control, asked_move2goal.DECLARED: move2goal.declared},
    GAMEPAD: {asked_gamepad.STICKS: gamepad.sticks, asked_gamepad.BUTTONS: buttons,
              asked_gamepad.NO_SERVICE: gamepad.no_service,
              asked_gamepad.LOST: gamepad.lost},
}
#: (lab, part) -> what this program plays there, and nobody else may: a topic.
PLAYED = {(TURN, asked_turn.MOUSE): MOUSE_INFO, (TURN, asked_turn.BOTH): MOUSE_INFO}
PLAYED.update({(lab, part): topic for lab, topic in ((MOVE2GOAL, CTRL_RELINQ), (GAMEPAD, JOY))
               for part in PARTS[lab]})
#: topic -> how it is let go of, given a BenchStage
RELEASES = {MOUSE_INFO: release_mouse, JOY: release_pad, CTRL_RELINQ: release_control}
