"""Elements and relations of an argument, as they are stated; then their status."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from bridgegen.jobs.safety_case.model import (
    SACM,
    Condition,
    Declaration,
    Element,
    Kind,
    Number,
    Relation,
    RelationKind,
    Status,
)
from bridgegen.jobs.safety_case.numbers import statement

_PREFIX: dict[Kind, str] = {
    "Goal": "G",
    "Strategy": "S",
    "Solution": "Sn",
    "Context": "C",
    "Assumption": "A",
    "Justification": "J",
    "CounterGoal": "CG",
    "CounterSolution": "CSn",
}
_CLAIMS = ("Goal", "CounterGoal", "Assumption", "Justification")


@dataclass
class Draft:
    """An element before its status is known; attributes as of `Element`, texts as templates."""

    kind: Kind
    at: str
    template: str
    details: Sequence[str] = ()
    undeveloped: bool = False
    holds: Condition | None = None
    evidence: Sequence[str] = ()
    link: str = ""
    below: list[tuple[RelationKind, "Draft"]] = field(default_factory=list)
    challengers: list["Draft"] = field(default_factory=list)

    @property
    def id(self) -> str:
        """Its id: its kind, and its place in the argument."""
        return _PREFIX[self.kind] + self.at

    def add(
        self,
        kind: Kind,
        at: str,
        template: str,
        *,
        details: Sequence[str] = (),
        undeveloped: bool = False,
        holds: Condition | None = None,
        evidence: Sequence[str] = (),
        link: str = "",
    ) -> "Draft":
        """Add an element below this one, and return it; its relation follows from its kind."""
        draft = Draft(kind, at, template, details, undeveloped, holds, evidence, link)
        context = kind in ("Context", "Assumption", "Justification")
        self.below.append(("InContextOf" if context else "SupportedBy", draft))
        return draft

    def challenge(self, template: str, details: Sequence[str] = ()) -> "Draft":
        """Add a counter goal that challenges this goal, and return it."""
        draft = Draft("CounterGoal", self.at, template, details)
        self.challengers.append(draft)
        return draft

    def walk(self) -> Iterable["Draft"]:
        """Yield this element, then all that is below it or challenges it."""
        yield self
        for _, draft in self.below:
            yield from draft.walk()
        for challenger in self.challengers:
            yield from challenger.walk()


def status_of(draft: Draft, values: dict[str, float]) -> Status:
    """Return the status of a goal; "" of another element.

    A goal is not supported if its condition does not hold, if a counter goal challenges it, or if
    a goal below it is not supported; incomplete if a goal below it is undeveloped or incomplete.
    """
    if draft.kind not in ("Goal", "CounterGoal"):
        return ""
    if draft.undeveloped:
        return "undeveloped"
    if draft.challengers or not _holds(draft.holds, values):
        return "not supported"
    found = {status_of(goal, values) for goal in _goals(draft)}
    if "not supported" in found:
        return "not supported"
    return "incomplete" if found & {"undeveloped", "incomplete"} else "supported"


def _goals(draft: Draft) -> Iterable[Draft]:
    """Yield the goals next below one, strategies between left out."""
    for relation, other in draft.below:
        if relation == "SupportedBy":
            yield from _goals(other) if other.kind == "Strategy" else (other,)


def _holds(condition: Condition | None, values: dict[str, float]) -> bool:
    if condition is None:
        return True
    other = values[condition.equals] if isinstance(condition.equals, str) else 0
    return values[condition.number] == other


def finish(
    top: Draft, numbers: dict[str, Number]
) -> tuple[tuple[Element, ...], tuple[Relation, ...]]:
    """Return the elements and relations of an argument.

    Args:
        top: its top goal.
        numbers: all of the case, by id.
    """
    values = {n: number.value for n, number in numbers.items() if not isinstance(number.value, str)}
    drafts = list(top.walk())
    elements = tuple(_element(draft, status_of(draft, values), numbers) for draft in drafts)
    relations: list[Relation] = []
    for draft in drafts:
        relations += [_relation(kind, draft, other) for kind, other in draft.below]
        relations += [_relation("Challenges", other, draft) for other in draft.challengers]
    return elements, tuple(relations)


def _element(draft: Draft, status: Status, numbers: dict[str, Number]) -> Element:
    return Element(
        id=draft.id,
        kind=draft.kind,
        sacm=SACM[draft.kind],
        declaration=_declaration(draft, status),
        statement=statement(draft.template, numbers),
        details=tuple(statement(text, numbers) for text in draft.details),
        status=status,
        undeveloped=draft.undeveloped,
        holds=draft.holds,
        evidence=tuple(draft.evidence),
        link=draft.link,
    )


def _declaration(draft: Draft, status: Status) -> Declaration:
    """Return what SACM says of a claim."""
    if draft.kind not in _CLAIMS:
        return ""
    if draft.kind == "Assumption":
        return "assumed"
    if draft.kind == "Justification":
        return "axiomatic"
    if status == "not supported":
        return "defeated"
    return "asserted" if status == "supported" else "needsSupport"


def _relation(kind: RelationKind, draft: Draft, other: Draft) -> Relation:
    if kind == "InContextOf":
        sacm = "AssertedContext"
    elif other.kind in ("Solution", "CounterSolution"):
        sacm = "AssertedEvidence"
    else:
        sacm = "AssertedInference"
    return Relation(
        kind=kind, source=draft.id, target=other.id, sacm=sacm, counter=kind == "Challenges"
    )
