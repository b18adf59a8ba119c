"""A recorded event as an OpenSCENARIO file: everyone on a timetable, or the ego with a driver."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import EntityBody, entity_body
from bridgegen.openx.openscenario.declarations import DRIVER
from bridgegen.openx.openscenario.recorded import Recording, recorded
from bridgegen.openx.openscenario.versions import at, at_once
from bridgegen.recordings.excerpt import Clock, excerpt, path_speeds
from bridgegen.recordings.readers.bodies import usual
from bridgegen.recordings.readers.table import RecordedTraffic
from bridgegen.recordings.replays.road import LANE, ROAD
from bridgegen.simulation.rollout import Rollout

EGO = "ego"
DATE = "2025-01-01T00:00:00"
"""Of all files, so that the same recording gives the same bytes."""
AROUND = 80.0
"""Who comes nearer to the ego [m] is there."""
MOST_OTHERS = 60
"""Participants besides the ego; of more, the nearest."""
FASTER = 1.0
"""A driver is told of the highest speed of the recorded ego if that is so much [m/s] above its
first one."""
RATE = 2.0
"""How fast it is to get there [m/s²]."""


def others_near(
    traffic: RecordedTraffic, clock: Clock, ego: int, first: Sequence[int], begin: int, end: int
) -> list[int]:
    """Return who is near the ego from one instant to another, those of ``first`` before all.

    Fragments of tracks are left out.
    """
    is_there = (clock.begin <= end) & (clock.end >= begin) & clock.is_whole
    is_there[ego] = False
    nearest: list[tuple[float, int]] = []
    ego_at = np.arange(begin, end + 1) - clock.begin[ego] + traffic.first[ego]
    for p in np.flatnonzero(is_there).tolist():
        low, high = max(begin, int(clock.begin[p])), min(end, int(clock.end[p]))
        its = np.arange(low, high + 1) - clock.begin[p] + traffic.first[p]
        own = ego_at[low - begin : high - begin + 1]
        apart = np.hypot(traffic.x[its] - traffic.x[own], traffic.y[its] - traffic.y[own])
        if apart.min() < AROUND:
            nearest.append((float(apart.min()), p))
    rest = [p for _, p in sorted(nearest) if p not in first]
    return [*first, *rest][:MOST_OTHERS]


def replay_of(
    traffic: RecordedTraffic, clock: Clock, ego: int, others: Sequence[int], begin: int, end: int
) -> tuple[osc.OpenScenario, Rollout, Recording]:
    """Return the scenario in which all do what was recorded, and that motion, in two forms.

    Its map is not named yet; see `with_map`.
    """
    motion = excerpt(traffic, clock, ego, others, begin, end)
    names = (EGO, *_names([traffic.names[p] for p in others], traffic.kind[list(others)].tolist()))
    motion = replace(motion, names=names)
    entities = [
        osc.ScenarioObject(name, _body(traffic, p))
        for name, p in zip(names, (ego, *others), strict=True)
    ]
    seconds = begin * traffic.facts.time_step
    about = f"{traffic.facts.name}: participant {traffic.names[ego]} from {seconds:.2f} s"
    empty = osc.OpenScenario(
        osc.FileHeader(
            1, 2, DATE, about, "BridgeGen",
            properties=osc.Properties((osc.Property("time_step", repr(motion.time_step)),)),
        ),
        osc.RoadNetwork(),
        osc.Entities(tuple(entities)),
        osc.Storyboard(osc.Init(osc.InitActions()), (), osc.Trigger()),
    )  # fmt: skip
    there = motion.present[0] if motion.present.size else None
    recording = Recording(
        names, motion.time_step, motion.x[0], motion.y[0], motion.h[0],
        path_speeds(traffic, clock, (ego, *others), begin, end), (), there,
    )  # fmt: skip
    return recorded(empty, recording), motion, recording


def with_map(scenario: osc.OpenScenario, file: str) -> osc.OpenScenario:
    """Return a scenario on a map."""
    return replace(scenario, road_network=osc.RoadNetwork(osc.File(file)))


def driven(
    scenario: osc.OpenScenario, motion: Rollout, driver: str, start: float, length: float
) -> osc.OpenScenario:
    """Return a replay in which a driver takes the ego's place, on the road along its path.

    It starts where the ego was and as fast; its target is the ego's highest speed.

    Args:
        scenario: the replay.
        motion: what was recorded.
        driver: by name.
        start: where on the road the ego's path begins [m].
        length: of the road [m].
    """
    speed, most = float(motion.v[0, 0, 0]), float(motion.v[0, 0].max())
    controller = osc.Controller(
        "ego_driver",
        osc.Properties(
            (osc.Property(DRIVER, driver), osc.Property("esminiController", "ExternalController"))
        ),
    )
    bodies = tuple(
        replace(one, object_controllers=(osc.ObjectController(controller),))
        if one.name == EGO else one
        for one in scenario.entities.scenario_objects
    )  # fmt: skip
    place, goal = (
        osc.Position(osc.LanePosition(ROAD, str(LANE), s)) for s in (start, length - 1.0)
    )
    shortest = osc.RouteStrategy.SHORTEST
    route = osc.Route(
        "the_recorded_path", False, (osc.Waypoint(shortest, place), osc.Waypoint(shortest, goal))
    )
    actions = (
        osc.PrivateAction(osc.TeleportAction(place)),
        _at_speed(speed, 0.0),
        osc.PrivateAction(osc.RoutingAction(osc.AssignRouteAction(route))),
    )
    board = scenario.storyboard
    init = replace(
        board.init.actions,
        privates=tuple(
            osc.Private(EGO, actions) if one.entity_ref == EGO else one
            for one in board.init.actions.privates
        ),
    )
    stories = board.stories
    if most > speed + FASTER:
        stories = (*stories, _story(_at_speed(most, (most - speed) / RATE)))
    return replace(
        scenario,
        entities=osc.Entities(bodies),
        storyboard=replace(board, init=osc.Init(init), stories=stories),
    )


def _at_speed(speed: float, seconds: float) -> osc.PrivateAction:
    shape = osc.DynamicsShape.LINEAR if seconds else osc.DynamicsShape.STEP
    dynamics = osc.TransitionDynamics(shape, osc.DynamicsDimension.TIME, seconds)
    target = osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(speed))
    return osc.PrivateAction(osc.LongitudinalAction(osc.SpeedAction(dynamics, target)))


def _story(action: osc.PrivateAction) -> osc.Story:
    event = osc.Event(
        "target_speed", osc.Priority.PARALLEL, (osc.Action("target_speed", action),),
        at(0.0, "target_speed_at"), 1,
    )  # fmt: skip
    group = osc.ManeuverGroup(
        "target_speed", 1, osc.Actors(False, (osc.EntityRef(EGO),)),
        (osc.Maneuver("target_speed", (event,)),),
    )  # fmt: skip
    return osc.Story("target_speed", (osc.Act("target_speed", (group,), at_once()),))


def _body(traffic: RecordedTraffic, p: int) -> EntityBody:
    kind = usual(int(traffic.kind[p]))
    length, width = float(traffic.length[p]), float(traffic.width[p])
    scale = length / kind.body.length
    body = replace(
        kind.body, length=length, width=width, center_ahead=kind.body.center_ahead * scale,
        wheelbase=kind.body.wheelbase * scale,
    )  # fmt: skip
    return entity_body(kind, body, mass=kind.body.mass or None)


def _names(names: Sequence[str], kinds: Sequence[int]) -> Iterator[str]:
    """Yield names that any reader takes, all different."""
    taken = {EGO}
    for name, kind in zip(names, kinds, strict=True):
        plain = f"{usual(kind).name}_{re.sub(r'[^A-Za-z0-9]+', '_', name).strip('_')}"
        wanted, number = plain, 1
        while wanted in taken:
            number += 1
            wanted = f"{plain}_{number}"
        taken.add(wanted)
        yield wanted
