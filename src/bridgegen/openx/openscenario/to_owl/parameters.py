"""OpenSCENARIO2OWL, its parameters: their ranges, and the header's properties on them.

A parameter's value is already on the individuals that it gives; one that gives nothing carries its
value itself. What a file of others does not say: the axis is ``weather`` of what gives nothing but
weather, else ``participants``; the unit is that of the property that it gives.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping

import pyoxigraph as ox

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import ROAD_END, SEVERITY, TIME_STEP
from bridgegen.openx.openscenario.from_owl.notes import EVENT, FINDINGS, PARAMETER, SIGNALS
from bridgegen.openx.openscenario.parameters import refers
from bridgegen.openx.openscenario.to_owl.build import NotExpressibleError, StoryBuilder
from bridgegen.openx.openscenario.to_owl.entities import as_number
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.ontology.vocabulary import bg, tbox
from bridgegen.scenario.weather import PARAMETERS

_WEATHER = frozenset(parameter.owl_property for parameter in PARAMETERS.values())
_LIMITS = {osc.Rule.GREATER_OR_EQUAL: "has_low", osc.Rule.LESS_OR_EQUAL: "has_high"}

Facts = dict[str, dict[str, list[osc.Property]]]


class Notes:
    """The header's properties (`bridgegen.openx.openscenario.from_owl.notes`).

    Attributes:
        time_step: the property of it, if there is one.
        road_end: likewise.
        severity: likewise.
        findings: by name, the properties on why it is critical.
        of: per kind (``parameter``, ``event``, ``signals``) and name, what is said, by its name.
    """

    def __init__(self, builder: StoryBuilder, header: osc.FileHeader) -> None:
        self.time_step: osc.Property | None = None
        self.road_end: osc.Property | None = None
        self.severity: osc.Property | None = None
        self.findings: dict[str, osc.Property] = {}
        self.of: dict[str, Facts] = {PARAMETER: {}, EVENT: {}, SIGNALS: {}}
        for property_ in () if header.properties is None else header.properties.properties:
            name = builder.text(property_.name)
            kind, _, rest = name.partition(".")
            which, _, what = rest.rpartition(".")
            if what.isdecimal():  # one of several
                which, _, what = which.rpartition(".")
            if name == TIME_STEP:
                self.time_step = self.time_step or property_
            elif name == ROAD_END:
                self.road_end = self.road_end or property_
            elif name == SEVERITY:
                self.severity = self.severity or property_
            elif name in FINDINGS:
                self.findings.setdefault(name, property_)
            elif kind in self.of and which:
                about = self.of[kind].setdefault(which, defaultdict(list))
                about[what].append(property_)


def add_parameters(builder: StoryBuilder, scenario: ox.NamedNode, notes: Notes) -> None:
    """Add the parameters, after all that is bound to them."""
    declared = builder.scenario_file.parameter_declarations
    ranges = (
        {}
        if declared is None
        else {declaration.name: declaration for declaration in declared.parameters}
    )
    for name in _categories(notes, ranges):
        with builder.attempt():
            builder.put(
                scenario, "has_parameter_declaration", _add_category(builder, ranges[name], notes)
            )
    bound: dict[str, dict[str, list[ox.NamedNode]]] = defaultdict(dict)
    for node, name, parameter in builder.bindings:
        bound[parameter].setdefault(name, []).append(node)
    free = set(builder.free)
    said = notes.of[PARAMETER]
    alone = [name for name, facts in said.items() if facts.get("value")]
    for name in dict.fromkeys([*builder.numbers, *alone]):
        with builder.attempt():
            facts = said.get(name, {})
            value = builder.numbers.get(name)
            if value is None:
                value = as_number(builder, facts["value"][0].value, facts["value"][0])
            node = _add_parameter(builder, name, value, facts, bound.get(name, {}))
            _put_range(builder, node, ranges.get(name))
            builder.put(scenario, "has_parameter_declaration", node)
            _check_clear(ranges.get(name), name, bound.get(name, {}), free)


def _categories(notes: Notes, declared: Mapping[str, osc.ParameterDeclaration]) -> Iterator[str]:
    """Yield the parameters that are categories: texts with an axis in the header."""
    for name in notes.of[PARAMETER]:
        declaration = declared.get(name)
        if declaration is not None and declaration.parameter_type is osc.ParameterType.STRING:
            yield name


def _add_category(
    builder: StoryBuilder, declaration: osc.ParameterDeclaration, notes: Notes
) -> ox.NamedNode:
    facts = notes.of[PARAMETER][declaration.name]
    node = builder.state(builder.reserve(f"p_{declaration.name}"), "Parameter")
    builder.put(node, "has_name", declaration.name)
    builder.put(node, "has_axis", _said(builder, facts, "axis", str(Axis.PARTICIPANTS)))
    builder.put(node, "has_unit", _said(builder, facts, "unit", "1"))
    for group in declaration.constraint_groups:
        for limit in group.constraints:
            builder.put(node, "has_allowed_word", builder.text(limit.value))
    builder.put(node, "has_word", builder.text(declaration.value))
    builder.put(node, "has_parameter", node)
    builder.put(node, "binds_property", "has_word")
    _constrain(builder, node, facts, ["has_word"])
    return node


def _add_parameter(
    builder: StoryBuilder,
    name: str,
    value: float,
    facts: dict[str, list[osc.Property]],
    bound: dict[str, list[ox.NamedNode]],
) -> ox.NamedNode:
    node = builder.parameters.get(name) or builder.reserve(f"p_{name}")
    formula = facts.get("expression")
    builder.state(node, "DerivedParameter" if formula else "Parameter")
    builder.put(node, "has_name", name)
    if formula:
        builder.put(node, "has_expression", builder.text(formula[0].value))
    if not bound:  # no other individual carries its value, so it does
        builder.put(node, "has_value", value)
        builder.put(node, "has_parameter", node)
    names = sorted(bound) or ["has_value"]
    for item in names:
        builder.put(node, "binds_property", item)
    axis = Axis.WEATHER if set(names) <= _WEATHER else Axis.PARTICIPANTS
    units = [tbox().units[item] for item in names if item in tbox().units]
    builder.put(node, "has_axis", _said(builder, facts, "axis", str(axis)))
    builder.put(node, "has_unit", _said(builder, facts, "unit", units[0] if units else "1"))
    _constrain(builder, node, facts, names)
    return node


def _constrain(
    builder: StoryBuilder,
    node: ox.NamedNode,
    facts: dict[str, list[osc.Property]],
    names: Iterable[str],
) -> None:
    """State a parameter's rules in the header."""
    for rule in facts.get("constraint", ()):
        text = builder.text(rule.value)
        builder.put(node, "constraint", text)
        for property_name in names:
            builder.quads.append(ox.Quad(bg(property_name), bg("constraint"), ox.Literal(text)))


