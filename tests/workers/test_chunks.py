"""A batch is cut into chunks that cover it, in order, none larger than may be."""

from hypothesis import given
from hypothesis import strategies as st

from bridgegen.engine.workers.workers import cut


@given(st.integers(0, 500), st.integers(1, 40), st.integers(1, 200))
def test_chunks_cover_every_row_once(n, workers, at_once):
    chunks = list(cut(n, workers, at_once))
    assert [row for a, b in chunks for row in range(a, b)] == list(range(n))
    assert all(b - a <= at_once for a, b in chunks)
    sizes = [b - a for a, b in chunks]
    assert max(sizes) - min(sizes) <= 1
    assert len(chunks) % workers == 0 or len(chunks) == max(n, 1)  # nobody works alone at the end
    assert len(chunks) <= max(1, workers * (n // (workers * at_once) + 1))  # nor for nothing


def test_by_hand():
    assert list(cut(10, 3, 100)) == [(0, 3), (3, 6), (6, 10)]
    assert list(cut(10, 1, 4)) == [(0, 3), (3, 6), (6, 10)]
    assert len(list(cut(40, 2, 8))) == 6  # not 5, of which somebody does 3
    assert list(cut(0, 2, 8)) == [(0, 0)]
