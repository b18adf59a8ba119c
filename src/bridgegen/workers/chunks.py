"""How a batch of rows is cut."""

from collections.abc import Iterator


def cut(n: int, workers: int, at_once: int) -> Iterator[tuple[int, int]]:
    """Yield the bounds of chunks that cover rows 0 … n − 1 in their order; of none, one chunk.

    Args:
        n: rows, ≥ 0.
        workers: that are to have something to do each, ≥ 1.
        at_once: rows that a chunk has at most, ≥ 1.
    """
    size = max(1, min(at_once, -(-n // workers)))
    for start in range(0, max(n, 1), size):
        yield start, min(start + size, n)
