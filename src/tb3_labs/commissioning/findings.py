"""The lines of the page: each number with what is usual, a verdict, and what it means for a class.

A verdict is `ok`, `look` (a class can work with it, if it knows) or `FAULT` (mend it first).
"""
import math
from dataclasses import dataclass
from typing import Dict, List, NamedTuple

from tb3_labs.commissioning import ride, steps
from tb3_labs.commissioning.recording import Recording
from tb3_labs.commissioning.sensors import GAP, Estimate, Estimates, silences
from tb3_labs.robot.turtlebot3 import CUT_OFF, RobotModel

OK, LOOK, FAULT = 'ok', 'look', 'FAULT'
#: A battery lasts for a lab from CHARGED on; FULL is that of a new charge [V].
CHARGED, FULL = 11.4, 12.6


@dataclass(frozen=True)
class Finding:
    """One line. `key` names it for programs, `name` for people; `text` is the number."""

    verdict: str
    key: str
    name: str
    text: str
    usual: str = ''
    meaning: str = ''


class Rule(NamedTuple):
    """The judgement of a number: ok in [low, high], FAULT outside of [worst_low, worst_high], else
    look. A number that is inside within its error counts as inside."""

    name: str
    form: str                   # of the number and its error, times `scale`
    scale: float
    low: float
    high: float
    worst_low: float
    worst_high: float
    meaning: str
    bad: str = ''               # instead of the meaning, if it is not ok


INF = math.inf
LAGS = 'the laws learn it; students see the robot answer late'
CLOCK = 'tf and recordings need clocks that agree: chrony on both sides'


#: Rules of sensors, network and motors, and below of wheels, gyro and board, by their numbers.
SENSED = {
    'imu_rate': Rule('IMU', '{:.1f} messages/s', 1.0, 80.0, INF, 15.0, INF,
                     '170 behind a fast computer, 115 behind a Raspberry Pi',
                     'too few to steer by: what loads the robot\'s computer?'),
    'odom_rate': Rule('Odometry', '{:.1f} messages/s', 1.0, 27.0, INF, 10.0, INF,
                      'its rhythm is that of the commands', 'is the robot\'s computer busy?'),
    'clock_offset': Rule('Clock of the robot', '{:+.0f} ms ahead', 1e3, -0.1, 0.1, -1.0, 1.0,
                         'the clocks agree', CLOCK),
    'sample_delay': Rule('Delay of a sample', '{:.1f} ms', 1e3, -0.02, 0.08, -INF, 0.15,
                         'from its stamp to its arrival',
                         'a slow network, or a clock that is off'),
    'sensor_jitter': Rule('Jitter of the delay', '{:.1f} ms', 1e3, 0.0, 0.02, -INF, 0.05,
                          'mean; each message has another delay', 'is the WLAN crowded?'),
    'stamp_step': Rule('Steps of the stamps', '{:.1f} ms', 1e3, 0.0, 0.03, -INF, 0.1,
                       'the serial link sets the board\'s clock now and then',
                       'the robot\'s computer is busy'),
    'stalls_per_min': Rule('Stalls of the WLAN', '{:.1f} a minute', 1.0, 0.0, 6.0, -INF, INF,
                           'the nodes bridge short ones',
                           'drives pause: 5 GHz, a cable, or go nearer to the access point'),
    'longest_stall': Rule('Longest stall', '{:.2f} s', 1.0, 0.0, 0.25, -INF, 0.65,
                          'nodes pause after 0.22 s',
                          'nodes stop the robot in each long one; power saving of the WLAN?'),
    'imu_drift_deg_per_min': Rule(
        'Drift of the heading', '{:+.2f} deg/min', 1.0, -2.0, 2.0, -7.5, 7.5,
        'a lab of ten minutes does not see it',
        'the gyro was calibrated while the robot moved: `reset`, at rest'),
    'imu_noise_deg': Rule('Noise of the heading', '{:.4f} deg', 1.0, 0.0, 0.05, -INF, 0.5,
                          'from sample to sample', 'does the robot stand on firm ground?'),
    'imu_offset_deg': Rule(
        'IMU minus odometry', '{:+.1f} deg', 1.0, -180.1, 180.1, -INF, INF,
        'any constant is normal: nodes must not mix the two headings'),
    'turn_delay': Rule('Dead time of turning', '{:.0f} ms', 1e3, 0.0, 0.2, -INF, 0.28, LAGS,
                       'turns overshoot: slow network, or samples that are old at their stamp'),
    'drive_delay': Rule('Dead time of driving', '{:.0f} ms', 1e3, 0.0, 0.2, -INF, 0.28, LAGS,
                        'drives overshoot: see the delays above'),
    'imu_after_wheels': Rule('Age of the heading', '{:+.0f} ms', 1e3, -0.01, 0.03, -0.1, 0.1,
                             'later than the wheels\' value of the same stamp', LAGS),
    'motor_lag': Rule('Lag of the motors', '{:.1f} ms', 1e3, 0.0, 0.16, -INF, 0.2,
                      'time constant', 'sluggish: battery, dirt in the wheels, another motor'),
}
OF_BOARD = {
    'wheel_mismatch': Rule('Right wheel smaller by', '{:+.2f} %', 100.0, -0.016, 0.016,
                           -0.023, 0.023, 'turns in a straight drive: 3.6 deg/m for each %',
                           'it drives curves: is a tyre loose, or dirt on a wheel?'),
    'gyro_scale': Rule('Turn by the IMU', '{:.4f} of the true one', 1.0, 0.99, 1.01, 0.95,
                       1.05, 'by the mark on the floor',
                       'turns are wrong by this factor; calibrate the IMU'),
    'wrap': Rule('Rate of turn at +/-180 deg', '{:.0f} rad/s', 1.0, 100.0, 220.0, -INF, INF,
                 'the odometry\'s twist, wrong for one sample: nodes use the gyro',
                 'not the firmware that the labs know'),
    'reset_pause': Rule('`reset`: deaf and silent for', '{:.2f} s', 1.0, 1.5, 3.5, -INF, 6.0,
                        'wait for it; the motors keep their speed meanwhile'),
    'obeyed_late': Rule('A command meanwhile is obeyed', '{:.1f} s late', 1.0, 0.0, 4.0, -INF,
                        INF, 'stop the robot before a reset'),
    'reset_place': Rule('Odometry after `reset`', '{:.3f} m from zero', 1.0, 0.0, 0.05, -INF,
                        INF, 'its yaw is not zero: it takes the IMU\'s turn of the pause',
                        'the odometry is not zeroed: a firmware of another kind'),
}


