"""The files of the commissioning: robot3.yaml for the simulated robot, robot3.html for people.

The YAML holds settings of the simulated robot only. Delays that cannot be separated are divided by
a rule. The network needs as long in either direction. The rest of the dead time is the age of the
wheels' value at its stamp, up to `OLDEST`; a further rest is the delay of the command.
"""
import io
from dataclasses import fields
from typing import Any, Dict, List, Optional, Tuple

import numpy as np
from matplotlib.figure import Figure

from tb3_labs.commissioning import steps
from tb3_labs.commissioning.estimates import WAIT, clean
from tb3_labs.commissioning.findings import FAULT, LOOK, Finding, summary
from tb3_labs.commissioning.recording import Recording
from tb3_labs.commissioning.responses import responses
from tb3_labs.commissioning.sensors import Estimates
from tb3_labs.commissioning.twin import driven
from tb3_labs.report import figures
from tb3_labs.report.page import document, picture
from tb3_labs.report.tables import Markup, table
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: The least age of the wheels' value at its stamp, and the largest one [s].
YOUNGEST, OLDEST = 0.0085, 0.15
#: Numbers that are settings of the simulated robot as they are.
SAME = ('imu_offset_deg', 'imu_rate', 'odom_rate', 'imu_noise_deg', 'imu_drift_deg_per_min',
        'stamp_step', 'wheel_mismatch', 'wheel_separation', 'wheel_radius', 'motor_lag',
        'sensor_latency', 'sensor_jitter', 'stalls_per_min', 'longest_stall', 'reset_pause')
#: Steps of the twin, and their curves: (part, samples, direction of the command).
TWIN = tuple(steps.BY_NAME[name] for name in (steps.REST, 'turns', 'drives'))
#: Answer: (times after the command [s], travel [rad] or [m]). Answers: {part: both robots' Answer}.
Answer = Tuple[np.ndarray, np.ndarray]
Answers = Dict[str, Tuple[Answer, Answer]]
CURVES = (('turn', 'imu', 'turned [deg]', 180.0 / np.pi), ('drive', 'odom', 'driven [mm]', 1e3))


def settings(found: Estimates, model: RobotModel) -> Dict[str, Any]:
    """{field of SimulatorConfig: value} of this robot, as far as it was measured."""
    chosen: Dict[str, Any] = {'model': model.name}
    for name in SAME:
        if name in found:
            value, error = float(found[name].value), found[name].error
            chosen[name] = 0.0 if name == 'imu_drift_deg_per_min' and abs(value) < error else value
    mismatch = chosen.get('wheel_mismatch', 0.0)
    if 'wheel_radius' in chosen:        # of the left wheel; the mean of both was measured
        chosen['wheel_radius'] /= 1.0 - 0.5 * mismatch
    latency = chosen.get('sensor_latency', 0.0)
    jitter = chosen.get('sensor_jitter', 0.0)
    if 'turn_delay' in found and 'sample_delay' in found:
        younger = found['imu_after_wheels'].value if 'imu_after_wheels' in found else 0.005
        seen = min(max(found['sample_delay'].value, 0.0), found['turn_delay'].value)
        rest = found['turn_delay'].value - younger - seen - WAIT
        age = min(max(rest - latency - jitter, YOUNGEST), OLDEST)
        chosen.update(wheel_lag=age, yaw_lag=float(max(0.0, age + younger)), command_jitter=jitter,
                      command_latency=float(max(0.0, rest - age - jitter)))
    valid = {item.name: item.metadata for item in fields(SimulatorConfig)}
    for name, value in chosen.items():
        if isinstance(value, float):
            low, high = valid[name]['low'], valid[name]['high']
            chosen[name] = round(min(max(value, low), high), 5)
    return chosen


