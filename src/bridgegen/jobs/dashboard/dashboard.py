"""A dashboard: what a project's results say together, and the page that shows it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from bridgegen.base.disk import refuse_other
from bridgegen.base.errors import FileFormatError
from bridgegen.engine.options import called_with
from bridgegen.jobs.dashboard.crash_types import CrashTypes, crash_types
from bridgegen.jobs.dashboard.modes import (
    OpenMode,
    contradictions,
    decisions_of,
    failure_modes,
    undecided,
    unseen,
)
from bridgegen.jobs.dashboard.odd import Coverage, coverage
from bridgegen.jobs.dashboard.options import DashboardOptions
from bridgegen.jobs.dashboard.project import Project, read_project
from bridgegen.jobs.dashboard.requirements import Matrix, matrices
from bridgegen.jobs.dashboard.results import Result, current
from bridgegen.jobs.dashboard.trends import Series, trends
from bridgegen.jobs.dashboard.verdicts import is_rare, standings
from bridgegen.jobs.frame import Judged, Table
from bridgegen.results.failures import (
    FILE,
    OLD_FILE,
    Failure,
    FailureFile,
    read_failures,
    read_old_file,
    write_failures,
)
from bridgegen.scenario.language.criteria import Criterion, read_criterion

PAGE = "dashboard.html"
GENERATOR = "bridgegen dashboard"

MOST_LINES = 12
"""Largest number of failure modes, of problems and of notes that the terminal shows."""


@dataclass(frozen=True)
class Dashboard:
    """What the results of a project say together.

    Attributes:
        project: all that was found.
        page: path of the page.
        own: the blocks of ``failures.yaml`` in the folder, by id.
        status_path: path of ``failures.yaml`` in the folder.
        modes: all failure modes, those that fail now first.
        requirements: a matrix for each driver.
        declared: the requirements that are named for the project.
        trends: a series for each scenario or suite, and driver.
        coverage: of the taxonomy, and by parameter.
        added: number of failure modes that were added to the file.
        notes: what the person should know of the files of decisions.
    """

    project: Project
    page: Path
    own: Mapping[str, Failure]
    status_path: Path
    modes: tuple[OpenMode, ...]
    requirements: tuple[Matrix, ...]
    declared: tuple[Criterion, ...]
    trends: tuple[Series, ...]
    coverage: Coverage
    added: int = 0
    notes: tuple[str, ...] = ()

    @cached_property
    def failing(self) -> tuple[OpenMode, ...]:
        """The failure modes that current results have."""
        return tuple(mode for mode in self.modes if mode.fails_now)

    @cached_property
    def rare(self) -> tuple[Result, ...]:
        """The current results that fail in fresh random draws alone."""
        return tuple(filter(is_rare, current(self.project.results)))

    @cached_property
    def regressions(self) -> tuple[OpenMode, ...]:
        """Those of them that are called fixed."""
        return tuple(mode for mode in self.failing if mode.is_regression)

    @cached_property
    def unseen(self) -> dict[str, Failure]:
        """The blocks of the folder about modes that no result has, by id."""
        return unseen(self.modes, self.own)

    @cached_property
    def criteria(self) -> tuple[Criterion, ...]:
        """All requirements, the gravest first."""
        if self.requirements:
            return self.requirements[0].requirements
        return self.declared

    @cached_property
    def violated(self) -> dict[str, list[tuple[Matrix, list[str]]]]:
        """By violated requirement, the drivers that violate it, each with the scenarios."""
        found: dict[str, list[tuple[Matrix, list[str]]]] = {}
        for criterion in self.criteria:
            some = [(each, each.violated(criterion.id)) for each in self.requirements]
            if any(names for _, names in some):
                found[criterion.id] = [(each, names) for each, names in some if names]
        return found

    @cached_property
    def untested(self) -> list[str]:
        """The ids of the requirements that no driver is tested by with a result."""
        found = [set(requirement.untested) for requirement in self.requirements]
        return [
            criterion.id
            for criterion in self.criteria
            if all(criterion.id in each for each in found)
        ]

    @cached_property
    def without_requirement(self) -> list[str]:
        """The scenarios that test no requirement with any driver."""
        tested = {name for requirement in self.requirements for name, _ in requirement.cells}
        return [name for name in self.scenarios if name not in tested]

    @cached_property
    def scenarios(self) -> list[str]:
        """The names of all scenarios that were tested."""
        return sorted({result.scenario for result in self.project.results})

    @cached_property
    def drivers(self) -> list[str]:
        """The labels of all drivers, each version by itself."""
        return sorted({result.driver.label for result in self.project.results})

    @cached_property
    def crash_types(self) -> CrashTypes | None:
        """How drivers stand in the types of crashes; None where few scenarios were tried."""
        return crash_types(standings(self.project.results, self.failing))

    @property
    def weighed(self) -> list[str]:
        """In which types of crashes drivers fail, in words; nothing where few were tried."""
        types = self.crash_types
        if types is None:
            return []
        return [*map(types.sentence, types.drivers[:MOST_LINES]), types.limits]

    @property
    def work(self) -> str:
        """How much was read."""
        return f"{sum(result.evaluations for result in self.project.results):,} evaluations"

    def to_json(self) -> Any:
        """Return figures, failure modes, notes and problems as JSON's types."""
        return {
            "page": str(self.page),
            "figures": self.figures,
            "added": self.added,
            "modes": [
                {
                    "id": mode.key.id,
                    "status": mode.status,
                    "comment": mode.comment,
                    "decided": mode.decided,
                    "fails_now": mode.fails_now,
                    "regression": mode.is_regression,
                    "scenario": mode.key.scenario,
                    "driver": mode.key.driver,
                    "title": mode.title,
                    "evaluations": mode.count,
                    "severity": mode.severity,
                    "results": [result.source for result in mode.results],
                }
                for mode in self.modes
            ],
            "notes": list(self.notes),
            "problems": [
                {"place": problem.place, "why": problem.why} for problem in self.project.problems
            ],
        }

    def shown(self) -> list[str | Table]:
        """Return what fails now, in two sentences and by failure mode; then the files."""
        from bridgegen.jobs.dashboard.sentences import failing_sentence, requirements_sentence

        lines: list[str | Table] = [failing_sentence(self)]
        if words := requirements_sentence(self):
            lines.append(words)
        lines += self.weighed
        for mode in self.failing[:MOST_LINES]:
            status = "regression" if mode.is_regression else mode.status
            of = f"{mode.key.scenario}, {mode.key.driver}: {mode.title}"
            lines.append(f"  {status:<11}{mode.key.id}  {of}")
        if len(self.failing) > MOST_LINES:
            lines.append(f"  and {len(self.failing) - MOST_LINES:,} more")
        problems = self.project.problems
        lines += [
            f"  not read    {problem.place}: {problem.why}" for problem in problems[:MOST_LINES]
        ]
        if len(problems) > MOST_LINES:
            lines.append(f"  and {len(problems) - MOST_LINES:,} more are not read")
        lines += [f"{'note':<12}{note}" for note in self.notes[:MOST_LINES]]
        if self.added:
            lines.append(f"{'statuses':<12}{self.status_path}: {self.added:,} added as new")
        return [*lines, f"{'page':<12}{self.page}"]

    def judged(self) -> list[Judged]:
        """Return whether all results could be read, and the figures."""
        problems = self.project.problems
        return [
            Judged(
                suite=str(self.page),
                group="bridgegen.dashboard",
                test="all results are read",
                holds=not problems,
                details="; ".join(
                    f"{problem.place}: {problem.why}" for problem in problems[:MOST_LINES]
                )
                or self.work,
                figures=self.figures,
                facts={},
                missing="problems",
            )
        ]

    @cached_property
    def figures(self) -> dict[str, float]:
        """The figures that ``--fail-if`` judges, see `bridgegen.jobs.dashboard.options`."""
        failing = [mode.status for mode in self.failing]
        project = self.project
        return {
            "new": failing.count("new"),
            "known": failing.count("known"),
            "accepted": failing.count("accepted"),
            "fixed": sum(mode.status == "fixed" and not mode.fails_now for mode in self.modes),
            "regressions": len(self.regressions),
            "failing": len(failing),
            "worst_severity": max((mode.severity for mode in self.failing), default=0.0),
            "requirements": len(self.criteria),
            "violated_requirements": len(self.violated),
            "untested_requirements": len(self.untested),
            "scenarios_without_requirement": len(self.without_requirement),
            "runs": len(project.runs),
            "suites": len(project.suites),
            "maps": len(project.maps),
            "comparisons": len(project.comparisons),
            "scenarios": len(self.scenarios),
            "drivers": len(self.drivers),
            "evaluations": sum(result.evaluations for result in project.results),
            "problems": len(project.problems),
        }


