"""Numbers and places of a scenario file: checked, with the parameters that they name."""

import math
from collections.abc import Iterator, Mapping, Set
from itertools import pairwise

from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Axis, Derived, Parameter, nearest
from bridgegen.scenario.language.plain_yaml import Document, Path, entries
from bridgegen.scenario.language.roads import LETTERS, Quantity, RoadsSpec
from bridgegen.scenario.language.schema_types import section
from bridgegen.scenario.language.story import Jam, Participant, RoadWorks, Waypoint
from bridgegen.scenario.language.story_schema import JamSection, WaypointSection, WorksSection
from bridgegen.scenario.participants import PARTICIPANTS

# --- Numbers of a scenario file: constants, or names of parameters in the right unit ---


class Quantities:
    """Checks each number that a file states, and collects what is wrong.

    Attributes:
        problems: the rules that are broken, with their lines.
        used: the parameters that are referred to.

    Args:
        document: the scenario file.
        parameters: what may be referred to.
        derived: likewise; they follow from the parameters, and have no range of their own.
        declared: all names, also of what is declared wrongly: no reason to call it unknown.
    """

    def __init__(
        self,
        document: Document,
        parameters: Mapping[str, Parameter],
        derived: Mapping[str, Derived],
        declared: Set[str],
    ) -> None:
        self.document = document
        self.parameters, self.derived, self.declared = parameters, derived, declared
        self.problems: list[str] = []
        self.used: set[str] = set()

    def report(self, problem: str, path: Path) -> None:
        """Record a problem with its line."""
        self.problems.append(f"{problem} ({self.document.at(path)})")

    def check(
        self, value: Quantity, unit: str, path: Path, *, low: float = 0.0, above: bool = False
    ) -> None:
        """Check a constant, or a reference, that must be ≥ ``low`` (> it, if ``above``)."""
        label = ".".join(str(part) for part in path)
        limit = "finite" if low == -math.inf else f"at least {low:g}"
        rule = f"{label} [{unit}] must be {f'greater than {low:g}' if above else limit}"
        if not isinstance(value, str):
            if not (value > low if above else value >= low) or math.isinf(value):
                extra = "" if low == -math.inf else " and finite"
                self.report(f"{rule}{extra}, got {value}", path)
            return
        self.used.add(value)
        parameter = self.parameters.get(value) or self.derived.get(value)
        if parameter is None:
            if value not in self.declared:
                hint = nearest(value, [*self.parameters, *self.derived])
                self.report(f"{label} names the unknown parameter '{value}'{hint}", path)
            return
        if isinstance(parameter, Parameter) and parameter.kind.names:
            self.report(
                f"{label} needs a number, '{value}' is a category: derive a number from it", path
            )
        elif parameter.unit != unit:
            self.report(
                f"{label} needs a parameter in {unit}, '{value}' is in {parameter.unit}", path
            )
        elif isinstance(parameter, Parameter) and (
            parameter.low < low or (above and parameter.low == low)
        ):
            self.report(f"{rule}, '{value}' goes down to {parameter.low:g}", path)
        if parameter.axis is Axis.STATIC:
            self.report(
                f"{label} must not depend on the static axis, '{value}' does: "
                "one storyboard serves every road network",
                path,
            )