def yaml_text(name: str, chosen: Dict[str, Any], found: Estimates) -> str:
    """The text of the YAML file."""
    lines = ['# {}, as commission.py measured it. The simulated robot becomes it:'.format(name),
             '# roslaunch tb3_labs fake_robot.launch params:={}.yaml'.format(name)]
    for key, value in chosen.items():
        error = '    # +- {:.2g}'.format(found[key].error) if key in found else ''
        # YAML takes 1e-05 for a text
        number = '{:.5f}'.format(value) if isinstance(value, float) else value
        lines.append('{}: {}{}'.format(key, number, error))
    return '\n'.join(lines) + '\n'


def mean_answer(recording: Recording, name: str, kind: str) -> Optional[Answer]:
    """(times after the command, travel) of a step's answer: the mean over all clean ones."""
    ones = {one.begin for one in clean(responses(recording, name, kind))}
    time, curves = np.arange(0.0, 1.0, 0.01), []
    for mark in recording.marked(name):
        samples = recording.samples(kind).between(mark.begin - 1.0, mark.end + 1.0)
        imu = recording.samples('imu').between(mark.begin - 1.0, mark.end + 1.0)
        if mark.begin in ones and len(samples) > 8:
            values = samples.turned if kind == 'imu' else samples.way
            at = samples.stamp + imu.usual_delay - mark.begin
            sign = np.sign(mark.angular or mark.linear)
            values = sign * (values - np.interp(0.0, at, values))
            curves.append(np.interp(time, at, values))
    return (time, np.median(curves, axis=0)) if curves else None


def both_answers(recording: Recording, twin: Recording) -> Answers:
    """The answers of both robots, of each part that both of them have."""
    found: Answers = {}
    for name, kind, _, _ in CURVES:
        real, simulated = (mean_answer(of, name, kind) for of in (recording, twin))
        if real is not None and simulated is not None:
            found[name] = real, simulated
    return found


def agreement(answers: Answers) -> Dict[str, float]:
    """{part: largest difference of the two answers, as a share of the travel}."""
    return {name: float(np.abs(real[1] - simulated[1]).max() / abs(real[1]).max())
            for name, (real, simulated) in answers.items()}


def figure(answers: Answers) -> Optional[Figure]:
    """Both robots' answers to a step, over each other."""
    if not answers:
        return None
    drawn = [curve for curve in CURVES if curve[0] in answers]
    made = figures.new_figure(2.8)
    for axes, (name, _, label_y, scale) in zip(
            made.subplots(1, len(drawn), squeeze=False)[0], drawn):
        for label, looks, answer in zip(('this robot', 'simulated'), figures.STYLES, answers[name]):
            axes.plot(answer[0], scale * answer[1], label=label, color=looks[0],
                      linestyle=looks[1], linewidth=1.3)
        axes.set(xlabel='time since the command [s]', ylabel=label_y)
        axes.grid(True, linewidth=0.3)
        axes.legend(fontsize=8, frameon=False)
    return made


def html(name: str, lines: List[Finding], recording: Recording, chosen: Dict[str, Any],
         found: Estimates) -> str:
    """The page, with everything in it. It drives a simulated robot with the YAML's numbers."""
    rows = [[Markup('<b>{}</b>'.format(line.verdict)) if line.verdict in (FAULT, LOOK)
             else line.verdict, line.name, line.text, line.usual, line.meaning] for line in lines]
    heads = ['verdict', 'what', 'number', 'usual', 'what it means for a class']
    parts = ['<p>{}. Errors hold in 95 of 100 cases.</p>'.format(summary(lines)),
             table(heads, rows, words=heads)]
    if 'turn_delay' in found:
        answers = both_answers(recording, driven(SimulatorConfig(**chosen), TWIN))
        drawn = figure(answers)
        if drawn is not None:
            png = io.BytesIO()
            figures.save(drawn, png)
            parts.append(picture(png.getvalue(), 'Answers to a step', 'This robot, and the '
                                 'simulated one with {}.yaml: {}.'.format(name, ', '.join(
                                     'a {} differs by at most {:.1f} %'.format(part, 100.0 * share)
                                     for part, share in agreement(answers).items()))))
    return document('{}: first contact'.format(name), parts)
