"""The chain of the IMU lab: heading -> curr_yaw -> goal_yaw -> turning -> command -> stop."""
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.watch.chain import Broken, Inside, belief, is_heading
from tb3_labs.watch.quantities import Quantity, followed
from tb3_labs.watch.variables import Series, number

#: The handout's constants: gain [rad/s for each degree], tolerance [deg], slowest and fastest turn
#: [rad/s], the angle of a letter [deg].
K_HDG, HDG_TOL, MIN_ANG_Z, MAX_ANG_Z, ASKED = 0.1, 10.0, 0.5, 1.5, 90.0
#: A letter is read within ANSWERED [s]. The variables are read every READ [s].
ANSWERED, READ = 3.0, 0.06
#: An angle is right within NEAR [deg]; an error is clear from CLEAR to 180 - CLEAR [deg].
NEAR, CLEAR = 3.0, 20.0
#: A longer pause between commands is a mistake [s].
PAUSE = 0.45


class Letter(NamedTuple):
    """A letter that was typed: its time, the time at which its turn ends [s], its side: 1 for l,
    -1 for r, 0 if it is not known."""

    begin: float
    end: float
    side: int

    @property
    def words(self) -> str:
        return {1: 'l', -1: 'r'}.get(self.side, 'a letter')


def letters(inside: Inside) -> List[Letter]:
    """The letters of a run: as they were typed, else as `turning` or `goal_yaw` tell."""
    typed, end = inside.run.letters, inside.run.duration
    if len(typed):
        ends = np.append(typed.arrival[1:], end)
        return [Letter(float(at), float(until), int(side))
                for at, until, side in zip(typed.arrival, ends, typed.value) if side]
    turning, goal = inside.find('turning'), inside.find('goal_yaw')
    if turning is not None and len(turning.time):
        times = turning.time[1:][np.diff(turning.value) > 0.0]
    else:
        times = goal.changes if goal is not None else np.empty(0)
    times = times - 0.1     # the variables are read twenty times a second
    return [Letter(float(at), float(until), 0)
            for at, until in zip(times, np.append(times[1:], end))]


def heading(inside: Inside) -> Tuple[Optional[Series], Optional[Quantity], Optional[Broken]]:
    """(the variable for the heading, the quantity that it follows, the Broken if it is wrong)."""
    quantities = inside.imu
    series = inside.find('curr_yaw')
    if series is None:
        found = [(each, followed(each, quantities)) for each in inside.variables.values()
                 if 'goal' not in each.name and np.isfinite(each.value).any()
                 and np.nanmax(each.value) - np.nanmin(each.value) > 0.5]
        usable = [each for each in found if each[1] and is_heading(each[1][0], quantities[0])]
        others = [each for each in found if each[1]]
        if not usable and not others:
            return None, None, None
        series = (usable or others)[0][0]
    return (series, *belief(series, quantities))


def wrong_heading(inside: Inside) -> Optional[Broken]:
    """Is curr_yaw the heading, in a range that can be used?"""
    return inside.known(heading)[2]


def goals(inside: Inside) -> List[Tuple[Letter, float, float, str, str]]:
    """(letter, curr_yaw, the goal that it asks for, goal_yaw before and after it) of each letter,
    the angles in the node's own unit."""
    series, quantity, _ = inside.known(heading)
    goal = inside.find('goal_yaw')
    if series is None or quantity is None or goal is None:
        return []
    turning, found = inside.find('turning'), []
    for letter in letters(inside):
        if turning is not None and turning.at(letter.begin) == 1.0:
            continue        # it is not read yet
        own, at = series.at(letter.begin), read_at(goal, letter) + READ
        if at < goal.time[-1]:
            found.append((letter, own, own + letter.side * ASKED * quantity.per_degree,
                          goal.text_at(letter.begin), goal.text_at(at)))
    return found


def read_at(goal: Series, letter: Letter) -> float:
    """The time at which goal_yaw changes after a letter; if it does not, soon after the letter."""
    changes = goal.changes[goal.changes > letter.begin]
    return float(changes[0]) if len(changes) and changes[0] < min(
        letter.end, letter.begin + ANSWERED) else letter.begin + READ


