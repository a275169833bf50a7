"""The marks of a submission, and the table of all marks."""
import csv
from dataclasses import dataclass, field
from pathlib import Path
from typing import List, Optional, Sequence

from tb3_labs.marking.criteria import Outcome, Verdict
from tb3_labs.marking.observation import Observation


@dataclass
class Marks:
    """One submission: its verdicts, and remarks."""

    student: str
    node: str = ''                   # package/file
    verdicts: List[Verdict] = field(default_factory=list)
    remarks: List[str] = field(default_factory=list)      # sentences
    observation: Optional[Observation] = None  # None: nothing could be observed
    findings: List[str] = field(default_factory=list)     # for the instructor alone; sentences
    failed: bool = False             # it could not be judged, by no known fault of its own

    @property
    def points(self) -> float:
        """The points that were earned, by extra criteria too."""
        return sum(verdict.points for verdict in self.verdicts)

    @property
    def worth(self) -> float:
        """The points of all criteria of the handout together: full marks."""
        return sum(verdict.worth for verdict in self.graded)

    @property
    def graded(self) -> List[Verdict]:
        """The verdicts on the handout's criteria."""
        return [verdict for verdict in self.verdicts if not verdict.criterion.extra]

    @property
    def extra(self) -> List[Verdict]:
        """The verdicts on criteria beyond the handout."""
        return [verdict for verdict in self.verdicts if verdict.criterion.extra]


def write_csv(all_marks: Sequence[Marks], path: Path) -> None:
    """Write one row for each submission.

    The columns: student, points, of (full marks), the points for each criterion, node, remarks. A
    criterion beyond the handout has 'extra_' before its name, and 'yes' or 'no' if it is worth
    nothing.
    """
    with open(str(path), 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file, lineterminator='\n')
        some = all_marks[0]
        writer.writerow(['student', 'points', 'of']
                        + [v.criterion.label for v in some.graded + some.extra]
                        + ['node', 'remarks'])
        for marks in all_marks:
            writer.writerow(
                [marks.student, '{:g}'.format(marks.points), '{:g}'.format(marks.worth)]
                + ['{:g}'.format(v.points) for v in marks.graded]
                + ['{:g}'.format(v.points) if v.worth else
                   'yes' if v.outcome is Outcome.MET else 'no' for v in marks.extra]
                + [marks.node, ' '.join(marks.remarks)])
