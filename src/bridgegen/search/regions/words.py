"""Boxes in words."""

from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.regions.box import Box, whole
from bridgegen.search.regions.evidence import Evidence

ANYWHERE = "anywhere"
_UNITLESS = ("1", "count", "?")


def conditions(box: Box, space: SearchSpace) -> list[str]:
    """Return the conditions of a box, one per parameter.

    The numbers are those of the box, to the last bit.
    """
    outer = whole(space)
    found = []
    for k in box.narrows(outer).nonzero()[0].tolist():
        low, high = float(box.low[k]), float(box.high[k])
        name = space.variables[k]
        text = space.parameters[name].kind.range_text(
            low, high, number,
            low_counts=low > float(outer.low[k]), high_counts=high < float(outer.high[k]),
        )  # fmt: skip
        found.append(f"{name} {text}{_unit(space, name)}")
    return found


def rule(box: Box, space: SearchSpace) -> str:
    """Return all conditions of a box in one line."""
    return " and ".join(conditions(box, space)) or ANYWHERE


def sentence(box: Box, space: SearchSpace, driver: str, fresh: Evidence) -> str:
    """Return the evidence for a box in one sentence.

    Args:
        box: a region.
        space: the search space.
        driver: the ego's driver.
        fresh: the results of random scenarios in the box.
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
    """Return a share in per cent, with enough digits to differ from 0 % and 100 %."""
    if 0.0 < share < 0.0995:
        return f"{100.0 * share:.2g} %"
    if 0.995 <= share < 1.0:
        return f"{min(100.0 * share, 99.9):.1f} %"
    return f"{100.0 * share:.0f} %"


def number(value: float) -> str:
    """Return the shortest text that is parsed as the same float64."""
    return repr(value).removesuffix(".0")


def _unit(space: SearchSpace, name: str) -> str:
    unit = space.parameters[name].unit
    return "" if unit in _UNITLESS else f" {unit}"
