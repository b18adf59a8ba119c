"""What an OpenSCENARIO DSL file and its imports declare, and what is wrong with their names.

The names of the standard's domain model (``import osc.standard.all``) and scenario_runner's are
known without a file; of types that a file declares, fields are known as well.
"""

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from bridgegen.base.errors import FileFormatError, ScenarioError
from bridgegen.base.units import in_unit
from bridgegen.scenario.language.dsl.parser import COMPOSITIONS, MAX_BYTES, Node, parse

MOST_FILES = 32

QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        "time": "s", "length": "m", "distance": "m", "velocity": "m/s", "speed": "m/s",
        "acceleration": "m/s²", "angle": "deg",
    }
)  # fmt: skip
"""The unit in which a physical type is simulated, by name."""

_UNITS = {
    ("s", "sec", "second", "seconds"): "s", ("ms", "millisecond"): "ms",
    ("min", "minute"): "min", ("h", "hour"): "h",
    ("m", "meter", "meters"): "m", ("mm", "millimeter"): "mm", ("cm", "centimeter"): "cm",
    ("km", "kilometer"): "km", ("feet", "ft", "foot"): "ft",
    ("mps", "meter_per_second", "m/s"): "m/s", ("mph", "mile_per_hour", "miph"): "mph",
    ("kph", "kmh", "kmph", "kilometer_per_hour"): "km/h",
    ("mpss", "mpsps", "meter_per_sec_sqr"): "m/s²",
    ("deg", "degree"): "deg", ("rad", "radian"): "rad",
}  # fmt: skip
UNITS: Mapping[str, str] = MappingProxyType(
    {name: unit for names, unit in _UNITS.items() for name in names}
)
"""The units of the standard, by name, as `bridgegen.base.units` calls them."""

ACTORS: Mapping[str, str] = MappingProxyType(
    {
        "vehicle": "car", "car": "car", "truck": "truck", "bus": "bus", "van": "van",
        "motorcycle": "motorcycle", "motorbike": "motorcycle", "bicycle": "bicycle",
        "emergency_vehicle": "emergency", "dut": "car", "ego": "car",
    }
)  # fmt: skip
"""The type of participant that an actor of the domain model is, by its type's name."""

_DOMAIN = frozenset(
    re.findall(
        r"\w+",
        """int uint float bool string mass temperature pressure jerk angular_rate illuminance
        angular_acceleration luminous_intensity position_3d pose_3d orientation_3d route_point
        odr_point xyz_point path_point path route trajectory map environment env weather color
        directionality vehicle_category bounding_box axle osc_actor physical_object
        stationary_object movable_object traffic_participant person animal pedestrian lane
        junction crossing road""",
    )
) | {*QUANTITIES, *ACTORS}
_COLOURS = {"white", "silver", "gray", "black", "red", "yellow", "green", "blue", "brown"}
_SI = ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset")


_ORDER = (
    "type",
    "unit",
    "enum",
    "struct",
    "actor",
    "action",
    "scenario",
    "modifier",
    "extend",
    "global",
)
"""The order in which kinds of declarations are taken in, wherever they stand."""


@dataclass
class Type:
    """What a name stands for.

    Attributes:
        node: its declaration.
        fields: the fields and variables, its own and those of its base, by name.
        events: likewise.
        members: all, with those of extensions.
    """

    node: Node
    fields: dict[str, Node] = field(default_factory=dict)
    events: dict[str, Node] = field(default_factory=dict)
    members: list[Node] = field(default_factory=list)


