"""Marks that are kept in a file, so that a submission is tried once and judged by any points.

A record holds what json.dump() writes: the verdicts, without the observation they came from, and
the key of the try. The key tells whether another try could come to anything else.
"""
from dataclasses import fields
from typing import Any, Dict, Iterable, Mapping, Sequence

from tb3_labs.marking.criteria import Criterion, Outcome, Verdict
from tb3_labs.marking.marks import Marks

KEY, MARKS, VERDICTS = 'key', 'marks', 'verdicts'
#: Fields of Marks that a record does not hold as they are; VERDICTS is one of them.
LEFT_OUT = (VERDICTS, 'observation')


def to_record(marks: Marks, key: Mapping[str, Any]) -> Dict[str, Any]:
    """The record of these marks."""
    return {KEY: dict(key),
            MARKS: {item.name: getattr(marks, item.name) for item in fields(marks)
                    if item.name not in LEFT_OUT},
            VERDICTS: {verdict.criterion.name: [verdict.outcome.value, verdict.seen]
                       for verdict in marks.verdicts}}


def from_record(record: Mapping[str, Any], criteria: Iterable[Criterion],
                worth: Mapping[str, float], parts: Sequence[str] = ()) -> Marks:
    """The Marks of a record, with these points for each criterion.

    ``ValueError`` if it lacks a criterion of these parts, or is no record of this version.
    """
    try:
        marks = Marks(**record[MARKS])
        for criterion in criteria:
            if not parts or criterion.part in parts:
                outcome, seen = record[VERDICTS][criterion.name]
                marks.verdicts.append(Verdict(criterion, Outcome(outcome), seen,
                                              worth[criterion.name]))
    except (KeyError, TypeError) as problem:
        raise ValueError('the record lacks {}'.format(problem)) from None
    return marks
