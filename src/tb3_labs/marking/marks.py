"""What a submission earned."""
import csv
from dataclasses import dataclass, field
from typing import Optional

from tb3_labs.marking.criteria import Outcome
from tb3_labs.marking.observation import Observation


@dataclass
class Marks:
    """One submission: its verdicts, and what there is to say about it besides."""

    student: str
    node: str = ''                   # package/file
    verdicts: list = field(default_factory=list)
    remarks: list = field(default_factory=list)      # sentences
    observation: Optional[Observation] = None    # None: nothing could be observed
    failed: bool = False             # by no fault of the submission, as far as is known

    @property
    def points(self):
        """What was earned, by extra criteria too."""
        return sum(verdict.points for verdict in self.verdicts)

    @property
    def worth(self):
        """What the handout's criteria are worth together."""
        return sum(verdict.worth for verdict in self.graded)

    @property
    def graded(self):
        """The verdicts on the handout's criteria."""
        return [verdict for verdict in self.verdicts if not verdict.criterion.extra]

    @property
    def extra(self):
        """The verdicts on criteria beyond the handout."""
        return [verdict for verdict in self.verdicts if verdict.criterion.extra]


def write_csv(all_marks, path):
    """One row for each submission; of extra criteria without points it says whether they are
    met."""
    with open(str(path), 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file, lineterminator='\n')
        some = all_marks[0]
        writer.writerow(['student', 'points', 'of'] + [v.criterion.name for v in some.graded]
                        + ['extra_' + v.criterion.name for v in some.extra] + ['node', 'remarks'])
        for marks in all_marks:
            writer.writerow(
                [marks.student, '{:g}'.format(marks.points), '{:g}'.format(marks.worth)]
                + ['{:g}'.format(v.points) for v in marks.graded]
                + ['{:g}'.format(v.points) if v.worth else
                   'yes' if v.outcome is Outcome.MET else 'no' for v in marks.extra]
                + [marks.node, ' '.join(marks.remarks)])
