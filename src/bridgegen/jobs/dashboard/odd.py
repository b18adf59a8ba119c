"""What all scenarios of a project cover together, after the taxonomy and by parameter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bridgegen.jobs.dashboard.results import Result, Seen
from bridgegen.jobs.dashboard.scenery import Scenery
from bridgegen.scenario.odd.states import table

SOURCE = "ISO 34503:2023, BSI PAS 1883:2020"


@dataclass(frozen=True)
class Attribute:
    """A leaf of the taxonomy.

    Attributes:
        path: from the top to its name.
        fact: of scenarios that have it; "" for none.
        band: a quantity, and the number of its band; None for none.
        note: what a reader has to know of it.
    """

    path: tuple[str, ...]
    fact: str = ""
    band: tuple[str, int] | None = None
    note: str = ""

    @property
    def expressible(self) -> bool:
        """Whether a scenario can state it."""
        return bool(self.fact) or self.band is not None


def _read(group: str, name: str, text: str) -> Attribute:
    evidence, _, note = (part.strip() for part in text.partition("#"))
    quantity, _, number = evidence.rpartition(":")
    path = (*group.split(" / "), name)
    if quantity in table().quantities:
        return Attribute(path, band=(quantity, int(number)), note=note)
    return Attribute(path, fact=evidence, note=note)


TAXONOMY = tuple(
    _read(group, name, text)
    for group, names in table().attributes.items()
    for name, text in names.items()
)
"""All attributes of ``taxonomy.yaml``, in its order."""


@dataclass(frozen=True)
class Covered:
    """An attribute of the taxonomy, and what covers it.

    Attributes:
        attribute: it.
        scenarios: evaluations by scenario, the most first; empty: it is not covered.
        unread: number of scenarios of which it is not read, so that they may cover it.
    """

    attribute: Attribute
    scenarios: Mapping[str, int]
    unread: int = 0

    @property
    def evaluations(self) -> int:
        """Of all scenarios."""
        return sum(self.scenarios.values())


@dataclass(frozen=True)
class Coverage:
    """What a project covers.

    Attributes:
        attributes: of the taxonomy, in its order.
        seen: by scenario, the values that were evaluated.
        sceneries: by scenario, what it states.
    """

    attributes: tuple[Covered, ...]
    seen: Mapping[str, Seen]
    sceneries: Mapping[str, Scenery]

    @property
    def counts(self) -> tuple[int, int, int]:
        """The numbers of attributes that are covered, not covered, and not expressible."""
        covered = sum(bool(attribute.scenarios) for attribute in self.attributes)
        cannot = sum(not attribute.attribute.expressible for attribute in self.attributes)
        return covered, len(self.attributes) - covered - cannot, cannot


def coverage(results: Sequence[Result], sceneries: Mapping[str, Scenery]) -> Coverage:
    """Return what results cover together.

    Args:
        results: of all drivers: what is tested with one is covered.
        sceneries: by the names of their scenarios.
    """
    seen: dict[str, Seen] = {}
    for result in results:
        if result.seen is not None and result.scenario in sceneries:
            seen.setdefault(result.scenario, Seen()).add(result.seen)
    attributes = tuple(
        Covered(
            attribute, _scenarios(attribute, seen, sceneries), _unread(attribute, seen, sceneries)
        )
        for attribute in TAXONOMY
    )
    return Coverage(attributes, dict(sorted(seen.items())), sceneries)


def _unread(
    attribute: Attribute, seen: Mapping[str, Seen], sceneries: Mapping[str, Scenery]
) -> int:
    """Return of how many scenarios an attribute is not read."""
    if not attribute.expressible or attribute.fact.startswith("participant:"):
        return 0
    partly = [name for name in seen if sceneries[name].partly]
    if attribute.band is not None:
        return sum(attribute.band[0] not in seen[name].bands for name in partly)
    return sum(attribute.fact not in sceneries[name].facts for name in partly)


def _scenarios(
    attribute: Attribute, seen: Mapping[str, Seen], sceneries: Mapping[str, Scenery]
) -> dict[str, int]:
    found = {}
    for name, element in seen.items():
        if attribute.band is not None:
            quantity, number = attribute.band
            count = element.bands[quantity][number] if quantity in element.bands else 0
        else:
            has = bool(attribute.fact) and attribute.fact in sceneries[name].facts
            count = element.evaluations if has else 0
        if count:
            found[name] = count
    return dict(sorted(found.items(), key=lambda item: (-item[1], item[0])))
