"""A safety case as ``safety-case.json``: an argument in Goal Structuring Notation, with evidence.

Source: Goal Structuring Notation Community Standard, version 3 (SCSC-141C, 2021), with its
dialectic extension (counter goals, counter solutions, challenges, defeated elements). The names
in ``sacm`` are those of OMG's Structured Assurance Case Metamodel, version 2.
"""

import re
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

FILE = "safety-case.json"

Kind = Literal[
    "Goal",
    "Strategy",
    "Solution",
    "Context",
    "Assumption",
    "Justification",
    "CounterGoal",
    "CounterSolution",
]
RelationKind = Literal["SupportedBy", "InContextOf", "Challenges"]

Status = Literal["supported", "not supported", "incomplete", "undeveloped", ""]
"""Status of a goal; "incomplete": nothing speaks against it, and a goal below it is undeveloped; ""
of elements that are no goals."""

Declaration = Literal["asserted", "needsSupport", "assumed", "axiomatic", "defeated", ""]
"""SACM's assertionDeclaration of a claim; "" of what is no claim."""

Form = Literal["count", "percent", "percent_up", "percent_down", "number", "text"]
"""Format of a number: shares in per cent, rounded to 3 digits, bounds away from the share; "text":
a sentence that is quoted from a file."""

SACM: dict[Kind, str] = {
    "Goal": "Claim",
    "Strategy": "ArgumentReasoning",
    "Solution": "ArtifactReference",
    "Context": "ArtifactReference",
    "Assumption": "Claim",
    "Justification": "Claim",
    "CounterGoal": "Claim",
    "CounterSolution": "ArtifactReference",
}
"""The element of SACM 2 that each kind of GSN's corresponds to."""

PLACE = re.compile(r"\{([\w.:-]+)\}")
"""Regular expression of a number's place in a template, by its id."""

Text = Annotated[str, Field(max_length=20_000)]
Id = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.:-]{0,199}$")]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Statement(_Model):
    """A sentence, and the numbers in it.

    Attributes:
        text: as it is read.
        template: the same with ids of numbers in braces in place of these; "" where there are
            none.
    """

    text: Text
    template: Text = ""


class Number(_Model):
    """A number that the case states, or a sentence that it quotes.

    Attributes:
        id: "R1.harmful", "R1.harm2", "R1.violated:R-12": the run's id, the definition by its name
            in ``recompute.py``, and which of several.
        value: it.
        unit: of it; "1" of shares and counts.
        form: how it is written.
        text: as it is written.
        of: which of several: the number of a failure mode, a criterion's id, a file.
        source: the file that it is recomputed from; "" where no file has what it follows from.
        again: the command that determines it anew, where ``source`` is "".
    """

    id: Id
    value: int | float | Text
    unit: Text
    form: Form
    text: Text
    of: Text = ""
    source: Text
    again: Text = ""


class Condition(_Model):
    """When a goal holds: two numbers are equal.

    Attributes:
        number: id of the first.
        equals: id of the other, or 0.
    """

    number: Id
    equals: Id | Literal[0]


class Element(_Model):
    """An element of the argument.

    Attributes:
        id: by its place in the argument: "G1.3", "Sn1.3.1".
        kind: in GSN.
        sacm: the same in SACM.
        declaration: SACM's assertionDeclaration of a claim; "" of what is no claim.
        statement: of it.
        details: more of it, a line each.
        status: of a goal.
        undeveloped: whether it is deliberately left without support.
        holds: when it does; None where it rests on what is below it.
        evidence: ids of the files that a solution refers to.
        link: page of the documentation that explains it; "" without.
    """

    id: Id
    kind: Kind
    sacm: Text
    declaration: Declaration
    statement: Statement
    details: Annotated[tuple[Statement, ...], Field(max_length=2000)] = ()
    status: Status = ""
    undeveloped: bool = False
    holds: Condition | None = None
    evidence: Annotated[tuple[Id, ...], Field(max_length=1000)] = ()
    link: Text = ""

    @property
    def defeated(self) -> bool:
        """Whether counter-evidence defeats it."""
        return self.declaration == "defeated"


