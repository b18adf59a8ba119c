"""The module of all kernels for NVIDIA's GPUs: see `portable`."""

import gzip
import re
import time
from collections.abc import Mapping
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from portable import kinds, machine_for, module_of, optimised, symbol_of

from bridgegen.base.compiled import Bundle, _BundleModel, row_type
from bridgegen.engine import _device_kernels as kernels
from bridgegen.simulation.embedded import device, portable
from bridgegen.simulation.embedded.addresses import CALLED
from bridgegen.simulation.embedded.drivers import ask

TRIPLE = "nvptx64-nvidia-cuda"
PROCESSOR, FEATURES = "sm_75", "+ptx63"
"""The oldest processors that it runs on (Turing, 2018); the driver compiles it for the one there
is."""

CONSTANT = 4
"""LLVM's address space of constant memory."""

ENTRY = """
@job = addrspace(4) externally_initialized global [{job} x i64] zeroinitializer
{tables}

declare i32 @llvm.nvvm.read.ptx.sreg.tid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.nctaid.x()
declare void @llvm.nvvm.exit()

define internal void @NRT_incref(ptr %p) alwaysinline {{ ret void }}
define internal void @NRT_decref(ptr %p) alwaysinline {{ ret void }}

define internal i64 @thread() alwaysinline {{
  %t = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
  %b = call i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
  %d = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %first = mul i32 %b, %d
  %me = add i32 %first, %t
  %wide = zext i32 %me to i64
  ret i64 %wide
}}

define internal i64 @word(i64 %which) alwaysinline {{
  %at = getelementptr i64, ptr addrspace(4) @job, i64 %which
  %value = load i64, ptr addrspace(4) %at
  ret i64 %value
}}

define internal ptr addrspace(1) @heap() alwaysinline {{
  %me = call i64 @thread()
  %each = call i64 @word(i64 {HEAP_BYTES})
  %base = call i64 @word(i64 {HEAP})
  %off = mul i64 %me, %each
  %at = add i64 %base, %off
  %p = inttoptr i64 %at to ptr addrspace(1)
  ret ptr addrspace(1) %p
}}

define internal ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) noinline {{
  %mine = call ptr addrspace(1) @heap()
  %each = call i64 @word(i64 {HEAP_BYTES})
  %used = load i64, ptr addrspace(1) %mine
  %more = add i64 %size, 15
  %whole = and i64 %more, -16
  %next = add i64 %used, %whole
  %sane = icmp ule i64 %size, %each
  %there = icmp ule i64 %next, %each
  %fits = and i1 %sane, %there
  br i1 %fits, label %ok, label %short
short:
  call void @llvm.nvvm.exit()
  unreachable
ok:
  store i64 %next, ptr addrspace(1) %mine
  %p = getelementptr i8, ptr addrspace(1) %mine, i64 %used
  %q = addrspacecast ptr addrspace(1) %p to ptr
  ret ptr %q
}}

define internal ptr @NRT_MemInfo_alloc_safe_aligned(i64 %size, i32 %align) alwaysinline {{
  %p = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align)
  ret ptr %p
}}

define internal ptr @NRT_MemInfo_data_fast(ptr %p) alwaysinline {{
  ret ptr %p
}}

define internal {{ i64, i1 }} @product(i64 %a, i64 %b) alwaysinline {{
  %p = mul i64 %a, %b
  %r = insertvalue {{ i64, i1 }} {{ i64 undef, i1 false }}, i64 %p, 0
  ret {{ i64, i1 }} %r
}}

define internal double @rest(double %x, double %y) noinline {{
  %r0 = call double @llvm.fabs.f64(double %x)
  %d = call double @llvm.fabs.f64(double %y)
  %finite = fcmp olt double %r0, 0x7FF0000000000000
  %divides = fcmp ogt double %d, 0.0
  %sane = and i1 %finite, %divides
  %db = bitcast double %d to i64
  %de = and i64 %db, 9218868437227405312
  br i1 %sane, label %test, label %none
none:
  ret double 0x7FF8000000000000
test:
  %r = phi double [ %r0, %0 ], [ %left, %step ]
  %go = fcmp oge double %r, %d
  br i1 %go, label %step, label %done
step:
  %rb = bitcast double %r to i64
  %re = and i64 %rb, 9218868437227405312
  %up = sub i64 %re, %de
  %tb = add i64 %db, %up
  %t = bitcast i64 %tb to double
  %over = fcmp ogt double %t, %r
  %half = fmul double %t, 5.0e-1
  %take = select i1 %over, double %half, double %t
  %left = fsub double %r, %take
  br label %test
done:
  %signed = call double @llvm.copysign.f64(double %r, double %x)
  ret double %signed
}}

{calls}

define internal ptr @place(i64 %base, i64 %tile, i64 %lanes, i64 %i) alwaysinline {{
  %t = udiv i64 %i, %lanes
  %l = urem i64 %i, %lanes
  %to = mul i64 %t, %tile
  %lo = mul i64 %l, 8
  %a = add i64 %base, %to
  %b = add i64 %a, %lo
  %p = inttoptr i64 %b to ptr
  ret ptr %p
}}

define ptx_kernel void @rows() {{
  %answer = alloca i64
  %error = alloca ptr
  %me = call i64 @thread()
  %d = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %g = call i32 @llvm.nvvm.read.ptx.sreg.nctaid.x()
  %all = mul i32 %d, %g
  %step = zext i32 %all to i64
  %n = call i64 @word(i64 {ROWS})
  %asked = call i64 @word(i64 {ASKED})
  %mine = call ptr addrspace(1) @heap()
  %lanes = call i64 @word(i64 {LANES})
{words}
  %plan.p = inttoptr i64 %plan to ptr
  %state.p = call ptr @place(i64 %state, i64 %state_bytes, i64 %lanes, i64 %me)
  %verdict.p = call ptr @place(i64 %verdict, i64 %verdict_bytes, i64 %lanes, i64 %me)
  %template = call i64 @word(i64 {TEMPLATE})
  %template.p = inttoptr i64 %template to ptr
  %stride = mul i64 %lanes, 8
  %record_lanes = call i64 @word(i64 {RECORD_LANES})
  %keeps = icmp eq i64 %record_lanes, 1
  %state_words = sdiv i64 %state_bytes, %stride
  br label %loop
loop:
  %i = phi i64 [ %me, %0 ], [ %next, %ran ]
  %go = icmp slt i64 %i, %n
  br i1 %go, label %begin, label %done
begin:
  store i64 16, ptr addrspace(1) %mine
  %networks.p = inttoptr i64 %networks to ptr
  %net.p = getelementptr i64, ptr %networks.p, i64 %i
  %net = load i64, ptr %net.p
  %roads.p = call ptr @place(i64 %roads, i64 %roads_bytes, i64 1, i64 %net)
  %facts.p = call ptr @place(i64 %facts, i64 %facts_bytes, i64 1, i64 %net)
  %measuring.p = call ptr @place(i64 %measuring, i64 %measuring_bytes, i64 1, i64 %net)
  %given.p = call ptr @place(i64 %given, i64 %given_bytes, i64 1, i64 %i)
  %found.p = call ptr @place(i64 %found, i64 %found_bytes, i64 1, i64 %i)
  %slot = select i1 %keeps, i64 %i, i64 %me
  %record.p = call ptr @place(i64 %record, i64 %record_bytes, i64 %record_lanes, i64 %slot)
  br label %copy
copy:
  %w = phi i64 [ 0, %begin ], [ %w1, %copied ]
  %more = icmp slt i64 %w, %state_words
  br i1 %more, label %copied, label %run
copied:
  %from = getelementptr i64, ptr %template.p, i64 %w
  %value = load i64, ptr %from
  %off = mul i64 %w, %stride
  %to = getelementptr i8, ptr %state.p, i64 %off
  store i64 %value, ptr %to
  %w1 = add i64 %w, 1
  br label %copy
run:
  call i32 @"{run}"(ptr %answer, ptr %error, i64 %asked, ptr %plan.p, ptr %roads.p, ptr %state.p,
    ptr %record.p, ptr %facts.p, ptr %measuring.p, ptr %verdict.p, ptr %given.p, ptr %found.p)
  br label %ran
ran:
  %next = add i64 %i, %step
  br label %loop
done:
  ret void
}}
"""
"""What the module has besides kernels, in LLVM's IR.

``NRT_MemInfo_alloc_aligned`` gives a thread memory of its own; one that needs more than there is
ends, and its row has no result. ``rest`` is the rest of a division, exact as the processor's; that
of NVPTX is not.
"""


