"""Typologies of crashes: how common each type is, and which scenarios of the catalogue realise it.

``typology.yaml`` has the figures, each typology with its source and how its figures are known.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

from bridgegen.base.units import percent
from bridgegen.scenario.language.plain_yaml import read_plain_yaml


@dataclass(frozen=True)
class CrashType:
    """A type of crash.

    Attributes:
        id: its number in the typology.
        name: in few words.
        percent: its published share of the crashes that the typology counts [%]; None: not known.
        harm: likewise of the harm that these did [%]; None: not known.
        conflicts: labels of the types of conflict in which such a crash shows.
        scenarios: of the catalogue, by name, each with what of the type it has.
        given: parameters of these scenarios by whose values they are of this type and no other; see
            `bridgegen.scenario.language.tables`.
    """

    id: str
    name: str
    percent: float | None = None
    harm: float | None = None
    conflicts: tuple[str, ...] = ()
    scenarios: Mapping[str, str] = field(default_factory=dict)
    given: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Typology:
    """Types of crashes, and where their figures come from.

    Attributes:
        name: of it.
        title: in words.
        counts: the crashes that the shares are of.
        source: of types and shares.
        known: how they are known: what was read, and what was not.
        types: all of them.
        country: of the crashes, or "".
        year: of the crashes, else of the publication; None: not stated.
        total: number of crashes in that year; None: not stated.
    """

    name: str
    title: str
    counts: str
    source: str
    known: str
    types: tuple[CrashType, ...]
    country: str = ""
    year: int | None = None
    total: int | None = None

    @property
    def covered(self) -> tuple[CrashType, ...]:
        """The types that a scenario realises."""
        return tuple(kind for kind in self.types if kind.scenarios)

    @property
    def uncovered(self) -> tuple[CrashType, ...]:
        """The others, the most harmful first; where no harm is known, the most common."""
        return most_harmful(kind for kind in self.types if not kind.scenarios)


def most_harmful(types: Iterable[CrashType]) -> tuple[CrashType, ...]:
    """Return types, the most harmful first; where no harm is known, the most common."""
    return tuple(sorted(types, key=lambda kind: (-(kind.harm or 0.0), -(kind.percent or 0.0))))


def total_of(types: Sequence[CrashType], quantity: str = "percent") -> float | None:
    """Return the share of some types together [%], of crashes or of ``harm``; None: not known."""
    values = [getattr(kind, quantity) for kind in types]
    return None if not values or None in values else sum(values)


def named(kind: CrashType) -> str:
    """Return a type with its shares, of crashes and of harm, in words."""
    known = [percent(value / 100) for value in (kind.percent, kind.harm) if value is not None]
    return f"{kind.name} ({', '.join(known)})" if known else kind.name


_QUANTITIES = {"percent": "crashes", "harm": "harm"}


def shares(types: Sequence[CrashType]) -> str:
    """Return in words the shares of some types together; "" where none is known."""
    found = [(total_of(types, quantity), what) for quantity, what in _QUANTITIES.items()]
    words = [f"{percent(share / 100)} of the {what}" for share, what in found if share is not None]
    return f", with {' and '.join(words)}" if words else ""


def published(scenario: str) -> list[dict[str, Any]]:
    """Return the types of crashes that a scenario of the catalogue realises, with known shares."""
    return [
        {
            "type": kind.name,
            "percent": kind.percent,
            "of": typology.counts,
            "country": typology.country,
            "year": typology.year,
            "source": typology.source,
        }
        for typology in typologies().values()
        for kind in typology.types
        if scenario in kind.scenarios and kind.percent is not None
    ]


def said(typology: Typology) -> str:
    """Return in words how much of a typology scenarios cover, and what is not known."""
    missing = [what for name, what in _QUANTITIES.items() if total_of(typology.types, name) is None]
    words = f"{len(typology.covered)} of {len(typology.types)} types{shares(typology.covered)}"
    unknown = f" (shares of {' and of '.join(missing)} by type: not known)" if missing else ""
    return words + unknown


@cache
def typologies() -> Mapping[str, Typology]:
    """Return the typologies that ship, by name."""
    text = resources.files("bridgegen.scenario").joinpath("typology.yaml").read_bytes()
    data = read_plain_yaml(text, "typology.yaml").data
    assert isinstance(data, dict)
    return {name: _read(name, **given) for name, given in data.items()}


def _read(name: str, types: Mapping[str, Any], **given: Any) -> Typology:
    kinds = tuple(CrashType(id, **kind) for id, kind in types.items())
    return Typology(name=name, types=kinds, **given)