class Places:
    """Reads places, and reports their problems.

    Args:
        quantities: of the file; collects problems.
        roads: what places may lie on.
    """

    def __init__(self, quantities: Quantities, roads: RoadsSpec) -> None:
        self._quantities, self._roads = quantities, roads
        self._report, self._check = quantities.report, quantities.check

    def waypoint(self, given: WaypointSection, path: Path, *, above: bool = False) -> Waypoint:
        """Return a place on a leg, and report its problems."""
        self._check(given.distance, "m", (*path, "distance"), above=above)
        self._check(given.offset, "m", (*path, "offset"), low=-math.inf)
        roads = self._roads
        leg, way = given.leg, given.way
        if given.point is not None:
            if leg is not None or way is not None:
                self._report("a place has a point, or a leg and a way, not both", path)
            at = Waypoint.at_point(given.point, given.distance)
            leg, way = at.leg, at.way
        elif roads.template == "road":
            leg, way = leg or "main", way or "out"
        elif leg is None or way is None:
            self._report("a place must have a point, or a leg and a way", path)
            leg, way = leg or roads.leg_names[0], way or "in"
        if leg not in roads.leg_names:
            points = [f"P{2 * LETTERS.index(n) + k}" for n in roads.legs for k in (1, 2)]
            known = ", ".join(roads.leg_names) + (f" ({', '.join(points)})" if points else "")
            got = given.point or leg
            self._report(f"a place lies on one of the legs {known}, got '{got}'", path)
        elif isinstance(given.lane, int):
            self._check_lane(leg, way, given.lane, path)
        else:
            self._check_strip(leg, given.lane, path)
        return Waypoint(leg, way, given.distance, given.lane, given.offset)  # type: ignore[arg-type]

    def _check_lane(self, leg: str, way: str, lane: int, path: Path) -> None:
        count = self._roads.lanes(leg, way)
        if isinstance(count, str):
            parameter = self._quantities.parameters.get(count)
            least = parameter.low if parameter else lane
            if lane > least:
                self._report(
                    f"lane {lane} of leg {leg} must always be there, '{count}' goes down to "
                    f"{least:g}",
                    path,
                )
        elif lane > count:
            self._report(f"leg {leg} has {count:g} lanes {way}, got lane {lane}", path)

    def _check_strip(self, leg: str, strip: str, path: Path) -> None:
        width = self._roads.knobs[f"{strip}_width"]
        if width == 0.0:
            self._report(f"leg {leg} has no {strip}: {strip}_width must be greater than 0 m", path)
        for way in ("in", "out"):
            count = self._roads.lanes(leg, way)
            if isinstance(count, str):
                self._report(
                    f"a place on a {strip} needs a fixed number of lanes, '{count}' varies: "
                    "one storyboard serves every road network",
                    path,
                )

    def range_of(self, value: Quantity) -> tuple[float, float]:
        """Return the least and the greatest value that a constant or a parameter has."""
        if not isinstance(value, str):
            return value, value
        parameter = self._quantities.parameters.get(value)
        return (parameter.low, parameter.high) if parameter else (-math.inf, math.inf)

    def check_crossing(self, name: str, points: tuple[Waypoint, ...], path: Path) -> None:
        """Report where a pedestrian leaves the sidewalks and crosswalks (paper, Section III-B)."""
        roads = self._roads
        half = roads.knobs["crosswalk_width"]
        reach = 0.5 * (half if isinstance(half, float) else 0.0)
        for waypoint, other in pairwise(points):
            if waypoint.lane == other.lane == "sidewalk" and (waypoint.leg, waypoint.way) == (
                other.leg,
                other.way,
            ):
                continue
            at = roads.crosswalk(waypoint.leg)
            rule = "pedestrians cross on crosswalks only"
            if at is None or waypoint.leg != other.leg:
                self._report(
                    f"{rule}: there is none where {name} crosses leg {waypoint.leg}; else "
                    "off_crosswalk states why",
                    path,
                )
                return
            for point in (waypoint, other):
                low, high = self.range_of(point.distance)
                if low < at - reach - 1e-9 or high > at + reach + 1e-9:
                    got = f"{low:g}" if low == high else f"{low:g} to {high:g}"
                    self._report(
                        f"{rule}: distance of {name} must be {at - reach:g} to {at + reach:g} m "
                        f"on leg {point.leg}, got {got}",
                        path,
                    )


# --- Temporary changes of a scenario file (layer 3): queues and road works, down to each body ---
# Where a place depends on a parameter, so do the places of all that stands in a row with it: each
# gets a derived quantity of its own.


_BESIDE = 0.75
"""Distance of a sign from the carriageway's edge [m]; source: RSA 21, 0.5 to 1.5 m."""
_MOST_CONES = 60


def jam_members(quantities: Quantities) -> tuple[str, ...]:
    """Return the names of all vehicles of a file's jams."""
    names: list[str] = []
    for key, data in entries(quantities.document, "jams"):
        given = section(JamSection, data)
        if given is not None:
            names += (f"{key}_{k}" for k in range(1, len(given.vehicles) + 1))
    return tuple(names)


