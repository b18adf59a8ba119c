"""Link the kernels into one module, which simulates any row of any storyboard elsewhere.

    .venv/bin/python tools/portable.py           # two minutes; writes pages/web/kernels.wasm
    .venv/bin/python tools/portable.py cuda      # five; writes engine/device/kernels.ptx.gz

Numba types and lowers each kernel as always; the bitcode of all is linked before anything has been
optimised for this processor, and LLVM writes it for another one. Nothing is specialised to a
storyboard: tables say where the arrays of its bundles lie, and a kernel that is called by its
address is called by its number in ``CALLED``.

In a browser a bundle is such a table, and functions have addresses. LLVM's object file is a module
whose relocations hold already, so no linker is needed. On a GPU all threads share the tables, in
constant memory, and a bundle is where the row's memory begins, so that neighbours in a warp read
neighbouring words; and a kernel is called by a switch over all, so that the driver knows how much
stack a thread needs.
"""

import gzip
import os
import re
import sys
import tempfile
import time
from collections.abc import Collection, Iterable, Iterator
from typing import Any, NamedTuple

# Bitcode that is not optimised must not reach the cache, whose folder is chosen at import.
os.environ["NUMBA_CACHE_DIR"] = tempfile.mkdtemp(prefix="bridgegen-portable-")

import numpy as np
from llvmlite import binding as llvm
from numba import types
from numba.core import codegen
from numba.core.runtime import rtsys

from bridgegen.assess.conflict._judge_kernels import judge_row
from bridgegen.assess.conflict._measure_kernels import implausible_row, measure_row
from bridgegen.assess.conflict.judging import facts_of, measuring_of, verdict_of
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compilation.library import KernelLibrary
from bridgegen.base.compiled import compile_for_kernels, row_type
from bridgegen.drivers.lane_tables import CORRIDOR
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import portable
from bridgegen.simulation.embedded._rollout_kernels import simulate_row
from bridgegen.simulation.embedded.addresses import CALLED

TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+bulk-memory,+bulk-memory-opt,+nontrapping-fptoint,+sign-ext,+mutable-globals"
EXPORTS = ("simulate", "judge", "implausible", "measure", "function", "address")

