"""How often the intervals of a risk hold the truth, and what estimates cost against counting.

python benchmarks/risk.py coverage [--repeats 400] [--budget 60000] [METHOD …]
python benchmarks/risk.py scenarios FOLDER [--count 1000000]

``coverage``: on the analytic problems of the tests, whose probability is known. ``scenarios``: of
catalogue scenarios with their parameters uniform over the ranges, by ``auto`` and by counting;
stopped and started again, it goes on.
"""

import argparse
import importlib.util
import sys
import time
from pathlib import Path
from types import ModuleType

import numpy as np

from bridgegen.risk import estimate_risk
from bridgegen.risk.estimators.problem import Aim
from bridgegen.risk.methods import estimate

TESTS = Path(__file__).parents[1] / "tests/risk/estimators/problems.py"
PAIRS = (
    ("crossroads-s1", "reference"), ("crossroads-s1", "careful"),
    ("cut-out", "reference"), ("cut-out", "careful"),
    ("lead-brakes", "reference"), ("lead-brakes", "careful"),
    ("pedestrian-behind-parked", "reference"), ("pedestrian-behind-parked", "careful"),
    ("left-across-path", "reference"), ("left-across-path", "careful"),
    ("emergency-vehicle-on-red", "reference"), ("emergency-vehicle-on-red", "careful"),
)  # fmt: skip
"""Scenarios and drivers."""


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


def scenarios(folder: Path, count: int) -> None:
    """Print estimates of catalogue scenarios by ``auto``, and by counting."""
    print("| scenario | driver | method | evaluations | estimate | 95 % | s | counted | 95 % | s |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for scenario, driver in PAIRS:
        cells = [scenario, driver]
        for method, budget, precision in (("auto", 200_000, 0.2), ("mc", count, 0.0)):
            start = time.perf_counter()
            found = estimate_risk(
                scenario, ego=driver, exposure="uniform", event="conflict", method=method,
                budget=budget, precision=precision, seed=1 if method == "mc" else 0,
                out=folder / f"{scenario}-{driver}-{method}",
            )  # fmt: skip
            seconds = time.perf_counter() - start
            p = found.probability("conflict")
            if method == "auto":
                cells += [found.estimated.method, f"{found.weighted.evaluations:,}"]
            cells += (
                ["–", "–"] if p is None else [f"{p.estimate:.3g}", f"{p.low:.3g} to {p.high:.3g}"]
            )
            cells.append(f"{seconds:.0f}")
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
    other.add_argument("--count", type=int, default=1_000_000)
    given = parser.parse_args()
    if given.what == "coverage":
        coverage(given.repeats, given.budget, given.methods)
    else:
        scenarios(given.folder, given.count)


if __name__ == "__main__":
    main()
