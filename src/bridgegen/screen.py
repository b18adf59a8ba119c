"""What a person sees in the terminal: the progress bar and the tables."""

import json
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

if TYPE_CHECKING:
    from bridgegen.campaign import Run, Watch
    from bridgegen.campaign.driver_contract import Check
    from bridgegen.campaign.loop import Progress as LoopProgress
    from bridgegen.campaign.settings import Settings
    from bridgegen.metrics.measure import Measured
    from bridgegen.odd.coverage import Coverage, ParameterBins
    from bridgegen.odd.scenario import ParameterLine
    from bridgegen.simulate import FileResult

_STAGES = {
    "compile": "compiling",
    "search": "",  # the bar says it; a terminal has but 80 columns
    "hand over": "writing the critical scenarios",
    "report": "writing the report",
}

MOST_REASONS = 5
"""Why evaluations failed is told in so many lines at most."""


class Screen:
    """A campaign's live progress on stderr: evaluations, critical so far, best d_min, rate."""

    def __init__(self, budget: int | None = None) -> None:
        self._console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=14),
            MofNCompleteColumn(),
            TextColumn("{task.fields[facts]}"),
            TimeRemainingColumn(compact=True),
            console=self._console,
            transient=True,
        )
        self._task = self._progress.add_task("starting", total=budget, facts="")
        self._critical, self._best = 0, float("inf")
        self._began = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Since it was made [s]."""
        return time.perf_counter() - self._began

    @property
    def watch(self) -> "Watch":
        """The callbacks for a campaign."""
        from bridgegen.campaign import Watch

        return Watch(stage=self._stage, batch=self._batch)

    def _stage(self, stage: str) -> None:
        from bridgegen.compiled import is_compiled

        if stage == "compile" and not is_compiled():
            self._console.print(
                "First run: compiling the simulator, which takes a minute or two; later runs start "
                "at once."
            )
        self._progress.update(self._task, description=_STAGES[stage])

    def _batch(self, progress: "LoopProgress") -> None:
        column = progress.result.metrics[:, progress.metrics.index("d_min")]
        self._critical += int(progress.result.critical.sum())
        good = column[progress.result.status == 0]
        self._best = min(self._best, float(good.min())) if len(good) else self._best
        rate = progress.evaluations / progress.seconds if progress.seconds > 0 else 0.0
        self._progress.update(
            self._task,
            total=progress.budget,
            completed=progress.evaluations,
            facts=f"{self._critical} critical · best d_min {self._best:.2f} m · {rate:.0f}/s",
        )

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.stop()


def print_summary(run: "Run", seconds: float) -> None:
    """Print a run's figures, the whole job's time [s], and where its files are."""
    s, settings = run.summary, run.settings
    rows = [
        ("scenario", f"{Path(settings.scenario).stem}, ego {settings.ego}"),
        ("search", f"{settings.algorithm}, seed {settings.seed}"),
        ("evaluations", f"{s.evaluations}" + (f" ({s.failed} failed)" if s.failed else "")),
        ("R_critic", f"{s.r_critic:.3f} ({s.critical} critical{_by(settings.cause)})"),
        *([("causes", ", ".join(f"{k} {n}" for k, n in s.causes.items()))] if s.causes else []),
        ("first critical after", _count(s.first)),
        ("50th critical after", _count(s.fiftieth)),
        ("d_min", f"best {s.d_min_best:.2f} m, median {s.d_min_median:.2f} m"),
        ("v_d", f"best {s.v_d_best:.2f} m/s, median {s.v_d_median:.2f} m/s"),
        ("wall time", f"{seconds:.2f} s, of which {s.seconds:.2f} s search"),
        ("scenarios", f"{len(run.scenarios)} in {run.folder / 'critical'}"),
        ("report", str(run.report)),
    ]
    reasons = run.failures.most_common(MOST_REASONS)
    rows += [("failed", f"{count} × {reason}") for reason, count in reasons]
    for name, value in rows:
        print(f"{name:<22}{value}")


def print_file_result(file: Path, result: "FileResult") -> None:
    """Print what one scenario file came to."""
    print(f"{file}: ego {result.driver}, {result.seconds:g} s simulated")
    if result.status != "ok":
        print(f"failed: {result.status}")
    if result.cause is not None:
        print(f"cause of its harm, as it was found: {result.cause}")
    _print_metrics(result.metrics)


def print_measured(file: Path, measured: "Measured", *, as_json: bool) -> None:
    """Print what a recording came to."""
    rollout, n = measured.rollout, measured.rollout.shape[2]
    if as_json:
        facts = {
            "file": str(file), "ego": rollout.names[0], "entities": rollout.names, "instants": n,
            "time_step": rollout.time_step, "metrics": _finite(measured.metrics),
            "notes": measured.notes,
        }  # fmt: skip
        print(json.dumps(facts, indent=2))
        return
    print(
        f"{file}: ego {rollout.names[0]}, {len(rollout.names) - 1} others, {measured.seconds:g} s "
        f"in {n} instants"
    )
    _print_metrics(measured.metrics)


def _print_metrics(values: Mapping[str, float]) -> None:
    from bridgegen.metrics import METRICS

    width = max(len(name) for name in values)
    for name, value in values.items():
        unit = METRICS[name].unit
        print(f"{name:<{width}}  {value:.6g}{'' if unit == '1' else ' ' + unit}")


def _finite(values: Mapping[str, float]) -> dict[str, float | None]:
    """Return values as JSON has them: null for what is infinite or NaN."""
    return {name: value if isfinite(value) else None for name, value in values.items()}


def print_checks(checks: "Iterable[Check]", *, as_json: bool) -> bool:
    """Print what was tried on a driver as it comes in; return whether it kept everything."""
    done, scenario = [], ""
    for check in checks:
        done.append(check)
        if as_json:
            continue
        if check.scenario != scenario:
            scenario = check.scenario
            print(scenario)
        sign = "no " if check.problem else "   " if check.figure else "ok "
        print(f"  {sign} {check.rule}" + (f": {check.figure}" if check.figure else ""))
        if check.problem:
            print(f"        {check.problem}")
    if as_json:
        print(json.dumps([asdict(check) for check in done], indent=2))
    return not any(check.problem for check in done)


def print_table(head: Sequence[str], rows: Sequence[Sequence[object]], *, as_json: bool) -> None:
    """Print rows as a table, or as a JSON list of objects."""
    if as_json:
        print(json.dumps([dict(zip(head, row, strict=True)) for row in rows], indent=2))
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in head:
        table.add_column(name, overflow="fold")  # nothing is lost in a narrow terminal
    for row in rows:
        table.add_row(*("" if value is None else _shown(value) for value in row))
    Console(markup=False, emoji=False).print(table)


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def print_parameters(lines: "Sequence[ParameterLine]", *, as_json: bool) -> None:
    """Print parameters with range and default; below each, what it is and its constraints."""
    if as_json:
        print(json.dumps([{**asdict(line), "axis": str(line.axis)} for line in lines], indent=2))
        return
    width = max(len(line.name) for line in lines)
    for line in lines:
        span = "derived" if line.low is None else f"{line.low:g} to {line.high:g} {line.unit}"
        default = "" if line.default is None else f", default {line.default:g}"
        print(f"{line.name:<{width}}  {line.axis}, {span}{default}")
        for text in (line.description, *line.bounds.split("; ")):
            if text:
                print(f"{'':<{width}}    {text}")


def print_coverage(run: Path, settings: "Settings", found: "Coverage", *, as_json: bool) -> None:
    """Print how many t-way combinations of bins were evaluated, then each parameter's bins."""
    if as_json:
        print(json.dumps({"run": str(run), **_plain(asdict(found))}, indent=2))
        return
    print(
        f"{run}: {Path(settings.scenario).stem}, {settings.algorithm}, {found.evaluations} "
        f"evaluations, {found.critical} critical, {len(found.parameters)} parameters searched\n"
    )
    head = ("t", "combinations", "feasible", "evaluated", "of feasible", "critical")
    rows = [
        (w.strength, w.total, w.feasible, w.evaluated, f"{w.share:.1%}", w.critical)
        for w in found.ways
    ]
    print_table(head, rows, as_json=False)
    print(
        f"\nFeasible: met among {found.sample} random scenarios, or in the run; a lower bound. "
        "The constraints\nexclude others. Critical: combinations that hold a critical scenario.\n"
    )
    print("Evaluations per bin, lowest first, of these critical; – where none is feasible:")
    width = max(len(one.name) for one in found.parameters)
    for one in found.parameters:
        low, high = one.edges[[0, -1]] + ((0.5, -0.5) if one.integer else (0.0, 0.0))
        print(f"{one.name:<{width}}  {one.axis}, {low:g} to {high:g} {one.unit}")
        print(f"    {_cells(one)}")


def _cells(one: "ParameterBins") -> str:
    counts = zip(one.evaluated, one.critical, one.feasible, strict=True)
    return "".join(f"{f'{n}/{k}' if possible else '–':>10}" for n, k, possible in counts)


def _plain(value: Any) -> Any:
    """Return arrays and tuples as lists, all the way down."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _by(cause: str | None) -> str:
    return f" by {cause}" if cause else ""


def _count(value: int | None) -> str:
    return "never" if value is None else f"{value} evaluations"