@called_with(DashboardOptions)
def build_dashboard(given: DashboardOptions) -> Dashboard:
    """Read all results below a folder, and write one page that shows them together.

    Returns:
        What the results say together.

    Raises:
        StorageError: there are no results; or the page or the file cannot be written, or another
            file is where the page is to be.
        InputError: ``failures.yaml`` in the folder or a requirement breaks a rule; with ``update``,
            any ``failures.yaml``.
    """
    from bridgegen.jobs.dashboard.page import write_page

    folder, update = Path(given.folder), given.update
    page = folder / PAGE if given.out is None else Path(given.out)
    file, old = read_failures(folder), read_old_file(folder)
    declared = tuple(map(read_criterion, given.criteria))
    # Before the results are read, which may take long.
    refuse_other(page, GENERATOR, "dashboard")
    project = read_project(
        folder,
        lambda number, total: given.callbacks.progress("folders", number, total, ""),
        given.odd if isinstance(given.odd, Mapping) else None,
    )
    if update and (
        damaged := [problem.why for problem in project.problems if problem.place.endswith(FILE)]
    ):
        raise FileFormatError(*damaged)  # it may name modes that seem to be new
    found = dashboard_of(project, page, file, old, declared)
    # Without --update nothing is written but the page, so that a nightly job leaves the working
    # tree clean.
    new = {} if not update else undecided(found.modes, found.own)
    # Also what an earlier version's file holds: it moves to the new file at the first update.
    moved = {id: failure for id, failure in old.items() if id not in file.failures}
    if update and (new or moved):
        write_failures(file, {**moved, **new})
    if old:
        note = _note(folder / OLD_FILE, moved=bool(moved), update=update)
        found = replace(found, notes=(*found.notes, note))
    found = replace(found, added=len(new), status_path=folder / FILE)
    write_page(found)
    return found


def dashboard_of(
    project: Project,
    page: Path,
    file: FailureFile,
    old: Mapping[str, Failure],
    declared: tuple[Criterion, ...] = (),
) -> Dashboard:
    """Return what the results of a project say together; nothing is written.

    Args:
        project: with all that was read.
        page: path of the page.
        file: the statuses of the project's folder.
        old: those of a file of an earlier version.
        declared: requirements that are named for the project.
    """
    # The newer file counts where both name a failure mode.
    own = {**old, **file.failures}
    modes = failure_modes(project.results, decisions_of(own, project))
    return Dashboard(
        project,
        page,
        own,
        file.path,
        tuple(modes),
        tuple(matrices(project.results, declared)),
        declared,
        tuple(trends(project.runs, project.suites)),
        coverage(project.results, project.sceneries),
        notes=tuple(contradictions(modes, own)),
    )


def _note(old: Path, *, moved: bool, update: bool) -> str:
    """Return what to do with a file of an earlier version."""
    if moved and not update:
        return f"{old} is read, too: --update copies its statuses and notes to {FILE}"
    return (
        f"{old}: its statuses and notes are in {FILE}, which counts; move its comments there, and "
        "remove it"
    )
