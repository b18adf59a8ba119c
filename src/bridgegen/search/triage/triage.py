"""From a run's rows to findings: modes, their neighbours, minimal scenarios, and a bound."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.happening import Happening
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.assess.conflict.quantities import HARM
from bridgegen.assess.metrics import OF_BASELINE
from bridgegen.base.arrays import Bool, Float, Int, Numbers
from bridgegen.engine.evaluation import Evaluation
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.trials import EVENT
from bridgegen.results.store import Recorded, Rows
from bridgegen.scenario.language.prior import surprise
from bridgegen.scenario.odd.bounding import OddBound
from bridgegen.search.triage.bound import (
    CONTACT,
    UNBIASED,
    NotCounted,
    bound,
    estimate,
    least_margins,
)
from bridgegen.search.triage.effort import FULL, Effort
from bridgegen.search.triage.fresh import draw
from bridgegen.search.triage.influence import influences
from bridgegen.search.triage.judgement import judgement
from bridgegen.search.triage.minimal import Minimiser
from bridgegen.search.triage.modes import (
    Group,
    Key,
    by_frequency,
    by_harm,
    group,
    keys_of,
    rekeyed,
    title,
    where,
)
from bridgegen.search.triage.moves import searched
from bridgegen.search.triage.neighbours import NEIGHBOURS, RADIUS, AsIs, neighbourhoods
from bridgegen.search.triage.rates import Drawn as DrawnRows
from bridgegen.search.triage.rates import how_likely
from bridgegen.search.triage.record import (
    MOST_EXAMPLES,
    MOST_MODES,
    Drawn,
    Estimate,
    Frequency,
    FreshRows,
    Met,
    Minimal,
    Mode,
    Neighbourhood,
    PerAmount,
    Rate,
    Repeated,
    StepCheck,
    Triage,
)
from bridgegen.search.triage.repeats import repeated
from bridgegen.search.triage.time_steps import step_checks
from bridgegen.search.triage.what_happened import COPY, apart, distinct, of_events, of_results

SAME = 0.05
"""Harm that makes no difference between findings, of which one is in weather that is met more."""

_SAMPLE = 18  # stream of random numbers, apart from others of the same seed


@dataclass(frozen=True, eq=False)
class Triaged:
    """The result of the triage of a run.

    Attributes:
        record: the findings, without names of files.
        exports: positions of the rows to export, best first.
    """

    record: Triage
    exports: tuple[int, ...]


def triage(
    pipeline: Pipeline,
    rows: Rows | Recorded,
    *,
    algorithm: str,
    seed: int,
    keep: int,
    chosen: Sequence[int] | None = None,
    effort: Effort = FULL,
    domain: str = "",
    drawn: DrawnRows | None = None,
    repeats: int = 1,
    known: Sequence[Repeated] = (),
) -> Triaged:
    """Group a run's harmful rows into failure modes, and test the robustness of each finding.

    The result depends on the seed and the effort only, to the last bit.

    Args:
        pipeline: of the run.
        rows: all evaluations.
        algorithm: of the run; only rows of "random" and "sobol" estimate shares of the space.
        seed: of the run.
        keep: how many scenarios to export.
        chosen: positions of the rows to export, best first, where something else than harm chooses
            them; the harmful ones among them are tested.
        effort: how much is tested.
        domain: a sentence if the driver is not made for the scenario.
        drawn: the rows as they were drawn, of a run that estimates rates.
        repeats: how often a finding is evaluated again at most, to estimate how likely it fails; 1:
            not at all.
        known: repeats of an earlier triage of the same run.
    """
    made = _Triage(pipeline, rows, algorithm, seed, keep, chosen, effort, domain, drawn)
    made.repeats, made.again = repeats, {item.evaluation: item for item in known}
    return made.run()


def harmful_rows(
    metrics: Numbers, names: Sequence[str], harm: str, status: npt.NDArray[Any], findings: Findings
) -> tuple[Bool, Float]:
    """Return which rows are a failure of the ego, ``(N,)``, and the harm of each, ``(N,)``.

    Independently of the objective, a row is harmful if it has a result, plausible traffic and a
    harm of at least 0.3. Without recorded harm no row is harmful.

    Args:
        metrics: ``(N, M)``.
        names: of the M columns.
        harm: the quantity, "harm" or "harm_any".
        status: ``(N,)``, 0 is success.
        findings: of N rows.
    """
    if harm not in names:
        return np.zeros(len(metrics), np.bool_), np.zeros(len(metrics))
    values = np.nan_to_num(metrics[:, list(names).index(harm)], nan=0.0)
    plausible: Bool = np.array(findings.implausible == "", dtype=np.bool_).reshape(len(values))
    return (status == 0) & plausible & (values >= NEAR_MISS), values


class _Triage:
    """One call of `triage`; positions are those among all rows unless stated otherwise."""

    repeats: int
    again: dict[int, Repeated]

    def __init__(
        self,
        pipeline: Pipeline,
        rows: Rows | Recorded,
        algorithm: str,
        seed: int,
        keep: int,
        chosen: Sequence[int] | None,
        effort: Effort,
        domain: str,
        drawn: DrawnRows | None,
    ) -> None:
        self._drawn = drawn
        self._effort, self._tests = effort, pipeline.tries and effort.tests
        self._pipeline, self._rows, self._space = pipeline, rows, pipeline.space
        self._algorithm, self._seed, self._keep = algorithm, seed, keep
        self._chosen, self._domain = chosen, domain
        harmful, self._harm = self._counted(rows)
        self._at = np.flatnonzero(harmful)
        self._U: Float = rows.U[self._at]
        self._found: dict[int, Neighbourhood] = {}
        self._as_is: AsIs = {}
        self._steps: dict[int, StepCheck] = {}
        self._unrecorded = 0
        self._preventable: dict[int, bool | None] = {}
        self._event: Float = np.zeros((0, len(EVENT)))

    def _counted(self, rows: Rows | Recorded | Evaluation) -> tuple[Bool, Float]:
        """Return which rows are a failure that counts in this run, and the harm of each."""
        pipeline = self._pipeline
        of = rows.metrics, pipeline.metrics, pipeline.objective.harm, rows.status, rows.findings
        harmful, harm = harmful_rows(*of)
        # A search for one cause has found only what is critical for it.
        if pipeline.cause is not None:  # harm of another cause does not count
            harmful &= rows.critical
        if pipeline.baseline is not None:  # nor does what the baseline's driver fails in, too
            harmful &= ~_baseline_fails(pipeline, rows)
        return harmful, harm

    def run(self) -> Triaged:
        """Run the stages."""
        rows, tests = self._rows, self._tests
        U, harm = self._U, self._harm[self._at]
        place = self._places(U) if tests else [""] * len(self._at)
        quick = [Cause(item).label for item in rows.cause[self._at].tolist()]
        kinds = self._pipeline.runner.kinds
        keys = keys_of(rows.findings.take(self._at), kinds, place, quick)
        every = group(keys, harm, U)
        self._unrecorded = len(every[MOST_MODES:])
        groups = every[:MOST_MODES]
        shown = [int(item.rows[0]) for item in groups]
        if tests:
            shown = self._test_robustness(groups, U, harm)
        exports = self._choose(shown, U, harm)
        if self.repeats > 1:
            exports = self._repeat(exports, shown, harm)
        tested = list(dict.fromkeys([*exports, *shown[: self._effort.tested]]))
        sample = self._sample(tested) if tests else []
        if tests:
            self._test(tested, sampled=False)
            self._test(sample, sampled=True)
        groups, shown = self._by_tested_cause(groups, shown, U, harm)
        order = sorted(range(len(groups)), key=lambda k: self._rank(shown[k], harm))
        if self.repeats > 1:  # equal ones stay as they are
            order.sort(key=lambda k: self._risk(groups[k], shown[k]))
        groups, shown = [groups[k] for k in order], [shown[k] for k in order]
        minimal = self._minimal(groups, shown) if tests else [None] * len(groups)
        record = self._record(groups, shown, exports, tested, sample, minimal)
        return Triaged(record, tuple(self._at[exports].tolist()))

    # Stages; positions are those among the harmful rows.

    def _places(self, U: Float) -> list[str]:
        """Return where on its route each harmful row fails; keep what happened in it."""
        order = by_harm(self._harm[self._at], U)
        first, rest = np.split(order, [self._effort.placed])
        place = np.full(len(order), "", dtype=object)
        trials = self._pipeline.try_all(self._rows.X[self._at[first]])
        # Recorded rows do not say where on the route they failed, so the worst ones are simulated
        # once more; the others take the place of their nearest row of the same kind.
        place[first] = trials.place
        self._preventable = dict(zip(first.tolist(), trials.avoidable, strict=True))
        if not len(rest):
            self._event = trials.event[np.argsort(first)]
        else:
            from scipy.spatial import cKDTree

            findings = self._rows.findings.take(self._at)
            kinds, blank = self._pipeline.runner.kinds, [""] * len(order)
            keys = keys_of(findings, kinds, blank, blank)
            known: dict[Key, list[int]] = {}
            for i in first.tolist():
                known.setdefault(keys[i], []).append(i)
            trees = {key: cKDTree(U[members]) for key, members in known.items()}
            for i in rest.tolist():
                if keys[i] in trees:
                    place[i] = place[known[keys[i]][int(trees[keys[i]].query(U[i])[1])]]
        return place.tolist()

    def _happened(self) -> Float:
        """Return coordinates in which rows are near if the same happened in them."""
        if len(self._event) == len(self._at):
            return of_events(self._event)
        at = self._at
        return of_results(self._rows.metrics[at], self._rows.findings.take(at))

    def _test_robustness(self, groups: Sequence[Group], U: Float, harm: Float) -> list[int]:
        """Simulate neighbours of the worst rows; return the row that represents each mode."""
        # By what happened, not by parameters: drivers that do not look do not depend on weather,
        # and 41 of 716 exports were one event under other weather.
        events = self._happened()
        worst = [distinct(events, item.rows, self._effort.per_mode) for item in groups]
        every = by_harm(harm, U)
        several = distinct(events, every, self._effort.spare * max(self._keep, 1))
        self._simulate(dict.fromkeys(i for some in (*worst, several) for i in some), fixes=False)
        while True:  # a next best one is checked only where the best depends on the time step
            best = [self._best(some, harm) for some in worst]
            if not self._check_steps(best):
                return best

    def _choose(self, shown: Sequence[int], U: Float, harm: Float) -> list[int]:
        """Return the rows to export, one of each mode and others: robust ones first, then harm."""
        if self._chosen is not None:
            known = {at: i for i, at in enumerate(self._at.tolist())}
            return [known[at] for at in self._chosen if at in known]
        critical = self._rows.critical[self._at]
        first = sorted((i for i in shown if critical[i]), key=lambda i: self._rank(i, harm))
        events = self._happened()
        # In nine runs of the default algorithm 14 of 70 exports were copies of others.
        first = [i for k, i in enumerate(first) if not _is_copy(events, i, first[:k])]
        first = first[: self._keep]
        every = by_harm(harm, U)
        tried = [i for i in every.tolist() if i in self._found and critical[i]]
        tried.sort(key=lambda i: self._rank(i, harm))
        more = distinct(events, np.array(tried, dtype=np.int64), self._keep, first)
        if len(first) + len(more) < self._keep:  # rows of unknown robustness
            kept = [*first, *more]
            more += distinct(events, every[critical[every]], self._keep, kept)
            self._simulate([i for i in more if self._tests and i not in self._found], fixes=False)
        if self._tests:
            self._check_steps([*first, *more])
        return sorted([*first, *more], key=lambda i: self._rank(i, harm))

    def _repeat(self, exports: Sequence[int], shown: Sequence[int], harm: Float) -> list[int]:
        """Evaluate findings again; return the rows to export, the likeliest and worst first."""
        rows, chosen = self._rows, self._chosen or ()
        some = self._at[list(dict.fromkeys([*exports, *shown, *self._found]))].tolist()
        failed = np.isin(np.arange(len(rows.id)), [*self._at, *chosen])
        # What passed once may fail: those that came nearest, so that no flaky one is called safe.
        passed = np.flatnonzero((rows.status == 0) & ~_implausible(rows) & ~failed)
        beside = passed[np.argsort(-self._harm[passed], kind="stable")][: self._keep].tolist()
        at = list(dict.fromkeys([*chosen, *some, *beside]))
        ids = zip(rows.id[at].tolist(), failed[at].tolist(), strict=True)
        first = [self.again.get(i) or Repeated(evaluation=i, failed=has) for i, has in ids]
        self.again = repeated(self._pipeline, rows.X[at], first, self.repeats, self._fails)
        key = {i: -self._chance([i]) * float(harm[i]) for i in exports}
        return list(exports) if chosen else sorted(exports, key=key.__getitem__)

    def _fails(self, evaluation: Evaluation) -> Bool:
        """Return which rows of an evaluation fail: by harm, or by what else chooses exports."""
        harmful = self._counted(evaluation)[0]
        return harmful if self._chosen is None else harmful | evaluation.critical

    def _chance(self, some: Sequence[int]) -> float:
        """Return P(fail) of the repeated ones of some harmful rows, on average; 1 without any."""
        ids = self._rows.id[self._at[list(some)]].tolist()
        known = [self.again[i].probability for i in ids if i in self.again]
        return sum(known) / len(known) if known else 1.0

    def _risk(self, item: Group, i: int) -> tuple[float, float]:
        """Return the sort key of modes by P(fail) × severity × exposure; equal ones by harm."""
        # Exposure: how often its weather is met. A share of the space contains P(fail) already.
        bands = self._space.bands(self._space.values(self._rows.X[self._at[i]]))
        likely = self._chance(item.rows.tolist()) * math.exp(-surprise(bands))
        return -likely * self._severity(item), -likely * float(self._harm[self._at[i]])

    def _sample(self, tested: Sequence[int]) -> list[int]:
        """Return some of the harmful rows that are not tested yet, drawn at random."""
        rest = np.setdiff1d(np.arange(len(self._at)), tested)
        rest = rest[np.argsort(self._rows.id[self._at[rest]])]
        random = np.random.Generator(np.random.PCG64([self._seed, _SAMPLE]))
        drawn = random.permutation(len(rest))[: self._effort.sampled]
        return rest[np.sort(drawn)].tolist()  # type: ignore[no-any-return]

    def _test(self, at: Sequence[int], *, sampled: bool) -> None:
        """Simulate neighbours with every fix, if causes are determined."""
        if self._pipeline.seeks_causes:
            self._simulate(at, fixes=True, sampled=sampled)
        else:
            self._simulate([i for i in at if i not in self._found], fixes=False, sampled=sampled)

    def _simulate(self, at: Any, *, fixes: bool, sampled: bool = False) -> None:
        rows = self._at[np.array(list(at), dtype=np.int64)]
        results = neighbourhoods(
            self._pipeline,
            self._rows.X[rows],
            self._rows.id[rows],
            self._seed,
            fixes=fixes,
            sampled=sampled,
            as_is=self._as_is,
        )
        self._found |= dict(zip(at, results, strict=True))

    def _check_steps(self, at: Sequence[int]) -> bool:
        """Simulate rows at fractions of the time step; return whether there were new ones."""
        new = [i for i in dict.fromkeys(at) if i not in self._steps]
        rows = self._at[np.array(new, dtype=np.int64)]
        X, ids = self._rows.X[rows], self._rows.id[rows]
        found = step_checks(self._pipeline, X, ids, self._effort.finer)
        self._steps |= dict(zip(new, found, strict=True))
        return bool(new)

    def _is_flaky(self, i: int) -> bool:
        """Whether repeats change the verdict on a row: then a finer step is not why it changes."""
        again = self.again.get(int(self._rows.id[self._at[i]]))
        return again is not None and not again.agrees

    def _unharmed(self) -> list[StepCheck]:
        """Check rows without failure, evenly spread over the run."""
        rows, rest = self._rows, np.ones(len(self._rows.id), np.bool_)
        rest[self._at] = False
        rest &= (rows.status == 0) & ~_implausible(rows)
        some = np.flatnonzero(rest)
        some = some[np.argsort(rows.id[some])]
        n = min(len(some), self._effort.unharmed)
        at = some[np.linspace(0, len(some) - 1, n).astype(np.int64)] if n else some[:0]
        return step_checks(self._pipeline, rows.X[at], rows.id[at], self._effort.finer)

    def _doubts(self, i: int) -> tuple[bool, bool]:
        """Return whether a row's verdict depends on the time step, and whether it is knife-edge."""
        hangs = i in self._steps and not self._steps[i].stable and not self._is_flaky(i)
        return hangs, i in self._found and self._found[i].knife_edge

    def _rank(self, i: int, harm: Float) -> tuple[Any, ...]:
        """Return the sort key of findings: stable and robust ones first, then the worst."""
        return *self._doubts(i), *self._met(i, harm), -float(harm[i]), *self._U[i].tolist()

    def _best(self, some: Sequence[int], harm: Float) -> int:
        """Return the row that stands for its mode, of some, the worst first."""
        return min(some, key=lambda i: (*self._doubts(i), *self._met(i, harm), some.index(i)))

    def _met(self, i: int, harm: Float) -> tuple[int, float]:
        """Return a sort key: of about the same harm, weather that is met most comes first."""
        bands = self._space.bands(self._space.values(self._rows.X[self._at[i]]))
        return (-round(float(harm[i]) / SAME), surprise(bands)) if bands else (0, 0.0)

    def _by_tested_cause(
        self, groups: Sequence[Group], shown: Sequence[int], U: Float, harm: Float
    ) -> tuple[list[Group], list[int]]:
        """Give modes the tested cause; modes that are then equal are merged."""
        keys = []
        for item, i in zip(groups, shown, strict=True):
            cause = self._found[i].cause if i in self._found else ""
            keys.append(item.key._replace(cause=cause) if cause else item.key)
        joined = rekeyed(groups, keys, harm, U)
        held = np.zeros(len(harm), dtype=np.int64)
        for k, item in enumerate(joined):
            held[item.rows] = k
        of_each: list[list[int]] = [[] for _ in joined]
        for i in shown:
            of_each[int(held[i])].append(i)
        return joined, [min(some, key=lambda i: self._rank(i, harm)) for some in of_each]

    def _minimal(self, groups: Sequence[Group], shown: Sequence[int]) -> list[Minimal | None]:
        """Return the minimal scenarios of the first modes; one for modes that differ only in cause.

        With an adversary there are none: its decisions have no useful nominal values.
        """
        found: list[Minimal | None] = [None] * len(groups)
        first: dict[Any, int] = {}
        for k, item in enumerate(groups if not self._space.decisions else ()):
            # `way` is a key without its cause: a minimal scenario keeps how the ego fails, whatever
            # causes it.
            first.setdefault((item.key.way, item.part), k)
        at = list(first.values())[: self._effort.minimal]
        if at:
            X = self._rows.X[self._at[np.array([shown[k] for k in at], dtype=np.int64)]]
            ways, names = [groups[k].key.way for k in at], [f"minimal-{k + 1:02d}" for k in at]
            results = Minimiser(self._pipeline, self._seed, self._effort).find(X, ways, names)
            for k, minimal in zip(at, results, strict=True):
                found[k] = minimal
        return found

    def _shares(self, groups: Sequence[Group]) -> tuple[Estimate, list[Estimate], FreshRows | None]:
        """Return the harmful share of the space, that of each mode, and the fresh rows drawn."""
        rows = self._rows
        met: Met = any(self._space.parameters[name].prior for name in self._space.variables)
        if met and _is_narrowed(self._pipeline):
            met = "within"
        drawn_of = partial(estimate, met=met)
        fit = int(((rows.status == 0) & ~_implausible(rows)).sum())
        # Only rows that were drawn without regard to results estimate a share. Of a particle
        # swarm's leaves that are 80 to 100 % critical, 2 to 98 % of random scenarios are.
        if self._algorithm in UNBIASED:
            drawn: Drawn = "sobol" if self._algorithm == "sobol" else "random"
            each = [drawn_of(drawn, len(item.rows), fit) for item in groups]
            return drawn_of(drawn, len(self._at), fit), each, None
        n = self._effort.fresh
        is_possible = self._tests and self._pipeline.cause is None
        if not (n and is_possible and self._space.n_var):
            return estimate("", 0, 0), [estimate("", 0, 0) for _ in groups], None
        U, X = draw(self._space, self._seed, n)
        results = self._pipeline.try_all(X)
        kinds = self._pipeline.runner.kinds
        keys = keys_of(results.findings, kinds, results.place.tolist(), [""] * n)
        mode = [0] * n
        own = self._U
        for i in np.flatnonzero(results.harmful).tolist():
            same = [k for k, item in enumerate(groups) if item.key.way == keys[i]]
            if same:  # of several that differ in cause, the one with the nearest row
                gaps = [float(((own[groups[k].rows] - U[i]) ** 2).sum(axis=1).min()) for k in same]
                mode[i] = same[int(np.argmin(gaps))] + 1
        ok = int(results.ok.sum())
        harm = zip(results.harm.tolist(), results.ok.tolist(), strict=True)
        fresh = FreshRows(
            harm=tuple(item if has else None for item, has in harm),
            mode=tuple(mode),
        )
        each = [drawn_of("fresh", mode.count(k), ok) for k in range(1, len(groups) + 1)]
        return drawn_of("fresh", int(results.harmful.sum()), ok), each, fresh

    def _record(
        self,
        groups: Sequence[Group],
        shown: Sequence[int],
        exports: Sequence[int],
        tested: Sequence[int],
        sample: Sequence[int],
        minimal: Sequence[Minimal | None],
    ) -> Triage:
        rows, pipeline = self._rows, self._pipeline
        space, shares, fresh = self._shares(groups)
        ids = rows.id[self._at]
        order = self._at[exports].tolist() if self._chosen is None else list(self._chosen)
        self._judge([*tested, *sample, *shown])
        names = {i: f"{order.index(self._at[i]) + 1:04d}" for i in exports}
        modes = []
        for k, (item, i) in enumerate(zip(groups, shown, strict=True), start=1):
            members = np.isin(exports, item.rows).tolist()
            kept = [names[j] for j, has in zip(exports, members, strict=True) if has and j != i]
            near = self._found.get(i)
            rules = by_frequency(rows.findings.rule[self._at[item.rows]].tolist())
            modes.append(
                Mode(
                    number=k,
                    title=self._title(item, groups, [rule for rule, _ in rules]),
                    **item.key._asdict(),
                    rule=rules[0][0],
                    rules=rules,
                    judgement=self._judgement(i, item.key.cause),
                    tested=near is not None and near.cause != "",
                    count=len(item.rows),
                    space=shares[k - 1],
                    harm=float(self._harm[self._at[item.rows]].max()),
                    severity=self._severity(item),
                    worst=int(ids[item.rows[0]]),
                    shown=int(ids[i]),
                    robustness=None if near is None else near.robustness,
                    examples=tuple(ids[item.rows[:MOST_EXAMPLES]].tolist()),
                    exports=(*([names[i]] if i in names else []), *kept),
                    minimal=minimal[k - 1],
                    probability=self._how_likely(self._at[item.rows]),
                )
            )
        of = {i: k for k, g in enumerate(groups, 1) for i in ids[g.rows].tolist()}
        again = [item.model_copy(update={"mode": of.get(i, 0)}) for i, item in self.again.items()]
        ok = rows.status == 0
        implausible = _implausible(rows)
        known = [self._found[i] for i in dict.fromkeys([*tested, *sample]) if i in self._found]
        untested, baseline = "", pipeline.baseline.driver.label if pipeline.baseline else ""
        if not pipeline.tries:
            untested = "neighbours are simulated in the embedded simulator only"
        elif not self._tests:
            untested = "neighbours were not simulated (--triage none)"
        return Triage(
            scenario=pipeline.scenario.name, ego=pipeline.driver.label,
            baseline=baseline, count=pipeline.objective.count,
            results=rows.digest(), seed=self._seed,
            neighbours=NEIGHBOURS if self._tests else 0, radius=RADIUS, sampled=len(sample),
            bound=bound(
                evaluations=len(ok),
                besides=NotCounted.of(
                    rows.findings.take(slice(None)), self._harm, ok,
                    self._avoids if self._tests else None,
                ),
                happening=Happening.of(rows.findings.happened, self._domain),
                harmful=len(self._at), space=space,
                least=least_margins(
                    rows.metrics, pipeline.metrics, self._harm, rows.id, ok & ~implausible,
                ),
                modes=len(modes), ego=pipeline.driver.label, baseline=baseline,
                in_repeats=sum(item.fails > 0 and not item.failed for item in again),
            ),
            modes=tuple(modes), unrecorded_modes=self._unrecorded,
            neighbourhoods=tuple(known),
            influences=influences(
                self._space, rows.X, np.isin(np.arange(len(ok)), self._at), ok & ~implausible
            ),
            untested=untested, fresh=fresh, rate=self._rate(),
            step_checks=tuple(
                [
                    self._steps[i] for i in dict.fromkeys([*shown, *exports])
                    if i in self._steps and not self._is_flaky(i)
                ]
                + (self._unharmed() if self._tests else [])
            ),
            repeated=tuple(again),
        )  # fmt: skip

    def _how_likely(self, at: Int) -> Frequency | None:
        """Return how likely one of some rows is, where the run estimates it."""
        if self._drawn is None:
            return None
        happens = np.zeros(len(self._rows.id), np.bool_)
        happens[at] = True
        return how_likely(self._drawn, happens)

    def _rate(self) -> Rate | None:
        """Return how likely harm is, where the run estimates it."""
        if (harm := self._how_likely(self._at)) is None or self._drawn is None:
            return None
        priors = [self._space.parameters[name].prior for name in self._space.variables]
        per = []
        for unit, met in self._drawn.met.items():
            some = met.of_which(harm.estimate or 0.0, harm.low, harm.high)
            per.append(
                PerAmount(
                    unit=unit,
                    estimate=None if harm.estimate is None else some.estimate,
                    low=some.low,
                    high=some.high,
                )
            )
        return Rate(
            harm=harm, source=self._drawn.source, met=any(priors), per=tuple(per),
            rows=len(self._drawn.ids), road=float(self._drawn.draws.road.sum()),
            left=self._drawn.left,
        )  # fmt: skip

    def _avoids(self, at: Int) -> Bool:
        """Return in which of the first of some rows a careful driver has no collision."""
        X = self._rows.X[at[: self._effort.placed]]
        fixes = enumerate(self._pipeline.runner.fixes)
        careful = [number for number, fix in fixes if fix.cause == Cause.PLANNING]
        avoided = np.zeros(len(X), np.bool_)
        for number in careful:
            found = self._pipeline.try_all(X, fix=np.full(len(X), number))
            avoided |= found.ok & ~found.harmful & (found.findings.conflict != CONTACT)
        return avoided if careful else avoided[:0]

    def _judge(self, at: Sequence[int]) -> None:
        """Put the judgement of some rows on record, for which each is simulated once more."""
        rest = [i for i in dict.fromkeys(at) if i not in self._preventable] if self._tests else []
        if rest:
            trials = self._pipeline.try_all(self._rows.X[self._at[rest]])
            self._preventable |= dict(zip(rest, trials.avoidable, strict=True))
        for i, near in self._found.items():
            if near.cause:
                text = self._judgement(i, near.cause)
                self._found[i] = near.model_copy(update={"judgement": text})

    def _judgement(self, i: int, cause: str) -> str:
        if cause == "sensitive" and self._is_flaky(i):  # its parameters need not change for that
            again = self.again[int(self._rows.id[self._at[i]])]
            passes = f"{again.repeats - again.fails} of {again.repeats} repeats"
            return f"root cause not known: the same scenario passes in {passes}"
        return judgement(
            cause,
            self._found.get(i),
            preventable=self._preventable.get(i),
            responsible=str(self._rows.findings.responsible[self._at[i]]),
        )

    def _severity(self, item: Group) -> float:
        names = self._pipeline.metrics
        if "severity" not in names:
            return 0.0
        column = self._rows.metrics[self._at[item.rows], names.index("severity")]
        return float(np.nan_to_num(column, nan=0.0).max())

    def _title(self, item: Group, groups: Sequence[Group], rules: Sequence[str]) -> str:
        """Return a mode in words; a cluster also with the parameter that separates it."""
        left = self._pipeline.runner.left_hand
        text = title(item.key, rules, self._pipeline.objective.count, left_hand=left)
        others = [g.rows for g in groups if g is not item and g.key == item.key]
        if not item.part or not others:
            return text
        names, at = self._space.variables, self._at
        X, rest = (
            searched(self._space, self._rows.X[at[rows]])
            for rows in (item.rows, np.concatenate(others))
        )
        found = where(X, rest, names)
        if found is None:
            return text
        k, low, high = found
        parameter = self._space.parameters[names[k]]
        unit = "" if parameter.unit in ("1", "count", "?") else f" {parameter.unit}"
        return f"{text}, {names[k]} {parameter.kind.span_text(low, high, '{:.3g}'.format, unit)}"


