"""Events that are planted in traffic, and what `bridgegen mine` finds of them, by format of file.

python -m benchmarks.recordings FOLDER [--events 10000] [--formats highD …] [--noise 0.2]

The embedded simulator drives scenarios of the catalogue with random parameters. The traffic is
written in each format at its usual rate, read, cleaned, placed on the map and searched for events.
FOLDER gets pieces.jsonl, a line per scenario, format and 400 rows with the planted and the mined
parameters of its events, and is where a run that was stopped goes on; the tables are printed.
``--noise`` is that of positions [m]: velocities then have 5 % of noise, too, and 5 % of the states
are missing.
"""

import argparse
import json
import multiprocessing
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import ks_2samp
from tests.mining.events import simulated as planted
from tests.mining.events import test_crossing_round_trip as meetings
from tests.mining.events import test_round_trip as lane_events
from tests.recordings import binary_writers, writers

from bridgegen.recordings.readers.formats import read
from bridgegen.scenario.exposure.exposure import Encounters

ROWS = 400
"""Rows of a piece: what is simulated and written at once."""
APART = 40.0
"""Between the beginnings of two rows of a recording [s]."""
REPEATS = 2000
NOISE_OF_VELOCITIES, MISSING = 0.05, 0.05


@dataclass(frozen=True)
class Form:
    """A format: its writer, its usual time step [s], the rows of a file, whether it has people."""

    write: Any
    step: float = 0.1
    rows: int = ROWS
    people: bool = True


FORMATS = {
    "states": Form(writers.write_states, 0.05),
    "highD": Form(writers.write_highd, 0.04, people=False),
    "inD": Form(writers.write_ind, 0.04),
    "NGSIM": Form(writers.write_ngsim, people=False),
    "SMARTS": Form(writers.write_smarts),
    "CommonRoad": Form(writers.write_commonroad, rows=100),
    "INTERACTION": Form(writers.write_interaction),
    "SUMO FCD": Form(writers.write_sumo),
    "OSI": Form(binary_writers.write_osi, 0.05),
    "esmini .dat": Form(binary_writers.write_dat, 0.05),
    "WOMD JSON": Form(writers.write_womd, rows=10),
    "ScenarioNet": Form(writers.write_scenarionet, rows=10),
}
SCENARIOS = (
    "cut-in", "cut-out", "lead-brakes", "crossroads-s1", "left-across-path", "pedestrian-at-night",
)  # fmt: skip
PEOPLE = ("pedestrian-at-night",)


def observe(form: Form, seed: int) -> Any:
    """Return what makes recordings of a rollout's rows, through files of a format."""

    def recordings(
        rollout: Any, rows: Any, lanes: Any, noise: float = 0.0, dropped: float = 0.0
    ) -> Iterator[Any]:
        for begin in range(0, len(rows), form.rows):
            some = rows[begin : begin + form.rows]
            tracks, called = planted.tracks_of(
                rollout, some, noise, dropped, form.step, seed + begin, APART
            )
            if noise:
                rng = np.random.default_rng(seed + begin)
                for one in tracks:
                    one.states[:, 4:6] *= rng.normal(1.0, NOISE_OF_VELOCITIES, (len(one.states), 1))
            with tempfile.TemporaryDirectory() as folder:
                (traffic,) = read(form.write(Path(folder), tracks, form.step))
            names = tuple(called[int(one)] for one in traffic.names)
            yield planted.located(replace(traffic, names=names), lanes)

    return recordings


def piece(task: tuple[str, str, int, float]) -> dict[str, Any]:
    """Return what became of the events of some rows of a scenario in a format."""
    name, format_name, seed, noise = task
    form = FORMATS[format_name]
    dropped = MISSING if noise else 0.0
    if name in lane_events.CASES:
        found = lane_events.round_trip(
            name, noise, dropped, ROWS, seed=seed, observe=observe(form, seed)
        )
    else:
        found = meetings.round_trip(
            name, noise, dropped, ROWS, ROWS, seed=seed, observe=observe(form, seed)
        )
    return {
        "scenario": name, "format": format_name, "seed": seed, "noise": noise,
        "true": found.true.tolist(), "found": found.found.tolist(),
        "planted": {key: one.tolist() for key, one in found.planted.items()},
        "mined": {key: one.tolist() for key, one in found.mined.items()},
        "ranges": found.ranges,
    }  # fmt: skip


