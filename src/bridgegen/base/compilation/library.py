"""The code of kernels: each kernel is optimised once, and has machine code once.

Numba links all that a function calls into it and optimises the whole again, so that what lies deep
is optimised as often as there are functions above it. Here a kernel that is large is called where
it lies, as a symbol of its own; only small ones are linked, to be inlined. Machine code is
generated where Python calls in, for the kernel and all that it calls.

The code of a kernel of this package lies in the cache by its symbol, which is the same in every
process: `CodeStore`. It lies there as it was lowered, too, for `whole_program`.
"""

import hashlib
import pickle
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Any, ClassVar, Self

from llvmlite import binding as llvm
from numba.core import compiler, typed_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_machinery import AnalysisPass, register_pass

from bridgegen.base.compilation.folder import digest, shipped
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError

# Measured against Numba's way, which inlines all: with 6 kB rollouts take 7 to 18 % longer, with 15
# kB 2 to 3 %. With 12 kB, and what runs at every instant inlined, they take 0.87 to 0.99 of the
# time.
LARGE = 12_000
"""Size of bitcode from which on a kernel is called rather than linked [bytes]."""

WRAPPER = "_ZN7cpython"
"""Prefix of the name of the function by which Python calls a kernel."""


class CodeStore:
    """Bitcode and machine code of kernels in a folder, by symbol; else in the wheel's.

    Args:
        folder: of the cache; only its owner can write to it.
        machine: for which the code is: triple, processor, features.
    """

    def __init__(self, folder: Path, machine: tuple[str, ...]) -> None:
        self._folder, self._machine = folder, machine

    def read(self, symbol: str, kind: str) -> Any:
        """Return what is stored, or None."""
        paths = [self._path(symbol, kind)]
        if carried := shipped():
            paths.append(_path(carried.folder, carried.machine, symbol, kind))
        for path in paths:
            with suppress(OSError, pickle.UnpicklingError, EOFError):
                # Unpickling runs code; `cache_folder` returns only folders in which nobody else can
                # write.
                return pickle.loads(path.read_bytes())
        return None

    def write(self, symbol: str, kind: str, content: Any) -> None:
        """Store something, if it can be written."""
        path = self._path(symbol, kind)
        with suppress(OSError, StorageError):
            path.parent.mkdir(exist_ok=True, parents=True)
            write_whole(path, [pickle.dumps(content)])

    def _path(self, symbol: str, kind: str) -> Path:
        return _path(self._folder, self._machine, symbol, kind)


def _path(folder: Path, machine: tuple[str, ...], symbol: str, kind: str) -> Path:
    digest = hashlib.sha256(" ".join((symbol, *machine)).encode()).hexdigest()[:24]
    return folder / "code" / f"{digest}.{kind}"


class MissingCodeError(Exception):
    """The code of a kernel that another one calls is not in the cache."""


