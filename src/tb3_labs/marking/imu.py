"""The IMU exercise: the heading in the terminal."""
import re

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.marking.criteria import Criterion, Place
from tb3_labs.marking.observation import NotSeen
from tb3_labs.marking.life import TRACEBACK, clean_exit, says, starts

LINE = re.compile(r'Current heading is (-?\d+(?:\.\d+)?) degrees')
GOODBYE = 'Shutting down the IMU subscriber'
#: Where the robot stands meanwhile; each is a stimulus.
STANDS = ('at 50 degrees', 'at 150 degrees', 'at 220 degrees', 'at 350 degrees')
#: A printed heading is right when it is this near [deg].
TOLERANCE = 1.0
#: The heading that is sent after a quaternion of zeros [deg].
AFTERWARDS = 57.0

EXERCISE = Place('imu_lab.md', 'Exercise: the heading', 1)
QUATERNION = Place('imu_lab.md', 'Exercise: the heading', 2)
CTRL_C = Place('imu_lab.md', 'Exercise: the heading', 4)


def headings(text):
    """The headings that were printed [deg]."""
    return [float(number) for number in LINE.findall(text)]


def _standing(seen):
    """[(heading [deg], headings that were printed there)]; NotSeen where none ever were."""
    scenes = [seen.during(name) for name in STANDS]
    stands = [(scene.facts['heading_deg'], headings(scene.printed)) for scene in scenes]
    if not any(printed for _, printed in stands):
        raise NotSeen('no line "Current heading is ... degrees." was printed')
    return stands


def prints_heading(seen):
    """Is the line printed, wherever the robot stands?"""
    for heading, printed in _standing(seen):
        if not printed:
            return 'nothing was printed while the robot stood at {:.0f} degrees'.format(heading)
    return ''


def heading_right(seen):
    """Is the heading that of the IMU, in whatever way it is counted?"""
    for heading, printed in _standing(seen):
        for number in printed:
            if abs(difference_degrees(number, heading)) > TOLERANCE:
                return 'printed {:.1f} degrees while the IMU said {:.1f}'.format(number, heading)
    return ''


def from_0_to_360(seen):
    """Is it counted from 0 to 360?"""
    for heading, printed in _standing(seen):
        for number in printed:
            if not 0.0 <= number < 360.0:
                return 'printed {:.1f} degrees while the robot stood at {:.0f}'.format(
                    number, heading)
    return ''


def says_goodbye(seen):
    """Does it say that it ends, and nothing after that?"""
    missed = says(seen, GOODBYE)
    if missed:
        return missed
    printed = seen.during('Ctrl+C', may_die=True).printed
    if headings(printed[printed.rfind(GOODBYE):]):
        return 'headings were printed after "{}"'.format(GOODBYE)
    return ''


def never_360(seen):
    """Is 360.000000 never shown, also a hair below zero?"""
    printed = headings(seen.during('a hair below zero').printed)
    if not printed:
        return 'nothing was printed a hair below zero'
    if max(printed) >= 360.0:
        return 'printed {:.6f} degrees for an IMU a hair below zero'.format(max(printed))
    return ''


def survives_nonsense(seen):
    """Does it go on after a quaternion that is none?"""
    scene = seen.during('a quaternion of zeros')
    if TRACEBACK.search(scene.printed):
        return 'a quaternion of zeros gave a traceback'
    if not any(abs(number - AFTERWARDS) < TOLERANCE for number in headings(scene.printed)):
        return 'after a quaternion of zeros the heading was not printed any more'
    return ''


CRITERIA = [
    Criterion('starts', 'heading', 'runs and listens to imu', EXERCISE, starts),
    Criterion('prints_heading', 'heading', 'prints "Current heading is ... degrees."', EXERCISE,
              prints_heading),
    Criterion('heading_right', 'heading', "the heading is the IMU's, within 1 degree", QUATERNION,
              heading_right),
    Criterion('from_0_to_360', 'heading', 'counts from 0 to 360 degrees', EXERCISE,
              from_0_to_360),
    Criterion('says_goodbye', 'heading', 'Ctrl+C: says that it shuts down, then nothing', CTRL_C,
              says_goodbye),
    Criterion('clean_exit', 'heading', 'Ctrl+C: ends by itself, without a traceback', CTRL_C,
              clean_exit),
    Criterion('never_360', 'odd samples', 'never shows 360.000000', EXERCISE, never_360,
              extra=True),
    Criterion('survives_nonsense', 'odd samples', 'goes on after a quaternion of zeros',
              QUATERNION, survives_nonsense, extra=True),
]
