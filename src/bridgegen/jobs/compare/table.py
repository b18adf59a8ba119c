"""Measures over seeds: medians, quartiles, tests against the baseline; and all of it as CSV."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.base.disk import write_whole
from bridgegen.base.statistics import Quartiles, a12, holm, mann_whitney, quartiles
from bridgegen.jobs.compare.measures import Measure
from bridgegen.jobs.compare.plan import RUNS, Cell, Plan
from bridgegen.jobs.compare.record import Record

RUNS_FILE, SUMMARY_FILE, TIMES_FILE = "runs.csv", "summary.csv", "times.csv"

Values = Mapping[Cell, Mapping[str, float]]


@dataclass(frozen=True)
class Line:
    """One measure of one algorithm in one scenario, over its runs.

    Attributes:
        scenario: name.
        algorithm: name.
        measure: name.
        runs: how many have a value, +inf included.
        never: how many of these are +inf: the event never occurred.
        quartiles: over those runs.
        p: of the Mann–Whitney U test against the baseline, two-sided; NaN for the baseline itself,
            for timed measures, and where there is nothing to test.
        p_holm: corrected for the number of algorithms that are tested in this measure and scenario.
        a12: probability that a run of this algorithm is better than one of the baseline.
    """

    scenario: str
    algorithm: str
    measure: str
    runs: int
    never: int
    quartiles: Quartiles
    p: float
    p_holm: float
    a12: float


def summarise(
    values: Values,
    scenarios: Iterable[str],
    algorithms: Sequence[str],
    baseline: str,
    measures: Sequence[Measure],
) -> tuple[Line, ...]:
    """Return every measure of every algorithm in every scenario, in this order of nesting."""
    lines: list[Line] = []
    for scenario in scenarios:
        for measure in measures:
            lines += _lines(values, scenario, algorithms, baseline, measure)
    order = {name: k for k, name in enumerate(algorithms)}
    places = {name: k for k, name in enumerate(dict.fromkeys(line.scenario for line in lines))}
    return tuple(sorted(lines, key=lambda line: (places[line.scenario], order[line.algorithm])))


def _lines(
    values: Values, scenario: str, algorithms: Sequence[str], baseline: str, measure: Measure
) -> list[Line]:
    nan = float("nan")
    samples = {
        name: np.array(
            [
                row[measure.name]
                for cell, row in values.items()
                if (cell.scenario, cell.algorithm) == (scenario, name)
            ],
            np.float64,
        )
        for name in algorithms
    }
    tested = [name for name in algorithms if name != baseline and not measure.timed]
    p = {name: mann_whitney(samples[name], samples[baseline]) for name in tested}
    corrected = dict(zip(tested, holm([p[name] for name in tested]), strict=True))
    effects = {
        name: a12(samples[name], samples[baseline], larger_is_better=measure.larger)
        for name in tested
    }
    return [
        Line(
            scenario,
            name,
            measure.name,
            runs=int(np.count_nonzero(~np.isnan(sample))),
            never=int(np.count_nonzero(np.isinf(sample))),
            quartiles=quartiles(sample),
            p=p.get(name, nan),
            p_holm=corrected.get(name, nan),
            a12=effects.get(name, nan),
        )
        for name, sample in samples.items()
    ]


def write_tables(
    plan: Plan,
    records: Mapping[Cell, Record],
    values: Values,
    gaps: Mapping[Cell, str],
    lines: Sequence[Line],
    measures: Sequence[Measure],
) -> None:
    """Write the runs, the summary and the times; the first two are the same bytes every time.

    Raises:
        StorageError: they cannot be written.
    """
    out, cells = plan.out, plan.cells_in_order
    settled = [measure for measure in measures if not measure.timed]
    timed = [measure for measure in measures if measure.timed]
    write_csv(out / RUNS_FILE, RUNS_HEAD, _runs(cells, records, values, gaps, settled))
    write_csv(out / TIMES_FILE, RUNS_HEAD[:5], _times(cells, values, timed))
    kept = {measure.name for measure in settled}
    write_csv(
        out / SUMMARY_FILE, SUMMARY_HEAD, (_line(line) for line in lines if line.measure in kept)
    )


RUNS_HEAD = (
    "scenario",
    "algorithm",
    "seed",
    "measure",
    "value",
    "evaluations",
    "critical",
    "failed",
    "ended",
    "folder",
    "command",
)
"""Columns of the table of runs. ``value``: inf where the event never occurred in so many
evaluations (censored), empty where the measure is not defined; ``ended``: budget, exhausted or
converged, or why the run failed."""

SUMMARY_HEAD = (
    "scenario",
    "algorithm",
    "measure",
    "runs",
    "never",
    "q1",
    "median",
    "q3",
    "p",
    "p_holm",
    "a12",
)


def _runs(
    cells: Sequence[Cell],
    records: Mapping[Cell, Record],
    values: Values,
    gaps: Mapping[Cell, str],
    measures: Sequence[Measure],
) -> Iterable[Sequence[object]]:
    for cell in cells:
        name, folder = (cell.scenario, cell.algorithm, cell.seed), f"{RUNS}/{cell.name}"
        if cell in gaps:
            yield (*name, "", "", "", "", "", f"failed: {gaps[cell]}", folder, "")
            continue
        record = records[cell]
        facts = (
            record.evaluations,
            record.critical,
            record.failed,
            record.ended,
            folder,
            record.command,
        )
        for measure in measures:
            yield (*name, measure.name, values[cell][measure.name], *facts)


def _times(
    cells: Sequence[Cell], values: Values, measures: Sequence[Measure]
) -> Iterable[Sequence[object]]:
    for cell in cells:
        for measure in measures if cell in values else ():
            value = values[cell][measure.name]
            yield (cell.scenario, cell.algorithm, cell.seed, measure.name, value)


def _line(line: Line) -> Sequence[object]:
    q = line.quartiles
    return (
        line.scenario,
        line.algorithm,
        line.measure,
        line.runs,
        line.never,
        q.low,
        q.median,
        q.high,
        line.p,
        line.p_holm,
        line.a12,
    )


def write_csv(path: Path, head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table as CSV, the same bytes for the same values.

    Raises:
        StorageError: it cannot be written.
    """
    text = io.StringIO()
    # csv ends lines by \r\n unless told otherwise.
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    for row in rows:
        writer.writerow([_cell(value) for value in row])
    write_whole(path, [text.getvalue().encode()])


def _cell(value: object) -> str:
    """Return a value as text; a float with all digits that identify it."""
    if isinstance(value, float):
        return "" if value != value else repr(value)
    return str(value)
