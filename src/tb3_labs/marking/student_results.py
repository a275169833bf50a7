"""The page of one student, and results.json, the same content for Gradescope.

The page shows the verdicts, and the timeline of the recorded trial. The page needs no other file.

In results.json the whole score is the sum of the tests' scores, unless a person gave other points.
An unjudged submission also gets a file, with the score 0 and the reason, because Gradescope would
call a missing file an error of the autograder.
Source: "Autograder Specifications", https://gradescope-autograders.readthedocs.io/en/latest/specs/.
"""
import math
from dataclasses import replace
from html import escape
from typing import Any, Dict, Sequence

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.labs.criteria import Outcome, Verdict
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.trial.observation import GOAL_POSE, LOCAL_T_WORLD, Observation
from tb3_labs.recording.run_data import Poses, RunData
from tb3_labs.report.page.document import Markup, document, hints_section, table
from tb3_labs.report.page.timeline import timeline_data, timeline_event, timeline_html
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS

MAX_SHOWN_LINES = 15            # a page shows only the last lines that a process printed
MAX_SHOWN_LINE_LENGTH = 300
SYMBOLS = {Outcome.MET: '\N{CHECK MARK}', Outcome.MISSED: '\N{BALLOT X}',
           Outcome.NOT_OFFERED: '\N{EN DASH}'}
COLOURS = {Outcome.MET: '#d9efd9', Outcome.MISSED: '#f6d5d0', Outcome.NOT_OFFERED: '#e4e4e4'}
SEEN_HEADING = 'what was seen, and where to look'
VISIBILITY = 'visible'      # Gradescope always shows the test to the student

PAGE_STYLE = '''
td.words { min-width: 20em; }
pre { font-size: 8pt; background: #f3f3f3; padding: 4px; white-space: pre-wrap;
      overflow-wrap: anywhere; }
'''


def student_page(marks: Marks, lab_title: str) -> str:
    """Returns a student's page as HTML."""
    blocks = _points_and_remarks(marks)
    observation = marks.observation
    has_timeline = observation is not None and len(observation.truth) > 0
    if not marks.unjudged:
        blocks.append(_verdict_table(marks.graded_verdicts, has_timeline))
        if marks.extra_verdicts:
            blocks += ['<h2>Beyond the handout</h2>',
                       _verdict_table(marks.extra_verdicts, has_timeline)]
    if observation is not None:
        if has_timeline:
            blocks += [timeline_html(timeline_of(observation, marks.verdicts)),
                       hints_section(marks.first_mistake, marks.mistake_sentence)]
        blocks += _last_lines(observation)
    return document(f'{lab_title}: {marks.student}', blocks, PAGE_STYLE)


def _points_and_remarks(marks):
    node = f'Node: {escape(marks.node)}.' if marks.node else ''
    sentences = []
    if marks.decided_points is not None:
        sentences.append(f'A person gave these points; the marker gave {marks.earned_points:g}.')
    if marks.decision_reason:
        sentences.append(marks.decision_reason)
    sentences += marks.sentences
    return [f'<p><b>{marks.points_text.capitalize()}.</b> {node}</p>',
            *(f'<p>{escape(sentence, quote=False)}</p>' for sentence in sentences)]


def timeline_of(observation: Observation, verdicts: Sequence[Verdict]) -> Dict[str, Any]:
    """Returns the timeline of a trial, with the stimuli and the missed criteria."""
    events = []
    for stimulus in observation.stimuli:
        kind = 'drive' if GOAL_POSE in stimulus.facts else 'hand'
        events.append(timeline_event(kind, stimulus.begin, stimulus.name, stimulus.end))
    events += [timeline_event('hand', begin, "the check's own movement of the robot", end)
               for begin, end in observation.marker_moves]
    events += [timeline_event('start', process.begin, 'the node is started')
               for process in observation.processes]
    events += [timeline_event('lost', verdict.moment, 'not met: ' + verdict.criterion.meaning)
               for verdict in verdicts
               if verdict.outcome is Outcome.MISSED and verdict.moment is not None]
    return timeline_data(_recording_for_timeline(observation), MODELS[DEFAULT_MODEL], events)


