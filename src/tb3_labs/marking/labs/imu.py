"""The criteria of the IMU exercise, in which a node prints the IMU's heading."""
import re
from typing import List

from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.handout import IMU_GOODBYE, PRINTED_HEADING
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.criteria import (
    IMU_EXTRAS, START_LIMITS, Criterion, Reason, clean_exit_criterion, judge_line_at_ctrl_c,
    judge_start, within)
from tb3_labs.marking.trial.observation import CTRL_C, NotObserved, Observation
from tb3_labs.marking.trial.remarks import exceptions_in, why_unprinted
from tb3_labs.watch.lab_mistakes import HEADING_SECTION

HEADING_TOLERANCE_DEG = 1.0
#: A node may print this many headings after IMU_GOODBYE. In the handout's code, a callback that
#: runs at the time of Ctrl+C prints one more heading.
MAX_LATE_HEADINGS = 1

EXERCISE_STEP = HEADING_SECTION.at_step(3)
CTRL_C_STEP = HEADING_SECTION.at_step(4)


def headings_in_text(text: str) -> List[float]:
    """Returns the headings [deg] in a node's output."""
    pattern = PRINTED_HEADING.format(r'(-?\d+(?:\.\d+)?)')
    return [float(number) for number in re.findall(pattern, text)]


def _headings_at_rest(observation):
    """Yields (the IMU's heading [deg], list of the printed headings [deg]) for each stimulus in
    which the robot stood. Raises ``NotObserved`` if the node printed no heading in all stimuli."""
    scenes = [observation.enter_scene(name) for name in stimuli.STANDING_HEADINGS]
    if not any(headings_in_text(scene.printed) for scene in scenes):
        early_count = len(headings_in_text(scenes[0].process.printed))
        reason = (f'it printed {early_count} at its start, and then none' if early_count
                  else why_unprinted(scenes[-1]))
        raise NotObserved(f'no line "{PRINTED_HEADING.format("...")}." was printed: {reason}')
    for name in stimuli.STANDING_HEADINGS:
        scene = observation.enter_scene(name)     # sets observation.moment
        yield scene.facts[stimuli.HEADING_DEG], headings_in_text(scene.printed)


def _judge_print(observation: Observation) -> Reason:
    for expected, headings in _headings_at_rest(observation):
        if not headings:
            return f'nothing was printed while the robot stood at {expected:.0f} degrees'
    return ''


def _judge_heading(observation: Observation) -> Reason:
    for expected, headings in _headings_at_rest(observation):
        for heading in headings:
            if abs(wrap_all(heading - expected, 360.0)) > HEADING_TOLERANCE_DEG:
                return f'printed {heading:.1f} degrees while the IMU said {expected:.1f}'
    return ''


def _judge_range(observation: Observation) -> Reason:
    for expected, headings in _headings_at_rest(observation):
        for heading in headings:
            if not 0.0 <= heading < 360.0:
                return f'printed {heading:.1f} degrees while the robot stood at {expected:.0f}'
    return ''


def _judge_goodbye(observation: Observation) -> Reason:
    reason = judge_line_at_ctrl_c(observation, IMU_GOODBYE)
    if reason:
        return reason
    printed = observation.enter_scene(CTRL_C[0], may_die=True).printed
    _, _, printed_later = printed.rpartition(IMU_GOODBYE)
    late_count = len(headings_in_text(printed_later))
    if late_count <= MAX_LATE_HEADINGS:
        return ''
    return f'{late_count} headings were printed after "{IMU_GOODBYE}"'


def _judge_rounding_to_360(observation: Observation) -> Reason:
    headings = headings_in_text(observation.enter_scene(stimuli.JUST_BELOW_ZERO).printed)
    if not headings:
        return 'nothing was printed while the IMU was just below zero'
    greatest = max(headings)
    return '' if greatest < 360.0 else f'printed {greatest:.6f} degrees for an IMU just below zero'


def _judge_survival(observation: Observation) -> Reason:
    scene = observation.enter_scene(stimuli.ZERO_QUATERNION)
    if exceptions_in(scene):
        return 'a quaternion of zeros gave a traceback'
    for heading in headings_in_text(scene.printed):
        if abs(heading - stimuli.VALID_HEADING_DEG) < HEADING_TOLERANCE_DEG:
            return ''
    return ('after a quaternion of zeros, and a valid one, the heading '
            f'{stimuli.VALID_HEADING_DEG:g} was not printed')


CRITERIA = [
    Criterion('starts', stimuli.HEADING, 'runs and listens to imu', HEADING_SECTION.at_step(2),
              judge_start, limits=START_LIMITS),
    Criterion('prints_heading', stimuli.HEADING, f'prints "{PRINTED_HEADING.format("...")}."',
              EXERCISE_STEP, _judge_print,
              limits=f'{within(stimuli.READING_TIME)} at each heading'),
    Criterion('heading_right', stimuli.HEADING, 'prints the heading of the IMU', EXERCISE_STEP,
              _judge_heading, limits=f'within {HEADING_TOLERANCE_DEG:g} degree'),
    Criterion('from_0_to_360', stimuli.HEADING, 'counts the heading from 0 to 360 degrees',
              EXERCISE_STEP, _judge_range),
    Criterion('says_goodbye', stimuli.HEADING, f'at Ctrl+C says "{IMU_GOODBYE}", then nothing',
              CTRL_C_STEP, _judge_goodbye, limits=f'{MAX_LATE_HEADINGS} more heading may follow'),
    clean_exit_criterion(stimuli.HEADING, CTRL_C_STEP),
    Criterion('never_360', stimuli.ODD_SAMPLES, 'never prints 360.000000', IMU_EXTRAS,
              _judge_rounding_to_360, is_extra=True),
    Criterion('survives_nonsense', stimuli.ODD_SAMPLES, 'goes on after a quaternion of zeros',
              IMU_EXTRAS, _judge_survival, is_extra=True,
              limits=within(stimuli.VALID_HEADING_TIME)),
]