def tables(pieces: list[dict[str, Any]]) -> None:
    """Print what became of the events, by format, and of their parameters."""
    rng = np.random.default_rng(0)
    print("| format | noise | events | precision | recall | rate's interval holds the truth |")
    print("|---|---|---|---|---|---|")
    for format_name, noise in sorted({(one["format"], one["noise"]) for one in pieces}):
        of = [one for one in pieces if (one["format"], one["noise"]) == (format_name, noise)]
        true, found = (np.concatenate([one[key] for one in of]) for key in ("true", "found"))
        print(
            f"| {format_name} | {noise:g} | {len(found):,} | {true.mean():.4f} | "
            f"{found.mean():.4f} | {holds(found.mean(), (~true.astype(bool)).mean(), rng):.3f} |"
        )
    print("\n| format | noise | parameter | median error | 95 % | 98 % | KS |")
    print("|---|---|---|---|---|---|---|")
    for format_name, noise, name in sorted(
        {(one["format"], one["noise"], one["scenario"]) for one in pieces}
    ):
        of = [
            one
            for one in pieces
            if (one["format"], one["noise"], one["scenario"]) == (format_name, noise, name)
        ]
        for key, width in of[0]["ranges"].items():
            was, is_ = (
                np.concatenate([one[side][key] for one in of]) for side in ("planted", "mined")
            )
            known = np.isfinite(is_) & np.isfinite(was)
            error = np.abs(is_ - was)[known] / width
            middle, most, nearly_all = np.quantile(error, [0.5, 0.95, 0.98])
            print(
                f"| {format_name} | {noise:g} | {name}: {key} | {middle:.2%} | {most:.2%} | "
                f"{nearly_all:.2%} | {ks_2samp(is_[known], was[known]).statistic:.3f} |"
            )


def holds(recall: float, wrong: float, rng: np.random.Generator) -> float:
    """Return how often the interval of a rate holds the true one, in recordings of ten hours.

    Events come at 3 per hour, as a Poisson process; each is found with the measured recall, and
    false ones come on top.
    """
    hours, rate = 10.0, 3.0
    counts = rng.poisson(rate * hours * recall / max(1.0 - wrong, 0.5), REPEATS)
    intervals = (Encounters(int(one), hours, None, "planted").per_hour for one in counts)
    return float(np.mean([one.low <= rate <= one.high for one in intervals]))


def main() -> None:
    """Run what is missing, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--events", type=int, default=10_000)
    parser.add_argument("--formats", nargs="+", choices=list(FORMATS), default=list(FORMATS))
    parser.add_argument("--noise", type=float, default=0.0)
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    path = args.folder / "pieces.jsonl"
    pieces = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {(one["scenario"], one["format"], one["seed"], one["noise"]) for one in pieces}
    tasks = [
        (name, format_name, seed, args.noise)
        for seed in range(1, 1 + -(-args.events // (len(SCENARIOS) * ROWS)))
        for name in SCENARIOS
        for format_name in args.formats
        if FORMATS[format_name].people or name not in PEOPLE
    ]
    begin = time.time()
    with multiprocessing.get_context("spawn").Pool(args.workers) as pool, path.open("a") as file:
        for one in pool.imap(piece, [task for task in tasks if task not in done]):
            file.write(json.dumps(one) + "\n")
            file.flush()
            pieces.append(one)
            print(
                f"{time.time() - begin:6.0f} s {one['format']} {one['scenario']} "
                f"{np.mean(one['true']):.3f} {np.mean(one['found']):.3f}",
                flush=True,
            )
    wanted = set(tasks)
    tables(
        [
            one
            for one in pieces
            if (one["scenario"], one["format"], one["seed"], one["noise"]) in wanted
        ]
    )


if __name__ == "__main__":
    main()
