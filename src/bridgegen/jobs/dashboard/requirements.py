"""Requirements × scenarios: which are met, violated, or not tested, by each driver."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from bridgegen.jobs.dashboard.results import Judged, Result, current
from bridgegen.scenario.language.criteria import Criterion

Verdict = Literal["met", "violated", "unknown", "not tested"]

_GRAVITY = ("critical", "major", "minor")


@dataclass(frozen=True)
class Cell:
    """A requirement in a scenario.

    Attributes:
        met: number of evaluations that meet it.
        violated: number of those that violate it.
        worst: the least margin; None where there is none.
        unit: of the margin.
        page: of the result that violates it the most, else of the latest; "" if there is none.
    """

    met: int = 0
    violated: int = 0
    worst: float | None = None
    unit: str = "1"
    page: str = ""

    @property
    def verdict(self) -> Verdict:
        """What the evaluations say."""
        if self.violated:
            return "violated"
        return "met" if self.met else "unknown"


@dataclass(frozen=True)
class Matrix:
    """The requirements of a driver, by its current results.

    Attributes:
        driver: its name, without the version.
        labels: of the versions that the results are of.
        requirements: all of the project, the gravest first.
        scenarios: that the driver was tested in.
        cells: by scenario and id of the requirement; absent: not tested.
    """

    driver: str
    labels: tuple[str, ...]
    requirements: tuple[Criterion, ...]
    scenarios: tuple[str, ...]
    cells: dict[tuple[str, str], Cell]

    def cell(self, scenario: str, requirement: str) -> Cell | None:
        """Return a cell; None where the requirement is not tested."""
        return self.cells.get((scenario, requirement))

    def violated(self, requirement: str) -> list[str]:
        """Return the scenarios in which a requirement is violated."""
        return [
            name
            for name in self.scenarios
            if (cell := self.cell(name, requirement)) and cell.verdict == "violated"
        ]

    @property
    def without(self) -> list[str]:
        """The scenarios that test no requirement."""
        tested = {name for name, _ in self.cells}
        return [name for name in self.scenarios if name not in tested]

    @property
    def untested(self) -> list[str]:
        """The ids of the requirements that no scenario tests with a result."""
        tested = {name for (_, name), cell in self.cells.items() if cell.verdict != "unknown"}
        return [requirement.id for requirement in self.requirements if requirement.id not in tested]


def matrices(results: Sequence[Result], declared: Iterable[Criterion] = ()) -> list[Matrix]:
    """Return a matrix for each driver, in the order of names.

    Args:
        results: of the project.
        declared: requirements that the project has, whether they are tested or not.
    """
    known = {criterion.id: criterion for criterion in declared}
    for result in results:
        for judged in result.judged:
            known.setdefault(judged.criterion.id, judged.criterion)
    order = sorted(
        known.values(), key=lambda criterion: (_GRAVITY.index(criterion.severity), criterion.id)
    )
    by_driver: dict[str, list[Result]] = {}
    for result in current(results):
        by_driver.setdefault(result.driver.name, []).append(result)
    return [
        Matrix(
            name,
            tuple(dict.fromkeys(result.driver.label for result in some)),
            tuple(order),
            tuple(sorted({result.scenario for result in some})),
            _cells(some),
        )
        for name, some in sorted(by_driver.items())
    ]


def statements(results: Iterable[Result]) -> dict[str, list[str]]:
    """Return all formulas of each requirement, by its id; they should be one."""
    found: dict[str, dict[str, None]] = {}
    for result in results:
        for judged in result.judged:
            found.setdefault(judged.criterion.id, {})[judged.criterion.states] = None
    return {name: list(some) for name, some in found.items()}


def _cells(results: Iterable[Result]) -> dict[tuple[str, str], Cell]:
    found: dict[tuple[str, str], Cell] = {}
    for result in results:
        for judged in result.judged:
            key = (result.scenario, judged.criterion.id)
            found[key] = _joined(found.get(key), judged, result.page)
    return found


def _joined(cell: Cell | None, judged: Judged, page: str) -> Cell:
    if cell is None:
        return Cell(judged.met, judged.violated, judged.worst, judged.unit, page)
    worse = judged.worst is not None and (cell.worst is None or judged.worst < cell.worst)
    return Cell(
        cell.met + judged.met,
        cell.violated + judged.violated,
        judged.worst if worse else cell.worst,
        cell.unit,
        page if worse or not cell.page else cell.page,
    )
