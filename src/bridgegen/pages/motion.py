"""The motion of a scenario that the page does not hold, simulated on request."""

from typing import Any, Protocol

from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.picture_payload import pictures_payload
from bridgegen.pages.playback_payload import playback_payload, road_payload
from bridgegen.pages.playbacks import playbacks
from bridgegen.results.store import Recorded, Rows


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
    (one,) = playbacks(pipeline, rows, [(name, evaluation, exported.files if exported else ())])
    return {
        "roads": [road_payload(one)],
        "pictures": pictures_payload([one.picture]) if one.picture else None,
        "playback": playback_payload(one, -1, 0 if one.picture else None),
    }
