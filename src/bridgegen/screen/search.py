"""A campaign: its bar, and its final figures."""

from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.screen.live import Live

if TYPE_CHECKING:
    from bridgegen.campaign import Run, SearchCallbacks
    from bridgegen.campaign.loop import Progress
    from bridgegen.campaign.settings import Settings
    from bridgegen.triage import Triage
    from bridgegen.workers import Workers

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


class SearchScreen(Live):
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
        from bridgegen.campaign import SearchCallbacks

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
        from bridgegen.workers import Threads

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


def print_summary(run: "Run", seconds: float) -> None:
    """Print a run's figures, the total time [s], its failure modes; last, what matters most."""
    s, settings, found = run.summary, run.settings, run.triage
    quick = "quick causes" if found is not None else "causes"
    rows = [
        ("scenario", f"{Path(settings.scenario).stem}, ego {settings.ego}{_worse(settings)}"),
        ("search", f"{settings.algorithm}, seed {settings.seed}"),
        ("evaluations", f"{s.evaluations}" + (f" ({s.failed} failed)" if s.failed else "")),
        *screen_rows(run),
        ("R_critic", f"{s.r_critic:.3f} ({s.critical} critical{_by(settings.cause)})"),
        *([(quick, ", ".join(f"{k} {n}" for k, n in s.causes.items()))] if s.causes else []),
        ("first critical after", _count(s.first)),
        ("50th critical after", _count(s.fiftieth)),
        ("d_min", f"best {s.d_min_best:.2f} m, median {s.d_min_median:.2f} m"),
        ("v_d", f"best {s.v_d_best:.2f} m/s, median {s.v_d_median:.2f} m/s"),
        *((f"criterion {one.criterion.id}", one.sentence) for one in run.criteria),
        *([("what happened", said)] if (said := run.happening.sentence) else []),
        ("wall time", f"{seconds:.2f} s, of which {s.seconds:.2f} s search"),
        ("scenarios", _exported(run)),
    ]
    rows += [
        ("not exported", f"{one.name}, evaluation {one.evaluation + 1}: {'; '.join(one.problems)}")
        for one in run.not_exported
    ]
    reasons = run.failures.most_common(MOST_REASONS)
    rows += [("failed", f"{count} × {reason}") for reason, count in reasons]
    _print_rows(rows)
    if found is not None and found.modes:
        print()
        _print_modes(found)
    print()
    _print_rows(conclusion(run))


def screen_rows(run: "Run") -> list[tuple[str, str]]:
    """Return how far the run's screen agrees; nothing without one."""
    from bridgegen.report.screened_payload import in_a_line

    return [] if run.screened is None else [("screen", in_a_line(run.screened))]


def conclusion(run: "Run") -> list[tuple[str, str]]:
    """Return what matters of a run: the verdict, the worst failure, where it is; and its page."""
    from bridgegen.criteria import headline as judged
    from bridgegen.triage.words import headline, shortly

    s, found = run.summary, run.triage
    critical = f"{s.critical} of {s.evaluations} evaluations are critical"
    succeeded = s.evaluations - s.failed
    if s.evaluations and not succeeded:
        rows = [("verdict", "no verdict: all evaluations failed")]
    else:
        failed = f"; {s.failed} of {s.evaluations} evaluations failed" if s.failed else ""
        rows = [("verdict", (headline(found) if found is not None else critical) + failed)]
    if text := judged(run.settings.ego, run.criteria):
        if any(one.violated for one in run.criteria):
            rows = [("verdict", text), ("harm", rows[0][1])]
        else:
            rows.append(("criteria", text))
    if stuck := run.happening.stuck_in_words:
        rows.append(("progress", stuck))
    if found is not None and found.modes:
        worst = max(found.modes, key=lambda one: (one.severity, one.harm))
        rows.append(("worst", shortly(worst)))
        where = worst.minimal.sentence if worst.minimal is not None else worst.place
        if where:
            rows.append(("where", where))
    return [*rows, ("page", str(run.report))]


def _print_rows(rows: list[tuple[str, str]]) -> None:
    for name, value in rows:
        print(f"{name:<21} {value}")


def _print_modes(found: "Triage") -> None:
    """Print the failure modes, with their simplest scenarios."""
    from bridgegen.triage.words import mode_in_words, parameters_in_words

    for one in found.modes[:MOST_MODES]:
        print(mode_in_words(one, found))
        if one.minimal is not None:
            edge = " (knife-edge)" if one.minimal.knife_edge else ""
            print(f"     simplest{edge}: {one.minimal.sentence}")
    more = len(found.modes[MOST_MODES:]) + found.unrecorded_modes
    if more:
        print(f"     and {more} more")
    if matter := parameters_in_words(found):
        print(f"what matters most: {matter}")


def _exported(run: "Run") -> str:
    n, minimal = len(run.scenarios), len(run.minimal_scenarios)
    if not (n or minimal or run.not_exported) and run.settings.keep:
        return "none exported: no failure found"
    return f"{n} in {run.folder / 'critical'}" + (f", and {minimal} minimal" if minimal else "")


def _worse(settings: "Settings") -> str:
    return f", worse than {settings.worse_than}" if settings.worse_than else ""


def _by(cause: str | None) -> str:
    return f" by {cause}" if cause else ""


def _count(value: int | None) -> str:
    return "never" if value is None else f"{value} evaluations"
