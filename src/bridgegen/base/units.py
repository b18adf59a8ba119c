"""Numbers with a unit, as people write them: ``90 km/h``, ``5 cm``, ``1.5 min``, ``80 %``.

They become numbers in the units of `bridgegen.scenario.language.parameters.UNITS`, rounded once.
"""

import math
import re
from collections.abc import Mapping
from difflib import get_close_matches
from fractions import Fraction
from types import MappingProxyType

_INCH = Fraction(254, 10_000)
_TURN = Fraction(math.degrees(1.0))

WRITTEN: Mapping[str, Mapping[str, tuple[Fraction, Fraction]]] = MappingProxyType(
    {
        unit: {symbol: (Fraction(factor), Fraction(offset)) for symbol, factor, offset in symbols}
        for unit, symbols in {
            "m": (
                ("m", 1, 0),
                ("mm", "0.001", 0),
                ("cm", "0.01", 0),
                ("km", 1000, 0),
                ("ft", 12 * _INCH, 0),
            ),
            "m/s": (
                ("m/s", 1, 0),
                ("km/h", Fraction(5, 18), 0),
                ("mph", 63360 * _INCH / 3600, 0),
            ),
            "m/s²": (("m/s²", 1, 0), ("m/s^2", 1, 0), ("m/s2", 1, 0), ("g", "9.80665", 0)),
            "s": (("s", 1, 0), ("ms", "0.001", 0), ("min", 60, 0), ("h", 3600, 0)),
            "deg": (("deg", 1, 0), ("°", 1, 0), ("rad", _TURN, 0)),
            "deg/s": (("deg/s", 1, 0), ("°/s", 1, 0), ("rad/s", _TURN, 0)),
            "%": (("%", 1, 0),),
            "1": (("%", "0.01", 0),),
            "mm/h": (("mm/h", 1, 0),),
            "kg": (("kg", 1, 0), ("t", 1000, 0)),
            "lx": (("lx", 1, 0), ("klx", 1000, 0)),
            "°C": (
                ("°C", 1, 0),
                ("K", 1, "-273.15"),
                ("°F", Fraction(5, 9), Fraction(-160, 9)),
            ),
            "1/m": (("1/m", 1, 0), ("1/km", "0.001", 0)),
        }.items()
    }
)
"""Units that a number may be written in, with factor and offset, by unit of the parameter."""

_SYMBOLS = sorted({symbol for symbols in WRITTEN.values() for symbol in symbols})
_NUMBER = r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]{1,2})?"
_UNIT = r"[A-Za-z°%][\w°%/²^]{0,15}"
_FORM = re.compile(rf"\s*({_NUMBER})(?:\s*({_UNIT})|\s+(1/k?m))\s*")
PATTERN = rf"^{_NUMBER} ?({'|'.join(re.escape(name) for name in _SYMBOLS)})$"
"""Regular expression of a number with a unit, for JSON Schema."""


def has_unit(text: str) -> bool:
    """Return whether a text is a number followed by something else."""
    return _FORM.fullmatch(text) is not None


def in_unit(text: str, unit: str) -> float:
    """Return a number that is written with a unit, in the unit of a parameter.

    Args:
        text: a number and a unit, ``90 km/h`` say.
        unit: one of `bridgegen.scenario.language.parameters.UNITS`.

    Raises:
        ValueError: it is no such number, or in a unit of another dimension; says the rule, as the
            end of a sentence that names the parameter.
    """
    found = _FORM.fullmatch(text)
    symbol = (found[2] or found[3]) if found else ""
    known = WRITTEN.get(unit, {})
    if found is None or symbol not in known:
        plain = f"in {unit}" if unit in known else "without a unit"
        choice = ", ".join(known)
        if symbol not in _SYMBOLS and (near := get_close_matches(symbol, known, 1)):
            choice += f"; did you mean '{near[0]}'?"
        rule = f"must be a number {plain}" + (f", or one with a unit ({choice})" if known else "")
        raise ValueError(rule)
    factor, offset = known[symbol]
    return float(Fraction(found[1]) * factor + offset)


def percent(share: float) -> str:
    """Return a share in per cent, with enough digits to differ from 0 % and 100 %."""
    if 0.0 < share < 0.0995:
        return f"{100.0 * share:.2g} %"
    if 0.995 <= share < 1.0:
        return f"{min(100.0 * share, 99.9):.1f} %"
    return f"{100.0 * share:.0f} %"
