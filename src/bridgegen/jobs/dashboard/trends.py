"""How results of a scenario, or of a suite, change over the versions of a driver."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from bridgegen.jobs.dashboard.results import Result, in_order
from bridgegen.jobs.dashboard.results_of import SuiteLine
from bridgegen.pages.templates import counted

Measure = Literal["harmful share", "failed variations"]

MOST_POINTS = 40
"""Largest number of points of a chart; the latest."""


@dataclass(frozen=True)
class Point:
    """A result in a chart.

    Attributes:
        driver: label of the version.
        version: of the driver, or the label where it is not known.
        source: folder of the result.
        page: of the result, or "".
        time: of the result [s since 1970].
        count: failing evaluations, of ``of``.
        of: evaluations from which the share is known.
        share: count / of, in [0, 1].
        low: lower end of its 95 % interval; the share itself where it is no estimate.
        high: its upper end.
    """

    driver: str
    version: str
    source: str
    page: str
    time: float
    count: int
    of: int
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class Series:
    """A chart.

    Attributes:
        title: the scenario; of a suite where its latest results are, and how many scenarios.
        driver: name of the driver, without version.
        measure: what is drawn.
        points: by time; the latest ``MOST_POINTS``.
        left_out: earlier points.
    """

    title: str
    driver: str
    measure: Measure
    points: tuple[Point, ...]
    left_out: int = 0

    @property
    def change(self) -> float:
        """Share of the last point less that of the one before; 0 where there is only one."""
        return self.points[-1].share - self.points[-2].share if len(self.points) > 1 else 0.0


def trends(runs: Sequence[Result], suites: Iterable[SuiteLine]) -> list[Series]:
    """Return a series for each scenario and driver, and for each suite and driver.

    Suites with the same entries are one over time. Those that grew last are first, then those with
    the largest share.
    """
    held: dict[tuple[str, str, Measure], list[Point]] = {}
    for run in in_order(runs):
        point = _of_run(run)
        if point is not None:
            key = (run.scenario, run.driver.name, _RUN)
            held.setdefault(key, []).append(point)
    in_time = sorted(suites, key=lambda line: (line.time, line.source))
    latest = {_entries(suite): suite.source for suite in in_time}
    for suite in in_time:
        entries = _entries(suite)
        title = f"{latest[entries]} ({counted(len(entries), 'scenario')})"
        for name, point in _of_suite(suite):
            held.setdefault((title, name, _SUITE), []).append(point)
    found = [
        Series(title, driver, measure, tuple(some[-MOST_POINTS:]), max(0, len(some) - MOST_POINTS))
        for (title, driver, measure), some in held.items()
    ]
    return sorted(
        found, key=lambda series: (-series.change, -series.points[-1].share, series.title)
    )


_RUN: Measure = "harmful share"
_SUITE: Measure = "failed variations"


def _entries(suite: SuiteLine) -> frozenset[str]:
    return frozenset(result.entry for result in suite.results)


def _of_run(run: Result) -> Point | None:
    """Return the point of a run; None of one whose harmful share is not known."""
    space = run.space
    if space is None or space.share is None:
        return None
    return Point(
        run.driver.label,
        _version(run),
        run.source,
        run.page,
        run.time,
        space.harmful,
        space.rows,
        space.share,
        space.low,
        space.high,
    )


def _version(result: Result) -> str:
    return result.driver.version or result.driver.label


def _of_suite(suite: SuiteLine) -> list[tuple[str, Point]]:
    found = []
    for label in suite.egos:
        some = [result for result in suite.results if result.driver.label == label]
        count, of = (
            sum(getattr(result, name) for result in some) for name in ("failed", "evaluations")
        )
        if of:
            share = count / of
            point = Point(
                label,
                _version(some[0]),
                suite.source,
                suite.page,
                suite.time,
                count,
                of,
                share,
                share,
                share,
            )
            found.append((some[0].driver.name, point))
    return found
