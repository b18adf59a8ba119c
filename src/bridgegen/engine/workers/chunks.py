"""Splits a batch of rows into chunks."""

from collections.abc import Iterator


def cut(n: int, workers: int, at_once: int) -> Iterator[tuple[int, int]]:
    """Yield the bounds of chunks that cover rows 0 … n − 1 in order; one empty chunk if n = 0.

    Their sizes differ by one row at most. If there are enough rows, their number is a multiple of
    the number of workers, so that no worker evaluates the last rows alone.

    Args:
        n: number of rows, ≥ 0.
        workers: number of workers that need a chunk each, ≥ 1.
        at_once: maximum number of rows of a chunk, ≥ 1.
    """
    rounds = -(-n // (workers * at_once))
    pieces = max(1, min(n, rounds * workers))
    for i in range(pieces):
        yield i * n // pieces, (i + 1) * n // pieces
