"""OpenSCENARIO2OWL: a storyboard as individuals, on those of its map (Algorithm 1, step 3, back).

Our own files come back as they were: the statements of layers 3 to 5 are those that the file was
written from, word for word. Other people's files come as far as the ontology can say them. What it
cannot is found in two ways, and all of it is named at once: by an element that no class or property
stands for, and by writing the individuals again (`bridgegen.openx.openscenario.from_owl`) and
comparing that file with the first, element by element. So nothing is lost without a word but

- the header's date and author, which are the file's and not the scenario's;
- labels: names of stories, acts, maneuver groups, maneuvers, actions, conditions, routes and
  environments, which nothing refers to;
- the order of entities, events and parameters;
- the static parameters, and how the map was generated: the road network comes back as the map that
  it is. Nothing in a storyboard depends on them.

What individuals must have and a file need not say is added: a time step (`DEFAULT_TIME_STEP`), the
range's unit and axis (`bridgegen.openx.openscenario.to_owl.parameters`).
"""

from collections.abc import Iterator
from pathlib import PurePath

import pyoxigraph as ox

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.openx.opendrive.map_names import road_name
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.to_owl import individuals_from_opendrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.declarations import DEFAULT_TIME_STEP
from bridgegen.openx.openscenario.from_owl.notes import EVENT, FINDINGS, SIGNALS
from bridgegen.openx.openscenario.from_owl.scenario import ARRIVAL, openscenario_from_owl
from bridgegen.openx.openscenario.from_owl.signals import LINKS, PASSED, Signals
from bridgegen.openx.openscenario.parameters import EGO
from bridgegen.openx.openscenario.read import fragment_of
from bridgegen.openx.openscenario.resolve import part_resolved
from bridgegen.openx.openscenario.to_owl.actions import signal_state
from bridgegen.openx.openscenario.to_owl.build import (
    ACTION,
    Lost,
    NotExpressibleError,
    StoryBuilder,
    numbered,
    quoted,
)
from bridgegen.openx.openscenario.to_owl.conditions import add_trigger
from bridgegen.openx.openscenario.to_owl.entities import (
    add_begun,
    add_element,
    add_participant,
    as_number,
)
from bridgegen.openx.openscenario.to_owl.events import (
    Happening,
    add_changes,
    add_events,
    happenings,
)
from bridgegen.openx.openscenario.to_owl.legs import stretches, with_legs
from bridgegen.openx.openscenario.to_owl.losses import losses
from bridgegen.openx.openscenario.to_owl.parameters import Facts, Notes, add_parameters
from bridgegen.openx.openscenario.to_owl.simplified import simplified, without_foregone
from bridgegen.openx.openscenario.to_owl.weather import add_weather
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import bg

# --- OpenSCENARIO2OWL, its traffic lights: controllers with their phases ---


_LINK_OF = {state: link for link, state in LINKS.items()} | {"red": None}


def add_controllers(builder: StoryBuilder, network: ox.NamedNode, said: Facts) -> list[str]:
    """Add the controllers of the road network's lights; return the names of those added.

    Args:
        builder: where to.
        network: the map's.
        said: by a controller's name, what the header says of it.
    """
    signals = builder.scenario_file.road_network.traffic_signals
    done: list[str] = []
    switched: set[str] = set()
    for controller in () if signals is None else signals.controllers:
        name = builder.text(controller.name)
        with builder.attempt():
            if name in done:
                raise NotExpressibleError(controller, f"a second TrafficSignalController {name}")
            lights = _add_controller(builder, network, name, controller, said.get(name, {}))
            if switched & lights:
                raise NotExpressibleError(
                    controller, f"a second TrafficSignalController of {min(lights)}"
                )
            switched |= lights
            done.append(name)
    return done


