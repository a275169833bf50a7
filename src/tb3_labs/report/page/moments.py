"""The moments of a run on its timeline: turns, drives, movements by hand, resets, stops, gaps."""
from typing import List, Sequence

import numpy as np

from tb3_labs.report.motion.drives import DriveReport
from tb3_labs.report.motion.epochs import epochs
from tb3_labs.report.motion.goals import spans
from tb3_labs.report.motion.movements import Kind, movements, parts_of, programs
from tb3_labs.report.motion.turns import TurnReport
from tb3_labs.report.page.document import degrees, number
from tb3_labs.report.page.timeline import Mark, mark
from tb3_labs.report.run_data import GAP, RunData


def moments(run: RunData, turned: Sequence[TurnReport],
            driven: Sequence[DriveReport]) -> List[Mark]:
    """The Marks of a recorded run, with its turns and drives."""
    found = [mark('turn', turn.begin, 'turn {}: asked {}, turned {} deg'.format(
        k, degrees(turn.requested, '{:+.0f}'), degrees(turn.turned, '{:+.1f}')), turn.end)
        for k, turn in enumerate(turned, 1)]
    found += [mark('drive', drive.begin, 'drive {}: {}, {} m and {} deg off'.format(
        k, drive.outcome, number(drive.measured[0], '{:.3f}'),
        degrees(drive.measured[1], '{:.1f}')), drive.end) for k, drive in enumerate(driven, 1)]
    found += [_by_hand(run, *part) for movement in movements(run) for part in (
        parts_of(run, movement) if movement.kind is Kind.BY_HAND else [
            (movement.begin, movement.end)]) if not any(
        movement.begin < each['end'] and each['begin'] < movement.end for each in found)]
    found += [mark('reset', epoch.begin, f'reset {k} of local')
              for k, epoch in enumerate(epochs(run)[1:], 1)]
    found += [mark('stop', span.begin, span.state) for span in spans(run) if ':' in span.state]
    given = run.control.value > 0.5
    found += [mark('start' if given[k] else 'stop', run.control.time[k],
                   f"control {'given to' if given[k] else 'taken from'} the node")
              for k in np.flatnonzero(np.diff(given, prepend=~given[:1]))]
    for name, samples in (('imu', run.imu), ('odometry', run.odometry)):
        for k in np.flatnonzero(np.diff(samples.time) > GAP):
            begin, end = samples.time[k:k + 2]
            found.append(mark('lost', begin, f'{name} silent for {end - begin:.1f} s',
                              end))
    return found


def _by_hand(run: RunData, begin: float, end: float) -> Mark:
    before, after = run.imu.yaw_at((begin, end))
    # a controller sends what its mouse asks for
    drivers = [] if 'mouse_info' in run.devices else programs(run, begin, end)
    return mark('hand', begin, '{}: {:.2f} m, turned {} deg'.format(
        'driven by ' + ' and '.join(drivers) if drivers else 'by hand',
        run.odometry.between(begin, end).length, degrees(after - before, '{:+.1f}')), end)