class KernelLibrary(JITCodeLibrary):  # type: ignore[misc]
    """The code of a kernel.

    Attributes:
        inner: whether only kernels call it, not Python.
        is_inlined: whether it is linked and inlined however large it is.
        symbol: of the kernel, where it is in the store; else "".
        callees: symbols of the kernels that it calls, those of linked kernels among them.
    """

    _linking_libraries: list[Any]
    _final_module: Any

    store: ClassVar[CodeStore]
    by_symbol: ClassVar[dict[str, "KernelLibrary"]] = {}
    """Libraries of this process by the symbol that they define."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.inner = self.is_inlined = self.is_stored = False
        self.symbol = ""
        self.callees: tuple[str, ...] = ()
        self._bitcode, self._object = b"", b""
        self._lowered: tuple[tuple[str, ...], bytes] = (), b""
        self._is_loaded = False
        self.enable_object_caching()

    @classmethod
    def find(cls, codegen: Any, symbol: str) -> "KernelLibrary":
        """Return the code of a kernel, of this process or else of the store.

        Raises:
            MissingCodeError: it is in neither.
        """
        if symbol not in cls.by_symbol:
            found = cls.store.read(symbol, "bc")
            if found is None:
                raise MissingCodeError(symbol)
            self = cls(codegen, symbol)
            self.inner, self.symbol, self._finalized = True, symbol, True
            self.callees, self._bitcode, self.is_inlined = found
            # Found now, so that a missing one is noticed while the kernel can still be compiled
            # again, and not while machine code is loaded.
            for callee in self.callees:
                cls.find(codegen, callee)
            cls.by_symbol[symbol] = self
        return cls.by_symbol[symbol]

    @property
    def is_large(self) -> bool:
        """Whether it is called, not linked."""
        return bool(self.symbol) and len(self._bitcode) > LARGE and not self.is_inlined

    def _optimize_functions(self, ll_module: Any) -> None:
        # The module's passes do all that Numba's passes over each function do.
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        # Numba runs a cheap pass before, and at level 3: longer, and no faster code.
        # Measured: both together take 8 % more of a compilation, and rollouts of four scenarios
        # take 0.95 to 1.0 of the time at level 2. The loop vectoriser stays: without it metrics are
        # 15 % slower and compilation is no shorter.
        manager, builder = self._codegen._module_pass_manager(opt=2)
        manager.run(self._final_module, builder)

    def finalize(self) -> None:
        """Link what is small; see the base class."""
        callees: dict[str, None] = {}
        linked = []
        called = []
        for library in self._linking_libraries:
            if isinstance(library, KernelLibrary):
                if library.symbol:
                    called.append(library.symbol)
                if library.is_large:
                    callees[library.symbol] = None
                    continue
                # A kernel that is linked leaves the large ones that it calls to its caller.
                callees |= dict.fromkeys(library.callees)
            linked.append(library)
        self.callees = tuple(callees)
        if self.is_stored:
            mine = [library for library in linked if not getattr(library, "symbol", "")]
            for library in dict.fromkeys(mine):
                self._final_module.link_in(library._get_module_for_linking(), preserve=True)
            self._lowered = tuple(called), self._final_module.as_bitcode()
            linked = [library for library in linked if library not in mine]
        self._linking_libraries = linked
        super().finalize()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True
        self._bitcode = self._final_module.as_bitcode()
        if self.is_stored:
            (self.symbol,) = (
                function.name for function in self._final_module.functions if _is_own(function)
            )
            self.by_symbol[self.symbol] = self
            self.store.write(self.symbol, "bc", (self.callees, self._bitcode, self.is_inlined))
            self.store.write(self.symbol, "raw", self._lowered)
            self._lowered = (), b""

    def _get_module_for_linking(self) -> Any:
        self._parse()
        return super()._get_module_for_linking()

    def _parse(self) -> None:
        if self.symbol and not any(True for _ in self._final_module.functions):
            self._final_module = llvm.parse_bitcode(self._bitcode)

    def load(self) -> None:
        """Load the machine code of the kernel and of all that it calls; generate what lacks."""
        if self._is_loaded:
            return
        self._is_loaded = True
        self._codegen._engine._defined_symbols.add(self.symbol)
        for symbol in self.callees:
            self.find(self._codegen, symbol).load()
        if self.symbol and not self._object:
            self._object = self.store.read(self.symbol, "o") or b""
        if self._object:
            engine = self._codegen._engine
            engine._ee.add_object_file(llvm.ObjectFileRef.from_data(self._object))
            engine.finalize_object()
            return
        self._parse()
        super()._finalize_final_module()
        self._object = self._get_compiled_object()
        if self.symbol:
            self.store.write(self.symbol, "o", self._object)

    def get_pointer_to_function(self, name: str) -> int:
        """Return where the code of a function lies, 0 if it has none; see the base class."""
        self._ensure_finalized()
        if name.startswith(WRAPPER) and self.inner:
            return 0
        self.load()
        address: int = super().get_pointer_to_function(name)
        return address

    def serialize_using_object_code(self) -> Any:
        """Return what `_unserialize` takes."""
        self._ensure_finalized()
        names = [] if self.inner else list(self._defined())
        bitcode = b"" if self.symbol else self._bitcode
        given = (self.inner, self.symbol, self.callees, bitcode, self._object, names)
        return (self.name, "kernel", given)

    def _defined(self) -> Iterator[str]:
        for some in (self._final_module.functions, self._final_module.global_variables):
            yield from (item.name for item in some if not item.is_declaration)

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Self:
        name, _, (inner, symbol, callees, bitcode, machine_code, names) = state
        if symbol and inner:
            return cls.find(codegen, symbol)
        self = cls(codegen, name)
        self.inner, self.callees, self._finalized = inner, callees, True
        self._bitcode, self._object = bitcode, machine_code
        for callee in callees:
            cls.find(codegen, callee)
        if bitcode:
            self._final_module = llvm.parse_bitcode(bitcode)
        codegen._engine._defined_symbols |= set(names)
        return self

    @property
    def codegen(self) -> Any:
        """The code generator; one that sets no environments in what only kernels call."""
        return _WithoutEnvironments(self._codegen) if self.inner else self._codegen


def _is_own(function: Any) -> bool:
    return not function.is_declaration and function.linkage == llvm.Linkage.external


class _WithoutEnvironments:
    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def set_env(self, name: str, env: Any) -> None:
        """Do nothing: kernels raise nothing."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)


# --- Numba's compiler as kernels use it ---


_FOR_KERNEL: ContextVar[bool] = ContextVar("for_kernel", default=False)


def is_for_kernel() -> bool:
    """Return whether a kernel is compiled only for other kernels to call it, not for Python."""
    return _FOR_KERNEL.get()


@contextmanager
def for_kernel() -> Iterator[None]:
    """Compile kernels for other kernels, in this thread."""
    token = _FOR_KERNEL.set(True)
    try:
        yield
    finally:
        _FOR_KERNEL.reset(token)


@register_pass(mutates_CFG=False, analysis_only=True)
class _MakeLibrary(AnalysisPass):  # type: ignore[misc]
    _name = "make_kernel_library"

    def __init__(self) -> None:
        AnalysisPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        library = KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        library.inner = state.flags.no_cpython_wrapper = is_for_kernel()
        library.is_inlined = state.flags.forceinline
        state.library = library
        function = state.func_id.func
        if function.__module__.startswith("bridgegen.") and "<" not in function.__qualname__:
            # The symbol, which contains this, is then the same in every process.
            state.func_id.unique_id = digest(Path(function.__code__.co_filename))
            library.is_stored = library.inner
        return True


class KernelCompiler(compiler.CompilerBase):  # type: ignore[misc]
    """Numba's compiler without object mode."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_MakeLibrary, typed_passes.AnnotateTypes)
        passes.finalize()
        return [passes]
