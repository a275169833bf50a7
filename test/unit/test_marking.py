"""Marks, pages and tables of observations that are made up, so that the true events are known."""
import csv
import io
import math
import re
import tempfile
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from pages import ROOT
from made_run import made, speeds_sent
from recorded_trial import write_trial

from tb3_labs.handout import PAD_AXES, PAD_BUTTONS
from tb3_labs.marking import marks
from tb3_labs.marking import limits
from tb3_labs.marking.intake import archives
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.criteria import Criterion, Outcome, Verdict
from tb3_labs.marking.labs.gamepad import pad_called, pad_text
from tb3_labs.marking.marks import LABS, Marks, marks_after_trial, points_of
from tb3_labs.marking.marks_csv import MarksTable
from tb3_labs.marking.student_results import student_page, timeline_of
from tb3_labs.marking.trial.from_bag import read_trial
from tb3_labs.marking.trial.observation import MAX_FINDINGS, NodeProcess, Observation, Stimulus
from tb3_labs.marking.trial.ros_trial import SCRIPTS, Trial
from tb3_labs.nodes.gamepad.pad import PadConfig
from tb3_labs.recording.run_data import Poses
from tb3_labs.watch.mistake import SheetStep

TABLE = yaml.safe_load((ROOT / 'launch/checks/points.yaml').read_text(encoding='utf-8'))


def stimulus(name, begin=0.0, end=2.0, **more):
    return Stimulus(name, begin, end, **more)


def recording(commands=(), truth=()):
    """The recording of `commands` (time, linear, angular) and of true poses (time, x, y, yaw)."""
    time, linear, angular = np.array(commands, dtype=float).reshape(-1, 3).T
    at, *true = np.array(truth, dtype=float).reshape(-1, 4).T
    return made(commands=speeds_sent(time, time, linear, angular), ground_truth=Poses(at, at, *true))


def observation(lab='turn', commands=(), truth=(), **parts):
    """The Observation of a node that ran all the time."""
    return Observation(lab, 'lab2/node.py', recording(commands, truth),
                       processes=[NodeProcess(0.0, ready=0.5)], **parts)


def turned(degrees):
    """After the letter l, the robot turned by `degrees` within two seconds, from 3 rad on."""
    angle = math.radians(degrees)
    return observation(
        stimuli=[stimulus('l', facts={'moved': True, 'rested': True})],
        truth=[[0.02 * k, 0.0, 0.0, 3.0 + angle * k / 100.0] for k in range(101)],
        commands=[[0.1, 0.0, math.copysign(1.5, degrees)], [1.9, 0.0, 0.0]])


@pytest.mark.parametrize('lab', LABS)
def test_every_criterion_has_points_and_a_place_in_a_lab_sheet(lab):
    criteria = LABS[lab].criteria
    assert len({criterion.name for criterion in criteria}) == len(criteria)
    assert sum(points_of(lab, TABLE).values()) > 0
    for criterion in criteria:
        place = criterion.sheet_step
        sheet = (ROOT / 'doc' / place.sheet).read_text(encoding='utf-8')
        section = r'^#+ {}\n(.*?)(?=^#+ |\Z)'.format(re.escape(place.heading))
        text = re.search(section, sheet, re.M | re.S).group(1)
        if place.step:
            step = r'^{}\. (.*?)(?=^\d+\. |\Z)'.format(place.step)
            text = re.search(step, text, re.M | re.S).group(1)
            for word in ('Ctrl+C', 'mouse', 'right', 'imu'):
                assert word in text or word not in criterion.meaning, criterion.name
        assert len(' '.join(text.split())) >= 50, criterion.name


WITHOUT_RIGHT = {name: points for name, points in TABLE['turn'].items() if name != 'right'}


@pytest.mark.parametrize('table, words', [
    ({'turn': dict(TABLE['turn'], left=-1)}, 'left = -1'),
    ({'turn': dict(TABLE['turn'], left='many')}, "left = 'many'"),
    ({'turn': dict(TABLE['turn'], left=True)}, 'left = True'),
    ({'turn': dict(TABLE['turn'], left=math.nan)}, 'left = nan'),
    ({'turn': dict(TABLE['turn'], lfet=1)}, '"lfet"'),
    ({'turn': dict(TABLE['turn'], extra={'left': 1})}, '"left"'),
    ({'turn': dict(TABLE['turn'], extra=3)}, 'section of its own'),
    ({'turn': WITHOUT_RIGHT}, 'right = None'),
    ({'imu': {}}, 'no section "turn"'), (None, 'no section "turn"')])
