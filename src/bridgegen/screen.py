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
    from bridgegen.campaign.regions import RunRegions
    from bridgegen.campaign.settings import Settings
    from bridgegen.metrics.measure import Measured
    from bridgegen.odd.coverage import Coverage, ParameterBins
    from bridgegen.odd.scenario import ParameterLine
    from bridgegen.regions import Evidence
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
        if stage == "compile":
            _say_compiling(self._console)
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


class Bar:
    """A bar on stderr of something that is counted.

    Args:
        what: is done.
    """

    def __init__(self, what: str) -> None:
        self._console, self._what = Console(stderr=True), what
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=14),
            MofNCompleteColumn(),
            TimeRemainingColumn(compact=True),
            console=self._console,
            transient=True,
        )
        self._task = self._progress.add_task("starting", total=None)

    def stage(self, stage: str) -> None:
        """Take down what begins."""
        if stage == "compile":
            _say_compiling(self._console)
        self._progress.update(self._task, description=_STAGES.get(stage) or self._what)

    def progress(self, done: int, total: int) -> None:
        """Take down how many are done, and how many there are."""
        self._progress.update(self._task, description=self._what, completed=done, total=total)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()


def _say_compiling(console: Console) -> None:
    from bridgegen.compiled import is_compiled

    if not is_compiled():
        console.print(
            "First run: compiling the simulator, which takes a minute or two; later runs start "
            "at once."
        )


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


def print_regions(run: "RunRegions", *, as_json: bool) -> None:
    """Print a run's regions: what holds, then what does not, then what that comes to."""
    facts, found = run.record, run.found
    if as_json:
        print(json.dumps(facts, indent=2))
        return
    confirmed = len(found.confirmed)
    by = f" by {facts['cause']}" if facts["cause"] else ""
    print(
        f"{run.folder}: {facts['scenario']}, ego {facts['ego']}, {facts['algorithm']}, "
        f"{facts['evaluations']} evaluations{'' if facts['finished'] else ' so far'}, "
        f"{found.critical} critical{by}\n"
    )
    least = _percent(facts["at_least"])
    asked = f"at least {least} of all scenarios are critical, with 95 % confidence"
    if confirmed:
        print(f"Regions where {asked}:\n")
        _print_regions(run, 0, confirmed)
    else:
        print(f"No region is confirmed where {asked}.")
    if others := len(found.regions) - confirmed:
        print("\nNot confirmed:\n")
        _print_regions(run, confirmed, confirmed + others)
    if found.regions:
        print(
            "\nfresh: random scenarios of the region, simulated for this table: the share that "
            "counts, with\nits 95 % interval. run: those that the search chose there, a biased "
            "share. space: how many\nof all random scenarios lie in the region."
        )
    else:
        print(
            "No part of the parameters' ranges stands out in a decision tree of the evaluations:\n"
            "too few are critical, or nowhere enough of them."
        )
    if confirmed:
        print(
            f"\nThe confirmed {'region holds' if confirmed == 1 else 'regions hold'} "
            f"{found.critical_held} of the run's {found.critical} critical scenarios, and "
            f"{_percent(found.space_share)} of all random scenarios."
        )
    files = ", ".join(map(str, run.files))
    print(f"{found.simulations} fresh scenarios, seed {facts['seed']}: {files}")
    if run.unstated:
        print(
            f"{len(run.unstated)} of the confirmed regions cannot be stated as classes: the "
            "ontology cannot say this\nscenario, or has no value of a parameter that the rule "
            "names."
        )


def _print_regions(run: "RunRegions", start: int, stop: int) -> None:
    from bridgegen.regions.words import ANYWHERE, conditions

    failed = any(one.fresh.failed for one in run.found.regions[start:stop])
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 1, 0))
    for name in ("#", "region", "fresh", "run", "space", *(["failed"] if failed else [])):
        table.add_column(name, overflow="fold")
    for number, one in enumerate(run.found.regions[start:stop], start=start + 1):
        rule = "\nand ".join(conditions(one.box, run.space)) or ANYWHERE
        note = "\n(narrowed to others)" if one.narrowed else ""
        table.add_row(
            str(number),
            rule + note,
            _shares(one.fresh),
            _shares(one.search),
            _percent(one.space_share),
            *([str(one.fresh.failed)] if failed else []),
        )
    Console(markup=False, emoji=False, highlight=False).print(table)


def _shares(one: "Evidence") -> str:
    if one.share is None:
        return "none"
    low, high = map(_percent, one.interval)
    low = low.removesuffix(" %")
    return f"{_percent(one.share)}\n{low} to {high}\n{one.critical} of {one.rows}"


def _percent(share: float) -> str:
    from bridgegen.regions.words import percent

    return percent(share)


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