def rules(model: RobotModel) -> Dict[str, Rule]:
    """The rules by the names of the numbers, in the order of the page."""
    return {**SENSED, **_of_model(model), **OF_BOARD}


def _of_model(model: RobotModel) -> Dict[str, Rule]:
    """The rules of numbers that each model has as its own."""
    top, fast = model.max_linear, min(model.max_angular,
                                      model.max_wheel_speed / model.half_track)
    radius, apart = model.wheel_radius, model.wheel_separation
    return {
        'top_turn': Rule('Fastest turn', '{:.2f} rad/s', 1.0, 0.9 * fast, 1.1 * fast, 0.75 * fast,
                         1.25 * fast, 'faster commands are cut off by the firmware',
                         'is it {}? do the wheels slip?'.format(model.name)),
        'top_speed': Rule('Fastest drive', '{:.3f} m/s', 1.0, 0.97 * top, 1.05 * top, 0.8 * top,
                          1.25 * top, 'by odometry; faster commands are cut off',
                          'is it {}? battery?'.format(model.name)),
        'braking': Rule('Braking from there', '{:.0f} mm', 1e3, 0.0, 0.07, -INF, 0.15,
                        'from the zero to rest, as seen here: keep that far from walls'),
        'time_out': Rule('Drives on in a silence', '{:.2f} s', 1.0, 0.4, 0.65, 0.2, 1.0,
                         'the firmware\'s own stop, if a program or the network dies',
                         'another firmware: do not rely on its stop'),
        'wheel_radius': Rule('Radius of the wheels', '{:.2f} mm', 1e3, 0.96 * radius,
                             1.04 * radius, 0.93 * radius, 1.07 * radius,
                             'by the tape measure', "the wheels slip, or are not the model's"),
        'wheel_separation': Rule('Distance of the wheels', '{:.1f} mm', 1e3, 0.94 * apart,
                                 1.06 * apart, 0.9 * apart, 1.1 * apart,
                                 'by the mark on the floor',
                                 "the wheels slip, or are not the model's"),
    }


def findings(recording: Recording, found: Estimates, model: RobotModel) -> List[Finding]:
    """All lines: first the faults that ended the drive, then the others by the order of rules."""
    lines = _of_the_end(recording) + _of_dropouts(recording) + _of_the_body(recording)
    for key, rule in rules(model).items():
        if key in found:
            lines.append(_judged(key, rule, found[key]))
    if 'time_out' not in found and recording.marked(steps.SILENCE):
        lines.append(Finding(LOOK, 'time_out', 'Drives on in a silence', 'not measured', '',
                             'the network stalled just then: measure again'))
    return lines


