"""Rows of a storyboard on a GPU: a thread for each, by the module that ``tools/portable.py`` makes.

All threads share tables, in constant memory, of what lies where in a row's memory; so the module is
the same for all storyboards. State, record and verdict of 32 rows are interleaved, since what 32
threads read at once should lie in one piece; threads use theirs again for further rows.
"""

import gzip
import os
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.cuda import DEVICE, Gpu, OutOfMemory
from bridgegen.base.errors import InputError, WorkersError
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.simulation.embedded import _memory_kernels as memory
from bridgegen.simulation.embedded import _rollout_kernels as kernels
from bridgegen.simulation.embedded.addresses import CALLED, addressed
from bridgegen.simulation.embedded.batch import noise_keys, put_back, starts_of, taken
from bridgegen.simulation.embedded.drivers import DEMANDS
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.program import Program

PATH = Path(__file__).with_name("kernels.ptx.gz")
"""The module."""

LANES = 32
"""Number of rows that are interleaved: a warp's threads."""

THREADS = 64
"""Number of threads of a block."""

BLOCKS = 4
"""Number of blocks for each multiprocessor: 255 registers a thread leave room for 256 threads."""

LARGEST_SHARE = 0.8
"""Share of the free memory that is taken."""

HEAP, HEAP_EACH, HEAP_SEEN = 1 << 15, 96, 160
"""Memory that a thread may take during a row [bytes], and more for each participant and instant:
of all, and where detections are measured."""

INTERLEAVED = ("state", "record", "verdict")

JOB = (
    *("ROWS", "ASKED", "HEAP", "HEAP_BYTES", "LANES", "RECORD_LANES", "TEMPLATE"),
    *("networks", "plan", "roads", "roads_bytes", "state", "state_bytes", "record"),
    *("record_bytes", "facts", "facts_bytes", "measuring", "measuring_bytes", "verdict"),
    *("verdict_bytes", "given", "given_bytes", "found", "found_bytes"),
)
"""Words of the module's variable ``job``."""

MOTION = 0
"""What is asked of a row: its motion alone."""


class Given(NamedTuple):
    """What a row has of its own before it starts; see `State`."""

    slots: Float
    station: Float
    aside: Float
    key: npt.NDArray[np.uint64]


class Found(NamedTuple):
    """What remains of a row.

    Attributes:
        done: ``(1,)`` 1 of a row that ended; 0 of one whose thread had too little memory.
        ending, wanted, transitions: see `State`.
        on: ``(1,)`` the path that the ego is on,
        way: ``(3,)`` how far it drove, its station [m], the friction at the end [m/s²].
        code: ``(1,)`` what is implausible; see ``plausibility.Implausible``.
        worst: ``(1,)`` the highest kind of its conflicts; see ``_codes``.
        metrics: ``(len(MEASURED),)``; NaN of one that was not asked for.
        whole, real, potential, severity, changes, aside, breach, instants: see `Verdict`.
    """

    done: Int
    ending: Int
    wanted: Int
    transitions: Int
    on: Int
    way: Float
    code: Int
    worst: Int
    metrics: Float
    whole: Int
    real: Float
    potential: Float
    severity: Float
    changes: Float
    aside: Float
    breach: Float
    instants: Int


def given_of(states: memory.State) -> Given:
    """Return what N rows have of their own."""
    return Given(states.slots, states.station, states.aside, states.key)


def own_of(
    program: Program, roads: Network, rows: Int, values: Mapping[str, npt.ArrayLike]
) -> Given:
    """Return what N rows have of their own; see `Batch`, which makes all of their states."""
    slots = program.fill(values, len(rows))
    station, aside = starts_of(program, roads, rows, slots)
    return Given(slots, station, aside, noise_keys(program, values, len(rows))[:, np.newaxis])


