"""The decorators for compiled code, and intrinsics that Numba lacks."""

import ctypes
import gc
import hashlib
import struct
from collections.abc import Callable, Sequence
from typing import Any, cast

import numba
import numba.extending
import numpy as np
from llvmlite import ir
from numba.core import cgutils, event
from numba.core.imputils import lower_getattr_generic
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import AttributeTemplate, infer_getattr

from bridgegen.base.compilation.cache import KernelCache
from bridgegen.base.compilation.library import KernelCompiler, for_kernel, is_for_kernel


class _RelaxGarbageCollection(event.Listener):  # type: ignore[misc]
    """Collects garbage less often during a compilation, which keeps its millions of objects."""

    depth, usual = 0, (0, 0, 0)

    def on_start(self, _: Any) -> None:
        if self.depth == 0:
            self.usual = gc.get_threshold()
            # A cold compilation of all kernels takes 46 s of one core instead of 55 s, with 30 MB
            # more memory. With the collector off it takes 48 s and 600 MB more.
            gc.set_threshold(50_000, 20, 50)
        self.depth += 1

    def on_end(self, _: Any) -> None:
        self.depth -= 1
        if self.depth == 0:
            gc.set_threshold(*self.usual)


event.register("numba:compile", _RelaxGarbageCollection())  # always under Numba's own lock


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of arrays and numbers on its first call; it then runs without the GIL.

    A kernel never raises, does not check its arguments (its wrapper does), divides by zero as
    IEEE 754 says, and is not reordered (no fastmath), so its result is the same in any batch.
    """
    compiled = _compile(function)
    if not numba.config.DISABLE_JIT:
        _compile_by_ourselves(compiled)
    return cast(Callable[..., Any], compiled)


def inlined_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a part of a kernel: as ``kernel`` does, but into each kernel that calls it.

    For what runs at every instant, where a call is felt.
    """
    # By LLVM. Numba would inline before it infers types, which gives as fast a rollout, but copied
    # functions' code 480 times: 9 s of the 86 s of a cold compilation.
    compiled = _compile(function, forceinline=True)
    if not numba.config.DISABLE_JIT:
        _compile_by_ourselves(compiled)
    return cast(Callable[..., Any], compiled)


def _compile_by_ourselves(compiled: Any) -> None:
    """Have a kernel's code cached, and callable from Python only where Python calls it."""
    compiled._cache = KernelCache(compiled.py_func)
    compile_or_load, add = compiled.compile, compiled.add_overload

    def compile_alone(signature: Any) -> Any:
        with compiled._cache.compiling():
            known = compiled.overloads.get(normalize_signature(signature)[0])
            # Code that was compiled for other kernels has no wrapper for Python, so a first call
            # from Python compiles the same signature again.
            if known and known.library.inner and not is_for_kernel():
                del compiled.overloads[known.signature.args]  # Python needs a wrapper
            return compile_or_load(signature)

    def add_overload(result: Any) -> None:
        # Numba's own method registers the wrapper's address with the dispatcher; inner code has
        # none.
        if result.library.inner:
            compiled.overloads[result.signature.args] = result
        else:
            add(result)

    compiled.compile, compiled.add_overload = compile_alone, add_overload


