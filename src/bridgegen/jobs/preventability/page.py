"""A map on one self-contained page without scripts: counts, pictures, and how it was made."""

import base64
import io
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from bridgegen.base.arrays import Float
from bridgegen.base.units import percent
from bridgegen.jobs.preventability.classes import CellClass, Codes
from bridgegen.jobs.preventability.grid import Grid
from bridgegen.jobs.preventability.result import PreventabilityMap
from bridgegen.pages import charts, templates
from bridgegen.pages.templates import counted
from bridgegen.pages.thumbnails import drawn

if TYPE_CHECKING:
    from bridgegen.jobs.preventability.pictures import CellPicture

COLOURS = {
    CellClass.AVOIDED: "#56b4e9",
    CellClass.PREVENTABLE: "#d55e00",
    CellClass.UNPREVENTABLE: "#8a8a8a",
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


WIDE, BESIDE = (640.0, 420.0), (380.0, 270.0)
SMALL = (254.0, 190.0)
"""Sizes of a picture that is alone in its row, of each of up to three, and of more [pixels]."""


def write_page(
    path: Path, result: PreventabilityMap, pictures: Sequence["CellPicture"] = ()
) -> None:
    """Write the page, whole or not at all.

    Args:
        path: of it.
        result: the map.
        pictures: cells that are played.

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
        blocks=[_block(result, at, pictures) for at in shown],
        played=[
            (
                number,
                drawn(picture.shown, f"t{number}"),
                COLOURS[picture.kind],
                f"{picture.kind.label}, {picture.place}",
                f"{picture.shown.caption.removesuffix('.').partition(';')[0]}.",
                picture.driver,
                ", ".join(_value(result, axis, i) for axis, i in enumerate(picture.cell)),
            )
            for number, picture in enumerate(pictures, 1)
        ],
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
        hits = driver["preventable"] + driver["unpreventable"]
        words = f"{driver['driver']} avoids {driver['avoided']:,} of {counted(judged, 'cell')}"
        if hits:
            verb = "was" if driver["preventable"] == 1 else "were"
            words += f"; {driver['preventable']:,} of its {counted(hits, 'collision')} {verb}"
            words += " preventable"
        sentences.append(f"{words}.")
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


def drawn_columns(grid: Grid) -> list[int]:
    """Return the numbers of the third axis' values that are drawn; none without such an axis."""
    return _spread(grid.shape[2], PANELS) if len(grid.shape) > 2 else []


def _block(
    result: PreventabilityMap, further: tuple[int, ...], pictures: Sequence["CellPicture"]
) -> dict[str, object]:
    """Return the pictures of one block: a row a driver, a column a value of the third axis."""
    grid, columns = result.grid, drawn_columns(result.grid)
    plane = (slice(None),) * min(len(grid.shape), 2)
    places: list[tuple[int, ...]] = [(column, *further) for column in columns] or [()]
    return {
        "label": ", ".join(_value(result, 3 + k, i) for k, i in enumerate(further)),
        "columns": [_value(result, 2, column) for column in columns],
        "all": grid.shape[2] if columns else 0,
        "third": grid.names[2] if columns else "",
        "rows": [
            (
                name,
                [
                    _picture(
                        result,
                        result.classes[name][plane + at],
                        name,
                        {
                            number: picture.cell[:2]
                            for number, picture in enumerate(pictures, 1)
                            if (picture.driver, picture.cell[2:]) == (name, at)
                        },
                        WIDE if len(places) == 1 else BESIDE if len(places) <= 3 else SMALL,
                    )
                    for at in places
                ],
            )
            for name in result.drivers
        ],
    }


def _value(result: PreventabilityMap, axis: int, i: int) -> str:
    grid = result.grid
    return f"{grid.names[axis]} = {grid.values[axis][i]:.4g} {grid.units[axis]}"


def _picture(
    result: PreventabilityMap,
    codes: Codes,
    driver: str,
    marks: Mapping[int, tuple[int, ...]],
    size: tuple[float, float],
) -> str:
    """Return one picture with its axes: the first across, the second, if there is one, up.

    Args:
        result: the map.
        codes: of its cells.
        driver: under test.
        marks: the cells that are played, by their numbers; these lead there.
        size: of the picture [pixels].
    """
    grid = result.grid
    flat = codes[:, np.newaxis] if codes.ndim == 1 else codes
    (x, x_label), *second = (
        ((float(values[0]), float(values[-1])), name if unit == "1" else f"{name} [{unit}]")
        for name, unit, values in zip(grid.names, grid.units, grid.values, strict=True)
    )
    y, y_label = second[0] if second else ((0.0, 1.0), "")
    plot = charts.Plot(size, x, y, (46.0, 8.0, 6.0, 38.0))
    plot.image(data_uri(flat.T[::-1]))
    plot.frame(x_label, y_label, 6)
    for number, cell in marks.items():
        i, k = (*cell, 0)[:2]
        # The picture's cells share its width evenly.
        u = plot.left + (i + 0.5) / flat.shape[0] * (plot.right - plot.left)
        v = plot.base - (k + 0.5) / flat.shape[1] * (plot.base - plot.top)
        kind = CellClass(int(flat[i, k])).label
        title = charts.element("title", f"{number}: {kind}")
        dot = charts.element("circle", cx=u, cy=v, r=9.0)
        text = charts.element("text", number, x=u, y=v + 4.0, text_anchor="middle")
        plot.add("a", title, dot, text, class_="mark", href=f"#cell-{number}")
    return plot.svg(f"{driver}, {grid.names[0]} across")


def _spread(n: int, most: int) -> list[int]:
    """Return numbers below n, all or ``most`` of them, evenly, both ends included."""
    return sorted({int(i) for i in np.round(np.linspace(0, n - 1, min(n, most)))})