def wrong_goal(inside: Inside) -> Optional[Broken]:
    """Is goal_yaw 90 degrees from curr_yaw after a letter, to its side?"""
    series, quantity, _ = inside.known(heading)
    goal = inside.find('goal_yaw')
    if series is None or quantity is None or goal is None:
        return None
    wrong: List[Tuple[Letter, float, float, str, str]] = []
    right: List[Tuple[Letter, float, float, str, str]] = []
    for letter, own, asked, before, after in goals(inside):
        sides = [asked] if letter.side else [
            own + side * ASKED * quantity.per_degree for side in (1, -1)]
        value = number(after)
        off = [abs(turn_between(value, each, quantity.per_degree)) for each in sides]
        (right if min(off) <= NEAR else wrong).append((letter, own, asked, before, after))
    if not wrong:
        return None
    letter, own, asked, before, after = wrong[0]
    unit = quantity.per_degree
    asked = asked % (360.0 * unit) if letter.side else asked
    stayed = before == after
    words = 'after {}, with {} {:.4g}, {} {} {}; it should be {}'.format(
        letter.words, series.name, own, goal.name,
        'stayed' if stayed else 'became', short(after),
        '{:.4g}'.format(asked) if letter.side else '{:g} more or less'.format(ASKED * unit))
    printed = inside.run.printed.arrival
    begun = max([at for at in inside.run.starts if at < letter.begin], default=0.0)
    if stayed and inside.run.starts and not ((begun < printed) & (printed < letter.begin)).any():
        words += '. It had asked for nothing, {:.1f} s after its start'.format(letter.begin - begun)
    if unit < 0.5:
        words += '. {} is in radians here'.format(series.name)
    elif right:
        words += '; after {} with {:.4g} it was right'.format(right[0][0].words, right[0][1])
    return Broken(words, letter.begin, goal.name)


def short(text: str) -> str:
    """A variable's text with few digits."""
    try:
        return '{:.4g}'.format(float(text))
    except ValueError:
        return text[:40]


def turn_between(goal: float, own: float, unit: float = 1.0) -> float:
    """The turn from `own` to `goal` the short way round [deg]; both in `unit` for each degree."""
    turn = (goal - own) / unit
    return float(turn - 360.0 * np.round(turn / 360.0))


def not_turning(inside: Inside) -> Optional[Broken]:
    """Does `turning` become True by a letter?"""
    turning = inside.find('turning')
    if turning is None:
        return None
    for letter in letters(inside):
        part = turning.between(letter.begin + 0.02, min(letter.end, letter.begin + 1.0))
        if len(part.value) > 4 and not (part.value == 1.0).any():
            error = [step.error[0] for each, step in inside.known(steps)
                     if each == letter and len(step.error)]
            return Broken('after {}{}, {} stayed {}, or was {} again at once'.format(
                letter.words, ', at an error of {:+.0f} degrees'.format(error[0]) if error else '',
                turning.name, part.text[-1], part.text[-1]), letter.begin, turning.name)
    return None


class Steps(NamedTuple):
    """The commands of the turns: times, angular.z, the error from the node's own goal [deg], the
    same before it is wrapped, the goals and headings in the node's own numbers."""

    time: np.ndarray
    command: np.ndarray
    error: np.ndarray
    difference: np.ndarray
    goal: np.ndarray
    own: np.ndarray


def steps(inside: Inside) -> List[Tuple[Letter, Steps]]:
    """The Steps of each letter, until the node has sent the zero by which its turn ends."""
    series, quantity, _ = inside.known(heading)
    imu, right = inside.run.imu, inside.imu[0]
    used = quantity or right
    goal, found = inside.find('goal_yaw'), []
    for letter in letters(inside):
        sent = inside.run.commands
        begin = letter.begin if goal is None else read_at(goal, letter) - 2.0 * READ
        chosen = (sent.arrival > max(letter.begin, begin)) & (sent.arrival < letter.end)
        time, command = sent.arrival[chosen], sent.angular[chosen]
        sample = (np.searchsorted(imu.arrival, time) - 1).clip(0)
        own = used.value[sample]
        if goal is not None and quantity is not None:
            aim = np.array([goal.at(max(at + READ, begin + 3.0 * READ)) for at in time])
        elif letter.side:
            begin = used.value[max(0, int(np.searchsorted(imu.arrival, letter.begin)) - 1)]
            aim = np.full(len(time), begin + letter.side * ASKED * used.per_degree)
        else:
            continue
        raw = (aim - own) / used.per_degree
        found.append((letter, Steps(time, command, raw - 360.0 * np.round(raw / 360.0), raw, aim,
                                    own)))
    return found


