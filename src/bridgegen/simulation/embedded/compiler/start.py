"""The start of a storyboard: where each entity is, how fast, and which way it goes."""

from collections.abc import Collection, Iterable, Iterator

from bridgegen.base.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, walk
from bridgegen.simulation.embedded._codes import WHOSE
from bridgegen.simulation.embedded.compiler.actions import CONTROLLING, Actions
from bridgegen.simulation.embedded.compiler.controllers import Controllers
from bridgegen.simulation.embedded.compiler.courses import LONGITUDINAL, first_speed
from bridgegen.simulation.embedded.compiler.layouts import Towing, gives_path, is_laid
from bridgegen.simulation.embedded.compiler.positions import Positions
from bridgegen.simulation.embedded.compiler.tables import Tables
from bridgegen.simulation.embedded.compiler.trajectories import compile_trajectory
from bridgegen.simulation.embedded.program import (
    AlongLanes,
    AlongTrajectory,
    LanePoint,
    LaneSpot,
    Nowhere,
    PathSpec,
)

Way = osc.AssignRouteAction | osc.AcquirePositionAction
"""Action that gives an entity a route."""


class Start:
    """The start of a storyboard, compiled.

    Args:
        tables: what all parts of the compiler share.
        paths: of the entities; those that they start on are added, in the entities' order.
        positions: where places are kept.
        actions: where actions that begin at the start are kept.
        controllers: who moves the ego.
        towing: who tows whom.

    Attributes:
        speeds: the slot of each entity's speed.
        routes: the route of each entity that gets one.
        absent: the entities that are not there at the start.
        apart: of each entity, whether it has a start of its own.
    """

    def __init__(
        self,
        tables: Tables,
        paths: list[PathSpec],
        positions: Positions,
        actions: Actions,
        controllers: Controllers,
        towing: Towing,
    ) -> None:
        self._towing = towing
        self._tables, self._paths, self._positions = tables, paths, positions
        self._actions, self._controllers = actions, controllers
        self._places: dict[int, int] = {}
        self.speeds: list[int] = []
        self.routes: dict[int, int] = {}
        self.absent: list[int] = []
        self.apart: list[bool] = []

    def compile(self, storyboard: osc.Storyboard, has_driver: bool) -> None:
        """Compile the start of a storyboard.

        Raises:
            InputError: entities that nothing puts anywhere.
        """
        actions = storyboard.init.actions
        for command in actions.user_defined_actions:
            self._tables.unsupported(command, "UserDefinedAction")
        for global_action in actions.global_actions:
            if not isinstance(global_action.action, osc.EntityAction):
                self._actions.begin_with_all(global_action.action)
        init = dict.fromkeys(self._tables.names, self._tables.slot(0.0))
        starts = dict(self._added(actions.global_actions))
        routes: dict[str, Way] = {}
        tracks: dict[str, AlongTrajectory] = {}
        first: list[tuple[osc.PrivateAction, int]] = []
        for private in actions.privates:
            name = str(private.entity_ref)
            for wrapped in private.private_actions:
                action = wrapped.action
                if isinstance(action, osc.TeleportAction):
                    whose = getattr(action.position.position, "entity_ref", None)
                    if name in starts and whose is not None and self._tables.text(whose) == name:
                        first.append((wrapped, self._tables.entity(name)))  # from where it is put
                    else:
                        starts[name] = action.position
                    continue
                if isinstance(action, CONTROLLING):
                    self._controllers.begin(action, self._tables.entity(name))
                    self._actions.begin_pedals(action, self._tables.entity(name))
                    continue
                inner = getattr(action, "action", action)
                if isinstance(inner, LONGITUDINAL):
                    speed = first_speed(inner)
                    if speed is None:
                        first.append((wrapped, self._tables.entity(name)))
                    else:
                        init[name] = self._tables.slot(speed)
                elif isinstance(
                    action, osc.LateralAction | osc.VisibilityAction | osc.TrailerAction
                ) or self._actions.lamps(inner):
                    first.append((wrapped, self._tables.entity(name)))
                elif isinstance(inner, osc.FollowTrajectoryAction) and (
                    is_laid(inner)  # a driver needs a path, by the declared numbers
                    and not (has_driver and self._tables.entity(name) == 0 and gives_path(inner))
                ):
                    first.append((wrapped, self._tables.entity(name)))
                    if (begins := _first_position(inner)) is not None:
                        starts.setdefault(name, begins)
                elif isinstance(inner, osc.FollowTrajectoryAction):
                    tracks[name] = compile_trajectory(self._tables, inner)
                elif isinstance(inner, Way):
                    routes[name] = inner
                elif not self._actions.is_unseen(inner, self._tables.entity(name)):
                    self._tables.unsupported(inner, f"an initial {type(inner).__name__}")
        later = dict(self._added(walk(storyboard)))
        self.absent = [
            e
            for e, name in enumerate(self._tables.names)
            if name not in {*starts, *tracks} and name in later and not (e == 0 and has_driver)
        ]
        self.absent += self._unmoved(storyboard, {*starts, *tracks, *later})
        waiting = {self._tables.names[e] for e in self.absent}
        self.absent += self._deleted(actions.global_actions)
        self.apart = [name in {*starts, *tracks} for name in self._tables.names]
        led = {name for e, name in enumerate(self._tables.names) if self._towing.towers[e] >= 0}
        settled = {*starts, *tracks, *waiting, *led}
        missing = [name for name in self._tables.names if name not in settled]
        if missing and not self._tables.problems:
            self._tables.culprits += [
                obj for obj in self._tables.objects if str(obj.name) in missing
            ]
            raise InputError(
                *(
                    f"{self._tables.place}: entity '{name}' needs an initial TeleportAction, or "
                    "an AddEntityAction"
                    for name in missing
                )
            )
        for e, name in enumerate(self._tables.names):
            if name in tracks:  # there it starts
                self._paths.append(tracks[name])
            elif name in starts:
                self._paths.append(self._start(e, starts[name], routes.get(name), has_driver))
            elif name in waiting | led:
                self._paths.append(self._nowhere(e, routes.get(name)))
        for one_more, entity in first:
            self._actions.begin(one_more, entity)
        self.speeds = [init[name] for name in self._tables.names]

    def ordered_places(self) -> list[tuple[int, int]]:
        """Return who starts at which position, after those whose place it counts from.

        Raises:
            InputError: starts that depend on one another.
        """
        found: list[tuple[int, int]] = []
        left = dict(self._places)
        while left:
            ready = [
                e for e, place in left.items() if self._positions.rows[place][WHOSE] not in left
            ]
            if not ready:
                names = ", ".join(f"'{self._tables.names[e]}'" for e in left)
                raise InputError(
                    f"{self._tables.place}: the starts of {names} depend on one another"
                )
            found += [(e, left.pop(e)) for e in ready]
        return found

    def _added(self, elements: Iterable[Element]) -> Iterator[tuple[str, osc.Position]]:
        """Yield whom actions among some elements add, and where."""
        for element in elements:
            action = element.action if isinstance(element, osc.GlobalAction) else None
            if isinstance(action, osc.EntityAction) and isinstance(
                action.action, osc.AddEntityAction
            ):
                yield self._tables.text(action.entity_ref), action.action.position

    def _unmoved(self, storyboard: osc.Storyboard, placed: Collection[str]) -> list[int]:
        """Return the entities that nothing places, leads or moves, never the ego; note them."""
        moved = {
            entity
            for part in walk(storyboard)
            if isinstance(part, osc.Actors)
            for ref in part.entity_refs
            for entity in self._tables.members(ref.entity_ref)
        } | {
            self._tables.entity(private.entity_ref)
            for private in storyboard.init.actions.privates
            if not all(isinstance(part.action, CONTROLLING) for part in private.private_actions)
        }
        found = []
        for e, (name, obj) in enumerate(zip(self._tables.names, self._tables.objects, strict=True)):
            if e and e not in moved and name not in placed and self._towing.towers[e] < 0:
                sentence = f"'{name}' is absent: no action places or moves it"
                self._tables.note(obj, sentence)
                found.append(e)
        return found

    def _deleted(self, actions: Iterable[osc.GlobalAction]) -> list[int]:
        """Return the entities that are deleted at the start."""
        return [
            self._tables.entity(action.action.entity_ref)
            for action in actions
            if isinstance(action.action, osc.EntityAction)
            and isinstance(action.action.action, osc.DeleteEntityAction)
        ]

    def _nowhere(self, e: int, route: Way | None) -> Nowhere:
        """Return the path of an entity that is not there yet; it keeps the route that it gets."""
        if route is not None and (spots := self._actions.waypoints(route)):
            self.routes[e] = self._actions.add_route(spots)
        return Nowhere()

    def _start(
        self,
        e: int,
        position: osc.Position,
        route: Way | None,
        has_driver: bool,
    ) -> PathSpec:
        """Return the path that an entity starts on: along its lane, as far as the file tells."""
        where = position.position
        spots = () if route is None else self._actions.waypoints(route)
        if spots:
            self.routes[e] = self._actions.add_route(spots)
        if not isinstance(where, osc.LanePosition) or not _faces_ahead(where.orientation):
            self._places[e] = self._positions.add(position)
            return Nowhere()
        point, aside = self._tables.point(position)
        if has_driver and e == 0:  # it keeps to its path
            aside = self._tables.literal(where, "offset", aside)
        if not isinstance(point, LanePoint):
            return Nowhere()
        via = tuple(
            LanePoint(spot.road, spot.lane, spot.s, spot.line)
            for spot in spots
            if isinstance(spot, LaneSpot) and spot.s is not None
        )
        if len(via) < len(spots):
            self._places[e] = self._positions.add(position)
            return Nowhere()
        return AlongLanes(point, via, aside)


def _first_position(action: osc.FollowTrajectoryAction) -> osc.Position | None:
    """Return the position that a trajectory's line begins with, if it states one."""
    line = action.trajectory_ref.trajectory.shape.shape
    match line:
        case osc.Polyline():
            return line.vertices[0].position
        case osc.Nurbs():
            return line.control_points[0].position
        case osc.Clothoid():
            return line.position
    return line.segments[0].position_start


def _faces_ahead(turned: osc.Orientation | None) -> bool:
    """Return whether an orientation on a lane is the lane's."""
    if turned is None or turned.h is None:
        return True
    return turned.h == 0.0 and turned.type is not osc.ReferenceContext.ABSOLUTE