def test_points_that_are_not_valid_are_refused(table, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        points_of('turn', table)


def test_the_sheet_for_instructors_lists_every_part():
    sheet = (ROOT / 'doc' / 'instructor' / 'marking.md').read_text(encoding='utf-8')
    table = sheet.split('## What is tried')[1]
    listed, lab = [], ''
    for line in re.findall(r'^\| (\w*) *\| ([\w ]+) \|', table, re.M)[1:]:
        lab = line[0] or lab
        listed.append((lab, line[1]))
    assert listed == [(name, part) for name, lab in LABS.items() for part in SCRIPTS[name]]
    assert all(lab.parts == list(SCRIPTS[name]) for name, lab in LABS.items())


def test_the_sheet_for_instructors_has_the_numbers_of_the_marking():
    sheet = (ROOT / 'doc' / 'instructor' / 'marking.md').read_text(encoding='utf-8')
    words, turns = ' '.join(sheet.split()), stimuli.TURN_STIMULI.values()
    for said in (
            'the robot rests at {:g}, {:g}, {:g} and {:g} degrees'.format(*stimuli.STANDING_HEADINGS.values()),
            '`l` from {:g} and {:g} degrees, `r` from {:g}, {:g} and {:g}, `l` from {:g}'.format(
                *[each.begins_deg for each in turns]),
            '{:g} MB or {} files'.format(archives.MAX_SUBMISSION_BYTES / 1e6, archives.MAX_FILES),
            'files above {:g} MB are left out'.format(archives.MAX_COPIED_BYTES / 1e6),
            '{} processes, {:g} GB of memory'.format(limits.MAX_PROCESSES, limits.MAX_NODE_MEMORY_BYTES / 1e9),
            '{:g} MB in th'.format(limits.MAX_DISK_BYTES / 1e6),      # their folders
            'with more than {:g} MB'.format(limits.MAX_OTHER_MEMORY_BYTES / 1e6),
            'more than {:g} GB of address space, or {:g} MB in a file'.format(
                limits.MAX_ADDRESS_SPACE_BYTES / 1e9, limits.MAX_FILE_BYTES / 1e6)):
        assert said in words


@pytest.mark.parametrize('was_moving, waits, took', [
    (False, True, True), (False, False, False), (True, True, False)])
def test_a_node_that_waits_for_a_letter_at_ctrl_c_gets_enter(was_moving, waits, took):
    """Python 3.13 does not end while input() waits. A node that turned the robot did not wait for a letter."""
    node = SimpleNamespace(is_alive=True, send_ctrl_c=lambda limit: False, record_state=lambda: None,
                           flush=lambda: None, status=0, stop=lambda: None)
    node.type = lambda line: setattr(node, 'is_alive', not (waits and line == ''))
    events = []
    trial = Trial.__new__(Trial)
    vars(trial).update(
        node=node, part='', _print_line=lambda said: None, recorder=SimpleNamespace(now=1.0),
        bag=SimpleNamespace(add_event=lambda kind, **facts: events.append(facts) or 0.0))
    trial.send_ctrl_c(was_moving=was_moving)
    assert (events[-1]['facts'][stimuli.EXIT_SECONDS] is not None) is took


def test_findings_are_kept_once_and_not_without_end():
    seen = observation(findings=['first', *map(str, range(100)), 'first'])
    assert marks_of('', seen).observation.findings == ['first', *map(str, range(MAX_FINDINGS - 1))]


def test_a_pad_is_played_by_the_numbers_that_the_launch_file_loads():
    assert PadConfig(**pad_called('handout')) == PadConfig()
    assert pad_text('f310_d') == ('The pad was "f310_d": axis 1 drives, axis 2 turns; button 1 '
                                  'is A, 2 is B, 3 is Y.')


def test_the_sticks_and_buttons_of_every_pad_are_there():
    for file in (ROOT / 'launch' / 'params').glob('pad_*.yaml'):
        pad = PadConfig(**pad_called(file.name[4:-5]))
        assert max(pad.linear_axis, pad.angular_axis) < PAD_AXES
        assert max(pad.relinquish_button, pad.regain_button, pad.reset_button) < PAD_BUTTONS


def handed_in(student, **more):
    return Marks(student, 'lab2/node.py', remarks=['A "remark", <b>.'], **more)


def marks_of(student, seen):
    """The Marks from the bag of an Observation."""
    with tempfile.TemporaryDirectory() as folder:
        write_trial(folder + '/trial.bag', seen)
        return marks_after_trial(handed_in(student), read_trial(folder + '/trial.bag'), 'turn',
                                 points_of('turn', TABLE))


class Strict(HTMLParser):
    """Reads the words and the tags of a page. Each element must be closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.words, self.tags = [], '', []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag not in ('meta', 'img', 'input'):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words += data


def test_a_criterion_that_is_not_met_leads_to_its_moment():
    seen = turned(81.0)
    seen.stimuli[0].begin = 0.4
    marks = marks_of('Bobby', seen)
    lost = [event for event in timeline_of(marks.observation, marks.verdicts)['marks']
            if event['kind'] == 'lost']
    assert lost and all(event['begin'] == pytest.approx(0.4, abs=0.01) for event in lost)
    assert '<a href="#t=0.4">Watch it</a>' in student_page(marks, 'IMU lab')
    marks.observation = None        # nothing was recorded
    assert 'Watch it' not in student_page(marks, 'IMU lab')


def shown(seen):
    """The timeline of the marks of an Observation."""
    return timeline_of(marks_of('', seen).observation, ())


def test_the_timeline_of_a_mark_shows_heading_commands_stimuli_and_starts():
    seen = turned(90.0)
    seen.stimuli[0].end = 0.9
    seen.stimuli.append(stimulus('x', 1.0, 1.5))
    seen.processes.append(NodeProcess(1.5))
    data, true = shown(seen), seen.truth
    heading = np.interp(true[:, 0], data['heading']['time'], data['heading']['columns'][0])
    assert heading == pytest.approx(np.degrees(true[:, 3]), abs=0.2)
    assert [row for row in data['commands'] if None not in row] == [
        pytest.approx(row, abs=0.001) for row in seen.commands]
    assert [(event['kind'], event['begin'], event['text']) for event in data['marks']] == [
        ('hand', 0.0, 'l'), ('start', 0.0, 'the node is started'), ('hand', 1.0, 'x'),
        ('start', 1.5, 'the node is started')]


def test_the_drives_of_a_mark_are_in_their_drive_states():
    """The frame of the second drive stands at (1, 2) in the world, turned by 90 degrees."""
    first = {'goal': stimuli.GOAL, 'local_T_world': [0.0, 0.0, 0.0]}
    second = {'goal': [4.0, 5.0, 0.0], 'local_T_world': [-2.0, 1.0, -math.pi / 2.0]}
    data = shown(observation(
        'move2goal',
        truth=[[0.0, 0.0, 0.0, 0.0], [0.2, 0.1, 0.0, 0.1], [0.4, 0.2, 0.05, 0.5], [1.6, 1.0, 2.0, 0.0],
               [1.8, 1.0, 2.2, 2.0]],
        stimuli=[stimulus('first', 0.0, 0.5, facts=first), stimulus('none', 0.6, 0.7),
                 stimulus('second', 1.6, 1.9, facts=second)]))
    x, y, yaw = data['local']['columns']
    assert data['local']['time'] == pytest.approx([0.0, 0.2, 0.4, 1.6, 1.8])
    assert x == pytest.approx([0.0, 0.1, 0.2, 0.0, 0.2], abs=0.002)
    assert y == pytest.approx([0.0, 0.0, 0.05, 0.0, 0.0], abs=0.002)
    assert yaw[-1] == pytest.approx(math.degrees(2.0) - 90.0, abs=0.2)
    assert [goal for _, _, goal in data['goals']] == [list(stimuli.GOAL)] * 2 + [second['goal']]


def test_the_table_of_marks():
    def verdict(name, outcome, worth, extra=True):
        place = SheetStep('imu_lab.md', 'Lab')
        return Verdict(Criterion(name, '', name, place, lambda seen: '', is_extra=extra), outcome, '', worth)
    verdicts = [verdict('one', Outcome.MET, 1.5, False), verdict('two', Outcome.NOT_OFFERED, 2, False),
                verdict('more', Outcome.MET, 0.5), verdict('free', Outcome.MET, 0), verdict('freer', Outcome.MISSED, 0)]
    text = MarksTable().renewed_text([Marks('Bobby', 'lab2/n.py', '17', True, ['Hm.'], verdicts=verdicts)])
    row, = csv.DictReader(io.StringIO(text))
    assert row == {'student': 'Bobby', 'points': '2', 'of': '3.5', 'one': '1.5', 'two': '0',
                   'extra_more': '0.5', 'extra_free': 'yes', 'extra_freer': 'no',
                   'node': 'lab2/n.py', 'remarks': 'Hm.', 'id': '17', 'late': 'late',
                   'decided': '', 'reason': ''}


def test_marks_do_not_depend_on_what_a_node_holds(monkeypatch):
    """If the code of a check raises an exception, the student loses nothing, and the instructor reads why."""
    monkeypatch.setattr(marks, 'find_first_mistake', lambda *_: [][0])
    seen = turned(45.0)
    given = marks_after_trial(Marks('Ann'), seen, 'turn', points_of('turn', TABLE))
    assert given.first_mistake is None and given.verdicts and [
        finding for finding in given.findings if 'inside' in finding] == [
            'The marker could not look inside the node (IndexError: list index out of range).']
