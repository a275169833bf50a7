"""The files of the report: report.html with everything in it, the figures as PNG, and CSV files.

Units: as in the headings of the columns; metres and degrees.
"""
import math
from datetime import datetime
from html import escape
from pathlib import Path
from typing import Dict, Sequence, Union

from tb3_labs.report import figures, path_figures, tables
from tb3_labs.report.drives import DriveReport, drives
from tb3_labs.report.epochs import epochs
from tb3_labs.report.html import degrees, document, number
from tb3_labs.report.movements import FASTEST_BY_MOUSE, PAUSE, by_hand
from tb3_labs.report.run_data import RunData, yaw_offset
from tb3_labs.report.turns import TurnReport, turns
from tb3_labs.robot.turtlebot3 import RobotModel

#: A path that is shorter is not drawn [m].
SHORTEST_PATH = 0.05
CAPTIONS = {
    'paths': 'The same path in the global and in the local frame, with the axes of both.',
    'turns': 'Angle left to what was asked, and rate of turn, from the first command on.',
    'errors': 'Distance to the goal, and angle off its heading, in local. Labels: errors at rest.',
    'heading': 'The IMU\'s heading, and how its difference from the odometry\'s varies.',
    'speeds': 'Commanded and measured speeds.'}
NOTHING = 'No drives are listed: {}. The local frame is {}.'
NO_COMMANDS = 'the recording holds neither goal_state nor commands; record /cmd_vel too'
NO_DRIVE = 'neither goal_state nor the commands show one'
#: How turns and drives are told from movements by hand.
BY_CONTROL = ('By the commands and ctrl_relinq: each movement while a node had control is a '
              'drive, any other is by hand; so is a turn alone, unless something cut it off.')
PAD_ALONE = ('A gamepad (joy) was recorded, but it never gave control (ctrl_relinq): all movements '
             'count as by hand.')
WITH_MOUSE = ('By the commands: a turn has no forward speed, from rest to rest, and is faster '
              'than any by the mouse ({:g} rad/s); all else is by hand.'.format(FASTEST_BY_MOUSE))
BY_SHAPE = ('By the commands: a turn has no forward speed, from rest to rest; a drive is a '
            'turn, a straight line and a turn, with pauses under {:g} s; all else is by '
            'hand.'.format(PAUSE))

RATES = '''<section><h2>Sensor rates and gaps</h2>
{}
<p>Intervals by the senders' stamps; cmd_vel has none, and is silent while nobody drives.</p>
</section>'''


def write_report(run: RunData, model: RobotModel, folder: Union[str, Path], turn: int = 0) -> Path:
    """Write the report of a run into a folder, which is made if it is missing; the path of
    report.html. `turn`: the number of the only turn that is drawn; 0: all are.

    ``OSError`` if nothing can be written, ``ValueError`` if there is no such turn."""
    folder = Path(str(folder))
    driven, turned = drives(run, model), turns(run)
    if turn > len(turned):
        raise ValueError('--turn {}: {} has {} turns'.format(turn, run.name, len(turned)))
    folder.mkdir(parents=True, exist_ok=True)
    name = Path(run.name).name
    tables.write_csv(run, folder / 'run.csv')
    tables.write_reports(folder, [(name, turned, driven)])
    page = folder / 'report.html'
    shown = _figures(run, model, folder, turn)
    page.write_text(document('Run report: ' + name, [
        '<p>{}</p>'.format(escape(_summary(run, model))), _turns(run, turned), shown['turns'],
        _drives(run, driven, turned), _by_hand(run, driven, turned), shown['paths'], shown['errors'], _along(driven),
        shown['heading'], shown['speeds'], RATES.format(tables.rates(run))]), encoding='utf-8')
    return page


def _figures(run: RunData, model: RobotModel, folder: Path, turn: int) -> Dict[str, str]:
    """{name: HTML} of each figure; '' for one that would show nothing."""
    drawn = {'turns': figures.turns(run, turn), 'errors': figures.errors(run, model),
             'heading': figures.heading(run), 'speeds': figures.speeds(run, model),
             'paths': None}
    if run.odometry.length >= SHORTEST_PATH:
        drawn['paths'] = path_figures.paths(run, model)
    return {name: figures.write_figure(figure, folder / (name + '.png'), CAPTIONS[name])
            for name, figure in drawn.items()}