def _said(
    builder: StoryBuilder, facts: dict[str, list[osc.Property]], what: str, usual: str
) -> str:
    if not facts.get(what):
        return usual
    fact = facts[what][0]
    text = builder.text(fact.value)
    if what == "axis" and text not in [axis.value for axis in Axis if axis != Axis.STATIC]:
        raise NotExpressibleError(fact, f"the axis '{text}' of a parameter")
    return text


def _put_range(
    builder: StoryBuilder, node: ox.NamedNode, declaration: osc.ParameterDeclaration | None
) -> None:
    """State the range that the first constraints give; what else there is the comparison finds."""
    if declaration is None or len(declaration.constraint_groups) != 1:
        return
    found: set[str] = set()
    for limit in declaration.constraint_groups[0].constraints:
        name = _LIMITS.get(limit.rule)
        if name is not None and name not in found and not refers(limit):
            found.add(name)
            builder.put(node, name, builder.now(float(limit.value), limit))


def _check_clear(
    declaration: osc.ParameterDeclaration | None,
    name: str,
    bound: dict[str, list[ox.NamedNode]],
    free: Iterable[tuple[ox.NamedNode, str]],
) -> None:
    """Make sure that an individual's own number is not taken for the parameter's.

    The ontology binds an individual to a parameter and the parameter to properties.

    Raises:
        NotExpressibleError: an individual has one property from the parameter, another not.
    """
    if len(bound) < 2 or declaration is None:
        return
    owned = {node for nodes in bound.values() for node in nodes}
    taken = set(free)
    if any((node, property_name) in taken for node in owned for property_name in bound):
        raise NotExpressibleError(
            declaration,
            f"the parameter {name}, which gives {' and '.join(sorted(bound))} by turns,",
        )
