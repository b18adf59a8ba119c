"""How often the intervals of a risk hold the truth, and what estimates cost against counting.

python benchmarks/risk.py coverage [--repeats 400] [--budget 60000] [METHOD …]
python benchmarks/risk.py scenarios FOLDER [--pairs SCENARIO/DRIVER …]
python benchmarks/risk.py rate FOLDER [--pairs SCENARIO/DRIVER …] [--seeds 3] [--budget 1000]
python benchmarks/risk.py known [--repeats 200] [--budget 600]
python benchmarks/risk.py total [--repeats 200] [--budget 30000]
python benchmarks/risk.py near-misses [--repeats 200]

``coverage``: on the analytic problems of the tests, whose probability is known. ``scenarios``: of
catalogue scenarios, with exposures under which harm is rare. The truth is counted without any
estimator: rows that are uniform over the ranges are simulated, and the harmful ones weighted by how
likely they are. ``rate``: failures and rates from one budget (``search --rate``) in the same cases,
beside a search without rates, and Monte Carlo of the same budget. ``known``: how often intervals of
``search --rate`` hold a truth that is known. ``total``: how often the interval
of a sum over scenarios does, with encounters that are counted; ``near-misses``: that of extreme
values. Stopped and started again, it goes on.
"""

import argparse
import importlib.util
import json
import math
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import scipy.stats

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.statistics import clopper_pearson
from bridgegen.jobs.compare.record import distinct, normalised, space_of
from bridgegen.jobs.risk.estimators.problem import Aim
from bridgegen.jobs.risk.estimators.total import (
    DRAWS,
    Part,
    Total,
    rates_of,
    shared_out,
    total_of,
)
from bridgegen.jobs.risk.estimators.weighted import Probability, Weighted, of_weights
from bridgegen.jobs.risk.experiment import estimate
from bridgegen.jobs.risk.extremes import of_near_misses
from bridgegen.jobs.risk.result import Risk
from bridgegen.jobs.risk.risk import estimate_risk
from bridgegen.jobs.search import Run, run_search
from bridgegen.jobs.search.scenarios import load
from bridgegen.results.store import Store
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.reader import UNIFORM, build_exposure
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.search.algorithms.algorithm import Problem, Results
from bridgegen.search.algorithms.rate import Rate
from bridgegen.search.triage.rates import Drawn, how_likely
from bridgegen.search.triage.record import Frequency

TESTS = Path(__file__).parents[1] / "tests/risk/estimators/problems.py"


@dataclass(frozen=True)
class Case:
    """A scenario, a driver, and an exposure that is made up.

    Attributes:
        scenario: of the catalogue.
        driver: of the ego.
        rows: how many are counted.
        deviation: of the parameters that are normal, as a share of their ranges.
        means: of these, likewise, by name; all others are uniform.
    """

    scenario: str
    driver: str
    rows: int
    deviation: float
    means: Mapping[str, float]


CASES = (
    Case("cut-in", "careful", 400_000, 0.1, {"speed_difference": 0.2}),
    Case("cut-in", "route-follower", 400_000, 0.15,
         {"speed_difference": 0.8, "cut_in_distance": 0.2, "change_time": 0.8}),
    Case("lead-brakes", "careful", 400_000, 0.15,
         {"ego_speed": 0.2, "gap": 0.8, "low_speed": 0.8}),
    Case("lead-brakes", "reference", 1_000_000, 0.3, {"gap": 0.3}),
    Case("left-across-path", "careful", 200_000, 0.15,
         {"van_start": 0.8, "van_speed": 0.2, "van_time": 0.2}),
    Case("left-across-path", "route-follower", 200_000, 0.15,
         {"ego_speed": 0.2, "van_speed": 0.8, "van_time": 0.8}),
    Case("emergency-vehicle-on-red", "careful", 200_000, 0.15,
         {"ego_speed": 0.2, "ambulance_start": 0.2, "ambulance_speed": 0.65}),
    Case("emergency-vehicle-on-red", "route-follower", 200_000, 0.15,
         {"ego_speed": 0.2, "ambulance_start": 0.2, "crossing_speed": 0.8}),
    Case("bus-pulls-out", "careful", 200_000, 0.15,
         {"ego_speed": 0.2, "pull_out_distance": 0.5, "trigger_gap": 0.8}),
    Case("bus-pulls-out", "un-r157", 200_000, 0.1,
         {"ego_speed": 0.2, "bus_acceleration": 0.8, "trigger_gap": 0.8}),
    Case("crossroads-s1", "route-follower", 200_000, 0.15,
         {"ego_speed": 0.65, "bv_start": 0.8, "bv_speed": 0.2}),
    Case("red-light-runner", "route-follower", 200_000, 0.15, {"crossing_speed": 0.35}),
)  # fmt: skip
METHODS = ("auto", "importance", "subset")
BUDGET = 200_000


