"""How often Python looks for cyclic garbage in the processes that are BridgeGen's own."""

import gc

RARELY = (50_000, 20, 50)
"""Thresholds of Python's collector.

With its own, (700, 10, 10), a short search collects 704 times, which takes 0.7 s of its 5.6 s of
processor time; with these, 9 times and 0.2 s. Memory is the same, 289 MB (crossroads-s4 with a
budget of 80).
"""


def collect_rarely() -> None:
    """Look for cyclic garbage less often in this process; it must belong to BridgeGen."""
    gc.set_threshold(*RARELY)
