"""Mutate real files by the thousand: every reader must answer with a result or one clear error.

    python tests/fuzzing.py --inputs 100000 --jobs 2 [--seeds FOLDER …]

An input is a file of ours, or of strangers (``--seeds``), changed in a few places: bytes flipped,
cut and repeated; elements dropped, doubled, moved, renamed, put into another file; numbers
replaced by what breaks programs. It is read and, where that succeeds, run. What counts as found:
any exception but BridgeGen's own, an input that takes longer than 5 s, a process that dies or grows
by more than 1 GiB. Each input depends on (seed, number) alone, so a finding can be had again.
"""

import argparse
import contextlib
import copy
import random
import resource
import selectors
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

SECONDS = 5.0
"""An input that takes longer counts as a hang."""

START_SECONDS = 300.0
"""A worker's first input also waits for compiled kernels."""

MEMORY = 2**30
"""Bytes that a process may grow by."""

XML = (".xosc", ".xodr", ".owl", ".osm")

NASTY = (
    "", " ", "0", "-1", "1", "1e308", "-1e308", "1e-320", "NaN", "INF", "-inf", "Infinity", "0x10",
    "1,5", "1.5", "2147483648", "99999999999999999999", "true", "$a", "$", "${1/0}", "${", "${1+}",
    "${pow(9,pow(9,9))}", "nichts", "../../../../etc/passwd", "/dev/zero", "x" * 5000,
    "\u0663", "\u202e", "a b", "-0.0", "1e9", "0.001", "360", "-180", "ego", "24:00",
    "1970-01-01T00:00:00",
)  # fmt: skip


@dataclass(frozen=True)
class Seed:
    """A file to begin from: its kind (the suffix), its content, and the folder it came from."""

    kind: str
    data: bytes
    beside: Path


# --- Inputs ---------------------------------------------------------------------------------------


def mutated(seeds: list[Seed], rng: random.Random) -> Seed:
    """Return a seed, changed in one to four places."""
    seed = rng.choice(seeds)
    if seed.kind in XML and rng.random() < 0.75:
        root = etree.fromstring(seed.data)
        for _ in range(rng.choice((1, 1, 2, 4))):
            _change_tree(root, seeds, rng)
        data = etree.tostring(root)
    else:
        data = seed.data
        for _ in range(rng.choice((1, 1, 2, 4))):
            data = _change_bytes(data, rng)
    return Seed(seed.kind, data, seed.beside)


def _change_bytes(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    to = min(len(data), at + rng.choice((1, 2, 8, 64, 512)))
    match rng.randrange(6):
        case 0:
            return data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]
        case 1:
            return data[:at] + data[to:]
        case 2:
            return data[:at] + data[at:to] * rng.choice((2, 3, 50)) + data[to:]
        case 3:
            return data[:at]
        case 4:
            return data[:at] + rng.choice(NASTY).encode() + data[at:]
        case _:
            return data[:at] + rng.choice(NASTY).encode() + data[to:]


def _change_tree(root: etree._Element, seeds: list[Seed], rng: random.Random) -> None:
    nodes = [node for node in root.iter() if isinstance(node.tag, str)]
    node, other = rng.choice(nodes), rng.choice(nodes)
    parent = node.getparent()
    kind = rng.randrange(9)
    if kind <= 2 and node.attrib:
        node.set(rng.choice(list(node.attrib)), rng.choice(NASTY))
    elif kind == 3 and node.attrib:
        del node.attrib[rng.choice(list(node.attrib))]
    elif kind == 4 and node.attrib and other.attrib:
        node.set(rng.choice(list(node.attrib)), rng.choice(list(other.attrib.values())))
    elif parent is None:
        return
    elif kind == 5:
        parent.remove(node)
    elif kind == 6:
        parent.append(copy.deepcopy(node))
    elif kind == 7:
        node.tag = other.tag
    else:
        strange = etree.fromstring(rng.choice([one for one in seeds if one.kind in XML]).data)
        graft = rng.choice([one for one in strange.iter() if isinstance(one.tag, str)])
        if sum(1 for _ in graft.iter()) < 2000:
            rng.choice((parent, node)).append(copy.deepcopy(graft))


# --- Readers --------------------------------------------------------------------------------------


def _scenario(seed: Seed, folder: Path) -> None:
    import numpy as np

    from bridgegen.openx.convert import roads_of
    from bridgegen.openx.openscenario.read import read
    from bridgegen.openx.openscenario.validate import problems
    from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

    path = folder / "mutated.xosc"
    path.write_bytes(seed.data)
    scenario = read(path)
    roads = roads_of(scenario, path)
    if problems(scenario, roads):
        return
    simulator = EmbeddedSimulator(scenario, path.name)
    if len(simulator.program.names) * simulator.program.n_steps < 2_000_000:
        simulator.run(simulator.roads([roads]), np.zeros(1, dtype=np.int64), {})


