"""How soon, and how many different, critical scenarios each search finds, over fixed pairs.

    .venv/bin/python benchmarks/searches.py FOLDER
        [--pairs crossroads-s4/route-follower …] [--methods random es surrogate …]
        [--budgets 50 100 300 1000] [--seeds 20] [--workers N]

A pair is a scenario and the ego's driver; the objective is harm. Each method searches each pair
once for each seed, with the largest budget: a smaller budget's run is the beginning of it. The runs
are those of `bridgegen benchmark algorithms`, one comparison for each driver; called again with
the same folder, it resumes them. A method may be `file.py:Class`, as those of docs/examples. Twelve
pairs, seven methods and 20 seeds of 1000 take hours.
"""

import argparse
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from run import seconds_a_row

import bridgegen as bg
from bridgegen.base.errors import BridgeGenError
from bridgegen.base.plugins import label_of
from bridgegen.jobs.compare.record import distinct, modes_of, normalised, space_of
from bridgegen.jobs.compare.result import Comparison
from bridgegen.results.store import Store
from bridgegen.scenario.language.space import SearchSpace

PAIRS = {
    "stopped-after-curve/reference": 0.0007,
    "wrong-way-driver/reference": 0.0013,
    "red-light-runner/route-follower": 0.002,
    "pedestrian-at-night/careful": 0.002,
    "bus-pulls-out/careful": 0.0073,
    "left-across-path/careful": 0.013,
    "crossroads-s4/route-follower": 0.018,
    "crossroads-s3/careful": 0.025,
    "roundabout-entry/route-follower": 0.033,
    "crossroads-s1/route-follower": 0.08,
    "crossroads-s3/route-follower": 0.25,
    "jam-tail-in-fog/careful": 0.47,
}
"""By pair the critical share of 3000 random rows, 12,000 of the red-light runner."""

METHODS = ("random", "pso", "es", "cma-es", "nsga2", "turbo", "surrogate")
MODES = 5


@dataclass(frozen=True)
class Found:
    """What a run has found within a budget.

    Attributes:
        first: evaluations to the first critical row; inf if there is none.
        fifth_mode: evaluations to the fifth distinct failure mode; likewise.
        modes: number of distinct failure modes.
        distinct: number of critical scenarios that are 0.1 apart in root mean square.
        r_critic: critical share of the evaluations.
    """

    first: float
    fifth_mode: float
    modes: int
    distinct: int
    r_critic: float


def found(folder: Path, space: SearchSpace, budgets: Sequence[int]) -> dict[int, Found]:
    """Return what a run had found after each budget."""
    with Store.open(folder) as store:
        rows = store.read()
    at = np.flatnonzero(rows.critical)
    X = normalised(space, rows.X[at])
    new = distinct(X, n_var=space.n_var)
    firsts = [int(at[k[0]]) + 1 for k in modes_of(rows.findings.take(at)).values()]
    result = {}
    for budget in budgets:
        n = int(np.searchsorted(at, budget))
        modes = int(np.searchsorted(firsts, budget, side="right"))
        result[budget] = Found(
            first=float(at[0] + 1) if n else np.inf,
            fifth_mode=float(firsts[MODES - 1]) if modes >= MODES else np.inf,
            modes=modes,
            distinct=int(new[:n].sum()),
            r_critic=n / min(budget, len(rows)),
        )
    return result


def compared(
    out: Path,
    pairs: Sequence[str],
    methods: Sequence[str],
    seeds: int,
    budget: int,
    workers: int | None,
) -> list[Comparison]:
    """Make the runs that are missing, and return the comparisons, one for each driver."""
    scenarios = defaultdict(list)
    for pair in pairs:
        scenario, ego = pair.split("/")
        scenarios[ego].append(scenario)
    return [
        bg.compare(
            names, algorithms=methods, ego=ego, objective={"harm": None}, seeds=seeds,
            budget=budget, workers=workers, out=out / ego, deliver=False,
        )
        for ego, names in scenarios.items()
    ]  # fmt: skip


def median(values: Sequence[float]) -> str:
    """Return a median as text; the upper of two, so that half a find is none."""
    middle = sorted(values)[len(values) // 2]
    return "never" if middle == np.inf else f"{middle:.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pairs", nargs="+", default=list(PAIRS), metavar="SCENARIO/DRIVER")
    parser.add_argument("--methods", nargs="+", default=list(METHODS))
    parser.add_argument("--budgets", nargs="+", type=int, default=[50, 100, 300, 1000])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--workers", type=int, default=None)
    given = parser.parse_args()
    if wrong := [pair for pair in given.pairs if pair.count("/") != 1]:
        parser.error(f"a pair is SCENARIO/DRIVER, got '{wrong[0]}'")
    budgets = sorted(given.budgets)
    try:
        made = compared(
            given.folder, given.pairs, given.methods, given.seeds, budgets[-1], given.workers
        )
    except BridgeGenError as error:
        parser.exit(2, f"{error}\n")
    overhead = {name: 1e3 * seconds_a_row(name) for name in given.methods}
    for pair in given.pairs:
        scenario, ego = pair.split("/")
        rate = f", {100 * PAIRS[pair]:g} % of random rows" if pair in PAIRS else ""
        print(f"\n{pair}{rate}")
        print(
            f"{'':>12}{'budget':>8}{'found':>8}{'first':>8}{f'{MODES} modes':>9}{'modes':>7}"
            f"{'distinct':>10}{'R_critic':>10}{'ms':>8}"
        )
        of = defaultdict(list)
        for one in made:
            if one.plan.options.ego == ego:
                for cell in one.records:
                    if cell.scenario == scenario:
                        folder = one.plan.folder(cell)
                        of[cell.algorithm].append(found(folder, space_of(folder), budgets))
        for method in given.methods:
            name = label_of(method)
            for budget in budgets if of[name] else ():
                own = [run[budget] for run in of[name]]
                print(
                    f"{name:>12}{budget:>8}"
                    f"{np.mean([np.isfinite(one.first) for one in own]):>8.2f}"
                    f"{median([one.first for one in own]):>8}"
                    f"{median([one.fifth_mode for one in own]):>9}"
                    f"{np.mean([one.modes for one in own]):>7.1f}"
                    f"{np.mean([one.distinct for one in own]):>10.1f}"
                    f"{np.mean([one.r_critic for one in own]):>10.3f}{overhead[method]:>8.2f}"
                )
    for one in made:
        for cell, why in one.gaps.items():
            print(f"{cell.name} ({one.plan.options.ego}): {why}")


if __name__ == "__main__":
    main()