def wrong_command(inside: Inside) -> Optional[Broken]:
    """Has each command the side of the error, and a speed within the limits?"""
    each = inside.known(steps)
    for letter, step in each:
        turning = inside.find('turning')
        if not len(step.time):
            if turning is not None and (turning.between(
                    letter.begin, letter.begin + 1.0).value == 1.0).sum() > 10:
                return Broken('after {} {} was True, and no command came'.format(
                    letter.words, turning.name), letter.begin)
            continue
        moving = np.flatnonzero(step.command)
        if 0 < len(moving) < 3 and moving[-1] == len(step.time) - 1 and (
                letter.end - step.time[-1] > PAUSE):
            return Broken('after {} the command {:+.2f} rad/s came {}, and then none'.format(
                letter.words, step.command[-1], ('once', 'twice')[len(moving) - 1]), letter.begin)
        if not step.command.any() and len(step.time) > 5 and abs(step.error[-1]) > CLEAR:
            return Broken('after {}, for an error of {:.0f} degrees, angular.z stayed 0{}'.format(
                letter.words, step.error[-1], inside.known(other_fields)), letter.begin,
                'angular.z')
    return wrong_side(inside, each) or too_fast(inside, each) or drives(inside, each)


#: The fields of a command that no wheel follows: its name in Twists, and in the message.
UNUSED = (('sideways', 'linear.y'), ('upward', 'linear.z'), ('rolling', 'angular.x'),
          ('pitching', 'angular.y'))


def other_fields(inside: Inside) -> str:
    """Words on a field of the commands in which there is a speed that was not asked for."""
    found = wrong_field(inside.run.commands, (*UNUSED, ('linear', 'linear.x')))
    return found and '; ' + found


def wrong_field(sent: Any, fields: Sequence[Tuple[str, str]] = UNUSED) -> str:
    """A clause on the first of these fields in which the commands have a speed; '' if none has."""
    for field, words in fields:
        speeds = getattr(sent, field, np.empty(0))
        if speeds.any():
            return '{} was {:.2g}'.format(words, speeds[np.argmax(np.abs(speeds))])
    return ''


def joined(each: List[Tuple[Letter, Steps]]) -> Steps:
    """The Steps of all letters in one."""
    return Steps(*(np.concatenate([getattr(step, name) for _, step in each] or [np.empty(0)])
                   for name in Steps._fields))


def wrong_side(inside: Inside, each: List[Tuple[Letter, Steps]]) -> Optional[Broken]:
    """Does a command turn away from the goal by the short way?"""
    step = joined(each)
    clear = (np.abs(step.error) > CLEAR) & (np.abs(step.error) < 180.0 - CLEAR) & (
        np.abs(step.command) > 0.02)
    wrong = clear & (step.command * step.error < 0.0)
    right = clear & ~wrong
    if wrong.sum() < 2:
        return None
    k = int(np.flatnonzero(wrong)[0])
    words = 'for an error of {:+.0f} degrees the command was {:+.2f} rad/s'.format(
        step.error[k], step.command[k])
    if np.abs(step.difference[k]) > 180.0:
        words = 'goal_yaw {:.4g} minus curr_yaw {:.4g} is {:+.0f}, by the short way {:+.0f} ' \
            'degrees: the command was {:+.2f} rad/s'.format(
                step.goal[k], step.own[k], step.difference[k], step.error[k], step.command[k])
    for good, said in ((np.abs(step.difference) <= 180.0, 'differences up to 180'),
                       (step.error > 0.0, 'errors to the left'),
                       (step.error < 0.0, 'errors to the right')):
        if right[good].any() and not wrong[good].any():
            words += '; for {} it was right'.format(said)
            break
    return Broken(words, float(step.time[k]), 'angular.z')


def too_fast(inside: Inside, each: List[Tuple[Letter, Steps]]) -> Optional[Broken]:
    """Is a command beyond the limit?"""
    step = joined(each)
    if not len(step.time) or np.abs(step.command).max() <= MAX_ANG_Z + 0.01:
        return None
    k = int(np.argmax(np.abs(step.command)))
    return Broken('for an error of {:+.0f} degrees the command was {:+.2f} rad/s, at most {:g} are '
                  'asked for{}'.format(step.error[k], step.command[k], MAX_ANG_Z,
                                       inside.constant('MAX_ANG_Z', MAX_ANG_Z)),
                  float(step.time[k]), 'angular.z')


def drives(inside: Inside, each: List[Tuple[Letter, Steps]]) -> Optional[Broken]:
    """Does it drive forward while it turns?"""
    sent = inside.run.commands
    for letter, step in each:
        chosen = np.isin(sent.arrival, step.time) & (sent.angular != 0.0)
        if (np.abs(sent.linear[chosen]) > 0.01).sum() > 2:
            return Broken('in the turn after {} linear.x was {:.2g}'.format(
                letter.words, sent.linear[chosen][1]), letter.begin, 'linear.x')
    return None


