"""A campaign: its bar, and its final figures."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.base.units import percent
from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from bridgegen.engine.workers import Workers
    from bridgegen.jobs.search import Run, SearchCallbacks
    from bridgegen.jobs.search.loop import Progress
    from bridgegen.jobs.search.settings import Settings
    from bridgegen.scenario.language.coverage import Coverage, ParameterBins
    from bridgegen.scenario.odd.coverage import OddCoverage
    from bridgegen.search.triage import Triage

_STAGES = {
    "search": "",  # the bar shows it; a terminal has only 80 columns
    "triage": "testing the findings",
    "export": "writing the critical scenarios",
    "report": "writing the report",
}

MOST_MODES = 10
"""Maximum number of failure modes shown."""

MOST_REASONS = 5
"""Maximum number of lines with reasons of failed evaluations."""


class SearchProgress(Live):
    """A campaign's live progress: evaluations, critical so far, best d_min, rate.

    Args:
        budget: of evaluations, if it is known.
    """

    def __init__(self, budget: int | None = None) -> None:
        super().__init__(budget)
        self._critical, self._best = 0, float("inf")
        self._workers: Workers | None = None

    @property
    def callbacks(self) -> "SearchCallbacks":
        """The callbacks for a campaign."""
        from bridgegen.jobs.search import SearchCallbacks

        return SearchCallbacks(
            stage=self._stage,
            workers=self._set_workers,
            batch=self._batch,
            warning=lambda text: self.console.print(
                f"bridgegen: warning: {text}", soft_wrap=True, markup=False, highlight=False
            ),
        )

    def _set_workers(self, workers: "Workers") -> None:
        self._workers = workers

    def _stage(self, stage: str) -> None:
        if stage == "compile":
            self.say_compiling()
        else:
            self.show(what=_STAGES[stage])

    def _by(self) -> str:
        """Return the number of workers, unless they are threads; a cluster's may change."""
        from bridgegen.engine.workers import Threads

        workers = self._workers
        if workers is None or isinstance(workers, Threads):
            return ""
        return f" by {workers.count} worker" + "s" * (workers.count != 1)

    def _batch(self, progress: "Progress") -> None:
        column = progress.result.metrics[:, progress.metrics.index("d_min")]
        self._critical += int(progress.result.critical.sum())
        good = column[progress.result.status == 0]
        self._best = min(self._best, float(good.min())) if len(good) else self._best
        rate = progress.evaluations / progress.seconds if progress.seconds > 0 else 0.0
        self.show(
            done=progress.evaluations,
            total=progress.budget,
            facts=f"{self._critical} critical · best d_min {self._best:.2f} m · {rate:.0f}/s"
            f"{self._by()}",
        )


def print_summary(run: "Run", seconds: float, *, verbose: bool = False) -> None:
    """Print a run's verdict, its failure modes, how common they are, and what to do next.

    Args:
        run: the run.
        seconds: total time [s].
        verbose: its figures and each mode in full first.
    """
    if verbose:
        _print_figures(run, seconds)
    print("\n".join(verdict_lines(run, seconds)))


