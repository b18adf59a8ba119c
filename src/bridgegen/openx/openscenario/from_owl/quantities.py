"""OWL2OpenSCENARIO, its numbers: an individual's value, or the parameter that it is bound to.

The value of a parameter lives on the individuals that are bound to it. The file declares each
dynamic parameter with that value and refers to it by ``$name``, so it is concrete and searchable.
"""

import math
import re
from collections.abc import Mapping
from functools import lru_cache
from keyword import iskeyword

import pyoxigraph as ox

from bridgegen.base.errors import FileFormatError, OntologyError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.read import element_from
from bridgegen.openx.openscenario.values import format_double
from bridgegen.scenario.language.expression import RESERVED, Expression, parse
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject, bg

Quantity = float | osc.ParameterRef
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class Quantities:
    """The numbers of a scenario's individuals, as the storyboard needs them.

    Attributes:
        values: every dynamic parameter's number by name, in alphabetical order.
        words: likewise, of those that are categories, the name of the value.
        limits: derived parameters that only limit others: nothing in the storyboard carries them.

    Raises:
        OntologyError: a parameter has no value, two values, one outside its range, or no
            identifier for a name.
    """

    def __init__(self, individuals: Individuals, scenario: Subject) -> None:
        self._individuals = individuals
        bearers: dict[object, list[Subject]] = {}
        has_parameter = bg("has_parameter")
        for quad in individuals.quads:
            if quad.predicate == has_parameter and not isinstance(quad.subject, ox.Triple):
                bearers.setdefault(quad.object, []).append(quad.subject)
        found: dict[str, tuple[float, Subject]] = {}
        categories: dict[str, Subject] = {}
        self.limits: set[Subject] = set()
        for parameter in individuals.links(scenario, "has_parameter_declaration"):
            if individuals.text(parameter, "has_axis") == Axis.STATIC:
                continue
            if individuals.is_a(parameter, "DerivedParameter") and parameter in bearers.get(
                parameter, []
            ):
                self.limits.add(parameter)
                continue
            name = individuals.text(parameter, "has_name")
            if not _NAME.fullmatch(name) or name in RESERVED or iskeyword(name):
                raise OntologyError(
                    f"a parameter's name must be an identifier of its own, got '{name}'"
                )
            if name in found or name in categories:
                raise OntologyError(f"parameter {name} is declared twice")
            if individuals.texts(parameter, "has_allowed_word"):
                categories[name] = parameter
                continue
            value = self._value(name, parameter, bearers.get(parameter, []))
            found[name] = value, parameter
        self.words = {name: self._word(name, categories[name]) for name in sorted(categories)}
        self._nodes = {name: found[name][1] for name in sorted(found)} | categories
        self.values = {name: found[name][0] for name in sorted(found)}

    def _word(self, name: str, parameter: Subject) -> str:
        word, allowed = self._individuals.text(parameter, "has_word"), self._allowed(parameter)
        if word not in allowed:
            raise OntologyError(f"{name} must be one of {', '.join(allowed)}, got '{word}'")
        return word

    def _allowed(self, parameter: Subject) -> list[str]:
        return sorted(self._individuals.texts(parameter, "has_allowed_word"))

    def _value(self, name: str, parameter: Subject, bearers: list[Subject]) -> float:
        individuals = self._individuals
        found: dict[float, str] = {}
        for node in bearers:
            for bound in individuals.texts(parameter, "binds_property"):
                value = individuals.optional_number(node, bound)
                if value is not None:
                    found.setdefault(value, individuals.describe(node))
        if not found:
            raise OntologyError(
                f"parameter {name} must have a value: no individual that is bound to it has one"
            )
        if len(found) > 1:
            shown = ", ".join(f"{value!r} on {owner}" for value, owner in sorted(found.items()))
            raise OntologyError(f"parameter {name} must have one value, got {shown}")
        value = next(iter(found))
        low, high = self._range(parameter)
        if not low <= value <= high and (value < low - slack(low) or value > high + slack(high)):
            unit = individuals.text(parameter, "has_unit")
            raise OntologyError(f"{name} [{unit}] must be {low!r} to {high!r}, got {value!r}")
        return value

    def get(self, node: Subject, name: str) -> Quantity:
        """Return an individual's number, or the reference to the parameter that it is bound to.

        Raises:
            OntologyError: there is no number, or it is bound to a static parameter, on which a
                storyboard never depends.
        """
        number = self._individuals.number(node, name)
        parameter = self._individuals.parameter(node, name)
        if parameter is None:
            return number
        if parameter not in self.values:
            raise OntologyError(
                f"{name} of {self._individuals.describe(node)} must be bound to a dynamic "
                f"parameter that the scenario declares, got {parameter}"
            )
        return osc.ParameterRef(f"${parameter}")

    def value(self, quantity: Quantity) -> float:
        """Return the number that a quantity has now."""
        return self.values[quantity.name] if isinstance(quantity, osc.ParameterRef) else quantity

    def apply(self, formula: str, quantity: Quantity) -> float | osc.Expr:
        """Return a formula of ``x`` at a quantity: its value, or an expression over the parameter.

        Args:
            formula: in what OpenSCENARIO 1.2 and `bridgegen.scenario.language.expression` have in
                common.
            quantity: what ``x`` stands for.

        Raises:
            OntologyError: the formula has no finite value there.
        """
        now = self.value(quantity)
        value = float(parsed(formula).evaluate({"x": now}))
        if not math.isfinite(value):
            raise OntologyError(f"{formula} must have a finite value, got x = {now!r} ({quantity})")
        if isinstance(quantity, osc.ParameterRef):
            # In brackets: esmini pastes the value's text, whose sign would meet an operator.
            return osc.Expr("${" + re.sub(r"\bx\b", f"({quantity})", formula) + "}")
        return value

    def declarations(self) -> list[osc.ParameterDeclaration]:
        """Return the declaration of each dynamic parameter, its range as constraints."""
        said = {
            name: (osc.ParameterType.DOUBLE, format_double(value), self._constraints(name))
            for name, value in self.values.items()
        }
        said |= {
            name: (osc.ParameterType.STRING, word, self._alternatives(name))
            for name, word in self.words.items()
        }
        return [osc.ParameterDeclaration(name, *said[name]) for name in sorted(said)]

    def _alternatives(self, name: str) -> tuple[osc.ValueConstraintGroup, ...]:
        """Return a group for each name of a category: one of them holds."""
        return tuple(
            osc.ValueConstraintGroup((osc.ValueConstraint(osc.Rule.EQUAL_TO, word),))
            for word in self._allowed(self._nodes[name])
        )

    def _constraints(self, name: str) -> tuple[osc.ValueConstraintGroup, ...]:
        low, high = self._range(self._nodes[name])
        constraints = [
            osc.ValueConstraint(rule, format_double(limit))
            for rule, limit in ((osc.Rule.GREATER_OR_EQUAL, low), (osc.Rule.LESS_OR_EQUAL, high))
            if math.isfinite(limit)
        ]
        return (osc.ValueConstraintGroup(tuple(constraints)),) if constraints else ()

    def _range(self, parameter: Subject) -> tuple[float, float]:
        low = self._individuals.optional_number(parameter, "has_low")
        high = self._individuals.optional_number(parameter, "has_high")
        return -math.inf if low is None else low, math.inf if high is None else high


@lru_cache(maxsize=256)
def parsed(formula: str) -> Expression:
    """Return a formula, read once."""
    return parse(formula)


# --- OWL2OpenSCENARIO, what the ontology keeps in OpenSCENARIO's own words ---


def quoted_element(
    individuals: Individuals, node: Subject, options: Mapping[str, type[Element]]
) -> Element:
    """Return the element that an individual's has_openscenario is.

    Args:
        individuals: one scenario.
        node: of a class of what is quoted.
        options: tag → class, all that it may be.

    Raises:
        OntologyError: there is none, or it is malformed.
        UnsupportedError: it holds what cannot be run.
    """
    text = individuals.text(node, "has_openscenario")
    place = f"has_openscenario of {individuals.describe(node)}"
    try:
        return element_from(text, options, place)
    except FileFormatError as error:
        raise OntologyError(*error.problems) from None