class TemporaryChanges:
    """A file's sections on layer 3.

    Attributes:
        participants: the vehicles of the jams.
        jams: as ``Story`` holds them.
        works: as ``Story`` holds them.
        derived: the places of what stands in a row.

    Args:
        quantities: of the file; collects problems.
        roads: where it is.
    """

    def __init__(self, quantities: Quantities, roads: RoadsSpec) -> None:
        self._quantities, self._roads = quantities, roads
        self._places = Places(quantities, roads)
        self.participants: list[Participant] = []
        self.derived: list[Derived] = []
        self.jams = tuple(self._jams())
        self.works = tuple(self._works())

    def _jams(self) -> Iterator[Jam]:
        for key, data in entries(self._quantities.document, "jams"):
            name, path = str(key), ("jams", key)
            given = section(JamSection, data)
            if given is None:
                continue
            self._quantities.check(given.gap, "m", (*path, "gap"), above=True)
            tail = self._places.waypoint(given.tail, (*path, "tail"))
            ahead, names = 0.0, []
            for k, kind in enumerate(given.vehicles):
                body = PARTICIPANTS[kind].body
                ahead += body.rear if k else 0.0
                place = self._row(f"{name}_{k + 1}_at", tail, ahead, k, given.gap, path)
                names.append(f"{name}_{k + 1}")
                self.participants.append(Participant(names[-1], kind, place, None, 0.0))
                ahead += body.front
            yield Jam(name, tail, tuple(names))

    def _works(self) -> Iterator[RoadWorks]:
        for key, data in entries(self._quantities.document, "road_works"):
            name, path = str(key), ("road_works", key)
            given = section(WorksSection, data)
            if given is None:
                continue
            start = self._places.waypoint(given.start, (*path, "start"))
            problem = self._works_problem(given, start)
            if problem:
                self._quantities.report(problem, path)
                continue
            count = int(given.length / given.spacing) + 1
            cones = tuple(
                self._moved(
                    f"{name}_cone_{k + 1}_at",
                    start,
                    k * given.spacing,
                    self._offset(given, start, k * given.spacing),
                    path,
                )
                for k in range(count)
            )
            sign = self._moved(
                f"{name}_sign_at", start, -given.sign_before, self._beside(start), path
            )
            yield RoadWorks(name, start, given.length, cones, sign)

    def _works_problem(self, given: WorksSection, start: Waypoint) -> str:
        """Return why a lane cannot be closed so, or nothing."""
        lanes = self._roads.lanes(start.leg, start.way)
        if not isinstance(start.lane, int):
            return "road works close a driving lane, given by its number"
        if isinstance(lanes, str) or isinstance(self._roads.knobs["lane_width"], str):
            return "road works need a fixed number of lanes of a fixed width"
        against = self._roads.lanes(start.leg, "in" if start.way == "out" else "out")
        if lanes < 2 and (isinstance(against, str) or against < 1):
            return f"road works leave a lane to drive on; leg {start.leg} {start.way} has only one"
        if not 0.0 < given.taper <= given.length or not 1.0 <= given.spacing <= 50.0:
            return (
                "road works need 0 < taper <= length and 1 <= spacing <= 50 [m], got "
                f"taper={given.taper:g}, length={given.length:g}, spacing={given.spacing:g}"
            )
        if given.length / given.spacing > _MOST_CONES:
            return f"road works have {_MOST_CONES} cones at most, got {given.length} m of them"
        if given.sign_before <= 0.0:
            return f"sign_before [m] must be greater than 0, got {given.sign_before:g}"
        return ""

    def _offset(self, given: WorksSection, start: Waypoint, along: float) -> float:
        """Return a cone's offset from the closed lane's centre: across it, then along its side."""
        half = 0.5 * float(self._roads.knobs["lane_width"])
        share = min(along / given.taper, 1.0)
        lanes = float(self._roads.lanes(start.leg, start.way))
        # Traffic passes on the inner side, unless the inner lane is the closed one.
        side = -1.0 if start.lane == 1 and lanes > 1 else 1.0
        return side * half * (2.0 * share - 1.0)

    def _beside(self, start: Waypoint) -> float:
        """Return the offset from a lane that lies beside the road, on its right."""
        knobs = self._roads.knobs
        width, lanes = float(knobs["lane_width"]), float(self._roads.lanes(start.leg, start.way))
        outer = (lanes - int(start.lane) + 0.5) * width
        strips = sum(
            float(value)
            for value in (knobs["shoulder_width"], knobs["sidewalk_width"])
            if not isinstance(value, str)
        )
        return -(outer + strips + _BESIDE)

    def _moved(
        self, name: str, start: Waypoint, along: float, offset: float, path: Path
    ) -> Waypoint:
        """Return a place ``along`` metres of travel beyond another."""
        moved = self._row(name, start, along, 0, 0.0, path)
        return Waypoint(moved.leg, moved.way, moved.distance, start.lane, offset)

    def _row(
        self, name: str, start: Waypoint, along: float, gaps: int, gap: Quantity, path: Path
    ) -> Waypoint:
        """Return the place ``along`` metres and some gaps beyond another, in travel direction."""
        sign = 1.0 if start.way == "out" else -1.0
        distance: Quantity
        known = self._quantities.parameters.keys() | self._quantities.derived.keys()
        if any(isinstance(item, str) and item not in known for item in (start.distance, gap)):
            return start  # reported as unknown already
        if isinstance(start.distance, str) or (isinstance(gap, str) and gaps):
            between = f"{gaps}*{gap}" if isinstance(gap, str) else repr(gaps * gap)
            text = f"{start.distance} {'+' if sign > 0 else '-'} ({along!r} + {between})"
            if along == 0.0 and gaps == 0:
                return start
            self.derived.append(
                Derived(
                    name,
                    Axis.TEMPORARY,
                    "m",
                    parse(text),
                    "It stands in a row with the first.",
                    "BridgeGen",
                    f"Where {name[:-3]} stands.",
                    self._quantities.document.at(path),
                )
            )
            distance = name
        else:
            between_them = gaps * float(gap) if gaps else 0.0
            distance = start.distance + sign * (along + between_them)
        return Waypoint(start.leg, start.way, distance, start.lane, start.offset)
