"""Cells of a map that stand for their class, simulated again to be played."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_cdt

from bridgegen.base.errors import BridgeGenError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.preventability.classes import CellClass, Codes
from bridgegen.jobs.preventability.page import drawn_columns
from bridgegen.jobs.preventability.result import PreventabilityMap
from bridgegen.pages.playbacks import nominal_playback
from bridgegen.pages.thumbnails import Thumbnail, thumbnail

MOST_DRIVERS = 4
"""Largest number of drivers whose cells are played: six thumbnails each."""

JUDGED = (CellClass.AVOIDED, CellClass.PREVENTABLE, CellClass.UNPREVENTABLE)


@dataclass(frozen=True)
class CellPicture:
    """A cell that stands for its class.

    Attributes:
        driver: under test.
        cell: its number on each axis.
        kind: its class.
        place: where it lies, in words.
        shown: its motion.
    """

    driver: str
    cell: tuple[int, ...]
    kind: CellClass
    place: str
    shown: Thumbnail


def representatives(codes: Codes) -> Iterator[tuple[CellClass, str, tuple[int, int]]]:
    """Yield cells of a picture for each class: one in its middle, and one beside another class.

    Args:
        codes: ``(width, height)``, a `CellClass` each.
    """
    judged = np.isin(codes, JUDGED)
    for kind in JUDGED:
        mask = codes == kind
        if not mask.any():
            continue
        # The map's edge is no boundary of a class.
        depth = distance_transform_cdt(np.pad(mask, 1, mode="edge"), "chessboard")[1:-1, 1:-1]
        middle = np.unravel_index(int(np.where(mask, depth, -1).argmax()), codes.shape)
        yield kind, "in the middle", (int(middle[0]), int(middle[1]))
        beside = np.argwhere(mask & binary_dilation(judged & ~mask))
        if len(beside):
            x, y = beside[len(beside) // 2].tolist()
            if (x, y) != tuple(map(int, middle)):
                yield kind, "at the boundary", (x, y)


def cell_pictures(
    result: PreventabilityMap, pipeline: Callable[[str], Pipeline | None]
) -> Iterator[CellPicture]:
    """Yield cells of each driver's picture that has the most classes.

    Args:
        result: the map.
        pipeline: of a driver; None of one without motion.
    """
    grid = result.grid
    for driver in result.drivers[:MOST_DRIVERS]:
        made = pipeline(driver)
        if made is None:
            continue
        classes = result.classes[driver]
        further = (0,) * max(0, len(grid.shape) - 3)  # of several blocks, the first
        places = [(column, *further) for column in drawn_columns(grid)] or [()]
        plane = (slice(None),) * min(len(grid.shape), 2)
        planes = [classes[plane + place] for place in places]
        most = max(
            range(len(planes)), key=lambda i: len(np.intersect1d(np.unique(planes[i]), JUDGED))
        )
        codes = planes[most] if planes[most].ndim > 1 else planes[most][:, np.newaxis]
        for kind, where, at in representatives(codes):
            cell = (*at[: len(grid.shape)], *places[most])
            number = int(np.ravel_multi_index(cell, grid.shape))
            X, _ = grid.rows(number, number + 1)
            try:
                playback = nominal_playback(made, driver, X[0])
            except BridgeGenError:
                continue  # its class stands
            conflict = playback.conflict
            happened = conflict is not None and conflict.summary.happened
            words = conflict.summary.sentence if conflict and happened else "No collision."
            shown = thumbnail(playback, words)
            if shown is not None:
                yield CellPicture(driver, cell, kind, where, shown)
