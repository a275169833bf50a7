"""Does a node stop the robot in time?"""
from tb3_labs.marking.observation import WAS_MOVING, Observation

#: The time within which a stop "at once" must happen [s].
AT_ONCE = 0.5
#: The time within which a node must stop the robot after a sensor or an input fell silent [s].
LOST = 1.0
#: Both in words.
STOPS_AT_ONCE, STOPS_WHEN_LOST = ('within {:g} s'.format(time) for time in (AT_ONCE, LOST))


def stops_when_silent(seen: Observation, name: str, what: str) -> str:
    """'' if the node stopped the robot after `what` fell silent, which is the stimulus `name`."""
    scene = seen.during(name)
    if not scene.facts[WAS_MOVING]:
        return 'the robot was not moving when {} fell silent'.format(what)
    if len(scene.moving_after(LOST)):
        return 'the robot was still driven more than {:g} s after {} had fallen silent'.format(
            LOST, what)
    return ''
