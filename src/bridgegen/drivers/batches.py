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
Where the library rounds differently from place to place even so, rows are put in equal places only.
The same must hold inside of Intel's MKL, which PyTorch calls: importing this module sets
``MKL_CBWR=COMPATIBLE`` unless it is set (MKL's *conditional numerical reproducibility*), to be read
by MKL at its first use.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Int
from bridgegen.base.errors import InputError

SIZE = 64
"""Number of rows of a block: with a multiple of it, no vector of up to 64 numbers is cut at the
end."""

PROBES = 64
"""Number of rows by which equal places are found; a rounding need not show in the result of
each."""

INPUTS, OUTPUTS = (5, 17, 89, 256, 512), (2, 17, 64, 100, 256)
"""Sizes of the matrix products by which NumPy's library is probed."""

ALIGNED = 64  # bytes, a line of the processor's cache

# When imported, since MKL reads it at its first use.
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
        self._places: Int | None = None

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
        whole = checked_rows(arrays)
        if self._places is None:
            self._places = equal_places(lambda block: self._parts(block)[0], whole, self._size)
        parts: list[list[npt.NDArray[Any]]] = []
        several = False
        for rows, block in blocks(*whole, size=self._size, places=self._places):
            found, several = self._parts(block)
            at = self._places[: rows.stop - rows.start]
            parts.append([array[at] for array in found])
        joined = tuple(np.concatenate(column) for column in zip(*parts, strict=True))
        return joined if several else joined[0]

    def _parts(self, block: Sequence[npt.NDArray[Any]]) -> tuple[list[npt.NDArray[Any]], bool]:
        """Return what the function returns for a block, and whether that is a tuple."""
        found = self._function(*block)
        several = isinstance(found, tuple)
        return [self._of_block(item) for item in (found if several else (found,))], several

    def _of_block(self, found: Any) -> npt.NDArray[Any]:
        array = np.array(found)  # a copy: the function may use its memory again
        if array.shape[:1] != (self._size,):
            raise InputError(
                f"a network in a FixedBatch must return {self._size} rows for a block of "
                f"{self._size}, got the shape {array.shape}"
            )
        return array


def blocks(
    *arrays: npt.ArrayLike, size: int = SIZE, places: Int | None = None
) -> Iterator[tuple[slice, list[npt.NDArray[Any]]]]:
    """Yield the blocks of N rows: which rows, and copies of the arrays ``(size, …)``.

    The last block is padded with its last row; of no rows there is one block of zeros.

    Args:
        arrays: ``(N, …)`` each.
        size: rows of a block.
        places: where in a block rows are put, in their order; elsewhere is the last one. All places
            if left out.

    Raises:
        InputError: no arrays, or arrays of different N.
    """
    whole = checked_rows(arrays)
    if places is None:
        places = np.arange(size)
    n = len(whole[0])
    for start in range(0, max(n, 1), len(places)):
        rows = slice(start, min(start + len(places), n))
        yield rows, [_placed(array[rows], size, places) for array in whole]


def checked_rows(arrays: Sequence[npt.ArrayLike]) -> list[npt.NDArray[Any]]:
    """Return arrays ``(N, …)``.

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
    return whole


def equal_places(
    function: Callable[[list[npt.NDArray[Any]]], Sequence[npt.NDArray[Any]]],
    like: Sequence[npt.NDArray[Any]],
    size: int = SIZE,
) -> Int:
    """Return the places in a block at which a function gives one row the same bits.

    A block of one row repeated shows them, for `PROBES` rows: random floats, zeros for other types.
    Where they differ, the places must also be equal for NumPy's matrix products.

    Args:
        function: returns arrays ``(size, …)`` of a block.
        like: arrays ``(·, …)`` of the rows that it takes.
        size: rows of a block.

    Returns:
        int64, ascending, 0 first.
    """
    equal = _equal_to_first(function, like, size)
    if not equal.all():
        for dtype in {array.dtype for array in like if array.dtype.kind == "f"}:
            equal &= _equal_in_products(dtype, size)
    return np.flatnonzero(equal)


def _equal_to_first(
    function: Callable[[list[npt.NDArray[Any]]], Sequence[npt.NDArray[Any]]],
    like: Sequence[npt.NDArray[Any]],
    size: int,
) -> Bool:
    rng = np.random.default_rng(0)
    equal = np.ones(size, dtype=np.bool_)
    for _ in range(PROBES if size > 1 else 0):
        group = [
            (rng.normal(size=shape) if array.dtype.kind == "f" else np.zeros(shape)).astype(
                array.dtype
            )
            for array in like
            for shape in [(1, *array.shape[1:])]
        ]
        for found in function([_placed(row, size, np.arange(size)) for row in group]):
            bits = np.ascontiguousarray(found).reshape(size, -1).view(np.uint8)
            equal &= (bits == bits[0]).all(axis=1)
    return equal


@cache
def _equal_in_products(dtype: np.dtype[Any], size: int) -> Bool:
    """Return which places are equal to the first in products of matrices of many sizes."""
    rng = np.random.default_rng(0)
    equal = np.ones(size, dtype=np.bool_)
    for inputs in INPUTS:
        for outputs in OUTPUTS:
            weights = rng.normal(size=(inputs, outputs)).astype(dtype)
            like = [np.zeros((0, inputs), dtype)]
            equal &= _equal_to_first(lambda block, w=weights: [block[0] @ w], like, size)  # type: ignore[misc]
    return equal


def checked_size(size: int) -> int:
    """Return the size of a block.

    Raises:
        InputError: it is neither 1 nor a multiple of 64.
    """
    if size != 1 and (size < SIZE or size % SIZE):
        raise InputError(f"the size of a fixed batch must be 1 or a multiple of {SIZE}, got {size}")
    return size


def _placed(rows: npt.NDArray[Any], size: int, places: Int) -> npt.NDArray[Any]:
    """Return a block aligned in memory: rows at the first of the places, the last one elsewhere."""
    shape = (size, *rows.shape[1:])
    n_bytes = int(np.prod(shape)) * rows.dtype.itemsize
    memory = np.zeros(n_bytes + ALIGNED, dtype=np.uint8)
    start = -memory.ctypes.data % ALIGNED
    block = memory[start : start + n_bytes].view(rows.dtype).reshape(shape)
    if len(rows):
        block[...] = rows[-1]
        block[places[: len(rows)]] = rows
    return block
