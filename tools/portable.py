"""Link the kernels into one WebAssembly module, which simulates any row of any storyboard.

    .venv/bin/python tools/portable.py           # some minutes; writes src/bridgegen/pages/web/rollout.wasm

Numba types and lowers each kernel as always; its bitcode is linked before any optimisation for this
processor, and LLVM writes it for another one. Nothing is specialised to a storyboard: a bundle is a
table of where its arrays lie, and a kernel that is called by its address has one in the module's
table of functions, which `address` returns by its number.

LLVM's object file is a module whose relocations hold already, so no linker is needed.
"""

import os
import re
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

KERNELS = tempfile.mkdtemp(prefix="bridgegen-portable-")
os.environ["NUMBA_CACHE_DIR"] = KERNELS  # code that is not optimised must not reach the cache

from llvmlite import binding as llvm
from numba.core import codegen
from numba.core.runtime import rtsys

from bridgegen.base import compiled
from bridgegen.base.compilation.library import KernelLibrary
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import _rollout_kernels as rollout
from bridgegen.simulation.embedded.addresses import CALLED

EXPORTS = ("simulate", "address")

OUT = Path(__file__).parents[1] / "src" / "bridgegen" / "pages" / "web" / "rollout.wasm"
TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+bulk-memory,+bulk-memory-opt,+nontrapping-fptoint,+sign-ext,+mutable-globals"


def link_late() -> None:
    """Have Numba keep each kernel's bitcode as it lowers it, and link none into another."""
    KernelLibrary.is_large = property(lambda self: bool(self.symbol))
    KernelLibrary._optimize_final_module = lambda self: None
    codegen.CPUCodeLibrary._optimize_functions = _lay_out
    codegen.CPUCodeLibrary._optimize_final_module = lambda self: None
    add = codegen.CodeLibrary.add_linking_library
    codegen.CodeLibrary.add_linking_library = lambda self, library: (
        None if library is rtsys.library else add(self, library)
    )
    finalize = KernelLibrary.finalize

    def without_runtime(self: Any) -> None:
        self._linking_libraries = [x for x in self._linking_libraries if x is not rtsys.library]
        finalize(self)

    KernelLibrary.finalize = without_runtime


def _lay_out(self: Any, module: Any) -> None:
    module.data_layout = self._codegen._data_layout


def compile_all() -> tuple[str, list[str]]:
    """Return the symbols of the kernel of a row, and of those that are called by their address."""
    logical = load("crossroads-s4")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego="reference"))
    batch = pipeline.runner.nominal_batch()
    kinds = batch.kinds()
    entry = compiled.compile_for_kernels(rollout.simulate_row, kinds).fndesc.llvm_func_name
    called = []
    for kernel, first in CALLED.items():
        found = compiled.compile_for_kernels(kernel, (*first, *kinds))
        called.append(found.fndesc.llvm_func_name)
    return entry, called


def reachable(roots: Iterable[str]) -> set[str]:
    """Return the symbols of kernels, and of all that they call."""
    found: set[str] = set()
    left = list(roots)
    while left:
        if (symbol := left.pop()) not in found:
            found.add(symbol)
            left += KernelLibrary.by_symbol[symbol].callees
    return found


RUNTIME = """
declare i32 @"{entry}"(ptr, ptr, ptr, ptr, ptr, ptr)
{declared}
@heap = global i32 0
define internal void @NRT_incref(ptr %p) alwaysinline {{ ret void }}
define internal void @NRT_decref(ptr %p) alwaysinline {{ ret void }}
define internal ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) noinline {{
  %at = load i32, ptr @heap
  %p = inttoptr i32 %at to ptr
  %small = trunc i64 %size to i32
  %more = add i32 %small, 127
  %whole = and i32 %more, -64
  %next = add i32 %at, %whole
  store i32 %next, ptr @heap
  %d = getelementptr i8, ptr %p, i32 64
  store ptr %d, ptr %p
  ret ptr %p
}}
define internal ptr @NRT_MemInfo_alloc_safe_aligned(i64 %size, i32 %align) alwaysinline {{
  %p = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align)
  ret ptr %p
}}
define internal ptr @NRT_MemInfo_data_fast(ptr %p) alwaysinline {{
  %d = load ptr, ptr %p
  ret ptr %d
}}
define internal {{ i64, i1 }} @product(i64 %a, i64 %b) alwaysinline {{
  %p = mul i64 %a, %b
  %r = insertvalue {{ i64, i1 }} {{ i64 undef, i1 false }}, i64 %p, 0
  ret {{ i64, i1 }} %r
}}
define i32 @simulate(ptr %plan, ptr %roads, ptr %state, ptr %record, i32 %heap) {{
  %answer = alloca i64
  %error = alloca ptr
  store i32 %heap, ptr @heap
  %r = call i32 @"{entry}"(ptr %answer, ptr %error, ptr %plan, ptr %roads, ptr %state, ptr %record)
  ret i32 %r
}}
define i32 @address(i32 %code) {{
  switch i32 %code, label %none [ {cases} ]
none:
  ret i32 0
{blocks}
}}
"""


