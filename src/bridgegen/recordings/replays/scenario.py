"""A recorded event as an OpenSCENARIO file: everyone on a timetable, or the ego with a driver."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.openx.opendrive.model import Header, Lane, LaneSection, OpenDrive, Road, Width
from bridgegen.openx.opendrive.plan_view import Cubic, Geometry, Line, ParamPoly3
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import EntityBody, entity_body
from bridgegen.openx.openscenario.declarations import DRIVER
from bridgegen.openx.openscenario.recorded import Recording, recorded
from bridgegen.openx.openscenario.write import at, at_once
from bridgegen.recordings.excerpt import Clock, excerpt, path_speeds
from bridgegen.recordings.readers.states import usual
from bridgegen.recordings.readers.table import RecordedTraffic
from bridgegen.simulation.rollout import Rollout

# --- A road along the ego's recorded path, for recordings whose lanes are not known ---
# Its one lane is where the ego's rear axle went, and runs on straight at both ends. So a driver who
# takes the ego's place has a lane that leads where the ego went; everyone else is on a timetable
# and # needs no road.


ROAD, LANE = "1", -1
WIDTH = 3.5  # m
BEFORE = 30.0  # m, of the road before the ego's start
BEYOND = 150.0  # m, after its end
PIECE = 4.0  # m, of the path to a cubic
STANDS = 0.05  # m; steps that are shorter have no direction
_SAMPLES = 33

Knot = tuple[float, float, float]
"""Knot of a path: x, y [m] and direction [rad]."""


def along(x: Float, y: Float, h: Float) -> tuple[OpenDrive, float]:
    """Return a road network of one road along a path, and where on the road the path begins [m].

    Args:
        x: ``(T,)`` of the rear axle [m].
        y: ``(T,)`` [m].
        h: ``(T,)`` heading [rad], continuous.
    """
    knots = list(_knots(x, y, h))
    pieces = [Geometry(0.0, *_behind(knots[0], BEFORE), BEFORE, Line())]
    for pair, two in pairwise(knots):
        pieces.append(_cubic(_end(pieces), pair, two))
    last = knots[-1]
    pieces.append(Geometry(_end(pieces), *last, BEYOND, Line()))
    lanes = LaneSection(
        0.0,
        center=(Lane(0),),
        right=(Lane(LANE, "driving", widths=(Width(0.0, WIDTH, 0.0, 0.0, 0.0),)),),
    )
    shift = Cubic(0.0, 0.5 * WIDTH, 0.0, 0.0, 0.0)  # the lane's middle is the reference line
    road = Road(
        ROAD,
        _end(pieces),
        name="the ego's path",
        plan_view=tuple(pieces),
        lane_offsets=(shift,),
        sections=(lanes,),
    )
    header = Header(1, 7, name="the ego's path", version="1.00", vendor="BridgeGen")
    return OpenDrive(header, (road,), (), ()), BEFORE


def _end(pieces: list[Geometry]) -> float:
    return pieces[-1].s + pieces[-1].length


def _behind(knot: Knot, by: float) -> Knot:
    x, y, h = knot
    return x - by * float(np.cos(h)), y - by * float(np.sin(h)), h


def _knots(x: Float, y: Float, h: Float) -> Iterator[Knot]:
    """Yield points of the path, at least `PIECE` apart, with its direction there."""
    last = 0
    yield float(x[0]), float(y[0]), float(h[0])
    for k in range(1, len(x)):
        ahead = (x[k] - x[last]) * np.cos(h[last]) + (y[k] - y[last]) * np.sin(h[last])
        if ahead >= PIECE or (k == len(x) - 1 and ahead > STANDS):
            yield float(x[k]), float(y[k]), float(h[k])
            last = k


def _cubic(s: float, knot: Knot, two: Knot) -> Geometry:
    """Return the cubic with both points and both directions."""
    x, y, h = knot
    dx, dy, turn = two[0] - x, two[1] - y, two[2] - h
    u = dx * np.cos(h) + dy * np.sin(h)
    v = -dx * np.sin(h) + dy * np.cos(h)
    chord = float(np.hypot(u, v))
    end_u, end_v = chord * float(np.cos(turn)), chord * float(np.sin(turn))
    c_u, d_u = 3.0 * u - 2.0 * chord - end_u, chord + end_u - 2.0 * u
    c_v, d_v = 3.0 * v - end_v, end_v - 2.0 * v
    p = np.linspace(0.0, 1.0, _SAMPLES)
    speed = np.hypot(chord + 2.0 * c_u * p + 3.0 * d_u * p * p, 2.0 * c_v * p + 3.0 * d_v * p * p)
    length = float(np.sum(speed * _simpson(_SAMPLES)) / (_SAMPLES - 1))
    shape = ParamPoly3(0.0, chord, float(c_u), float(d_u), 0.0, 0.0, float(c_v), float(d_v))
    return Geometry(s, x, y, h, length, shape)


def _simpson(n: int) -> Float:
    """Return the weights of Simpson's rule over n points, n odd, one apart."""
    weights = np.full(n, 2.0 / 3.0)
    weights[1::2], weights[[0, -1]] = 4.0 / 3.0, 1.0 / 3.0
    return weights


EGO = "ego"
DATE = "2025-01-01T00:00:00"
"""Date of all files, so that the same recording gives the same bytes."""
AROUND = 80.0
"""Distance from the ego below which a participant is in the replay [m]."""
MOST_OTHERS = 60
"""Largest number of participants besides the ego; of more, the nearest."""
FASTER = 1.0
"""Increase of the recorded ego's speed above its first one from which on a driver is told of the
highest [m/s]."""
RATE = 2.0
"""Acceleration to the recorded ego's highest speed [m/s²]."""


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
            1,
            2,
            DATE,
            about,
            "BridgeGen",
            properties=osc.Properties((osc.Property("time_step", repr(motion.time_step)),)),
        ),
        osc.RoadNetwork(),
        osc.Entities(tuple(entities)),
        osc.Storyboard(osc.Init(osc.InitActions()), (), osc.Trigger()),
    )
    there = motion.present[0] if motion.present.size else None
    recording = Recording(
        names,
        motion.time_step,
        motion.x[0],
        motion.y[0],
        motion.h[0],
        path_speeds(traffic, clock, (ego, *others), begin, end),
        (),
        there,
    )
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
        replace(obj, object_controllers=(osc.ObjectController(controller),))
        if obj.name == EGO
        else obj
        for obj in scenario.entities.scenario_objects
    )
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
            osc.Private(EGO, actions) if private.entity_ref == EGO else private
            for private in board.init.actions.privates
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
        "target_speed",
        osc.Priority.PARALLEL,
        (osc.Action("target_speed", action),),
        at(0.0, "target_speed_at"),
        1,
    )
    group = osc.ManeuverGroup(
        "target_speed",
        1,
        osc.Actors(False, (osc.EntityRef(EGO),)),
        (osc.Maneuver("target_speed", (event,)),),
    )
    return osc.Story("target_speed", (osc.Act("target_speed", (group,), at_once()),))


def _body(traffic: RecordedTraffic, p: int) -> EntityBody:
    kind = usual(int(traffic.kind[p]))
    length, width = float(traffic.length[p]), float(traffic.width[p])
    scale = length / kind.body.length
    body = replace(
        kind.body,
        length=length,
        width=width,
        center_ahead=kind.body.center_ahead * scale,
        wheelbase=kind.body.wheelbase * scale,
    )
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