class FarBundle(Bundle):
    """A bundle that is where a row's memory begins; the module's tables say what lies where."""

    def __init__(self, near: Bundle, layout: str, title: str) -> None:
        held = near.held
        given = (
            kind.copy(layout=layout, readonly=False) if isinstance(kind, types.Array) else kind
            for kind in held.types
        )
        super().__init__(types.NamedTuple(tuple(given), held.instance_class))
        self.title = title


numba.extending.register_model(FarBundle)(_BundleModel)


@lower_getattr_generic(FarBundle)  # type: ignore[untyped-decorator]
def _read(context: Any, builder: Any, bundle: FarBundle, value: Any, name: str) -> Any:
    held = bundle.held
    fields = held.instance_class._fields
    i = fields.index(name)
    word = sum(map(_words, held.types[:i]))
    table = _table(builder.module, bundle)
    number, kind = ir.IntType(64), held.types[i]

    def load(at: int) -> Any:
        return builder.load(builder.gep(table, [ir.Constant(number, 0), ir.Constant(number, at)]))

    if not isinstance(kind, types.Array):
        return builder.bitcast(load(word), context.get_value_type(kind))
    view = context.make_array(kind)(context, builder)
    view.meminfo, view.parent = view.meminfo.type(None), view.parent.type(None)
    # Of device memory, so that what inlines this need not ask which memory it is.
    far = builder.addrspacecast(value, ir.PointerType(ir.IntType(8), 1))
    there = builder.gep(far, [load(word)])
    data = builder.addrspacecast(there, ir.PointerType(ir.IntType(8)))
    view.data = builder.bitcast(data, view.data.type)
    size = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    view.nitems, view.itemsize = load(word + 1), ir.Constant(number, size)
    at, d = word + 2, kind.ndim
    view.shape = cgutils.pack_array(builder, [load(at + k) for k in range(d)], ty=number)
    view.strides = cgutils.pack_array(builder, [load(at + d + k) for k in range(d)], ty=number)
    return view._getvalue()


