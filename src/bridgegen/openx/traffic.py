"""Traffic that a storyboard asks for at its start: sources, sinks and swarms, vehicle by vehicle.

Each vehicle is drawn beforehand. It is an entity of its own, with the attentive driver and a random
route, so that it is simulated, recorded and looked at like any other. The numbers follow from the
action's name, and are the same in every row.
"""

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.lanes import borders, section_end
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import DRIVER
from bridgegen.openx.openscenario.element import Element, references
from bridgegen.openx.openscenario.to_owl.starts import Starts
from bridgegen.scenario.language.adversary import ATTENTIVE
from bridgegen.scenario.participants import PARTICIPANTS, Body

MOST = 100
"""Largest number of vehicles of all traffic of a file."""
STEP = 5.0
"""Distance between two places on a lane at which a vehicle may start [m]."""
APART = 15.0
"""Least distance between the reference points of two vehicles at the start [m]; ours."""
LASTS = 60.0
"""Time for which a source emits vehicles where the scenario does not end by time [s]."""
FASTEST = 100.0
"""Largest speed of traffic [m/s]."""
NAMED = "traffic"

_CATEGORIES = {
    "car": "car",
    "van": "van",
    "truck": "truck",
    "bus": "bus",
    "motorbike": "motorcycle",
}
"""Kinds of bodies by the kind of vehicle that traffic may be made of."""

Source = osc.TrafficSourceAction | osc.TrafficSwarmAction
Made = tuple[osc.ScenarioObject, osc.Private, osc.GlobalAction | None, float]


class _Places(NamedTuple):
    """Places on drivable lanes: ``(G,)`` each; x, y [m], heading of the traffic [rad]."""

    x: Float
    y: Float
    h: Float
    on: Sequence[osc.LanePosition]


def populated(scenario: osc.OpenScenario, roads: OpenDrive, place: str) -> osc.OpenScenario:
    """Return a scenario with the vehicles of its initial traffic actions instead of these.

    Args:
        scenario: any scenario; one without such actions comes back as it is.
        roads: its map.
        place: what to call the scenario in messages.

    Raises:
        FileFormatError: what cannot be populated, by line.
    """
    actions = scenario.storyboard.init.actions
    if not any(
        isinstance(_asked(action), Source | osc.TrafficSinkAction)
        for action in actions.global_actions
    ):
        return scenario
    return _Populated(scenario, roads, place).scenario


def _asked(global_action: osc.GlobalAction) -> Element | None:
    """Return what traffic an action asks for; None if it is about something else."""
    return (
        global_action.action.action if isinstance(global_action.action, osc.TrafficAction) else None
    )