RUNTIME = """
@heap = global i32 0

define internal void @NRT_incref(ptr %p) alwaysinline {{ ret void }}
define internal void @NRT_decref(ptr %p) alwaysinline {{ ret void }}

define internal ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) noinline {{
  %at = load i32, ptr @heap
  %p = inttoptr i32 %at to ptr
  %short = trunc i64 %size to i32
  %more = add i32 %short, 127
  %whole = and i32 %more, -64
  %next = add i32 %at, %whole
  store i32 %next, ptr @heap
  %data = getelementptr i8, ptr %p, i32 64
  store ptr %data, ptr %p
  ret ptr %p
}}

define internal ptr @NRT_MemInfo_alloc_safe_aligned(i64 %size, i32 %align) alwaysinline {{
  %p = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align)
  ret ptr %p
}}

define internal ptr @NRT_MemInfo_data_fast(ptr %p) alwaysinline {{
  %data = load ptr, ptr %p
  ret ptr %data
}}

define internal {{ i64, i1 }} @product(i64 %a, i64 %b) alwaysinline {{
  %p = mul i64 %a, %b
  %r = insertvalue {{ i64, i1 }} {{ i64 undef, i1 false }}, i64 %p, 0
  ret {{ i64, i1 }} %r
}}

define void @simulate(ptr %plan, ptr %roads, ptr %state, ptr %record, i32 %heap) {{
  %answer = alloca i64
  %error = alloca ptr
  store i32 %heap, ptr @heap
  call i32 @"{simulate}"(ptr %answer, ptr %error, ptr %plan, ptr %roads, ptr %state, ptr %record)
  ret void
}}

define void @judge(
  i32 %steps, i32 %status, i32 %path, double %friction, ptr %facts, ptr %record, ptr %verdict
) {{
  %answer = alloca i64
  %error = alloca ptr
  %n = sext i32 %steps to i64
  %s = sext i32 %status to i64
  %p = sext i32 %path to i64
  call i32 @"{judge}"(
    ptr %answer, ptr %error, i64 %n, i64 %s, i64 %p, double %friction,
    ptr %facts, ptr %record, ptr %verdict
  )
  ret void
}}

define i32 @implausible(
  i32 %steps, ptr %facts, ptr %measuring, ptr %record, ptr %verdict, i32 %heap
) {{
  %answer = alloca i8
  %error = alloca ptr
  store i32 %heap, ptr @heap
  %n = sext i32 %steps to i64
  call i32 @"{implausible}"(
    ptr %answer, ptr %error, i64 %n, ptr %facts, ptr %measuring, ptr %record, ptr %verdict
  )
  %code = load i8, ptr %answer
  %value = zext i8 %code to i32
  ret i32 %value
}}

define double @measure(
  i32 %which, i32 %steps, ptr %facts, ptr %measuring, ptr %record, ptr %verdict, i32 %heap
) {{
  %answer = alloca double
  %error = alloca ptr
  store i32 %heap, ptr @heap
  %w = sext i32 %which to i64
  %n = sext i32 %steps to i64
  call i32 @"{measure}"(
    ptr %answer, ptr %error, i64 %w, i64 %n, ptr %facts, ptr %measuring, ptr %record, ptr %verdict
  )
  %value = load double, ptr %answer
  ret double %value
}}

define double @function(i32 %which, double %x, double %y) {{
  %answer = alloca double
  %error = alloca ptr
  %number = zext i32 %which to i64
  call i32 @"{function}"(ptr %answer, ptr %error, i64 %number, double %x, double %y)
  %value = load double, ptr %answer
  ret double %value
}}

define i32 @address(i32 %code) {{
  switch i32 %code, label %none [ {cases} ]
none:
  ret i32 0
{blocks}
}}
"""
"""What the module has besides kernels, in LLVM's IR: entries, and memory that grows during a row.

A product of two lengths cannot overflow here, so that the check, which would need 128 bits, goes.
"""


def link_late() -> None:
    """Have Numba keep each kernel's bitcode as it lowers it, and link none into another."""
    add, finalize = codegen.CodeLibrary.add_linking_library, KernelLibrary.finalize

    def lay_out(self: Any, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def finalize_without_runtime(self: Any) -> None:
        own = [library for library in self._linking_libraries if library is not rtsys.library]
        self._linking_libraries = own
        finalize(self)

    def add_what_is_ours(self: Any, library: Any) -> None:
        if library is not rtsys.library:
            add(self, library)

    KernelLibrary.is_large = property(lambda self: bool(self.symbol))
    KernelLibrary.finalize = finalize_without_runtime
    KernelLibrary._optimize_final_module = lambda self: None
    codegen.CPUCodeLibrary._optimize_functions = lay_out
    codegen.CPUCodeLibrary._optimize_final_module = lambda self: None
    codegen.CodeLibrary.add_linking_library = add_what_is_ours


def symbol_of(kernel: Any, kinds: tuple[Any, ...]) -> str:
    """Compile a kernel for arguments of some types; return the symbol of its code."""
    if (known := kernel.overloads.get(kinds)) and not known.library.inner:
        del kernel.overloads[
            kinds
        ]  # Python has called it, and what is made for it has another form
    found: str = compile_for_kernels(kernel, kinds).fndesc.llvm_func_name
    return found


def reachable(roots: Iterable[str]) -> set[str]:
    """Return the symbols of kernels, and of all that they call."""
    found: set[str] = set()
    left = list(roots)
    while left:
        if (symbol := left.pop()) not in found:
            found.add(symbol)
            left += KernelLibrary.by_symbol[symbol].callees
    return found


class Kinds(NamedTuple):
    """Numba's types of the bundles that kernels of a row take, by what they describe."""

    plan: Any
    roads: Any
    state: Any
    record: Any
    facts: Any
    measuring: Any
    verdict: Any


def kinds() -> Kinds:
    """Return the types of bundles; those of all storyboards are the same."""
    logical = load("crossroads-s4")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego="reference"))
    batch = pipeline.runner.nominal_batch()
    rows = batch.kinds()
    rollout = batch.standing()
    facts = facts_of(rollout, 0, np.zeros((0, CORRIDOR)))
    bundles = (facts, measuring_of(rollout, 0), verdict_of(*rollout.shape[1:]))
    return Kinds(*rows, *(row_type(bundle, 0) for bundle in bundles))


