"""Which constants of the models the verdicts on a finished run's findings hang on."""

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError
from bridgegen.base.units import percent
from bridgegen.engine.constants import NOT_VARIED, Constant, applying, try_with
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.trials import Trials
from bridgegen.engine.workers import Threads
from bridgegen.jobs.search.report import SENSITIVITY, rewrite_report
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.jobs.search.run import REPORT, Run
from bridgegen.pages import charts, templates
from bridgegen.search import sensitivity as record
from bridgegen.search.sensitivity import (
    BETWEEN,
    HALVINGS,
    JSON_FILE,
    Effect,
    Finding,
    Sensitivity,
)
from bridgegen.search.triage.moves import nearest, reaches, searched
from bridgegen.search.triage.neighbours import RADIUS

FINDINGS, BUDGET = 20, 10_000
"""Findings that are analysed, and evaluations, at most."""

TRAJECTORIES, LEAST = 4, 2
"""Trajectories of Morris's design: by default, and the fewest by which it has a sigma."""


class Share(NamedTuple):
    """What a constant or a parameter moves in all findings of a record.

    Attributes:
        share: of trajectories in which it changes the verdict.
        name: of it.
        kind: "constant" or "parameter".
        flips: these trajectories.
        of: all trajectories.
        mu_star: mean over the findings.
        alone: findings whose verdict it changes alone, within its plausible range.
    """

    share: float
    name: str
    kind: str
    flips: int
    of: int
    mu_star: float
    alone: int


