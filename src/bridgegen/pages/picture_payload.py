"""Pictures of scenarios as plain dicts and lists, for ``picture.js``.

Boxes of one class are grouped; many of them fold into one, which shows what they have in common
once. A column that several scenarios share (for example, on the same roads) is stored once.
"""

import json
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from bridgegen.pages.picture import Box, Fact, Parameter, Picture
from bridgegen.scenario.ontology.phrases import quantity
from bridgegen.scenario.ontology.structure import LAYERS

FOLD = 3
"""Maximum number of boxes of a class before they fold into one."""

_PLAIN = {"count": "", "1": ""}


def pictures_payload(pictures: Sequence[Picture]) -> dict[str, Any]:
    """Return pictures as the page's data.

    Args:
        pictures: one per scenario.

    Returns:
        ``layers``, the names of the columns; ``columns``, all different ones as groups of boxes;
        ``pictures``, each with the numbers of its five columns.
    """
    columns: dict[str, int] = {}
    sent = []
    for picture in pictures:
        places = []
        for layer in LAYERS:
            boxes = [box for box in picture.boxes if box.layer == layer]
            groups = [
                group
                for cls, found in groupby(boxes, lambda box: box.cls)
                for group in _groups(cls, list(found))
            ]
            text = json.dumps(groups, separators=(",", ":"))
            places.append(columns.setdefault(text, len(columns)))
        sent.append(
            {
                "name": picture.name,
                "checked": picture.checked,
                "facts": [_fact(fact) for fact in picture.facts],
                "parameters": {
                    name: _parameter(parameter) for name, parameter in picture.parameters.items()
                },
                "violations": [[reason.about, reason.text] for reason in picture.violations],
                "homeless": list(picture.homeless),
                "left_out": list(picture.left_out),
                "columns": places,
            }
        )
    return {
        "layers": list(LAYERS.values()),
        "columns": [json.loads(text) for text in columns],
        "pictures": sent,
    }


def _groups(cls: str, boxes: list[Box]) -> Iterator[dict[str, Any]]:
    """Yield the boxes of a class; many fold, but not those that violate a constraint."""
    broken = [box for box in boxes if box.broken or any(item.broken for item in box.inside)]
    kept = [box for box in boxes if box not in broken]
    if len(kept) <= FOLD:
        yield {"class": cls, "boxes": [_box(box) for box in boxes]}
        return
    if broken:
        yield {"class": cls, "boxes": [_box(box) for box in broken]}
    common = [fact for fact in kept[0].facts if all(fact in box.facts for box in kept[1:])]
    yield {
        "class": cls,
        "common": [_fact(fact) for fact in common],
        "boxes": [_box(box, common) for box in kept],
    }


def _box(box: Box, common: Sequence[Fact] = ()) -> dict[str, Any]:
    facts = [fact for fact in box.facts if fact not in common]
    shown = sum(fact not in common for fact in box.facts[: box.shown])
    sent: dict[str, Any] = {"id": box.id, "name": box.name, "facts": [_fact(f) for f in facts]}
    if shown < len(facts):
        sent["shown"] = shown
    if box.links:
        sent["links"] = [[link.label, link.to] for link in box.links]
    if box.broken:
        sent["broken"] = list(box.broken)
    if box.inside:
        sent["inside"] = [{"class": item.cls, **_box(item)} for item in box.inside]
    return sent


def _fact(fact: Fact) -> list[Any]:
    """Return label, text, then, if any, the bound values and whether a constraint is violated."""
    bound = [[name, float(f"{value:.5g}")] for name, value in fact.bound]
    whole = [fact.label, fact.text, bound, 1]
    return whole if fact.wrong else whole[:3] if bound else whole[:2]


def _parameter(parameter: Parameter) -> dict[str, Any]:
    """Return a parameter's range in words, and its ends where it has any."""
    if parameter.low is None or parameter.high is None:
        return {"text": f"= {parameter.formula}" if parameter.formula else "no range"}
    unit = _PLAIN.get(parameter.unit, parameter.unit)
    return {
        "text": f"{quantity(parameter.low, '')} to {quantity(parameter.high, unit)}",
        "low": parameter.low,
        "high": parameter.high,
    }
