"""From one row of X to individuals (Algorithm 1, steps 2.1 and 3.1).

The road network comes from the static parameters or from a `Site`; nothing else depends on the
static parameters, so one storyboard serves all road networks of a batch.
"""

import importlib.util
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.base.arrays import Float
from bridgegen.base.errors import BridgeGenError, InputError, OntologyError
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter, nearest
from bridgegen.scenario.language.roads import RoadsSpec
from bridgegen.scenario.ontology.builder import Builder, add_course
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.roads import add_road_network
from bridgegen.scenario.ontology.site import Site
from bridgegen.scenario.ontology.story import (
    EGO,
    add_event,
    add_jam,
    add_participant,
    add_perception,
    add_weather,
    add_works,
)
from bridgegen.scenario.ontology.templates import crossroads, site_of

if TYPE_CHECKING:
    from bridgegen.scenario.language.scenario import LogicalScenario

# --- Functions of a user's own that a scenario file names under ``effects`` ---
# Such a function is called with the `Builder` of each concrete scenario and the values of all its
# parameters, after the scenario's own individuals are there, and adds its own: with
# ``builder.quantity(node, property, "my_parameter")`` they carry a parameter's value, and so do the
# files that are made of them. It adds the same individuals whatever the values: one storyboard
# serves all rows.
#
# What a scenario file may run is limited to what its user has put there: a function of a Python
# file in the same folder, or one that an installed package offers by the entry point group
# ``bridgegen.effects``.


GROUP = "bridgegen.effects"
"""The entry point group of effects that packages offer."""

Effect = Callable[[Builder, Mapping[str, float]], None]


def apply_effect(spec: str, place: str, builder: Builder, values: Mapping[str, float]) -> None:
    """Let a user's function add its individuals.

    Args:
        spec: ``file.py:function``, beside the scenario's file, or the name of an entry point.
        place: the scenario's file.
        builder: holds the scenario's own individuals.
        values: of all parameters.

    Raises:
        InputError: there is no such function, or it failed.
    """
    function = _load(spec, str(Path(place).resolve().parent))
    try:
        function(builder, values)
    except BridgeGenError:
        raise
    except Exception as error:
        raise InputError(f"effect '{spec}' failed: {_described(error)} ({place})") from error


@lru_cache(maxsize=64)
def _load(spec: str, folder: str) -> Effect:
    source, _, name = spec.rpartition(":")
    if not source:
        return _offered(spec)
    if not source.endswith(".py") or Path(source).name != source or not name.isidentifier():
        raise InputError(
            f"an effect is 'file.py:function' beside the scenario's file, or the name of an entry "
            f"point of the group {GROUP}, got '{spec}'"
        )
    path = Path(folder) / source
    if not path.is_file():
        raise InputError(f"effect '{spec}': no such file: {path}")
    found = importlib.util.spec_from_file_location(f"bridgegen_effect_{path.stem}", path)
    assert found is not None  # of a .py file there is one
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    try:
        found.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"effect '{spec}': {source} fails: {_described(error)}") from error
    return _callable(spec, getattr(module, name, None))


def _offered(spec: str) -> Effect:
    """Return the function that an installed package offers by a name."""
    offered = {point.name: point for point in entry_points(group=GROUP)}
    if spec not in offered:
        raise InputError(
            f"no installed package offers the effect '{spec}'{nearest(spec, offered)}; a function "
            "of your own is 'file.py:function'"
        )
    try:
        return _callable(spec, offered[spec].load())
    except (ImportError, AttributeError) as error:
        raise InputError(f"effect '{spec}' cannot be loaded: {_described(error)}") from error


def _callable(spec: str, found: object) -> Effect:
    if not callable(found):
        raise InputError(f"effect '{spec}' must be a function, got {type(found).__name__}")
    effect: Effect = found
    return effect


def _described(error: Exception) -> str:
    """Return an error on one line, with the line of the user's file where it came up."""
    line, trace = 0, error.__traceback__
    while trace is not None:
        line, trace = trace.tb_lineno, trace.tb_next
    where = f", line {getattr(error, 'lineno', None) or line}"
    return f"{type(error).__name__}: {' '.join(str(error).split())}{where}"