def _judged(key: str, rule: Rule, estimate: Estimate) -> Finding:
    value, error = estimate
    verdict = OK
    if value + error < rule.low or value - error > rule.high:
        verdict = LOOK
    if value + error < rule.worst_low or value - error > rule.worst_high:
        verdict = FAULT
    number, unit = (rule.form + ' ').split(' ', 1)
    text = '{} +- {} {}'.format(number.format(rule.scale * value), number.replace('+', '').format(
        rule.scale * error), unit.strip())
    bounds = [rule.form.split(' ')[0].replace('+', '').format(rule.scale * bound)
              for bound in (rule.low, rule.high) if math.isfinite(bound)]
    usual = ' to '.join(bounds) if len(bounds) == 2 else 'at least ' + bounds[0]
    return Finding(verdict, key, rule.name, text, usual,
                   rule.bad if verdict != OK and rule.bad else rule.meaning)


def _of_the_end(recording: Recording) -> List[Finding]:
    ended = recording.ended
    if not ended:
        return []
    if ride.KEY in ended:
        return [Finding(LOOK, 'ended', 'Ended', ended, '', 'numbers are missing below')]
    if recording.lost:
        return [_of_the_lost(recording)]
    key, meaning = next(
        (key, meaning) for words, key, meaning in (
            (ride.FROZEN + 'imu', 'imu_frozen', 'the board repeats one sample: restart bringup'),
            (ride.FROZEN + 'odom', 'odom_frozen', 'the board repeats one sample: restart bringup'),
            (ride.STANDS + ', by imu', 'imu_frozen', 'the odometry turns, the IMU does not: '
             'restart bringup'),
            (ride.STANDS + ', by odom', 'odom_frozen', 'the IMU turns, the odometry does not'),
            (ride.STANDS, 'motors', 'battery below 11 V? torque off? does the robot hear cmd_vel?'),
            (ride.STOOD, 'stood', 'this computer was asleep, or too busy: measure again'),
            (ride.WALL, 'wall', 'it did not come back to its start: do the wheels slip?'),
            ('', 'slow', 'it moves less than commanded')) if words in ended)
    return [Finding(FAULT, key, 'Ended', ended, '', meaning)]


def _of_the_lost(recording: Recording) -> Finding:
    """A silence ended the drive: whose, and of which kind?"""
    names, heard = recording.lost, []
    begin = max((mark.begin for mark in recording.marks), default=0.0)
    for kind in names.split(' and '):
        samples = recording.samples(kind)
        late = samples.between(begin, math.inf) if len(samples) else samples
        if len(late) > 2 and (late.arrival[1:] - late.arrival[:-1]).max() > 0.5:
            heard.append(float((late.stamp[1:] - late.stamp[:-1]).max()))
    text, key = recording.ended, 'lost_' + '_'.join(names.split(' and '))
    if heard and max(heard) < GAP:
        return Finding(FAULT, 'stalls', 'Ended', text, '', 'it all came later at once: the WLAN '
                       'stalls. 5 GHz, a cable, power saving off')
    if heard:
        return Finding(FAULT, key, 'Ended', text, '', 'it came back: the board itself was silent '
                       'for {:.1f} s. Cable, battery, bringup'.format(max(heard)))
    return Finding(FAULT, key, 'Ended', text, '', 'it did not come back: board off, cable, or '
                   'bringup ended')


def _of_dropouts(recording: Recording) -> List[Finding]:
    _, dropouts = silences(recording) if len(recording.rows['imu']) > 2 else ([], [])
    if not dropouts:
        return []
    return [Finding(FAULT, 'dropouts', 'Dropouts', '{} of up to {:.1f} s'.format(
        len(dropouts), max(dropouts)), '0', 'the board itself was silent: cable, battery, bringup')]


def _of_the_body(recording: Recording) -> List[Finding]:
    lines = []
    if recording.volts:
        before, after = recording.volts[0], recording.volts[-1]
        verdict = FAULT if after < CUT_OFF else LOOK if after < CHARGED else OK
        text = '{:.2f} V before, {:.2f} V after'.format(before, after)
        lines.append(Finding(
            verdict, 'battery', 'Battery', text, '{:.1f} to {:.1f}'.format(CHARGED, FULL),
            'below {:.1f} V the board cuts the motors'.format(CUT_OFF)))
    if recording.torque is not None:
        lines.append(Finding(OK if recording.torque else FAULT, 'torque', 'Torque of the motors',
                             'on' if recording.torque else 'off', 'on',
                             'off: the wheels turn freely'))
    return lines


def summary(lines: List[Finding]) -> str:
    """One line on all findings."""
    count = {verdict: sum(line.verdict == verdict for line in lines)
             for verdict in (FAULT, LOOK, OK)}
    return ', '.join('{} {}'.format(number, verdict) for verdict, number in count.items())


def printed(line: Finding) -> str:
    """The line as text."""
    return '{:<6}{:<32}{}{}'.format(line.verdict, line.name, line.text,
                                    '' if line.verdict == OK else ': ' + line.meaning)