def found_of(n: int, e: int = 0, metrics: int = 0, whole: int = 0, real: int = 0) -> Found:
    """Return arrays of N rows, zeros.

    Args:
        n: N.
        e: how many participants there are; 0 where only motion is asked for, as of the others.
        metrics: how many metrics.
        whole: how many whole numbers of each pair,
        real: and how many numbers.
    """
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(Found._fields, (e,))
    shapes |= dict.fromkeys(("done", "on", "code", "worst"), (1,))
    shapes |= {"ending": (4,), "wanted": (2,), "transitions": (2,), "instants": (2,), "way": (3,)}
    shapes |= {"metrics": (metrics,), "whole": (e, whole), "real": (e, real), "changes": (e, 2)}
    floats = {"way", "metrics", "real", "potential", "severity", "changes", "aside", "breach"}
    return Found(
        **{
            name: np.zeros((n, *shape), float if name in floats else np.int64)
            for name, shape in shapes.items()
        }
    )


def some_of(rows: Any, at: Int | slice) -> Any:
    """Return some rows of a named tuple of arrays."""
    return type(rows)(*(array[at] for array in rows))


# --- Where arrays lie ---


def table_of(bundle: NamedTuple, axes: int, lanes: int = 1) -> tuple[Int, int]:
    """Return what the module knows of a bundle, in words, and the bytes of ``lanes`` rows.

    Args:
        bundle: arrays of N rows, and numbers.
        axes: how many first axes a row has not.
        lanes: how many rows are interleaved, a word each; 1: none, elements lie side by side.
    """
    words: list[int] = []
    at = 0
    for value in bundle:
        if not isinstance(value, np.ndarray):
            words.append(
                int(np.array([value], np.float64).view(np.int64)[0])
                if isinstance(value, float)
                else int(value)
            )
            continue
        shape = value.shape[axes:]
        step = value.itemsize if lanes == 1 else 8 * lanes
        strides = [step * int(np.prod(shape[k + 1 :])) for k in range(len(shape))]
        count = int(np.prod(shape))
        words += [at, count, *shape, *strides]
        at += -(-count * step // 8) * 8
    return np.array(words, np.int64), at


def packed(bundle: NamedTuple, axes: int) -> npt.NDArray[np.uint8]:
    """Return the bytes of a bundle's arrays that are not interleaved, ``(N, size)``."""
    arrays = [value for value in bundle if isinstance(value, np.ndarray)]
    n = len(arrays[0]) if axes else 1
    parts = [np.ascontiguousarray(value).reshape(n, -1).view(np.uint8) for value in arrays]
    return np.concatenate([np.pad(part, ((0, 0), (0, -part.shape[1] % 8))) for part in parts], 1)


def views_of(block: npt.NDArray[np.uint8], bundle: Any) -> Any:
    """Return arrays as those of a bundle, but of the rows whose bytes ``(N, size)`` are given."""
    found, at = [], 0
    for value in bundle:
        shape, strides = (len(block), *value.shape[1:]), (block.shape[1], *value.strides[1:])
        found.append(np.ndarray(shape, value.dtype, block.data, at, strides))
        at += -(-int(np.prod(shape[1:])) * value.itemsize // 8) * 8
    return type(bundle)(*found)


def template_of(states: memory.State) -> npt.NDArray[np.uint64]:
    """Return a row's state before it starts, without what is its own, a word each element."""
    words = []
    for name, value in states._asdict().items():
        one = np.ascontiguousarray(value[0]).reshape(-1)
        word = np.zeros((one.size, 8), np.uint8)
        if name not in Given._fields:
            word[:, : one.itemsize] = one.view(np.uint8).reshape(one.size, one.itemsize)
        words.append(word)
    return np.concatenate(words).reshape(-1).view(np.uint64)


class Judging(NamedTuple):
    """What judging rows needs; see `bridgegen.assess.conflict`.

    Attributes:
        asked: what is asked of a row.
        facts: arrays of P road networks, and numbers,
        measuring: likewise,
        verdict: room for one row.
        found: arrays of one row, for their shapes.
    """

    asked: int
    facts: Any
    measuring: Any
    verdict: Any
    found: Found


class Device:
    """A GPU that rolls rows out; several threads may use it.

    Attributes:
        name: of the GPU.

    Raises:
        InputError: there is no GPU, or this installation has no kernels for it.
    """

    def __init__(self) -> None:
        if not PATH.is_file():
            raise InputError("--device cuda: this installation has no kernels for GPUs")
        self._gpu = Gpu(gzip.decompress(PATH.read_bytes()))
        self.name = self._gpu.name
        self._lock = Lock()
        self._entry = self._gpu.function("rows")
        self._rooms: dict[str, tuple[int, int]] = {}

    def simulate_rows(
        self,
        program: Program,
        plan: memory.Plan,
        roads: memory.Roads,
        rows: Int,
        states: memory.State,
        records: memory.Record,
    ) -> None:
        """Roll N rows out as ``_rollout_kernels.simulate_rows`` does, with the same bits.

        Of the states, what a rollout consists of is filled.

        Args:
            program: the storyboard.
            plan: of this process,
            roads: see ``simulate_rows``, as for the others.
            rows: likewise.
            states: likewise.
            records: likewise.
        """
        given, table = given_of(states), coded(plan, program)
        template = template_of(states)
        size = table_of(records, 1)[1]
        for start, stop in self._parts(len(rows), size):
            at = slice(start, stop)
            some = some_of(records, at)
            own = some_of(given, at)
            found = self.run(table, roads, rows[at], own, states, template, some, None)
            (there,) = np.nonzero(found.done[:, 0])
            done, lost = start + there, start + np.flatnonzero(found.done[:, 0] == 0)
            states.ending[done], states.wanted[done] = found.ending[there], found.wanted[there]
            states.transitions[done] = found.transitions[there]
            states.on[done, 0], way = found.on[there, 0], found.way[there]
            states.travelled[done, 0], states.station[done, 0] = way[:, 0], way[:, 1]
            states.weather[done, FRICTION] = way[:, 2]
            if lost.size:  # this processor has more memory for a row
                state, record = taken(states, lost), taken(records, lost)
                kernels.simulate_rows(plan, roads, rows[lost], state, record)
                put_back(states, state, lost)
                put_back(records, record, lost)

    def _parts(self, n: int, size: int) -> Sequence[tuple[int, int]]:
        """Return the bounds of parts of N rows whose records fit into half of the memory."""
        with self._lock:
            self._gpu.enter()
            most = max(int(0.5 * self._gpu.free_bytes()) // max(size, 1), LANES)
        return [(at, min(at + most, n)) for at in range(0, n, most)]

    def run(
        self,
        plan: memory.Plan,
        roads: memory.Roads,
        networks: Int,
        given: Given,
        states: memory.State,
        template: npt.NDArray[np.uint64],
        records: memory.Record,
        judging: Judging | None,
    ) -> Found:
        """Run N rows; fill their records, unless they are judged.

        Args:
            plan: with codes of kernels.
            roads: P networks.
            networks: ``(N,)`` the one of each row.
            given: of N rows.
            states: of any rows, for their shapes.
            template: see `template_of`.
            records: of N rows; of any, where rows are judged.
            judging: what judging needs; None: rows are not judged.
        """
        with self._lock:
            self._gpu.enter()
            try:
                return self._run(plan, roads, networks, given, states, template, records, judging)
            except OutOfMemory as error:
                raise WorkersError(
                    f"the GPU ({self.name}) has too little memory ({error})"
                ) from None

    def _run(
        self,
        plan: memory.Plan,
        roads: memory.Roads,
        networks: Int,
        given: Given,
        states: memory.State,
        template: npt.NDArray[np.uint64],
        records: memory.Record,
        judging: Judging | None,
    ) -> Found:
        n = len(networks)
        like = judging.found if judging else found_of(1)
        keeps = judging is None
        tables = {
            "plan": table_of(plan, 0),
            "roads": table_of(roads, 1),
            "state": table_of(states, 1, LANES),
            "record": table_of(records, 1, 1 if keeps else LANES),
            "given": table_of(given, 1),
            "found": table_of(like, 1),
        }
        if judging:
            tables |= {
                "facts": table_of(judging.facts, 1),
                "measuring": table_of(judging.measuring, 1),
                "verdict": table_of(judging.verdict, 0, LANES),
            }
        sizes = {name: size for name, (_, size) in tables.items()}
        e, t = records.x.shape[1:]
        heap = HEAP + HEAP_EACH * e * t + (HEAP_SEEN * e * t if records.detections.size else 0)
        each = sizes["state"] // LANES + heap
        if judging:
            each += (sizes["record"] + sizes["verdict"]) // LANES
        content: dict[str, npt.NDArray[Any]] = {
            "plan": packed(plan, 0),
            "roads": packed(roads, 1),
            "given": packed(given, 1),
        }
        content |= {"TEMPLATE": template, "networks": np.ascontiguousarray(networks)}
        if judging:
            content |= {
                "facts": packed(judging.facts, 1),
                "measuring": packed(judging.measuring, 1),
            }
        job = dict.fromkeys(JOB, 0)
        job |= {name: self._put(name, array) for name, array in content.items()}
        job["found"] = self._room("found", n * sizes["found"])
        self._gpu.clear(job["found"], n * sizes["found"])
        if keeps:
            job["record"] = self._room("record", n * sizes["record"])
        blocks = self._blocks(n, each)
        threads = blocks * THREADS
        job["HEAP"] = self._room("HEAP", threads * heap)
        for name in INTERLEAVED[: 1 if keeps else 3]:
            job[name] = self._room(name, threads // LANES * sizes[name])
        job |= {f"{name}_bytes": size for name, size in sizes.items() if f"{name}_bytes" in job}
        job |= {"ROWS": n, "ASKED": judging.asked if judging else MOTION, "HEAP_BYTES": heap}
        job |= {"LANES": LANES, "RECORD_LANES": 1 if keeps else LANES}
        for name, (words, _) in tables.items():
            self._gpu.put(self._gpu.symbol(f"table_{name}"), words)
        self._gpu.put(self._gpu.symbol("job"), np.array([job[name] for name in JOB], np.int64))
        self._gpu.launch(self._entry, blocks, THREADS)
        block = np.empty((n, sizes["found"]), np.uint8)
        self._gpu.get(block, job["found"])
        found: Found = views_of(block, like)
        if keeps:
            block = np.empty((n, sizes["record"]), np.uint8)
            self._gpu.get(block, job["record"])
            done = found.done[:, 0] == 1
            rows = slice(None) if done.all() else np.flatnonzero(done)
            pairs: Any = zip(records, views_of(block, records), strict=True)
            for array, part in pairs:
                array[rows] = part[rows]
        return found

    def _blocks(self, n: int, each: int) -> int:
        """Return how many blocks of threads run N rows.

        Raises:
            OutOfMemory: not even one has as many bytes as each thread needs.
        """
        held = sum(self._rooms[name][1] for name in ("HEAP", *INTERLEAVED) if name in self._rooms)
        most = int(LARGEST_SHARE * (self._gpu.free_bytes() + held)) // (each * THREADS)
        if most < 1:
            raise OutOfMemory(f"{each * THREADS / 2**20:.0f} MiB for {THREADS} rows")
        return min(most, -(-n // THREADS), BLOCKS * self._gpu.processors)

    def _put(self, name: str, array: npt.NDArray[Any]) -> int:
        at = self._room(name, array.nbytes)
        self._gpu.put(at, array)
        return at

    def _room(self, name: str, size: int) -> int:
        """Return where memory for a purpose lies; it is kept for the next call."""
        at, there = self._rooms.get(name, (0, 0))
        if there < size:
            if there:
                del self._rooms[name]
                self._gpu.give_back(at)
            at = self._gpu.take(size)
            self._rooms[name] = at, size
        return at


@cache
def _opened() -> Device:
    return Device()


def current() -> Device:
    """Return the device of this process.

    Raises:
        InputError: another one than "cuda" is asked for, or there is none.
    """
    if (name := os.environ.get(DEVICE)) != "cuda":
        raise InputError(f"--device must be cuda, got {name}")
    return _opened()


def coded(plan: memory.Plan, program: Program) -> memory.Plan:
    """Return a plan with the numbers of kernels in ``CALLED``, from 1 on, in place of addresses."""
    order = list(CALLED)
    drives = DEMANDS.get(program.driver.kernel)
    return addressed(plan, drives, lambda kernel: 1 + order.index(kernel))
