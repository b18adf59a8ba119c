"""A constraint as SHACL-SPARQL, and the composition of its message."""

from dataclasses import dataclass

from bridgegen.scenario.language.expression import Expression
from bridgegen.scenario.language.kinds import TOLERANCE
from bridgegen.scenario.ontology.sparql import literal
from bridgegen.scenario.ontology.vocabulary import tbox


@dataclass(frozen=True)
class Rule:
    """One constraint of a scenario as a SHACL-SPARQL constraint.

    Attributes:
        key: local name of its shape.
        target: the parameter that breaks the rule, if one does.
        focus: the class whose individuals are asked.
        text: the rule, as formula; of a rule about individuals what they must do, with
            ``{?name}`` for what the query returns under that name.
        limit: the formula of the side that the target is compared with, if there is one.
        why: reason and source, one sentence; may be empty.
        select: the query; it returns each focus node that breaks the rule, with the value: of a
            rule about individuals, the individual that breaks it.
        at_fault: local name of the property that is at fault, of a rule about individuals.
        individuals: whether it is a rule about individuals, whatever parameters they have.
        needs: local names of classes and properties; where one of them does not occur, there is
            nothing to check.
    """

    key: str
    target: str
    focus: str
    text: str
    limit: Expression | None
    why: str
    select: str
    at_fault: str = ""
    individuals: bool = False
    needs: tuple[str, ...] = ()

    @property
    def message(self) -> str:
        """The rule with its reason; for a rule about individuals, the statement on each."""
        text = f"{with_unit(self.at_fault)} {self.text}" if self.at_fault else self.text
        return f"{text}: {self.why}" if self.why else text


def about(
    key: str,
    focus: str,
    property_name: str,
    text: str,
    why: str,
    source: str,
    select: str,
    needs: tuple[str, ...] = (),
) -> Rule:
    """Return a rule about individuals.

    Args:
        key: local name of its shape.
        focus: the class that the query starts from: ``Scenario`` or ``RoadNetwork``.
        property_name: local name of the property at fault, or empty.
        text: what must be, going on after the property's name (or the individual's).
        why: the reason, one sentence.
        source: of the rule.
        select: the query.
        needs: classes and properties without which there is nothing to check.
    """
    reason = f"{why} (source: {source})"
    return Rule(key, "", focus, text, None, reason, select, property_name, True, needs)


def with_unit(property_name: str) -> str:
    """Return a property's name with its unit, if it has one."""
    unit = tbox().units.get(property_name)
    return f"{property_name} [{unit}]" if unit else property_name


def slack(limit: str, side: int) -> str:
    """Move a limit (SPARQL) outwards by the one tolerance of all checks."""
    sign = "+" if side > 0 else "-"
    return f"({limit} {sign} {literal(TOLERANCE)} * (1.0e0 + ABS({limit})))"


def shown(value: str) -> str:
    """Return a number (SPARQL) as people read it: rounded, without superfluous digits."""
    return f'REPLACE(STR(ROUND(xsd:double({value}) * 1.0e3) / 1.0e3), "[.]0$", "")'


def called(node: str) -> str:
    """Return the last part of an individual's IRI (SPARQL), as people call it."""
    return f'REPLACE(STR({node}), "^.*[#/]", "")'


def is_a(node: str, cls: str) -> str:
    """Return the pattern that an individual is of a class, or of one below it."""
    return f"{node} a/rdfs:subClassOf* bg:{cls} ."