class _Populated:
    def __init__(self, scenario: osc.OpenScenario, roads: OpenDrive, place: str) -> None:
        self._roads, self._place = roads, place
        self._starts = Starts(scenario, scenario.storyboard.init.actions, roads)
        self._places = _places(roads)
        self._taken: list[tuple[float, float]] = []
        self._problems: list[str] = []
        self._lasts = _end(scenario, self._starts) or LASTS
        actions = scenario.storyboard.init.actions
        for private in actions.privates:
            pose = self._pose(self._starts.text(private.entity_ref), actions)
            self._taken += [pose[:2]] if pose else []
        kept: list[osc.GlobalAction] = []
        made: list[Made] = []
        sinks: list[osc.TrafficSinkAction] = []
        for number, global_action in enumerate(actions.global_actions):
            action = _asked(global_action)
            if isinstance(action, osc.TrafficSinkAction):
                sinks.append(action)
            elif isinstance(global_action.action, osc.TrafficAction) and isinstance(action, Source):
                name = self._starts.text(
                    global_action.action.traffic_name or f"{NAMED}_{number + 1}"
                )
                try:
                    _check_constant(action)
                    made += self._vehicles(name, action, actions)
                except (InputError, ValueError) as error:
                    self._problems.append(f"{place}: {error} (line {action.line})")
            else:
                kept.append(global_action)
        if len(made) > MOST:
            self._problems.append(
                f"{place}: all traffic may have {MOST} vehicles, got {len(made)}: lower rates, "
                "numbers, or an earlier end"
            )
        names = [str(pair[0].name) for pair in made]
        events = [*_arrivals(made), *(e for sink in sinks for e in self._departures(sink, names))]
        if self._problems:
            raise FileFormatError(*self._problems)
        self.scenario = _with(scenario, kept, made, events)

    def _pose(self, name: str, actions: osc.InitActions) -> tuple[float, float, float] | None:
        """Return where an entity starts: x, y [m], heading [rad]; None where it is not known."""
        for private in actions.privates:
            for action in private.private_actions:
                if isinstance(action.action, osc.TeleportAction) and (
                    self._starts.text(private.entity_ref) == name
                ):
                    return self._starts.pose(action.action.position)
        return None

    def _vehicles(self, name: str, action: Source, actions: osc.InitActions) -> Iterator[Made]:
        # Not `hash`: that of a text differs from process to process, and runs on several workers
        # must get the same vehicles.
        seed = hashlib.sha256(name.encode()).digest()[:8]
        random = np.random.default_rng(int.from_bytes(seed, "big"))
        kinds = _kinds(action, self._starts)
        if isinstance(action, osc.TrafficSourceAction):
            yield from self._of_source(name, action, random, kinds)
        else:
            yield from self._of_swarm(name, action, random, kinds, actions)

    def _of_source(
        self,
        name: str,
        action: osc.TrafficSourceAction,
        random: np.random.Generator,
        kinds: "_Kinds",
    ) -> Iterator[Made]:
        """Yield the vehicles that come at a place, one after the other."""
        rate, radius = (self._starts.number(value) for value in (action.rate, action.radius))
        said = action.speed if action.speed is not None else action.velocity
        speed = 0.0 if said is None else self._starts.number(said)
        _check_speed(speed)
        at = self._starts.pose(action.position)
        if at is None:
            raise InputError("a TrafficSourceAction needs a position on the map")
        if rate <= 0.0:
            raise InputError(f"rate [1/s] of a source must be greater than 0, got {rate:g}")
        away = elementary.hypot(self._places.x - at[0], self._places.y - at[1])
        # Places are STEP apart: a source of a smaller radius, or of none, would miss them all.
        near = np.flatnonzero(away <= max(radius, STEP))
        if not near.size:
            raise InputError(f"no lane is within {radius:g} m of the source")
        if rate * self._lasts > MOST:
            raise InputError(
                f"a source of {rate:g} a second gives {rate * self._lasts:.0f} vehicles in "
                f"{self._lasts:g} s, {MOST} at most are possible"
            )
        for k in range(math.floor(rate * self._lasts) + 1):
            where = osc.Position(self._places.on[int(random.choice(near))])
            yield self._made(f"{name}_{k + 1}", kinds.draw(random), where, speed, k / rate)

    def _of_swarm(
        self,
        name: str,
        action: osc.TrafficSwarmAction,
        random: np.random.Generator,
        kinds: "_Kinds",
        actions: osc.InitActions,
    ) -> Iterator[Made]:
        """Yield the vehicles around an entity at the start."""
        number = self._starts.number
        whom = self._starts.text(action.central_object.entity_ref)
        centre = self._pose(whom, actions)
        if centre is None:
            raise InputError(f"a TrafficSwarmAction needs a start on the map of '{whom}'")
        x, y, h = centre
        c, s = elementary.cos(h), elementary.sin(h)
        dx, dy = self._places.x - x, self._places.y - y
        along, aside = dx * c + dy * s - number(action.offset), dy * c - dx * s
        major, minor = number(action.semi_major_axis), number(action.semi_minor_axis)
        # An axis may be 0. What is so far outside that the quotient overflows is infinitely far,
        # and stays outside.
        with np.errstate(over="ignore"):
            inside = elementary.hypot(along / max(major, 1e-9), aside / max(minor, 1e-9)) <= 1.0
        inside &= elementary.hypot(along, aside) >= number(action.inner_radius)
        ways = [1.0, 1.0]
        if action.direction_of_travel_distribution is not None:
            said = action.direction_of_travel_distribution
            ways = _shares([number(said.same), number(said.opposite)])
        weight = np.where(elementary.cos(self._places.h - h) >= 0.0, *ways) * inside
        if not weight.any():
            raise InputError(f"no lane is where the swarm around '{whom}' is")
        low = high = 0.0 if action.velocity is None else number(action.velocity)
        if action.initial_speed_range is not None:
            ends = action.initial_speed_range
            low, high = number(ends.lower_limit), number(ends.upper_limit)
        for value in (low, high):
            _check_speed(value)
        wanted, made = number(action.number_of_vehicles), 0
        if wanted > MOST:
            raise InputError(f"a swarm may have {MOST} vehicles, got {wanted:g}")
        # Without replacement, and all at once: drawing again until a place is free would not end on
        # a map that is full.
        order = random.choice(
            len(weight), int((weight > 0.0).sum()), replace=False, p=weight / weight.sum()
        )
        for i in order.tolist():
            if made == wanted:
                return
            here = float(self._places.x[i]), float(self._places.y[i])
            if any(math.dist(here, pair) < APART for pair in self._taken):
                continue
            self._taken.append(here)
            made += 1
            speed = float(random.uniform(low, high))
            where = osc.Position(self._places.on[i])
            yield self._made(f"{name}_{made}", kinds.draw(random), where, speed, None)

    def _made(
        self, name: str, body: osc.Vehicle, where: osc.Position, speed: float, at: float | None
    ) -> Made:
        """Return an entity, its start, and how it comes [s] where it does so later."""
        driver = osc.Controller(
            f"{name}_driver", osc.Properties((osc.Property(DRIVER, ATTENTIVE),))
        )
        entity = osc.ScenarioObject(name, body, (osc.ObjectController(driver),))
        step = osc.TransitionDynamics(osc.DynamicsShape.STEP, osc.DynamicsDimension.TIME, 0.0)
        target = osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(speed))
        does: list[osc.PrivateAction] = [
            osc.PrivateAction(osc.LongitudinalAction(osc.SpeedAction(step, target)))
        ]
        comes: osc.GlobalAction | None = None
        if at is None:
            does.insert(0, osc.PrivateAction(osc.TeleportAction(where)))
            does.append(osc.PrivateAction(osc.RoutingAction(osc.RandomRouteAction())))
        else:
            comes = osc.GlobalAction(osc.EntityAction(name, osc.AddEntityAction(where)))
        return entity, osc.Private(name, tuple(does)), comes, at or 0.0

    def _departures(self, sink: osc.TrafficSinkAction, names: Sequence[str]) -> Iterator[osc.Event]:
        """Yield an event for each vehicle: it leaves when it is near the sink."""
        if isinstance(sink.rate, osc.ParameterRef | osc.Expr):
            self._problems.append(
                f"{self._place}: the rate of a sink must be a number, got {sink.rate} "
                f"(line {sink.line})"
            )
        elif sink.rate is not None and self._starts.number(sink.rate) < 1.0:
            self._problems.append(
                f"{self._place}: a sink takes all who come; rate [1/s] must be 1 at least, got "
                f"{self._starts.number(sink.rate):g} (line {sink.line})"
            )
        for name in names:
            near = osc.ReachPositionCondition(sink.radius, sink.position)
            who = osc.TriggeringEntities(osc.TriggeringEntitiesRule.ANY, (osc.EntityRef(name),))
            condition = osc.Condition(
                f"{name}_is_there",
                0.0,
                osc.ConditionEdge.NONE,
                osc.ByEntityCondition(who, osc.EntityCondition(near)),
            )
            leaves = osc.GlobalAction(osc.EntityAction(name, osc.DeleteEntityAction()))
            yield _event(f"{name}_leaves_{sink.line}", leaves, condition)


