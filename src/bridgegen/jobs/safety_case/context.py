"""What a run was made of, and what its results assume: contexts, assumptions, justifications."""

from collections.abc import Iterator, Sequence
from importlib.metadata import version

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.assess.conflict.summary import CAREFUL_DRIVER
from bridgegen.drivers import STORYBOARD, is_spec
from bridgegen.jobs.safety_case.builder import Draft
from bridgegen.jobs.safety_case.facts import Facts, Files
from bridgegen.pages.scenario_page import story_lines
from bridgegen.pages.templates import counted
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.simulation.choice import EMBEDDED

LIMITS = "limits.md"

_UNITLESS = ("", "1", "?", "count")


def add_context(top: Draft, facts: Facts, files: Files) -> None:
    """Add what the goal of a run is stated in the context of."""
    at, scenario, settings = top.at, facts.scenario, facts.run.settings
    searched = [scenario.parameters[name] for name in facts.space.variables]
    inputs = [f"file {input_}" for input_ in files.inputs]
    top.add(
        "Context",
        f"{at}.1",
        f"What was searched: {scenario.name}, {counted(len(searched), 'parameter')} over the "
        "declared ranges, within the declared constraints.",
        details=[
            scenario.title,
            f"digest of the scenario {settings.fingerprint}",
            *inputs,
            *map(_range, searched),
            *(f"constraint {bound}: {bound.why} ({bound.source})" for bound in scenario.bounds),
            *(
                f"derived {derived}: {derived.why} ({derived.source})"
                for derived in scenario.derived
            ),
        ],
        link="scenarios.md",
    )
    top.add(
        "Context",
        f"{at}.2",
        f"Operational design domain: {scenario.title}{_road(facts)}; {_weather(facts)}.",
        details=[*_environment(facts)],
        link="scenarios.md",
    )
    driver = [f"its code: file {files.driver}"] if files.driver else []
    top.add(
        "Context",
        f"{at}.3",
        f"System under test: {facts.ego}, simulated by {settings.simulator.name}.",
        details=[
            f"driver {settings.ego}",
            *driver,
            f"other participants: {settings.others or 'as the scenario declares'}",
            f"participant whose course the search decides: {settings.adversary or 'none'}",
            f"time limit: {settings.time_limit or 'that of the scenario'}",
            f"map: {settings.road_map or 'that of the scenario'}"
            + (f", digest {settings.map_digest}" if settings.map_digest else ""),
        ],
        link="drivers.md",
    )
    top.add(
        "Context",
        f"{at}.4",
        f"Search: {settings.algorithm}, seed {settings.seed}, budget {settings.budget}, BridgeGen "
        f"{facts.run.version}.",
        details=[
            f"settings: {', '.join(f'{k} = {v}' for k, v in settings.settings.items()) or 'none'}",
            f"digest of all evaluations {facts.triage.results}",
        ],
        link="algorithms.md",
    )
    top.add("Context", f"{at}.5", _failure(facts), link="failure-modes.md")


def _failure(facts: Facts) -> str:
    whose = "that it is responsible for, or that a careful driver would have prevented"
    if facts.triage.count == "any":
        whose = "whoever is responsible"
    cause = facts.run.settings.cause
    only = f" Only failures with the root cause {cause} count." if cause else ""
    return (
        f"A failure of {facts.ego}: a collision or a near miss of the ego, {whose}, or "
        f"that it leaves its lane or the road, or passes a cyclist or pedestrian too closely, in "
        f"plausible traffic: harm of {NEAR_MISS:g} or more.{only}"
    )


def _road(facts: Facts) -> str:
    """Return the kind of road, as far as the scenario declares one."""
    if facts.run.settings.road_map is not None:
        return ", on a map"
    if isinstance(facts.scenario, LogicalScenario):
        return f", on a generated road ({facts.scenario.roads.template})"
    return ", on the scenario file's map"


