"""What cleaning found and did, and whether a recording is in the units of its format."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import CAR
from bridgegen.recordings.readers.table import RecordedTraffic

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


# --- Is a recording in the units and the frame that its format says? If not, it is refused ---


FASTEST = 100.0
"""Speed beyond that of any traffic [m/s]."""
LARGEST_SHARE = 0.05
"""Largest share of states that may be faster than `FASTEST`: ids jump, but not so often."""
WIDEST = 200_000.0
"""Largest extent of a recording [m]."""
CARS = (2.0, 9.0)
"""Range of the median length of cars [m]."""
AGREEMENT = 1.25
"""Largest factor between the given speeds and those of the positions (median)."""
# From state to state, 0.2 m of noise at 10 Hz made traffic that creeps seem to have wrong units,
# and a good recording was refused.
OVER = 1.0
"""Time over which positions are compared, so that their noise counts little [s]."""
LEAST_MOVING = 20  # states
MOVING = 1.0  # m/s
UNITS = {
    "km/h": 3.6,
    "mph": 2.23694,
    "ft/s": 3.28084,
    "positions in km": 1000.0,
    "positions in feet": 0.3048,
    "positions in cm": 0.01,
}
"""Ratios of the given speeds to those of the positions, by the wrong unit of one of both."""


def check(traffic: RecordedTraffic) -> None:
    """Refuse a recording in wrong units or mixed frames.

    Raises:
        FileFormatError: all rules that it breaks, each with a place.
    """
    problems = list(_problems(traffic))
    if problems:
        raise FileFormatError(*problems)


def _problems(traffic: RecordedTraffic) -> Iterator[str]:
    source = traffic.facts.source
    for name, values in (("x", traffic.x), ("y", traffic.y)):
        extent = float(np.ptp(values))
        if extent > WIDEST:
            far = int(np.argmax(np.abs(values - np.median(values))))
            yield (
                f"{traffic.where(far)}: the {name} of a recording may extend over "
                f"{WIDEST / 1000:g} km, got {extent / 1000:.4g} km: are two frames mixed?"
            )
    lengths = traffic.length[(traffic.kind == CAR) & np.isfinite(traffic.length)]
    if len(lengths) and not CARS[0] <= np.median(lengths) <= CARS[1]:
        yield (
            f"{source}: the median length of cars must be {CARS[0]:g} to {CARS[1]:g} m, got "
            f"{np.median(lengths):.4g}: in which unit are lengths?"
        )
    steps = np.diff(traffic.time)
    within = np.ones(len(steps), dtype=np.bool_)
    within[traffic.first[1:-1] - 1] = False
    distance = np.hypot(np.diff(traffic.x), np.diff(traffic.y))
    moved = np.divide(distance, steps, out=np.zeros_like(steps), where=within)
    fast = np.flatnonzero(moved > FASTEST)
    # A few jumps are a matter of cleaning; many mean that units or ids are wrong, which no rule
    # mends.
    if len(fast) > LARGEST_SHARE * max(int(within.sum()), 1):
        yield (
            f"{traffic.where(int(fast[0]) + 1)}: positions say {moved[fast[0]]:.4g} m/s, and "
            f"{len(fast) / within.sum():.0%} of them more than {FASTEST:g} m/s: are positions in "
            "metres, times in seconds, and ids those of one participant each?"
        )
        return
    moved, said = _over(traffic, max(1, round(OVER / max(traffic.facts.time_step, 1e-3))))
    if np.count_nonzero(moved > MOVING) < LEAST_MOVING:
        moved, said = _over(traffic, 1)
    at = np.flatnonzero((moved > MOVING) & np.isfinite(said))
    if len(at) < LEAST_MOVING:
        return
    # The median: some tracks may be wrong, the unit is one for all.
    ratio = float(np.median(said[at] / moved[at]))
    if not 1 / AGREEMENT <= ratio <= AGREEMENT:
        # By the ratio's logarithm, for twice and half are equally far off.
        unit = min(UNITS, key=lambda name: abs(np.log(max(ratio, 1e-9) / UNITS[name])))
        hint = f" ({unit}?)" if abs(ratio / UNITS[unit] - 1.0) < 0.1 else ""
        yield (
            f"{traffic.where(int(at[0]))}: speeds must be those of the positions, got {ratio:.4g} "
            f"times them (median of {len(at)} states){hint}"
        )


def _over(traffic: RecordedTraffic, lag: int) -> tuple[Float, Float]:
    """Return speeds over a number of states [m/s], ``(S - lag,)``: by the positions, and as given.

    The former is 0 where the states are of two participants, the latter NaN where one is unknown.
    """
    each = 0.5 * (traffic.speed[1:] + traffic.speed[:-1]) * np.diff(traffic.time)
    driven, unknown = (
        np.append(0.0, np.cumsum(array)) for array in (np.nan_to_num(each), np.isnan(each))
    )
    who = traffic.participant
    same = who[lag:] == who[:-lag]
    span = np.where(same, traffic.time[lag:] - traffic.time[:-lag], 1.0)
    distance = np.hypot(traffic.x[lag:] - traffic.x[:-lag], traffic.y[lag:] - traffic.y[:-lag])
    said = np.where(unknown[lag:] == unknown[:-lag], driven[lag:] - driven[:-lag], np.nan)
    return np.where(same, distance / span, 0.0), said / span
