"""The rows that a search has asked for: 24 to 32 bytes of memory for each."""

from array import array
from hashlib import blake2b

import numpy as np

from bridgegen.base.arrays import Float, Int

FIRST_SLOTS = 1 << 12


class KnownRows:
    """The distinct rows of X that a search has asked for; ids number them from 0, in their order.

    Rows are distinguished by digests of 16 bytes, held in the order of ids. An open-addressing hash
    table of ids, at most half full, finds them. (A dict takes 200 bytes a row.)
    """

    def __init__(self) -> None:
        self._digests, self._slots = array("Q"), array("i")
        self._resize(FIRST_SLOTS)

    def __len__(self) -> int:
        return len(self._digests) // 2

    def add(self, X: Float, most: int) -> tuple[Int, list[int]]:
        """Return the id of each row, ``(n,)``, and the positions of those that are new.

        Args:
            X: ``(n, k)`` float64, without −0.0.
            most: at most so many rows are known; the id of a further new one is −1.
        """
        whole = b"".join([blake2b(row.tobytes(), digest_size=16).digest() for row in X])
        keys = np.frombuffer(whole, np.uint64).reshape(-1, 2).tolist()
        ids, fresh, n = [-1] * len(keys), [], len(self)
        slots, digests, mask = self._slots, self._digests, len(self._slots) - 1
        for k, (low, high) in enumerate(keys):
            at = low & mask
            while (known := slots[at]) >= 0:
                if digests[2 * known] == low and digests[2 * known + 1] == high:
                    ids[k] = known
                    break
                at = (at + 1) & mask
            else:
                if n < most:
                    slots[at] = ids[k] = n
                    digests.append(low)
                    digests.append(high)
                    fresh.append(k)
                    n += 1
                    if 2 * n > mask:
                        self._resize(2 * len(slots))
                        slots, mask = self._slots, len(self._slots) - 1
        return np.array(ids, dtype=np.int64), fresh

    def _resize(self, size: int) -> None:
        """Rebuild the table with so many slots, a power of two."""
        slots = np.full(size, -1, np.int32)
        low = np.frombuffer(self._digests, np.uint64)[::2]
        at, left = (low & np.uint64(size - 1)).astype(np.int64), np.arange(len(low))
        while len(left):
            free = slots[at] < 0
            slots[at[free]] = left[free]  # one of several rows gets a slot
            out = slots[at] != left
            at, left = (at[out] + 1) & (size - 1), left[out]
        self._slots = array("i", slots.tobytes())
