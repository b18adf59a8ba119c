"""SHACL shapes: what every scenario's individuals must be, and the constraints of one scenario.

The structure (which properties, of which kind, how many) is compiled from ``bridgegen.owl``; the
constraints from the declarations of `bridgegen.scenario.language` that also make the decoder. Both
are plain SHACL with SPARQL 1.1, in Turtle: any SHACL processor can run them.

Values of the weather's parameters are found as properties of the parts of the scenario's own
``bg:Weather``; those of all others (a later weather's among them) on whatever individual binds
the parameter (``bg:has_parameter``). What holds in every scenario, `placement` and `conduct` say.
"""

from collections.abc import Iterator, Mapping
from functools import cache, partial
from typing import TYPE_CHECKING

from bridgegen.scenario.language.expression import Expression
from bridgegen.scenario.language.kinds import FLOAT, TOLERANCE
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.ontology.conduct import conduct_rules, placement_rules
from bridgegen.scenario.ontology.individuals import reason
from bridgegen.scenario.ontology.rule import Rule, slack
from bridgegen.scenario.ontology.sparql import binds, literal, variable
from bridgegen.scenario.ontology.story import WEATHER
from bridgegen.scenario.ontology.structure import (
    property_shapes,
    quoted,
    required_turtle,
    requirements,
)
from bridgegen.scenario.ontology.vocabulary import BG, ONTOLOGY, RDFS, XSD

if TYPE_CHECKING:
    from bridgegen.scenario.language.scenario import LogicalScenario

SHAPES = ONTOLOGY + "/shapes#"

WEATHER_PATHS = {
    name: f"{'(bg:hasSun|bg:has_sun)' if link == 'hasSun' else f'bg:{link}'}/bg:has_{name}"
    for link, _, names in WEATHER
    for name in names
}
"""Property paths from a ``bg:Weather`` to the values of its parameters, by name."""

_HEADER = f"""\
@prefix bg: <{BG}> .
@prefix sh: <http://www.w3.org/ns/shacl#> .
@prefix xsd: <{XSD}> .
@prefix : <{SHAPES}> .

:prefixes sh:declare
  [ sh:prefix "bg" ; sh:namespace "{BG}"^^xsd:anyURI ] ,
  [ sh:prefix "rdfs" ; sh:namespace "{RDFS}"^^xsd:anyURI ] ,
  [ sh:prefix "xsd" ; sh:namespace "{XSD}"^^xsd:anyURI ] .
"""


def turtle(scenario: "LogicalScenario | None" = None) -> str:
    """Return the shapes as Turtle: the structure, and a scenario's constraints."""
    parts = [_HEADER, structure()]
    parts += [required_turtle(cls, name) for cls, name in _required_weather(scenario)]
    parts += [_sparql_shape(rule) for rule in rules(scenario)]
    return "\n".join(parts)


# -- structure, from bridgegen.owl -----------------------------------------------------------------


@cache
def structure() -> str:
    """Return the shapes of single properties, and of what individuals must have."""
    shapes = [shape.turtle() for shape in property_shapes()]
    return "\n".join([*shapes, *(required_turtle(cls, name) for cls, name in requirements())])


def required(scenario: "LogicalScenario | None" = None) -> tuple[tuple[str, str], ...]:
    """Return (class, property) where each individual of the class must have a value."""
    return (*requirements(), *_required_weather(scenario))


def _required_weather(scenario: "LogicalScenario | None") -> tuple[tuple[str, str], ...]:
    has_weather = scenario is not None and any(
        parameter in WEATHER_PATHS for parameter in scenario.parameters
    )
    return (("Scenario", "has_weather"),) if has_weather else ()


def _general_rules() -> Iterator[Rule]:
    """Yield rules of every scenario that need a query."""
    yield Rule(
        "one-value",
        "",
        "Scenario",
        "a parameter has one value, wherever it is bound",
        None,
        "",
        "SELECT $this (MIN(?raw) AS ?value) WHERE { $this a bg:Scenario . "
        "?node bg:has_parameter ?parameter ; ?property ?raw . "
        f"{_bound_by('?parameter')} }} "
        "GROUP BY $this ?parameter HAVING(COUNT(DISTINCT ?raw) > 1)",
    )
    yield from placement_rules()
    yield from conduct_rules()


def _declared_ranges() -> Rule:
    low, high = slack("xsd:double(?low)", -1), slack("xsd:double(?high)", 1)
    return Rule(
        "declared-range",
        "",
        "Parameter",
        "has_low <= value <= has_high",
        None,
        "",
        "SELECT DISTINCT $this ?value WHERE { $this bg:has_low ?low ; bg:has_high ?high . "
        f"?node bg:has_parameter $this ; ?property ?value . {_bound_by('$this')} "
        "BIND(xsd:double(?value) AS ?x) "
        f"FILTER(!COALESCE(?x >= {low} && ?x <= {high}, false)) }}",
    )


def _declared_words() -> Rule:
    return Rule(
        "declared-words",
        "",
        "Parameter",
        "has a word that is allowed",
        None,
        "a category has one of its names",
        "SELECT DISTINCT $this (?word AS ?value) WHERE { $this bg:has_allowed_word ?any ; "
        "bg:has_word ?word . FILTER NOT EXISTS { $this bg:has_allowed_word ?word } }",
        "has_word",
        True,
    )