def _compile(function: Callable[..., Any], **options: Any) -> Any:
    # Numba's error model for Python tests each divisor and raises; a kernel must not raise. No C
    # wrapper is needed: `call_kernel_at` calls kernels by Numba's own convention.
    options |= {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    options["pipeline_class"] = KernelCompiler
    compiled: Any = numba.njit(**options)(function)
    if not numba.config.DISABLE_JIT:
        resolve = compiled.get_call_template

        def resolve_alike(given: Any, named: Any) -> Any:
            """Compile a function once for any number, not once more for every constant given."""
            # 47 of 234 compilations were of a kernel for one more constant.
            plain = numba.types.unliteral
            with for_kernel():
                return resolve([plain(a) for a in given], {k: plain(a) for k, a in named.items()})

        compiled.get_call_template = resolve_alike
    return compiled


# With a hundred arrays in a tuple a cold compilation took 108 s of one core; with bundles, and more
# code, 55 s.
class Bundle(numba.types.Type):  # type: ignore[misc]
    """In a kernel: where a named tuple of arrays is described; its arrays are read as attributes.

    A tuple itself would be copied whole wherever one of its arrays is read, and passed array by
    array wherever a kernel calls another: a hundred arrays take the compiler minutes.
    """

    def __init__(self, held: Any) -> None:
        self.held = held
        digest = hashlib.sha256(str(held).encode()).hexdigest()[:12]  # a symbol names all its types
        super().__init__(name=f"Bundle({held.instance_class.__name__}-{digest})")


@numba.extending.register_model(Bundle)
class _BundleModel(numba.extending.models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, cgutils.voidptr_t)


@infer_getattr
class _BundleAttributes(AttributeTemplate):  # type: ignore[misc]
    key = Bundle

    def generic_resolve(self, bundle: Bundle, name: str) -> Any:
        fields = bundle.held.instance_class._fields
        return bundle.held.types[fields.index(name)] if name in fields else None


@lower_getattr_generic(Bundle)  # type: ignore[untyped-decorator]
def _read(context: Any, builder: Any, bundle: Bundle, value: Any, name: str) -> Any:
    held = bundle.held
    i = held.instance_class._fields.index(name)
    place = builder.bitcast(value, context.get_value_type(held).as_pointer())
    at = cgutils.gep_inbounds(builder, place, 0, i)
    if not isinstance(held.types[i], numba.types.Array):
        return builder.load(at)
    there = context.make_array(held.types[i])(context, builder, ref=at)
    view = context.make_array(held.types[i])(context, builder)
    # Without an owner Numba counts no references. It counts atomically, some 20 ns for each array
    # argument and view: without, perception of one body takes 66 µs a row instead of 120.
    view.meminfo, view.parent = view.meminfo.type(None), view.parent.type(None)
    for part in ("nitems", "itemsize", "data", "shape", "strides"):
        setattr(view, part, getattr(there, part))
    return view._getvalue()


def _bundled(_: Any, value: Any) -> Any:
    """In a kernel: a bundle of a named tuple's arrays, borrowed; their owners must outlive it."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = cgutils.alloca_once(builder, arguments[0].type)
        for i, member in enumerate(value.types):
            at = cgutils.gep_inbounds(builder, place, 0, i)
            part = builder.extract_value(arguments[0], i)
            if not isinstance(member, numba.types.Array):
                builder.store(part, at)
                continue
            here = context.make_array(member)(context, builder, part)
            there = context.make_array(member)(context, builder, ref=at)
            for name in ("nitems", "itemsize", "data", "shape", "strides"):
                setattr(there, name, getattr(here, name))
        return builder.bitcast(place, cgutils.voidptr_t)

    return Bundle(value)(value), generate


# One intrinsic, for the same array by array in Python was 6 s of a cold compilation.
def _bundled_row(_: Any, rows: Any, i: Any) -> Any:
    """In a kernel: a bundle of row i of a named tuple of N rows' arrays; see `bundled`.

    Numbers in the tuple are all rows'.
    """
    row = _row_tuple(rows.types, rows.instance_class, 1)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = cgutils.alloca_once(builder, context.get_value_type(row))
        for at, member in enumerate(rows.types):
            part = builder.extract_value(arguments[0], at)
            slot = cgutils.gep_inbounds(builder, place, 0, at)
            if not isinstance(member, numba.types.Array):
                builder.store(part, slot)
                continue
            here = context.make_array(member)(context, builder, part)
            there = context.make_array(row.types[at])(context, builder, ref=slot)
            shape = cgutils.unpack_tuple(builder, here.shape)
            strides = cgutils.unpack_tuple(builder, here.strides)
            count = context.get_constant(numba.types.intp, 1)
            for size in shape[1:]:
                count = builder.mul(count, size)
            start = builder.bitcast(here.data, cgutils.voidptr_t)
            start = builder.gep(start, [builder.mul(arguments[1], strides[0])])
            there.data = builder.bitcast(start, here.data.type)
            there.nitems, there.itemsize = count, here.itemsize
            there.shape = cgutils.pack_array(builder, shape[1:])
            there.strides = cgutils.pack_array(builder, strides[1:])
        return builder.bitcast(place, cgutils.voidptr_t)

    return Bundle(row)(rows, numba.types.intp), generate


def _called_at(_: Any, address: Any, arrays: Any) -> Any:
    """In a kernel: call the machine code at an address with where each array lies, and how long.

    Its signature in C is ``void f(void *, intptr_t, …)``, a pair for each array, which must be
    contiguous.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values = []
        for i, member in enumerate(arrays):
            part = builder.extract_value(arguments[1], i)
            view = context.make_array(member)(context, builder, part)
            values += [
                builder.bitcast(view.data, cgutils.voidptr_t),
                builder.extract_value(view.shape, 0),
            ]
        code = ir.FunctionType(ir.VoidType(), [value.type for value in values])
        builder.call(builder.inttoptr(arguments[0], code.as_pointer()), values)
        return context.get_dummy_value()

    return numba.types.void(address, arrays), generate


def _cast(to: Any) -> Callable[..., Any]:
    """Return an intrinsic that reads the bits of a number as those of one of another type."""

    def cast(_: Any, number: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], context.get_value_type(to))

        return to(numba.types.float64 if to == numba.types.int64 else numba.types.int64), generate

    return cast


