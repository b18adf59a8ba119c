"""A suite's results in words, and in points of Euro NCAP's protocol."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from bridgegen.base.units import percent
from bridgegen.jobs.suite.clauses import ClauseResult
from bridgegen.jobs.suite.difference import Change, Difference
from bridgegen.jobs.suite.results import (
    OUTCOMES,
    EntryResult,
    GridResult,
    RowResult,
    Verdict,
    counts,
)

# --- Points of a matrix's rows by the colours of Euro NCAP's protocol of 2026 ---
# Source: Euro NCAP, Crash Avoidance protocol, Frontal Collisions, 1.1 (2025), sections 4.2.4, 5.2
# and # 5.3. The bands are pictures there; they are taken from Euro NCAP's own rating calculator
# (euroncap_rating_2026, Apache-2.0), and agree with the protocol's example (60 km/h, 4.2.4).


Colour = Literal["green", "yellow", "orange", "brown", "red"]

SUB_SCORES: dict[Colour, float] = {
    "green": 1.0,
    "yellow": 0.75,
    "orange": 0.5,
    "brown": 0.25,
    "red": 0.0,
}
"""Sub-scores by colour. Source: section 5.3.1."""

KMH = 3.6

_ROUNDING = 1e-6
"""Tolerance by which a speed may exceed a limit and be within it [km/h]."""

_BANDS: tuple[tuple[float, tuple[tuple[float, Colour], ...]], ...] = (
    (50.0, ((10.0, "yellow"), (20.0, "orange"), (30.0, "brown"))),
    (40.0, ((10.0, "orange"), (20.0, "brown"))),
    (30.0, ((10.0, "brown"),)),
)
"""Colours by test speed [km/h] from which, and relative impact speed [km/h] up to which they
hold."""

_REDUCTIONS: tuple[tuple[float, Colour], ...] = ((10.0, "red"), (20.0, "orange"))
"""Colours by reduction of the ego's speed [km/h] up to which they hold; above, green."""


def colour_of(row: RowResult, score: str) -> Colour | None:
    """Return the colour of a row; None if it has no result, or is not rated.

    Args:
        row: of a matrix.
        score: of its grid, see `bridgegen.scenario.language.protocols.Score`.
    """
    if row.problem or not score:
        return None
    if score == "avoidance":
        return "green" if row.collisions == 0.0 else "red"
    if row.outcome == "avoided":
        return "green"
    if score == "speed reduction":
        return _within(row.speed_reduction * KMH, _REDUCTIONS, "green")
    if score == "relative impact speed":
        speed = (row.impact_speed + row.speed_reduction) * KMH
        bands = next((some for least, some in _BANDS if speed >= least - _ROUNDING), ())
        return _within(row.relative_impact_speed * KMH, bands, "red")
    return "red"  # by the impact speed, avoided or not


def _within(value: float, bands: Iterable[tuple[float, Colour]], beyond: Colour) -> Colour:
    return next((colour for limit, colour in bands if value <= limit + _ROUNDING), beyond)


def grid_of(result: EntryResult, row: RowResult) -> GridResult | None:
    """Return the grid that a row belongs to; None if its entry has no matrix."""
    return next((grid for grid in result.grids if row.x and row.x[0] == grid.label), None)


def colours_of(result: EntryResult) -> list[Colour | None]:
    """Return the colour of each row of an entry."""
    grids = [grid_of(result, row) for row in result.rows]
    return [colour_of(r, g.score if g else "") for r, g in zip(result.rows, grids, strict=True)]


@dataclass(frozen=True)
class Points:
    """What some entries reach of the points of an edition.

    Attributes:
        edition: of the protocol.
        reached: sum over grids: its points, times the mean sub-score of its rows.
        most: sum of the grids' points.
    """

    edition: str
    reached: float
    most: float


def points_of(results: Iterable[EntryResult]) -> tuple[Points, ...]:
    """Return what entries reach of each edition's points, by edition; of one ego.

    A row without a result counts as red. The protocol's further steps (verification tests, the
    thresholds of extended ranges, robustness layers) are not applied.
    """
    found: dict[str, tuple[float, float]] = {}
    for result in results:
        colours = colours_of(result)
        for grid in result.grids:
            if not grid.score:
                continue
            of_it = [
                colour
                for row, colour in zip(result.rows, colours, strict=True)
                if row.x and row.x[0] == grid.label
            ]
            scores = [_sub_score(colour, grid) for colour in of_it]
            reached, most = found.get(grid.edition, (0.0, 0.0))
            mean = sum(scores) / len(scores) if scores else 0.0
            found[grid.edition] = (reached + grid.points * mean, most + grid.points)
    return tuple(Points(edition, *found[edition]) for edition in sorted(found))


def _sub_score(colour: Colour | None, grid: GridResult) -> float:
    if colour is None:
        return 0.0
    return SUB_SCORES[colour] if grid.graded else float(colour != "red")


MOST_DIFFERENCES = 4
"""Largest number of kinds of differences that a sentence names."""

_WORD: dict[Verdict, str] = {
    "failed": "fails",
    "passed": "passes",
    "not judged": "is not judged",
    "not run": "did not run",
    "flaky": "is flaky",
}