# -- constraints, from the declarations in odd -----------------------------------------------------


def rules(scenario: "LogicalScenario | None") -> tuple[Rule, ...]:
    """Compile what holds in every scenario and one scenario's ranges, bounds and formulas.

    Without a scenario, the ranges are those that the individuals declare themselves.
    """
    found = list(_general_rules())
    if scenario is None:
        return (*found, _declared_ranges(), _declared_words())
    rule = partial(_rule, scenario.parameters)
    for name, parameter in scenario.parameters.items():
        low, high = (
            slack(literal(value), side)
            for value, side in ((parameter.low, -1), (parameter.high, 1))
        )
        x = variable(name)
        kind = parameter.kind
        inside = kind.sparql_inside(_raw(name)) or f"{x} >= {low} && {x} <= {high}"
        text = kind.rule(name, parameter.low, parameter.high)
        found.append(rule(f"range-{name}", name, text, inside, present=True, axis=parameter.axis))
        if alone := kind.sparql_kept(x):
            found.append(rule(f"whole-{name}", name, f"{name} is {alone[1]}", alone[0]))
    for number, bound in enumerate(scenario.bounds):
        for sign, expression, side in ((">=", bound.lo, -1), ("<=", bound.hi, 1)):
            if expression is not None:
                found.append(
                    rule(
                        f"bound-{number}-{'low' if side < 0 else 'high'}-{bound.target}",
                        bound.target,
                        f"{bound.target} {sign} {expression}",
                        f"{variable(bound.target)} {sign} {slack('?limit', side)}",
                        limit=expression,
                        why=reason(bound),
                    )
                )
    for derived in scenario.derived:
        x = variable(derived.name)
        found.append(
            rule(
                f"derived-{derived.name}",
                derived.name,
                str(derived),
                f"ABS({x} - ?limit) <= {literal(TOLERANCE)} * (1.0e0 + ABS(?limit))",
                limit=derived.value,
                why=reason(derived),
                present=True,
                axis=derived.axis,
            )
        )
    return tuple(found)


def _rule(
    parameters: Mapping[str, Parameter],
    key: str,
    target: str,
    text: str,
    kept: str,
    *,
    limit: Expression | None = None,
    why: str = "",
    present: bool = False,
    axis: Axis | None = None,
) -> Rule:
    """Return a rule about one parameter.

    Args:
        parameters: the scenario's.
        key: local name of its shape.
        target: the parameter.
        text: the rule as people read it.
        kept: the filter that holds where the rule is kept; ``?limit`` is the limit's value.
        limit: what the target is compared with.
        why: the reason.
        present: whether the rule is broken, too, where the target has no value at all.
        axis: the target's; a map made elsewhere has no static parameters.
    """
    names = sorted({target} | (limit.names if limit else frozenset()))
    lines = []
    for name in names:
        pattern = _pattern(name)
        lines.append(f"OPTIONAL {{ {pattern} }}" if present and name == target else pattern)
        kind = parameters[name].kind if name in parameters else FLOAT
        lines.append(f"BIND({kind.sparql_value(_raw(name))} AS {variable(name)})")
    if limit is not None:
        lines.append(binds(limit, "limit"))
    lines.append(f"BIND({_raw(target)} AS ?value)")
    # What has no value (a root of a negative number) breaks the rule, as the check of rows has it.
    lines.append(f"FILTER(!COALESCE({kept}, false))")
    # An imported map has roads of its own, and no static parameters: their absence is no fault
    # then.
    if axis is Axis.STATIC:
        map_file = "$this bg:has_road_network/bg:has_map_file ?map_file"
        lines.append(f"FILTER(BOUND({_raw(target)}) || NOT EXISTS {{ {map_file} }})")
    select = f"SELECT DISTINCT $this ?value WHERE {{ {' '.join(lines)} }}"
    return Rule(key, target, "Scenario", text, limit, why, select)


def _pattern(name: str) -> str:
    """Return the graph pattern that finds a parameter's value as `_raw`."""
    if name in WEATHER_PATHS:
        return f"$this bg:has_weather/{WEATHER_PATHS[name]} {_raw(name)} ."
    # each different value once, however many lanes have it: the rules join several parameters
    return (
        f"{{ SELECT DISTINCT $this {_raw(name)} WHERE {{ $this a bg:Scenario . "
        f'?parameter bg:has_name "{name}" . ?node bg:has_parameter ?parameter ; '
        f"?property {_raw(name)} . {_bound_by('?parameter')} }} }}"
    )


def _raw(name: str) -> str:
    """Return the variable for a parameter's value as the graph has it, before it is a double."""
    return f"?raw_{name}_x"


def _bound_by(parameter: str) -> str:
    """Return the pattern that makes ``?property`` one that a parameter binds."""
    return f'{parameter} bg:binds_property ?bound . FILTER(STR(?property) = CONCAT("{BG}", ?bound))'


# -- Turtle ----------------------------------------------------------------------------------------


def _sparql_shape(rule: Rule) -> str:
    return (
        f":{rule.key} a sh:NodeShape ; sh:targetClass bg:{rule.focus} ;\n"
        f"  sh:sparql [ sh:prefixes :prefixes ; sh:message {quoted(rule.message)} ;\n"
        f"    sh:select {quoted(rule.select)} ] .\n"
    )
