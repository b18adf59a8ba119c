"""How a batch of rows is cut."""

from collections.abc import Iterator


def cut(n: int, workers: int, at_once: int) -> Iterator[tuple[int, int]]:
    """Yield the bounds of chunks that cover rows 0 … n − 1 in their order; of none, one chunk.

    All are alike, but for a row, and their number is a multiple of the workers' where there are
    rows enough: so nobody is left to work alone on the last ones.

    Args:
        n: rows, ≥ 0.
        workers: that are to have something to do each, ≥ 1.
        at_once: rows that a chunk has at most, ≥ 1.
    """
    rounds = -(-n // (workers * at_once))
    pieces = max(1, min(n, rounds * workers))
    for i in range(pieces):
        yield i * n // pieces, (i + 1) * n // pieces
