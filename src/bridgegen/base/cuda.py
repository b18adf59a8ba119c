"""NVIDIA's driver by ctypes: a module of PTX, memory and launches, and errors by their names.

Source: CUDA Driver API, https://docs.nvidia.com/cuda/cuda-driver-api/.
"""

import ctypes
import sys
from ctypes import byref, c_char_p, c_int, c_size_t, c_uint, c_void_p
from typing import TYPE_CHECKING, Any

from bridgegen.base.errors import InputError, WorkersError

if TYPE_CHECKING:  # it is part of the command line, which starts fast
    import numpy.typing as npt

DEVICE = "BRIDGEGEN_DEVICE"
"""Variable of the environment with the device on which the embedded simulator runs: "cuda"; so that
processes which this one starts use it, too."""

LOG = 8192
"""Number of characters of the compiler's log that are kept."""

ERROR_LOG, ERROR_LOG_BYTES = 5, 6  # of CUjit_option
PROCESSORS = 16  # of CUdevice_attribute

OUT_OF_MEMORY = 2

STACK_SIZE = 0  # of CUlimit
STACK = 16_384
"""Stack of a thread [bytes]. Numba's merge sort calls itself, and the switch over kernels of one
signature looks as if they did, so the driver cannot know how much a thread needs, and would give it
1,024."""


class OutOfMemory(Exception):
    """The device has not as much memory."""


def library() -> Any:
    """Return the driver.

    Raises:
        InputError: this machine has no driver of NVIDIA's.
    """
    name = "nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1"
    try:
        return ctypes.CDLL(name)
    except OSError:
        raise InputError(
            f"--device cuda needs a GPU of NVIDIA's with its driver, and {name} is not found"
        ) from None


class Gpu:
    """The first GPU, with a module.

    Args:
        ptx: the module's text, which the driver compiles, and keeps in its cache.

    Attributes:
        name: of the GPU.
        processors: the number of its multiprocessors.

    Raises:
        InputError: there is no driver or no GPU, or it cannot compile the module.
    """

    def __init__(self, ptx: bytes) -> None:
        self._driver, self._is_ready = library(), False
        device, context, name = c_int(), c_void_p(), ctypes.create_string_buffer(256)
        self._call("cuInit", 0)
        self._call("cuDeviceGet", byref(device), 0)
        self._call("cuDeviceGetName", name, len(name), device)
        self.name = name.value.decode(errors="replace")
        count = c_int()
        self._call("cuDeviceGetAttribute", byref(count), PROCESSORS, device)
        self.processors = count.value
        self._call("cuDevicePrimaryCtxRetain", byref(context), device)
        self._context = context
        self.enter()
        self._call("cuCtxSetLimit", STACK_SIZE, c_size_t(STACK))
        self._module, log = c_void_p(), ctypes.create_string_buffer(LOG)
        options = (c_int * 2)(ERROR_LOG, ERROR_LOG_BYTES)
        values = (c_void_p * 2)(ctypes.addressof(log), LOG)
        self._log = log
        image = c_char_p(ptx + b"\0")
        self._call("cuModuleLoadDataEx", byref(self._module), image, 2, options, values)
        self._is_ready = True

    def enter(self) -> None:
        """Have this thread use the GPU; each thread does so first."""
        self._call("cuCtxSetCurrent", self._context)

    def function(self, name: str) -> c_void_p:
        """Return an entry of the module."""
        found = c_void_p()
        self._call("cuModuleGetFunction", byref(found), self._module, name.encode())
        return found

    def symbol(self, name: str) -> int:
        """Return where a variable of the module lies."""
        found, size = c_void_p(), c_size_t()
        self._call("cuModuleGetGlobal_v2", byref(found), byref(size), self._module, name.encode())
        return found.value or 0

    def free_bytes(self) -> int:
        """Return how much memory can still be taken."""
        free, total = c_size_t(), c_size_t()
        self._call("cuMemGetInfo_v2", byref(free), byref(total))
        return free.value

    def take(self, size: int) -> int:
        """Return where memory of some bytes begins.

        Raises:
            OutOfMemory: there is not as much.
        """
        found = c_void_p()
        self._call("cuMemAlloc_v2", byref(found), c_size_t(max(size, 1)))
        return found.value or 0

    def give_back(self, at: int) -> None:
        """Free what ``take`` returned."""
        self._call("cuMemFree_v2", c_void_p(at))

    def put(self, at: int, array: "npt.NDArray[Any]") -> None:
        """Copy the bytes of a contiguous array to the device."""
        self._call(
            "cuMemcpyHtoD_v2", c_void_p(at), c_void_p(array.ctypes.data), c_size_t(array.nbytes)
        )

    def get(self, array: "npt.NDArray[Any]", at: int) -> None:
        """Fill a contiguous array with the bytes of the device."""
        self._call(
            "cuMemcpyDtoH_v2", c_void_p(array.ctypes.data), c_void_p(at), c_size_t(array.nbytes)
        )

    def clear(self, at: int, size: int) -> None:
        """Set bytes to 0."""
        self._call("cuMemsetD8_v2", c_void_p(at), 0, c_size_t(size))

    def launch(self, function: c_void_p, blocks: int, threads: int) -> None:
        """Run an entry without arguments, and wait for its end."""
        one, none = c_uint(1), c_void_p()
        self._call(
            "cuLaunchKernel", function, c_uint(blocks), one, one, c_uint(threads), one, one,
            c_uint(0), none, none, none,
        )  # fmt: skip
        self._call("cuCtxSynchronize")

    def _call(self, function: str, *arguments: Any) -> None:
        """Call a function of the driver.

        Raises:
            OutOfMemory: it says so.
            InputError: of other errors, before the module is loaded,
            WorkersError: and later.
        """
        code = getattr(self._driver, function)(*arguments)
        if not code:
            return
        if code == OUT_OF_MEMORY:
            raise OutOfMemory(function)
        text = c_char_p()
        self._driver.cuGetErrorName(code, byref(text))
        name = (text.value or b"").decode() or f"error {code}"
        if self._is_ready:
            raise WorkersError(f"the GPU ({self.name}) failed: {name} in {function}")
        log = getattr(self, "_log", None)
        words = " ".join(log.value.decode(errors="replace").split())[:400] if log else ""
        raise InputError(f"--device cuda: {name} in {function}" + (f": {words}" if words else ""))
