import tracemalloc

import numpy as np

from bridgegen.jobs.search import known_rows
from bridgegen.jobs.search.known_rows import KnownRows


def test_ids_are_those_of_a_dict(monkeypatch):
    monkeypatch.setattr(known_rows, "FIRST_SLOTS", 4)  # the table grows eleven times
    rng = np.random.default_rng(0)
    rows, known, found = rng.integers(0, 40, (20_000, 2)).astype(float), {}, KnownRows()
    rows[10_000:] += rng.random((10_000, 1))
    for start in range(0, len(rows), 50):
        some, want, new = rows[start : start + 50], [], []
        for k, row in enumerate(map(tuple, some)):
            new += [k] * (row not in known)
            want.append(known.setdefault(row, len(known)))
        ids, fresh = found.add(some, 10**9)
        assert (ids.tolist(), fresh) == (want, new)
    assert len(found) == len(known) > 8_000


def meet(found, values, most=9):
    ids, fresh = found.add(np.array(values).reshape(-1, 1), most)
    return ids.tolist(), fresh


def test_a_new_row_beyond_the_most_is_not_met():
    found = KnownRows()
    assert meet(found, [1.0, 2.0, 3.0, 1.0], 2) == ([0, 1, -1, 0], [0, 1])
    assert len(found) == 2
    assert meet(found, [3.0, 4.0], 3) == ([2, -1], [0])


def test_rows_that_want_the_same_slot_are_found_again(monkeypatch):
    """Also past the table's end, in a larger table, and where half of the digest is the same."""
    digests = {1.0: (15, 1), 2.0: (15, 2), 3.0: (31, 1), 4.0: (15, 3)}
    monkeypatch.setattr(known_rows, "FIRST_SLOTS", 16)
    monkeypatch.setattr(known_rows, "blake2b", lambda row, digest_size: Digest(digests, row))
    found = KnownRows()
    assert meet(found, list(digests)) == ([0, 1, 2, 3], [0, 1, 2, 3])
    assert meet(found, list(digests)) == ([0, 1, 2, 3], [])
    found._resize(32)
    assert meet(found, list(digests)) == ([0, 1, 2, 3], [])


class Digest:
    def __init__(self, digests, row):
        self._halves = digests[float(np.frombuffer(row)[0])]

    def digest(self):
        return np.array(self._halves, dtype=np.uint64).tobytes()


def test_memory_a_row():
    def taken(n: int) -> int:
        rows = np.random.default_rng(0).random((n, 2))
        tracemalloc.start()
        found = KnownRows()
        for start in range(0, n, 50):
            found.add(rows[start : start + 50], n)
        used, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return used

    assert taken(30_000) - taken(10_000) < 40 * 20_000