def _print_figures(run: "Run", seconds: float) -> None:
    """Print a run's figures, and its failure modes with all that was measured of them."""
    s, settings, found = run.summary, run.settings, run.triage
    quick = "quick causes" if found is not None else "causes"
    rows = [
        ("scenario", f"{Path(settings.scenario).stem}, ego {settings.called}{_worse(settings)}"),
        ("search", f"{settings.algorithm}, seed {settings.seed}"),
        ("evaluations", f"{s.evaluations}" + (f" ({s.failed} failed)" if s.failed else "")),
        *screen_rows(run),
        ("R_critic", f"{s.r_critic:.3f} ({s.critical} critical{_by(settings.cause)})"),
        *([(quick, ", ".join(f"{k} {n}" for k, n in s.causes.items()))] if s.causes else []),
        ("first critical after", _count(s.first)),
        ("50th critical after", _count(s.fiftieth)),
        ("d_min", f"best {s.d_min_best:.2f} m, median {s.d_min_median:.2f} m"),
        ("v_d", f"best {s.v_d_best:.2f} m/s, median {s.v_d_median:.2f} m/s"),
        *(
            (f"criterion {criterion.criterion.id}", criterion.sentence)
            for criterion in run.criteria
        ),
        *([("what happened", said)] if (said := run.happening.sentence) else []),
        ("wall time", f"{seconds:.2f} s, of which {s.seconds:.2f} s search"),
        ("scenarios", _exported(run)),
    ]
    rows += [
        (
            "not exported",
            f"{refused.name}, evaluation {refused.evaluation + 1}: {'; '.join(refused.problems)}",
        )
        for refused in run.not_exported
    ]
    reasons = run.failures.most_common(MOST_REASONS)
    rows += [("failed", f"{count} × {reason}") for reason, count in reasons]
    _print_rows(rows)
    if found is not None and found.modes:
        print()
        _print_modes(found)
    print()


def screen_rows(run: "Run") -> list[tuple[str, str]]:
    """Return how far the run's screen agrees; nothing without one."""
    from bridgegen.pages.screened_payload import in_a_line

    return [] if run.screened is None else [("screen", in_a_line(run.screened))]


WORDS = {"fails": "FAILS", "no failure found": "NO FAILURE FOUND", "not judged": "NOT JUDGED"}
"""The verdicts on the terminal."""

WIDTH, BAR = 100, 5
"""Largest length of a mode's line, and length of its bar [characters]."""


def verdict_lines(run: "Run", seconds: float) -> list[str]:
    """Return the verdict on the first line; then the modes, and what matters most of the run."""
    from bridgegen.assess.criteria import headline as judged

    s, settings, found = run.summary, run.settings, run.triage
    lines = [f"{conclusion(run)} ({seconds:.0f} s)"]
    if text := judged(settings.ego, run.criteria):
        lines.append(f"Criteria: {text}")
    if found is not None:
        lines += _mode_lines(found)
        lines += ["", *_found_lines(found)]
    if not run.happening.happened or run.happening.stuck:
        lines.append(f"What happened: {run.happening.sentence}")
    elif run.happening.domain and run.verdict != "not judged":
        lines.append(f"Domain: {run.happening.domain}")
    if s.failed:
        reasons = ", ".join(f"{n} × {why}" for why, n in run.failures.most_common(MOST_REASONS))
        lines.append(f"Without a result: {reasons}")
    lines += [
        f"Not exported: {refused.name}, evaluation {refused.evaluation + 1}: "
        f"{'; '.join(refused.problems)}"
        for refused in run.not_exported
    ]
    folder = run.folder
    lines.append(f"Report: {run.report} (-v prints all figures)")
    if run.scenarios or run.fresh_scenarios:
        kept = folder if run.scenarios else run.fresh_scenarios[0]
        lines.append(
            f"Keep: {settings.keep_command(kept)} · compare drivers: bridgegen diff SUITE "
            f"--ego {settings.ego} --ego OTHER"
        )
    return lines