def _add_controller(
    builder: StoryBuilder,
    network: ox.NamedNode,
    name: str,
    controller: osc.TrafficSignalController,
    facts: dict[str, list[osc.Property]],
) -> set[str]:
    node = builder.node(name, "SignalController")
    builder.put(network, "has_signal_controller", node)
    builder.put(node, "has_name", name)
    passed = facts.get("offset")
    offset = as_number(builder, passed[0].value, passed[0]) if passed else 0.0
    if not controller.phases:
        raise NotExpressibleError(controller, f"the TrafficSignalController {name} without a Phase")
    parts = [(phase, builder.now(phase.duration, phase)) for phase in controller.phases]
    (first, lasts), (last, ended) = parts[0], parts[-1]
    # The phase that runs at time 0 is in two parts; files of earlier versions have it whole.
    if 0.0 < offset == ended and builder.text(last.name) == builder.text(first.name) + PASSED:
        parts = [(first, lasts + offset), *parts[1:-1]]
    shown = [
        {builder.text(state.traffic_signal_id): state for state in phase.traffic_signal_states}
        for phase, _ in parts
    ]
    lights = set(shown[0])
    for light in sorted(lights):
        builder.put(node, "has_light", builder.light(light, shown[0][light]))
    if passed is not None and not 0.0 <= offset < parts[0][1]:
        raise NotExpressibleError(
            passed[0], f"an offset of {offset!r} s, not within the first Phase,"
        )
    builder.put(node, "has_offset", offset)
    for number, ((phase, duration), states) in enumerate(zip(parts, shown, strict=True), start=1):
        if set(states) != lights:
            raise NotExpressibleError(
                phase, "a Phase that does not state every light of its controller"
            )
        if duration <= 0.0:
            raise NotExpressibleError(phase, f"a Phase of {duration!r} s")
        part = builder.node(f"{name}_phase_{number}", "SignalPhase")
        builder.put(node, "has_phase", part)
        builder.put(part, "has_index", number)
        builder.put(part, "has_name", builder.text(phase.name))
        builder.put(part, "has_duration", duration)
        for light, state in states.items():
            said = signal_state(builder, state.state, state)
            if said not in _LINK_OF:
                raise NotExpressibleError(state, f"a Phase in which a light is {said}")
            link = _LINK_OF[said]
            if link is not None:
                builder.put(part, link, builder.light(light, state))
    return lights


DURATION = 60.0
"""Duration of a file whose stop trigger names no time, if that is accepted [s]."""

MAX_PROBLEMS = 50
_SHOWN = 6  # details that are named


def individuals_from_openscenario(
    scenario: osc.OpenScenario,
    roads: OpenDrive,
    map_file: str,
    place: str = "document",
    *,
    partial: bool = False,
    in_substance: bool = False,
) -> tuple[Individuals, list[str]]:
    """Return the individuals of a scenario file, and its contents that they lack.

    Args:
        scenario: the file, as `bridgegen.openx.openscenario.read` returns it.
        roads: the map that it names.
        map_file: the path that the map has, seen from the ontology's file.
        place: the file's name, for messages.
        partial: leave out what cannot be said, instead of refusing the whole.
        in_substance: leave out what nothing depends on that happens, and state expressions by the
            values that they have.

    Returns:
        The individuals, and a sentence for each thing left out; one for all details together.

    Raises:
        UnsupportedError: contents cannot be expressed (at most 50 problems are named); also if
            ``partial``, if there is no entity ``ego`` that can.
    """
    lost: list[Lost] = []
    if in_substance:
        scenario, foregone = without_foregone(scenario)
        scenario, lost = simplified(scenario, roads)
        lost += foregone
    importer = _Importer(scenario, roads, map_file, in_substance)
    individuals = importer.build()
    missing = list(importer.problems(individuals))
    # A second pass: what the comparison found to be lost (a flag, a coordinate system) is quoted as
    # XML at its place. It is taken only where less is lost then.
    if in_substance and (lines := frozenset(item.line for item in missing if not item.is_detail)):
        again = _Importer(scenario, roads, map_file, in_substance, lines - {0})
        quoted = again.build()
        still = list(again.problems(quoted))
        if _count(still) + len(again.refused) < _count(missing) + len(importer.refused):
            importer, individuals, missing = again, quoted, still
    found = dict.fromkeys((*lost, *missing))
    problems = sorted(found, key=lambda item: item.line)
    details = [item for item in problems if item.is_detail and in_substance]
    sentences = [
        f"{place}: {item.text} cannot be said in the ontology"
        + (f" (line {item.line})" if item.line else "")
        for item in problems
        if item not in details
    ]
    sentences += [f"{place}: {problem}" for problem in importer.refused]
    if EGO not in importer.builder.cast:
        known = ", ".join(importer.builder.cast) or "none"
        sentences.append(f"{place}: one entity must have the name {EGO}, got {known}")
        partial = False
    if sentences and not partial:
        more = len(sentences) - MAX_PROBLEMS
        shown = sentences[:MAX_PROBLEMS] + ([f"… and {more} more problems"] if more > 0 else [])
        raise UnsupportedError(*shown)
    return individuals, [*sentences, *_of_details(place, details)]


