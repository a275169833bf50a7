"""The IMU lab: turns by keyboard, beside the mouse. All that it asks for."""
from tb3_labs.marking import mouse, turning
from tb3_labs.marking.criteria import Criterion, Place
from tb3_labs.marking.life import (CLEAN_EXIT, CLEAN_EXIT_LIMITS, IN_TIME, STOPS_IN_TIME, clean_exit,
                                   says, starts, stops_robot)
from tb3_labs.marking.observation import Observation
from tb3_labs.marking.sheets import EXERCISE, IMU_SHEET, TURN_LAB
from tb3_labs.marking.steering import ROUNDING
from tb3_labs.marking.stopping import STOPS_AT_ONCE, STOPS_WHEN_LOST, stops_when_silent

#: The parts of the lab.
TURNS, MOUSE, BOTH, SHUTDOWN, LOST = 'turns', 'mouse', 'both', 'shutdown', 'lost'
#: The stimulus of an IMU that sends no more, in a turn.
IMU_SILENT = 'IMU silent'
GOODBYE = 'Controller exiting. Halting robot.'

START, AT_MOUSE, LAW, AT_CTRL_C = (Place(IMU_SHEET, TURN_LAB, step) for step in (2, 3, 4, 5))


def says_goodbye(seen: Observation) -> str:
    """Does it say that it halts the robot?"""
    return says(seen, GOODBYE)


def lost_imu(seen: Observation) -> str:
    """Does a silent IMU stop a turn?"""
    return stops_when_silent(seen, IMU_SILENT, 'the IMU')


CRITERIA = [
    Criterion('starts', TURNS, 'runs and listens to imu', START, starts, limits=IN_TIME),
    Criterion('left', TURNS, 'l turns 90 degrees left', LAW, turning.left, limits=turning.LIMITS),
    Criterion('right', TURNS, 'r turns 90 degrees right', LAW, turning.right,
              limits=turning.LIMITS),
    Criterion('short_way', TURNS, 'turns the same across 180 and 0 degrees, where it jumps',
              EXERCISE, turning.short_way, limits=turning.LIMITS),
    Criterion('clamped', TURNS, 'turns no faster than {:g} rad/s'.format(turning.MAX_ANG_Z), LAW,
              turning.clamped, limits='and {:g} for rounding'.format(ROUNDING)),
    Criterion('on_the_spot', TURNS, 'does not drive forward while it turns', LAW,
              turning.on_the_spot, limits='less than {:g} m/s'.format(ROUNDING)),
    Criterion('answers_nonsense', TURNS, 'answers any other input by an error that names the valid '
              'ones', LAW, turning.answers_nonsense, limits='l and r, or left and right, within '
              '{:g} s, in at most {} lines; the robot rests'.format(
                  turning.ANSWER, turning.LEGIBLE)),
    Criterion('mouse_drives', MOUSE, 'mouse up drives forward, left turns left, {:g} at the '
              'edge'.format(mouse.FULL), AT_MOUSE, mouse.drives, limits=mouse.DRIVES),
    Criterion('mouse_dead_zone', MOUSE, 'a mouse within {:g} of the middle moves nothing'.format(
        mouse.DEAD_ZONE), AT_MOUSE, mouse.dead_zone, limits=mouse.IN_DEAD_ZONE),
    Criterion('mouse_off', MOUSE, 'the robot stops at once when the mouse is deactivated',
              AT_MOUSE, mouse.off, limits=STOPS_AT_ONCE),
    Criterion('turn_beside_mouse', BOTH, 'turns also while the mouse is active in the middle',
              AT_MOUSE, mouse.turn_beside, limits='as left'),
    Criterion('mouse_after_turn', BOTH, 'the mouse drives after a turn', AT_MOUSE,
              mouse.after_turn, limits=mouse.DRIVES_AFTER_TURN),
    Criterion('mouse_in_turn', BOTH, 'a mouse moved during a turn drives then or after it',
              AT_MOUSE, mouse.in_turn, limits='within {:g} s'.format(mouse.AT_LAST)),
    Criterion('stops_robot', SHUTDOWN, 'at Ctrl+C in a turn sends zero velocity', AT_CTRL_C,
              stops_robot, limits=STOPS_IN_TIME),
    Criterion('says_goodbye', SHUTDOWN, 'at Ctrl+C says "{}"'.format(GOODBYE), AT_CTRL_C,
              says_goodbye),
    Criterion('clean_exit', SHUTDOWN, CLEAN_EXIT, AT_CTRL_C, clean_exit,
              limits=CLEAN_EXIT_LIMITS),
    Criterion('within_1_deg', TURNS, 'all turns are within {:g} degree'.format(turning.EXACT), LAW,
              turning.within_1_deg, extra=True),
    Criterion('lost_imu', LOST, 'stops a turn after the IMU fell silent', AT_CTRL_C, lost_imu,
              extra=True, limits=STOPS_WHEN_LOST),
    Criterion('lost_mouse', LOST, 'stops the robot after the mouse fell silent', AT_MOUSE,
              mouse.lost, extra=True, limits=STOPS_WHEN_LOST),
]
