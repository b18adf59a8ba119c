"""What cleaning found and did: one finding per rule, so that nothing is dropped silently."""

from dataclasses import dataclass, field
from enum import Enum

MOST_EXAMPLES = 3


class Rule(Enum):
    """A rule of cleaning, in the order of its application; the value says what it does."""

    KIND = "kind told by box and speed"
    BOX = "box filled in by kind"
    OUTLIER = "single state off the path removed"
    SWAP = "track cut where two ids are swapped"
    JUMP = "track cut where it jumps"
    GAP_BRIDGED = "gap bridged"
    GAP_CUT = "track cut at a gap"
    SHORT = "piece of a track too short, dropped"
    MISFIT = "velocities are not those of the positions"
    SMOOTHED = "positions smoothed, velocities from them"
    VELOCITY = "velocity from positions"
    HEADING = "heading from motion"
    NO_HEADING = "heading unknown, taken as 0"
    ACCELERATION = "acceleration from speed"
    RESAMPLED = "resampled"


@dataclass
class Finding:
    """How often a rule applied.

    Attributes:
        rule: the rule.
        participants: number of participants of the recording to which it applied.
        count: number of times: of states (a state off the path, the states of a dropped piece, or
            those completed or smoothed), of gaps and cuts, of participants (kinds, boxes).
        examples: the first places.
    """

    rule: Rule
    participants: int = 0
    count: int = 0
    examples: list[str] = field(default_factory=list)


class Quality:
    """The findings of a recording, one per rule."""

    def __init__(self) -> None:
        self._findings = {rule: Finding(rule) for rule in Rule}
        self._last: dict[Rule, int] = {}

    def note(self, rule: Rule, participant: int, count: int, example: str) -> None:
        """Note that a rule applied to a participant, ``count`` times."""
        finding = self._findings[rule]
        finding.count += count
        if self._last.get(rule) != participant:
            finding.participants += 1
            self._last[rule] = participant
        if len(finding.examples) < MOST_EXAMPLES:
            finding.examples.append(example)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All rules' findings, those that never applied too."""
        return tuple(self._findings.values())

    def __getitem__(self, rule: Rule) -> Finding:
        return self._findings[rule]