DEMAND = numba.types.UniTuple(numba.types.float64, 2)
"""Return type of a kernel that is called by its address: two numbers."""


def _calls_kernel(returns: Any) -> Callable[..., Any]:
    """Return an intrinsic that calls a kernel by its address, see ``address_of``.

    So that what calls it is compiled without it, and it only where it is called.
    """

    def call(_: Any, address: Any, arguments: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            kinds, convention = signature.args[1].types, context.call_conv
            values = [builder.extract_value(given[1], i) for i in range(len(kinds))]
            code = convention.get_function_type(returns, kinds)
            answer = cgutils.alloca_once(builder, convention.get_return_type(returns).pointee)
            error = cgutils.alloca_once_value(builder, ir.Constant(code.args[1].pointee, None))
            packed = context.get_arg_packer(kinds).as_arguments(builder, values)
            callee = builder.inttoptr(given[0], code.as_pointer())
            builder.call(callee, [answer, error, *packed])
            if returns == numba.types.none:
                return context.get_dummy_value()
            return context.get_returned_value(builder, returns, builder.load(answer))

        return returns(address, arguments), generate

    return call


def merged(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return what calls a kernel of one float64 that returns two; of equal calls, LLVM keeps one.

    A kernel writes its result to memory, so that LLVM cannot tell that a second call is in vain.
    """
    if numba.config.DISABLE_JIT:
        return function
    number = numba.types.float64

    def call(_: Any, x: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            found = compile_for_kernels(function, (number,))
            context.active_code_library.add_linking_library(found.library)
            kind = context.get_value_type(DEMAND)
            wrapper = cgutils.get_or_insert_function(
                builder.module,
                ir.FunctionType(kind, [given[0].type]),
                f"merged.{found.fndesc.llvm_func_name}",
            )
            if wrapper.is_declaration:
                wrapper.linkage = "linkonce_odr"
                # Only a call carries the promise "no side effects". Once inlined, the stores to the
                # result would hide from LLVM that a second call with the same angle is in vain.
                # Without this, whole evaluations take 1.03 to 1.23 times as long.
                for attribute in ("noinline", "nounwind", "readnone"):
                    wrapper.attributes.add(attribute)
                inside = ir.IRBuilder(wrapper.append_basic_block())
                _, answer = context.call_conv.call_function(
                    inside,
                    cgutils.get_or_insert_function(
                        builder.module,
                        context.call_conv.get_function_type(DEMAND, (number,)),
                        found.fndesc.llvm_func_name,
                    ),
                    DEMAND,
                    (number,),
                    wrapper.args,
                )
                inside.ret(answer)
            return builder.call(wrapper, given)

        return DEMAND(number), generate

    intrinsic: Callable[..., Any] = numba.extending.intrinsic(call)
    return intrinsic


def compile_for_kernels(function: Callable[..., Any], kinds: tuple[Any, ...]) -> Any:
    """Compile a kernel for other kernels to call, if need be; return its code.

    Args:
        function: a ``kernel``.
        kinds: Numba's types of its arguments; see ``row_type`` for those of bundles.
    """
    compiled: Any = function
    with for_kernel():
        compiled.compile(kinds)
    return compiled.overloads[kinds]


def address_of(function: Callable[..., Any], kinds: tuple[Any, ...]) -> int:
    """Compile a kernel for arguments of some types, if need be; return where its code lies.

    Args:
        function: a ``kernel``; `call_kernel_at` calls one that returns two float64, and
            `run_kernel_at` one that returns nothing.
        kinds: Numba's types of its arguments; see ``row_type`` for those of bundles.
    """
    if numba.config.DISABLE_JIT:
        if function not in _INTERPRETED:
            _INTERPRETED.append(function)
        return 1 + _INTERPRETED.index(function)
    key = (function, *map(id, kinds))  # to hash the types of a hundred arrays takes a millisecond
    if key in _ADDRESSES:
        return _ADDRESSES[key][0]
    compiled: Any = function
    with compiled._cache.compiling():
        found = compile_for_kernels(function, kinds)
        address: int = found.library.get_pointer_to_function(found.fndesc.llvm_func_name)
    _ADDRESSES[key] = address, kinds
    return address


_ADDRESSES: dict[tuple[Any, ...], tuple[int, tuple[Any, ...]]] = {}
"""Addresses of kernels in this process, with the types, which must live as long as their ids
count."""


def row_type(rows: Any, axes: int = 1) -> Any:
    """Return the type of the bundle of one row of a named tuple of arrays.

    Args:
        rows: its arrays, of N rows, and numbers of less than 64 bits.
        axes: how many first axes a row has not.

    Returns:
        The same object for rows of the same types.
    """
    if numba.config.DISABLE_JIT:
        return None
    # Deriving the types of 180 arrays twice, and the sizes of a state, took 6 of the 25 ms of a
    # batch of 128 rows, under the GIL: so each look of the arrays is derived once.
    key = (type(rows), axes, *map(_look_of, rows))
    if key not in _ROW_TYPES:
        _ROW_TYPES[key] = Bundle(_row_tuple([numba.typeof(row) for row in rows], type(rows), axes))
    return _ROW_TYPES[key]


_ROW_TYPES: dict[tuple[Any, ...], Bundle] = {}


def _look_of(value: Any) -> Any:
    """Return all that Numba's type of an array or a number depends on."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num
    return type(value)


def _row_tuple(kinds: Sequence[Any], named: type, axes: int) -> Any:
    arrays = numba.types.Array
    row = (kind.copy(ndim=kind.ndim - axes) if isinstance(kind, arrays) else kind for kind in kinds)
    return numba.types.NamedTuple(tuple(row), named)


_INTERPRETED: list[Callable[..., Any]] = []
"""The functions that have addresses where Numba does not compile, the first at 1."""


def _interpreted_at(address: int, arguments: tuple[Any, ...]) -> Any:
    return _INTERPRETED[address - 1](*arguments)


def _itself(value: Any) -> Any:
    return value


def _row(rows: Any, i: int) -> Any:
    return type(rows)(*(row[i] if isinstance(row, np.ndarray) else row for row in rows))


def _bits_of(number: float) -> int:
    return int.from_bytes(struct.pack(">d", number), signed=True)


def _float_of(bits: int) -> float:
    (number,) = struct.unpack(">d", bits.to_bytes(8, signed=True))
    return float(number)


def call_from_python(address: int, arrays: tuple[np.ndarray, ...]) -> None:
    """Do in Python what ``call_at`` does in a kernel."""
    kinds = [ctypes.c_void_p, ctypes.c_ssize_t] * len(arrays)
    given = (number for array in arrays for number in (array.ctypes.data, len(array)))
    ctypes.CFUNCTYPE(None, *kinds)(address)(*given)


if numba.config.DISABLE_JIT:
    bundled, bundled_row = _itself, _row
    call_at, call_kernel_at, run_kernel_at = call_from_python, _interpreted_at, _interpreted_at
    bits_of, float_of = _bits_of, _float_of
else:
    bundled, bundled_row, call_at, call_kernel_at, run_kernel_at, bits_of, float_of = map(
        numba.extending.intrinsic,
        (
            _bundled,
            _bundled_row,
            _called_at,
            _calls_kernel(DEMAND),
            _calls_kernel(numba.types.none),
            _cast(numba.types.int64),
            _cast(numba.types.float64),
        ),
    )
