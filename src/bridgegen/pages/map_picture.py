"""A map from above as SVG: its roads, and its places by their ids."""

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, StorageError
from bridgegen.openx.opendrive.lanes import points
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.outline import AREAS, outline
from bridgegen.openx.opendrive.site import road_ends
from bridgegen.pages.charts import element, points_of

SIDE = 1400.0
"""Length of the longer side of the picture in pixels."""

_MARGIN = 40.0
_STEP = 4.0  # m between the points of a curve

_Pixels = Callable[[Float], Float]

_STYLE = """
svg { background: #eef1ea; font: 13px system-ui, sans-serif }
.area { fill: #98a0a9; stroke: #98a0a9 } .beside { fill: #c6cbd0; stroke: none }
.ring { fill: #ffffffcc; stroke: #4a5563; stroke-width: 2 }
.fits { fill: #d4f0e4; stroke: #00805f; stroke-width: 3 }
.road { fill: none; stroke: #00805f; stroke-width: 5; stroke-linecap: round }
text { fill: #17202c; text-anchor: middle; dominant-baseline: central }
.key { text-anchor: start }
@media (prefers-color-scheme: dark) {
  svg { background: #1b2027 } .area { fill: #59626d; stroke: #59626d } .beside { fill: #3a424b }
  .ring { fill: #242b34dd; stroke: #aab4c0 } .fits { fill: #0d4736; stroke: #38d39f }
  .road { stroke: #38d39f } text { fill: #eef2f6 }
}
"""


def write_map_picture(
    path: Path,
    model: OpenDrive,
    fitting: Collection[str] | None,
    roads: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Draw a map with its junctions, and the stretches of road that a scenario fits.

    Args:
        path: the picture (``.svg``), new.
        model: the road network.
        fitting: ids of the junctions to be marked as those that a scenario fits; None: no
            scenario was asked about.
        roads: by the ids of the stretches that a scenario fits, the road that each begins on.

    Raises:
        InputError: the name does not end in .svg.
        StorageError: the picture exists, or cannot be written.
    """
    if path.suffix.lower() != ".svg":
        raise InputError(f"{path}: the picture's name must end in .svg")
    if path.exists():
        raise StorageError(f"{path}: exists already, and is not overwritten")
    write_whole(path, [map_picture(model, fitting, roads).encode()])


def map_picture(
    model: OpenDrive,
    fitting: Collection[str] | None,
    roads: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return the picture; see `write_map_picture`."""
    shapes = [(kind, line) for kind, line in outline(model, step=_STEP) if kind in AREAS]
    corners = np.concatenate([line for _, line in shapes] or [np.zeros((1, 2))])
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = (SIDE - 2.0 * _MARGIN) / max(float((high - low).max()), 1.0)
    width, height = ((high - low) * scale + 2.0 * _MARGIN).tolist()

    def pixels(line: Float) -> Float:
        x, y = (line - low).T * scale
        return np.stack((x + _MARGIN, height - _MARGIN - y), axis=1)

    body = [*_areas(shapes, pixels), *_marks(model, fitting, pixels), *_lines(model, roads, pixels)]
    if fitting is not None:
        key = f"green: the scenario fits ({len(fitting) + len(roads)})"
        body.append(element("text", key, class_="key", x=12, y=18))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'role="img" aria-label="Map with its places"><style>{_STYLE}</style>'
        f"{''.join(body)}</svg>\n"
    )


def _areas(shapes: list[tuple[str, Float]], pixels: _Pixels) -> Iterator[str]:
    for kind, line in sorted(shapes, key=lambda shape: shape[0] in ("driving", "junction")):
        name = "area" if kind in ("driving", "junction") else "beside"
        yield element("polygon", class_=name, points=points_of(pixels(line).tolist()))


def _marks(model: OpenDrive, fitting: Collection[str] | None, pixels: _Pixels) -> Iterator[str]:
    """Yield a ring with the id of each junction, in the middle of where its roads end."""
    for junction in model.junctions:
        ends = [
            points(road, np.array([0.0 if end == "start" else road.length]), np.zeros(1))[0]
            for road, end in road_ends(model, junction)
        ]
        if not ends:
            continue
        ((x, y),) = pixels(np.mean(ends, axis=0, keepdims=True)).tolist()
        name = "fits" if fitting is not None and junction.id in fitting else "ring"
        radius = 8.0 + 4.0 * len(junction.id)
        yield element("ellipse", class_=name, cx=x, cy=y, rx=radius, ry=12)
        yield element("text", junction.id, x=x, y=y)


def _lines(model: OpenDrive, stretches: Mapping[str, str], pixels: _Pixels) -> Iterator[str]:
    """Yield the roads that stretches begin on as lines, with the stretches' ids."""
    names: dict[str, list[str]] = {}
    for place, road_id in stretches.items():
        names.setdefault(road_id, []).append(place)
    for road_id, places in names.items():
        road = model.road(road_id)
        s = np.linspace(0.0, road.length, 2 + int(road.length / _STEP))
        line = pixels(points(road, s, np.zeros(len(s))))
        x, y = line[len(line) // 2].tolist()
        text = ", ".join(places)
        yield element("polyline", class_="road", points=points_of(line.tolist()))
        yield element(
            "rect",
            class_="fits",
            x=x - 4 * len(text) - 6,
            y=y - 11,
            width=8 * len(text) + 12,
            height=22,
            rx=11,
        )
        yield element("text", text, x=x, y=y)