def problems() -> ModuleType:
    """Return the tests' analytic problems."""
    spec = importlib.util.spec_from_file_location("risk_problems", TESTS)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


class Cheap:
    """A screen of an analytic problem, that is wrong: a `Screen`.

    It takes each score for another one, which depends on two others; it is off by half a standard
    deviation; and it knows of nothing where the first score is negative.
    """

    name = "cheap"

    def __init__(self, problem: Any, road: Any, each: int, budget: int) -> None:
        self.evaluations, self.budget, self.each = 0, each * budget, float(each)
        self._problem, self._road = problem, road

    def evaluate(self, U: Any) -> tuple[Results, Any]:
        """See `Screen`."""
        there = np.arange(self.evaluations, self.evaluations + len(U)) < self.budget
        self.evaluations = min(self.evaluations + len(U), self.budget)
        Z = self._road.normal(U)
        score = self._problem.score(0.85 * Z + 0.5 * np.sin(2.0 * np.roll(Z, 1, axis=1))) + 0.5
        score = np.where(Z[:, 0] < 0.0, -3.0, score)
        found = Results.of_F(-score[:, np.newaxis], there)
        return replace(found, critical=(score >= 0.0) & there), there


def of_rate(problem: Any, seed: int, budget: int, each: int = 0) -> Frequency:
    """Return what a search with rates says of an analytic problem, beside a screen or alone."""
    road = problems().AnalyticRoad(problem)
    names = tuple(f"x{k}" for k in range(problem.dimensions))
    screen = Cheap(problem, road, each, budget) if each else None
    algorithm = Rate(Problem(names, road=road, screen=screen), seed)
    score = np.empty(0)
    while len(score) < budget:
        U = algorithm.ask()
        found = problem.score(road.normal(U))
        algorithm.tell(U, replace(Results.of_F(-found[:, np.newaxis]), critical=found >= 0.0))
        score = np.concatenate([score, found])
    drawn = Drawn(algorithm.draws.take(budget), np.arange(budget), problem.share, "")
    return how_likely(drawn, score[:budget] >= 0.0)


COUNTED = {
    "40 rare ones, rates known": (np.full(40, 1.0), np.full(40, 5e-4), 1000, math.inf),
    "40 rare ones, 10 encounters each": (np.full(40, 1.0), np.full(40, 5e-4), 1000, 10.0),
    "20 rarer ones, 1.5 encounters each": (np.full(20, 0.3), np.full(20, 1e-3), 1000, 5.0),
    "12 of all sizes": (np.logspace(-2, 1, 12), np.logspace(-5, -1, 12)[::-1], 2000, 50.0),
    "12, the largest seldom seen": (np.logspace(-2, 1, 12), np.full(12, 3e-4), 1000, 30.0),
    "one": (np.full(1, 1.0), np.full(1, 1e-2), 1000, 20.0),
    "5 common ones": (np.full(5, 1.0), np.full(5, 0.5), 500, 30.0),
}
"""Mixtures of counts: encounters per hour, probabilities, rows of each, and hours."""