def _roads(seed: Seed, folder: Path) -> None:
    from bridgegen.openx.convert import import_file
    from bridgegen.openx.opendrive.read import read

    path = folder / "mutated.xodr"
    path.write_bytes(seed.data)
    read(path)
    import_file(path, folder / "mutated.owl")


def _individuals(seed: Seed, folder: Path) -> None:
    from bridgegen.scenario.ontology.check import check
    from bridgegen.scenario.ontology.files import from_bytes

    check(from_bytes(seed.data, "mutated.owl"))


def _logical(seed: Seed, folder: Path) -> None:
    from bridgegen.engine.pipeline import Pipeline
    from bridgegen.scenario.language.reader import load

    path = folder / "mutated.yaml"
    path.write_bytes(seed.data)
    scenario = load(path)
    Pipeline(scenario, scenario.space())


def _recording(seed: Seed, folder: Path) -> None:
    from bridgegen.assess.conflict.recorded import measure_recording

    path = folder / "mutated.csv"
    path.write_bytes(seed.data)
    measure_recording(path)


def _lanelets(seed: Seed, folder: Path) -> None:
    from bridgegen.openx.opendrive.read import read
    from bridgegen.openx.opendrive.road_map import map_bytes
    from bridgegen.openx.opendrive.validate import problems

    path = folder / "mutated.osm"
    path.write_bytes(seed.data)
    problems(read(map_bytes(path), path.name))


def _dsl(seed: Seed, folder: Path) -> None:
    from bridgegen.engine.pipeline import Pipeline
    from bridgegen.scenario.language.reader import load

    path = folder / "mutated.osc"
    path.write_bytes(seed.data)
    scenario = load(path)
    Pipeline(scenario, scenario.space())


def _tier4(seed: Seed, folder: Path) -> None:
    (folder / "town_map" / "map").mkdir(parents=True)
    (folder / "town_map" / "map" / "lanelet2_map.osm").write_bytes(
        (seed.beside / "two_way.osm").read_bytes()
    )
    from bridgegen.openx.openscenario.read import read
    from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

    path = folder / "mutated.yaml"
    path.write_bytes(seed.data)
    EmbeddedSimulator(read(path), path.name)


READERS: dict[str, Callable[[Seed, Path], None]] = {
    ".xosc": _scenario,
    ".xodr": _roads,
    ".owl": _individuals,
    ".yaml": _logical,
    ".csv": _recording,
    ".osm": _lanelets,
    ".osc": _dsl,
    ".tier4": _tier4,
}


# --- Seeds ----------------------------------------------------------------------------------------


def write_ours(folder: Path) -> None:
    """Write the catalogue's scenarios at their defaults into a folder, in all formats."""
    from importlib import resources

    from bridgegen.engine.pipeline import Pipeline
    from bridgegen.openx.opendrive.write import to_xml as road_xml
    from bridgegen.openx.openscenario.write import to_xml as scenario_xml
    from bridgegen.scenario.language.reader import load, names
    from bridgegen.scenario.ontology.files import save
    from bridgegen.simulation.trace import write_trace

    for name in names():
        scenario = load(name)
        space = scenario.space()
        pipeline = Pipeline(scenario, space)
        concrete = pipeline.runner.concrete(space.row({}), f"{name}.xodr")
        assert concrete.individuals is not None
        save(concrete.individuals, folder / f"{name}.owl")
        (folder / f"{name}.xodr").write_bytes(road_xml(concrete.roads))
        (folder / f"{name}.xosc").write_bytes(scenario_xml(concrete.storyboard))
        text = resources.files("bridgegen.scenario.catalogue").joinpath(f"{name}.yaml").read_bytes()
        (folder / f"{name}.yaml").write_bytes(text)
        write_trace(folder / f"{name}.csv", pipeline.rollout(space.row({})[None]))
    root = Path(__file__).parents[1]
    sys.path.append(str(root))
    from tests.openx.lanelet2.test_lanelet2 import LANES, TWO_WAY, arc, crossroads, osm
    from tests.openx.openscenario.test_tier4 import SCENARIO

    (folder / "two_way.osm").write_text(osm(TWO_WAY, LANES))
    (folder / "crossroads.osm").write_text(crossroads())
    (folder / "bend.osm").write_text(
        osm({1: arc(4, 1.4, 60), 2: arc(7.5, 1.4, 60)}, [(11, 1, 2, {})])
    )
    (folder / "scenario.tier4").write_text(SCENARIO)
    for example in (root / "docs" / "examples").glob("*.osc"):
        (folder / example.name).write_bytes(example.read_bytes())
    log = Path(__file__).parent / "simulation" / "data" / "esmini_log.csv"
    (folder / log.name).write_bytes(log.read_bytes())