def _check_constant(action: Source) -> None:
    """Refuse parameters: vehicles are drawn once, so rows could not vary them."""
    if names := sorted(references(action)):
        raise InputError(
            f"a {type(action).__name__} must have numbers, got parameter {names[0]}: its vehicles "
            "are drawn beforehand, the same in every row"
        )


def _check_speed(speed: float) -> None:
    if not 0.0 <= speed <= FASTEST:
        raise InputError(f"speeds of traffic [m/s] must be 0 to {FASTEST:g}, got {speed:g}")


def _shares(weights: Sequence[float]) -> list[float]:
    """Return weights whose sum is 1.

    Raises:
        InputError: none is greater than 0, or one is infinite.
    """
    most = max(weights)
    if not 0.0 < most < math.inf:
        raise InputError("the weights of a distribution of traffic must not all be 0")
    # By the greatest first: the sum of huge weights would be infinite.
    scaled = [weight / most for weight in weights]
    return [value / sum(scaled) for value in scaled]


class _Kinds:
    """What vehicles are drawn from, by weights."""

    def __init__(self, bodies: Sequence[osc.Vehicle], weights: Sequence[float]) -> None:
        self._bodies, self._weights = bodies, _shares(weights)

    def draw(self, random: np.random.Generator) -> osc.Vehicle:
        return self._bodies[int(random.choice(len(self._bodies), p=self._weights))]


def _kinds(action: Source, starts: Starts) -> _Kinds:
    """Return what vehicles a traffic action has: cars where it does not say.

    Raises:
        InputError: vehicles of another category, or none.
    """
    if action.traffic_definition is not None:
        entries = action.traffic_definition.vehicle_category_distribution.entries
        kinds = [starts.text(entry.category) for entry in entries]
        for kind in kinds:
            if kind not in _CATEGORIES:
                known = ", ".join(_CATEGORIES)
                raise InputError(f"vehicles of traffic must be of {known}, got {kind}")
        return _Kinds(
            [_vehicle(name) for name in kinds], [starts.number(entry.weight) for entry in entries]
        )
    if action.traffic_distribution is None:
        return _Kinds([_vehicle("car")], [1.0])
    bodies: list[osc.Vehicle] = []
    weights = []
    for group in action.traffic_distribution.entries:
        for entry in group.entity_distribution.entries:
            body = entry.template.entity_object
            if not isinstance(body, osc.Vehicle):
                raise InputError(f"traffic is made of vehicles here, got {type(body).__name__}")
            bodies.append(body)
            weights.append(starts.number(group.weight) * starts.number(entry.weight))
    return _Kinds(bodies, weights)