def parts_of(found: list[Weighted], rates: Any, hours: float, seed: int) -> Total:
    """Return the sum of what estimators found, with encounters that are counted for some hours."""
    random, parts = np.random.default_rng((seed, 1)), []
    for weighted, rate in zip(found, rates, strict=True):
        drawn = (np.full(DRAWS, rate),) * 2
        if math.isfinite(hours):
            count = int(random.poisson(rate * hours))
            rate, drawn = count / hours, rates_of(count, hours, random)
        there = weighted.there(0.0)
        draws = weighted.draws(there, random, DRAWS)
        parts.append(Part(rate, drawn, weighted.mean(there).estimate, draws))
    return total_of(parts)


def counts(p: Any, rows: int, seed: int) -> list[Weighted]:
    """Return counted rows of each probability."""
    random, none = np.random.default_rng((seed, 0)), np.empty(0, np.int64)
    hits = random.binomial(rows, p)
    one = (1.0, 1.0, 1.0)
    return [
        Weighted(np.zeros((h, 1)), np.zeros((h, 2)), np.full(h, 1.0 / rows), rows, none, 0,
                 1.0 / rows, one, rows)
        for h in hits
    ]  # fmt: skip


def in_rounds(problems: list[Any], rates: Any, budget: int, seed: int) -> list[Weighted]:
    """Return the last round of estimates, whose budgets earlier ones decide."""
    spreads, left = [1.0] * len(problems), budget
    for turn, (share, method) in enumerate(((0.1, "mc"), (0.2, "auto"), (1.0, "auto"))):
        rows = shared_out(int(min(share * budget, left)), spreads, 20)
        found = [
            estimate(method, problem, Aim(0.0, 0.0, n, 0.0), 1000 * seed + 10 * k + turn, None)
            for k, (problem, n) in enumerate(zip(problems, rows, strict=True))
        ]
        left -= sum(one.weighted.evaluations for one in found)
        random = np.random.default_rng((seed, turn))
        spreads = [
            rate * float(one.weighted.draws(one.weighted.there(0.0), random, 1000)[2].std())
            * one.weighted.evaluations**0.5
            for one, rate in zip(found, rates, strict=True)
        ]  # fmt: skip
    return [one.weighted for one in found]


def total(repeats: int, budget: int) -> None:
    """Print how often the interval of a sum over scenarios holds the truth."""
    made = problems()
    print("| scenarios | mean / truth | width / truth | held | low > truth | high < truth |")
    print("|---|---|---|---|---|---|")

    def row(name: str, truth: float, find: Any, repeats: int) -> None:
        found = [find(seed) for seed in range(repeats)]
        mean = np.mean([one.estimate for one in found]) / truth
        width = np.median([one.high - one.low for one in found]) / truth
        above, below = (np.mean([getattr(o, e) * s > truth * s for o in found])
                        for e, s in (("low", 1), ("high", -1)))  # fmt: skip
        print(f"| {name} | {mean:.2f} | {width:.2f} | {1 - above - below:.1%} | {above:.1%} | "
              f"{below:.1%} |", flush=True)  # fmt: skip

    for name, (rates, p, rows, hours) in COUNTED.items():
        of = (rates, p, rows, hours)
        row(name, float(rates @ p), lambda seed, of=of: parts_of(
            counts(of[1], of[2], seed), of[0], of[3], seed), 2 * repeats)  # fmt: skip
    rates = np.array([0.05, 1.3, 0.1, 5.0, 0.3, 20.0])
    six = [made.linear(6, 2.6), made.bent(), made.two_sides(2, 2.4, 2.6), made.linear(6, 3.5),
           made.branches(), made.linear(2, 4.75)]  # fmt: skip
    truth = float(rates @ [one.probability for one in six])
    row("6 problems of 1e-6 to 1e-2, by auto, in rounds", truth, lambda seed: parts_of(
        in_rounds(six, rates, budget, seed), rates, 300.0, seed), repeats)  # fmt: skip


