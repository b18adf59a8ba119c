"""SVG elements, drawn with the same calls as Pillow's ``ImageDraw``."""

import html
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

Point = tuple[float, float]

ANCHORS = {"m": "middle", "l": "start", "r": "end"}


class SvgDraw:
    """Collects elements; a part of ``PIL.ImageDraw.ImageDraw``'s methods, by the same names.

    Args:
        size: width and height in the units of the points.
        ground: colour behind everything.
    """

    def __init__(self, size: tuple[int, int], ground: str) -> None:
        self._size = size
        self._parts = [f'<rect width="{size[0]}" height="{size[1]}" fill="{ground}"/>']

    def polygon(
        self,
        xy: Sequence[Point],
        fill: str | None = None,
        outline: str | None = None,
        width: int = 1,
    ) -> None:
        """Draw a closed shape."""
        # Between two areas of one colour, browsers show a hairline unless the areas have edges.
        self._add("polygon", {"points": _points(xy)}, fill, outline or fill, width)

    def line(
        self, xy: Sequence[Point], fill: str | None = None, width: int = 1, joint: str | None = None
    ) -> None:
        """Draw a line; a joint "curve" is round."""
        given = {"points": _points(xy)} | ({"stroke-linejoin": "round"} if joint else {})
        self._add("polyline", given, None, fill, width)

    def dashes(self, xy: Sequence[Point], fill: str, width: int, dash: float) -> None:
        """Draw a line of dashes with gaps of the same length; `birdseye.Pixels` does so, too."""
        given = {"points": _points(xy), "stroke-dasharray": _number(dash)}
        self._add("polyline", given, None, fill, width)

    def circle(
        self,
        xy: Point,
        radius: float,
        fill: str | None = None,
        outline: str | None = None,
        width: int = 1,
    ) -> None:
        """Draw a circle about a point."""
        given = {"cx": _number(xy[0]), "cy": _number(xy[1]), "r": _number(radius)}
        self._add("circle", given, fill, outline, width)

    def rounded_rectangle(
        self,
        xy: tuple[float, float, float, float],
        radius: float = 0.0,
        fill: str | None = None,
        outline: str | None = None,
        width: int = 1,
    ) -> None:
        """Draw a box with round corners."""
        x0, y0, x1, y1 = xy
        given = {"x": x0, "y": y0, "width": x1 - x0, "height": y1 - y0, "rx": radius}
        self._add("rect", {k: _number(v) for k, v in given.items()}, fill, outline, width)

    def text(self, xy: Point, text: str, fill: str, font: Any, anchor: str = "la") -> None:
        """Write a text; the anchor as Pillow has it: l, m, r across and m, b upwards."""
        size = float(font.size)
        y = xy[1] + {"m": 0.36, "b": -0.2, "a": 0.9}[anchor[1]] * size
        given = {
            "x": _number(xy[0]),
            "y": _number(y),
            "text-anchor": ANCHORS[anchor[0]],
            "font-size": _number(size),
            "fill": fill,
        }
        self._parts.append(f"<text {_attributes(given)}>{html.escape(text)}</text>")

    def add(self, part: Markup) -> None:
        """Add an element that is made elsewhere."""
        self._parts.append(part)

    def carry(self, animation: Markup) -> None:
        """Put what was drawn so far, but the ground, into a group that an animation moves."""
        self._parts[1:] = [f"<g>{animation}{self.inside()}</g>"]

    def inside(self) -> Markup:
        """Return what was drawn, without the ground."""
        return Markup("".join(self._parts[1:]))

    def svg(
        self,
        size: tuple[int, int] | None = None,
        title: str = "",
        *,
        is_file: bool = True,
        **more: str,
    ) -> str:
        """Return the whole picture.

        Args:
            size: its width and height [pixels]; by default as large as where it is shown.
            title: what it says to those who do not see it.
            is_file: whether it may stand alone; in a page, it needs no namespace.
            more: further attributes of it, or others in place of its own.
        """
        given = {"class": "birdseye", "role": "img"}
        given |= {"xmlns": "http://www.w3.org/2000/svg"} if is_file else {}
        given |= {"viewBox": f"0 0 {self._size[0]} {self._size[1]}", "font-weight": "700"}
        given |= {"font-family": "DejaVu Sans, Verdana, sans-serif"}
        if size:
            given |= {"width": str(size[0]), "height": str(size[1])}
        given |= more
        named = [f"<title>{html.escape(title)}</title>"] if title else []
        return "\n".join([f"<svg {_attributes(given)}>", *named, *self._parts, "</svg>\n"])

    def _add(
        self, name: str, given: dict[str, str], fill: str | None, stroke: str | None, width: int
    ) -> None:
        given = {**given, "fill": fill or "none"}
        if stroke:
            given |= {"stroke": stroke, "stroke-width": str(width)}
        self._parts.append(f"<{name} {_attributes(given)}/>")


def _points(xy: Sequence[Point]) -> str:
    return " ".join(f"{_number(x)},{_number(y)}" for x, y in xy)


def _number(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")


def _attributes(given: dict[str, str]) -> str:
    return " ".join(f'{name}="{html.escape(value)}"' for name, value in given.items())
