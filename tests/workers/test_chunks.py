"""A batch is cut into chunks that cover it, in order, none larger than may be."""

from hypothesis import given
from hypothesis import strategies as st

from bridgegen.workers.chunks import cut


@given(st.integers(0, 500), st.integers(1, 40), st.integers(1, 200))
def test_chunks_cover_every_row_once(n, workers, at_once):
    chunks = list(cut(n, workers, at_once))
    assert [row for a, b in chunks for row in range(a, b)] == list(range(n))
    assert all(b - a <= at_once for a, b in chunks)
    sizes = [b - a for a, b in chunks[:-1]]
    assert len(set(sizes)) <= 1  # but for the last, all are alike
    assert len(chunks) >= min(n, workers) // 2  # nearly everybody has something to do
    if n == 0:
        assert chunks == [(0, 0)]


def test_by_hand():
    assert list(cut(10, 3, 100)) == [(0, 4), (4, 8), (8, 10)]
    assert list(cut(10, 1, 4)) == [(0, 4), (4, 8), (8, 10)]
