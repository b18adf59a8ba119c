"""Digests of what every job gives on small seeds, from a cold kernel cache.

    .venv/bin/python tools/golden.py           # compare with tools/golden.txt
    .venv/bin/python tools/golden.py --write   # after a change of results that CHANGELOG names

Whoever moves code without meaning to change a result runs it before and after: rows, exported
files, records and printed JSON must have the same digests. Pages are left out, as are times and
what a job's files say of the machine. Digests hold for one machine's mathematical library: compare
two commits on the same machine.
"""

import argparse
import hashlib
import json
import os
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).with_suffix(".txt")
BRIDGEGEN = str(Path(sys.executable).with_name("bridgegen"))

LEFT_OUT = (".html", ".lock", ".parquet", ".svg", ".png", ".sqlite-wal", ".sqlite-shm", "times.csv")
"""Pages, pictures, and files that hold times."""

OF_A_MACHINE = ("seconds", "created", "version", "python", "rate", "digest", "sha256", "wall")
"""A key of JSON that contains one of these says something of this run, machine or source."""

CONFIRM = """
import sys
from dataclasses import replace
from pathlib import Path
from bridgegen.jobs.search.confirm import confirm
from bridgegen.simulation import choice

class Shifted:
    rows_at_once = runs_at_once = 1
    def __init__(self, embedded): self.embedded = embedded
    def __getattr__(self, name): return getattr(self.embedded, name)
    def run(self, roads, rows, values, **more):
        one = self.embedded.run(roads, rows, values, **more)
        return replace(one, x=one.x + 1e-3)

make = lambda embedded, storyboard, settings, access: Shifted(embedded)
choice.SIMULATORS["shifted"] = choice.Kind("shifted", "Ours, 1 mm aside.", make, settings={})
confirm(Path(sys.argv[1]), choice.SimulatorChoice("shifted", {}))
"""

SEARCHES = {
    "s4": ["crossroads-s4", "--algorithm", "auto"],
    "bus": ["bus-pulls-out", "--ego", "un-r157", "--algorithm", "surrogate"],
    "pedestrian": ["pedestrian-at-night", "--ego", "careful", "--algorithm", "pso"],
    "ambulance": ["emergency-vehicle-on-red", "--ego", "reference", "--algorithm", "sobol"],
    "brakes": ["lead-brakes", "--ego", "fsm", "--algorithm", "nsga2", "--objective", "paper"],
    "cut-in": ["r157/cut-in", "--ego", "route-follower", "--algorithm", "map-elites"],
}

JOBS: dict[str, list[str]] = {
    **{
        f"search-{name}": ["search", *rest, "--budget", "90", "--out", f"search-{name}"]
        for name, rest in SEARCHES.items()
    },
    **{
        f"risk-{method}": [
            "risk", "cut-in", "--ego", "route-follower", "--exposure", "cut-in-ann-arbor",
            "--method", method, "--budget", "3000", "--out", f"risk-{method}", "--json",
        ]
        for method in ("auto", "mc", "subset", "importance", "stratified")
    },
    "preventability": [
        "preventability", "r157/cut-in", "--ego", "reference,un-r157", "--out", "preventability",
        "--json",
    ],
    "suite-packs": ["suite", "ncap-aeb", "--out", "suite-packs", "--json"],
    "suite-samples": [
        "suite", "r157/cut-in", "jam-tail-in-fog", "--ego", "reference", "--ego", "careful",
        "--matrix", "none", "--samples", "40", "--out", "suite-samples", "--json",
    ],
    "compare": [
        "benchmark", "algorithms", "cut-in", "lead-brakes", "--algorithms", "random,pso",
        "--seeds", "2", "--budget", "60", "--out", "compare",
    ],
    "diff": [
        "diff", "cut-in", "--ego", "reference", "--ego", "route-follower", "--samples", "50",
        "--budget", "60", "--out", "diff", "--json",
    ],
    "benchmark": [
        "benchmark", "planners", "--scenario", "cut-in", "--ego", "reference", "--ego", "fsm",
        "--budget", "40", "--seeds", "1", "--triage", "none", "--out", "benchmark",
    ],
}  # fmt: skip

