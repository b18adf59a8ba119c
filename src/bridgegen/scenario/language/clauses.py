"""Clauses: what a regulation or protocol requires of the ego in a scenario, and what decides it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field

from bridgegen.base.errors import InputError
from bridgegen.scenario.language.criteria import Criterion, Tag
from bridgegen.scenario.language.parameters import at, nearest
from bridgegen.scenario.language.plain_yaml import Document, entries
from bridgegen.scenario.language.shape import ID, ShapedSection, Text, section

Collisions = Literal["any", "preventable"]


@dataclass(frozen=True)
class Clause:
    """A requirement of a regulation or protocol, which the ego passes or fails in a variation.

    Attributes:
        id: of the clause, ``R157-5.2.5.2`` say.
        text: the requirement in words.
        collisions: which collisions of the ego violate it: "any", or those that are "preventable"
            by the models of UN R157; None: none does.
        criteria: ids of the criteria whose violation violates it.
        place: file and line that declare it, for messages.
    """

    id: str
    text: str
    collisions: Collisions | None = None
    criteria: tuple[str, ...] = ()
    place: str = field(default="", compare=False, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Return it as a file declares it, without what is not said."""
        found: dict[str, Any] = {"id": self.id, "text": self.text}
        if self.collisions:
            found["collisions"] = self.collisions
        if self.criteria:
            found["criteria"] = list(self.criteria)
        return found


class ClauseSection(ShapedSection):
    """One entry of ``clauses``: a requirement of a regulation, and what violates it."""

    id: Annotated[str, Field(strict=True, pattern=f"^{ID}$")]
    """Of the clause: letters, digits, '.', '_' and '-'."""
    text: Text
    """The requirement in words."""
    collisions: Collisions | None = None
    """Which collisions of the ego violate it: any, or those that a model of UN R157 avoids."""
    criteria: Annotated[list[Tag], Field(default=[])]
    """Ids of criteria of this file: one that is violated violates the clause."""


def read_clause(given: Mapping[str, Any]) -> Clause:
    """Return a clause of plain data, as ``Clause.to_dict`` gives them.

    Raises:
        InputError: it is not of that shape.
    """
    shaped = section(ClauseSection, dict(given))
    if shaped is None:
        raise InputError("a clause has an id, a text, 'collisions' and 'criteria', and no more")
    return _clause(shaped, "")


def read_clauses_in(
    document: Document, criteria: Iterable[Criterion]
) -> tuple[tuple[Clause, ...], list[str]]:
    """Return the clauses of a scenario file, and what is wrong with them.

    What has not the shape of a clause is left to the check of the file's shape.

    Args:
        document: the file.
        criteria: its pass criteria.
    """
    known = [one.id for one in criteria]
    found, problems = list[Clause](), list[str]()
    for number, data in entries(document, "clauses"):
        given = section(ClauseSection, data)
        if given is None:
            continue
        one = _clause(given, document.at(("clauses", number)))
        where = f"clause {one.id}:"
        if not one.collisions and not one.criteria:
            problems.append(
                f"{where} nothing can violate it, state 'collisions' or 'criteria'{at(one.place)}"
            )
        problems += [
            f"{where} unknown criterion '{name}'{nearest(name, known)}{at(one.place)}"
            for name in one.criteria
            if name not in known
        ]
        if one.id in [other.id for other in found]:
            problems.append(f"{where} it is there twice, each has an id of its own{at(one.place)}")
        found.append(one)
    return tuple(found), problems


def _clause(given: ClauseSection, place: str) -> Clause:
    return Clause(given.id, given.text, given.collisions, tuple(given.criteria), place)
