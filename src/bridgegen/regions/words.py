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
    return [
        _condition(
            name,
            _unit(space, name),
            float(box.low[k]) if box.low[k] > outer.low[k] else None,
            float(box.high[k]) if box.high[k] < outer.high[k] else None,
        )
        for k, name in enumerate(space.variables)
        if box.narrows(outer)[k]
    ]


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
        f"{where}, {share} of the random scenarios of {space.scenario.name} are critical for "
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


def _condition(name: str, unit: str, low: float | None, high: float | None) -> str:
    """Return the condition on one parameter; None leaves a side as wide as it is."""
    if low is not None and low == high:
        return f"{name} = {number(low)}{unit}"
    if low is not None and high is not None:
        return f"{name} in {number(low)} .. {number(high)}{unit}"
    sign, edge = ("≥", low) if low is not None else ("≤", high)
    return f"{name} {sign} {number(edge)}{unit}" if edge is not None else name


def _unit(space: SearchSpace, name: str) -> str:
    unit = space.scenario.parameters[name].unit
    return "" if unit in _UNITLESS else f" {unit}"
