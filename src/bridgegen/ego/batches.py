"""Neural networks as drivers: batches of one fixed size, so that bits do not depend on the batch.

    class MyDriver:
        def __init__(self):
            self._network = FixedBatch(my_network)  # (64, K) -> (64, J)

        def act(self, observation):
            answer = self._network(features(observation))  # (N, K) -> (N, J)

Linear algebra sums in an order that depends on a matrix's shape, on a row's place in it and on its
address in memory. So a network rounds differently in a batch of 16 than in one of 512, and a
scenario's result would depend on how batches are cut. Here, all of these stay the same: blocks of
one size, the last one padded; whole vectors in every loop, and memory aligned to a cache line.
The same must hold inside of Intel's MKL, which PyTorch calls: importing this module sets
``MKL_CBWR=COMPATIBLE`` unless it is set (MKL's *conditional numerical reproducibility*), to be read
by MKL at its first use.
"""

import os
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.errors import InputError

SIZE = 64
"""Rows of a block: with a multiple of it, no vector of up to 64 numbers is cut at the end."""

ALIGNED = 64  # bytes, a line of the processor's cache

os.environ.setdefault("MKL_CBWR", "COMPATIBLE")


class FixedBatch:
    """A network, or any function of rows, called with blocks of one size.

    Args:
        function: takes one or more arrays whose first axis is ``size``, and returns one or a tuple
            of them; anything that NumPy reads as an array, so a tensor without gradient, too.
            Each row of its result depends on that row of its arguments alone.
        size: rows of a block, a multiple of 64; or 1, which is slow, for a function whose results
            depend on a row's place even so.

    Raises:
        InputError: another size.
    """

    def __init__(self, function: Callable[..., Any], size: int = SIZE) -> None:
        self._function, self._size = function, checked_size(size)

    def __call__(self, *arrays: npt.ArrayLike) -> Any:
        """Return the function's result for N rows.

        Args:
            arrays: ``(N, …)`` each.

        Returns:
            ``(N, …)``, or a tuple of such arrays if the function returns a tuple.

        Raises:
            InputError: no arrays or arrays of different N; or the function's result has not one row
                for each row of the block.
        """
        parts: list[list[npt.NDArray[Any]]] = []
        several = False
        for rows, block in blocks(*arrays, size=self._size):
            found = self._function(*block)
            several = isinstance(found, tuple)
            parts.append(
                [
                    self._of_block(one)[: rows.stop - rows.start]
                    for one in (found if several else (found,))
                ]
            )
        joined = tuple(np.concatenate(column) for column in zip(*parts, strict=True))
        return joined if several else joined[0]

    def _of_block(self, found: Any) -> npt.NDArray[Any]:
        array = np.array(found)  # a copy: the function may use its memory again
        if array.shape[:1] != (self._size,):
            raise InputError(
                f"a network in a FixedBatch must return {self._size} rows for a block of "
                f"{self._size}, got the shape {array.shape}"
            )
        return array


def blocks(
    *arrays: npt.ArrayLike, size: int = SIZE
) -> Iterator[tuple[slice, list[npt.NDArray[Any]]]]:
    """Yield the blocks of N rows: which rows, and copies of the arrays ``(size, …)``.

    The last block is padded with its last row; of no rows there is one block of zeros.

    Args:
        arrays: ``(N, …)`` each.
        size: rows of a block.

    Raises:
        InputError: no arrays, or arrays of different N.
    """
    whole = [np.asarray(array) for array in arrays]
    counts = {array.shape[:1] for array in whole}
    if len(counts) != 1 or counts == {()}:
        raise InputError(
            "the arrays of a FixedBatch must have the same number of rows, got the shapes "
            + (", ".join(str(array.shape) for array in whole) or "of none")
        )
    n = len(whole[0])
    for start in range(0, max(n, 1), size):
        rows = slice(start, min(start + size, n))
        yield rows, [_padded(array[rows], size) for array in whole]


def checked_size(size: int) -> int:
    """Return the size of a block.

    Raises:
        InputError: it is neither 1 nor a multiple of 64.
    """
    if size != 1 and (size < SIZE or size % SIZE):
        raise InputError(f"the size of a fixed batch must be 1 or a multiple of {SIZE}, got {size}")
    return size


def _padded(rows: npt.NDArray[Any], size: int) -> npt.NDArray[Any]:
    """Return a copy of rows, the last one repeated up to ``size``, aligned in memory."""
    shape = (size, *rows.shape[1:])
    n_bytes = int(np.prod(shape)) * rows.dtype.itemsize
    memory = np.zeros(n_bytes + ALIGNED, dtype=np.uint8)
    start = -memory.ctypes.data % ALIGNED
    block = memory[start : start + n_bytes].view(rows.dtype).reshape(shape)
    block[: len(rows)] = rows
    if len(rows):
        block[len(rows) :] = rows[-1]
    return block
