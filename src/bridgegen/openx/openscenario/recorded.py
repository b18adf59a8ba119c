"""A scenario as it was played: every entity on a timetable, what happens to all at its time.

The vertices are the recorded states. Between two instants of different speed lies one more, half of
the step later, where the entity is if it keeps its speed until then: so distance by time is the
recorded speed on both sides of every instant, exactly where speeds change evenly within a step.
Where nothing moves, vertices between the first and the last are left out; all others stay, because
a smallest distance that moves by a rounding can move a first contact by a step.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.write import at, at_once

_TURNING = "plineInterpolation"

Body = osc.Vehicle | osc.Pedestrian | osc.MiscObject | osc.ExternalObjectReference

SAME_SPEED = 1e-9  # m/s, recorded speeds that differ by less are one


@dataclass(frozen=True)
class Recording:
    """What a simulator recorded of one scenario: E entities at K instants.

    Attributes:
        names: of the E entities.
        time_step: between two instants [s]; instant k is at k · time_step.
        x: ``(E, K)`` [m], of the reference point.
        y: ``(E, K)`` [m].
        h: ``(E, K)`` [rad], heading, continuous.
        v: ``(E, K)`` [m/s], ≥ 0.
        began: per event, in the order of the file, the instant at which it began; -1 if never.
        present: ``(E, K)`` bool; None if all entities always are.
        light_names: ids of the S traffic lights that change.
        lights: ``(S, K)`` int8, their states, as `bridgegen.simulation.rollout.Rollout` has them.
    """

    names: Sequence[str]
    time_step: float
    x: Float
    y: Float
    h: Float
    v: Float
    began: Sequence[int]
    present: Bool | None = None
    light_names: Sequence[str] = ()
    lights: npt.NDArray[np.int8] = field(default_factory=lambda: np.zeros((0, 0), np.int8))

    def stays(self, e: int) -> list[tuple[int, int]]:
        """Return the first and the last instant of each time in which an entity is there."""
        k = self.x.shape[1]
        there = np.ones(k, np.bool_) if self.present is None else self.present[e]
        edges = np.flatnonzero(np.diff(there.astype(np.int8), prepend=0, append=0))
        return [(first, end - 1) for first, end in edges.reshape(-1, 2).tolist()]

    def until_left(self, but: Collection[str] = ()) -> "Recording":
        """Return the recording in which an entity that leaves for good stands where it left.

        Args:
            but: names of entities that leave all the same.
        """
        if self.present is None:
            return self
        states = {name: getattr(self, name).copy() for name in ("x", "y", "h", "v")}
        present = self.present.copy()
        for e in range(len(self.names)):
            stays = self.stays(e)
            if self.names[e] not in but and len(stays) == 1 and stays[0][0] == 0:
                last = stays[0][1]
                for name, state in states.items():
                    state[e, last + 1 :] = 0.0 if name == "v" else state[e, last]
                present[e] = True
        return replace(self, present=None if present.all() else present, **states)


def recorded(scenario: osc.OpenScenario, recording: Recording) -> osc.OpenScenario:
    """Return a scenario that any player shows as it was recorded.

    The environment, its changes, the traffic lights' states and the stop trigger stay; what
    entities did of themselves and who drove them goes. It also stops where the recording did.

    Args:
        scenario: without parameters (`resolve.resolved`), of version 1.2 or 1.3.
        recording: its own.
    """
    board = scenario.storyboard
    start = replace(
        board.init.actions,
        global_actions=tuple(
            action
            for action in board.init.actions.global_actions
            if not isinstance(action.action, osc.EntityAction)
        ),
        privates=tuple(_private(recording, e) for e in range(len(recording.names))),
    )
    bodies = [
        replace(obj, object_controllers=(), entity_object=_turning(obj.entity_object))
        for obj in scenario.entities.scenario_objects
    ]
    return replace(
        scenario,
        entities=osc.Entities(tuple(bodies)),
        storyboard=osc.Storyboard(
            osc.Init(start), tuple(_stories(board, recording)), _stop(board, recording)
        ),
    )


def _turning(body: Body) -> Body:
    """Return a body that esmini, too, turns steadily from vertex to vertex, not at corners only."""
    if isinstance(body, osc.ExternalObjectReference):
        return body
    # By default esmini turns a body at the corners of a polyline only: up to 0.8° off. The property
    # is its own; others pass over it.
    held = body.properties or osc.Properties()
    if held.get(_TURNING) is not None:
        return body
    more = (*held.properties, osc.Property(_TURNING, "segment"))
    return replace(body, properties=replace(held, properties=more))


def _private(recording: Recording, e: int) -> osc.Private:
    """Return how fast an entity starts and, if it is there, where, and its timetable."""
    stays, actions = recording.stays(e), []
    first = stays[0][0] if stays else 0
    speed = osc.SpeedAction(
        osc.TransitionDynamics(osc.DynamicsShape.STEP, osc.DynamicsDimension.TIME, 0.0),
        osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(float(recording.v[e, first]))),
    )
    actions.append(osc.PrivateAction(osc.LongitudinalAction(speed)))
    if stays and first == 0:
        place, follow = _timetable(recording, e, *stays[0])
        actions = [osc.PrivateAction(osc.TeleportAction(place)), *actions, follow]
    return osc.Private(recording.names[e], tuple(actions))


def _timetable(
    recording: Recording, e: int, first: int, last: int
) -> tuple[osc.Position, osc.PrivateAction]:
    """Return where an entity is at an instant, and the way that it takes until a later one."""
    vertices = tuple(_vertices(recording, e, first, last))
    name = recording.names[e]
    follow = osc.FollowTrajectoryAction(
        # Absolute times with scale 1 and offset 0: tools divide by the scale or multiply by it, and
        # add the offset or subtract it.
        osc.TimeReference(osc.Timing(osc.ReferenceContext.ABSOLUTE, 1.0, 0.0)),
        osc.TrajectoryFollowingMode(osc.FollowingMode.POSITION),
        osc.TrajectoryRef(
            osc.Trajectory(f"{name}_recorded", False, osc.Shape(osc.Polyline(vertices)))
        ),
    )
    return vertices[0].position, osc.PrivateAction(osc.RoutingAction(follow))


def _comings_and_goings(recording: Recording) -> Iterator[osc.ManeuverGroup]:
    """Yield when entities appear and disappear, and the paths of those that appear."""
    step, k = recording.time_step, recording.x.shape[1]
    for e, name in enumerate(recording.names):
        events = []
        for number, (first, last) in enumerate(recording.stays(e), 1):
            if first > 0:
                place, follow = _timetable(recording, e, first, last)
                come = osc.GlobalAction(osc.EntityAction(name, osc.AddEntityAction(place)))
                event = _timed_event(f"{name}_comes_{number}", first * step, (come, follow))
                events.append(event)
            if last < k - 1:
                gone = osc.GlobalAction(osc.EntityAction(name, osc.DeleteEntityAction()))
                events.append(_timed_event(f"{name}_goes_{number}", (last + 1) * step, (gone,)))
        if events:
            actors = osc.Actors(False, (osc.EntityRef(name),))
            maneuver = osc.Maneuver(f"{name}_presence", tuple(events))
            yield osc.ManeuverGroup(f"{name}_presence", 1, actors, (maneuver,))


def _timed_event(
    name: str, seconds: float, parts: Sequence[osc.GlobalAction | osc.PrivateAction]
) -> osc.Event:
    actions = tuple(osc.Action(f"{name}_{i}", part) for i, part in enumerate(parts, 1))
    return osc.Event(name, osc.Priority.PARALLEL, actions, at(seconds, f"{name}_at"), 1)


def _vertices(recording: Recording, e: int, first: int, last: int) -> Iterator[osc.Vertex]:
    x, y, h, v = (getattr(recording, field)[e] for field in ("x", "y", "h", "v"))
    step = recording.time_step
    still = (np.diff(x) == 0.0) & (np.diff(y) == 0.0) & (np.diff(h) == 0.0)
    for k in range(first, last + 1):
        # All other vertices stay, however near: esmini plays such files exactly with `--traj_filter
        # 0`.
        if not (first < k < last and still[k - 1] and still[k]):
            yield _vertex(k * step, x[k], y[k], h[k])
        if k < last and abs(v[k] - v[k + 1]) > SAME_SPEED and not still[k]:
            # Over half a step at v[k], and half a step at v[k + 1], the entity covers this share of
            # the way first.
            share = v[k] / (v[k] + v[k + 1])
            yield _vertex(
                (k + 0.5) * step,
                x[k] + share * (x[k + 1] - x[k]),
                y[k] + share * (y[k + 1] - y[k]),
                0.5 * (h[k] + h[k + 1]),
            )
    if last == first:  # stopped at once: a line has two ends
        yield _vertex((last + 1) * step, x[last], y[last], h[last])


def _vertex(time: float, x: float, y: float, h: float) -> osc.Vertex:
    place = osc.WorldPosition(float(x), float(y), h=float(h))
    return osc.Vertex(osc.Position(place), float(time))


def _stories(board: osc.Storyboard, recording: Recording) -> Iterator[osc.Story]:
    """Yield the stories with what happened to all, at its time."""
    began = iter(recording.began)
    for story in board.stories:
        acts = []
        for act in story.acts:
            groups = []
            for group in act.maneuver_groups:
                maneuvers = []
                for maneuver in group.maneuvers:
                    events = [
                        item
                        for event in maneuver.events
                        for item in _event(event, next(began) * recording.time_step)
                    ]
                    if events:
                        maneuvers.append(replace(maneuver, events=tuple(events)))
                if maneuvers:
                    groups.append(replace(group, maneuvers=tuple(maneuvers)))
            if groups:
                acts.append(osc.Act(act.name, tuple(groups), at_once()))
        if acts:
            yield osc.Story(story.name, tuple(acts))
    if presence := tuple(_comings_and_goings(recording)):
        yield osc.Story("presence", (osc.Act("presence", presence, at_once()),))


def _event(event: osc.Event, seconds: float) -> Iterator[osc.Event]:
    """Yield the event with its actions that concern all, if it began and has any."""
    actions = tuple(
        action
        for action in event.actions
        if isinstance(action.action, osc.GlobalAction)
        and not isinstance(action.action.action, osc.EntityAction)
    )
    if actions and seconds >= 0.0:
        yield replace(event, actions=actions, start_trigger=at(seconds, f"{event.name}_began"))


def _stop(board: osc.Storyboard, recording: Recording) -> osc.Trigger:
    """Return the end: what it was, save where that asks for what is gone, and the last instant."""
    # A condition on a part of the storyboard that is gone would never be met, or be an error.
    groups = board.stop_trigger.condition_groups if board.stop_trigger else ()
    kept = [
        group
        for group in groups
        if not any(isinstance(node, osc.StoryboardElementStateCondition) for node in walk(group))
    ]
    end = at((recording.x.shape[1] - 1) * recording.time_step, "recording_ends")
    return osc.Trigger((*kept, *end.condition_groups))
