"""Participants and events of a scenario file: built, with the rules they must keep."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.adversary import DRIVERS, LOOKING
from bridgegen.scenario.language.choices import Choices
from bridgegen.scenario.language.event_kinds import EVENT_KINDS, EventKind
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.parameters import Axis, Derived, Parameter, at, nearest
from bridgegen.scenario.language.places import Places, Quantities
from bridgegen.scenario.language.plain_yaml import Document, Path, entries
from bridgegen.scenario.language.roads import LETTERS, Quantity, RoadsSpec
from bridgegen.scenario.language.schema_types import Formula, ShapedSection, Text, section
from bridgegen.scenario.language.story import (
    CONDITIONS,
    GHOST_UNITS,
    TRACKER_UNITS,
    Action,
    Arrival,
    Change,
    ConditionSpec,
    EventSpec,
    Ghost,
    Indication,
    KeepDistance,
    LaneChange,
    LaneOffset,
    Opening,
    Participant,
    SpeedChange,
    Waypoint,
    WeatherChange,
)
from bridgegen.scenario.language.story_schema import (
    ACTIONS,
    ConditionSection,
    EventSection,
    GhostSection,
    ParticipantSection,
    PassSection,
    RouteChangeSection,
    TrackerSection,
    WaypointSection,
    WorksSection,
)
from bridgegen.scenario.named_models import MODELS, body_of
from bridgegen.scenario.participants import PARTICIPANTS, TYPES, Body
from bridgegen.scenario.weather import PARAMETERS

EGO = "ego"

MOST_ASIDE = 4.0
"""Largest offset from the lane's centre [m]: a lane and a shoulder are seldom wider."""

FASTEST_REVERSE = -5.0
"""Fastest speed in reverse [m/s]; 18 km/h is about what a reverse gear does."""

DOOR = Body(1.1, 0.06, 1.1, center_ahead=-0.55, max_speed=1.0, mass=30.0)
"""A front door of a car, whose reference point is its hinge; ours."""

HINGE_BEHIND = 1.3
"""Distance from a vehicle's front to the hinges of its front doors [m]; ours."""

DOOR_GAP, DOOR_BEND, DOOR_ANGLE = 0.06, 0.02, math.radians(70.0)
"""Distance from a vehicle's side to the hinge [m]; and the bend that the hinge goes round, of two
straight lines of that length [m], so that the door turns by that angle [rad]; ours. A door that
turned on the spot would have no path, and a body faster than 0.1 m/s is none that stands."""

DOOR_WAY = 0.8819 * 2.0 * DOOR_BEND
"""Length of the curve of a door's hinge round that bend [m]."""

WEATHER_STEPS = 5
"""Steps of a weather that changes over a time."""

BEFORE = 5.0
"""Distance before what it passes at which the ego is beside its lane [m]: its front is 3.7 m ahead
of its rear axle; ours."""

BEHIND = 3.0
"""Distance behind it from which on the ego returns [m]: its rear is 1 m behind the axle; ours."""

_OF_EVENTS = ("after", "began")
_OF_DISTANCE = {
    "distance": "m", "time": "s", "acceleration": "m/s²", "braking": "m/s²", "max_speed": "m/s",
}  # fmt: skip
"""What one that keeps its distance may be given, and its units."""

_OFF_LANES = tuple(
    name
    for name in TYPES
    if PARTICIPANTS[name].seen_as.conduct != "obstacle" and not PARTICIPANTS[name].on_rails
)
"""Types that may have a path of their own."""


