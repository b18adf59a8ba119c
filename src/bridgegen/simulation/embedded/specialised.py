"""Rows of one storyboard in code specialised to it, once so many run that its compilation pays.

Generic code, that of all storyboards, reads from tables what a storyboard consists of, and how
large its arrays are. Code in which these are constants takes 0.5 to 0.7 of the time, and some
seconds to compile: another process does so while rows run. It gives the same bits, so it does not
matter when, or whether, it comes.
"""

import hashlib
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np
from llvmlite import binding as llvm
from numba.core import itanium_mangler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from bridgegen.base.arrays import Int
from bridgegen.base.compilation.folder import cache_folder, digest
from bridgegen.base.compilation.library import KernelLibrary
from bridgegen.base.compilation.whole_program import machine_code
from bridgegen.base.compiled import compile_for_kernels, row_type
from bridgegen.base.processes.child import Child
from bridgegen.simulation.embedded import _memory_kernels as memory
from bridgegen.simulation.embedded import _rollout_kernels as kernels
from bridgegen.simulation.embedded.addresses import CALLED, FIELDS, addressed
from bridgegen.simulation.embedded.drivers import DEMANDS
from bridgegen.simulation.embedded.program import Program

SAVED = 0.4
"""Share of a rollout's processor time that specialised code saves: see docs/decisions/speed.md."""

COST = 8.0
"""Processor time of a compilation, until one was measured on this machine [s]."""

WORTHWHILE = 0.5
"""Processor time of rows after which the cache is asked for code of an earlier process [s]: the
question takes a millisecond."""

KEPT = 64
"""Number of storyboards that are remembered."""

LARGEST = 4096
"""Number of elements of a table up to which its content is a constant, too."""


@dataclass(repr=False)
class _Storyboard:
    """What is known of the rows of a storyboard, for arrays of one shape.

    Attributes:
        program: held, since its identity names it.
        seconds: processor time that its rows have taken; None before the first batch, which may
            compile what all storyboards share.
        job: what is compiled; None before it was looked for.
        code: machine code, not loaded yet.
        address: of its code; 0: none.
    """

    program: Program
    seconds: float | None = None
    job: tuple[Any, ...] | None = None
    code: bytes = b""
    address: int = 0


_KNOWN: OrderedDict[tuple[Any, ...], _Storyboard] = OrderedDict()
_LOCK = threading.Lock()
_COMPILING: list[Child] = []
"""The process that compiles, if there is one."""


def simulate_rows(
    program: Program,
    plan: memory.Plan,
    networks: memory.Roads,
    rows: Int,
    states: memory.State,
    records: memory.Record,
) -> None:
    """Do as ``_rollout_kernels.simulate_rows``, in specialised code if there is some."""
    given = plan, networks, rows, states, records
    if numba.config.DISABLE_JIT:
        kernels.simulate_rows(*given)
        return
    shapes = (array.shape[1:] for arrays in (networks, states, records) for array in arrays)
    key = (id(program), plan.until_collision, *shapes)
    with _LOCK:
        storyboard = _KNOWN.setdefault(key, _Storyboard(program))
        _KNOWN.move_to_end(key)
        if len(_KNOWN) > KEPT:
            _KNOWN.popitem(last=False)
    if storyboard.code:
        _load(storyboard)
    if storyboard.address:
        kernels.simulate_rows_at(storyboard.address, *given)
        return
    started = time.thread_time()
    kernels.simulate_rows(*given)
    if storyboard.seconds is None:
        storyboard.seconds = 0.0
        return
    storyboard.seconds += time.thread_time() - started
    if storyboard.seconds > WORTHWHILE:
        with _LOCK:
            _consider(storyboard, plan, networks, states, records)


def _consider(storyboard: _Storyboard, *bundles: Any) -> None:
    """Find code of an earlier process, or have some compiled if that would have paid by now."""
    store = KernelLibrary.store
    if storyboard.job is None:
        storyboard.job = _job(storyboard.program, *bundles)
        storyboard.code = store.read(storyboard.job[-1], "o") or b""
        return
    # How many rows will come is not known. Compiling once it would have paid takes at most twice as
    # long as the best choice would.
    cost = store.read("specialised", "seconds") or COST
    if _COMPILING or storyboard.seconds is None or storyboard.seconds * SAVED < cost:
        return

    def take(message: tuple[Any, ...]) -> None:
        if message[0] == "compiled":
            assert storyboard.job is not None
            storyboard.code = message[1]
            store.write(storyboard.job[-1], "o", message[1])
            store.write("specialised", "seconds", message[2])
        elif message[0] == "died":
            _COMPILING.clear()

    storyboard.seconds = -np.inf  # once, whatever comes of it
    # Where no further process can be started, rows go on as they are.
    with suppress(OSError), open(os.devnull, "wb") as nowhere:
        child = Child(["-m", "bridgegen.base.compilation.whole_program"], take, errors=nowhere)
        _COMPILING.append(child)
        child.send((cache_folder(), *storyboard.job))