def headline(results: Sequence[EntryResult], label: str) -> str:
    """Return what an ego passes of its entries, as a sentence without an end.

    Args:
        results: with one ego.
        label: how the ego is called.
    """
    n, rows = len(results), sum(len(result.rows) for result in results)
    number = Counter(result.verdict for result in results)
    of = f"all {n:,} scenarios" if number["passed"] == n > 1 else f"{number['passed']:,} of {n:,}"
    if not of.startswith("all"):
        of += " scenario" if n == 1 else " scenarios"
    if rows > n:
        passed = counts(results)["passed"]
        share = f"{rows:,}" if passed == rows else f"{passed:,} of {rows:,}"
        of += f" ({share} variations)"
    some = label.startswith("the scenarios'")
    words = f"{label[:1].upper() + label[1:] if some else label} pass{'' if some else 'es'} {of}"
    if number["failed"]:
        words += f" and fail{'' if some else 's'} {number['failed']:,}"
    partly = sum(result.verdict == "not run" and result.count("passed") > 0 for result in results)
    unjudged = number["not judged"]
    said = [f"{unjudged:,} {'is' if unjudged == 1 else 'are'} not judged"] if unjudged else []
    said += [f"{number['flaky']:,} flaky"] if number["flaky"] else []
    lost = [f"{number['not run'] - partly:,} did not run"] if number["not run"] > partly else []
    lost += [f"{partly:,} ran only in part"] if partly else []
    return "; ".join([words, *said, *lost])


def outcomes(results: Sequence[EntryResult]) -> str:
    """Return in how many variations with a result an ego avoids a collision, as a sentence.

    Empty if it touches nothing in any.
    """
    number = Counter(row.outcome for each in results for row in each.rows if row.outcome)
    n = number.total()
    if number["avoided"] == n:
        return ""
    hit = [row for each in results for row in each.rows if row.outcome in OUTCOMES[1:]]
    speeds = [result.impact_speed for result in hit]
    mean, slowed = sum(speeds) / len(speeds), number["mitigated"]
    return (
        f"Collisions: {len(hit):,} of {n:,} ({percent(len(hit) / n)}), {slowed:,} of them after "
        f"slowing down; impact {mean:.1f} m/s on average, {max(speeds):.1f} m/s at most"
    )


def points(results: Sequence[EntryResult]) -> str:
    """Return what an ego reaches of a matrix's points, as a sentence; empty without points."""
    found = points_of(results)
    parts = [f"{item.reached:.2f} of {item.most:.2f} ({item.edition})" for item in found]
    return f"Points by colour: {', '.join(parts)}" if parts else ""


def clause_in_words(clause_result: ClauseResult) -> str:
    """Return what an ego makes of a clause: "3 of 101 fail, 2 collisions not preventable" say."""
    n = clause_result.passed + clause_result.failed
    parts = (
        [f"{clause_result.failed:,} of {n:,} fail"]
        if clause_result.failed
        else [f"pass ({n:,})"]
        if n
        else []
    )
    if clause_result.unpreventable:
        some = "collision" if clause_result.unpreventable == 1 else "collisions"
        parts.append(f"{clause_result.unpreventable:,} {some} not preventable")
    parts += [f"{clause_result.not_run:,} not run"] if clause_result.not_run else []
    parts += (
        [f"{clause_result.not_applicable:,} not applicable"] if clause_result.not_applicable else []
    )
    return ", ".join(parts)


def difference(verdicts: Sequence[Verdict], labels: Sequence[str]) -> str:
    """Return how egos differ in an entry, in words; empty if they do not."""
    if len(set(verdicts)) <= 1:
        return ""
    who: dict[Verdict, list[str]] = {}
    for verdict, label in zip(verdicts, labels, strict=True):
        who.setdefault(verdict, []).append(label)
    for verdict in ("failed", "passed"):
        alone = who.get(verdict, [])
        if len(who) == 2 and "failed" in who and "passed" in who and len(alone) == 1:
            return f"only {alone[0]} {_WORD[verdict]}"
    parts = [
        f"{', '.join(who[verdict])} {_of_many(_WORD[verdict], len(who[verdict]))}"
        for verdict in ("failed", "flaky", "passed", "not judged", "not run")
        if verdict in who
    ]
    return "; ".join(parts)


def differences(of_entries: Sequence[Sequence[Verdict]], labels: Sequence[str]) -> str:
    """Return in how many entries egos agree and differ, as a sentence; empty for one ego."""
    if len(labels) < 2:
        return ""
    two = len(labels) == 2
    same = Counter(entry[0] for entry in of_entries if len(set(entry)) == 1)
    differ = Counter(words for entry in of_entries if (words := difference(entry, labels)))
    often = differ.most_common(MOST_DIFFERENCES)
    rest = sum(differ.values()) - sum(count for _, count in often)
    parts = [f"in {count:,} {words}" for words, count in often]
    parts += [f"in {rest:,} they differ otherwise"] if rest else []
    if same["failed"]:
        parts.append(f"{'both' if two else 'all'} fail {same['failed']:,}")
    if same["passed"]:
        parts.append(f"{'both' if two else 'all'} pass {same['passed']:,}")
    if same["not judged"]:
        parts.append(f"{'neither' if two else 'none'} is judged in {same['not judged']:,}")
    if same["not run"]:
        parts.append(f"{'neither' if two else 'none'} ran in {same['not run']:,}")
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _of_many(word: str, number: int) -> str:
    many = {
        "fails": "fail",
        "passes": "pass",
        "is not judged": "are not judged",
        "is flaky": "are flaky",
    }
    return many.get(word, word) if number > 1 else word


def changes(found: Difference) -> str:
    """Return what the second ego breaks and fixes with intervals; "" where there are none."""
    counts = found.counts
    n = len(found.rows) - counts["not comparable"]
    if not n:
        return ""
    verbs: dict[Change, str] = {"broken": "breaks", "fixed": "fixes"}
    words = []
    for change, verb in verbs.items():
        low, high = found.interval(change)
        words.append(f"{verb} {counts[change]:,} ({percent(low)} to {percent(high)})")
    if not found.sampled:
        return ""
    text = f"Of {n:,} variations, {found.second} {' and '.join(words)} against {found.first}"
    return f"{text} (95 % confidence; McNemar’s exact test: p = {found.p_value:.2g})."
