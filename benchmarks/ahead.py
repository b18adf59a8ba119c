"""What it costs a search to run ahead of its results: critical rows found, over fixed pairs.

    .venv/bin/python benchmarks/ahead.py FOLDER
        [--pairs crossroads-s4/route-follower …] [--methods surrogate es …]
        [--ahead 0 4 8 16] [--budget 300] [--seeds 10]

A pair is a scenario and the ego's driver; the objective is harm. Called again with the same folder,
it makes the runs that are missing. How much time is gained depends on the simulator, see
`benchmarks/run.py workers`.
"""

import argparse
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from searches import Found, found

import bridgegen as bg
from bridgegen.jobs.compare.record import space_of

PAIRS = ("crossroads-s4/route-follower", "bus-pulls-out/careful")


def searched(folder: Path, pair: str, method: str, ahead: int, budget: int, seed: int) -> Found:
    """Return what a search finds; it is made, or resumed, unless it is finished."""
    scenario, ego = pair.split("/")
    out = folder / f"{scenario}-{ego}-{method}-{ahead}-{budget}-{seed}"
    if (out / "run.sqlite").exists():
        bg.resume(out, deliver=False)
    else:
        bg.run_search(
            scenario, ego=ego, algorithm=method, objective={"harm": None}, budget=budget, seed=seed,
            ahead=ahead or None, out=out, deliver=False,
        )  # fmt: skip
    return found(out, space_of(out), [budget])[budget]


def line(results: Sequence[Found], budget: int) -> str:
    """Return a cell of the table: results of at least two seeds."""
    firsts = [one.first for one in results]
    distinct = [one.distinct for one in results]
    critical = budget * np.mean([one.r_critic for one in results])
    error = np.std(distinct, ddof=1) / len(results) ** 0.5
    return (
        f"{np.mean(np.isfinite(firsts)):.2f} / {np.median(firsts):.0f} / {critical:.0f} / "
        f"{np.mean(distinct):.1f} ± {error:.1f}"
    )


def main() -> None:
    """Make the runs and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pairs", nargs="+", default=PAIRS)
    parser.add_argument("--methods", nargs="+", default=["surrogate", "es"])
    parser.add_argument("--ahead", nargs="+", type=int, default=[0, 4, 8, 16])
    parser.add_argument("--budget", type=int, default=300)
    parser.add_argument("--seeds", type=int, default=10)
    given = parser.parse_args()
    if given.seeds < 2:
        parser.error(f"--seeds must be 2 or more, got {given.seeds}")
    print("found / median of the first / mean critical / mean distinct (0.1) ± standard error")
    print(f"| | {' | '.join(f'ahead {one}' for one in given.ahead)} |")
    print("|---" * (1 + len(given.ahead)) + "|")
    for pair, method in product(given.pairs, given.methods):
        cells = [
            line(
                [
                    searched(given.folder, pair, method, ahead, given.budget, seed)
                    for seed in range(given.seeds)
                ],
                given.budget,
            )
            for ahead in given.ahead
        ]
        print(f"| {pair}, `{method}` | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