def near_misses(repeats: int) -> None:
    """Print how often the interval of extreme values holds how likely a collision is."""
    print("| margin | rows | probability | median | known | held | below |")
    print("|---|---|---|---|---|---|---|")
    sf = scipy.stats
    cases: dict[str, tuple[Any, float]] = {
        "normal": (lambda r, n: r.normal(2.0, 0.55, n), sf.norm.cdf(-2.0 / 0.55)),
        "Gumbel": (lambda r, n: 2.0 - r.gumbel(0.0, 0.3, n), sf.gumbel_r.sf(2.0 / 0.3)),
        "exponential": (lambda r, n: 3.0 - r.exponential(0.35, n), math.exp(-3.0 / 0.35)),
        "a tenth meets anyone": (
            lambda r, n: np.where(r.random(n) < 0.1, r.normal(1.5, 0.5, n), 9.0),
            0.1 * sf.norm.cdf(-3.0),
        ),
        "never below 0.4 s": (lambda r, n: 0.4 + r.gamma(2.0, 0.8, n), 0.0),
    }
    for name, (draw, truth) in cases.items():
        for rows in (500, 2000, 16_384):
            found = [
                of_near_misses(np.clip(draw(np.random.default_rng(seed), rows), 0.0, 4.0), seed)
                for seed in range(repeats)
            ]
            known = [one for one in found if not one.doubt]
            if not known:
                print(f"| {name} | {rows} | {truth:.2g} | – | 0 % | – | – |")
                continue
            middle = np.median([one.estimate for one in known])
            held = np.mean([one.low <= truth <= one.high for one in known])
            below = np.mean([one.high < truth for one in known])
            said = f"{middle:.2g} | {len(known) / repeats:.0%} | {held:.1%} | {below:.1%}"
            print(f"| {name} | {rows} | {truth:.2g} | {said} |", flush=True)


def coverage(repeats: int, budget: int, methods: list[str]) -> None:
    """Print how often intervals hold the truth, and estimates, of the results that are believed."""
    made = problems()
    cases = {
        "RP22": made.bent, "four branches": made.branches,
        "two sides": lambda: made.two_sides(2, 2.4, 2.6), "constrained": made.constrained,
        "cases": lambda: made.discrete(0.2), "6 dimensions": lambda: made.linear(6, 2.6),
        "20 dimensions": lambda: made.linear(20, 2.6), "rare, 6": lambda: made.linear(6, 4.753),
        "rare, 20": lambda: made.linear(20, 4.753), "RP107": lambda: made.linear(10, 5.0),
        "RP111": made.product, "RP25": made.wedge,
        "two sides, rare": lambda: made.two_sides(6, 4.5, 4.8),
        "plateaus": lambda: made.stairs(6, 4.753), "RP110": made.misleading,
    }  # fmt: skip
    print("| method | problem | probability | mean / truth | spread | believed | below | above |")
    print("|---|---|---|---|---|---|---|---|")
    for method in methods:
        for name, make in cases.items():
            truth, ratios, believed, below, above = make().probability, [], 0, 0, 0
            for seed in range(repeats):
                found = estimate(method, make(), Aim(0.0, 0.0, budget, 0.0), seed, None).weighted
                p = found.probability(0.0)
                if not found.doubts:
                    ratios.append(p.estimate / truth)
                    believed += 1
                    below += p.high < truth
                    above += p.low > truth
            mean, spread = (float(np.mean(ratios)), float(np.std(ratios))) if ratios else (0.0, 0.0)
            share = [f"{one / believed:.1%}" if believed else "–" for one in (below, above)]
            print(
                f"| {method} | {name} | {truth:.3g} | {mean:.3f} | {spread:.3f} | "
                f"{believed} of {repeats} | {share[0]} | {share[1]} |",
                flush=True,
            )


