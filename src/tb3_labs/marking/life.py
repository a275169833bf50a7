"""What every node should do: start, and end at Ctrl+C."""
import re

#: A node that is still there so long after Ctrl+C hangs [s]; rospy itself takes up to two.
ENDING = 5.0
#: A zero velocity must have been sent by then [s].
STOPPING = 0.5
#: What rospy publishes on the way out may be lost: one that was not seen gets another chance.
CTRL_C = ('Ctrl+C', 'Ctrl+C again', 'Ctrl+C a third time')
TRACEBACK = re.compile(r'^Traceback \(most recent call last\)', re.MULTILINE)
#: What rospy itself throws into a callback that publishes in the moment of the end.
NOT_THEIRS = 'publish() to a closed topic'


def starts(seen):
    """Does it run, and listen to the robot?"""
    return seen.why_missing() if not seen.runs or seen.runs[0].ready is None else ''


def clean_exit(seen):
    """Does it end by itself, without a traceback?"""
    scene = seen.during('Ctrl+C', may_die=True)
    if scene.facts['took'] is None:
        return 'it was still running {:g} s after Ctrl+C and had to be killed'.format(ENDING)
    if TRACEBACK.search(scene.printed):
        errors = [line for line in scene.printed.splitlines()
                  if re.match(r'\w[\w.]*(Error|Exception|Interrupt|Exit)\b', line)
                  and NOT_THEIRS not in line]
        if not errors and NOT_THEIRS in scene.printed:
            return ''
        return 'it ended with a traceback{}'.format(
            ': ' + repr(errors[-1][:120]) if errors else '')
    if scene.facts['signal'] not in (0, 2, 15):
        return 'it was ended by signal {}'.format(scene.facts['signal'])
    return ''


def stops_robot(seen):
    """Does it send a zero velocity, in one of several tries?"""
    scenes = [seen.during(name, may_die=True) for name in CTRL_C if seen.has(name)] or [
        seen.during(CTRL_C[0])]
    if not any(scene.facts['was_moving'] for scene in scenes):
        return 'it did not move the robot before, so that nothing could be stopped'
    for scene in scenes:
        soon = scene.commands[scene.commands[:, 0] <= scene.begin + STOPPING]
        if scene.facts['was_moving'] and (soon[:, 1:] == 0.0).all(axis=1).any():
            return ''
    return 'at Ctrl+C in the middle of a movement it sent no zero velocity: the robot went on'


def says(seen, words):
    """Is this printed at Ctrl+C?"""
    scene = seen.during('Ctrl+C', may_die=True)
    return '' if words in scene.printed else '"{}" was not printed at Ctrl+C'.format(words)
