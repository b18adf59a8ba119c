"""Statements of the ontology that OpenDRIVE cannot express: own ``<userData>`` elements.

The standard allows them at any element, and other tools pass over them. A code is ours where it
begins with `PREFIX`; after that comes the local name of a property of the ontology (or
``class``, ``part_of`` and ``phase``), and it is said of the individual that the element stands
for. Other people's ``userData`` is dropped by the reader.

Source: ASAM OpenDRIVE 1.7, section 6.5 (ancillary data).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bridgegen.openx.opendrive.declaration import attribute

PREFIX = "bridgegen:"


@dataclass(frozen=True, slots=True)
class UserData:
    """A named value; ``code`` begins with `PREFIX`."""

    code: str = attribute("code")
    value: str = attribute("value", default="")


def user_datum(name: str, value: str | float) -> UserData:
    """Return a named value; numbers are written in full."""
    return UserData(PREFIX + name, value if isinstance(value, str) else repr(float(value)))


def values_of(data: Sequence[UserData], name: str) -> list[str]:
    """Return all values of a name, in the file's order."""
    return [user_data.value for user_data in data if user_data.code == PREFIX + name]


def number(data: Sequence[UserData], name: str) -> float | None:
    """Return the finite number of a name; None if there is none, or it is invalid."""
    for value in values_of(data, name):
        try:
            found = float(value)
        except ValueError:
            continue
        if math.isfinite(found):
            return found
    return None


def exact(data: Sequence[UserData], name: str, measured: float, slack: float = 1e-6) -> float:
    """Return a number to the last digit: as stated, if the measured value agrees.

    If another tool moved things without regard to BridgeGen's ``userData``, the geometry counts.

    Args:
        data: of the element.
        name: of the property.
        measured: the geometry's value, with rounding.
        slack: by how much the two may differ, in the property's unit.
    """
    # The geometry overrules the statement: a tool that moves a junction leaves our userData as it
    # was. Where both agree, the stated number has the last digits that a measured one lost.
    found = number(data, name)
    return measured if found is None or abs(found - measured) > slack else found
