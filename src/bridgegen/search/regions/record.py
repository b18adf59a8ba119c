"""The regions of a run as JSON."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bridgegen.base.errors import FileFormatError
from bridgegen.base.records import parse_json, read_bytes
from bridgegen.base.statistics import CONFIDENCE
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.regions.box import Box, Evidence, rule, sentence, whole
from bridgegen.search.regions.find import Found, Region

JSON_FILE = "regions.json"
"""The file name in a run's folder."""


def read_record(path: Path) -> Mapping[str, Any] | None:
    """Return the record of `to_json` in a file; None if the file does not exist.

    Raises:
        FileFormatError: it cannot be read, or is not such a record.
    """
    try:
        record = parse_json(read_bytes(path))
        for item in record["regions"]:
            _check(item)
        _whole(*(record[key] for key in ("evaluations", "critical", "critical_held")))
        _number(*(record[key] for key in ("confidence", "at_least", "space_share")))
        if "exposure" in record:
            _of(str, record["exposure"])
            for told in (
                record["exposure_share"],
                *(item["exposure"] for item in record["regions"]),
            ):
                low, high = told["interval"]
                _number(told["share"], low, high)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise FileFormatError(
            f"{path}: must be what 'bridgegen analyse regions' writes, and {_reason(error)}; "
            "run that again, or delete the file"
        ) from None
    return record  # type: ignore[no-any-return]


def _check(record: Mapping[str, Any]) -> None:
    """Raise a KeyError, TypeError or ValueError if a region lacks data that a page needs."""
    _whole(record["number"])
    _of(bool, record["confirmed"])
    _of(str, record["rule"], record["sentence"], *_of(list, record["named"])[0])
    ends = [
        end for name in record["named"] for end in (record["box"][name][k] for k in ("low", "high"))
    ]
    for evidence in (record["fresh"], record["search"]):
        _whole(evidence["rows"], evidence["critical"])
        low, high = evidence["interval"]
        ends += [low, high]
    _number(*ends, record["space_share"])


def _of(kind: type, *values: Any) -> tuple[Any, ...]:
    for value in values:
        if type(value) is not kind:
            raise TypeError(f"{kind.__name__} is needed, got {str(value)[:40]!r}")
    return values


def _whole(*values: Any) -> None:
    if min(_of(int, *values)) < 0:
        raise ValueError(f"numbers of rows must be at least 0, got {min(values)}")


def _number(*values: Any) -> None:
    """Check that values are numbers; `parse_json` has checked that they are finite."""
    _of(float, *(float(value) if type(value) is int else value for value in values))


def _reason(error: Exception) -> str:
    return f"lacks {str(error)[:60]}" if isinstance(error, KeyError) else f"is not: {error}"


def to_json(found: Found, space: SearchSpace, driver: str) -> dict[str, Any]:
    """Return the regions in JSON types.

    ``box`` has the inclusive bounds of every searched parameter; ``named`` lists the parameters
    that the rule names.

    Args:
        found: the regions.
        space: the search space.
        driver: the ego's driver.
    """
    outer = whole(space)
    return {
        "parameters": [
            {
                "name": name,
                "unit": space.parameters[name].unit,
                "integer": space.parameters[name].kind.apart,
                **space.parameters[name].kind.labels(),
                "low": low,
                "high": high,
            }
            for name, (low, high) in _edges(outer, space).items()
        ],
        "confidence": CONFIDENCE,
        "regions": [
            _region(number, region, space, driver, outer)
            for number, region in enumerate(found.regions, start=1)
        ],
        "rows": found.rows,
        "critical": found.critical,
        "critical_held": found.critical_held,
        "space_share": found.space_share,
        "simulations": found.simulations,
    }


def _region(
    number: int, region: Region, space: SearchSpace, driver: str, outer: Box
) -> dict[str, Any]:
    named = zip(space.variables, region.box.narrows(outer), strict=True)
    edges = _edges(region.box, space)
    return {
        "number": number,
        "confirmed": region.confirmed,
        "narrowed": region.narrowed,
        "rule": rule(region.box, space),
        "sentence": sentence(region.box, space, driver, region.fresh),
        "named": [name for name, narrower in named if narrower],
        "box": {name: {"low": low, "high": high} for name, (low, high) in edges.items()},
        "fresh": _evidence(region.fresh),
        "search": _evidence(region.search),
        "space_share": region.space_share,
    }


def _edges(box: Box, space: SearchSpace) -> dict[str, tuple[float, float]]:
    both = zip(box.low.tolist(), box.high.tolist(), strict=True)
    return dict(zip(space.variables, both, strict=True))


def _evidence(evidence: Evidence) -> dict[str, Any]:
    return {
        "rows": evidence.rows,
        "critical": evidence.critical,
        "failed": evidence.failed,
        "share": evidence.share,
        "interval": list(evidence.interval),
    }
