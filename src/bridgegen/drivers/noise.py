"""The key of a row's random numbers: a hash of its parameter values."""

import hashlib
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import as_float

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_SHIFT_1, _SHIFT_2, _SHIFT_3 = np.uint64(30), np.uint64(27), np.uint64(31)


def noise_key(values: Mapping[str, npt.ArrayLike], n_rows: int) -> npt.NDArray[np.uint64]:
    """Return the noise key of each of N rows.

    Equal values give equal keys, whatever the order of the names and whichever rows are beside;
    −0.0 is 0.0. Rows that differ in one bit of one value have unrelated keys.

    Args:
        values: ``(N,)`` float64, or one number for all rows, per parameter.
        n_rows: N.

    Returns:
        ``(N,)`` uint64.

    Raises:
        ValueError: a value is not finite, or a column's shape differs.

    Source: the mixing function is SplitMix64's, Steele, Lea, Flood, Fast Splittable Pseudorandom
    Number Generators, OOPSLA (2014), with Stafford's constants (variant 13).
    """
    key = np.zeros(n_rows, dtype=np.uint64)
    for name in sorted(values):
        column = np.broadcast_to(np.asarray(values[name], dtype=np.float64), n_rows)
        # Adding 0.0 makes 0.0 of −0.0, which is equal and has other bits.
        bits = (as_float(name, column, (n_rows,)) + 0.0).view(np.uint64)
        digest = hashlib.blake2b(name.encode(), digest_size=8).digest()
        word = np.frombuffer(digest, dtype="<u8").astype(np.uint64)
        key = _mix(_mix(key ^ word) + bits)
    return key


def driver_seeds(keys: npt.NDArray[np.uint64], repeat: int = 0) -> npt.NDArray[np.int64]:
    """Return the seeds of a user's driver in N rows, ``(N,)`` in 0 .. 2**32 − 1.

    They follow from the rows alone, as their noise does: so a row is driven alike in a search, in a
    suite and from its exported file.

    Args:
        keys: ``(N,)``, see `noise_key`.
        repeat: which evaluation of the rows it is; 0 is the first.
    """
    word = np.uint64(int.from_bytes(b"a driver", "little"))
    return (_mix(_mix(keys ^ word) + np.uint64(repeat)) >> np.uint64(32)).astype(np.int64)


def _mix(word: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    word = word + _GOLDEN
    word = (word ^ (word >> _SHIFT_1)) * _MIX_1
    word = (word ^ (word >> _SHIFT_2)) * _MIX_2
    return word ^ (word >> _SHIFT_3)
