"""A road's reference line in the plane, and cubics along it, in OpenDRIVE's terms.

Values only; `geometry` evaluates them.
"""

# ruff: noqa: RUF009  (fields are declared through functions that call dataclasses.field)

from dataclasses import dataclass
from typing import ClassVar

from bridgegen.openx.opendrive.declaration import attribute, choice

LENGTH_LIMIT = 1e6
"""Largest length of a road [m]."""
CURVATURE_LIMIT = 1e4
"""Largest curvature of a road [1/m]."""
SHARP_CURVATURE = 10.0
"""Curvature above which a reader warns [1/m]: no vehicle turns on 0.1 m."""


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line."""

    TAG: ClassVar[str] = "line"


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc of constant curvature [1/m], positive to the left."""

    TAG: ClassVar[str] = "arc"
    curvature: float = attribute("curvature", unit="1/m", high=CURVATURE_LIMIT)


@dataclass(frozen=True, slots=True)
class Spiral:
    """A clothoid: the curvature [1/m] changes linearly along it."""

    TAG: ClassVar[str] = "spiral"
    curv_start: float = attribute("curvStart", unit="1/m", high=CURVATURE_LIMIT)
    curv_end: float = attribute("curvEnd", unit="1/m", high=CURVATURE_LIMIT)


@dataclass(frozen=True, slots=True)
class Poly3:
    """v = a + b·u + c·u² + d·u³ in the frame of the geometry's start."""

    TAG: ClassVar[str] = "poly3"
    a: float = attribute("a", unit="m")
    b: float = attribute("b")
    c: float = attribute("c", unit="1/m")
    d: float = attribute("d", unit="1/m²")


@dataclass(frozen=True, slots=True)
class ParamPoly3:
    """u(p) and v(p), two cubics in the frame of the geometry's start.

    p runs over [0, 1] (``normalized``) or [0, length] (``arcLength``).
    """

    TAG: ClassVar[str] = "paramPoly3"
    a_u: float = attribute("aU", unit="m")
    b_u: float = attribute("bU")
    c_u: float = attribute("cU")
    d_u: float = attribute("dU")
    a_v: float = attribute("aV", unit="m")
    b_v: float = attribute("bV")
    c_v: float = attribute("cV")
    d_v: float = attribute("dV")
    p_range: str = attribute("pRange", default="normalized", words=("arcLength", "normalized"))


@dataclass(frozen=True, slots=True)
class Geometry:
    """A piece of a road's reference line, from its start at ``s`` along the road."""

    s: float = attribute("s", unit="m", low=0.0)
    x: float = attribute("x", unit="m")
    y: float = attribute("y", unit="m")
    hdg: float = attribute("hdg", unit="rad", high=1e4)
    length: float = attribute("length", unit="m", low=0.0, high=LENGTH_LIMIT)
    shape: Line | Arc | Spiral | Poly3 | ParamPoly3 = choice()


@dataclass(frozen=True, slots=True)
class Cubic:
    """a + b·Δ + c·Δ² + d·Δ³ over the distance Δ from ``s``, until the next one's ``s``."""

    s: float = attribute("s", unit="m", low=0.0)
    a: float = attribute("a", unit="m")
    b: float = attribute("b")
    c: float = attribute("c", unit="1/m")
    d: float = attribute("d", unit="1/m²")
