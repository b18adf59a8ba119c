"""From one row of X to individuals (Algorithm 1, steps 2.1 and 3.1).

The road network comes from the static parameters or from a `Site`; nothing else depends on the
static parameters, so one storyboard serves all road networks of a batch.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bridgegen.errors import OntologyError
from bridgegen.odd.parameters import Axis, Bound, Derived, Parameter
from bridgegen.ontology.builder import Builder
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.site import Site

if TYPE_CHECKING:
    from bridgegen.odd.scenario import LogicalScenario


def build(
    scenario: "LogicalScenario",
    values: Mapping[str, float],
    *,
    driver: str,
    site: Site | None = None,
) -> Individuals:
    """Return the individuals of one concrete scenario.

    Args:
        scenario: the logical scenario.
        values: every parameter of it by name, derived ones included: a row of X. The static ones
            may be absent where ``site`` is given.
        driver: the ego's driver.
        site: the intersection of a map that was made elsewhere; by default a crossroads is
            generated from the static parameters.

    Raises:
        OntologyError: ``values`` lacks a parameter, or the site a leg that the scenario uses.
        UnsupportedError: a participant of a type that has no class.
    """
    declared: dict[str, Parameter | Derived] = {
        name: parameter
        for name, parameter in (scenario.parameters | _derived(scenario)).items()
        if site is None or parameter.axis != Axis.STATIC
    }
    missing = [name for name in declared if name not in values]
    if missing:
        raise OntologyError(*(f"{scenario.name}: {name} must have a value" for name in missing))
    builder = Builder(scenario.name, values)
    top = builder.scenario(scenario)
    place = site or Site.generated(values, scenario.template)
    builder.put(top, "has_road_network", builder.road_network(place))
    if site is None:
        builder.bind_static(place, declared)
    for participant in scenario.participants:
        builder.put(top, "has_participant", builder.participant(participant, place, driver))
    for event in scenario.events:
        builder.put(top, "has_event", builder.event(event))
    if weather := builder.weather(declared):
        builder.put(top, "has_weather", weather)
    for name, parameter in declared.items():
        builder.put(top, "has_parameter_declaration", builder.parameter(name, parameter))
    constraints: list[Bound | Derived] = [*scenario.bounds, *scenario.derived]
    for rule in constraints:
        target = rule.target if isinstance(rule, Bound) else rule.name
        if target in declared:
            builder.explain(target, f"{rule}: {reason(rule)}")
    return Individuals(builder.quads)


def build_static(static: Mapping[str, float] | Site) -> Individuals:
    """Return the individuals of a road network alone: all that OWL2OpenDRIVE needs.

    Args:
        static: the static parameters by name (`Site.generated`), or a site.
    """
    site = static if isinstance(static, Site) else Site.generated(static)
    builder = Builder(site.name, {})
    builder.road_network(site)
    return Individuals(builder.quads)


def reason(rule: Bound | Derived) -> str:
    """Return why a constraint holds and who says so, on one line."""
    return " ".join(f"{rule.why} (source: {rule.source.strip()})".split())


def _derived(scenario: "LogicalScenario") -> dict[str, Derived]:
    return {derived.name: derived for derived in scenario.derived}