def too_seldom(inside: Inside) -> Optional[Broken]:
    """Do commands come ten times a second, none of them from elsewhere?"""
    for letter, step in inside.known(steps):
        moving = np.flatnonzero(step.command)
        if len(moving) < 3:
            continue
        part = step.command[moving[0]:moving[-1] + 1]
        pauses = np.diff(step.time[moving[0]:moving[-1] + 1])
        if np.median(pauses) > PAUSE:
            return Broken('commands came every {:.1f} s; the handout has ten a second'.format(
                np.median(pauses)), letter.begin)
        if (np.diff((part != 0.0).astype(int)) < 0).sum() >= 3:
            return Broken('{} of {} commands in the turn after {} were zero: another callback '
                          'publishes, too'.format((part == 0.0).sum(), len(part), letter.words),
                          letter.begin)
    return None


def not_over(inside: Inside) -> Optional[Broken]:
    """Does `turning` become False at the goal?"""
    turning = inside.find('turning')
    for letter in letters(inside):
        if turning is not None and turning.at(letter.begin - READ) == 1.0:
            return Broken('{} was still True when {} was typed: it did not become False at the '
                          'goal before'.format(turning.name, letter.words), letter.begin,
                          turning.name)
    return None


def same_time(inside: Inside) -> str:
    """Words on turns that all took the same time, wherever they ended; else ''."""
    took, errors = [], []
    for _, step in inside.known(steps):
        moving = np.flatnonzero(step.command)
        if len(moving):
            took.append(step.time[moving[-1]] - step.time[moving[0]])
            errors.append(abs(step.error[min(moving[-1] + 1, len(step.error) - 1)]))
    return '; each turn took {:.1f} s, at whatever error it ended'.format(np.mean(took)) if (
        len(took) > 2 and np.ptp(took) < 0.15 and np.ptp(errors) > HDG_TOL) else ''


def wrong_stop(inside: Inside) -> Optional[Broken]:
    """Does a turn end within the tolerance, by a zero?"""
    turning = inside.find('turning')
    tolerance = inside.constant('HDG_TOL', HDG_TOL) or inside.known(same_time)
    for letter, step in inside.known(steps):
        moving = np.flatnonzero(step.command)
        if not len(moving):
            continue
        last = moving[-1]
        rest = step.time[last + 1:]
        if len(rest):       # the zero by which it ends
            if abs(step.error[last + 1]) > HDG_TOL + 4.0:
                return Broken('the turn after {} was ended at an error of {:+.0f} degrees; {:g} '
                              'are the tolerance{}'.format(
                                  letter.words, step.error[last + 1], HDG_TOL, tolerance),
                              float(rest[0]), 'turning')
        elif letter.end - step.time[last] > PAUSE:
            return Broken('no zero followed the last command of the turn after {}, {:+.2f} rad/s '
                          'at an error of {:+.0f} degrees'.format(
                              letter.words, step.command[last], step.error[last]),
                          float(step.time[last]), 'angular.z')
        inner = np.flatnonzero(np.abs(step.error[:last + 1]) < HDG_TOL / 2.0)
        if len(inner) and step.time[last] - step.time[inner[0]] > 0.5:
            k = inner[0]
            is_on = turning is not None and turning.at(step.time[k] + 0.3) == 1.0
            return Broken('at an error of {:+.0f} degrees{} the command was {:+.2f} rad/s, and the '
                          'turn after {} went on{}'.format(
                              step.error[k], ', with turning still True,' if is_on else '',
                              step.command[k], letter.words, tolerance),
                          float(step.time[k]), 'turning')
    return None


def slow_law(inside: Inside) -> Optional[Broken]:
    """Is the command the gain times the error, within the limits?"""
    step = joined(inside.known(steps))
    clear = (np.abs(step.error) > 2.0 * MAX_ANG_Z / K_HDG) & (step.command * step.error > 0.0)
    if not clear.any() or np.median(np.abs(step.command[clear])) > 0.9 * MAX_ANG_Z:
        return None
    k = int(np.flatnonzero(clear)[0])
    return Broken('for an error of {:+.0f} degrees the command was {:+.2f} rad/s, by the handout '
                  'it is {:+.2f}{}{}'.format(
                      step.error[k], step.command[k], np.copysign(MAX_ANG_Z, step.error[k]),
                      inside.constant('K_HDG', K_HDG), inside.constant('MAX_ANG_Z', MAX_ANG_Z)),
                  float(step.time[k]), 'angular.z', is_weak=True)
