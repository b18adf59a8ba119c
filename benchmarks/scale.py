"""What many evaluations take on your machine: cores, hours, memory, disk; and where it ends.

    .venv/bin/python benchmarks/scale.py [EVALUATIONS]        # 1e9 by default

Measures what a scenario takes in processor time, and what recording 10⁴, 10⁵ and 10⁶ of them takes
(time, memory, store), then reckons in proportion. A minute or two; run it when nothing else runs.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from rates import rate_of

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.search.campaign import MAX_BUDGET
from bridgegen.scenario.language.reader import load

SCENARIO = "crossroads-s4"
SIZES = (10_000, 100_000, 1_000_000)
CASES = (("route-follower", False), ("reference", False), ("reference", True))


def cost(ego: str, causes: bool) -> float:
    """Return the processor time of a scenario [s], all of an evaluation included."""
    scenario = load(SCENARIO)
    space = scenario.space()
    pipeline = Pipeline(
        scenario, space, PipelineOptions(ego=ego, causes=causes), workers=Threads(1)
    )
    pipeline.choose_objective()
    X = space.decode(np.random.default_rng(0).random((1500, space.n_var)))
    return rate_of(pipeline, X).cpu_seconds


def recorded(n: int) -> tuple[float, float, float]:
    """Return the seconds, the peak of memory [bytes] and the store's bytes of n evaluations."""
    script = Path(__file__).with_name("million.py")
    done = subprocess.run(
        [sys.executable, str(script), "random", str(n)], stdout=subprocess.PIPE, check=True
    )
    seconds, mebibytes, store = map(float, done.stdout.split())
    return seconds, mebibytes * 2**20, store


def main() -> None:
    wanted = int(float((sys.argv[1:] or ["1e9"])[0]))
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, {SCENARIO}\n")
    costs = {case: cost(*case) for case in CASES}
    for (ego, causes), each in costs.items():
        name = f"{ego}, causes" if causes else ego
        print(f"a scenario, {name:<24}{1e6 * each:8.0f} µs   {1 / each:8,.0f} a second and core")
    print(f"\n{'evaluations':>14}{'seconds':>10}{'memory, MiB':>14}{'store, MiB':>13}")
    table = {n: recorded(n) for n in SIZES}
    for n, (seconds, memory, store) in table.items():
        print(f"{n:>14,}{seconds:>10.1f}{memory / 2**20:>14.0f}{store / 2**20:>13.1f}")
    last, one = (np.array(table[n]) for n in (SIZES[-1], SIZES[-2]))
    slope = (last - one) / (SIZES[-1] - SIZES[-2])
    seconds, memory, store = last + slope * (MAX_BUDGET - SIZES[-1])
    print(
        f"{MAX_BUDGET:>14,}{seconds:>10.0f}{memory / 2**20:>14.0f}{store / 2**20:>13.0f}   reckoned"
    )
    runs = -(-wanted // MAX_BUDGET)
    print(f"\n{wanted:,} evaluations:")
    print(f"recorded: {slope[0] * wanted / 3600:.1f} hours of one core, ", end="")
    print(f"{slope[2] * wanted / 1e9:,.0f} GB of stores")
    for (ego, causes), each in costs.items():
        name = f"{ego}, causes" if causes else ego
        hours = each * wanted / 3600
        print(f"simulated, {name}: {hours:,.0f} core hours; on 1,000 cores {3.6 * hours:,.0f} s")
    print(
        f"\nOne run holds {MAX_BUDGET:,} at most: {runs:,} runs, of other seeds or scenarios, each"
    )
    print("a folder with a store and a writer of its own. What ends first, of one run:")
    print(f"  cores: its writer takes {1 / slope[0]:,.0f} rows a second, which is as much as")
    for (ego, causes), each in costs.items():
        name = f"{ego}, causes" if causes else ego
        print(f"    {each / slope[0]:,.0f} cores simulate ({name})")
    print(f"  memory: it knows every row that it has met, {slope[1]:.0f} bytes each, ", end="")
    print(f"{memory / 2**30:.1f} GiB at {MAX_BUDGET:,}")
    print(f"  disk: {slope[2]:.0f} bytes each, {store / 2**30:.1f} GiB at {MAX_BUDGET:,}")


if __name__ == "__main__":
    main()
