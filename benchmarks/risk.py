"""How often the intervals of a risk hold the truth, and what estimates cost against counting.

python benchmarks/risk.py coverage [--repeats 400] [--budget 60000] [METHOD …]
python benchmarks/risk.py scenarios FOLDER [--pairs SCENARIO/DRIVER …]

``coverage``: on the analytic problems of the tests, whose probability is known. ``scenarios``: of
catalogue scenarios, with exposures under which harm is rare. The truth is counted without any
estimator: rows that are uniform over the ranges are simulated, and the harmful ones weighted by how
likely they are. Stopped and started again, it goes on.
"""

import argparse
import importlib.util
import json
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.jobs.risk.estimators.problem import Aim
from bridgegen.jobs.risk.estimators.weighted import Probability, of_weights
from bridgegen.jobs.risk.experiment import estimate
from bridgegen.jobs.risk.result import Risk
from bridgegen.jobs.risk.risk import estimate_risk
from bridgegen.jobs.search.scenarios import load
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.reader import UNIFORM, build_exposure
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.scenario import LogicalScenario

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
    assert isinstance(scenario, LogicalScenario)
    normal = {}
    for name, mean in case.means.items():
        one = scenario.parameters[name]
        size = one.high - one.low
        normal[name] = {
            "distribution": "normal", "mean": one.low + mean * size,
            "deviation": case.deviation * size,
        }  # fmt: skip
    node = {"source": "Made up for this benchmark.", "others": "uniform", "parameters": normal}
    return build_exposure(read_plain_yaml(json.dumps(node).encode(), "made up"), scenario, None)


def truth(counted: Risk, wanted: Exposure) -> Probability:
    """Return the probability under an exposure, of rows that were drawn from another one."""
    rows = counted.weighted
    X = counted.exposure.from_normal(rows.Z[rows.there(NEAR_MISS) > 0.0])
    likelier = np.exp(wanted.log_density(X) - counted.exposure.log_density(X))
    return of_weights(likelier / rows.rows)


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
    other.add_argument("--pairs", nargs="*", default=[])
    given = parser.parse_args()
    if given.what == "coverage":
        coverage(given.repeats, given.budget, given.methods)
    else:
        scenarios(given.folder, given.pairs)


if __name__ == "__main__":
    main()