class Names:
    """What a file and its imports declare; its problems are all reported at once.

    Attributes:
        types: structs, actors, scenarios, actions and modifiers, by name.
        enums: the values of each, in order.
        quantities: the physical types that are declared.
        units: the physical type and factor to SI of each unit that is declared, by name.
        fields: global ones.
        problems: with file and line.

    Raises:
        FileFormatError: a file is missing, outside the folder, or not of the grammar.
    """

    def __init__(self, path: Path) -> None:
        self.types: dict[str, Type] = {}
        self.enums: dict[str, dict[str, int]] = {}
        self.quantities: dict[str, Node] = {}
        self.units: dict[str, tuple[str, float, Node]] = {}
        self.fields: dict[str, Node] = {}
        self.problems: list[str] = []
        self._files: set[Path] = set()
        self._standard = False
        self._nodes: list[Node] = []
        self._read(path, path.parent)
        self._nodes.sort(key=lambda node: _ORDER.index(node.kind))
        self._bases = {node.name: node for node in reversed(self._nodes) if node.more.get("base")}
        for node in self._nodes:
            self._declare(node)
        for found in self.types.values():
            self._check(found)
        for node in self.fields.values():
            self._check_types(node)

    # -- files -------------------------------------------------------------------------------------

    def _read(self, path: Path, folder: Path, place: str = "") -> None:
        if path.resolve() in self._files:
            return
        self._files.add(path.resolve())
        if len(self._files) > MOST_FILES:
            raise FileFormatError(f"a file may import {MOST_FILES - 1} files at most{place}")
        try:
            if not path.is_file():
                raise FileFormatError(f"no such file: {path}{place}")
            with path.open("rb") as file:
                data = file.read(MAX_BYTES + 1)
        except OSError as error:
            raise FileFormatError(f"cannot be read: {error.strerror} ({path}){place}") from None
        for node in parse(data, str(path)):
            if node.kind != "import":
                self._nodes.append(node)
            elif node.name.split(".")[0] == "osc":
                self._standard = True
            else:
                other = Path(node.name)
                if other.is_absolute() or ".." in other.parts:
                    raise FileFormatError(
                        f"a file to import lies beside the scenario, got '{node.name}' "
                        f"({node.place})"
                    )
                named = folder / other
                if not named.is_file() and other.suffix != ".osc":
                    named = folder / f"{node.name.replace('.', '/')}.osc"
                self._read(named, folder, f" ({node.place})")

    # -- declarations ------------------------------------------------------------------------------

    def _refuse(self, what: str, node: Node) -> None:
        self.problems.append(f"{what} ({node.place})")

    def _again(self, name: str, node: Node, earlier: Node | None) -> bool:
        if earlier is not None:
            self._refuse(f"'{name}' is declared already, in line {earlier.line}", node)
        return earlier is not None

    def _declare(self, node: Node) -> None:
        name = node.name
        if node.more.get("of") and node.kind == "modifier":
            name = f"{name} of {node.more['of']}"
        known = self.types.get(name)
        if node.kind in ("type", "unit"):
            self._physical(node)
        elif node.kind == "enum" or node.more.get("values"):
            self._enum(node)
        elif node.kind == "global":
            self._add(self.fields, node)
        elif node.kind == "extend":
            if known is None:
                self._refuse(f"'{name}' is extended and not declared", node)
            else:
                self._take(known, node.part("members"))
        elif not self._again(name, node, known.node if known else None):
            base, found = str(node.more["base"]), Type(node)
            if base in self._bases and base not in self.types:
                self._declare(self._bases.pop(base))
            actor, dot, short = node.name.rpartition(".")
            of = self.types.get(actor)
            if dot and (of.node.kind != "actor" if of else actor not in _DOMAIN):
                self._refuse(
                    f"a behaviour is of an actor, and no actor '{actor}' is declared", node
                )
            if node.kind in ("scenario", "action") and short in (actor, *self._of("actor")):
                self._refuse(f"a behaviour is not called as an actor, got '{short}'", node)
            if base:
                above = self.types.get(base)
                if above is not None and above.node.kind == node.kind:
                    found.fields |= above.fields
                    found.events |= above.events
                    found.members += above.members
                elif above is not None or base not in _DOMAIN:
                    self._refuse(f"no {node.kind} '{base}' is declared, which '{name}' is", node)
            self.types[name] = found
            inherited, found.fields = found.fields, {}
            self._take(found, node.part("members"))
            found.fields = inherited | found.fields

    def _of(self, kind: str) -> Iterator[str]:
        return (name for name, found in self.types.items() if found.node.kind == kind)

    def _take(self, found: Type, members: tuple[Node, ...]) -> None:
        for member in members:
            found.members.append(member)
            if member.kind in ("field", "var"):
                self._add(found.fields, member)
            elif member.kind == "event" and not self._again(
                member.name, member, found.events.get(member.name)
            ):
                found.events[member.name] = member

    def _add(self, fields: dict[str, Node], node: Node) -> None:
        for name in node.more["names"]:
            if not self._again(name, node, fields.get(name)):
                fields[name] = node

    def _physical(self, node: Node) -> None:
        name, parts = node.name, {part.name: part for part in node.part("parts")}
        for number, part in enumerate(node.part("parts")):
            if part.name not in _SI:
                self._refuse(f"SI has no base unit '{part.name}'", part)
            elif part is not parts[part.name] and number < len(parts):
                self._refuse(f"'{part.name}' is declared already, in this list", part)
        of = str(node.more["of"])
        earlier = self.quantities.get(name) if node.kind == "type" else None
        if node.kind == "unit" and name in self.units:
            earlier = self.units[name][2]
        if earlier is not None and earlier.file != node.file:
            return  # what an import says, said again
        if self._again(name, node, earlier):
            return
        if node.kind == "type":
            self.quantities[name] = node
        elif of not in self.quantities and not (self._standard and of in _DOMAIN):
            self._refuse(f"no physical type '{of}' is declared, of which '{name}' is a unit", node)
        else:
            factor = self.number(parts["factor"].items[0]) if "factor" in parts else 1.0
            if factor is None or factor <= 0.0 or not math.isfinite(factor):
                self._refuse(
                    f"the factor of a unit is a number above 0, '{name}' has another", node
                )
            self.units[name] = of, factor or 1.0, node

    def _enum(self, node: Node) -> None:
        name, members = node.name, node.part("members")
        known = self.enums.get(name)
        if node.kind == "extend" and known is None:
            self._refuse(f"'{name}' is extended and not declared", node)
        elif node.kind == "enum" and (known is not None or name in self.types):
            self._refuse(f"'{name}' is declared already", node)
            return
        values = self.enums.setdefault(name, {})
        last = next(reversed(values.values()), -1)
        for number, member in enumerate(members):
            value = member.more["value"]
            if member.name in values:
                self._refuse(f"'{member.name}' is a value of {name} already", member)
            elif number and value not in (None, last + 1):
                what = f"'{member.name}' must be {last + 1}, got {value}"
                self._refuse(f"values of an enum succeed each other: {what}", member)
            last = last + 1 if value is None else value
            values[member.name] = last

    # -- what refers to names ----------------------------------------------------------------------

    def _check_types(self, node: Node) -> None:
        of = str(node.more["of"]).removeprefix("list of ")
        if not (of in self.types or of in self.enums or of in self.quantities or of in _DOMAIN):
            self._refuse(f"no type '{of}' is declared", node)

    def _check(self, found: Type) -> None:
        labels: dict[str, Node] = {}
        own = found.node.file
        for member in (*found.members, *found.node.part("condition")):
            for node in member.every():
                if node.kind in ("field", "var") or (node.kind == "argument" and "of" in node.more):
                    self._check_types(node)
                elif node.kind == "enum_value":
                    self._check_value(node)
                elif node.kind == "number" and node.name and self.unit(node.name) is None:
                    self._refuse(f"no unit '{node.name}' is declared", node)
                elif node.kind in (*COMPOSITIONS, "drive", "wait") and node.name:
                    self._again(node.name, node, labels.get(node.name))
                    labels.setdefault(node.name, node)
            if member.kind == "keep" and own == member.file:
                self._check_keep(member, found, None)
            of = self.types.get(str(member.more.get("of")))
            for inner in member.part("members") if member.kind == "field" else ():
                if inner.kind == "keep":
                    self._check_keep(inner, found, of)

    def _check_value(self, node: Node) -> None:
        values = self.enums.get(str(node.more["of"]))
        if values is None and not self._standard:
            self._refuse(f"no enum '{node.more['of']}' is declared", node)
        elif values is not None and node.name not in values:
            self._refuse(f"the enum {node.more['of']} has no value '{node.name}'", node)

    def _check_keep(self, keep: Node, found: Type, it: Type | None) -> None:
        """Check the names that a constraint reads: its fields, and those of their types."""
        known = {value for each in self.enums.values() for value in each} | _COLOURS
        known |= {"it", *self.types, *_DOMAIN, *(it.fields if it else ())}
        inner = {id(node.items[0]) for node in keep.every() if node.kind == "member_of"}
        for node in keep.every():
            root = node.items[0] if node.kind == "member_of" else node
            if root.kind != "name" or id(node) in inner:
                continue
            declared = found.fields.get(root.name) or self.fields.get(root.name)
            of = self.types.get(str(declared.more["of"])) if declared else None
            of = it if root.name == "it" else of
            if declared is None and root.name not in known:
                self._refuse(f"no field '{root.name}' is declared", node)
            elif root is not node and of and node.name not in (*of.fields, "as", "is"):
                self._refuse(f"'{node.name}' is no field of {of.node.name}", node)
            elif declared and declared.kind == "var" and declared.more["value"] is None:
                what = "has no value that a keep() could limit"
                self._refuse(f"the variable '{root.name}' {what}", node)

    # -- values ------------------------------------------------------------------------------------

    def unit(self, name: str) -> tuple[str, float] | None:
        """Return the unit that a unit is simulated in, and its factor; None if there is none."""
        of, factor, _ = self.units.get(name, ("", 1.0, None))
        if name in self.units and QUANTITIES.get(of) != "deg":  # files turn that factor round
            unit = QUANTITIES.get(of, of)
            exact = self._standard_unit(name)
            near = exact is not None and exact[0] == unit and abs(factor / exact[1] - 1.0) < 1e-6
            return exact if near else (unit, factor)
        return self._standard_unit(name)

    @staticmethod
    def _standard_unit(name: str) -> tuple[str, float] | None:
        for unit in dict.fromkeys(QUANTITIES.values()):
            with suppress(ValueError):
                return unit, in_unit(f"1 {UNITS.get(name, '?')}", unit)
        return None

    def number(self, node: Node) -> float | None:
        """Return the number that a plain node states; None if it states none."""
        if node.kind == "operation" and node.name == "minus":
            value = self.number(node.items[0])
            return None if value is None else -value
        return float(node.more["value"]) if node.kind == "number" and not node.name else None

    def stop(self) -> None:
        """Refuse a file with problems.

        Raises:
            ScenarioError: all of them.
        """
        if self.problems:
            raise ScenarioError(*dict.fromkeys(self.problems))