class Relation(_Model):
    """A relation between two elements.

    Attributes:
        kind: in GSN.
        source: the element that is supported, in context, or that challenges.
        target: the element that supports, is the context, or is challenged.
        sacm: the same in SACM; a strategy is the ``reasoning`` of the inference from the goals
            below it to the goal above it.
    """

    kind: RelationKind
    source: Id
    target: Id
    sacm: Literal["AssertedInference", "AssertedEvidence", "AssertedContext"]
    counter: bool = False


class Evidence(_Model):
    """A file that the case rests on.

    Attributes:
        id: of it: "E1.1".
        file: relative to the case's folder.
        sha256: of its content.
        bytes: its size.
        shows: its content.
        command: that makes it.
    """

    id: Id
    file: Text
    sha256: Digest
    bytes: Annotated[int, Field(ge=0)]
    shows: Text
    command: Text


class RunFacts(_Model):
    """What a recomputation needs to know of a run.

    Attributes:
        id: "R1".
        folder: relative to the case's folder.
        scenario: its name.
        ego: label of the driver.
        algorithm: of the search.
        seed: of the search.
        version: of BridgeGen that made it.
        results: SHA-256 of all evaluations without their times.
        count: whose conflicts count as harm, "ego" or "any".
        drawn: the rows that the share of the space is estimated from: "run", "fresh" or "".
        edges: inner edges of the bins of each searched parameter.
    """

    id: Id
    folder: Text
    scenario: Text
    ego: Text
    algorithm: Text
    seed: int
    version: Text
    results: Text
    count: Literal["ego", "any"]
    drawn: Literal["run", "fresh", ""]
    edges: dict[Text, tuple[float, ...]]


class SafetyCase(_Model):
    """A safety case.

    Attributes:
        schema_version: 1.
        notation: of the argument.
        generator: what wrote it.
        title: of it.
        confidence: of each interval.
        runs: that it is about.
        numbers: every number in the texts.
        elements: of the argument, each goal before what is below it.
        relations: between them.
        evidence: the files.
    """

    schema_version: Literal[1] = 1
    notation: Literal["GSN Community Standard 3"] = "GSN Community Standard 3"
    generator: Text
    title: Text
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)]
    runs: Annotated[tuple[RunFacts, ...], Field(min_length=1, max_length=100)]
    numbers: tuple[Number, ...]
    elements: tuple[Element, ...]
    relations: tuple[Relation, ...]
    evidence: tuple[Evidence, ...]

    @model_validator(mode="after")
    def _consistent(self) -> "SafetyCase":
        known = {element.id for element in self.elements}
        for kind, ids in (
            ("element", [element.id for element in self.elements]),
            ("number", [number.id for number in self.numbers]),
            ("evidence item", [evidence.id for evidence in self.evidence]),
        ):
            if len({*ids}) != len(ids):
                raise ValueError(f"the ids of each {kind} must differ")
        if (
            odd := {
                end for relation in self.relations for end in (relation.source, relation.target)
            }
            - known
        ):
            raise ValueError(f"a relation must be between elements, got {min(odd)}")
        return self

    def element(self, name: str) -> Element:
        """Return an element by its id."""
        return next(item for item in self.elements if item.id == name)

    def targets(self, name: str, kind: RelationKind) -> Iterator[Element]:
        """Yield the elements that one has a relation to, in their order."""
        for relation in self.relations:
            if relation.source == name and relation.kind == kind:
                yield self.element(relation.target)

    def challengers(self, name: str) -> Iterator[Element]:
        """Yield the elements that challenge one."""
        for relation in self.relations:
            if relation.target == name and relation.kind == "Challenges":
                yield self.element(relation.source)

    def goals_of(self, name: str) -> Iterator[Element]:
        """Yield the goals that the strategies of a goal have."""
        for strategy in self.targets(name, "SupportedBy"):
            yield from self.targets(strategy.id, "SupportedBy")

    def run_goals(self) -> tuple[Element, ...]:
        """Return the goal of each run, in their order."""
        top = self.elements[0]
        return (top,) if len(self.runs) == 1 else tuple(self.goals_of(top.id))

    def main_goals(self) -> Iterator[Element]:
        """Yield the top goal, then the goals next below each run's."""
        yield self.elements[0]
        for goal in self.run_goals():
            yield from (goal,) if goal is not self.elements[0] else ()
            yield from self.goals_of(goal.id)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of safety cases (draft 2020-12)."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "urn:bridgegen:safety-case",
        **SafetyCase.model_json_schema(mode="serialization"),
    }