AFTERWARDS: dict[str, list[str]] = {
    "mine": ["mine", "recordings", "--out", "mined", "--json"],
    "safety-case": ["safety-case", "search-s4", "search-bus", "--out", "safety-case", "--json"],
    "regions": ["analyse", "regions", "search-s4", "--json"],
    "coverage": ["analyse", "coverage", "search-bus", "--json"],
    "export": ["export", "search-bus", "--flavour", "resolved", "--out", "exported"],
    "dashboard": ["dashboard", ".", "--out", "dashboard.html", "--json"],
}
"""Jobs on what the others left."""


def main() -> None:
    """Run every job; print the digests that differ, or write them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--write", action="store_true", help=f"write {HERE.name}")
    parser.add_argument("--keep", type=Path, help="new folder for the jobs' files")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (given.keep or Path(temporary) / "jobs").absolute()
        folder.mkdir(parents=True)
        # Kernels are compiled anew, so that nothing hides a change of their source.
        environment = os.environ | {"NUMBA_CACHE_DIR": str(Path(temporary) / "kernels")}
        found = dict(sorted(_run_all(folder, environment)))
    text = "".join(f"{digest}  {name}\n" for name, digest in found.items())
    if given.write:
        HERE.write_text(text, "utf-8")
        return
    known = {name: digest for digest, name in map(str.split, HERE.read_text("utf-8").splitlines())}
    changed = [one for one in sorted({*known, *found}) if known.get(one) != found.get(one)]
    for name in changed:
        print(f"{name}: {known.get(name, 'new')} -> {found.get(name, 'gone')}")
    print(f"{len(found)} digests, {len(changed)} differ")
    sys.exit(bool(changed))


def _run_all(folder: Path, environment: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the name and digest of each job's exit status, printed JSON and files."""

    def run(item: tuple[str, list[str]]) -> tuple[str, str]:
        name, arguments = item
        done = subprocess.run(
            [BRIDGEGEN, *arguments], cwd=folder, env=environment, capture_output=True, text=True
        )
        if done.returncode not in (0, 3):
            sys.exit(f"{name}: status {done.returncode}: {done.stderr}")
        printed = _plain(json.loads(done.stdout)) if "--json" in arguments else None
        return f"{name}:status", _digest(json.dumps([done.returncode, printed]).encode())

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield run(("search-s4", JOBS["search-s4"]))  # compiles what all share
        yield from pool.map(run, [one for one in JOBS.items() if one[0] != "search-s4"])
    (folder / "recordings").mkdir()
    for path in sorted((folder / "search-bus" / "critical").glob("0*.xosc")):
        trace = f"recordings/{path.stem}.csv"
        run(("trace", ["simulate", str(path.relative_to(folder)), "--trace", trace]))
    yield from map(run, AFTERWARDS.items())
    subprocess.run(
        [sys.executable, "-c", CONFIRM, "search-s4"], cwd=folder, env=environment, check=True
    )
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.name.endswith(LEFT_OUT):
            yield str(path.relative_to(folder)), _digest_of(path)


def _digest_of(path: Path) -> str:
    """Return the digest of a file's content, without what is of this run alone."""
    if path.suffix == ".sqlite":
        return _digest(repr(list(_rows(path))).encode())
    if path.suffix == ".npz":
        with np.load(path) as arrays:
            return _digest(b"".join(arrays[name].tobytes() for name in sorted(arrays.files)))
    if path.suffix in (".json", ".jsonl"):
        parts = [path.read_text("utf-8")]
        if path.suffix == ".jsonl":
            parts = sorted(parts[0].splitlines())  # workers end in any order
        return _digest(json.dumps([_plain(json.loads(part)) for part in parts]).encode())
    return _digest(path.read_bytes())


def _rows(path: Path) -> Iterator[Any]:
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as database:
        cursor = database.execute("SELECT * FROM evaluations ORDER BY id")
        names = [one[0] for one in cursor.description]
        for row in cursor:
            yield [value for name, value in zip(names, row, strict=True) if name != "seconds"]


def _plain(value: Any) -> Any:
    """Return JSON without what is of this run alone."""
    if isinstance(value, dict):
        return {
            key: _plain(part)
            for key, part in value.items()
            if not any(word in key for word in OF_A_MACHINE)
        }
    return [_plain(part) for part in value] if isinstance(value, list) else value


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


if __name__ == "__main__":
    main()
