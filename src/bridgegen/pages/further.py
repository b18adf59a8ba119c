"""Scenarios besides the exported ones: whose motion the page holds, or has simulated on request."""

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Any, Protocol

import numpy as np

from bridgegen.base.arrays import Int
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.picture_payload import pictures_payload
from bridgegen.pages.playback import Playback
from bridgegen.pages.playback_payload import playback_payload, road_payload
from bridgegen.pages.playbacks import playbacks
from bridgegen.results.store import Recorded, Rows
from bridgegen.search.algorithms.dominance import by_merit

MOTIONS, MOTIONS_OF_THEIR_OWN = 400, 20
"""Maximum number of further scenarios whose motion the page holds: a second's work. Of a long run a
tenth of the rows. Fewer where each has a road, or an adversary's course, of its own, which take ten
times as long; none with a user's own driver, which may be slow."""

AT_A_TIME = 40
"""Number of further scenarios that are simulated together: a long one with many participants takes
2 MB."""


def further_playbacks(
    pipeline: Pipeline, rows: Rows | Recorded, kept: set[int], wanted: Sequence[int]
) -> "_Further":
    """Return the playbacks of scenarios besides the exported ones.

    First the requested ones; then the most critical ones by turns with others, spread evenly over
    the search, so that wherever one points in the scatter plot, there is one near that plays.
    """
    critical = np.flatnonzero(rows.critical & (rows.status == 0))
    best = critical[by_merit(rows.F[critical])]
    best = best[~np.isin(best, list(kept))]
    space = pipeline.space
    own = space.decisions or {*pipeline.runner.source.static_names} & {*space.variables}
    most = MOTIONS_OF_THEIR_OWN if own else max(MOTIONS, len(rows) // 10)
    first = [evaluation for evaluation in wanted if evaluation not in kept]
    best = best[:most]
    rest = np.setdiff1d(np.flatnonzero(rows.status == 0), [*kept, *best[: most // 2]])
    # Half the most critical ones, half spread evenly over the search: the others play in `bridgegen
    # view`.
    spread = rest[spread_evenly(rest.size, most)]
    turns = [item for pair in zip_longest(best.tolist(), spread.tolist()) for item in pair]
    order = [turn for turn in dict.fromkeys([*first, *turns]) if turn is not None][:most]
    # A user's driver may be slow, and runs only where it is asked for.
    if pipeline.driver.is_own:
        order = []
    return _Further(pipeline, rows, order)


def spread_evenly(n: int, most: int) -> Int:
    """Return distinct numbers below ``n``, every first part of which is spread evenly.

    Van der Corput's sequence: the bits of 0, 1, 2 … in reverse.

    Args:
        n: how many numbers there are to choose from.
        most: how many are chosen at most.
    """
    bits = max(n - 1, 1).bit_length()
    k = np.arange(2**bits)
    numbers = np.zeros_like(k)
    for i in range(bits):
        # Van der Corput's sequence: bits in reverse.
        numbers |= (k >> i & 1) << (bits - 1 - i)
    return numbers[numbers < n][:most]


class _Further:
    """Playbacks of some evaluations, simulated a few at a time on iteration.

    A long run has more of them than the page can hold.
    """

    def __init__(self, pipeline: Pipeline, rows: Rows | Recorded, order: Sequence[int]) -> None:
        self._pipeline, self._rows, self._order = pipeline, rows, order

    def __iter__(self) -> Iterator[Playback]:
        for start in range(0, len(self._order), AT_A_TIME):
            numbers = self._order[start : start + AT_A_TIME]
            some = [(f"evaluation {i + 1}", i, ()) for i in numbers]
            yield from playbacks(self._pipeline, self._rows, some, brief=True)


# --- The motion of a scenario that the page does not hold, simulated on request ---


class Named(Protocol):
    """An exported scenario."""

    @property
    def name(self) -> str:
        """The name of its files."""

    @property
    def files(self) -> tuple[str, ...]:
        """Their paths, relative to the run's folder."""


def motion_payload(
    pipeline: Pipeline, rows: Rows | Recorded, evaluation: int, exported: Named | None = None
) -> dict[str, Any]:
    """Return a scenario's playback, with its road and picture.

    ``playback`` is as in the page's data, except that its road, number −1, is the first of
    ``roads`` and its picture, if it has one, the first of ``pictures``.

    Args:
        pipeline: what evaluated the rows.
        rows: of the run, in order.
        evaluation: which of them, from 0.
        exported: its name and files, if it was exported.
    """
    name = exported.name if exported else f"evaluation {evaluation + 1}"
    (playback,) = playbacks(
        pipeline, rows, [(name, evaluation, exported.files if exported else ())]
    )
    return {
        "roads": [road_payload(playback)],
        "pictures": pictures_payload([playback.picture]) if playback.picture else None,
        "playback": playback_payload(playback, -1, 0 if playback.picture else None),
    }