class Storyboard:
    """A file's sections on participants and events, as far as they have the right shape.

    Attributes:
        participants: as ``LogicalScenario`` holds them.
        events: likewise.
        perception: likewise, ghosts and the numbers of the tracker.
        known: the participants' names, also of those that are described wrongly.
        derived: the weathers between, where one changes over a time.

    Args:
        quantities: of the file; collects problems.
        roads: what waypoints may lie on.
        prefixes: of the weathers that an event may change to.
        more: names of participants that other parts of the file bring.
    """

    def __init__(
        self,
        quantities: Quantities,
        roads: RoadsSpec,
        prefixes: tuple[str, ...] = (),
        more: tuple[str, ...] = (),
    ) -> None:
        self._quantities, self._roads, self._prefixes = quantities, roads, prefixes
        self._places, self._choices = Places(quantities, roads), Choices(quantities)
        self._report, self._check = quantities.report, quantities.check
        document = quantities.document
        # Whether the scenario's own events move the ego, as it has no driver of its own.
        self._by_file = (
            isinstance(document.data, dict) and document.data.get("driver") == "storyboard"
        )
        self.known = [str(name) for name, _ in entries(document, "participants")] + list(more)
        self._events_read = list(entries(document, "events"))
        self._event_names = [str(name) for name, _ in self._events_read]
        self.derived: list[Derived] = []
        self.participants = tuple(self._participants())
        self.participants += tuple(self._doors())
        self._acting = {participant.name: participant for participant in self.participants}
        self.events = tuple(self._events())
        self.perception = tuple(self._ghosts()), self._tracker()

    # -- participants --------------------------------------------------------------------------

    def _participants(self) -> Iterator[Participant]:
        if EGO not in self.known:
            self._report("participants must hold 'ego', the system under test", ("participants",))
        elif len(self.known) < 2 and not self._by_file:
            self._report("participants must hold another one besides the ego", ("participants",))
        for key, data in entries(self._quantities.document, "participants"):
            name, path = str(key), ("participants", key)
            given = section(ParticipantSection, data)
            if given is None:
                continue
            if not name.isidentifier() or not name.isascii():
                self._report(f"a participant's name is a word, got '{name}'", path)
            slowest = _slowest(name, given.type)
            self._check(given.speed, "m/s", (*path, "speed"), low=slowest)
            self._check_heading(name, given, path)
            self._check_body(name, given, path)
            self._choices.check_types(name, given, path)
            self._choices.check_places(name, given, path)
            if given.siren and (given.type != "emergency" or name == EGO):
                self._report(
                    f"a siren is for emergency vehicles other than the ego, {name} is a "
                    f"{given.type}",
                    (*path, "siren"),
                )
            if given.exceeds_limit and PARTICIPANTS[given.type].seen_as.conduct != "vehicle":
                self._report(
                    f"a speed limit is for vehicles, {name} has none to exceed",
                    (*path, "exceeds_limit"),
                )
            if given.off_crosswalk and given.type != "pedestrian":
                self._report(
                    f"off_crosswalk is for pedestrians, {name} is of type {given.type}",
                    (*path, "off_crosswalk"),
                )
            self._check_driver(name, given, path)
            way = "lane_change" if given.lane_change else "passes"
            if (given.lane_change or given.passes) and (name != EGO or given.places):
                self._report(
                    f"a {way} is for the route of the ego, from one start to one end; others "
                    "change lanes by events",
                    (*path, way),
                )
            if given.lane_change and given.passes:
                self._report("a route has a lane_change or passes something, not both", path)
            if given.places:
                yield self._at_places(name, given, path)
            elif given.path:
                yield self._off_lanes(name, given, path)
            elif given.start is None:
                self._report(f"{name} must have a start or a path", path)
            else:
                yield self._driver(name, given, given.start, path)

    def _at_places(self, name: str, given: ParticipantSection, path: Path) -> Participant:
        """Return a participant whose start and end a category chooses."""
        usual, found = self._choices.default_place(given), {}
        for key, place_section in given.places.items():
            at = given.model_copy(update={"start": place_section.start, "end": place_section.end})
            place = (*path, "places", key)
            found[key] = self._driver(name, at, place_section.start, place)
            self._check_heading(name, at, place)
        chosen = found[usual or next(iter(found))]
        ways = tuple((found[key].start, found[key].end) for key in self._choices.places(given))
        return replace(chosen, place_by=given.place_by or "", ways=ways)

    def _off_lanes(self, name: str, given: ParticipantSection, path: Path) -> Participant:
        """Return a participant with a path of its own."""
        points = tuple(
            self._places.waypoint(waypoint_section, (*path, "path", number))
            for number, waypoint_section in enumerate(given.path)
        )
        if given.start is not None or given.end is not None:
            self._report(f"{name} must have a path, or a start and an end, not both", path)
        if len(points) < 2:
            self._report(f"a path leads through two points at least, {name} has one", path)
        if name == EGO:
            self._report("the ego has a route, no path: its driver is under test", path)
        elif given.type not in _OFF_LANES:
            kinds = ", ".join(_OFF_LANES)
            self._report(f"a path is for {kinds}; {name} is of type {given.type}", path)
        elif given.driver in LOOKING and PARTICIPANTS[given.type].seen_as.conduct == "vehicle":
            self._report(
                f"an {given.driver} driver keeps to lanes, {name} has a path: it is scripted", path
            )
        if given.type == "pedestrian" and not given.off_crosswalk:
            self._places.check_crossing(name, points, path)
        return self._participant(name, given, points[0], path=points)

    def _driver(
        self, name: str, given: ParticipantSection, place: WaypointSection, path: Path
    ) -> Participant:
        """Return a participant that keeps to lanes."""
        start = self._places.waypoint(place, (*path, "start"))
        end: Waypoint | None = None
        change: tuple[Waypoint, ...] = ()
        if given.end is not None:
            end = self._places.waypoint(given.end, (*path, "end"), above=True)
            if given.lane_change is not None:
                change = self._route_change(start, end, given.lane_change, (*path, "lane_change"))
            elif given.passes is not None and name == EGO:
                change = self._way_round(start, end, given.passes, (*path, "passes"))
            self._check_route(name, start, end, given, path)
        elif name == EGO:
            self._report("the ego's route must have an end", path)
        if name == EGO and isinstance(start.offset, str):
            self._report(
                f"the ego's offset is a constant, its driver keeps to one path; got "
                f"'{start.offset}'",
                path,
            )
        conduct = PARTICIPANTS[given.type].seen_as.conduct
        if name == EGO and PARTICIPANTS[given.type].on_rails:
            self._report(
                f"the ego must be a vehicle that its driver can steer, a {given.type} runs on "
                f"rails; got type '{given.type}'",
                (*path, "type"),
            )
        stands = conduct in ("obstacle", "pedestrian", "animal")
        if stands and (given.speed != 0.0 or end is not None):
            self._report(f"{name} without a path stands: no speed, no end", path)
        if given.type == "pedestrian" and start.lane != "sidewalk" and not given.off_crosswalk:
            self._report(
                f"{name} must stand on a sidewalk: pedestrians are on roads to cross; else "
                "off_crosswalk states why",
                path,
            )
        if conduct == "vehicle" and start.lane == "sidewalk":
            self._report(f"{name} must stand on a lane: vehicles are on roads only", path)
        return self._participant(name, given, start, end=end, heading=given.heading, change=change)

    def _participant(
        self, name: str, given: ParticipantSection, start: Waypoint, **more: Any
    ) -> Participant:
        return Participant(
            name,
            given.type,
            start,
            speed=given.speed,
            driver=given.driver or "",
            exceeds_limit=given.exceeds_limit or "",
            off_crosswalk=given.off_crosswalk or "",
            siren=given.siren,
            own_body=_body(given),
            type_by=given.type_by or "",
            types=self._choices.types(given),
            model=given.model or "",
            **{"end": None, **more},
        )

    def _doors(self) -> Iterator[Participant]:
        """Yield the doors that events open: bodies of their own, closed along their vehicles."""
        vehicles = {each.name: each for each in self.participants}
        for key, data in self._events_read:
            given, path = section(EventSection, data), ("events", key)
            if given is None or given.door is None:
                continue
            of = vehicles.get(str(given.participant))
            if (
                of is None
                or of.conduct != "vehicle"
                or of.name == EGO
                or PARTICIPANTS[of.type].on_rails
            ):
                self._report(f"{key}: a door is of a vehicle other than the ego", (*path, "door"))
            elif of.path or of.heading or of.place_by or of.type_by or self._drives(of):
                what = "stands along its lane, at one place and of one type"
                self._report(f"{key}: who opens a door {what}, {of.name} does not", (*path, "door"))
            elif given.time is None or isinstance(given.time, str) or given.time <= 0.0:
                what = f"a constant time greater than 0 [s], got {given.time}"
                self._report(f"{key}: a door opens within {what}", (*path, "door"))
            else:
                yield self._door(of, given.door, self._quantities.document.at(path))

    def _drives(self, participant: Participant) -> bool:
        events = (section(EventSection, value) for _, value in self._events_read)
        return participant.speed != 0.0 or any(
            event is not None
            and event.participant == participant.name
            and (event.speed is not None or event.keep_distance or event.arrive)
            for event in events
        )

    def _door(self, of: Participant, side: str, place: str) -> Participant:
        """Return the closed door of a vehicle; its path is the bend in which it opens."""
        name, left = door_of(of.name, side), 1.0 if side == "left" else -1.0
        ahead = of.body.front - HINGE_BEHIND
        aside = left * (0.5 * of.body.width + DOOR_GAP)
        turned = DOOR_BEND * elementary.cos(DOOR_ANGLE), DOOR_BEND * elementary.sin(DOOR_ANGLE)
        bend = ((0.0, 0.0), (DOOR_BEND, 0.0), (DOOR_BEND + turned[0], -left * turned[1]))
        points: list[Waypoint] = []
        for number, (along, across) in enumerate(bend, start=1):
            values: list[Quantity] = []
            forward = 1.0 if of.start.way == "out" else -1.0
            for label, start, by in (
                ("at", of.start.distance, forward * (ahead + along)),
                ("offset", of.start.offset, aside + across),
            ):
                if not isinstance(start, str):
                    values.append(by + start)
                elif start in self._quantities.declared:
                    key, text = f"{name}_{label}_{number}", parse(f"{start} + ({by!r})", place)
                    why, said = "It is hinged to its vehicle.", f"Where the hinge of {name} is."
                    self.derived.append(
                        Derived(key, Axis.PARTICIPANTS, "m", text, why, "ours", said, place)
                    )
                    values.append(key)
                else:
                    values.append(by)  # an unknown name is reported already
            points.append(replace(of.start, distance=values[0], offset=values[1]))
        return Participant(name, "obstacle", points[0], None, 0.0, tuple(points), own_body=DOOR)

    def _ghosts(self) -> Iterator[Ghost]:
        for key, data in entries(self._quantities.document, "ghosts"):
            name, path = str(key), ("ghosts", key)
            given = section(GhostSection, data)
            if given is None:
                continue
            if not name.isidentifier() or not name.isascii():
                self._report(f"a ghost's name is a word, got '{name}'", path)
            stated = [given.at, given.rate, given.mirrors].count(None) == 2
            if not stated or (given.mirrors is None) != (given.aside is None):
                what = "a place (at), a rate, or mirrors with aside"
                self._report(f"ghost {name} must have {what}, one of the three", path)
            if given.mirrors == EGO or given.mirrors not in (None, *self.known):
                what = f"ghosts.{name}.mirrors must name another participant"
                self._report(f"{what}, got '{given.mirrors}'", path)
            numbers = {w: value for w in GHOST_UNITS if (value := getattr(given, w)) is not None}
            for word, value in numbers.items():
                above = word in ("rate", "appears", "lifetime", "share")
                low = -math.inf if word == "aside" else 0.0
                self._check(value, GHOST_UNITS[word], (*path, word), low=low, above=above)
            near, far = given.vanishes, given.appears
            if not isinstance(near, str) and not isinstance(far, str) and near >= far:
                self._report(f"vanishes < appears [m] must hold, got {near:g} and {far:g}", path)
            yield Ghost(name, given.type, numbers, given.mirrors or "")

    def _tracker(self) -> dict[str, Quantity]:
        given = section(TrackerSection, dict(entries(self._quantities.document, "tracker")) or None)
        if given is None:
            return {}
        numbers: dict[str, Quantity] = {word: getattr(given, word) for word in TRACKER_UNITS}
        for word, value in numbers.items():
            low = 1.0 if word in ("confirm", "of") else 0.0
            self._check(value, TRACKER_UNITS[word], ("tracker", word), low=low)
        for word, limit in (("extent", 1.0), ("of", 30.0)):  # frames of `_tracking_kernels`
            highest = self._places.range_of(numbers[word])[1]
            if limit < highest < math.inf:
                what = f"tracker.{word} [1] must be at most {limit:g}, got {highest:g}"
                self._report(what, ("tracker", word))
        if self._places.range_of(given.confirm)[0] > self._places.range_of(given.of)[1]:
            self._report(f"confirm <= of must hold, got {given.confirm}, {given.of}", ("tracker",))
        if (given.angle == 0.0) != (given.range == 0.0):
            self._report("tracker must have angle and range, or neither", ("tracker",))
        return numbers

    def _route_change(
        self, start: Waypoint, end: Waypoint, given: RouteChangeSection, path: Path
    ) -> tuple[Waypoint, ...]:
        """Return where the ego's route may change lanes, and where it must have; () if nowhere."""
        if not isinstance(end.lane, int):
            return ()  # the ego is on lanes: reported where the route is checked
        merges = self._roads.template == "merge" and start.leg == "ramp"
        first = Waypoint(end.leg, end.way, given.at, end.lane + given.lanes)
        until = given.at + given.within
        last = replace(first, distance=until, lane=end.lane)
        if merges and (given.at, given.lanes) != (0.0, 1):
            self._report(
                "the ego that merges changes to its left from where the acceleration lane begins: "
                f"lanes 1, at 0 m, got {given.lanes} and {given.at:g} m",
                path,
            )
        elif merges:
            length = self._roads.knobs["merge_length"]
            if not isinstance(length, str) and given.within > length:
                self._report(
                    f"the ego must have merged within the acceleration lane, {length:g} m, got "
                    f"{given.within:g} m",
                    (*path, "within"),
                )
        else:
            lane = end.lane + given.lanes
            if lane < 1 or end.way == "in":
                self._report(
                    "a lane change leads from a lane that goes along the leg to the one beside, "
                    f"got lane {lane} {end.way} of leg {end.leg}",
                    path,
                )
            else:
                place = WaypointSection(leg=end.leg, way=end.way, distance=given.at)
                self._places.waypoint(place.model_copy(update={"lane": lane}), path)
        bounds = [(self._places.range_of(end.distance)[0], until, "end")]
        if start.leg == end.leg:
            bounds.append((given.at, self._places.range_of(start.distance)[1], "start"))
        for far, near, which in bounds:
            if not near < far:
                self._report(
                    f"a lane change lies between the route's start and end: {given.at:g} to "
                    f"{until:g} m, but its {which} may be at "
                    f"{far if which == 'end' else near:g} m",
                    path,
                )
        return (Waypoint("ramp", "in", 0.0) if merges else first, last)

    def _way_round(
        self, start: Waypoint, end: Waypoint, given: PassSection, path: Path
    ) -> tuple[Waypoint, ...]:
        """Return where the ego's route leaves its lane, must be beside it, returns, and is back."""
        found = self._obstruction(given.around)
        if found is None:
            self._report(
                "the ego passes a participant that stands on a lane at a constant distance, or "
                f"road works that do, got '{given.around}'",
                (*path, "around"),
            )
            return ()
        place, rear, front = found
        on = [at for at in (start, end) if (at.leg, at.way) == (place.leg, place.way)]
        if place.lane not in [at.lane for at in on]:
            self._report(
                f"what the ego passes is in its lane, but {given.around} is on {place}", path
            )
            return ()
        lane, way = int(place.lane) - given.lanes, place.way
        if lane < 1:
            lane, way = 1, "in" if way == "out" else "out"
        sign, at = (1.0 if place.way == "out" else -1.0), float(place.distance)
        over, until = at - sign * (rear + BEFORE), at + sign * (front + BEHIND)
        leaves, back = over - sign * given.before, until + sign * given.after
        other = WaypointSection(leg=place.leg, way=way, lane=lane, distance=max(over, 0.0))
        beside = self._places.waypoint(other, path)
        for far, near, which in (
            *((leaves, edge, "start") for edge in self._places.range_of(start.distance)),
            *((edge, back, "end") for edge in self._places.range_of(end.distance)),
        ):
            if (start if which == "start" else end) in on and not sign * (far - near) > 0.0:
                self._report(
                    f"the ego leaves its lane at {leaves:g} m and is back at {back:g} m, between "
                    f"its route's start and end, but its {which} may be at "
                    f"{near if which == 'start' else far:g} m",
                    path,
                )
                break
        own = replace(place, offset=0.0)
        return (
            replace(own, distance=leaves),
            replace(beside, distance=over),
            replace(beside, distance=until),
            replace(own, distance=back),
        )

    def _obstruction(self, name: str) -> tuple[Waypoint, float, float] | None:
        """Return where what stands in a lane is, and how far it reaches back and ahead [m]."""
        document = self._quantities.document
        for key, data in entries(document, "road_works"):
            works = section(WorksSection, data) if key == name else None
            if works is not None and not isinstance(works.start.distance, str):
                at = self._places.waypoint(works.start, ("road_works", key, "start"))
                return (at, 0.0, works.length) if isinstance(at.lane, int) else None
        for key, data in entries(document, "participants"):
            given = section(ParticipantSection, data) if key == name else None
            if given is None or given.start is None or self._moves(name, given):
                continue
            at = self._places.waypoint(given.start, ("participants", key, "start"))
            bodies = [_body(given) or body_of(given.model or given.type)]
            bodies += map(body_of, self._choices.types(given))
            rear, front = (max(getattr(body, end) for body in bodies) for end in ("rear", "front"))
            if given.heading != 0.0:
                rear = front = max(rear, front)
            if isinstance(at.lane, int) and not isinstance(at.distance, str):
                return at, rear, front
        return None

    def _check_body(self, name: str, given: ParticipantSection, path: Path) -> None:
        """Check model and own body, if there are: what the type's has none of, it has not."""
        if given.model and MODELS[given.model].type != given.type:
            self._report(
                f"model of {name} must be a {given.type}, {given.model} is a "
                f"{MODELS[given.model].type}",
                (*path, "model"),
            )
        usual = PARTICIPANTS[given.type].body
        for key, value in given.body.model_dump().items() if given.body else ():
            if value is not None and getattr(usual, key) == 0.0 and key != "mass":
                self._report(f"{name}, of type {given.type}, has no {key}", (*path, "body", key))

    def _check_heading(self, name: str, given: ParticipantSection, path: Path) -> None:
        """Check how a participant is turned from its lane's direction, if it is."""
        heading, place = given.heading, (*path, "heading")
        if heading == 0.0:
            return
        self._check(heading, "deg", place, low=-180.0)
        parameter = self._quantities.parameters.get(heading) if isinstance(heading, str) else None
        most = parameter.high if parameter else heading
        if not isinstance(most, str) and most > 180.0:
            self._report(f"heading of {name} [deg] must be -180 to 180, got {most:g}", place)
        if name == EGO:
            self._report("the ego drives along its route, it has no heading", place)
        elif given.path:
            self._report(f"{name} goes along its path, it has no heading of its own", place)
        elif given.end is not None:
            self._report(
                f"a route leads along lanes in their direction: {name} has an end, so no heading",
                place,
            )
        elif self._moves(name, given) and heading not in (180.0, -180.0):
            self._report(
                f"{name} moves, so it drives along its lane or against the traffic: heading 0 or "
                f"180 deg, got {heading}",
                place,
            )

    def _moves(self, name: str, given: ParticipantSection) -> bool:
        """Return whether a participant is given a speed, at the start or by an event."""
        # From the file's sections: the events are built after the participants, which they refer
        # to.
        events = (section(EventSection, value) for _, value in self._events_read)
        return given.speed != 0.0 or any(
            event is not None
            and event.participant == name
            and (event.speed not in (None, 0.0) or event.keep_distance or event.arrive)
            for event in events
        )

    def _check_driver(self, name: str, given: ParticipantSection, path: Path) -> None:
        """Check a participant's driver, if it has one."""
        driver, place = given.driver, (*path, "driver")
        if driver is None:
            return
        if name == EGO:
            self._report(
                f"the ego's driver is named once, by the scenario's own key 'driver'; got "
                f"'{driver}' here",
                place,
            )
        elif driver == EGO:
            kind, has_route = PARTICIPANTS[given.type], given.end or given.places
            if kind.seen_as.conduct != "vehicle" or kind.on_rails or given.path or not has_route:
                why = "the ego's driver drives vehicles that have a start and an end on lanes"
                self._report(f"{why}; {name} is of type {given.type}", place)
        elif driver not in DRIVERS:
            hint = nearest(driver, DRIVERS)
            self._report(
                f"the driver of {name} must be one of {', '.join(DRIVERS)}, ego (others are for "
                f"the ego), got '{driver}'{hint}",
                place,
            )
        elif driver in LOOKING and PARTICIPANTS[given.type].seen_as.conduct == "obstacle":
            self._report(f"{name} is an obstacle, which has no driver; got '{driver}'", place)

    def _check_route(
        self, name: str, start: Waypoint, end: Waypoint, given: ParticipantSection, path: Path
    ) -> None:
        if not {start.leg, end.leg} <= {*self._roads.leg_names}:
            return  # reported where the place was read
        by_points = given.start is not None and given.start.point is not None
        if self._roads.template == "road":
            change = given.lane_change
            lane = start.lane if change is None else int(start.lane) - change.lanes
            if (start.leg, start.way, lane) != (end.leg, end.way, end.lane):
                self._report(
                    f"a route changes no lane but by lane_change: {name} goes from {start} to "
                    f"{end}",
                    path,
                )
            return
        for place, way, number, word in ((start, "in", 1, "start"), (end, "out", 2, "end")):
            if place.way != way:
                got = _point(place) if by_points else str(place)
                which = ", ".join(f"P{2 * LETTERS.index(leg) + number}" for leg in self._roads.legs)
                what = f"a route {word}s where an {way}bound lane does: {which}, got {got}"
                self._report(what, (*path, word))
        back = start.leg == end.leg and start.way == "in" and end.way == "out"
        if back and self._roads.template != "roundabout":
            self._report(
                f"a route must not turn back: {_point(start)} to {_point(end)} is one leg", path
            )

    # -- what and when -------------------------------------------------------------------------

    def _events(self) -> Iterator[EventSpec]:
        for key, data in self._events_read:
            name, path = str(key), ("events", key)
            given = section(EventSection, data)
            if given is None:
                continue
            if not name.isidentifier() or not name.isascii():
                self._report(f"an event's name is a word, got '{name}'", path)
            actions = tuple(self._actions(name, given, path))
            if not actions:
                self._report(f"{name} must have an action: {', '.join(ACTIONS)}", path)
            if given.participant is not None:
                self._check_participant(given.participant, (*path, "participant"))
                acting = self._acting.get(given.participant)
                if (given.participant == EGO and not self._by_file) or (
                    acting and acting.driver == EGO
                ):
                    self._report("events move the others; the ego's driver is under test", path)
            when = tuple(
                tuple(self._conditions(given, condition_section, (*path, "when", number)))
                for number, condition_section in enumerate(given.when)
            )
            if given.door is not None:
                door, time = door_of(str(given.participant), given.door), given.time
                speed = DOOR_WAY / (time if isinstance(time, float) and time > 0.0 else 1.0)
                opened = ConditionSpec("travelled", 0.98 * DOOR_WAY, of=door)
                when = tuple(  # of the vehicle: the door is not there yet
                    tuple(
                        each
                        if each.kind in ("time", *_OF_EVENTS)
                        else replace(each, of=each.of or given.participant)
                        for each in conditions
                    )
                    for conditions in when
                )
                begins, ends = SpeedChange(speed, Change()), SpeedChange(0.0, Change())
                yield EventSpec(name, door, (*actions, begins), when)
                yield EventSpec(f"{name}_ends", door, (ends,), ((opened,),))
                continue
            if given.weather is not None and given.time is not None:
                yield from self._weather_in_steps(name, given, when, path)
                continue
            yield EventSpec(name, given.participant, actions, when)

    def _weather_names(self, prefix: str) -> list[str]:
        """Return the parameters of the weather that are declared with a prefix."""
        return [name for name in PARAMETERS if prefix + name in self._quantities.declared]

    def _weather_in_steps(
        self,
        name: str,
        given: EventSection,
        when: tuple[tuple[ConditionSpec, ...], ...],
        path: Path,
    ) -> Iterator[EventSpec]:
        """Yield the events of a weather that changes over a time, in `WEATHER_STEPS` equal steps.

        OpenSCENARIO has no weather that changes steadily.
        """
        prefix, time = str(given.weather), given.time
        if isinstance(time, str):
            what = f"time of {name} [s] must be a constant, got '{time}': steps are events"
            self._report(what, (*path, "time"))
            time = 1.0
        assert time is not None
        self._check(time, "s", (*path, "time"), above=True)
        changes = [data for _, data in self._events_read if isinstance(data, dict)]
        if sum("weather" in data for data in changes) > 1:
            what = f"{name} changes the weather over a time, which begins with that of the start"
            self._report(f"{what}: no other event may change it", path)
        place = self._quantities.document.at(path)
        for step in range(1, WEATHER_STEPS + 1):
            share, between = step / WEATHER_STEPS, f"{prefix}{step}_"
            if step == WEATHER_STEPS:
                between = prefix
            for each in self._weather_names(prefix) if step < WEATHER_STEPS else ():
                unit, to = PARAMETERS[each].unit, f"{prefix}{each}"
                value = parse(f"{each} + {share!r}*({to} - {each})", place)
                why = "The weather changes step by step."
                said = f"{each} after step {step} of {WEATHER_STEPS} of {name}."
                self.derived.append(
                    Derived(between + each, Axis.WEATHER, unit, value, why, "ours", said, place)
                )
            change = WeatherChange(between, step == WEATHER_STEPS and prefix in self._prefixes)
            if step == 1:
                yield EventSpec(name, None, (change,), when)
            else:
                after = time * (step - 1) / (WEATHER_STEPS - 1)
                began = ConditionSpec("began", after, event=name)
                yield EventSpec(f"{name}_{step}", None, (change,), ((began,),))

    def _actions(self, name: str, given: EventSection, path: Path) -> Iterator[Action]:
        if given.weather is not None:
            is_whole = given.weather in self._prefixes
            names = self._weather_names(given.weather)
            if not names:
                known = ", ".join(self._prefixes) or "none"
                self._report(
                    f"{name} changes the weather to one that is included with a prefix "
                    f"('weather as {given.weather}'), or to parameters of such names "
                    f"({given.weather}fog_density); there are: {known}",
                    path,
                )
            for each in names if not is_whole else ():
                unit, low = PARAMETERS[each].unit, -math.inf
                self._check(f"{given.weather}{each}", unit, (*path, "weather"), low=low)
            if given.participant is not None:
                self._report(f"{name}: the weather has no participant", path)
            yield WeatherChange(given.weather, is_whole)
        elif given.participant is None:
            self._report(f"{name} must have a participant", path)
        if given.door is not None:
            if given.speed is not None or given.lane_change or given.weather is not None:
                self._report(f"{name} opens a door, and does nothing else", path)
            yield Opening()
        elif given.speed is not None:
            actor = self._acting.get(str(given.participant))
            slowest = _slowest(actor.name, actor.type) if actor else 0.0
            self._check(given.speed, "m/s", (*path, "speed"), low=slowest)
            if given.jerk is not None:
                self._check(given.jerk, "m/s³", (*path, "jerk"), above=True)
                if given.rate is None or given.shape != "linear":
                    self._report("a jerk is for a rate, without a shape", (*path, "jerk"))
            change = self._change(given.rate, given.time, given.distance, given.shape, path)
            yield SpeedChange(given.speed, replace(change, jerk=given.jerk))
        elif any(
            value is not None
            for value in (given.rate, given.jerk, given.distance)
            + ((given.time,) if given.weather is None else ())
        ):
            self._report(f"{name} has a change of speed without its target (speed)", path)
        if given.lane_change is not None:
            lane_change = given.lane_change
            if lane_change.lanes == 0.0:
                self._report("lane_change must not be 0 lanes", (*path, "lane_change"))
            if lane_change.time is None and lane_change.distance is None:
                self._report("a lane change takes a time or a distance", (*path, "lane_change"))
            change = self._change(
                None,
                lane_change.time,
                lane_change.distance,
                lane_change.shape,
                (*path, "lane_change"),
            )
            actor = self._acting.get(str(given.participant))
            if actor is not None and actor.name != EGO and (actor.end is not None or actor.path):
                self._report(f"{actor.name} changes lane, so it has no end and no path", path)
            if actor is not None and PARTICIPANTS[actor.type].on_rails:
                self._report(
                    f"{actor.name}, a {actor.type}, runs on rails and changes no lane", path
                )
            yield LaneChange(int(lane_change.lanes), change)
        yield from self._moves_aside(name, given, path)
        yield from self._beside_others(name, given, path)
        if given.indicate is not None:
            actor = self._acting.get(str(given.participant))
            if actor is not None and PARTICIPANTS[actor.type].seen_as.conduct != "vehicle":
                self._report(
                    f"{actor.name}, a {actor.type}, has no indicators", (*path, "indicate")
                )
            yield Indication(given.indicate)

    def _moves_aside(self, name: str, given: EventSection, path: Path) -> Iterator[Action]:
        aside, place = given.lane_offset, (*path, "lane_offset")
        if aside is None:
            return
        self._check(aside.offset, "m", (*place, "offset"), low=-MOST_ASIDE)
        parameter = self._quantities.parameters.get(str(aside.offset))
        most = parameter.high if parameter else aside.offset
        if not isinstance(most, str) and most > MOST_ASIDE:
            self._report(
                f"offset of {name} [m] must be {-MOST_ASIDE:g} to {MOST_ASIDE:g}, beyond that it "
                f"changes lane, got {most:g}",
                (*place, "offset"),
            )
        self._check(aside.acceleration, "m/s²", (*place, "acceleration"), above=True)
        actor = self._acting.get(str(given.participant))
        if actor is not None and (actor.path or PARTICIPANTS[actor.type].on_rails):
            self._report(f"{actor.name} keeps to its path and cannot move aside", place)
        yield LaneOffset(aside.offset, aside.acceleration, aside.shape)

    def _beside_others(self, name: str, given: EventSection, path: Path) -> Iterator[Action]:
        """Yield the actions whose speed depends on another participant."""
        keeps, arrives = given.keep_distance, given.arrive
        if sum(item is not None for item in (given.speed, keeps, arrives)) > 1:
            self._report(
                f"{name} must have one of speed, keep_distance and arrive: each sets the speed",
                path,
            )
        actor = self._acting.get(str(given.participant))
        for other, key in (
            (keeps.to if keeps else None, "keep_distance"),
            (arrives.other if arrives else None, "arrive"),
        ):
            if other is None:
                continue
            self._check_participant(other, (*path, key))
            if other == given.participant:
                self._report(f"{key} is to another participant, got '{other}' twice", (*path, key))
            if actor is not None and actor.driver in LOOKING:
                self._report(
                    f"{actor.name} is {actor.driver}, its driver keeps the distance; {key} is for "
                    "one that is scripted",
                    (*path, key),
                )
        if keeps is not None:
            place = (*path, "keep_distance")
            if (keeps.distance is None) == (keeps.time is None):
                self._report(f"{name} keeps a distance or a time, one of them", place)
            values = {part: getattr(keeps, part) for part in _OF_DISTANCE}
            for part, value in values.items():
                if value is not None:
                    self._check(value, _OF_DISTANCE[part], (*place, part), above=True)
            yield KeepDistance(keeps.to, **values)
        if arrives is not None:
            places = [
                self._places.waypoint(waypoint_section, (*path, "arrive", key))
                for waypoint_section, key in ((arrives.at, "at"), (arrives.place, "place"))
            ]
            yield Arrival(places[0], arrives.other, places[1])

    def _change(
        self,
        rate: Quantity | None,
        time: Quantity | None,
        distance: Quantity | None,
        shape: str,
        path: Path,
    ) -> Change:
        given = {"rate": (rate, "m/s²"), "time": (time, "s"), "distance": (distance, "m")}
        for key, (value, unit) in given.items():
            if value is not None:
                self._check(value, unit, (*path, key), above=True)
        if sum(value is not None for value, _ in given.values()) > 1:
            self._report("a change takes a rate, a time or a distance, one of them", path)
        return Change(rate, time, distance, shape)  # type: ignore[arg-type]

    def _conditions(
        self, event: EventSection, given: ConditionSection, path: Path
    ) -> Iterator[ConditionSpec]:
        """Yield the conditions of one alternative."""
        if given.all:
            if given.kind is not None:
                self._report("an alternative is a condition, or 'all' of several, not both", path)
            for number, each in enumerate(given.all):
                if each.kind == "began":
                    self._report(
                        "a 'began' condition holds for an instant, so it stands alone, not in "
                        "'all'",
                        (*path, "all", number),
                    )
                yield from self._conditions(event, each, (*path, "all", number))
            return
        if given.kind is None:
            self._report(f"a condition must have a kind: {', '.join(CONDITIONS)}", path)
            return
        kind, subject = CONDITIONS[given.kind], given.of or event.participant
        self._check(given.value, kind.unit, (*path, "value"))
        if given.kind == "contact" and given.value != 0.0:
            self._report(f"a contact condition has no value, got {given.value}", (*path, "value"))
        if given.kind in _OF_EVENTS and isinstance(given.value, str):
            self._report(
                f"value of an '{given.kind}' condition [s] must be a constant, got "
                f"'{given.value}': "
                "delays are part of the storyboard, which is the same for all rows",
                (*path, "value"),
            )
        if not kind.pair and given.to is not None:
            self._report(f"a {given.kind} condition has no 'to', got '{given.to}'", path)
        if kind.pair and given.to is None:
            self._report(f"a {given.kind} condition needs 'to', the other participant", path)
        elif kind.pair:
            self._check_participant(str(given.to), (*path, "to"))
            if given.to == subject:
                self._report(
                    f"a {given.kind} is to another participant, got '{given.to}' twice", path
                )
        if given.of is not None:
            self._check_participant(given.of, (*path, "of"))
        elif subject is None and given.kind not in ("time", *_OF_EVENTS):
            self._report(f"a {given.kind} condition needs 'of', whose it is", path)
        if (given.kind in _OF_EVENTS) != (given.event is not None):
            self._report("an 'after' or 'began' condition, and no other, names an event", path)
        elif given.event is not None and given.event not in self._event_names:
            hint = nearest(given.event, self._event_names)
            self._report(f"unknown event '{given.event}'{hint}", path)
        yield ConditionSpec(given.kind, given.value, given.to, given.of, given.event)

    def _check_participant(self, name: str, path: Path) -> None:
        if name not in self.known:
            self._report(f"unknown participant '{name}'{nearest(name, self.known)}", path)


