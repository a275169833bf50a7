"""The marks of one student as Gradescope reads them: results.json.

Source: "Autograder Specifications", https://gradescope-autograders.readthedocs.io/en/latest/specs/.
A test's score is a number, and the scores add up to that of the whole. Nothing is shown before the
instructor publishes the grades.
"""
from typing import Any, Dict, Sequence

from tb3_labs.marking.course import Row, scaled
from tb3_labs.marking.criteria import Outcome, Verdict
from tb3_labs.marking.marks import Marks

#: When a student sees the tests; whether a student sees what the marking printed.
VISIBILITY, STDOUT_VISIBILITY = 'after_published', 'hidden'
PASSED, FAILED = 'passed', 'failed'
TEXT = 'text'


def results(marks: Marks, rows: Sequence[Row] = ()) -> Dict[str, Any]:
    """What json.dump() writes; `rows`: of the course, whose first one is what full marks are worth.
    """
    factor = rows[0].points / marks.worth if rows and marks.worth else 1.0
    score = scaled(marks, rows[0].points) if rows else marks.points
    return {
        'score': round(float(score), 2),
        'execution_time': int(round(marks.seconds)),
        'output': '\n'.join(['Node: {}.'.format(marks.node)] * bool(marks.node) + marks.sentences),
        'output_format': TEXT,
        'test_output_format': TEXT,
        'test_name_format': TEXT,
        'visibility': VISIBILITY,
        'stdout_visibility': STDOUT_VISIBILITY,
        'tests': [_test(verdict, factor, str(number))
                  for number, verdict in enumerate(marks.graded + marks.extra, 1)],
        'extra_data': {'student': marks.student, 'late': bool(marks.late)},
    }


def _test(verdict: Verdict, factor: float, number: str) -> Dict[str, Any]:
    extra = verdict.criterion.extra
    return {
        'name': ('Beyond the handout: ' if extra else '') + verdict.criterion.meaning,
        'number': number,
        'score': round(verdict.points * factor, 4),
        'max_score': 0.0 if extra else round(verdict.worth * factor, 4),
        'status': PASSED if verdict.outcome is Outcome.MET else FAILED,
        'output': verdict.sentence,
        'visibility': VISIBILITY,
    }
