"""The IMU exercise: the heading in the terminal."""
import re
from typing import List

from tb3_labs.geometry.angle_arrays import difference_degrees
from tb3_labs.handout import IMU_GOODBYE, PRINTED_HEADING
from tb3_labs.marking.labs.criteria import (
    CTRL_C, IMU_EXTRAS, IN_TIME, Criterion, Reason, ends_cleanly, prints, starts)
from tb3_labs.marking.trial.observation import NotObserved, Observation
from tb3_labs.marking.trial.remarks import exceptions_in, why_unprinted
from tb3_labs.watch.chains import HEADING_EXERCISE

#: The parts of the exercise.
HEADING, ODD_SAMPLES = 'heading', 'odd samples'
#: stimulus -> heading at which the robot stands [deg]
STANDS = {f'at {heading:g} degrees': heading for heading in (50.0, 150.0, 220.0, 350.0)}
#: The node must print its line at each heading within this time [s].
READING = 1.5
#: The stimuli by samples that a real IMU sends seldom.
HAIR_BELOW_ZERO, ZERO_QUATERNION = 'a hair below zero', 'a quaternion of zeros'
#: After the quaternion of zeros the heading AFTERWARDS [deg] is sent for NEXT [s].
AFTERWARDS, NEXT = 57.0, 0.9
#: Key of a fact: the IMU's heading where the robot stands [deg].
HEADING_DEG = 'heading_deg'

#: A printed heading is right if its difference from the IMU's heading is at most this [deg].
HEADING_TOLERANCE = 1.0
#: The handout's code may print this many headings after its goodbye: a sample may come just before
#: the code sets its flag.
LATE_HEADINGS = 1

LISTENING, EXERCISE, IMU_AT_CTRL_C = (
    HEADING_EXERCISE.at_step(step) for step in (2, 3, 4))


def headings(text: str) -> List[float]:
    """Returns the headings in a node's output [deg]."""
    return [float(number) for number in re.findall(
        PRINTED_HEADING.format(r'(-?\d+(?:\.\d+)?)'), text)]


def _standing(observation):
    """Yields (the IMU's heading, the printed headings) [deg] of each stimulus; NotObserved if the
    node printed no heading at all."""
    scenes = [observation.scene(name) for name in STANDS]
    if not any(headings(scene.printed) for scene in scenes):
        before = len(headings(scenes[0].run.printed))
        raise NotObserved('no line "{}." was printed: {}'.format(
            PRINTED_HEADING.format('...'),
            'it printed {} at its start, and then none'.format(before) if before else
            why_unprinted(scenes[-1])))
    for scene in map(observation.scene, STANDS):    # sets the moment of the verdict
        yield scene.facts[HEADING_DEG], headings(scene.printed)


def _prints_heading(observation: Observation) -> Reason:
    return next((f'nothing was printed while the robot stood at {heading:.0f} degrees'
                 for heading, printed in _standing(observation) if not printed), '')


def _first_wrong(observation, is_wrong, words):
    """Returns the `words` on the first heading for which `is_wrong(printed heading, IMU's heading)`
    [deg]; '' if there is none."""
    return next((words.format(number, heading) for heading, printed in _standing(observation)
                 for number in printed if is_wrong(number, heading)), '')


def _says_goodbye(observation: Observation) -> Reason:
    missed = prints(observation, IMU_GOODBYE)
    if missed:
        return missed
    printed = observation.scene(CTRL_C[0], may_die=True).printed
    late = len(headings(printed[printed.rfind(IMU_GOODBYE):]))
    return '' if late <= LATE_HEADINGS else \
        f'{late} headings were printed after "{IMU_GOODBYE}"'


def _never_360(observation: Observation) -> Reason:
    printed = headings(observation.scene(HAIR_BELOW_ZERO).printed)
    if not printed:
        return 'nothing was printed while the IMU was just below zero'
    if max(printed) >= 360.0:
        return f'printed {max(printed):.6f} degrees for an IMU just below zero'
    return ''


def _survives_nonsense(observation: Observation) -> Reason:
    scene = observation.scene(ZERO_QUATERNION)
    if exceptions_in(scene):
        return 'a quaternion of zeros gave a traceback'
    if not any(abs(number - AFTERWARDS) < HEADING_TOLERANCE for number in headings(scene.printed)):
        return 'after a quaternion of zeros the heading was not printed any more'
    return ''


CRITERIA = [
    Criterion('starts', HEADING, 'runs and listens to imu', LISTENING, starts, limits=IN_TIME),
    Criterion('prints_heading', HEADING, 'prints "{}."'.format(PRINTED_HEADING.format('...')),
              EXERCISE, _prints_heading, limits=f'within {READING:g} s at each heading'),
    Criterion('heading_right', HEADING, 'prints the heading of the IMU', EXERCISE,
              lambda observation: _first_wrong(
                  observation, lambda *pair: abs(difference_degrees(*pair)) > HEADING_TOLERANCE,
                  'printed {:.1f} degrees while the IMU said {:.1f}'),
              limits=f'within {HEADING_TOLERANCE:g} degree'),
    Criterion('from_0_to_360', HEADING, 'counts the heading from 0 to 360 degrees', EXERCISE,
              lambda observation: _first_wrong(observation,
                                               lambda number, _: not 0.0 <= number < 360.0,
                                               'printed {:.1f} degrees while the robot stood at '
                                               '{:.0f}')),
    Criterion('says_goodbye', HEADING, f'at Ctrl+C says "{IMU_GOODBYE}", then nothing',
              IMU_AT_CTRL_C, _says_goodbye,
              limits=f'{LATE_HEADINGS} more heading may follow'),
    ends_cleanly(HEADING, IMU_AT_CTRL_C),
    Criterion('never_360', ODD_SAMPLES, 'never prints 360.000000', IMU_EXTRAS, _never_360,
              extra=True),
    Criterion('survives_nonsense', ODD_SAMPLES, 'goes on after a quaternion of zeros', IMU_EXTRAS,
              _survives_nonsense, extra=True, limits=f'within {NEXT:g} s'),
]
