"""How often the intervals of a risk hold the truth, and what estimates cost against counting.

python benchmarks/risk.py coverage [--repeats 400] [--budget 60000] [METHOD …]
python benchmarks/risk.py scenarios FOLDER [--count 400000] [--pairs SCENARIO/DRIVER …]

``coverage``: on the analytic problems of the tests, whose probability is known. ``scenarios``: of
catalogue scenarios, with each parameter normal around its default and so narrow that harm is rare.
The truth is counted without any estimator: rows that are uniform over the ranges are simulated, and
the harmful ones weighted by their density. Stopped and started again, it goes on.
"""

import argparse
import importlib.util
import json
import sys
import time
from pathlib import Path
from types import ModuleType

import numpy as np

from bridgegen.campaign.scenarios import load
from bridgegen.conflict.harm import NEAR_MISS
from bridgegen.exposure import Exposure
from bridgegen.exposure.chosen import UNIFORM, chosen_exposure
from bridgegen.exposure.reader import build_exposure
from bridgegen.odd.kinds import FLOAT
from bridgegen.odd.plain_yaml import read_plain_yaml
from bridgegen.risk import Risk, estimate_risk
from bridgegen.risk.estimators.problem import Aim
from bridgegen.risk.estimators.weighted import Probability, of_weights
from bridgegen.risk.methods import estimate

TESTS = Path(__file__).parents[1] / "tests/risk/estimators/problems.py"
PAIRS = {
    ("cut-in", "careful"): 0.2, ("cut-in", "route-follower"): 0.1,
    ("lead-brakes", "careful"): 0.1, ("lead-brakes", "reference"): 0.3,
    ("crossroads-s1", "route-follower"): 0.1, ("crossroads-s1", "un-r157"): 0.1,
    ("left-across-path", "careful"): 0.2, ("left-across-path", "route-follower"): 0.1,
    ("emergency-vehicle-on-red", "careful"): 0.1,
    ("emergency-vehicle-on-red", "route-follower"): 0.1,
    ("bus-pulls-out", "careful"): 0.1, ("bus-pulls-out", "un-r157"): 0.1,
    ("red-light-runner", "careful"): 0.2, ("red-light-runner", "route-follower"): 0.1,
}  # fmt: skip
"""Scenarios and drivers, and the standard deviation of each parameter as a part of its range."""
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


def coverage(repeats: int, budget: int, methods: list[str]) -> None:
    """Print how often intervals hold the truth."""
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
                ratios.append(p.estimate / truth)
                if not found.doubts:
                    believed += 1
                    below += p.high < truth
                    above += p.low > truth
            mean, spread = float(np.mean(ratios)), float(np.std(ratios))
            share = [f"{one / believed:.1%}" if believed else "–" for one in (below, above)]
            print(
                f"| {method} | {name} | {truth:.3g} | {mean:.3f} | {spread:.3f} | "
                f"{believed} of {repeats} | {share[0]} | {share[1]} |",
                flush=True,
            )


def narrow(scenario: str, deviation: float) -> Exposure:
    """Return the exposure whose parameters are normal around their defaults."""
    even = chosen_exposure(load(scenario), UNIFORM)
    assert even is not None
    normal = {}
    for name in even.names:
        one = even.space.parameters[name]
        if one.kind == FLOAT:
            spread = deviation * (one.high - one.low)
            normal[name] = {"distribution": "normal", "mean": one.default, "deviation": spread}
    source = f"Made up: normal around the defaults, deviations of {deviation:g} of the ranges."
    node = {"source": source, "others": "uniform", "parameters": normal}
    return build_exposure(read_plain_yaml(json.dumps(node).encode(), "narrow"), even.scenario, None)


def truth(counted: Risk, wanted: Exposure) -> Probability:
    """Return the probability under an exposure, of rows that were counted under another one."""
    rows = counted.weighted
    X = counted.exposure.from_normal(rows.Z[rows.there(NEAR_MISS) > 0.0])
    likelier = np.exp(wanted.log_density(X) - counted.exposure.log_density(X))
    return of_weights(likelier / rows.rows)


def scenarios(folder: Path, count: int, pairs: list[str]) -> None:
    """Print estimates of catalogue scenarios by each method, and by counting."""
    print("| scenario | driver | counted | 95 % | method | estimate | 95 % | evaluations | s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for (scenario, driver), deviation in PAIRS.items():
        pair = f"{scenario}/{driver}"
        if pairs and pair not in pairs:
            continue
        there = folder / f"{scenario}-{driver}"
        counted = estimate_risk(
            scenario, ego=driver, exposure="uniform", event="conflict", method="mc",
            budget=count, precision=0.0, seed=1, out=there / "counted",
        )  # fmt: skip
        wanted = narrow(scenario, deviation)
        true = truth(counted, wanted)
        for method in METHODS:
            start = time.perf_counter()
            found = estimate_risk(
                scenario, ego=driver, exposure=wanted, event="conflict", method=method,
                budget=BUDGET, out=there / method,
            )  # fmt: skip
            seconds = time.perf_counter() - start
            p = found.probability("conflict")
            cells = [scenario, driver, f"{true.estimate:.3g}", f"{true.low:.3g} to {true.high:.3g}"]
            cells.append(method + (f" ({found.estimated.method})" if method == "auto" else ""))
            cells += (
                ["in doubt", found.weighted.doubts[0]]
                if p is None
                else [f"{p.estimate:.3g}", f"{p.low:.3g} to {p.high:.3g}"]
            )
            cells += [f"{found.weighted.evaluations:,}", f"{seconds:.0f}"]
            print(f"| {' | '.join(cells)} |", flush=True)


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = parser.add_subparsers(dest="what", required=True)
    one = parts.add_parser("coverage")
    one.add_argument("methods", nargs="*", default=["mc", "subset", "importance", "stratified"])
    one.add_argument("--repeats", type=int, default=400)
    one.add_argument("--budget", type=int, default=60_000)
    other = parts.add_parser("scenarios")
    other.add_argument("folder", type=Path)
    other.add_argument("--count", type=int, default=400_000)
    other.add_argument("--pairs", nargs="*", default=[])
    given = parser.parse_args()
    if given.what == "coverage":
        coverage(given.repeats, given.budget, given.methods)
    else:
        scenarios(given.folder, given.count, given.pairs)


if __name__ == "__main__":
    main()