def door_of(vehicle: str, side: str) -> str:
    """Return the name of the participant that a front door of a vehicle is."""
    return f"{vehicle}_{side}_door"


def _slowest(name: str, kind: str) -> float:
    """Return the least speed that a participant may be given [m/s]; below 0 it reverses."""
    participant = PARTICIPANTS[kind]
    reverses = name != EGO and participant.seen_as.conduct == "vehicle" and not participant.on_rails
    return FASTEST_REVERSE if reverses else 0.0


def _body(given: ParticipantSection) -> Body | None:
    """Return a body of one's own; the reference point and the axles move with the length."""
    if given.body is None:
        return None
    usual = body_of(given.model or given.type)
    said = {key: value for key, value in given.body.model_dump().items() if value is not None}
    longer = said.get("length", usual.length) / usual.length
    return replace(
        usual, center_ahead=usual.center_ahead * longer, wheelbase=usual.wheelbase * longer, **said
    )


def _point(place: Waypoint) -> str:
    """Return a place's point in the paper's counting; its lane where the leg is no junction's."""
    if place.leg not in LETTERS:
        return str(place)
    return f"P{2 * LETTERS.index(place.leg) + (1 if place.way == 'in' else 2)}"


# --- Which recorded events a scenario is, and what its parameters are in them ---