def conclusion(run: "Run") -> str:
    """Return a run's verdict in a line: the word, the driver, the scenario, and why."""
    from bridgegen.search.triage.record import NOT_JUDGED

    settings, found = run.settings, run.triage
    name = f"{settings.called} in {Path(settings.scenario).stem}{_worse(settings)}"
    word = WORDS[run.verdict]
    if found is None:
        return f"{word}  {name}: the run has not ended"
    bound = found.bound
    if run.verdict == "fails" and found.modes:
        modes = len(found.modes) + found.unrecorded_modes
        ways = f"{modes} failure mode" + "s" * (modes != 1)
        return f"{word}  {name}: {ways} in {bound.harmful:,} of {bound.evaluations:,} evaluations"
    if violated := [criterion.criterion.id for criterion in run.criteria if criterion.violated]:
        return f"{word}  {name}: violates {', '.join(violated)}"
    if run.verdict == "fails":
        drawn = f"{bound.space.harmful} of {bound.space.rows} fresh random draws"
        if not bound.space.harmful:
            drawn = f"repeats of {bound.in_repeats} evaluations that passed at first"
        none = f"in none of {bound.evaluations:,} evaluations"
        return f"{word}  {name}: in {drawn}, though {none}"
    _, _, why = bound.sentence.rstrip(".").partition(": ")
    if run.verdict == NOT_JUDGED:
        return f"{word}  {name}: {why}"
    _, _, but = bound.sentence.partition(": ")[0].partition(" evaluations")
    nearest = why.partition(";")[0]
    return f"{word}  {name}: in {bound.evaluations:,} evaluations{but}; {nearest}"


def _mode_lines(found: "Triage") -> list[str]:
    """Return a line for each failure mode: its bar, count, event, rule, severity and cause."""
    from bridgegen.search.triage.words import step_in_words

    modes = found.modes[:MOST_MODES]
    most = max((mode.count for mode in modes), default=1)
    likely = "probability · " if found.rate else ""
    lines = [f"         count  event · {likely}rule · worst MAIS3+ · root cause"] if modes else []
    for mode in modes:
        bar = "█" * max(round(BAR * mode.count / most), 1)
        what, _, _ = mode.title.partition(" (")
        worst = percent(mode.severity) if mode.conflict == "contact" else mode.conflict
        hangs = "step-dependent" if step_in_words(mode, found) else ""
        chance = found.chance(mode)
        repeats = "" if chance is None else f"fails in {percent(chance[0])} of repeats"
        likely = f"P {mode.probability.sentence}" if mode.probability else ""
        about = " · ".join(filter(None, [likely, mode.rule, worst, mode.cause, hangs, repeats]))
        head = f"{mode.number:>2} {bar:<{BAR}} {mode.count:>5,}  "
        width = WIDTH + len(likely)
        room = max(width - len(head) - len(about) - 3, 12)
        short = what if len(what) <= room else f"{what[: room - 1]}…"
        lines.append(f"{head}{short} · {about}"[:width])
    more = len(found.modes[MOST_MODES:]) + found.unrecorded_modes
    return [*lines, f"    and {more} more"] if more else lines


def _found_lines(found: "Triage") -> list[str]:
    """Return how common failures are, the simplest one, what matters, and what does not count."""
    from bridgegen.search.triage.words import (
        all_repeats_in_words,
        covered_in_words,
        parameters_in_words,
        steps_in_words,
    )

    space, lines = found.bound.space, list[str]()
    if found.rate is not None:
        lines.append(f"How likely: {found.rate.sentence}")
    if found.bound.judged and space.drawn and space.rows:
        share = (
            f"{percent(space.share or 0.0)} of random scenarios fail ({percent(space.low)} to "
            f"{percent(space.high)})"
            if space.harmful
            else f"at most {percent(space.high)} of random scenarios fail"
        )
        lines.append(f"How common: {share}; {space.measure}, 95 % confidence; not a rate on roads")
        if covered := covered_in_words(found):
            lines.append(f"Share found: of {space.rows} random scenarios, {covered}")
    simplest = [mode.minimal for mode in found.modes if mode.minimal is not None]
    if simplest:
        lines.append(f"Simplest: {simplest[0].sentence}")
    if found.modes and (text := parameters_in_words(found)):
        lines.append(f"What matters most: {text}")
    if found.bound.not_counted:
        lines.append(f"N{found.bound.not_counted[1:]}")
    if again := all_repeats_in_words(found):
        lines.append(f"Repeats: {again}")
    if found.missed:
        lines.append(f"Time step: {steps_in_words(found)}")
    if found.extrapolated:
        lines.append(f"Extrapolated: {found.extrapolated}")
    return lines