def _words(kind: Any) -> int:
    return 2 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


def _table(module: Any, bundle: FarBundle) -> Any:
    name = f"table_{bundle.title}"
    if name in module.globals:
        return module.globals[name]
    size = sum(map(_words, bundle.held.types))
    found = ir.GlobalVariable(module, ir.ArrayType(ir.IntType(64), size), name, CONSTANT)
    found.linkage = "external"
    return found


def linked() -> str:
    """Return all kernels as one module in LLVM's IR, with the entry for a GPU."""
    e = np.zeros((1, 1))
    own = {"given": device.Given(e, e, e, e.astype(np.uint64)), "found": device.found_of(1, 1)}
    near = kinds()._asdict() | {name: row_type(bundle) for name, bundle in own.items()}
    far = {
        name: FarBundle(kind, "A" if name in device.INTERLEAVED else "C", name)
        for name, kind in near.items()
    }
    rows = tuple(far.values())
    run = symbol_of(kernels.run_row, (types.int64, *rows))
    called = {
        code: symbol_of(kernel, (*first, *rows[:4]))
        for code, (kernel, first) in enumerate(CALLED.items(), 1)
        if kernel is not ask  # which calls a user's code by its address
    }
    tables = {name: sum(map(_words, bundle.held.types)) for name, bundle in far.items()}
    return with_entry(module_of([run, *called.values()]), run, called, tables)