def _weather(facts: Facts) -> str:
    """Return which parameters of the weather vary."""
    names = [
        name
        for name in facts.space.variables
        if facts.scenario.parameters[name].axis == Axis.WEATHER
    ]
    return f"weather varies in {', '.join(names)}" if names else "weather does not vary"


def _environment(facts: Facts) -> Iterator[str]:
    """Yield the road, the traffic, and the weather as it varies or stands."""
    scenario, space = facts.scenario, facts.space
    yield scenario.description
    if isinstance(scenario, LogicalScenario):
        yield from story_lines(scenario)
    for parameter in scenario.parameters.values():
        if parameter.name not in space.variables:
            yield (
                f"{parameter.name} = {_value(parameter, space.defaults[parameter.name])} "
                f"({parameter.axis}, not searched)"
            )
    if not any(parameter.axis == Axis.WEATHER for parameter in scenario.parameters.values()):
        yield "no weather parameters"


def _range(parameter: Parameter) -> str:
    span = parameter.kind.span_text(parameter.low, parameter.high, "{:g}".format, _unit(parameter))
    source = f" ({parameter.source})" if parameter.source else ""
    return f"parameter {parameter.name}: {parameter.axis}, {span}{source}"


def _value(parameter: Parameter, value: float) -> str:
    return parameter.kind.text(value, "{:g}".format) + (
        "" if parameter.kind.names else _unit(parameter)
    )


def _unit(parameter: Parameter) -> str:
    return "" if parameter.unit in _UNITLESS else f" {parameter.unit}"


def add_assumptions(strategy: Draft, egos: list[Facts]) -> None:
    """Add what the results of runs assume of the world: the limits of the simulation."""
    for number, (text, place) in enumerate(assumptions(egos), start=1):
        strategy.add("Assumption", f"{strategy.at}.{number}", text, link=f"{LIMITS}{place}")


def assumptions(runs: Sequence[Facts]) -> Iterator[tuple[str, str]]:
    """Yield what the results of runs assume of the world, and the place in the limits of each."""
    simulators = {run.run.settings.simulator.name for run in runs}
    if EMBEDDED.name in simulators:
        yield (
            "The ego moves as a kinematic bicycle with limits of speed, acceleration, curvature "
            "and friction: no suspension, tyre slip or actuator delay. Bodies are boxes.",
            "#vehicle-model",
        )
    for name in sorted(simulators - {EMBEDDED.name}):
        yield f"The motion of vehicles is as {name} simulates it.", "#other-simulators"
    yield (
        "Sensors are models of detection, without images, false positives or radar.",
        "#sensors",
    )
    yield (
        "Other participants follow scripted paths and at most adapt speed and timing. No recorded "
        "traffic stands behind the ranges.",
        "#traffic-behaviour",
    )
    yield (
        "There is no exposure model: a share of the space is no rate of failures on roads.",
        "#in-short",
    )
    yield (
        "Responsibility follows from German law where rules differ, but for who goes first where a "
        "country is stated; in a mirror where traffic drives on the left; what "
        f"a careful driver prevents is judged by {CAREFUL_DRIVER}.",
        "#traffic-behaviour",
    )
    if any(run.run.settings.ego == "un-r157" for run in runs):
        yield (
            "The driver un-r157 follows the careful driver's own model: that it prevents what a "
            "careful driver prevents says little about it.",
            "#sotif-un-r157-euro-ncap",
        )
    if any(is_spec(run.run.settings.ego) for run in runs):
        yield (
            "The code of the driver is still what drove in the run: a run records the driver's "
            "name, and the digest of its file is that of the export.",
            "",
        )
    if any(run.run.settings.ego == STORYBOARD.name for run in runs):
        yield "The scenario's own storyboard moves the ego; no system is under test.", ""


def justification() -> str:
    """Return why a search is evidence at all."""
    return (
        "A simulated failure refutes a claim of safety; simulations without one bound the share "
        "that may remain. A search is no proof of absence."
    )


def generator() -> str:
    """Return what writes the case."""
    return f"BridgeGen {version('bridgegen')}"