def sensitivity_of(
    folder: Path | str,
    *,
    findings: int = FINDINGS,
    trajectories: int = TRAJECTORIES,
    budget: int = BUDGET,
    seed: int | None = None,
    ego: str | None = None,
    metrics: Sequence[str] | None = None,
    say: Callable[[str], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sensitivity:
    """Vary constants and parameters around a run's findings; write record and page beside it.

    Findings are the evaluations that stand for failure modes, then the exported ones.

    Args:
        folder: of a finished run.
        findings: how many at most.
        trajectories: of Morris's design, at least 2; fewer if the budget asks for it.
        budget: evaluations at most.
        seed: of the trajectories; the run's by default.
        ego: where a driver of your own drives, that same driver.
        metrics: likewise, those of your own.
        say: gets how many evaluations it takes, before it begins.
        progress: called with the number of evaluations, and the most there can be.

    Raises:
        StorageError: not a run, its scenario or map is not what it was, or not writable.
        FileFormatError: its triage is damaged.
        InputError: a number out of range; the run is unfinished, of another version, of two drivers
            or of another simulator; it has no findings; or the ego has to be named.
    """
    for name, value, least in (
        ("findings", findings, 1), ("trajectories", trajectories, LEAST), ("budget", budget, 1),
        ("seed", seed, 0),
    ):  # fmt: skip
        if value is not None and not least <= value < 2**32:
            raise InputError(f"{least} <= {name} < 2^32 must hold, got {value}")
    run = Run(folder)
    titles = _findings(run)
    pipeline = pipeline_of(
        run, "analyse sensitivity", ego=ego, metrics=metrics or (), workers=Threads(1)
    )
    if not pipeline.tries:
        raise InputError(f"{run.folder}: constants are varied in the embedded simulator only")
    constants = applying(pipeline.runner.embedded.program)
    moving = reaches(pipeline.space) > 0.0
    factors = len(constants) + int(moving.sum())
    alone = 2 * len(constants) * (len(BETWEEN) + HALVINGS)

    def most(trajectories: int) -> int:
        return 1 + trajectories * (factors + 1) + alone

    taken = min(findings, len(titles))
    while trajectories > LEAST and taken * most(trajectories) > budget:
        trajectories -= 1
    taken = min(taken, budget // most(trajectories))
    if not taken:
        raise InputError(
            f"a finding of this run takes up to {most(LEAST)} evaluations, got a budget of {budget}"
        )
    total = taken * most(trajectories)
    if say:
        say(
            f"{templates.counted(taken, 'finding')} of {len(titles)}, {len(constants)} constants, "
            f"{factors - len(constants)} parameters, {trajectories} trajectories: up to {total:,} "
            "evaluations"
        )
    seed = run.settings.seed if seed is None else seed
    rows, chosen = run.rows(), list(titles)[:taken]
    bench = _Bench(
        pipeline, rows.X[chosen], constants, moving, lambda n: progress and progress(n, total)
    )
    bench.sweep()
    points, order = record.design(trajectories, factors, seed)
    bench.walk(points)
    found = Sensitivity(
        scenario=pipeline.scenario.name,
        ego=pipeline.driver.label,
        results=rows.digest(),
        seed=seed,
        trajectories=trajectories,
        radius=RADIUS,
        evaluations=bench.done,
        constants=constants,
        not_varied=NOT_VARIED,
        findings=tuple(
            bench.finding(f, evaluation, titles[evaluation], points, order)
            for f, evaluation in enumerate(chosen)
            if bench.base.harmful[f]
        ),
        left_out=len(titles) - int(bench.base.harmful.sum()),
    )
    record.write_record(run.folder / JSON_FILE, found)
    _write_page(run.folder / SENSITIVITY, found)
    rewrite_report(run, pipeline, lambda stage: None)
    return found


def _findings(run: Run) -> dict[int, str]:
    """Return the evaluations that are findings of a run, and what each is, in their order.

    Raises:
        InputError: it is none whose findings can be analysed, or has none.
    """
    if not run.finished or run.triage is None:
        raise InputError(f"{run.folder}: the run has not finished; bridgegen resume {run.folder}")
    if run.version != version("bridgegen"):
        raise InputError(
            f"{run.folder}: made by BridgeGen {run.version}, whose constants may be others than "
            f"those of {version('bridgegen')}; search again"
        )
    if run.settings.worse_than is not None:
        raise InputError(
            f"{run.folder}: compares two drivers; the sensitivity of one driver's verdicts is "
            "analysed (a run without --worse-than)"
        )
    titles = {mode.shown: mode.title for mode in run.modes}
    of = {name: mode.title for mode in run.modes for name in mode.exports}
    harmful = run.triage.bound.harmful
    for item in run.exported(len(run.rows())) if harmful else ():
        titles.setdefault(item.evaluation, of.get(item.name, "exported scenario"))
    if not titles:
        raise InputError(f"{run.folder}: has no findings, so no verdict to vary constants for")
    return titles


class _Bench:
    """Findings of a run, evaluated with other constants and in their neighbourhood."""

    def __init__(
        self,
        pipeline: Pipeline,
        X: Float,
        constants: Sequence[Constant],
        moving: Bool,
        progress: Callable[[int], None],
    ) -> None:
        self._pipeline, self._X, self._constants = pipeline, X, constants
        self._moving, self._progress = np.flatnonzero(moving), progress
        self._center = searched(pipeline.space, X)
        self._reach = RADIUS * reaches(pipeline.space)
        self.done = 0
        self.base = self._trials(np.arange(len(X)), {})
        self._limits: dict[tuple[int, str, int], float | None] = {}

    def _trials(self, at: Int, values: Mapping[str, float], X: Float | None = None) -> Trials:
        """Evaluate some of the findings, or neighbours of them, with their own random numbers."""
        objective, own = self._pipeline.objective, self._X[at]
        found = try_with(
            self._pipeline.runner, own if X is None else X, own, objective.harm, objective.count,
            values,
        )  # fmt: skip
        self.done += len(at)
        self._progress(self.done)
        return found

    def sweep(self) -> None:
        """Move each constant alone from its nominal value to the ends of its range."""
        rows = np.flatnonzero(self.base.harmful)
        for constant in self._constants:
            for side, end in enumerate((constant.low, constant.high)):
                values = [constant.value + part * (end - constant.value) for part in BETWEEN]
                if end == constant.value or not len(rows):
                    continue
                same = np.array([self._same(rows, constant.name, value) for value in values])
                for row, stands in zip(rows.tolist(), same.T.tolist(), strict=True):
                    self._limits[row, constant.name, side] = record.limit(
                        constant.value,
                        [*zip(values, stands, strict=True)],
                        lambda value, row=row, name=constant.name: bool(  # type: ignore[misc]
                            self._same(np.array([row]), name, value)[0]
                        ),
                    )

    def _same(self, at: Int, name: str, value: float) -> Bool:
        """Return which findings keep their verdict; without a result, nothing is known of it."""
        found = self._trials(at, {name: value})
        same: Bool = ~found.ok | (_verdicts(found) == _verdicts(self.base.take(at)))
        return same

    def walk(self, points: Float) -> None:
        """Evaluate all findings at the points of a design."""
        shape = (len(self._X), *points.shape[:2])
        self._harm, self._verdict = np.full(shape, np.nan), np.full(shape, "", dtype=object)
        at, n = np.flatnonzero(self.base.harmful), len(self._constants)
        for r, k in np.ndindex(*shape[1:]) if len(at) else ():
            point = points[r, k]
            values = {
                constant.name: constant.low + share * (constant.high - constant.low)
                for constant, share in zip(self._constants, point.tolist(), strict=False)
            }
            wanted = self._center[at].copy()
            by = (2.0 * point[n:] - 1.0) * self._reach[self._moving]
            wanted[:, self._moving] += by
            found = self._trials(at, values, nearest(self._pipeline.space, wanted))
            self._harm[at, r, k] = np.where(found.ok, found.harm, np.nan)
            self._verdict[at, r, k] = _verdicts(found)

    def finding(self, f: int, evaluation: int, title: str, points: Float, order: Int) -> Finding:
        """Return what is found of one finding."""
        harm, verdict = self._harm[f], self._verdict[f]
        effects = record.elementary_effects(points, order, harm)
        mu_star, sigma = record.summary(effects)
        known = np.isfinite(effects)
        flips = np.zeros(len(mu_star), np.int64)
        for r, factors in enumerate(order):
            flips[factors] += (verdict[r, 1:] != verdict[r, :-1]) & known[r, factors]
        space = self._pipeline.space
        parameters = [(space.variables[i], "parameter") for i in self._moving.tolist()]
        names = [(constant.name, "constant") for constant in self._constants] + parameters
        found = [
            Effect(
                name=name, kind=kind, mu_star=float(mu_star[i]), sigma=float(sigma[i]),
                flips=int(flips[i]), of=int(known[:, i].sum()),
                at_least=self._limits.get((f, name, 0)) if kind == "constant" else None,
                at_most=self._limits.get((f, name, 1)) if kind == "constant" else None,
            )
            for i, (name, kind) in enumerate(names)
        ]  # fmt: skip
        sentences = [
            record.sentence(one.words, one.unit, effect.at_least, effect.at_most)
            for one, effect in zip(self._constants, found, strict=False)
        ]
        found.sort(key=lambda effect: (-effect.flips, -effect.mu_star))
        return Finding(
            evaluation=evaluation, title=title, conflict=str(self.base.findings.conflict[f]),
            harm=float(self.base.harm[f]), effects=tuple(found),
            sentences=tuple(text for text in sentences if text),
        )  # fmt: skip


def _verdicts(trials: Trials) -> "np.ndarray":
    """Return the kind of the conflict that makes each row a failure; "" of one that is none."""
    return np.where(trials.harmful, trials.findings.conflict, "")


def shares(found: Sensitivity) -> list[Share]:
    """Return what each constant and parameter moves in all findings, the most first."""
    of: dict[tuple[str, str], list[Effect]] = {}
    for finding in found.findings:
        for effect in finding.effects:
            of.setdefault((effect.kind, effect.name), []).append(effect)
    moved = []
    for (kind, name), some in of.items():
        flips, tried = (sum(getattr(one, n) for one in some) for n in ("flips", "of"))
        mu_star = sum(one.mu_star for one in some) / len(some)
        alone = sum(one.at_least is not None or one.at_most is not None for one in some)
        moved.append(Share(flips / max(tried, 1), name, kind, flips, tried, mu_star, alone))
    return sorted(moved, key=lambda one: (-one.share, -one.alone, -one.mu_star, one.name))


def in_a_sentence(found: Sensitivity) -> str:
    """Return how many findings stand whatever the constants are."""
    n = len(found.findings)
    hang = sum(bool(finding.sentences) for finding in found.findings)
    if not n:
        return "No verdict was reproduced, so none was analysed"
    if not hang:
        return f"No verdict on {templates.counted(n, 'finding')} hangs on one constant alone"
    return (
        f"Of {templates.counted(n, 'finding')}, {hang} "
        f"{'stands' if hang == 1 else 'stand'} only for some plausible values of a constant"
    )


def _write_page(path: Path, found: Sensitivity) -> None:
    """Write the page: which constant moves which verdict, and which findings hang on one."""
    moved = shares(found)
    drawn = [one for one in moved if one.kind == "constant"]
    words = {one.name: one.words for one in found.constants}
    around = f"of the scenario, ±{percent(found.radius)} of its range"
    templates.write_page(
        path,
        "jobs/search/sensitivity.html",
        title=f"Sensitivity of verdicts: {found.scenario}",
        facts=[
            f"driver {found.ego}",
            templates.counted(len(found.findings), "finding"),
            f"{len(found.constants)} constants",
            f"{found.trajectories} trajectories",
            f"{found.evaluations:,} evaluations",
        ],
        verdict=templates.Banner(f"{in_a_sentence(found)}.{_first(drawn, words)}"),
        has_report=path.with_name(REPORT).is_file(),
        picture=_bars(drawn, words) if drawn else "",
        moved=[
            (
                (one.name, words.get(one.name, around)),
                percent(one.share),
                f"{one.flips} of {one.of}",
                templates.number(one.mu_star),
                str(one.alone) if one.kind == "constant" else "–",
            )
            for one in moved
        ],
        hanging=[
            (f"evaluation {finding.evaluation + 1}", finding.title, "; ".join(finding.sentences))
            for finding in found.findings
            if finding.sentences
        ],
        standing=[
            (f"evaluation {finding.evaluation + 1}", finding.title, f"{finding.harm:.2f}")
            for finding in found.findings
            if not finding.sentences
        ],
        constants=[
            (
                (one.name, one.words),
                _value(one.value, one.unit),
                f"{one.low:g} to {_value(one.high, one.unit)}",
                one.source,
            )
            for one in found.constants
        ],
        not_varied=[*found.not_varied.items()],
    )


def _first(some: Sequence[Share], words: Mapping[str, str]) -> str:
    """Return which constant moves verdicts most; "" if none does."""
    if not some or not some[0].flips:
        return ""
    name = words[some[0].name]
    share = percent(some[0].share)
    return f" {name[0].upper()}{name[1:]} changes a verdict in {share} of trajectories, the most."


def _value(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit in ("1", "×") else f"{value:.4g} {unit}"


def _bars(some: Sequence[Share], words: Mapping[str, str]) -> str:
    """Return a bar for each constant: the share of trajectories in which the verdict changes."""
    most = max(one.share for one in some)
    top = next((end for end in (0.05, 0.1, 0.25, 0.5) if most <= end), 1.0)
    height = 40.0 * len(some)
    plot = charts.Plot((480.0, height + 8.0), (0.0, top), (0.0, 1.0), (4.0, 60.0, 0.0, 0.0))
    for row, one in enumerate(some):
        y = 40.0 * row
        plot.text(4.0, y + 16.0, words[one.name], "start")
        width = max(plot.at(one.share) - plot.left, 1.0)
        title = charts.element("title", f"{one.name}: {one.flips} of {one.of} trajectories")
        plot.add("rect", title, class_="bar", x=4.0, y=y + 21.0, width=width, height=13.0)
        plot.text(10.0 + width, y + 32.0, percent(one.share), "start")
    return plot.svg("Shares of trajectories, by constant", "chart intervals")