def module_of(symbols: Iterable[str]) -> str:
    """Return kernels, and all that they call, as one module in LLVM's IR, for no machine yet."""
    every = sorted(reachable(symbols))
    print(f"{len(every)} kernels", flush=True)
    module = llvm.parse_bitcode(KernelLibrary.by_symbol[every[0]]._bitcode)
    for symbol in every[1:]:
        module.link_in(llvm.parse_bitcode(KernelLibrary.by_symbol[symbol]._bitcode))
    return _without_machine(str(module))


def linked() -> str:
    """Return all kernels as one module in LLVM's IR, with the entries for a page."""
    of = kinds()
    rows = of[:4]
    measured = (types.int64, of.facts, of.measuring, of.record, of.verdict)
    numbers = (types.int64, types.int64, types.int64, types.float64)
    entries = {
        "simulate": symbol_of(simulate_row, rows),
        "judge": symbol_of(judge_row, (*numbers, of.facts, of.record, of.verdict)),
        "implausible": symbol_of(implausible_row, measured),
        "measure": symbol_of(measure_row, (types.int64, *measured)),
        "function": symbol_of(elementary.value, (types.int64, types.float64, types.float64)),
    }
    called = [symbol_of(kernel, (*first, *rows)) for kernel, first in CALLED.items()]
    return module_of([*entries.values(), *called]) + RUNTIME.format(
        **entries,
        cases=" ".join(f"i32 {code}, label %c{code}" for code in range(1, len(called) + 1)),
        blocks="\n".join(
            f'c{code}:\n  ret i32 ptrtoint (ptr @"{symbol}" to i32)'
            for code, symbol in enumerate(called, 1)
        ),
    )


def _without_machine(text: str) -> str:
    """Return a module's IR without what is said of a machine, and without Numba's run time."""
    for pattern in (
        r'target (datalayout|triple) = "[^"]*"',
        r'"target-(cpu|features)"="[^"]*"',
        r"^declare [^@\n]*@(llvm\.smul\.with\.overflow\.i64|NRT_\w+)\(.*$",
        r"^define [^@\n]*@NRT_\w+\([^\n]*\{\n(.*\n)*?\}\n",
    ):
        text = re.sub(pattern, "", text, flags=re.MULTILINE)
    # What errors would say: no kernel raises, and it names files of this machine.
    pickled = r"^(@\.const\.pickledata[^\n]*? constant \[\d+ x i8\]) c\"[^\"]*\""
    text = re.sub(pickled, r"\1 zeroinitializer", text, flags=re.MULTILINE)
    text = text.replace("@llvm.smul.with.overflow.i64(", "@product(")
    # Where all that is made for inlining is inlined, browsers take 1.13 times as long for a row:
    # their compilers keep little of so large a function in registers.
    text = text.replace(" alwaysinline ", " inlinehint ")
    for name in ("sqrt", "ceil", "floor", "fabs", "trunc", "rint"):
        text = text.replace(f"@{name}(", f"@llvm.{name}.f64(")  # an instruction, not a library's
        text = re.sub(rf"^declare [^@\n]*@llvm\.{name}\.f64\(.*$", "", text, flags=re.MULTILINE)
        text += f"\ndeclare double @llvm.{name}.f64(double)"
    return text