def _count(lost: list[Lost]) -> int:
    """Return how many of the things that are lost are no details."""
    return sum(not item.is_detail for item in lost)


def _of_details(place: str, details: list[Lost]) -> Iterator[str]:
    """Yield a sentence on details, if there are any: the first ones, and how many more."""
    if details:
        shown = ", ".join(detail.text for detail in details[:_SHOWN])
        more = f" and {len(details) - _SHOWN} more" if len(details) > _SHOWN else ""
        yield f"{place}: details on which nothing depends that happens: {shown}{more}"


class _Importer:
    """States the parts of a file in their order, then compares."""

    def __init__(
        self,
        scenario: osc.OpenScenario,
        roads: OpenDrive,
        map_file: str,
        in_substance: bool,
        quoted_lines: frozenset[int] = frozenset(),
    ) -> None:
        self.scenario, self.map_file = scenario, map_file
        header = scenario.file_header
        self.name = parameters.text_of(parameters.values(scenario), header.description)
        self.builder = StoryBuilder(
            self.name or PurePath(map_file).stem,
            scenario,
            roads,
            in_substance=in_substance,
            quoted_lines=quoted_lines,
        )
        self.builder.legs = stretches(roads, self._ends_of_way())
        signals = scenario.road_network.traffic_signals
        whole = individuals_from_opendrive(
            roads,
            map_file,
            name=self.name or PurePath(map_file).stem,
            controllers=signals is None or not signals.controllers,
        )
        nodes = {leg: self.builder.iri(road_name(leg)) for leg in self.builder.legs}
        self.static = tuple(with_legs(self.builder.legs, nodes, whole.quads))
        self.derived: dict[str, osc.Event] = {}
        self.stated: set[str] = set()
        self.happenings: list[Happening] = []
        self.controllers: list[str] = []
        self.refused: list[str] = []

    def _ends_of_way(self) -> set[str]:
        """Return the ids of the roads on which the ego starts and on which its route ends."""
        builder, positions = self.builder, []
        for private in self.scenario.storyboard.init.actions.privates:
            for wrapped in private.private_actions if private.entity_ref == EGO else ():
                action = wrapped.action
                if isinstance(action, osc.TeleportAction):
                    positions.append(action.position.position)
                elif isinstance(action, osc.RoutingAction) and isinstance(
                    action.action, osc.AssignRouteAction
                ):
                    positions.append(action.action.route.waypoints[-1].position.position)
        return {
            builder.text(position.road_id)
            for position in positions
            if isinstance(position, osc.LanePosition)
        }

    def build(self) -> Individuals:
        """Return the individuals."""
        builder, put = self.builder, self.builder.put
        notes = Notes(builder, self.scenario.file_header)
        node = builder.node("scenario", "Scenario")
        put(node, "has_name", self.name or PurePath(self.map_file).stem)
        duration = self._put_times(node, notes)
        network = builder.iri("road_network")
        put(node, "has_road_network", network)
        elements = self._elements(notes)
        self._add_variables(node)
        self._add_entities(node, elements)
        self.controllers = add_controllers(builder, network, notes.of[SIGNALS])
        lights = self._lights(duration)
        self.derived = {
            str(event.name): event
            for group in lights.maneuver_groups()
            for maneuver in group.maneuvers
            for event in maneuver.events
        }
        for happening in happenings(builder):
            # Events that follow from the controllers' phases are written beside them for readers
            # that do not run phases; stated twice, they would come back twice.
            if self.derived.get(happening.name) != happening.event:
                self.happenings.append(happening)
        self.stated = add_events(builder, node, self.happenings)
        self._put_stop(node)
        add_changes(builder, node, notes.of[EVENT], elements)
        self._add_globals(node)
        add_parameters(builder, node, notes)
        return Individuals([*self.static, *builder.quads])

    def _put_times(self, node: ox.NamedNode, notes: Notes) -> float:
        """State how long the scenario lasts, and its step; return the duration [s]."""
        builder, step = self.builder, DEFAULT_TIME_STEP
        if notes.time_step is not None:
            with builder.attempt():
                step = as_number(builder, notes.time_step.value, notes.time_step)
        builder.put(node, "has_time_step", step)
        if notes.road_end is not None:
            with builder.attempt():
                builder.put(node, "has_road_end", builder.text(notes.road_end.value))
        for name, found in notes.findings.items():
            with builder.attempt():
                builder.put(node, FINDINGS[name], builder.text(found.value))
        if notes.severity is not None:
            with builder.attempt():
                severity = as_number(builder, notes.severity.value, notes.severity)
                builder.put(node, "has_severity", severity)
        stop = self.scenario.storyboard.stop_trigger
        for group in () if stop is None else stop.condition_groups:
            if (time := _time_alone(group)) is not None:
                with builder.attempt():
                    builder.number(node, "has_duration", time.value, time)
                    return builder.now(time.value, time)
        line = self.scenario.storyboard.line if stop is None else stop.line
        text = (
            f"a Storyboard that no SimulationTimeCondition alone stops (it ends at {DURATION:g} s)"
        )
        builder.problems.append(Lost(line, text, is_detail=True))
        builder.put(node, "has_duration", DURATION)
        return DURATION

    def _add_variables(self, node: ox.NamedNode) -> None:
        builder, declared = self.builder, self.scenario.variable_declarations
        if declared is None or not builder.in_substance:
            return
        for declaration in part_resolved(declared, self.scenario, "document").variables:
            variable = builder.node(f"v_{declaration.name}", "Variable")
            builder.put(variable, "has_name", declaration.name)
            builder.put(variable, "has_openscenario", fragment_of(declaration))
            builder.put(node, "has_variable", variable)
            builder.variables.add(declaration.name)

    def _put_stop(self, node: ox.NamedNode) -> None:
        """State what else than the time ends the scenario; the ego's arrival follows from its way.

        What cannot be said is a detail: it says when one looks no further.
        """
        builder, stop = self.builder, self.scenario.storyboard.stop_trigger
        if stop is None or not builder.in_substance:
            return
        arrives = any(map(self._is_arrival, stop.condition_groups))
        if not arrives and self._has_way():
            builder.put(node, "has_arrival", "goes-on")
        groups = tuple(
            group
            for group in stop.condition_groups
            if _time_alone(group) is None and not (arrives and self._is_arrival(group))
        )
        before = len(builder.problems)
        with builder.attempt():
            if groups:
                trigger = add_trigger(builder, "stop", (), osc.Trigger(groups))
                builder.put(node, "has_stop", trigger)
        builder.problems[before:] = [
            problem._replace(is_detail=True) for problem in builder.problems[before:]
        ]

    def _is_arrival(self, group: osc.ConditionGroup) -> bool:
        """Return whether the ego's arrival ends the scenario, as that of its route does."""
        (condition, *others) = (each.condition for each in group.conditions)
        return (
            not others
            and isinstance(condition, osc.ByEntityCondition)
            and isinstance(condition.entity_condition.condition, osc.ReachPositionCondition)
            and condition.entity_condition.condition.tolerance == ARRIVAL
            and [
                self.builder.text(each.entity_ref)
                for each in condition.triggering_entities.entity_refs
            ]
            == [EGO]
            and self._has_way()
        )

    def _has_way(self) -> bool:
        """Return whether the ego has a route that is stated."""
        ego, route = self.builder.cast.get(EGO), bg("has_route")
        return any((quad.subject, quad.predicate) == (ego, route) for quad in self.builder.quads)

    def _elements(self, notes: Notes) -> dict[str, str]:
        """Return the things at road works, each with whose they are."""
        builder = self.builder
        return {
            builder.text(property_.value): name
            for name, facts in notes.of[EVENT].items()
            if any(builder.text(said.value) == "RoadWorks" for said in facts.get("class", ()))
            for property_ in facts.get("element", ())
        }

    def _add_entities(self, node: ox.NamedNode, elements: dict[str, str]) -> None:
        builder = self.builder
        starts: dict[str, list[osc.PrivateAction]] = {}
        for private in self.scenario.storyboard.init.actions.privates:
            name = builder.text(private.entity_ref)
            starts.setdefault(name, []).extend(private.private_actions)
        stated: list[osc.ScenarioObject] = []
        for obj in self.scenario.entities.scenario_objects:
            name = builder.text(obj.name)
            if name in builder.cast:
                builder.problems.append(Lost(obj.line, f"a second entity of the name {name}"))
                continue
            with builder.attempt():
                add = add_element if name in elements else add_participant
                entity = add(builder, obj, tuple(starts.get(name, ())))
                if name not in elements:
                    builder.put(node, "has_participant", entity)
                builder.cast[name] = entity
                stated.append(obj)
        for obj in stated:
            name = builder.text(obj.name)
            if name not in elements:
                add_begun(builder, obj, tuple(starts.get(name, ())))

    def _lights(self, duration: float) -> Signals:
        """Return what the controllers that are stated make of the lights."""
        quads = [*self.static, *self.builder.quads]
        return Signals(Individuals(quads), duration)

    def _add_globals(self, node: ox.NamedNode) -> None:
        """State the weather at the start, and quote what else the scenario begins with."""
        builder, begun = self.builder, False
        globals_ = self.scenario.storyboard.init.actions.global_actions
        for number, action in zip(numbered(len(globals_)), globals_, strict=True):
            if isinstance(action.action, osc.EnvironmentAction) and not begun:
                begun = True
                with builder.attempt():
                    weather = add_weather(builder, action.action.environment)
                    if weather is not None:
                        builder.put(node, "has_weather", weather)
                    elif builder.in_substance:
                        self._quote_global(node, number, action)
            elif action.line in builder.quoted_lines:
                with builder.attempt():
                    self._quote_global(node, number, action)

    def _quote_global(
        self, node: ox.NamedNode, number: str, global_action: osc.GlobalAction
    ) -> None:
        what = quoted(self.builder, f"global_action_{number}", ACTION, global_action)
        self.builder.put(node, "has_global_action", what)

    # -- losses ------------------------------------------------------------------------------------

    def problems(self, individuals: Individuals) -> Iterator[Lost]:
        """Yield lines, and their contents that the individuals lack."""
        builder = self.builder
        yield from builder.problems
        entities = {builder.text(obj.name) for obj in self.scenario.entities.scenario_objects}
        for private in self.scenario.storyboard.init.actions.privates:
            if (name := builder.text(private.entity_ref)) not in entities:
                yield Lost(private.line, f"Private of {name}, which is no entity,")
        if EGO not in builder.cast:
            return
        file = self.scenario.road_network.logic_file
        try:
            # Written again and compared: what no class stands for is not found by elements alone,
            # for an attribute may be lost of one that a class does stand for.
            again = openscenario_from_owl(individuals, "" if file is None else str(file.filepath))
        except InputError as error:
            self.refused += error.problems
            return
        stated = [happening for happening in self.happenings if happening.name in self.stated]
        yield from losses(builder, again, self.controllers, stated)


def _time_alone(group: osc.ConditionGroup) -> osc.SimulationTimeCondition | None:
    """Return the one condition of a group if it is on the time."""
    if len(group.conditions) != 1:
        return None
    condition = group.conditions[0]
    if condition.condition_edge is osc.ConditionEdge.FALLING or condition.delay != 0.0:
        return None
    wrapped = condition.condition
    parameter_condition = wrapped.condition if isinstance(wrapped, osc.ByValueCondition) else None
    if not isinstance(parameter_condition, osc.SimulationTimeCondition):
        return None
    return (
        parameter_condition
        if parameter_condition.rule in (osc.Rule.GREATER_OR_EQUAL, osc.Rule.GREATER_THAN)
        else None
    )