def _summary(run: RunData, model: RobotModel) -> str:
    offset, resets = yaw_offset(run), len(epochs(run)) - 1
    return (
        '{} on {}, {:.1f} s, {:.2f} m driven, {} reset{}. IMU yaw minus odometry yaw: mean {} deg, '
        'standard deviation {}, change from the first to the last tenth of the run {}.'.format(
            model.name.capitalize(), datetime.fromtimestamp(run.start).strftime('%Y-%m-%d %H:%M'),
            run.duration, run.odometry.length, resets or 'no', '' if resets == 1 else 's',
            degrees(offset.mean, '{:+.2f}'), degrees(offset.spread, '{:.3f}'),
            degrees(offset.drift, '{:+.3f}')))


def _turns(run: RunData, turned: Sequence[TurnReport]) -> str:
    if not turned:
        return ''
    return '<h2>Turns</h2>{}<p>{}</p>'.format(
        tables.turns(turned),
        escape(_rule_of_turns(run, turned)))


def _drives(run: RunData, driven: Sequence[DriveReport], turned: Sequence[TurnReport]) -> str:
    if not driven and turned:
        return ''
    words = _rule_of_drives(run) if driven else _nothing(run)
    return '<h2>Drives</h2>{}<p>{}</p>'.format(
        tables.drives(tables.REACHED, driven) if driven else '', escape(words))


def _by_hand(run: RunData, driven: Sequence[DriveReport], turned: Sequence[TurnReport]) -> str:
    listed = [(drive.begin, drive.end) for drive in driven] + [
        (turn.begin, turn.end) for turn in turned]
    return tables.by_hand(run, by_hand(run, listed))


def _along(driven: Sequence[DriveReport]) -> str:
    if not driven:
        return ''
    return '<div class="next"></div><h2>Along the way</h2>{}<p>{}</p>'.format(
        tables.drives(tables.ALONG, driven), escape(tables.NOTE))


# Sentences: findings, rules and frames --------------------------------------------------------


def _nothing(run: RunData) -> str:
    """Why no drives are listed."""
    words = NOTHING.format(
        NO_DRIVE if len(run.states) or len(run.commands) else NO_COMMANDS,
        _declared(run) if 'frames' in run.derived else 'the recorded one')
    return words if len(run.states) or not len(run.commands) else words + ' ' + _rule(run)


def _declared(run: RunData) -> str:
    """Where ``local`` was declared, for a run that did not record it."""
    words = ['taken as declared (0, 0, 0) at the first sample']
    for k, time in enumerate(run.resets.time):
        pose = run.resets.pose(k)
        words.append('({} m, {} m, {} deg) at {:.1f} s'.format(
            number(pose.x, '{:.2f}'), number(pose.y, '{:.2f}'), degrees(pose.yaw, '{:.1f}'), time))
    return ', then '.join(words)


def _rule_of_drives(run: RunData) -> str:
    """How the drives of a run were found, if goal_state was not recorded."""
    words = []
    if 'states' in run.derived:
        words.append(_rule(run))
    if 'goals' in run.derived:
        goal = run.goals.pose(0)
        words.append('Goal: taken as ({:g} m, {:g} m, {:g} deg), see --goal.'.format(
            goal.x, goal.y, round(math.degrees(goal.yaw), 3) + 0.0))
    if 'frames' in run.derived:
        words.append('The local frame is {}; the place in it is that of the odometry, the heading '
                     'that of the IMU.'.format(_declared(run)))
    return ' '.join(words)


def _rule_of_turns(run: RunData, reports: Sequence[TurnReport]) -> str:
    """How the turns of a run were found."""
    words = [_rule(run)] if 'states' not in run.derived else []
    if not all(turn.was_said for turn in reports):
        words.append('Asked: taken as the nearest multiple of 90 degrees{}.'.format(
            ' where topic turn said nothing' if len(run.asked) else ''))
    return ' '.join(words)


def _rule(run: RunData) -> str:
    if len(run.control):
        return BY_CONTROL
    if 'joy' in run.devices:
        return PAD_ALONE
    return WITH_MOUSE if 'mouse_info' in run.devices else BY_SHAPE