def build(
    scenario: "LogicalScenario",
    values: Mapping[str, float],
    *,
    driver: str,
    ideal: str = "",
    odd: str = "",
    site: Site | None = None,
    courses: Mapping[str, Float] | None = None,
) -> Individuals:
    """Return the individuals of one concrete scenario.

    Args:
        scenario: the logical scenario.
        values: every parameter of it by name, derived ones included: a row of X. The static ones
            may be absent where ``site`` is given.
        driver: the ego's driver.
        ideal: its stages that are ideal, separated by commas.
        odd: the ego's, as `bridgegen.scenario.weather.limits_text` writes it.
        site: the intersection of a map that was made elsewhere; by default a crossroads is
            generated from the static parameters.
        courses: timed poses: ``(V, 4)`` time [s], x, y [m], heading [rad], by the name of
            a participant; rounded.

    Raises:
        OntologyError: ``values`` lacks a parameter, or the site a leg that the scenario uses.
        UnsupportedError: a participant of a type that has no class.
    """
    # An adversary's decisions are in the course that came of them.
    decisions = {*scenario.adversary.controls} if scenario.adversary else set()
    declared: dict[str, Parameter | Derived] = {
        name: parameter
        for name, parameter in (scenario.parameters | _derived(scenario)).items()
        if (site is None or parameter.axis != Axis.STATIC) and name not in decisions
    }
    missing = [name for name in declared if name not in values]
    if missing:
        raise OntologyError(*(f"{scenario.name}: {name} must have a value" for name in missing))
    builder = Builder(scenario.name, values)
    top = builder.scenario(scenario)
    put, story = builder.put, scenario.story
    place = site or site_of(scenario.roads, values)
    put(top, "has_road_network", add_road_network(builder, place))
    for participant in story.participants:
        put(top, "has_participant", add_participant(builder, participant, place, driver, ideal))
    add_perception(builder, story)
    if odd:
        put(builder.iri(EGO), "has_odd", odd)
    own = {event.name for event in story.events if event.participant == EGO}
    for event in story.events:
        if driver and event.participant == EGO:
            continue  # the driver decides
        for condition in (each for conditions in event.when for each in conditions):
            if driver and condition.event in own:
                raise InputError(
                    f"event '{event.name}' waits for '{condition.event}' of the ego, which "
                    f"{driver} drives ({scenario.place})"
                )
        put(top, "has_event", add_event(builder, event, declared, place))
    for name, course in (courses or {}).items():
        put(top, "has_event", add_course(builder, name, course))
    for jam in story.jams:
        put(top, "has_event", add_jam(builder, jam, place))
    for works in story.works:
        put(top, "has_event", add_works(builder, works, place))
    if weather := add_weather(builder, declared):
        put(top, "has_weather", weather)
    for effect in scenario.effects:
        apply_effect(effect, scenario.place, builder, values)
    for name, parameter in declared.items():
        put(top, "has_parameter_declaration", builder.parameter(name, parameter))
    constraints: list[Bound | Derived] = [*scenario.bounds, *scenario.derived]
    for rule in constraints:
        target = rule.target if isinstance(rule, Bound) else rule.name
        if target in declared:
            builder.explain(target, f"{rule}: {reason(rule)}")
    return Individuals(builder.quads)


def build_static(static: Mapping[str, float] | Site, roads: RoadsSpec | None = None) -> Individuals:
    """Return the individuals of a road network alone: all that OWL2OpenDRIVE needs.

    Args:
        static: the static parameters by name, or a site.
        roads: the template that they belong to; the paper's crossroads by default.
    """
    if isinstance(static, Site):
        site = static
    else:
        site = crossroads(static) if roads is None else site_of(roads, static)
    builder = Builder(site.name, {})
    add_road_network(builder, site)
    return Individuals(builder.quads)


def reason(rule: Bound | Derived) -> str:
    """Return a constraint's reason and source on one line."""
    return " ".join(f"{rule.why} (source: {rule.source.strip()})".split())


def _derived(scenario: "LogicalScenario") -> dict[str, Derived]:
    return {derived.name: derived for derived in scenario.derived}