def _load(storyboard: _Storyboard) -> None:
    """Load the code of a storyboard."""
    assert storyboard.job is not None
    with global_compiler_lock:
        engine = cpu_target.target_context.codegen()._engine
        if not storyboard.address:
            name = storyboard.job[-1]
            if not engine._ee.get_function_address(name):
                engine._ee.add_object_file(llvm.ObjectFileRef.from_data(storyboard.code))
                engine.finalize_object()
            storyboard.address = engine._ee.get_function_address(name)
    storyboard.code = b""


# --- What is constant for all rows of a storyboard ---


def _job(program: Program, plan: memory.Plan, *rows: Any) -> tuple[Any, ...]:
    """Return the arguments of `whole_program.machine_code`, but the first."""
    kinds = (row_type(plan, 0), *map(row_type, rows))
    called: list[str] = []

    def at(kernel: Callable[..., Any]) -> int:
        library = compile_for_kernels(kernel, (*CALLED[kernel], *kinds)).library
        called.append(library.symbol)
        return len(called)

    coded = addressed(plan, DEMANDS.get(program.driver.kernel), at)
    root = compile_for_kernels(kernels.simulate_row, kinds).library.symbol
    tables: list[str] = []
    known = {
        itanium_mangler.mangle_type(kind): _constants(kind, bundle, i > 0, called, tables)
        for i, (kind, bundle) in enumerate(zip(kinds, (coded, *rows), strict=True))
    }
    compiler = digest(Path(machine_code.__code__.co_filename))
    said = repr((compiler, root, called, known, tables)).encode()
    return root, called, known, tables, f"specialised_{hashlib.sha256(said).hexdigest()[:24]}"


def _constants(
    kind: Any, bundle: Any, is_row: bool, called: list[str], tables: list[str]
) -> dict[int, str]:
    """Return where a bundle has constants, and which; add the tables that it has itself.

    Args:
        kind: type of the bundle.
        bundle: its arrays and numbers; of N rows if ``is_row``.
        is_row: whether it is of one row.
        called: symbols of kernels, by their number from 1 on.
        tables: is added to.
    """
    found: dict[int, str] = {}
    at = 0
    for name, value, held in zip(bundle._fields, bundle, kind.held.types, strict=True):
        if not isinstance(value, np.ndarray):
            codes = name in FIELDS
            found[at] = _symbol(called, value) if codes else _words(np.array([value]))[0]
            at += 8
            continue
        shape = value.shape[1:] if is_row else value.shape
        d = len(shape)
        numbers: dict[int, int] = {2: int(np.prod(shape)), 3: value.itemsize}
        numbers |= {5 + axis: size for axis, size in enumerate(shape)}
        if held.layout == "C":
            steps = (value.itemsize * int(np.prod(shape[axis + 1 :])) for axis in range(d))
            numbers |= {5 + d + axis: step for axis, step in enumerate(steps)}
        # Numba's array: owner, its parent, elements, bytes of one, data, shape, strides.
        found |= {at + 8 * word: f"i64 {number}" for word, number in numbers.items()}
        if held.layout == "C" and not is_row and 0 < value.size <= LARGEST:
            words = (
                [_symbol(called, code) for code in value.tolist()]
                if name in FIELDS
                else _words(value.reshape(-1))
            )
            size = f"[{value.size} x {words[0].split()[0]}]"
            tables.append(f"@{name}.table = internal constant {size} [{', '.join(words)}], align 8")
            found[at + 8 * 4] = f"ptr @{name}.table"
        at += 8 * (5 + 2 * d)
    return found


def _words(values: np.ndarray) -> list[str]:
    """Return numbers as constants of LLVM's IR."""
    if values.dtype == np.float64:
        return [f"double 0x{bits:016X}" for bits in values.view(np.uint64).tolist()]
    return [f"i{8 * values.itemsize} {int(value)}" for value in values.tolist()]


def _symbol(called: list[str], code: int) -> str:
    """Return the address of a kernel as a constant of LLVM's IR."""
    return f"i64 ptrtoint (ptr @{called[code - 1]} to i64)" if code else "i64 0"