def _print_rows(rows: list[tuple[str, str]]) -> None:
    for name, value in rows:
        print(f"{name:<21} {value}")


def _print_modes(found: "Triage") -> None:
    """Print the failure modes, with their simplest scenarios."""
    from bridgegen.search.triage.words import mode_in_words, parameters_in_words, steps_in_words

    for mode in found.modes[:MOST_MODES]:
        print(mode_in_words(mode, found))
        if mode.minimal is not None:
            edge = " (knife-edge)" if mode.minimal.knife_edge else ""
            print(f"     simplest{edge}: {mode.minimal.sentence}")
    more = len(found.modes[MOST_MODES:]) + found.unrecorded_modes
    if more:
        print(f"     and {more} more")
    if matter := parameters_in_words(found):
        print(f"what matters most: {matter}")
    if steps := steps_in_words(found):
        print(f"time step: {steps}")


def _exported(run: "Run") -> str:
    n, minimal = len(run.scenarios), len(run.minimal_scenarios)
    if run.fresh_scenarios:
        return f"{len(run.fresh_scenarios)} in {run.folder / 'critical'}, of fresh random draws"
    if not (n or minimal or run.not_exported) and run.settings.keep:
        return f"none exported: {run.verdict}" if run.verdict != "fails" else "none exported"
    return f"{n} in {run.folder / 'critical'}" + (f", and {minimal} minimal" if minimal else "")


def _worse(settings: "Settings") -> str:
    return f", worse than {settings.worse_than}" if settings.worse_than else ""


def _by(cause: str | None) -> str:
    return f" by {cause}" if cause else ""


def _count(value: int | None) -> str:
    return "never" if value is None else f"{value} evaluations"


# --- A run's coverage ---


def print_coverage(
    run: Path,
    settings: "Settings",
    found: "Coverage",
    of_odd: "OddCoverage | None",
    *,
    as_json: bool,
) -> None:
    """Print the number of evaluated t-way combinations of bins, then each parameter's bins."""
    if as_json:
        odd = {} if of_odd is None else {"odd": of_odd.to_json()}
        print(json.dumps({"run": str(run), **_plain(asdict(found)), **odd}, indent=2))
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
        f"\nFeasible: found in {found.sample} random scenarios, or in the run; a lower bound. "
        "The constraints\nexclude others. Critical: combinations with a critical scenario.\n"
    )
    print("Evaluations per bin, lowest first, of these critical; – where none is feasible:")
    width = max(len(parameter.name) for parameter in found.parameters)
    for parameter in found.parameters:
        print(f"{parameter.name:<{width}}  {parameter.axis}, {parameter.span}")
        print(f"    {_cells(parameter)}")
        if parameter.met is not None:
            print(
                "    "
                + "".join(f"{f'{share:.1%}':>10}" for share in parameter.met)
                + "  of the road"
            )
    if of_odd is not None:
        _print_odd(of_odd)


def _print_odd(found: "OddCoverage") -> None:
    title = f"{found.odd.name} ({found.odd.title})"
    print(f"\nOf the ODD {title}, {found.pairs_in_words}:")
    rows = [
        (
            each.name,
            f"{len(each.labels) - len(each.untried)} of {len(each.labels)}" if each.labels else "–",
            f"{each.tested} of {len(each.limits)}" if each.limits else "–",
            "; ".join(filter(None, (", ".join(each.untried), each.problem))) or "–",
        )
        for each in found.attributes
    ]
    print_table(("attribute", "values tried", "limits tried", "never tried"), rows, as_json=False)


def _cells(parameter_bins: "ParameterBins") -> str:
    counts = zip(
        parameter_bins.evaluated, parameter_bins.critical, parameter_bins.feasible, strict=True
    )
    return "".join(f"{f'{n}/{k}' if possible else '–':>10}" for n, k, possible in counts)


def _plain(value: Any) -> Any:
    """Return nested arrays and tuples as lists."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray) else value