def _baseline_fails(pipeline: Pipeline, rows: Rows | Recorded | Evaluation) -> Bool:
    """Return which rows the baseline's driver fails in, ``(N,)``, or has no usable result of."""
    column = rows.metrics[:, pipeline.metrics.index(f"{OF_BASELINE}{HARM}")]
    # Written so that a baseline without a result counts as failing: the row shows no difference.
    fails: Bool = ~(np.nan_to_num(column, nan=1.0) < NEAR_MISS)
    return fails | ~rows.critical if pipeline.objective.rule == "harm" else fails


def _is_copy(events: Float, i: int, others: Sequence[int]) -> bool:
    """Return whether the same happened in a row as in one of some others."""
    return bool((apart(events[list(others)], events[i]) < COPY).any())


def _is_narrowed(pipeline: Pipeline) -> bool:
    """Return whether a parameter is searched in a part of what its prior spans."""
    space, priors = pipeline.space, set()
    for name, parameter in space.parameters.items():
        if prior := parameter.prior:
            priors.add(name)
            if name in space.fixed or (parameter.low, parameter.high) != (prior.low, prior.high):
                return True
    constant = any(not rule.names for name in priors for rule in space.bounds[name])
    return constant or any(
        isinstance(rule, OddBound) and priors & {rule.target, *rule.names}
        for rule in (*space.constraints.bounds, *pipeline.scenario.checks)
    )


def _implausible(rows: Rows | Recorded) -> Bool:
    marked: Bool = np.array(rows.findings.implausible != "", dtype=np.bool_).reshape(len(rows.id))
    return marked