def linked(entry: str, called: list[str]) -> Any:
    """Return one module of all kernels, for no machine yet."""
    declared = "\n".join(f'@"{symbol}" = external global i8' for symbol in dict.fromkeys(called))
    cases = " ".join(f"i32 {code}, label %c{code}" for code in range(1, len(called) + 1))
    blocks = "\n".join(
        f'c{code}:\n  ret i32 ptrtoint (ptr @"{symbol}" to i32)'
        for code, symbol in enumerate(called, 1)
    )
    texts = []
    module = None
    for symbol in sorted(reachable([entry, *called])):
        part = llvm.parse_bitcode(KernelLibrary.by_symbol[symbol]._bitcode)
        if module is None:
            module = part
        else:
            module.link_in(part)
    text = str(module)
    text = re.sub(r'target (datalayout|triple) = "[^"]*"', "", text)
    text = re.sub(r'"target-(cpu|features)"="[^"]*"', "", text)
    text = re.sub(r"^declare [^@\n]*@llvm\.smul\.with\.overflow\.i64\(.*$", "", text, flags=re.M)
    text = text.replace("@llvm.smul.with.overflow.i64(", "@product(")
    text = re.sub(r"^declare [^@\n]*@NRT_\w+\(.*$", "", text, flags=re.M)
    text = re.sub(r"^define [^@\n]*@NRT_\w+\([^\n]*\{\n(.*\n)*?\}\n", "", text, flags=re.M)
    for plain in ("sqrt", "ceil", "floor", "fabs", "trunc", "rint"):
        text = re.sub(rf"@{plain}\(", f"@llvm.{plain}.f64(", text)
        text = re.sub(rf"^(declare [^@\n]*@llvm\.{plain}\.f64\(.*)$", "", text, flags=re.M)
        text += f"\ndeclare double @llvm.{plain}.f64(double)"
    runtime = RUNTIME.format(entry=entry, declared="", cases=cases, blocks=blocks)
    runtime = re.sub(r'^declare i32 @"_ZN.*$', "", runtime, flags=re.M)
    return text + runtime


def emitted(text: str) -> bytes:
    """Return WebAssembly's object file of a module, optimised."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(
        cpu="generic", features=FEATURES, opt=2, reloc="static"
    )
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = TRIPLE, str(machine.target_data)
    for function in module.functions:
        if not function.is_declaration and function.name not in EXPORTS:
            function.linkage = llvm.Linkage.internal
    for variable in module.global_variables:
        if not variable.is_declaration and not variable.name.startswith("llvm."):
            variable.linkage = llvm.Linkage.internal
    options = llvm.create_pipeline_tuning_options(2)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    declared = [function.name for function in module.functions if function.is_declaration]
    print("declared:", declared, [v.name for v in module.global_variables])
    return bytes(machine.emit_object(module))


def sections(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the number and the content of each section of a module."""
    at = 8
    while at < len(data):
        kind = data[at]
        size, start = number(data, at + 1)
        yield kind, data[start : start + size]
        at = start + size


def number(data: bytes, at: int) -> tuple[int, int]:
    """Return a number in LEB128, and where it ends."""
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            return value, at


def leb(value: int) -> bytes:
    """Return a number in LEB128."""
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    return bytes([*found, value])


def exporting(data: bytes) -> bytes:
    """Return an object file as a module that exports `EXPORTS`, without what linkers read."""
    parts = list(sections(data))
    (symbols,) = (functions(body) for kind, body in parts if kind == 0 and is_linking(body))
    exports = leb(len(EXPORTS)) + b"".join(
        leb(len(name)) + name.encode() + b"\0" + leb(symbols[name]) for name in EXPORTS
    )
    found = bytearray(data[:8])
    for kind, body in parts:
        if kind == 0:
            continue
        if kind in (9, 12, 10, 11) and exports:  # they come after the exports
            found += b"\7" + leb(len(exports)) + exports
            exports = b""
        found += bytes([kind]) + leb(len(body)) + body
    return bytes(found)


def is_linking(body: bytes) -> bool:
    size, at = number(body, 0)
    return body[at : at + size] == b"linking"


def functions(body: bytes) -> dict[str, int]:
    """Return the number of each function that the section "linking" names."""
    size, at = number(body, 0)
    at += size
    _, at = number(body, at)  # version
    found = {}
    while at < len(body):
        kind = body[at]
        size, at = number(body, at + 1)
        end = at + size
        if kind == 8:  # symbol table
            count, at = number(body, at)
            for _ in range(count):
                what = body[at]
                flags, at = number(body, at + 1)
                if what == 3:  # section
                    _, at = number(body, at)
                    continue
                if what == 1:  # data
                    size, at = number(body, at)
                    at += size
                    if not flags & 0x10:
                        for _ in range(3):
                            _, at = number(body, at)
                    continue
                index, at = number(body, at)
                if not flags & 0x10 or flags & 0x40:
                    size, at = number(body, at)
                    if what == 0:
                        found[body[at : at + size].decode()] = index
                    at += size
        at = end
    return found


if __name__ == "__main__":
    clock = time.time()
    if len(sys.argv) < 2:
        link_late()
        entry, called = compile_all()
        print(
            f"{len(reachable([entry, *called]))} kernels, {time.time() - clock:.0f} s", flush=True
        )
        text = linked(entry, called)
        Path("/tmp/pw/all.ll").write_text(text)
    text = Path("/tmp/pw/all.ll").read_text()
    data = emitted(text)
    Path("/tmp/pw/all.o").write_bytes(data)
    print(f"{len(data):,} B, {time.time() - clock:.0f} s", flush=True)
    module = exporting(data)
    Path("/tmp/pw/all.wasm").write_bytes(module)
    import gzip

    print(
        f"{len(module):,} B, packed {len(gzip.compress(module)):,} B, {time.time() - clock:.0f} s"
    )