def with_entry(text: str, run: str, called: Mapping[int, str], tables: Mapping[str, int]) -> str:
    """Return a module with the entry, in which kernels are called by a switch.

    Args:
        text: the module.
        run: the symbol of ``run_row``.
        called: symbols of the kernels that are called by their number.
        tables: the words of each bundle's table.
    """
    text = re.sub(r"^@table_.*$", "", text, flags=re.MULTILINE)
    text, calls = _switched(text, called)
    text = re.sub(r"frem double (.*), (\S+)", r"call double @rest(double \1, double \2)", text)
    if "declare double @llvm.copysign.f64" not in text:
        text += "\ndeclare double @llvm.copysign.f64(double, double)"
    places = {name: at for at, name in enumerate(device.JOB)}
    loaded = (f"  %{name} = call i64 @word(i64 {at})" for name, at in places.items())
    known = (
        f"@table_{name} = addrspace({CONSTANT}) externally_initialized global [{size} x i64] "
        "zeroinitializer"
        for name, size in tables.items()
    )
    return text + ENTRY.format(
        job=len(places),
        tables="\n".join(known),
        calls=calls,
        words="\n".join(line for name, line in zip(places, loaded, strict=True) if name.islower()),
        run=run,
        **{name: at for name, at in places.items() if name.isupper()},
    )


def _switched(text: str, called: Mapping[int, str]) -> tuple[str, str]:
    """Return a module that calls kernels by their number, and the functions that do so."""
    # The first word of each parameter; attributes may follow, and have parentheses.
    kinds_of = {
        symbol: ", ".join(re.findall(r"(?:^|, )(\w+) ", found.group(1)))
        for symbol in called.values()
        if (found := re.search(rf"^define [^\n]*@{symbol}\(([^\n]*)\) .*{{$", text, re.MULTILINE))
    }
    made: dict[str, str] = {}

    def replaced(found: re.Match[str]) -> str:
        result, code, given = found.groups()
        here = ", ".join(part.split()[0] for part in given.split(","))
        name = made.setdefault(here, f"call.{len(made)}")
        return f"{result}call i32 @{name}(ptr {code}, {given})"

    pattern = r"^(\s+%\S+ = )call i32 (%[^\s(]+)\((.*)\)"
    text = re.sub(pattern, replaced, text, flags=re.MULTILINE)
    functions = []
    for here, name in made.items():
        given = ", ".join(f"{kind} %a{i}" for i, kind in enumerate(here.split(", ")))
        fitting = [code for code, symbol in called.items() if kinds_of[symbol] == here]
        blocks = "\n".join(
            f"c{code}:\n  %r{code} = call i32 @{called[code]}({given})\n  ret i32 %r{code}"
            for code in fitting
        )
        cases = " ".join(f"i64 {code}, label %c{code}" for code in fitting)
        functions.append(
            f"define internal i32 @{name}(ptr %code, {given}) {{\n"
            "  %number = ptrtoint ptr %code to i64\n"
            f"  switch i64 %number, label %none [ {cases} ]\nnone:\n  ret i32 0\n{blocks}\n}}"
        )
    return text, "\n".join(functions)


def emitted(text: str) -> str:
    """Return a module as PTX; its first line says of which kernels it is."""
    machine = machine_for(TRIPLE, PROCESSOR, FEATURES)
    # Said first: numbers of 8 bytes then lie as they do on the device.
    text = f'target datalayout = "{machine.target_data}"\n{text}'
    exports = {"rows", "job", *re.findall(r"^@(table_\w+) =", text, re.MULTILINE)}
    ptx = machine.emit_assembly(optimised(text, machine, TRIPLE, exports))
    return f"// bridgegen {portable.device_sources()}\n{ptx}"


def write() -> None:
    """Write the module."""
    clock = time.time()
    ptx = emitted(linked())
    device.PATH.write_bytes(packed := gzip.compress(ptx.encode(), 9, mtime=0))
    print(f"{device.PATH}: {len(ptx):,} B, {len(packed):,} packed, {time.time() - clock:.0f} s")
