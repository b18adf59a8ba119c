"""A map on one self-contained page without scripts: counts, pictures, and how it was made."""

import base64
import re
import struct
import zlib
from collections.abc import Iterator
from html import escape
from importlib.metadata import version
from importlib.resources import files
from itertools import product
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.jobs.preventability.classes import CellClass, Codes
from bridgegen.jobs.preventability.result import PreventabilityMap

# --- Classes of cells as pictures: a pixel a cell, in a PNG with a palette ---


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
    """Return a picture.

    Args:
        codes: ``(height, width)``, a `CellClass` each, the uppermost row first.
    """
    height, width = codes.shape
    palette = b"".join(bytes.fromhex(COLOURS[one][1:]) for one in CellClass)
    lines = b"".join(b"\0" + row.astype("u1").tobytes() for row in codes)
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(kind, data)
        for kind, data in (
            (b"IHDR", header),
            (b"PLTE", palette),
            (b"IDAT", zlib.compress(lines, 9)),
            (b"IEND", b""),
        )
    )


def data_uri(codes: Codes) -> str:
    """Return a picture as the address of itself; see `png`."""
    return "data:image/png;base64," + base64.b64encode(png(codes)).decode("ascii")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


PANELS = 8
"""Values of the third axis that are drawn beside each other at most."""
BLOCKS = 12
"""Combinations of values of further axes that are drawn at most."""

_WIDTH, _HEIGHT, _LEFT, _BELOW = 200.0, 150.0, 46.0, 34.0  # pixels of a picture and its margins


def write_page(path: Path, result: PreventabilityMap) -> None:
    """Write the page, whole or not at all.

    Raises:
        StorageError: it cannot be written.
    """
    fill = {
        "title": escape(f"{result.scenario.name}: which collisions are preventable"),
        "css": _own("page.css"),
        "facts": "".join(f"<li>{escape(one)}</li>" for one in _facts(result)),
        "lead": escape(_lead(result)),
        "table": _table(result),
        "shares": "Shares are those of the cells that apply and have a result.",
        "legend": "".join(_legend(result)),
        "maps": "\n".join(_maps(result)),
        "method": _method(result),
        "command": escape(result.command),
        "version": escape(version("bridgegen")),
    }
    parts = re.split(r"\{\{(\w+)\}\}", _own("page.html"))
    text = "".join(fill[part] if i % 2 else part for i, part in enumerate(parts))
    write_whole(path, [text.encode("utf-8", "replace")])


def _facts(result: PreventabilityMap) -> Iterator[str]:
    grid = result.grid
    yield result.scenario.title
    yield f"{grid.cells:,} cells"
    for name, unit, values in zip(grid.names, grid.units, grid.values, strict=True):
        yield f"{name}: {_span(values, unit)}"
    space = grid.space
    held = {*space.variables, *space.fixed} - set(grid.names)
    for name, one in space.parameters.items():
        if name in held:
            value = one.kind.text(space.defaults[name], "{:.4g}".format)
            yield f"{name} = {value}{'' if one.unit == '1' else f' {one.unit}'}"
    yield f"preventable by: {', '.join(result.models)}"


def _span(values: Float, unit: str) -> str:
    unit = "" if unit == "1" else f" {unit}"
    if len(values) == 1:
        return f"{values[0]:.4g}{unit}"
    return f"{values[0]:.4g} to {values[-1]:.4g}{unit}, {len(values)} values"


def _lead(result: PreventabilityMap) -> str:
    figures = [result.figures(name) for name in result.drivers]
    sentences = []
    for one in figures:
        judged = sum(one[name.name.lower()] for name in CellClass if name < 3)
        sentences.append(
            f"{one['driver']} avoids {_share(one['avoided'], judged)} of {judged:,} cells; "
            f"{_share(one['preventable'], judged)} end in a collision that a model avoids."
        )
    return " ".join(sentences)


def _share(count: int, of: int) -> str:
    return f"{count / of:.2%}" if of else "none"


def _table(result: PreventabilityMap) -> str:
    head = "".join(f"<th>{escape(one.label)}</th>" for one in CellClass)
    lines = []
    for name in result.drivers:
        counts = result.counts(name)
        judged = sum(counts[one] for one in CellClass if one < CellClass.NOT_APPLICABLE)
        cells = "".join(
            f"<td>{counts[one]:,}"
            + (f" <small>{_share(counts[one], judged)}</small>" if one < 3 and judged else "")
            + "</td>"
            for one in CellClass
        )
        lines.append(f"<tr><th>{escape(name)}</th>{cells}</tr>")
    return (
        f"<table><thead><tr><th>driver</th>{head}</tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table>"
    )


def _legend(result: PreventabilityMap) -> Iterator[str]:
    there = set(np.unique(np.concatenate([one.ravel() for one in result.classes.values()])))
    for one in CellClass:
        if one in there:
            swatch = f'<span class="key" style="background:{COLOURS[one]}"></span>'
            yield f"<li>{swatch}{escape(one.label)}</li>"


