"""A comparison from start to finish: make the missing runs, measure, test, draw, write."""

from collections.abc import Mapping
from pathlib import Path

from bridgegen.base.errors import Interrupted, StorageError
from bridgegen.engine.options import CommonOptions, called_with
from bridgegen.engine.workers import read_choice
from bridgegen.engine.workers.processes import cores
from bridgegen.jobs.compare.measures import counts, measure, measures
from bridgegen.jobs.compare.options import CompareOptions
from bridgegen.jobs.compare.page import write_page
from bridgegen.jobs.compare.plan import Cell, Plan, begin, make_plan
from bridgegen.jobs.compare.record import read, space_of, terms_of
from bridgegen.jobs.compare.result import Comparison
from bridgegen.jobs.compare.runs import RunsProgress, Task, evaluations_of, run_all
from bridgegen.jobs.compare.table import summarise, write_tables
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.results.store.sqlite import Lock
from bridgegen.scenario.language.space import SearchSpace

LOCK = "compare.lock"


@called_with(CompareOptions)
def compare(given: CompareOptions) -> Comparison:
    """Run algorithms on scenarios with several seeds, and test which is better in which measure.

    A grid of runs, each an ordinary run's folder under ``OUT/runs`` (``resume`` exports its
    critical scenarios); then ``runs.csv``, ``summary.csv``, ``times.csv``, figures and a page.
    Killed at any moment and called again, it resumes; called with more scenarios, algorithms or
    seeds, it adds their runs.

    Returns:
        The comparison. A run that failed is a gap in it.

    Raises:
        InputError: an invalid argument or file.
        StorageError: the folder holds something else, is in use, or cannot be written.
        Interrupted: Ctrl-C; every run keeps what it has done.
    """
    callbacks = given.callbacks
    executor = read_choice(given.workers)
    plan = make_plan(
        given.scenarios,  # type: ignore[arg-type]
        given.algorithms,
        settings=given.settings,
        seeds=given.seeds,
        budget=given.budget,
        baseline=given.baseline,
        apart=given.apart,
        out=None if given.out is None else Path(given.out),
        options=CommonOptions.of(
            given,
            distribution=_absolute(given.distribution),
            road_map=_absolute(given.road_map),
            causes=given.causes or given.cause is not None,
        ),
    )
    begin(plan)
    lock = Lock(plan.out / LOCK)
    done: list[str] = []
    try:
        failures = _run(plan, executor, callbacks, done)
        return _conclude(plan, failures, callbacks, deliver=given.deliver)
    except KeyboardInterrupt:
        raise Interrupted(
            plan.out, len(done), len(plan.cells), what="runs", command=plan.command()
        ) from None
    finally:
        lock.release()


def _run(
    plan: Plan, executor: int | str | None, callbacks: JobCallbacks, done: list[str]
) -> dict[Cell, str]:
    """Make the runs that are missing; return why some failed.

    Args:
        plan: the runs.
        executor: of the runs, as ``read_choice`` returns it.
        callbacks: called as it progresses.
        done: gets the name of each run that has ended, this time or earlier.
    """
    failures, tasks, made = {}, [], 0
    for cell in plan.cells:
        folder = plan.folder(cell)
        try:
            evaluations, is_ended = evaluations_of(folder)
        except StorageError as error:
            failures[cell] = str(error)
            continue
        if is_ended:
            done.append(cell.name)
            made += evaluations
        else:
            tasks.append(_task(plan, cell))
    progress = RunsProgress(callbacks, len(plan.cells), plan.budget, len(done), made, done.append)
    at_once, cluster = (executor, None) if isinstance(executor, int) else (cores(), executor)
    failed = run_all(tasks, at_once, progress, cluster)
    return failures | {cell: failed[cell.name] for cell in plan.cells if cell.name in failed}


def _conclude(
    plan: Plan, failures: Mapping[Cell, str], callbacks: JobCallbacks, *, deliver: bool
) -> Comparison:
    """Read the runs, measure and test them, and write the results if requested."""
    callbacks.stage("reading the runs")
    gaps, records = dict(failures), {}
    spaces: dict[tuple[str, str], SearchSpace] = {}  # an adversary has other parameters
    terms = _common_terms(plan, gaps)
    for cell in plan.cells:
        if cell in gaps:
            continue
        folder = plan.folder(cell)
        try:
            kind = (cell.scenario, cell.algorithm)
            if kind not in spaces:
                spaces[kind] = space_of(folder)
            space = spaces[kind]
            records[cell] = read(
                folder, space, terms[cell.scenario], plan.budget, counts(plan.budget), plan.apart
            )
        except StorageError as error:
            gaps[cell] = str(error)
    measured = {
        scenario: measure(of_it, plan.budget, plan.baseline)
        for scenario in plan.scenarios
        if (of_it := {c: record for c, record in records.items() if c.scenario == scenario})
    }
    values = {cell: row for item in measured.values() for cell, row in item.values.items()}
    kinds = measures(plan.budget)
    lines = summarise(values, plan.scenarios, list(plan.algorithms), plan.baseline, kinds)
    result = Comparison(plan, records, measured, gaps, lines, kinds)
    if deliver:
        write_tables(plan, records, values, gaps, lines, kinds)
        callbacks.stage("drawing")
        write_page(result)
    return result


def _common_terms(plan: Plan, gaps: dict[Cell, str]) -> dict[str, tuple[str, ...]]:
    """Return, by scenario, the terms of the objective that all of its runs have.

    Algorithms of many objectives get one beside harm, which those of one objective lack.

    Args:
        plan: of the comparison.
        gaps: why runs cannot be read; gets those that are damaged.
    """
    found: dict[str, tuple[str, ...]] = {}
    for cell in plan.cells:
        if cell in gaps:
            continue
        try:
            own = terms_of(plan.folder(cell))
        except StorageError as error:
            gaps[cell] = str(error)
            continue
        found[cell.scenario] = tuple(name for name in found.get(cell.scenario, own) if name in own)
    return found


def _task(plan: Plan, cell: Cell) -> Task:
    scenario, options = plan.scenarios[cell.scenario], plan.options_of(cell)
    return Task(cell.name, plan.folder(cell), scenario, options)


def _absolute(path: Path | str | None) -> str | None:
    return None if path is None else str(Path(path).resolve())