@dataclass(frozen=True)
class RecordedSpec:
    """What of recorded traffic is this scenario.

    Attributes:
        event: one of `EVENT_KINDS`.
        parameters: a formula of the event's quantities, by parameter.
        where: which events count; None for all.
        place: file and line that declare it, for messages.
    """

    event: str
    parameters: Mapping[str, Expression]
    where: Expression | None = None
    place: str = field(default="", compare=False, repr=False)

    @property
    def needs_lights(self) -> bool:
        """Whether only recordings with traffic lights say which events count."""
        kind = EVENT_KINDS[self.event]
        return kind.needs_lights or (
            self.where is not None and not self.where.names.isdisjoint(kind.of_lights)
        )

    def counts(self, quantities: Mapping[str, Float]) -> Bool:
        """Return which events count, ``(N,)``; not where a quantity that decides is missing.

        Args:
            quantities: ``(N,)`` by name.
        """
        n = len(next(iter(quantities.values())))
        if self.where is None:
            return np.ones(n, np.bool_)
        missing = [np.isnan(quantities[name]) for name in sorted(self.where.names)]
        true = np.broadcast_to(self.where.evaluate(quantities) != 0.0, (n,))
        return np.asarray(true & ~np.any(missing, axis=0)) if missing else np.array(true)

    def values(self, quantities: Mapping[str, Float]) -> dict[str, Float]:
        """Return the parameters of events, ``(N,)`` each; NaN where a quantity is missing."""
        n = len(next(iter(quantities.values())))
        return {
            name: np.broadcast_to(parameter.evaluate(quantities), (n,)).copy()
            for name, parameter in self.parameters.items()
        }


