"""Boxes as people say them."""

from bridgegen.odd.space import SearchSpace
from bridgegen.regions.box import Box, whole
from bridgegen.regions.evidence import Evidence

ANYWHERE = "anywhere"
_UNITLESS = ("1", "count", "?")


def conditions(box: Box, space: SearchSpace) -> list[str]:
    """Return what a row must keep to lie in a box, one condition per parameter.

    The numbers are the box's own, to the last bit.
    """
    outer = whole(space)
    found = []
    for k in box.narrows(outer).nonzero()[0].tolist():
        low, high = float(box.low[k]), float(box.high[k])
        name = space.variables[k]
        text = _range(low, high, low > float(outer.low[k]), high < float(outer.high[k]))
        found.append(f"{name} {text}{_unit(space, name)}")
    return found


def rule(box: Box, space: SearchSpace) -> str:
    """Return all conditions of a box in one line."""
    return " and ".join(conditions(box, space)) or ANYWHERE


def sentence(box: Box, space: SearchSpace, driver: str, fresh: Evidence) -> str:
    """Return what is known of a box, in one sentence.

    Args:
        box: a region.
        space: what is searched.
        driver: the ego's.
        fresh: what random scenarios in the box came to.
    """
    text = rule(box, space)
    where = "Anywhere in its space" if text == ANYWHERE else f"Where {text}"
    low, high = fresh.interval
    share = "an unknown share" if fresh.share is None else percent(fresh.share)
    return (
        f"{where}, {share} of the random scenarios of {space.name} are critical for "
        f"{driver} ({fresh.critical} of {fresh.rows} that were simulated; {percent(low)} to "
        f"{percent(high)} with 95 % confidence)."
    )


def percent(share: float) -> str:
    """Return a share in whole per cent, or as it takes to tell it from none and from all."""
    if 0.0 < share < 0.0995:
        return f"{100.0 * share:.2g} %"
    if 0.995 <= share < 1.0:
        return f"{min(100.0 * share, 99.9):.1f} %"
    return f"{100.0 * share:.0f} %"


def number(value: float) -> str:
    """Return the shortest text that is read as the same float64."""
    return repr(value).removesuffix(".0")


def _range(low: float, high: float, low_counts: bool, high_counts: bool) -> str:
    """Return a range as read; an end that does not count excludes nothing."""
    if low == high:
        return f"= {number(low)}"
    if low_counts and high_counts:
        return f"in {number(low)} .. {number(high)}"
    return f"≥ {number(low)}" if low_counts else f"≤ {number(high)}"


def _unit(space: SearchSpace, name: str) -> str:
    unit = space.parameters[name].unit
    return "" if unit in _UNITLESS else f" {unit}"
