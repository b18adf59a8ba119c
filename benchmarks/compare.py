"""Compare algorithms on S1 to S4: R_critic over seeds, with Mann–Whitney p-values.

    .venv/bin/python benchmarks/compare.py [--seeds 10] [--budget 1000] [--ego route-follower]

The first algorithm is the baseline that the others are held against.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from scipy.stats import mannwhitneyu

from bridgegen.campaign.loop import run_loop
from bridgegen.odd.reader import load
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.source import on_map
from bridgegen.pipeline import Pipeline
from bridgegen.search import Problem, get
from bridgegen.store import Store
from bridgegen.store.summary import Summary, summarise

SCENARIOS = ("crossroads-s1", "crossroads-s2", "crossroads-s3", "crossroads-s4")


def one(pipeline: Pipeline, algorithm: str, seed: int, budget: int) -> Summary:
    """Return the figures of one run."""
    space, n_obj = pipeline.space, pipeline.objective.n_obj
    with (
        tempfile.TemporaryDirectory() as folder,
        Store.create(
            Path(folder) / "run", {}, space.names, pipeline.metrics,
            n_var=space.n_var, n_obj=n_obj,
        ) as store,
    ):  # fmt: skip
        method = get(algorithm)(Problem(space.variables, pipeline.metrics, n_obj), seed)
        run_loop(method, space.decode, pipeline.evaluate, store, budget)
        rows = store.read()
        d_min, v_d = (rows.metrics[:, store.metrics.index(name)] for name in ("d_min", "v_d"))
        return summarise(rows.critical, rows.status == 0, d_min, v_d, store.seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--algorithms", default="random,pso")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--budget", type=int, default=1000)
    parser.add_argument("--ego", default="route-follower")
    parser.add_argument("--map", type=Path)
    options = parser.parse_args()
    algorithms = options.algorithms.split(",")
    print(
        "| scenario | algorithm | R_critic, median (quartiles) | first | 50th | median d_min | p |"
    )
    print("|---|---|---|---|---|---|---|")
    for name in SCENARIOS:
        scenario = load(name)
        road_map = load_map(options.map) if options.map else None
        if road_map:
            scenario = on_map(scenario, road_map)
        space = scenario.space()
        pipeline = Pipeline(scenario, space, ego=options.ego, road_map=road_map)
        pipeline.choose_objective()
        shares: dict[str, list[float]] = {}
        for algorithm in algorithms:
            runs = [one(pipeline, algorithm, seed, options.budget) for seed in range(options.seeds)]
            shares[algorithm] = [run.r_critic for run in runs]
            low, middle, high = np.quantile(shares[algorithm], (0.25, 0.5, 0.75))
            p = ""
            if algorithm != algorithms[0]:
                test = mannwhitneyu(shares[algorithm], shares[algorithms[0]], alternative="greater")
                p = f"{test.pvalue:.1e}"
            first = _median([run.first for run in runs])
            fiftieth = _median([run.fiftieth for run in runs])
            d_min = float(np.median([run.d_min_median for run in runs]))
            print(
                f"| {name} | {algorithm} | {middle:.3f} ({low:.3f} to {high:.3f}) | {first} "
                f"| {fiftieth} | {d_min:.2f} m | {p} |",
                flush=True,
            )


def _median(counts: list[int | None]) -> str:
    """Return the median of counts of which some were never reached."""
    value = float(np.median([float("inf") if count is None else count for count in counts]))
    return f"{value:.0f}" if np.isfinite(value) else "never"


if __name__ == "__main__":
    main()