def _recording_for_timeline(observation: Observation) -> RunData:
    """Returns the recording of a trial, with poses in the frame ``local`` that are computed from
    the true poses. Each drive begins with a reset of this frame."""
    recording = observation.recording
    true_poses = recording.ground_truth
    drives = [stimulus for stimulus in observation.stimuli if GOAL_POSE in stimulus.facts]
    next_begins = [drive.begin for drive in drives[1:]] + [math.inf]
    local_poses, resets = [], []
    for drive, next_begin in zip(drives, next_begins):
        local_T_world = Pose2(*drive.facts[LOCAL_T_WORLD])
        local_poses.append(true_poses.between(drive.begin, next_begin).in_parent(local_T_world))
        first_pose = local_T_world @ true_poses.pose_at(drive.begin)
        resets.append([drive.begin, first_pose.x, first_pose.y, first_pose.yaw])
    local_pose = Poses.joined(local_poses) if drives else true_poses
    return replace(recording, name=observation.node, local_pose=local_pose,
                   resets=Poses.without_stamps(resets), frames=Poses.none())


def _verdict_table(verdicts, has_timeline):
    rows = []
    for verdict in verdicts:
        sentence = verdict.sentence
        if has_timeline and verdict.moment is not None and verdict.outcome is Outcome.MISSED:
            sentence = Markup(f'{escape(sentence)} <a href="#t={verdict.moment:.1f}">Watch it</a>')
        points = f'{verdict.points:g} / {verdict.full_points:g}' if verdict.full_points else ''
        rows.append([verdict.criterion.meaning, outcome_symbol(verdict), points, sentence])
    titles = ['what is asked', '', 'points', SEEN_HEADING]
    return table(titles, rows, text_columns=(SEEN_HEADING,), is_plain=True)


def outcome_symbol(verdict: Verdict) -> Markup:
    """Returns a coloured sign for the outcome of a verdict."""
    # the handout does not require an extra criterion, so the page does not blame the student
    is_missed_extra = verdict.criterion.is_extra and verdict.outcome is Outcome.MISSED
    shown_outcome = Outcome.NOT_OFFERED if is_missed_extra else verdict.outcome
    return Markup(f'<span class="verdict" style="background: {COLOURS[shown_outcome]}" '
                  f'title="{verdict.outcome.value}">{SYMBOLS[shown_outcome]}</span>')


def _last_lines(observation):
    blocks = ['<h2>What the node printed last</h2>']
    for number, process in enumerate(observation.processes, 1):
        lines = [line[:MAX_SHOWN_LINE_LENGTH]
                 for line in process.printed.splitlines() if line.strip()]
        text = '\n'.join(lines[-MAX_SHOWN_LINES:]) or '(nothing)'
        start = f'Start {number} of {len(observation.processes)}'
        if process.ready is None:
            start += ', never ready'
        blocks.append(f'<p>{start}</p><pre>{escape(text)}</pre>')
    return blocks


def results(marks: Marks) -> Dict[str, Any]:
    """Returns the content of results.json for Gradescope, with a test for each criterion. `output`
    contains the page without the criteria and the timeline."""
    blocks = [*_points_and_remarks(marks),
              hints_section(marks.first_mistake, marks.mistake_sentence, has_timeline=False)]
    if marks.observation is not None:
        blocks += _last_lines(marks.observation)
    score = round(float(marks.points), 2) if marks.has_known_points else 0.0
    verdicts = marks.graded_verdicts + marks.extra_verdicts if marks.has_known_points else []
    return {
        'score': score,
        'execution_time': int(round(marks.seconds)),
        'output': '\n'.join(blocks),
        'output_format': 'html',
        'visibility': VISIBILITY,
        'stdout_visibility': 'hidden',
        'tests': [_gradescope_test(number, verdict) for number, verdict in enumerate(verdicts, 1)],
        'extra_data': {'student': marks.student},
    }


def _gradescope_test(number, verdict):
    is_extra = verdict.criterion.is_extra
    return {
        'name': ('Beyond the handout: ' if is_extra else '') + verdict.criterion.meaning,
        'number': str(number),
        'score': verdict.points,
        'max_score': 0.0 if is_extra else verdict.full_points,
        'status': 'passed' if verdict.outcome is Outcome.MET else 'failed',
        'output': verdict.sentence,
        'visibility': VISIBILITY,
    }