def emitted(text: str) -> bytes:
    """Return LLVM's object file of a module for WebAssembly, optimised."""
    machine = machine_for(TRIPLE, "generic", FEATURES)
    return bytes(machine.emit_object(optimised(text, machine, TRIPLE, EXPORTS)))


def machine_for(triple: str, processor: str, features: str) -> Any:
    """Return LLVM's code generator."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple(triple).create_target_machine(
        cpu=processor, features=features, opt=3, reloc="static"
    )


def optimised(text: str, machine: Any, triple: str, exports: Collection[str]) -> Any:
    """Return a module in which all but what it exports may be inlined, and is optimised."""
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = triple, str(machine.target_data)
    for part in (*module.functions, *module.global_variables):
        if not part.is_declaration and part.name not in exports and "llvm." not in part.name:
            part.linkage = llvm.Linkage.internal
    options = llvm.create_pipeline_tuning_options(3)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return module


# --- The module of an object file: its exports instead of what linkers read ---


def exporting(data: bytes) -> bytes:
    """Return an object file as a module that exports ``EXPORTS``.

    The section "bridgegen" says of which kernels it is: see `portable.sources`.
    """
    parts = list(_sections(data))
    (symbols,) = (_functions(body) for kind, body in parts if kind == 0 and b"linking" in body[:9])
    exports = _leb(len(EXPORTS)) + b"".join(
        _leb(len(name)) + name.encode() + b"\0" + _leb(symbols[name]) for name in EXPORTS
    )
    found = bytearray(data[:8])
    for kind, body in parts:
        if kind in (9, 12, 10, 11) and exports:  # the sections that come after the exports
            found += b"\7" + _leb(len(exports)) + exports
            exports = b""
        if kind != 0:
            found += bytes([kind]) + _leb(len(body)) + body
    said = b"\x09bridgegen" + portable.sources().encode()
    return bytes(found) + b"\0" + _leb(len(said)) + said


def _sections(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 8
    while at < len(data):
        kind = data[at]
        size, start = _number(data, at + 1)
        yield kind, data[start : start + size]
        at = start + size


def _functions(body: bytes) -> dict[str, int]:
    """Return the number of each function that the section "linking" names."""
    size, at = _number(body, 0)
    _, at = _number(body, at + size)  # version
    found = {}
    while at < len(body):
        kind = body[at]
        size, at = _number(body, at + 1)
        end = at + size
        if kind == 8:  # the table of symbols
            count, at = _number(body, at)
            for _ in range(count):
                name, index, at = _symbol(body, at)
                if name:
                    found[name] = index
        at = end
    return found


def _symbol(body: bytes, at: int) -> tuple[str, int, int]:
    """Return name and number of a symbol, "" if it is no function; and where it ends."""
    what = body[at]
    flags, at = _number(body, at + 1)
    is_imported, is_named = bool(flags & 0x10), bool(flags & 0x40)
    if what == 3:  # a section
        return "", 0, _number(body, at)[1]
    if what == 1:  # data
        size, at = _number(body, at)
        at += size
        for _ in range(0 if is_imported else 3):
            _, at = _number(body, at)
        return "", 0, at
    index, at = _number(body, at)
    if is_imported and not is_named:
        return "", index, at
    size, at = _number(body, at)
    name = body[at : at + size].decode() if what == 0 else ""
    return name, index, at + size


def _number(data: bytes, at: int) -> tuple[int, int]:
    """Return a number in LEB128, and where it ends."""
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            return value, at


def _leb(value: int) -> bytes:
    found = bytearray()
    while value > 127:
        found.append((value & 127) | 128)
        value >>= 7
    return bytes([*found, value])


def main() -> None:
    """Write the module."""
    clock = time.time()
    link_late()
    if "cuda" in sys.argv[1:]:
        from portable_cuda import write

        write()
        return
    module = exporting(emitted(linked()))
    portable.MODULE.write_bytes(module)
    packed = len(gzip.compress(module))
    print(f"{portable.MODULE}: {len(module):,} B, {packed:,} packed, {time.time() - clock:.0f} s")


if __name__ == "__main__":
    main()
