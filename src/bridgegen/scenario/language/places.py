"""Numbers and places of a scenario file: checked, with the parameters that they name."""

import math
from collections.abc import Mapping, Set
from itertools import pairwise

from bridgegen.scenario.language.parameters import Axis, Derived, Parameter, nearest
from bridgegen.scenario.language.plain_yaml import Document, Path
from bridgegen.scenario.language.roads import LETTERS, Quantity, RoadsSpec
from bridgegen.scenario.language.story import Waypoint
from bridgegen.scenario.language.story_schema import WaypointSection

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
        one = self.parameters.get(value) or self.derived.get(value)
        if one is None:
            if value not in self.declared:
                hint = nearest(value, [*self.parameters, *self.derived])
                self.report(f"{label} names the unknown parameter '{value}'{hint}", path)
            return
        if isinstance(one, Parameter) and one.kind.names:
            self.report(
                f"{label} needs a number, '{value}' is a category: derive a number from it", path
            )
        elif one.unit != unit:
            self.report(f"{label} needs a parameter in {unit}, '{value}' is in {one.unit}", path)
        elif isinstance(one, Parameter) and (one.low < low or (above and one.low == low)):
            self.report(f"{rule}, '{value}' goes down to {one.low:g}", path)
        if one.axis is Axis.STATIC:
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

    def _range(self, value: Quantity) -> tuple[float, float]:
        """Return the least and the greatest value that a constant or a parameter has."""
        if not isinstance(value, str):
            return value, value
        one = self._quantities.parameters.get(value)
        return (one.low, one.high) if one else (-math.inf, math.inf)

    def check_crossing(self, name: str, points: tuple[Waypoint, ...], path: Path) -> None:
        """Report where a pedestrian leaves the sidewalks and crosswalks (paper, Section III-B)."""
        roads = self._roads
        half = roads.knobs["crosswalk_width"]
        reach = 0.5 * (half if isinstance(half, float) else 0.0)
        for one, other in pairwise(points):
            if one.lane == other.lane == "sidewalk" and (one.leg, one.way) == (
                other.leg, other.way
            ):  # fmt: skip
                continue
            at = roads.crosswalk(one.leg)
            rule = "pedestrians cross on crosswalks only"
            if at is None or one.leg != other.leg:
                self._report(f"{rule}: there is none where {name} crosses leg {one.leg}", path)
                return
            for point in (one, other):
                low, high = self._range(point.distance)
                if low < at - reach - 1e-9 or high > at + reach + 1e-9:
                    got = f"{low:g}" if low == high else f"{low:g} to {high:g}"
                    self._report(
                        f"{rule}: distance of {name} must be {at - reach:g} to {at + reach:g} m "
                        f"on leg {point.leg}, got {got}",
                        path,
                    )
