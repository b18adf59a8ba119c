"""Numbers as people read them."""

from math import isinf, isnan

from bridgegen.base.statistics import Quartiles


def number(value: float, digits: int) -> str:
    """Return a value with its digits; "–" where there is none, "never" for +inf."""
    if isnan(value):
        return "–"
    if isinf(value):
        return "never"
    text = f"{value:,.{digits}f}"
    if not text.strip("-0.,"):
        text = text.removeprefix("-")  # no −0.00
    return text.replace("-", "−")


def spread(quartiles: Quartiles, digits: int, *, several: bool) -> str:
    """Return a median, and the quartiles where there are several values."""
    middle = number(quartiles.median, digits)
    if not several or isnan(quartiles.median) or isinf(quartiles.low):
        return middle
    return f"{middle} ({number(quartiles.low, digits)} to {number(quartiles.high, digits)})"


def share(part: int, whole: int) -> str:
    """Return how many of how many, in percent; "–" of none."""
    return f"{100.0 * part / whole:.0f} %" if whole else "–"
