"""The marks of a submission."""
from dataclasses import dataclass, field
from typing import List, Optional

from tb3_labs.marking.criteria import Verdict
from tb3_labs.marking.observation import Observation


#: The words for marks that could not be given.
NOT_JUDGED = 'not judged'


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
    lacking: List[str] = field(default_factory=list)      # modules that this machine lacks
    late: str = ''                   # a sentence if it was handed in after it was due
    seconds: float = 0.0             # it took so long to mark

    @property
    def judged(self) -> bool:
        """Are these marks of what was handed in? Marks that could not be given are no zero."""
        return not self.failed

    @property
    def sentences(self) -> List[str]:
        """All remarks, that it is late too."""
        return [self.late] * bool(self.late) + self.remarks

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