class RecordedSection(ShapedSection):
    """The recorded events that are this scenario, and its parameters in them."""

    event: Text
    """Kind of the recorded event; see docs/recordings.md."""
    parameters: dict[str, Formula]
    """Formulas of the event's quantities, by parameter of the scenario."""
    where: Text | None = None
    """Condition on the quantities of the events that count."""


def read_recorded(
    document: Document, parameters: Mapping[str, Parameter], derived: Mapping[str, Derived]
) -> tuple[RecordedSpec | None, list[str]]:
    """Return the block ``recorded`` of a scenario file, and what is wrong with it.

    What has not the shape of the block is left to the check of the file's shape.
    """
    data = document.data.get("recorded") if isinstance(document.data, dict) else None
    given = section(RecordedSection, data) if data is not None else None
    if given is None:
        return None, []
    place = document.at(("recorded",))
    kind = EVENT_KINDS.get(given.event)
    if kind is None:
        known = nearest(given.event, EVENT_KINDS) or f"; known: {', '.join(EVENT_KINDS)}"
        where = at(document.at(("recorded", "event")))
        return None, [f"recorded.event names the unknown event '{given.event}'{known}{where}"]
    problems: list[str] = []
    formulas: dict[str, Expression] = {}
    if not given.parameters:
        problems.append(f"recorded.parameters must name a parameter{at(place)}")
    for name, formula in given.parameters.items():
        line = document.at(("recorded", "parameters", name))
        problems += [
            f"recorded.parameters{problem}{at(line)}"
            for problem in _target_problems(name, parameters, derived)
        ]
        expression = _formula(str(formula), f"recorded.parameters.{name}", kind, line, problems)
        if expression is not None:
            formulas[name] = expression
    condition = None
    if given.where is not None:
        line = document.at(("recorded", "where"))
        condition = _formula(given.where, "recorded.where", kind, line, problems)
    return RecordedSpec(given.event, formulas, condition, place), problems


def unmapped(
    spec: RecordedSpec, parameters: Mapping[str, Parameter], axis: Axis = Axis.PARTICIPANTS
) -> tuple[str, ...]:
    """Return the parameters of an axis that the events do not give."""
    return tuple(
        name
        for name, parameter in parameters.items()
        if parameter.axis is axis and name not in spec.parameters
    )


def _target_problems(
    name: str, parameters: Mapping[str, Parameter], derived: Mapping[str, Derived]
) -> list[str]:
    if name in derived:
        return [f".{name} is derived: state the parameters that it follows from"]
    if name not in parameters:
        return [f" names the unknown parameter '{name}'{nearest(name, parameters)}"]
    if parameters[name].kind.names:
        return [f".{name} is a category, and events give numbers"]
    return []


def _formula(
    text: str, label: str, kind: EventKind, line: str, problems: list[str]
) -> Expression | None:
    try:
        expression = parse(text, line)
    except InputError as error:
        problems += error.problems
        return None
    problems += [
        f"{label} names '{name}', which is no quantity of '{kind.name}'"
        f"{nearest(name, kind.quantities) or '; it has ' + ', '.join(kind.quantities)}{at(line)}"
        for name in sorted(expression.names - kind.quantities.keys())
    ]
    return expression