def _vehicle(category: str) -> osc.Vehicle:
    body: Body = PARTICIPANTS[_CATEGORIES[category]].body

    def axle(lock: float, x: float) -> osc.Axle:
        return osc.Axle(
            max_steering=lock,
            wheel_diameter=0.65,
            track_width=body.width - 0.3,
            position_x=x,
            position_z=0.325,
        )

    return osc.Vehicle(
        name=category,
        vehicle_category=osc.VehicleCategory(category),
        bounding_box=osc.BoundingBox(
            osc.Center(body.center_ahead, 0.0, 0.5 * body.height),
            osc.Dimensions(body.width, body.length, body.height),
        ),
        performance=osc.Performance(body.max_speed, body.max_acceleration, body.max_deceleration),
        axles=osc.Axles(
            axle(0.6, body.wheelbase),
            axle(0.0, 0.0),
        ),
        properties=osc.Properties(()),
    )


def _places(roads: OpenDrive) -> _Places:
    """Return places on all drivable lanes, at most ``STEP`` apart."""
    found: list[Float] = []
    on: list[osc.LanePosition] = []
    for road in roads.roads:
        for index, section in enumerate(road.sections):
            length = section_end(road, index) - section.s
            if road.is_connecting or length <= 2.0 * STEP:
                continue
            s = section.s + np.arange(STEP, length - STEP, STEP)
            line, edges = reference_line(road, s), borders(road, index, s)
            for lane in section.lanes:
                if not lane.drivable:
                    continue
                inner = edges[lane.id - int(math.copysign(1, lane.id))]
                t = 0.5 * (inner + edges[lane.id])
                back = 0.0 if road.direction(lane.id) > 0 else math.pi
                x, y = line.x - t * elementary.sin(line.h), line.y + t * elementary.cos(line.h)
                found.append(np.stack((x, y, line.h + back)))
                on += [osc.LanePosition(road.id, str(lane.id), float(item)) for item in s]
    x, y, h = np.concatenate(found, axis=1) if found else np.empty((3, 0))
    return _Places(x, y, h, on)


def _end(scenario: osc.OpenScenario, starts: Starts) -> float:
    """Return when a scenario ends at the latest [s]; 0 if no time says so."""
    stop = scenario.storyboard.stop_trigger
    found = [0.0]
    for group in () if stop is None else stop.condition_groups:
        for condition in group.conditions:
            clock = getattr(condition.condition, "condition", None)
            if isinstance(clock, osc.SimulationTimeCondition):
                found.append(starts.number(clock.value))
    return max(found)


def _arrivals(made: Sequence[Made]) -> Iterator[osc.Event]:
    for entity, _, comes, at in made:
        if comes is not None:
            clock = osc.SimulationTimeCondition(at, osc.Rule.GREATER_OR_EQUAL)
            condition = osc.Condition(
                f"time_of_{entity.name}", 0.0, osc.ConditionEdge.NONE, osc.ByValueCondition(clock)
            )
            yield _event(f"{entity.name}_comes", comes, condition)


def _event(name: str, action: osc.GlobalAction, condition: osc.Condition) -> osc.Event:
    trigger = osc.Trigger((osc.ConditionGroup((condition,)),))
    return osc.Event(
        priority=osc.Priority.PARALLEL,
        maximum_execution_count=1,
        name=name,
        actions=(osc.Action(f"{name}_action", action),),
        start_trigger=trigger,
    )


def _with(
    scenario: osc.OpenScenario,
    kept: Sequence[osc.GlobalAction],
    made: Sequence[Made],
    events: Sequence[osc.Event],
) -> osc.OpenScenario:
    """Return a scenario with more entities, and with events by which they come and go."""
    board = scenario.storyboard
    privates = (*board.init.actions.privates, *(private for _, private, _, _ in made))
    actions = replace(board.init.actions, global_actions=tuple(kept), privates=privates)
    stories = board.stories
    if events:
        group = osc.ManeuverGroup(
            maximum_execution_count=1,
            name=NAMED,
            actors=osc.Actors(False),
            maneuvers=(osc.Maneuver(name=NAMED, events=tuple(events)),),
        )
        stories = (*stories, osc.Story(name=NAMED, acts=(osc.Act(NAMED, (group,)),)))
    entities = scenario.entities
    objects = (*entities.scenario_objects, *(entity for entity, _, _, _ in made))
    return replace(
        scenario,
        entities=replace(entities, scenario_objects=objects),
        storyboard=replace(board, init=replace(board.init, actions=actions), stories=stories),
    )