def made_up(case: Case) -> Exposure:
    """Return the exposure of a case."""
    scenario = load(case.scenario)
    text = json.dumps(node(case)).encode()
    return build_exposure(read_plain_yaml(text, "made up"), scenario, None)


def truth(counted: Risk, wanted: Exposure) -> Probability:
    """Return the probability under an exposure, of rows that were drawn from another one."""
    rows = counted.weighted
    X = counted.exposure.from_normal(rows.Z[rows.there(NEAR_MISS) > 0.0])
    likelier = np.exp(wanted.log_density(X) - counted.exposure.log_density(X))
    return of_weights(likelier / rows.rows)


def node(case: Case) -> dict[str, object]:
    """Return the exposure of a case as its file has it."""
    scenario = load(case.scenario)
    assert isinstance(scenario, LogicalScenario)
    normal = {}
    for name, mean in case.means.items():
        one = scenario.parameters[name]
        size = one.high - one.low
        normal[name] = {
            "distribution": "normal", "mean": one.low + mean * size,
            "deviation": case.deviation * size,
        }  # fmt: skip
    return {"source": "Made up for this benchmark.", "others": "uniform", "parameters": normal}


def scenarios(folder: Path, pairs: list[str]) -> None:
    """Print estimates of catalogue scenarios by each method, and by counting."""
    print("| scenario | driver | counted | 95 % | method | estimate | 95 % | evaluations | s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for case in CASES:
        if pairs and f"{case.scenario}/{case.driver}" not in pairs:
            continue
        there = folder / f"{case.scenario}-{case.driver}"
        counted = estimate_risk(
            case.scenario, ego=case.driver, exposure=UNIFORM, event="conflict", method="mc",
            budget=case.rows, precision=0.0, seed=1, out=there / "counted",
        )  # fmt: skip
        wanted = made_up(case)
        true = truth(counted, wanted)
        for method in METHODS:
            start = time.perf_counter()
            found = estimate_risk(
                case.scenario, ego=case.driver, exposure=wanted, event="conflict", method=method,
                budget=BUDGET, out=there / method,
            )  # fmt: skip
            seconds = time.perf_counter() - start
            p = found.probability("conflict")
            cells = [
                case.scenario, case.driver, f"{true.estimate:.3g}",
                f"{true.low:.3g} to {true.high:.3g}",
                method if method != "auto" else f"auto: {found.estimated.method}",
            ]  # fmt: skip
            cells += (
                ["in doubt", found.weighted.doubts[0]]
                if p is None
                else [f"{p.estimate:.3g}", f"{p.low:.3g} to {p.high:.3g}"]
            )
            cells += [f"{found.weighted.evaluations:,}", f"{seconds:.0f}"]
            print(f"| {' | '.join(cells)} |", flush=True)


def rates(folder: Path, pairs: list[str], seeds: int, budget: int) -> None:
    """Print failures and intervals of one budget, beside those of a search and of Monte Carlo."""
    print(
        "| scenario | driver | seed | P(harm) | 95 % | Monte Carlo's width | failures | distinct |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for case in CASES:
        if pairs and f"{case.scenario}/{case.driver}" not in pairs:
            continue
        there = folder / f"{case.scenario}-{case.driver}"
        there.mkdir(parents=True, exist_ok=True)
        (file := there / "exposure.yaml").write_text(
            json.dumps({"exposure_of": case.scenario, "exposure": node(case)})
        )
        for seed in range(seeds):
            cells = [case.scenario, case.driver, str(seed)]
            counts = []
            for name, more in (("rate", {"exposure": file}), ("search", {})):
                if not (out := there / f"{name}-{seed}").exists():
                    run_search(
                        case.scenario, ego=case.driver, objective={"harm": 1.0}, budget=budget,
                        seed=seed, triage="none", keep=0, out=out, **more,
                    )  # fmt: skip
                run, space = Run(out), space_of(out)
                with Store.open(out) as store:
                    rows = store.read()
                at = np.flatnonzero(rows.critical)
                new = distinct(normalised(space, rows.X[at]), n_var=space.n_var)
                counts.append((len(at), int(new.sum())))
                if run.triage is not None and run.triage.rate is not None:
                    p = run.triage.rate.harm
                    low, high = clopper_pearson(round(budget * (p.estimate or 0.0)), budget)
                    cells += [
                        "in doubt" if p.estimate is None else f"{p.estimate:.2g}",
                        f"{p.low:.2g} to {p.high:.2g}", f"{high - low:.2g}",
                    ]  # fmt: skip
            cells += [" / ".join(str(count[k]) for count in counts) for k in range(2)]
            print(f"| {' | '.join(cells)} |", flush=True)


def known(repeats: int, budget: int, each: int) -> None:
    """Print how often intervals of ``search --rate`` hold the truth, on analytic problems."""
    made = problems()
    cases = {
        "half space, 6": lambda: made.linear(6, 2.6), "half space, 4": lambda: made.linear(4, 1.6),
        "two sides, 4": lambda: made.two_sides(4, 2.4, 2.6),
        "constrained": made.constrained,
    }  # fmt: skip
    print("| problem | probability | mean / truth, spread | believed | below | above | width |")
    print("|---|---|---|---|---|---|---|")
    for name, make in cases.items():
        problem, ratios, sides, widths = make(), [], [], []
        p = problem.probability
        for seed in range(repeats):
            found = of_rate(problem, seed, budget, each)
            if found.estimate is not None:
                ratios.append(found.estimate / p)
                sides.append((found.high < p, found.low > p))
                widths.append(found.high - found.low)
            else:
                sides.append((found.high < p, False))
        below, above = np.mean(sides, axis=0)
        low, high = clopper_pearson(budget * p, budget)
        width = np.median(widths) / (high - low) if widths else np.nan
        print(
            f"| {name} | {p:.3g} | {np.mean(ratios):.2f}, {np.std(ratios):.2f} | {len(ratios)} of "
            f"{repeats} | {below:.1%} | {above:.1%} | {width:.2f} |",
            flush=True,
        )


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = parser.add_subparsers(dest="what", required=True)
    one = parts.add_parser("coverage")
    one.add_argument("methods", nargs="*", default=["mc", "subset", "importance", "stratified"])
    one.add_argument("--repeats", type=int, default=400)
    one.add_argument("--budget", type=int, default=60_000)
    both = parts.add_parser("rate")
    both.add_argument("folder", type=Path)
    both.add_argument("--pairs", nargs="*", default=[])
    both.add_argument("--seeds", type=int, default=3)
    both.add_argument("--budget", type=int, default=1000)
    sure = parts.add_parser("known")
    sure.add_argument("--repeats", type=int, default=200)
    sure.add_argument("--budget", type=int, default=600)
    sure.add_argument("--screen", type=int, default=0)
    sums = parts.add_parser("total")
    sums.add_argument("--repeats", type=int, default=200)
    sums.add_argument("--budget", type=int, default=30_000)
    parts.add_parser("near-misses").add_argument("--repeats", type=int, default=200)
    other = parts.add_parser("scenarios")
    other.add_argument("folder", type=Path)
    other.add_argument("--pairs", nargs="*", default=[])
    given = parser.parse_args()
    if given.what == "coverage":
        coverage(given.repeats, given.budget, given.methods)
    elif given.what == "rate":
        rates(given.folder, given.pairs, given.seeds, given.budget)
    elif given.what == "known":
        known(given.repeats, given.budget, given.screen)
    elif given.what == "total":
        total(given.repeats, given.budget)
    elif given.what == "near-misses":
        near_misses(given.repeats)
    else:
        scenarios(given.folder, given.pairs)


if __name__ == "__main__":
    main()
