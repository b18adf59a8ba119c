"""Units in formulas: metres are not compared with seconds."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from bridgegen.base.units import WRITTEN

if TYPE_CHECKING:
    from bridgegen.scenario.stl.formula import Part, Reading


@dataclass(frozen=True)
class Dimension:
    """Exponents of the units of a quantity; an angle, a count and a share have none.

    Attributes:
        metre: exponent of m.
        second: exponent of s.
        kilogram: exponent of kg.
    """

    metre: int = 0
    second: int = 0
    kilogram: int = 0

    def __mul__(self, other: "Dimension") -> "Dimension":
        return Dimension(
            self.metre + other.metre,
            self.second + other.second,
            self.kilogram + other.kilogram,
        )

    def __truediv__(self, other: "Dimension") -> "Dimension":
        return Dimension(
            self.metre - other.metre,
            self.second - other.second,
            self.kilogram - other.kilogram,
        )

    def __str__(self) -> str:
        """The unit, "m/s²" say; "1" without one."""
        powers = (("m", self.metre), ("s", self.second), ("kg", self.kilogram))
        above = [_power(unit, n) for unit, n in powers if n > 0]
        below = [_power(unit, -n) for unit, n in powers if n < 0]
        return "/".join([" ".join(above) or "1", *below])


_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")

NONE = Dimension()

_DIMENSIONS = {
    "m": Dimension(1),
    "s": Dimension(0, 1),
    "m/s": Dimension(1, -1),
    "m/s²": Dimension(1, -2),
    "m/s³": Dimension(1, -3),
    "1/m": Dimension(-1),
    "kg": Dimension(0, 0, 1),
    "rad": NONE,
    "deg": NONE,
    "rad/s": Dimension(0, -1),
    "deg/s": Dimension(0, -1),
    "1/s": Dimension(0, -1),
    "1": NONE,
    "count": NONE,
}

_IN_RADIANS = {"deg", "deg/s"}
"""Units of parameters that formulas take in radians."""

SYMBOLS = {
    symbol: (unit, float(factor) * (math.pi / 180.0 if unit in _IN_RADIANS else 1.0))
    for unit in ("m", "m/s", "m/s²", "s", "deg", "deg/s", "kg", "1/m", "1")
    for symbol, (factor, _) in WRITTEN[unit].items()
} | {"rad": ("rad", 1.0), "rad/s": ("rad/s", 1.0), "m/s³": ("m/s³", 1.0), "m/s^3": ("m/s³", 1.0)}
"""Units that may stand behind a number, by symbol: the unit it is converted to, and the factor."""


def _power(unit: str, exponent: int) -> str:
    return unit if exponent == 1 else unit + str(exponent).translate(_SUPERSCRIPTS)


def dimension_of_unit(unit: str) -> Dimension | None:
    """Return the dimension of a unit of a metric; None if it is not known here."""
    return _DIMENSIONS.get(unit)


def in_si(number: str, symbol: str) -> tuple[float, Dimension]:
    """Return a number with a unit in SI units, and its dimension.

    Args:
        number: as written.
        symbol: a key of SYMBOLS.
    """
    unit, _ = SYMBOLS[symbol]
    exact = WRITTEN.get(unit, {}).get(symbol, (Fraction(1), Fraction(0)))[0]
    value = float(Fraction(number) * exact)
    return math.radians(value) if unit in _IN_RADIANS else value, _DIMENSIONS[unit]


def check_units(
    formula: "Part", dimension_of: "Callable[[Reading], Dimension | None]"
) -> tuple[list[str], Dimension | None]:
    """Check that only quantities of one dimension are added and compared.

    Args:
        formula: or a term.
        dimension_of: the dimension of what is read; None: unknown, which fits all.

    Returns:
        What is wrong, a sentence each, and the dimension: of a term its own; of a formula that of
        its margin; None where it is a number without a unit, unknown, or a mixture.
    """
    from bridgegen.scenario.stl import formula as f

    if isinstance(formula, f.Constant):
        return [], formula.dimension
    if isinstance(formula, f.Reading):
        return [], dimension_of(formula)
    found = [check_units(part, dimension_of) for part in f.parts(formula)]
    problems = [problem for some, _ in found for problem in some]
    dimensions = [dimension for _, dimension in found]
    if isinstance(formula, f.Arithmetic) and formula.sign in "*/":
        left, right = dimensions
        if left is None and right is None:
            return problems, None
        left, right = left or NONE, right or NONE
        return problems, left * right if formula.sign == "*" else left / right
    known = [dimension for dimension in dimensions if dimension is not None]
    if isinstance(formula, f.Arithmetic | f.Function | f.Comparison) and len({*known}) > 1:
        what = "compared" if isinstance(formula, f.Comparison) else "combined"
        units = " and ".join(f"[{dimension}]" for dimension in dict.fromkeys(known))
        problems.append(f"quantities of different units cannot be {what}: {units}")
    if isinstance(formula, f.Junction | f.Until) and len({*known}) > 1:
        return problems, None
    return problems, known[0] if known else None
