"""Traffic on the left, and what the law of a country says that the judgement of conflicts asks.

A scenario file is written for traffic on the right. Where traffic drives on the left, all of it
happens in a mirror: its right is the nearside, the side of the kerb, wherever it is driven.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Side = Literal["left", "right"]


@dataclass(frozen=True)
class Country:
    """A country's rules of the road, where those of countries differ and a judgement needs them.

    Attributes:
        code: ISO 3166-1, as OpenDRIVE names the country of a road.
        traffic: the side of the road on which it drives.
        first: from which side one comes who goes first at a junction without lights, signs and
            marks; None: nobody has priority there by law.
        source: of that rule.
    """

    code: str
    traffic: Side
    first: Side | None
    source: str


COUNTRIES: Mapping[str, Country] = MappingProxyType(
    {
        "DE": Country("DE", "right", "right", "StVO § 8 (1); Vienna Convention, Art. 18 (4) (a)"),
        "JP": Country("JP", "left", "left", "Road Traffic Act (Act No. 105 of 1960), Art. 36 (1)"),
        "UK": Country("GB", "left", None, "The Highway Code (2022), rule 146"),
        "US": Country("US", "right", "right", "Uniform Vehicle Code (2000), § 11-401"),
    }
)
"""By the name that a scenario file gives. The Vienna Convention leaves it to the law of a country
that drives on the left who goes first there (Art. 18 (4) (b)): it is no mirror image."""

_OTHER = {"left": "right", "right": "left", "north": "south", "south": "north"}
_SIDE = re.compile(
    r"(?<!° )\b(left|right|north|south)\b"
    # Words that name no side: right of way, a right angle, who has left, what is left.
    r"(?! of way| angle| away| (?:its|the|their|out|over|alone|enough|no|to act|to brake)\b)"
    r"(?<!\bhas left)(?<!\bhave left)(?<!\bis left)(?<!\bare left)(?<!\bwas left)(?<!\d s left)",
    re.IGNORECASE,
)


def in_the_mirror(text: str) -> str:
    """Return a text with left for right and north for south, where the words name sides."""

    def other(found: re.Match[str]) -> str:
        side = _OTHER[found[0].lower()]
        return side.capitalize() if found[0][0].isupper() else side

    return _SIDE.sub(other, text)


def country_of(code: str) -> Country | None:
    """Return a country by its code; None of one whose rules are not known here."""
    return next((country for country in COUNTRIES.values() if country.code == code), None)