def read_seeds(folders: list[Path], kinds: set[str]) -> list[Seed]:
    """Return the files in folders, of some kinds, that are sound XML and not above 300 kB."""
    seeds = []
    for path in sorted(path for folder in folders for path in folder.rglob("*")):
        if path.suffix in kinds and path.is_file() and path.stat().st_size < 300_000:
            data = path.read_bytes()
            with contextlib.suppress(etree.XMLSyntaxError):
                if path.suffix in XML:
                    etree.fromstring(data)
                seeds.append(Seed(path.suffix, data, path.parent))
    return seeds


# --- Running --------------------------------------------------------------------------------------


def try_one(seed: Seed) -> str:
    """Return "read", "refused", or what was found: the last line of a traceback and its place."""
    from bridgegen.base.errors import BridgeGenError

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for near in seed.beside.iterdir():  # the map that a storyboard names
            if near.suffix == ".xodr" and near.name.encode() in seed.data:
                (folder / near.name).symlink_to(near)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                READERS[seed.kind](seed, folder)
        except BridgeGenError as error:
            return "refused" if str(error).strip() else "found: an error without a word"
        except BaseException as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{Path(last.filename).name}:{last.lineno}"
            return f"found: {type(error).__name__} at {place}: {str(error)[:200]}"
    return "read"


def work(seeds: list[Seed], seed: int, numbers: range) -> None:
    """Try inputs one after the other; tell on stdout which is begun, and what came of it."""
    for kind in READERS:  # compile and import what they need
        for one in seeds:
            if one.kind == kind:
                try_one(one)
                break
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
    for number in numbers:
        print(f"begin {number}", flush=True)
        start = time.perf_counter()
        result = try_one(mutated(seeds, random.Random(f"{seed}/{number}")))
        took = time.perf_counter() - start
        if took > SECONDS:
            result = f"found: took {took:.1f} s ({result})"
        print(f"{number} {result}".replace("\n", " "), flush=True)


def watch(command: list[str], numbers: range, results: Counter[str]) -> None:
    """Run a worker over some inputs; start another behind an input that killed or stopped it."""
    while numbers:
        process = subprocess.Popen(
            [*command, str(numbers.start), str(numbers.stop), str(numbers.step)],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        at, patience = -1, START_SECONDS
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            while selector.select(patience) and (line := process.stdout.readline()):
                number, _, rest = line.strip().partition(" ")
                if number == "begin":
                    at = int(rest)
                else:
                    patience = 4 * SECONDS
                    _note(int(number), rest, results)
            process.kill() if process.poll() is None and at < numbers[-1] else None
        status = process.wait()
        if at < 0:
            raise RuntimeError(f"a worker ended before its first input (status {status})")
        if status == 0:
            return
        _note(at, f"found: hangs or dies (status {status})", results)
        numbers = range(at + numbers.step, numbers.stop, numbers.step)


def _note(number: int, result: str, results: Counter[str]) -> None:
    results[result.split(":")[0]] += 1
    if result.startswith("found"):
        print(number, result, flush=True)


def main() -> int:
    """Run, print what was found, and return 1 if anything was."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--inputs", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", default=",".join(READERS))
    parser.add_argument("--seeds", type=Path, action="append", default=[], metavar="FOLDER")
    parser.add_argument("--only", type=int, help="try this one input, and write it to stdout")
    parser.add_argument("--worker", type=int, nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    kinds = {f".{kind.lstrip('.')}" for kind in given.kinds.split(",")}
    if given.worker:
        work(read_seeds(given.seeds, kinds), given.seed, range(*given.worker))
        return 0
    with tempfile.TemporaryDirectory() as name:
        write_ours(Path(name))
        folders = [Path(name), *given.seeds]
        if given.only is not None:
            rng = random.Random(f"{given.seed}/{given.only}")
            one = mutated(read_seeds(folders, kinds), rng)
            sys.stdout.buffer.write(one.data)
            print(try_one(one), file=sys.stderr)
            return 0
        return _run(folders, given)


def _run(folders: list[Path], given: argparse.Namespace) -> int:
    command = [sys.executable, __file__, "--seed", str(given.seed), "--kinds", given.kinds]
    command += [part for folder in folders for part in ("--seeds", str(folder))]
    results: Counter[str] = Counter()
    with ThreadPoolExecutor(given.jobs) as pool:
        jobs = [
            pool.submit(watch, [*command, "--worker"], range(k, given.inputs, given.jobs), results)
            for k in range(given.jobs)
        ]
        for job in jobs:
            job.result()
    print(", ".join(f"{count} {what}" for what, count in sorted(results.items())))
    return 1 if results["found"] else 0


if __name__ == "__main__":
    sys.exit(main())
