"""A map on one self-contained page without scripts: counts, pictures, and how it was made."""

import base64
import io
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image

from bridgegen.base.arrays import Float
from bridgegen.base.units import percent
from bridgegen.jobs.preventability.classes import CellClass, Codes
from bridgegen.jobs.preventability.result import PreventabilityMap
from bridgegen.pages import charts, templates

COLOURS = {
    CellClass.AVOIDED: "#56b4e9",
    CellClass.PREVENTABLE: "#d55e00",
    CellClass.UNPREVENTABLE: "#3d3d3d",
    CellClass.NOT_APPLICABLE: "#c9ced6",
    CellClass.NO_RESULT: "#cc79a7",
}
"""The colour of each class, distinct for the colour-blind and in grey.

Source: Okabe and Ito, Color Universal Design (2008); greys of our own.
"""


def png(codes: Codes) -> bytes:
    """Return a picture with a pixel for each cell.

    Args:
        codes: ``(height, width)``, a `CellClass` each, the uppermost row first.
    """
    # A palette: a byte a cell, and the same colours in the picture and in its legend.
    picture, out = Image.fromarray(codes.astype("u1"), "P"), io.BytesIO()
    picture.putpalette(b"".join(bytes.fromhex(COLOURS[class_][1:]) for class_ in CellClass))
    picture.save(out, "PNG")
    return out.getvalue()


def data_uri(codes: Codes) -> str:
    """Return a picture as the address of itself; see `png`."""
    return "data:image/png;base64," + base64.b64encode(png(codes)).decode("ascii")


PANELS = 8
"""Largest number of values of the third axis that are drawn beside each other."""
BLOCKS = 12
"""Largest number of combinations of values of further axes that are drawn."""


def write_page(path: Path, result: PreventabilityMap) -> None:
    """Write the page, whole or not at all.

    Raises:
        StorageError: it cannot be written.
    """
    combinations = [*product(*map(range, result.grid.shape[3:]))]
    shown = [combinations[i] for i in _spread(len(combinations), BLOCKS)]
    there = np.unique(np.concatenate([kind.ravel() for kind in result.classes.values()]))
    templates.write_page(
        path,
        "jobs/preventability/page.html",
        title=f"{result.scenario.name}: which collisions are preventable",
        facts=[*_facts(result)],
        verdict=templates.Banner(_lead(result)),
        classes=[class_.label for class_ in CellClass],
        counts=[[name, *_counts(result, name)] for name in result.drivers],
        legend=[(COLOURS[class_], class_.label) for class_ in CellClass if class_ in there],
        shown=len(shown),
        combinations=len(combinations),
        blocks=[_block(result, at) for at in shown],
        models=result.models,
        command=result.command,
    )


def _facts(result: PreventabilityMap) -> Iterator[str]:
    grid = result.grid
    yield result.scenario.title
    yield f"{grid.cells:,} cells"
    for name, unit, values in zip(grid.names, grid.units, grid.values, strict=True):
        yield f"{name}: {_span(values, unit)}"
    space = grid.space
    held = {*space.variables, *space.fixed} - set(grid.names)
    for name, parameter in space.parameters.items():
        if name in held:
            value = parameter.kind.text(space.defaults[name], "{:.4g}".format)
            yield f"{name} = {value}{'' if parameter.unit == '1' else f' {parameter.unit}'}"
    yield f"preventable by: {', '.join(result.models)}"


def _span(values: Float, unit: str) -> str:
    unit = "" if unit == "1" else f" {unit}"
    if len(values) == 1:
        return f"{values[0]:.4g}{unit}"
    return f"{values[0]:.4g} to {values[-1]:.4g}{unit}, {len(values)} values"


def _lead(result: PreventabilityMap) -> str:
    sentences = []
    for driver in map(result.figures, result.drivers):
        judged = sum(driver[name.name.lower()] for name in CellClass if name < 3)
        sentences.append(
            f"{driver['driver']} avoids {_share(driver['avoided'], judged)} of {judged:,} cells; "
            f"{_share(driver['preventable'], judged)} end in a collision that a model avoids."
        )
    return " ".join(sentences)


def _share(count: int, of: int) -> str:
    return f"{percent(count / of)}" if of else "none"


def _counts(result: PreventabilityMap, driver: str) -> Iterator[int | tuple[int, str]]:
    """Yield the cells of each class; with their share where cells apply and have a result."""
    counts = result.counts(driver)
    judged = sum(counts[class_] for class_ in CellClass if class_ < CellClass.NOT_APPLICABLE)
    for class_ in CellClass:
        applies = class_ < CellClass.NOT_APPLICABLE and judged
        yield (counts[class_], _share(counts[class_], judged)) if applies else counts[class_]


def _block(result: PreventabilityMap, further: tuple[int, ...]) -> dict[str, object]:
    """Return the pictures of one block: a row a driver, a column a value of the third axis."""
    grid = result.grid
    has_third, plane = len(grid.shape) > 2, (slice(None),) * min(len(grid.shape), 2)
    columns = _spread(grid.shape[2], PANELS) if has_third else []
    places: list[tuple[int, ...]] = [(column, *further) for column in columns] or [()]
    return {
        "label": ", ".join(_value(result, 3 + k, i) for k, i in enumerate(further)),
        "columns": [_value(result, 2, column) for column in columns],
        "all": grid.shape[2] if has_third else 0,
        "third": grid.names[2] if has_third else "",
        "rows": [
            (name, [_picture(result, result.classes[name][plane + at], name) for at in places])
            for name in result.drivers
        ],
    }


def _value(result: PreventabilityMap, axis: int, i: int) -> str:
    grid = result.grid
    return f"{grid.names[axis]} = {grid.values[axis][i]:.4g} {grid.units[axis]}"


def _picture(result: PreventabilityMap, codes: Codes, driver: str) -> str:
    """Return one picture with its axes: the first across, the second, if there is one, up."""
    grid = result.grid
    flat = codes[:, np.newaxis] if codes.ndim == 1 else codes
    (x, x_label), *second = (
        ((float(values[0]), float(values[-1])), name if unit == "1" else f"{name} [{unit}]")
        for name, unit, values in zip(grid.names, grid.units, grid.values, strict=True)
    )
    y, y_label = second[0] if second else ((0.0, 1.0), "")
    plot = charts.Plot((254.0, 190.0), x, y, (46.0, 8.0, 6.0, 38.0))
    plot.image(data_uri(flat.T[::-1]))
    plot.frame(x_label, y_label, 6)
    return plot.svg(f"{driver}, {grid.names[0]} across")


def _spread(n: int, most: int) -> list[int]:
    """Return numbers below n, all or ``most`` of them, evenly, both ends included."""
    return sorted({int(i) for i in np.round(np.linspace(0, n - 1, min(n, most)))})
