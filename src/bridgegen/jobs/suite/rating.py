"""Points of a matrix's rows by the colours of Euro NCAP's protocol of 2026.

Source: Euro NCAP, Crash Avoidance protocol, Frontal Collisions, 1.1 (2025), sections 4.2.4, 5.2 and
5.3. The bands are pictures there; they are taken from Euro NCAP's own rating calculator
(euroncap_rating_2026, Apache-2.0), and agree with the protocol's example (60 km/h, 4.2.4).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from bridgegen.jobs.suite.results import EntryResult, GridResult, RowResult

Colour = Literal["green", "yellow", "orange", "brown", "red"]

SUB_SCORES: dict[Colour, float] = {
    "green": 1.0, "yellow": 0.75, "orange": 0.5, "brown": 0.25, "red": 0.0,
}  # fmt: skip
"""Section 5.3.1."""

KMH = 3.6

_ROUNDING = 1e-6
"""[km/h] By which a speed may exceed a limit and be within it."""

_BANDS: tuple[tuple[float, tuple[tuple[float, Colour], ...]], ...] = (
    (50.0, ((10.0, "yellow"), (20.0, "orange"), (30.0, "brown"))),
    (40.0, ((10.0, "orange"), (20.0, "brown"))),
    (30.0, ((10.0, "brown"),)),
)
"""From which test speed on [km/h]: up to which relative impact speed [km/h] which colour."""

_REDUCTIONS: tuple[tuple[float, Colour], ...] = ((10.0, "red"), (20.0, "orange"))
"""Up to which reduction of the ego's speed [km/h] which colour; above, green."""


def colour_of(row: RowResult, score: str) -> Colour | None:
    """Return the colour of a row; None if it has no result, or is not rated.

    Args:
        row: of a matrix.
        score: of its grid, see `bridgegen.scenario.language.matrix.Score`.
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
    return next((one for one in result.grids if row.x and row.x[0] == one.label), None)


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
