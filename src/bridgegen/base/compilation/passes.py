"""Numba's compiler as kernels use it: their code in libraries of ours, wrappers for Python only."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from numba.core import compiler, typed_passes
from numba.core.compiler_machinery import AnalysisPass, register_pass

from bridgegen.base.compilation.library import KernelLibrary
from bridgegen.base.compilation.sources import digest

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