def _maps(result: PreventabilityMap) -> Iterator[str]:
    """Yield a block of pictures for each combination of values of the fourth and further axes."""
    grid = result.grid
    further = [range(n) for n in grid.shape[3:]]
    combinations = list(product(*further))
    shown = [combinations[i] for i in _spread(len(combinations), BLOCKS)]
    if len(shown) < len(combinations):
        yield (
            f'<p class="muted">{len(shown)} of {len(combinations)} combinations of further axes '
            "are drawn; the files hold all.</p>"
        )
    for at in shown:
        label = ", ".join(
            f"{grid.names[3 + k]} = {grid.values[3 + k][i]:.4g} {grid.units[3 + k]}"
            for k, i in enumerate(at)
        )
        yield f"<h3>{escape(label)}</h3>" if label else ""
        yield f'<div class="card">{_block(result, at)}</div>'


def _block(result: PreventabilityMap, further: tuple[int, ...]) -> str:
    """Return the pictures of one block: a row a driver, a column a value of the third axis."""
    grid = result.grid
    columns = _spread(grid.shape[2], PANELS) if len(grid.shape) > 2 else [None]
    style = f"grid-template-columns: 130px repeat({len(columns)}, minmax(150px, 260px))"
    parts = [f'<div class="panels" style="{style}">']
    if len(grid.shape) > 2:
        parts.append("<div></div>")
        for column in columns:
            text = f"{grid.names[2]} = {grid.values[2][column]:.4g} {grid.units[2]}"
            parts.append(f'<div class="head">{escape(text)}</div>')
    for name in result.drivers:
        label = escape(name).replace(":", ":<wbr>").replace("/", "/<wbr>")
        parts.append(f'<div class="driver">{label}</div>')
        for column in columns:
            place = () if column is None else (column, *further)
            codes = result.classes[name][(slice(None),) * min(len(grid.shape), 2) + place]
            parts.append(_picture(result, codes, name))
    parts.append("</div>")
    if len(columns) < (grid.shape[2] if len(grid.shape) > 2 else 1):
        parts.append(
            f'<p class="muted">{len(columns)} of {grid.shape[2]} values of '
            f"{escape(grid.names[2])} are drawn; the files hold all.</p>"
        )
    return "".join(parts)


def _picture(result: PreventabilityMap, codes: Codes, driver: str) -> str:
    """Return one picture with its axes: the first across, the second, if there is one, up."""
    grid = result.grid
    flat = codes[:, np.newaxis] if codes.ndim == 1 else codes
    upright = flat.T[::-1]
    x_name, x_unit, xs = grid.names[0], grid.units[0], grid.values[0]
    parts = [
        f'<svg viewBox="0 0 {_LEFT + _WIDTH + 8:g} {_HEIGHT + _BELOW + 6:g}" role="img" '
        f'aria-label="{escape(driver)}, {escape(x_name)} across">',
        f'<image x="{_LEFT:g}" y="6" width="{_WIDTH:g}" height="{_HEIGHT:g}" '
        f'preserveAspectRatio="none" href="{data_uri(upright)}"/>',
        f'<rect class="frame" x="{_LEFT:g}" y="6" width="{_WIDTH:g}" height="{_HEIGHT:g}"/>',
    ]
    for share, anchor in ((0.0, "start"), (0.5, "middle"), (1.0, "end")):
        value = xs[0] + share * (xs[-1] - xs[0])
        parts.append(_text(_LEFT + share * _WIDTH, _HEIGHT + 19, f"{value:.3g}", anchor))
    parts.append(_text(_LEFT + 0.5 * _WIDTH, _HEIGHT + 33, _axis(x_name, x_unit), "middle"))
    if codes.ndim > 1:
        ys = grid.values[1]
        for share, drop in ((0.0, 0.0), (0.5, 4.0), (1.0, 8.0)):
            value = ys[0] + share * (ys[-1] - ys[0])
            y = 6 + (1.0 - share) * _HEIGHT + drop
            parts.append(_text(_LEFT - 4, y, f"{value:.3g}", "end"))
        middle = 6 + 0.5 * _HEIGHT
        label = escape(_axis(grid.names[1], grid.units[1]))
        parts.append(
            f'<text x="9" y="{middle:g}" text-anchor="middle" '
            f'transform="rotate(-90 9 {middle:g})">{label}</text>'
        )
    parts.append("</svg>")
    return "".join(parts)


def _axis(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}">{escape(text)}</text>'


def _spread(n: int, most: int) -> list[int]:
    """Return numbers below n, all or ``most`` of them, evenly, both ends included."""
    return sorted({int(i) for i in np.round(np.linspace(0, n - 1, min(n, most)))})


def _method(result: PreventabilityMap) -> str:
    return (
        "<p>Each cell is one concrete scenario, simulated with each driver. A collision counts "
        "whoever is responsible. Where a driver collides, the models "
        f"({escape(', '.join(result.models))}) drive in the same scenario: the collision is "
        "preventable if one of them avoids it. A cell does not apply where its values break a "
        "constraint of the scenario, or where its traffic is implausible.</p>"
        "<p>The driver un-r157 is the competent and careful human driver of UN R157, annex 3, fsm "
        "the fuzzy safety model. Here bodies point where they go and others may turn; the "
        "regulation's cars never do, so cells beside its boundary may differ.</p>"
    )


def _own(name: str) -> str:
    return files("bridgegen.jobs.preventability").joinpath(name).read_text("utf-8")
