"""The IMU lab: turns by keyboard, beside the mouse. All that it asks for."""
from tb3_labs.marking import mouse, turning
from tb3_labs.marking.criteria import Criterion, Place
from tb3_labs.marking.life import clean_exit, says, starts, stops_robot
from tb3_labs.marking.observation import Observation
from tb3_labs.marking.sheets import EXERCISE, IMU_SHEET, TURN_LAB
from tb3_labs.marking.stopping import stops_when_silent

#: The parts of the lab.
TURNS, MOUSE, BOTH, SHUTDOWN, LOST = 'turns', 'mouse', 'both', 'shutdown', 'lost'
#: The stimulus of an IMU that sends no more, in a turn.
IMU_SILENT = 'IMU silent'
GOODBYE = 'Controller exiting. Halting robot.'

START, AT_MOUSE, LAW, AT_CTRL_C = (Place(IMU_SHEET, TURN_LAB, step) for step in (1, 3, 4, 5))


def says_goodbye(seen: Observation) -> str:
    """Does it say that it halts the robot?"""
    return says(seen, GOODBYE)


def lost_imu(seen: Observation) -> str:
    """Does a silent IMU stop a turn?"""
    return stops_when_silent(seen, IMU_SILENT, 'the IMU')


CRITERIA = [
    Criterion('starts', TURNS, 'runs and listens to imu', START, starts),
    Criterion('left', TURNS, 'l turns 90 degrees left, within 10', LAW, turning.left),
    Criterion('right', TURNS, 'r turns 90 degrees right, within 10', LAW, turning.right),
    Criterion('short_way', TURNS, 'turns the same across 180 and 0 degrees, where it jumps',
              EXERCISE, turning.short_way),
    Criterion('clamped', TURNS, 'turns no faster than 1.5 rad/s', LAW, turning.clamped),
    Criterion('on_the_spot', TURNS, 'does not drive forward while it turns', LAW,
              turning.on_the_spot),
    Criterion('answers_nonsense', TURNS, 'answers any other input by an error that names the valid '
              'ones', START, turning.answers_nonsense),
    Criterion('mouse_drives', MOUSE, 'mouse up drives forward, left turns left, 0.5 at the edge',
              AT_MOUSE, mouse.drives),
    Criterion('mouse_dead_zone', MOUSE, 'a mouse within 0.25 of the middle moves nothing',
              AT_MOUSE, mouse.dead_zone),
    Criterion('mouse_off', MOUSE, 'the robot stops at once when the mouse is deactivated',
              AT_MOUSE, mouse.off),
    Criterion('turn_beside_mouse', BOTH, 'turns also while the mouse is active in the middle',
              AT_MOUSE, mouse.turn_beside),
    Criterion('mouse_after_turn', BOTH, 'the mouse drives after a turn', AT_MOUSE,
              mouse.after_turn),
    Criterion('mouse_in_turn', BOTH, 'a mouse moved during a turn drives then or after it',
              AT_MOUSE, mouse.in_turn),
    Criterion('stops_robot', SHUTDOWN, 'at Ctrl+C in a turn sends zero velocity', AT_CTRL_C,
              stops_robot),
    Criterion('says_goodbye', SHUTDOWN, 'at Ctrl+C says "{}"'.format(GOODBYE), AT_CTRL_C,
              says_goodbye),
    Criterion('clean_exit', SHUTDOWN, 'at Ctrl+C ends by itself, without a traceback', AT_CTRL_C,
              clean_exit),
    Criterion('within_1_deg', TURNS, 'all turns are within 1 degree', LAW, turning.within_1_deg,
              extra=True),
    Criterion('lost_imu', LOST, 'stops a turn within 1 s after the IMU fell silent', AT_CTRL_C,
              lost_imu, extra=True),
    Criterion('lost_mouse', LOST, 'stops the robot within 1 s after the mouse fell silent',
              AT_MOUSE, mouse.lost, extra=True),
]
