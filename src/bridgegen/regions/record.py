"""What was found, as JSON: for machines, and to be drawn."""

from typing import Any

from bridgegen.odd.space import SearchSpace
from bridgegen.regions.box import Box, whole
from bridgegen.regions.evidence import CONFIDENCE, Evidence
from bridgegen.regions.find import Found, Region
from bridgegen.regions.words import rule, sentence


def to_json(found: Found, space: SearchSpace, driver: str) -> dict[str, Any]:
    """Return everything as JSON's types.

    ``box`` has the lowest and the highest value of every searched parameter, both inside; ``named``
    are those that the rule names.

    Args:
        found: the regions.
        space: what was searched.
        driver: the ego's.
    """
    outer = whole(space)
    return {
        "parameters": [
            {
                "name": name,
                "unit": space.scenario.parameters[name].unit,
                "integer": space.scenario.parameters[name].kind == "integer",
                "low": low,
                "high": high,
            }
            for name, (low, high) in _edges(outer, space).items()
        ],
        "confidence": CONFIDENCE,
        "regions": [
            _region(number, one, space, driver, outer)
            for number, one in enumerate(found.regions, start=1)
        ],
        "rows": found.rows,
        "critical": found.critical,
        "critical_held": found.critical_held,
        "space_share": found.space_share,
        "simulations": found.simulations,
    }


def _region(
    number: int, one: Region, space: SearchSpace, driver: str, outer: Box
) -> dict[str, Any]:
    named = zip(space.variables, one.box.narrows(outer), strict=True)
    edges = _edges(one.box, space)
    return {
        "number": number,
        "confirmed": one.confirmed,
        "narrowed": one.narrowed,
        "rule": rule(one.box, space),
        "sentence": sentence(one.box, space, driver, one.fresh),
        "named": [name for name, narrower in named if narrower],
        "box": {name: {"low": low, "high": high} for name, (low, high) in edges.items()},
        "fresh": _evidence(one.fresh),
        "search": _evidence(one.search),
        "space_share": one.space_share,
    }


def _edges(box: Box, space: SearchSpace) -> dict[str, tuple[float, float]]:
    both = zip(box.low.tolist(), box.high.tolist(), strict=True)
    return dict(zip(space.variables, both, strict=True))


def _evidence(one: Evidence) -> dict[str, Any]:
    return {
        "rows": one.rows,
        "critical": one.critical,
        "failed": one.failed,
        "share": one.share,
        "interval": list(one.interval),
    }
