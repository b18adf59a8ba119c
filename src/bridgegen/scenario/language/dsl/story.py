"""From the drive()s of an OpenSCENARIO DSL scenario to the data of a YAML scenario file.

A scenario is gone through once, in the order of its phases: each actor has a speed, a lane and a
place at every time, each of them a formula of the file's ranges. Where the file says what holds at
a phase's end, the speed that leads there follows.

Distances are between reference points; a speed that a phase asks for is reached by `RATE`.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import ScenarioError, UnsupportedError
from bridgegen.scenario.language.dsl.names import ACTORS, QUANTITIES, Names, Type
from bridgegen.scenario.language.dsl.parser import COMPOSITIONS, Node
from bridgegen.scenario.language.plain_yaml import Document
from bridgegen.scenario.participants import PARTICIPANTS

RATE = 3.0
"""Acceleration to a speed that holds throughout a phase [m/s²]; comfortable; ours."""

NEVER = 1e5
"""Time of what does not happen in a row [s]."""

FREE = (8.0, 14.0)
"""Speeds where a file leaves them open [m/s]: 29 to 50 km/h; ours."""

OPEN_PHASE = 10.0
"""Duration of a phase that states none [s]; ours."""

SAMPLE = 512
"""Rows on which amounts are tried: what a road must hold, and which speeds there are."""

_EGOS = ("ego", "ego_vehicle", "sut", "dut")
_LIMITS = {"<": "hi", "<=": "hi", ">": "lo", ">=": "lo"}
_FLIPPED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}
_CONDITIONS = {
    "time_to_collision": "ttc", "time_headway": "headway", "object_distance": "distance",
    "space_gap": "gap",
}  # fmt: skip


class Amount(NamedTuple):
    """A number, or a formula of parameters, with its values in a sample of rows.

    Attributes:
        text: the formula.
        values: ``(SAMPLE,)`` float64; the first is that at the defaults.
    """

    text: str
    values: Float

    low = property(lambda self: float(self.values.min()))
    high = property(lambda self: float(self.values.max()))
    usual = property(lambda self: float(self.values[0]))
    fixed = property(lambda self: bool((self.values == self.values[0]).all()))

    @property
    def value(self) -> float | str:
        """The number; the name of a parameter or derived quantity, or its formula."""
        return round(self.usual, 9) if self.fixed else self.text


def number(value: float) -> Amount:
    """Return a number."""
    return Amount(repr(round(value, 9)), np.full(SAMPLE, value))


def combined(sign: str, a: Amount, b: Amount) -> Amount:
    """Return the sum, difference, product or quotient of two amounts; not finite where none is."""
    work = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}[sign]
    with np.errstate(all="ignore"):
        values = work(a.values, b.values)
    if a.fixed and b.fixed:
        return Amount(repr(round(float(values[0]), 9)), values)
    if b.fixed and b.usual == (0.0 if sign in "+-" else 1.0):
        return a
    return Amount(f"({a.text} {sign} {b.text})", values)


ZERO = number(0.0)


class Stretch(NamedTuple):
    """How an actor moves from a time on, until the next stretch."""

    start: Amount
    at: Amount
    before: Amount
    speed: Amount
    within: Amount | None


@dataclass
class Actor:
    """A participant, as far as the scenario has been gone through."""

    name: str
    type: str
    node: Node
    lane: int | None = None
    first_lane: int | None = None
    offset: Amount = ZERO
    at: Amount | None = None
    first_speed: Amount | None = None
    speed: Amount = ZERO
    way: list[Stretch] = field(default_factory=list)


class Scope(NamedTuple):
    """What names mean in a scenario: its declaration, and the arguments that it is given."""

    of: Type
    given: Mapping[str, Amount]


def read_dsl(path: Path) -> Document:
    """Return an ``.osc`` file as the document of a scenario file, with its lines.

    Raises:
        FileFormatError: it, or a file that it imports, is missing or not of the grammar.
        ScenarioError: names that are declared twice, or not at all.
        UnsupportedError: what logical scenarios have no words for, with the line.
    """
    names = Names(path)
    names.stop()
    return _Story(names, path).document()


class _Story:
    def __init__(self, names: Names, path: Path) -> None:
        self._names, self._path = names, path
        self._actors: dict[str, Actor] = {}
        self._parameters: dict[str, dict[str, Any]] = {}
        self._derived: dict[str, dict[str, Any]] = {}
        self._bounds: list[dict[str, Any]] = []
        self._events: dict[str, dict[str, Any]] = {}
        self._lines: dict[tuple[str | int, ...], int] = {}
        self._notes: list[str] = []
        self._values: dict[tuple[str, str], Amount] = {}
        self._lanes, self._junction, self._depth = 1, 0.0, 0
        self._guards: list[str] = []
        self._rows: dict[str, Any] = {}
        self._since: tuple[list[dict[str, Any]], Amount, str] | None = None
        self._highest = 0.0
        self._random = np.random.default_rng(0)  # which rows are tried; no scenario depends on it

    # -- the document ------------------------------------------------------------------------------

    def document(self) -> Document:
        """Return what the file says; see `read_dsl`."""
        name, top = self._top()
        for other in self._names.types.values():
            if other.node.kind == "scenario":
                self._roads(other)
        end = self._scenario(top, {}, ZERO, None)
        if not self._actors:
            self._refuse("a scenario needs a drive() of an actor", top.node)
        duration = math.ceil(round(end.high / 0.05, 6)) * 0.05
        if not 0.0 < duration <= 1000.0:
            self._refuse(f"a scenario takes more than 0 s and 1,000 s at most, got {end.high:g} s", top.node)
        ego = self._ego()
        everybody = [ego, *(actor for actor in self._actors.values() if actor is not ego)]
        places = {actor.name: self._at(actor, ZERO) for actor in everybody}
        back = min(at.low for at in places.values())
        begin = number(60.0 - min(0.0, back))
        ends = [self._at(actor, number(duration)).high for actor in everybody]
        length = math.ceil((begin.high + max(*ends, max(at.high for at in places.values())) + 100.0) / 50.0) * 50.0
        if length > 10_000.0:
            self._refuse(f"a road has 10,000 m at most, the actors drive {length:g} m", top.node)
        lanes = max(self._lanes, *(actor.first_lane or 1 for actor in everybody))
        data: dict[str, Any] = {
            "scenario": re.sub(r"[^A-Za-z0-9_-]", "_", f"s{self._path.stem}"[not self._path.stem[:1].isdigit() :])[:64],
            "title": f"{name} of {self._path.name}",
            "description": f"Read from an OpenSCENARIO DSL file: the scenario {name}.",
            "source": f"{self._path.name}, line {top.node.line}.",
            "template": "road",
        }
        limit = max(36.1, math.ceil(self._highest))
        if self._junction:
            data["template"] = "crossroads"
            data["roads"] = {"lanes_per_direction": lanes, "arm_length": length, "speed_limit": min(limit, 40.0)}
        else:
            data["roads"] = {
                "lanes": lanes, "length": length, "shoulder_width": 2.5,
                "speed_limit": min(limit, 60.0), "road_type": "motorway",
            }  # fmt: skip
        data |= {"duration": round(duration, 9), "time_step": 0.05, "axes": ["participants"]}
        data["include"] = ["town" if self._junction else "motorway", "weather"]
        data["driver"] = "storyboard"
        data["participants"] = {
            "ego" if actor is ego else actor.name: self._participant(actor, begin, places[actor.name], length, actor is ego)
            for actor in everybody
        }
        data["events"] = self._events
        for event in self._events.values():
            event["participant"] = "ego" if event["participant"] == ego.name else event["participant"]
            for each in event["when"]:
                each |= {key: "ego" for key in ("to", "of") if each.get(key) == ego.name}
        self._prune(data)
        data |= {"parameters": self._parameters, "bounds": self._bounds, "derived": self._derived}
        if not self._parameters:
            data["axes"] = ["weather"]
            self._notes.append("the file has no ranges: a search varies the weather")
        if any(event["participant"] == "ego" for event in self._events.values()):
            self._notes.append(
                f"{ego.name} is the ego: it moves as the file says unless --ego names a driver, which "
                "gets its first speed and lane alone"
            )
        self._lines[("participants",)] = self._lines[("events",)] = top.node.line
        return Document(data, self._lines, str(self._path), notes=tuple(dict.fromkeys(self._notes)))

    def _participant(self, actor: Actor, begin: Amount, place: Amount, length: float, is_ego: bool) -> dict[str, Any]:
        key = "ego" if is_ego else actor.name
        self._lines[("participants", key)] = actor.node.line
        lane = actor.first_lane or self._lanes
        at = combined("+", begin, place)
        if self._junction:
            start = {"leg": "A", "way": "in", "lane": lane, "distance": self._named(combined("-", number(self._junction + begin.usual), at), f"{key}_start", "m", actor.node)}
            end = {"leg": "C", "way": "out", "lane": lane, "distance": length - 10.0}
        else:
            start = {"lane": lane, "distance": self._named(at, f"{key}_start", "m", actor.node)}
            end = {"lane": lane, "distance": length - 20.0}
        if actor.offset.value != 0.0:
            start["offset"] = self._named(actor.offset, f"{key}_offset", "m", actor.node)
        speed = self._named(actor.first_speed or ZERO, f"{key}_start_speed", "m/s", actor.node)
        found = {"type": actor.type, "start": start, "speed": speed, "exceeds_limit": "The file states its speed."}
        moved = any(event["participant"] == actor.name and "lane_change" in event for event in self._events.values())
        if is_ego or (self._junction and not moved):
            found["end"] = end
        most = PARTICIPANTS[actor.type].body.max_speed
        if self._highest > most:
            found["body"] = {"max_speed": float(math.ceil(self._highest))}
        return found

    def _prune(self, data: Mapping[str, Any]) -> None:
        """Leave out what nothing reads."""
        while True:
            held: list[Any] = [data, self._bounds, [item["value"] for item in self._derived.values()]]
            words = set(re.findall(r"\w+", repr(held)))
            idle = [(table, name) for table in (self._parameters, self._derived) for name in table if name not in words]
            for table, name in idle:
                del table[name]
            if not idle:
                return

    def _top(self) -> tuple[str, Type]:
        """Return the scenario to run: ``top``, or the last that no other one calls."""
        kinds = ("scenario", "action")
        able = {
            name: found for name, found in self._names.types.items()
            if found.node.kind in kinds and any(member.kind == "do" for member in found.members)
        }  # fmt: skip
        called = {self._dotted(node.items[0]) for found in able.values() for member in found.members for node in member.every() if node.kind == "drive" for node in (node.items[0],)}
        free = [name for name in able if name not in called] or list(able)
        if not free:
            raise UnsupportedError(f"{self._path}: it declares no scenario with a do, so there is nothing to run")
        name = "top" if "top" in free else free[-1]
        if len(free) > 1:
            self._notes.append(f"of {', '.join(free)}, {name} is run")
        return name, able[name]

    def _ego(self) -> Actor:
        for name in _EGOS:
            if name in self._actors:
                return self._actors[name]
        for actor in self._actors.values():
            if actor.node.more.get("of") in ("dut", "ego"):
                return actor
        found = next(iter(self._actors.values()))
        self._notes.append(f"no actor is called ego: {found.name} is the ego")
        return found

    def _refuse(self, what: str, node: Node) -> NoReturn:
        raise UnsupportedError(f"{what} ({node.place})")

    # -- amounts -----------------------------------------------------------------------------------

    def _new(self, name: str, taken: Mapping[str, Any]) -> str:
        name = re.sub(r"\W", "_", name)[:56]
        return next(each for each in (name, *(f"{name}_{n}" for n in range(2, 10_000))) if each not in taken)

    def _parameter(self, name: str, unit: str, low: float, high: float, node: Node, **more: Any) -> Amount:
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise ScenarioError(f"a range goes from a number up to another, got [{low:g}..{high:g}] ({node.place})")
        usual = more.pop("usual", 0.5 * (low + high))
        if low == high:
            return number(low)
        name = self._new(name, self._parameters)
        said = f"Range of the file: {name.replace('_', ' ')}."
        source = f"{node.place}."
        self._parameters[name] = {"axis": "participants", "unit": unit, "low": low, "high": high, "default": usual, "description": said, "source": source, **more}
        self._lines[("parameters", name)] = node.line
        shares = self._random.choice([0.0, 1.0, 0.25, 0.5, 0.75], SAMPLE, p=[0.3, 0.3, 0.1, 0.2, 0.1])
        values = low + shares * (high - low)
        values[0] = usual
        return Amount(name, values)

    def _named(self, amount: Amount, name: str, unit: str, node: Node) -> float | str:
        """Return an amount as a scenario file holds it; a formula becomes a derived quantity."""
        if not np.isfinite(amount.values).all():
            self._refuse(f"{name.replace('_', ' ')} has no finite value", node)
        value = amount.value
        if isinstance(value, float) or value in self._parameters or value in self._derived:
            return value
        name = self._new(name, {**self._derived, **self._parameters})
        self._derived[name] = {
            "axis": "participants", "unit": unit, "value": value, "why": "What the file says of phases.",
            "source": f"{node.place}.", "description": f"{name.replace('_', ' ')}.",
        }  # fmt: skip
        self._lines[("derived", name)] = node.line
        return name

    def _short(self, amount: Amount, name: str, unit: str, node: Node) -> Amount:
        """Return an amount whose formula is short, so that what is made of it stays readable."""
        named = self._named(amount, name, unit, node)
        return amount._replace(text=named) if isinstance(named, str) else amount

    def _amount(self, node: Node, scope: Scope, unit: str, name: str) -> Amount:
        """Return the value of an expression in a unit.

        Args:
            node: the expression.
            scope: where it stands.
            unit: SI, or "" for a count.
            name: of the parameter that a range becomes.
        """
        if node.kind == "number":
            value = float(node.more["value"])
            found = self._names.unit(node.name) if node.name else ("", 1.0)
            if found is None or found[0] != unit:
                what = f"a value in {unit}" if unit else "a number without a unit"
                raise ScenarioError(f"{name.replace('_', ' ')} needs {what}, got {value:g} {node.name} ({node.place})")
            return number(value * found[1])
        if node.kind == "range":
            low, high = (self._amount(item, scope, unit, name) for item in node.items)
            if not (low.fixed and high.fixed):
                self._refuse("the ends of a range are numbers", node)
            more = {} if unit else {"kind": "integer", "usual": math.floor(0.5 * (low.low + high.low))}
            return self._parameter(name, unit or "1", low.low, high.high, node, **more)
        if node.kind == "operation" and node.name == "minus":
            return combined("-", ZERO, self._amount(node.items[0], scope, unit, name))
        if node.kind == "operation" and node.name in "+-*/":
            left, right = node.items
            units = [unit, unit]
            if node.name in "*/":
                plain = left.kind == "number" and not left.name and node.name == "*"
                units = ["", unit] if plain else [unit, ""]
            sides = (self._amount(item, scope, each, name) for item, each in zip(node.items, units, strict=True))
            return combined(node.name, *sides)
        if node.kind == "name":
            return self._value(node, scope, unit)
        self._refuse(f"no value of a {node.kind.replace('_', ' ')} can be given here", node)

    def _value(self, node: Node, scope: Scope, unit: str) -> Amount:
        """Return the value of a field: given, declared, or limited by keep()."""
        name, key = node.name, (scope.of.node.name, node.name)
        if name in scope.given:
            return scope.given[name]
        declared = scope.of.fields.get(name) or self._names.fields.get(name)
        if declared is None:
            raise ScenarioError(f"no field '{name}' is declared ({node.place})")
        of = QUANTITIES.get(str(declared.more["of"]), "" if declared.more["of"] in ("int", "uint", "float") else None)
        if of != unit:
            raise ScenarioError(f"{name} is of type {declared.more['of']}, {f'a value in {unit}' if unit else 'a number'} is needed ({node.place})")
        if key not in self._values:
            self._values[key] = ZERO  # a field that its own value names
            self._values[key] = self._of_field(name, declared, scope, unit)
        return self._values[key]

    def _of_field(self, name: str, declared: Node, scope: Scope, unit: str) -> Amount:
        limits: dict[str, Amount] = {}
        value, usual = declared.more["value"], None
        for sign, other, strength in self._kept(name, declared, scope):
            if sign == "==" and strength == "default":
                usual = other
            elif sign == "==":
                value = other
            elif sign == "in" and other.kind == "range":
                value = other
            elif sign in _LIMITS:
                limits[_LIMITS[sign]] = self._amount(other, scope, unit, name)
            else:
                self._refuse(f"keep() limits a field by ==, <, <=, >, >= or a range, got '{sign}'", other)
        ends = [side.low for side in limits.values() if side.fixed]
        if value is None and len(limits) == 2 and len(ends) == 2:
            return self._limited(name, unit, limits["lo"].low, limits["hi"].high, usual, declared, scope)
        if value is None and usual is not None and not limits:
            value = usual
        if value is None:
            self._refuse(f"'{name}' has no value, and no keep() that limits it from both sides", declared)
        if value.kind == "range" and usual is not None:
            low, high = (self._amount(item, scope, unit, name).usual for item in value.items)
            found = self._limited(name, unit, low, high, usual, declared, scope)
        else:
            found = self._amount(value, scope, unit, name)
        if limits and found.text not in self._parameters:
            self._refuse(f"keep() limits '{name}', which has no range", declared)
        for side, limit in limits.items():
            self._bounds.append({"target": found.text, side: limit.text, "why": "A keep() of the file.", "source": f"{declared.place}."})
        return found

    def _limited(self, name: str, unit: str, low: float, high: float, usual: Node | None, node: Node, scope: Scope) -> Amount:
        more = {} if usual is None else {"usual": self._amount(usual, scope, unit, name).usual}
        return self._parameter(name, unit or "1", low, high, node, **more)

    def _kept(self, name: str, declared: Node, scope: Scope) -> Iterator[tuple[str, Node, str]]:
        """Yield the constraints on a field: a sign, the other side, and how strong it is."""

        def is_it(node: Node, inner: bool) -> bool:
            return node.kind == "name" and node.name in ((name, "it") if inner else (name,))

        keeps = [(member, False) for member in scope.of.members]
        keeps += [(member, True) for member in declared.part("members")]
        for member, inner in keeps:
            if member.kind != "keep":
                continue
            waiting = [member.items[0]]
            while waiting:
                each = waiting.pop()
                if each.kind == "operation" and each.name == "and":
                    waiting += each.items
                elif each.kind == "operation" and len(each.items) == 2 and is_it(each.items[0], inner):
                    yield each.name, each.items[1], member.name
                elif each.kind == "operation" and len(each.items) == 2 and each.name in _FLIPPED and is_it(each.items[1], inner):
                    if each.items[0].kind == "number":  # else a limit of the other side's field
                        yield _FLIPPED[each.name], each.items[0], member.name

    # -- compositions ------------------------------------------------------------------------------

    @staticmethod
    def _dotted(node: Node) -> str:
        parts: list[str] = []
        while node.kind == "member_of":
            parts.append(node.name)
            node = node.items[0]
        return ".".join([node.name, *reversed(parts)])

    def _scenario(self, of: Type, given: Mapping[str, Amount], start: Amount, length: Amount | None) -> Amount:
        self._depth += 1
        if self._depth > 16:
            self._refuse("scenarios call each other 16 deep at most", of.node)
        scope, end = Scope(of, given), start
        for member in of.members:
            if member.kind == "do":
                end = self._do(member.items[0], scope, end, length, "")
            elif member.kind == "on":
                self._refuse("'on' is not supported: a phase ends by a duration or until", member)
            for node in member.every():
                if node.kind == "call" and node.items[0].name in ("cover", "record"):
                    self._cover(node, scope)
        self._depth -= 1
        return end

    def _cover(self, node: Node, scope: Scope) -> None:
        """Take in a cover(): every parameter is covered."""
        arguments = {each.name: each.items[0] for each in node.part("arguments")}
        of = arguments.get("expression", arguments.get(""))
        name = of.name if of is not None and of.kind == "name" else ""
        unit = QUANTITIES.get(str(scope.of.fields[name].more["of"])) if name in scope.of.fields else None
        amount = self._value(of, scope, unit) if of is not None and unit is not None else None
        if amount is None or amount.text not in self._parameters:
            self._notes.append(f"{node.items[0].name}() in line {node.line} is of no parameter: left out")
        else:
            self._notes.append(f"the coverage of {amount.text} is in the report, as of each parameter")

    def _do(self, node: Node, scope: Scope, start: Amount, length: Amount | None, label: str) -> Amount:
        """Go through a member of a do; return when it ends."""
        label = node.name or label
        if node.kind in COMPOSITIONS:
            given = {each.name: each.items[0] for each in node.part("arguments")}
            for name in given.keys() - {"duration"}:
                self._refuse(f"{node.kind}() has no '{name or 'value'}' here, a duration alone", node)
            if node.part("given"):
                self._refuse(f"'with' of a {node.kind} is not supported; of a drive() it is", node)
            if "duration" in given:
                length = self._amount(given["duration"], scope, "s", f"{label or node.kind}_duration")
            return self._composed(node, scope, start, length, label)
        if node.kind == "wait":
            return self._ended(node.items[0], scope, start, None, None, f"{label or 'wait'}_duration")
        if node.kind in ("emit", "call"):
            return start  # nothing listens to it
        call, name = node.items[0], self._dotted(node.items[0].items[0])
        of = self._names.types.get(name)
        if of is not None and of.node.kind in ("scenario", "action") and any(member.kind == "do" for member in of.members):
            given_amounts = {}
            for each in call.part("arguments"):
                field_node = of.fields.get(each.name)
                unit = QUANTITIES.get(str(field_node.more["of"])) if field_node else None
                if unit is None:
                    self._refuse(f"{name}() has no physical field '{each.name}'", each)
                given_amounts[each.name] = self._amount(each.items[0], scope, unit, each.name)
            for key in [key for key in self._values if key[0] == name]:
                del self._values[key]
            return self._scenario(of, given_amounts, start, length)
        if name.split(".")[-1] != "drive":
            self._refuse(f"'{name}()' is no action that logical scenarios have: drive() is", node)
        return self._drive(node, scope, start, length, label)

    def _composed(self, node: Node, scope: Scope, start: Amount, length: Amount | None, label: str) -> Amount:
        members = node.part("members")
        if node.kind == "serial":
            end, shared = start, length if len(members) == 1 else None
            for member in members:
                end = self._do(member, scope, end, shared, label)
            return end if length is None else combined("+", start, length)
        if node.kind == "one_of":
            return self._one_of(node, scope, start, length, label)
        # Those whose place another one of them decides come after it.
        driven = {self._driver_name(each) for member in members for each in member.every() if each.kind == "drive"}

        def awaits(member: Node) -> int:
            own = {self._driver_name(each) for each in member.every() if each.kind == "drive"}
            named = {each.name for each in member.every() if each.kind == "name"}
            return len(named & (driven - own))

        ends = [self._do(member, scope, start, length, label) for member in sorted(members, key=awaits)]
        return max(ends, key=lambda end: end.high) if length is None else combined("+", start, length)

    def _driver_name(self, node: Node) -> str:
        return self._dotted(node.items[0].items[0]).rpartition(".")[0]

    def _one_of(self, node: Node, scope: Scope, start: Amount, length: Amount | None, label: str) -> Amount:
        """Go through the alternatives, of which a category chooses one in each row."""
        members = node.part("members")
        if len(members) == 1:
            return self._do(members[0], scope, start, length, label)
        options = [member.name or f"option_{number_}" for number_, member in enumerate(members, 1)]
        choice = self._new(f"{label or 'one'}_of", self._parameters)
        self._parameters[choice] = {
            "axis": "participants", "kind": "category", "values": options, "default": options[0],
            "description": "Alternative of the one_of that happens.", "source": f"{node.place}.",
        }  # fmt: skip
        self._lines[("parameters", choice)] = node.line
        chosen = self._random.integers(0, len(options), SAMPLE)
        chosen[0] = 0
        self._rows |= {f"{choice} == {option}": chosen == k for k, option in enumerate(options)}
        before, ends, after = deepcopy(self._actors), [], []
        for option, member in zip(options, members, strict=True):
            self._actors = deepcopy(before)
            for actor in self._actors.values():  # what an alternative asks of the start holds for all
                for earlier in after:
                    if actor.name in earlier:
                        actor.first_lane = actor.first_lane or earlier[actor.name].first_lane
            self._guards.append(f"{choice} == {option}")
            ends.append(self._do(member, scope, start, length, f"{label}_{option}".strip("_")))
            self._guards.pop()
            after.append(self._actors)
        end = self._short(self._chosen(choice, options, ends), f"{choice}_ends", "s", node)
        self._actors = {}
        for name in dict.fromkeys(name for each in after for name in each):
            found = [each.get(name) for each in after]
            able = [each for each in found if each is not None]
            merged = deepcopy(able[0])
            firsts = [each.first_lane for each in able if each.first_lane is not None]
            merged.first_lane = firsts[-1] if firsts else None
            shift = {(each.lane or each.first_lane or 0) - (each.first_lane or 0) for each in able}
            if len(shift) > 1:
                self._refuse("the alternatives of a one_of end in one lane", node)
            merged.lane = None if merged.first_lane is None else merged.first_lane + shift.pop()
            at0 = next((each.at for each in able if each.at is not None), None)
            merged.at, speeds = at0, [each.speed if each else able[0].speed for each in found]
            unset = next((each.first_speed for each in able if each.first_speed is not None), None)
            merged.first_speed = self._short(
                self._chosen(choice, options, [(each.first_speed if each else None) or unset or ZERO for each in found]),
                f"{name}_first_speed", "m/s", node,
            )  # fmt: skip
            merged.speed = self._short(self._chosen(choice, options, speeds), f"{name}_{choice}_speed", "m/s", node)
            places = [self._at(each or able[0], ends[k]) for k, each in enumerate(found)]
            place = self._short(self._chosen(choice, options, places), f"{name}_{choice}_at", "m", node)
            opening = Stretch(ZERO, merged.at or ZERO, merged.first_speed, merged.first_speed, None)
            merged.way = [opening, Stretch(end, place, merged.speed, merged.speed, None)]
            self._actors[name] = merged
        return end

    def _chosen(self, choice: str, options: Sequence[str], amounts: Sequence[Amount]) -> Amount:
        """Return the amount of the alternative that a category chooses."""
        found = amounts[-1]
        if len({amount.text for amount in amounts}) == 1:
            return found
        for option, amount in zip(options[-2::-1], amounts[-2::-1], strict=True):
            guard = f"{choice} == {option}"
            values = np.where(self._rows[guard], amount.values, found.values)
            found = Amount(f"({amount.text} if {guard} else {found.text})", values)
        return found

    def _ended(self, happens: Node, scope: Scope, start: Amount, length: Amount | None, actor: Actor | None, name: str) -> Amount:
        """Return when a wait or an until ends."""
        if happens.kind == "call" and happens.items[0].name == "elapsed":
            return combined("+", start, self._amount(happens.part("arguments")[0].items[0], scope, "s", name))
        while happens.kind == "call" and happens.items[0].name in ("rise", "fall"):
            happens = happens.part("arguments")[0].items[0]
        if happens.kind != "operation" or happens.name not in _LIMITS or self._guards or self._since:
            self._refuse("wait and until end by elapsed(TIME), or once by a comparison of speed, object_distance, space_gap, time_headway or time_to_collision", happens)
        left, right = happens.items
        of = self._dotted(left.items[0] if left.kind == "call" else left).split(".")
        who = actor.name if len(of) == 1 and actor else self._actor(of[0], scope, happens).name
        found: dict[str, Any] = {"of": who}
        if of[-1] == "speed" and _LIMITS[happens.name] == "lo":
            found |= {"kind": "speed", "value": self._amount(right, scope, "m/s", "until_speed").value}
        elif of[-1] in _CONDITIONS and _LIMITS[happens.name] == "hi":
            to = {each.name: each.items[0].name for each in left.part("arguments")}
            other = self._actor(to.get("reference", to.get("", "")), scope, happens)
            kind = _CONDITIONS[of[-1]]
            unit = "s" if kind in ("ttc", "headway") else "m"
            found |= {"kind": kind, "to": other.name, "value": self._amount(right, scope, unit, f"until_{kind}").value}
        else:
            self._refuse("a condition is a speed above, or a distance, headway or time to collision below a value", happens)
        end = combined("+", start, length or number(OPEN_PHASE))
        when = [found] if length is None else [found, *self._when(end, happens, "until")]
        self._since = when, end, ""
        return end

    def _when(self, time: Amount, node: Node, name: str) -> list[dict[str, Any]]:
        """Return the conditions that start an event at a time of the scenario."""
        if self._since is not None and time.usual >= self._since[1].usual:
            conditions, base, marker = self._since
            later = combined("-", time, base)
            if later.value == 0.0:
                self._since = conditions, base, marker or name
                return [dict(each) for each in conditions]
            if not marker or not later.fixed:
                self._refuse("after 'until', what follows begins at once or a fixed time later", node)
            return [{"kind": "began", "event": marker, "value": round(later.usual, 9)}]
        for guard in self._guards:
            time = Amount(f"({time.text} if {guard} else {NEVER})", np.where(self._rows[guard], time.values, NEVER))
        return [{"kind": "time", "value": self._named(time, f"{name}_time", "s", node)}]

    # -- drive() -----------------------------------------------------------------------------------

    def _actor(self, name: str, scope: Scope, node: Node) -> Actor:
        declared, seen = scope.of.fields.get(name), 0
        while declared is not None and declared.more["value"] is not None and seen < 9:
            name, seen = declared.more["value"].name, seen + 1
            declared = scope.of.fields.get(name)
        for top in self._names.types.values():
            declared = declared or (top.fields.get(name) if top.node.kind == "scenario" else None)
        if declared is None and name not in _EGOS:
            raise ScenarioError(f"no actor '{name}' is declared ({node.place})")
        kind = str(declared.more["of"]) if declared else "vehicle"
        known = self._names.types.get(kind)
        while kind not in ACTORS and known is not None and known.node.more["base"]:
            kind = str(known.node.more["base"])
            known = self._names.types.get(kind)
        if kind not in ACTORS and (known is None or known.node.kind != "actor"):
            self._refuse(f"{name} is of type {kind}, which is no vehicle", node)
        if name not in self._actors:
            self._actors[name] = Actor(name, ACTORS.get(kind, "car"), declared or node)
        return self._actors[name]

    def _at(self, actor: Actor, time: Amount) -> Amount:
        """Return an actor's place at a time, along the road from where the first one starts."""
        if actor.at is None:
            unplaced = [each for each in self._actors.values() if each.at is not None]
            actor.at = number(30.0 * len(unplaced))
            if unplaced:
                self._notes.append(f"{actor.name} has no position: it starts {actor.at.usual:g} m ahead")
        if not actor.way:
            return actor.at
        stretch = next((each for each in reversed(actor.way) if each.start.usual <= time.usual + 1e-9), actor.way[0])
        start, at, before, speed, within = stretch
        elapsed = combined("-", time, start)
        gone = combined("*", speed, elapsed)
        if within is not None and elapsed.text == within.text:
            gone = combined("*", combined("/", combined("+", before, speed), number(2.0)), within)
        elif within is not None:
            gone = combined("+", gone, combined("*", combined("-", before, speed), combined("/", within, number(2.0))))
        elif before.text != speed.text:
            gain = combined("-", speed, before)
            size = number(abs(gain.usual)) if gain.fixed else Amount(f"abs({gain.text})", np.abs(gain.values))
            gone = combined("-", gone, combined("/", combined("*", gain, size), number(2.0 * RATE)))
        return combined("+", at, gone)

    def _drive(self, node: Node, scope: Scope, start: Amount, length: Amount | None, label: str) -> Amount:
        call = node.items[0]
        who = self._driver_name(node)
        actor = self._actor(who or next((name for name in _EGOS if name in scope.of.fields), "ego"), scope, node)
        name = f"{actor.name}_{label or 'drives'}"
        asked: dict[str, tuple[Node, dict[str, Node]]] = {}
        for each in call.part("arguments"):
            if each.name == "duration":
                length = self._amount(each.items[0], scope, "s", f"{name}_duration")
            elif each.name not in ("", "adjust"):
                self._refuse(f"drive() has no '{each.name}' here", each)
        until = None
        for member in node.part("given"):
            if member.kind == "until":
                until = member
                continue
            modifier = self._modifier(member, scope)
            if modifier is None:
                continue
            kind, arguments = modifier
            when = arguments["at"].name if "at" in arguments else "all"
            if when not in ("all", "start", "end"):
                self._refuse(f"a modifier holds at start, at end or throughout, got 'at: {when}'", member)
            key = f"{kind} {when}"
            if key in asked:
                self._refuse(f"{kind}() is said twice of one phase", member)
            asked[key] = member, arguments
        if until is not None and until.items[0].kind == "call" and until.items[0].items[0].name == "elapsed":
            length = combined("-", self._ended(until.items[0], scope, start, None, actor, f"{name}_duration"), start)
            until = None
        if length is None:
            length = number(OPEN_PHASE)
            self._notes.append(f"the phase in line {node.line} has no duration: {OPEN_PHASE:g} s")
        self._phase(actor, asked, scope, start, length, name, node)
        end = combined("+", start, length)
        return end if until is None else self._ended(until.items[0], scope, start, length, actor, name)

    def _modifier(self, member: Node, scope: Scope) -> tuple[str, dict[str, Node]] | None:
        """Return a modifier's name and arguments; that of a keep() of a speed; None: no effect."""
        if member.kind == "keep":
            each = member.items[0]
            of = each.items[0].name if each.kind == "operation" else ""
            if each.name not in ("==", "in") or of != "speed":
                self._refuse("keep() of a drive() gives its speed a value (==) or a range (in)", member)
            return "speed", {"": each.items[1]}
        if member.kind != "call":
            self._refuse(f"'{member.kind}' of a drive() is not supported", member)
        kind = self._dotted(member.items[0]).split(".")[-1]
        if kind in ("keep_lane", "keep_speed"):
            return None
        if kind not in _MODIFIERS:
            known = ", ".join(sorted((*_MODIFIERS, "keep_lane", "keep_speed")))
            self._refuse(f"the modifier {kind}() is not supported; {known} are", member)
        arguments: dict[str, Node] = {}
        for each in member.part("arguments"):
            key = "" if each.name in ("lane_changes", *_MODIFIERS[kind][:1]) else each.name
            if key and key not in (*_MODIFIERS[kind], "at"):
                self._refuse(f"{kind}() has no '{key}' here; {', '.join(_MODIFIERS[kind])} are", each)
            arguments[key] = each.items[0]
        return kind, arguments

    def _phase(
        self, actor: Actor, asked: Mapping[str, tuple[Node, dict[str, Node]]], scope: Scope,
        start: Amount, length: Amount, name: str, node: Node,
    ) -> None:  # fmt: skip
        """Take in a drive(): the places and speeds that it asks for, as events."""
        first, end = not actor.way, combined("+", start, length)
        begins: dict[str, Any] = {}
        self._lane(actor, asked, scope, first, length, begins, name)
        for key in ("lateral all", "lateral start", "lateral end"):
            if key in asked:
                member, given = asked[key]
                side = given["side"].name if "side" in given else ""
                aside = self._amount(given.get("", member), scope, "m", f"{name}_aside")
                aside = combined("-", ZERO, aside) if side == "right" else aside
                if first and not key.endswith("end"):
                    actor.offset = aside
                else:
                    begins["lane_offset"] = {"offset": self._named(aside, f"{name}_aside", "m", member)}
        before, speed, within = self._speed(actor, asked, scope, first, start, length, end, name)
        if first:
            actor.first_speed = before
            place = next((asked[key] for key in ("position start", "position all") if key in asked), None)
            if place is not None:
                ahead = combined("*", before, start)
                actor.at = combined("-", self._target(actor, *place, scope, start, name, before), ahead)
                actor.at = self._short(actor.at, f"{actor.name}_at", "m", node)
            place_0 = self._at(actor, ZERO)
            actor.way.append(Stretch(ZERO, place_0, before, before, None))
        at = self._at(actor, start)
        if speed.text != before.text:
            begins["speed"] = self._named(speed, f"{name}_speed", "m/s", node)
            begins |= {"rate": RATE} if within is None else {"time": self._named(within, f"{name}_takes", "s", node)}
        actor.way.append(Stretch(start, at, before, speed, within))
        at_end = self._short(self._at(actor, end), f"{name}_ends_at", "m", node)
        actor.way.append(Stretch(end, at_end, speed, speed, None))
        actor.speed, self._highest = speed, max(self._highest, speed.high, before.high)
        if begins:
            event = self._new(name, self._events)
            self._lines[("events", event)] = node.line
            second = begins.pop("then", None)
            self._events[event] = {"participant": actor.name, **begins, "when": self._when(start, node, event)}
            for number_, (k, guard, rows, change) in enumerate(second or (), 1):
                self._rows[guard] = rows
                self._guards.append(guard)
                later = combined("+", start, number(number_ * change["time"]))
                when = self._when(later, node, f"{event}_{k}")
                self._guards.pop()
                self._events[f"{event}_{k}"] = {"participant": actor.name, "lane_change": change, "when": when}

    def _target(
        self, actor: Actor, member: Node, given: Mapping[str, Node], scope: Scope, time: Amount,
        name: str, speed: Amount,
    ) -> Amount:  # fmt: skip
        """Return the place that position() asks for at a time."""
        side = next((key for key in ("ahead_of", "behind") if key in given), None)
        if side is None or not given.keys() & {"", "time"}:
            self._refuse("position() is a distance or time ahead_of or behind another actor", member)
        other = self._actor(given[side].name, scope, member)
        if other is actor:
            self._refuse(f"{actor.name} cannot be {side.replace('_', ' ')} itself", member)
        if "time" in given:
            away = combined("*", self._amount(given["time"], scope, "s", f"{name}_headway"), speed)
        else:
            away = self._amount(given[""], scope, "m", f"{name}_distance")
        return combined("+" if side == "ahead_of" else "-", self._at(other, time), away)

    def _speed(
        self, actor: Actor, asked: Mapping[str, tuple[Node, dict[str, Node]]], scope: Scope,
        first: bool, start: Amount, length: Amount, end: Amount, name: str,
    ) -> tuple[Amount, Amount, Amount | None]:  # fmt: skip
        """Return the speed that a phase begins with, the one it leads to, and within which time."""

        def said(kind: str) -> Amount | None:
            member, given = asked.get(kind, (None, {}))
            unit = "m/s²" if kind.startswith("acceleration") else "m/s"
            if member is None:
                return None
            if "faster_than" in given or "slower_than" in given:
                key = "faster_than" if "faster_than" in given else "slower_than"
                other = self._actor(given[key].name, scope, member)
                by = self._amount(given[""], scope, unit, f"{name}_speed")
                return combined("+" if key == "faster_than" else "-", other.speed, by)
            if "" not in given:
                self._refuse(f"{kind.split()[0]}() needs a value", member)
            return self._amount(given[""], scope, unit, f"{name}_{kind.split()[0]}")

        throughout, at_start, at_end = (said(f"speed {when}") for when in ("all", "start", "end"))
        before = (at_start or throughout) if first else actor.speed
        if at_start is not None and not first and at_start.text != actor.speed.text:
            self._refuse("a phase begins as the one before ends: say speed(…, at: end) there", asked["speed start"][0])
        change = next((said(key) for key in asked if key.startswith("change_speed")), None)
        rate = next((said(key) for key in asked if key.startswith("acceleration")), None)
        if "position end" in asked and not (throughout or at_end or change or rate):
            if self._since is not None:
                self._refuse("after 'until' nobody knows where others are: position(at: end) cannot be reached", asked["position end"][0])
            if first and "position start" in asked and actor.at is None:
                actor.at = self._target(actor, *asked["position start"], scope, start, name, ZERO)
            way = combined("-", self._target(actor, *asked["position end"], scope, end, name, actor.speed), self._at(actor, start))
            mean = combined("/", way, length)
            if before is None:
                before = speed = self._short(mean, f"{name}_speed", "m/s", asked["position end"][0])
                within = None
            else:
                speed = combined("-", combined("*", number(2.0), mean), before)
                speed, within = self._short(speed, f"{name}_speed", "m/s", asked["position end"][0]), length
            if speed.high < 0.0:
                self._refuse(f"{actor.name} would drive backwards at {speed.low:.3g} m/s to be there", asked["position end"][0])
            if speed.low < 0.0:
                self._notes.append(f"{actor.name} cannot be there in every row: it does not drive backwards")
                speed = Amount(f"max({speed.text}, 0)", np.maximum(speed.values, 0.0))
                speed = self._short(speed, f"{name}_speed", "m/s", asked["position end"][0])
                before = speed if within is None else before
            return before, speed, within
        if before is None and (at_end is None or change or rate):
            other = next((given for key, (_, given) in asked.items() if key == "position all"), {})
            reference = other.get("ahead_of", other.get("behind"))
            if reference is not None:
                before = self._actor(reference.name, scope, reference).speed
            else:
                before = self._parameter(f"{actor.name}_speed", "m/s", *FREE, actor.node)
                self._notes.append(f"{actor.name} has no speed: {FREE[0]:g} to {FREE[1]:g} m/s are searched")
        before = before or at_end or ZERO
        if at_end is not None:
            return before, at_end, length
        if rate is not None:
            gained = combined("+", before, combined("*", rate, length))
            speed, within = self._short(gained, f"{name}_speed", "m/s", actor.node), length
        else:
            speed = throughout if throughout is not None and change is None else before
            within = None
            if change is not None:
                speed = self._short(combined("+", before, change), f"{name}_speed", "m/s", actor.node)
        if speed.low < 0.0:
            self._refuse(f"{actor.name} would drive backwards at {speed.low:.3g} m/s", actor.node)
        return before, speed, within

    def _lane(
        self, actor: Actor, asked: Mapping[str, tuple[Node, dict[str, Node]]], scope: Scope,
        first: bool, length: Amount, begins: dict[str, Any], name: str,
    ) -> None:  # fmt: skip
        """Take in the lanes of a phase."""
        for key in ("lane start", "lane all", "lane end"):
            if key not in asked:
                continue
            member, given = asked[key]
            target = self._lane_of(actor, member, given, scope)
            if not 1 <= target <= 6:
                self._refuse(f"lanes count from 1, the leftmost, to 6; {actor.name} would be on lane {target}", member)
            self._lanes = max(self._lanes, target)
            if actor.first_lane is None and not key.endswith("end"):
                actor.lane = actor.first_lane = target
            elif key == "lane start" and target != self._now(actor):
                self._refuse(f"a phase begins as the one before ends: {actor.name} is on lane {actor.lane} then", member)
            elif (lanes := self._now(actor) - target) and not (first and not key.endswith("end")):
                begins["lane_change"] = {"lanes": lanes, "time": self._takes(length)}
                actor.lane = target
        for key in (key for key in asked if key.startswith("change_lane")):
            self._change(actor, *asked[key], scope, length, begins, name)

    def _change(
        self, actor: Actor, member: Node, given: Mapping[str, Node], scope: Scope, length: Amount,
        begins: dict[str, Any], name: str,
    ) -> None:  # fmt: skip
        """Take in a change_lane(); of a range of lanes, each is an event of its own."""
        count = self._amount(given[""], scope, "", f"{name}_lanes") if "" in given and given[""].kind != "name" else number(1.0)
        side = (given.get("side") or given.get("") or member).name
        if side not in ("left", "right"):
            self._refuse("change_lane() needs a side, left or right", member)
        now = self._now(actor)
        room = now - 1 if side == "left" else self._lanes - now
        if count.low < 1 or count.low > room:
            self._refuse(f"{actor.name} cannot change {count.low:g} lanes to the {side}: it is on lane {now} of {self._lanes}", member)
        if count.high > room:
            self._notes.append(f"{name}: change_lane() by {count.low:g} to {count.high:g} lanes is by {room} at most, there are no more lanes")
            count = Amount(f"min({count.text}, {room})", np.minimum(count.values, room))
        sign, most = (1 if side == "left" else -1), int(count.high)
        takes = self._takes(length)
        begins["lane_change"] = {"lanes": sign * int(count.low), "time": takes}
        if count.low < most:
            if isinstance(takes, str):
                self._refuse("a range of lanes needs a phase of constant duration", member)
            takes = begins["lane_change"]["time"] = takes / (most - count.low + 1)
            begins["then"] = [
                (k, f"{count.text} >= {k}", count.values >= k, {"lanes": sign, "time": takes})
                for k in range(int(count.low) + 1, most + 1)
            ]
        actor.lane = now - sign * most

    @staticmethod
    def _takes(length: Amount) -> float | str:
        return length.value if length.high <= 8.0 else 5.0

    def _now(self, actor: Actor) -> int:
        """Return the lane of an actor; that of the right, where none has been said."""
        if actor.lane is None:
            actor.lane = actor.first_lane = self._lanes
        return actor.lane

    def _lane_of(self, actor: Actor, member: Node, given: Mapping[str, Node], scope: Scope) -> int:
        side = next((key for key in ("right_of", "left_of", "same_as", "side_of") if key in given), None)
        by = 1
        if "" in given:
            count = self._amount(given[""], scope, "", f"{actor.name}_lane")
            if not count.fixed:
                self._refuse("a lane is one number, not a range: use one_of", member)
            by = int(count.low)
        if side is None:
            if "" not in given:
                self._refuse("lane() is a number, or left_of, right_of or same_as another actor", member)
            return by
        other = self._actor(given[side].name, scope, member)
        if other is actor:
            self._refuse(f"{actor.name} cannot be {side.replace('_', ' ')} itself", member)
        if side == "side_of":
            side = f"{given['side'].name}_of" if "side" in given else side
        shift = {"right_of": by, "left_of": -by, "same_as": 0}.get(side)
        if shift is None:
            self._refuse("lane(side_of: …) needs a side, left or right", member)
        return self._now(other) + shift

    # -- roads -------------------------------------------------------------------------------------

    def _roads(self, of: Type) -> None:
        """Take in what a scenario asks of its road."""
        for member in of.members:
            if member.kind != "call":
                continue
            kind, arguments = self._dotted(member.items[0]).split(".")[-1], member.part("arguments")
            scope = Scope(of, {})
            if kind == "set_map":
                where = arguments[0].items[0] if arguments else member
                if where.kind == "name" and where.name in self._names.fields:
                    where = self._names.fields[where.name].more["value"] or where
                self._notes.append(f"the map {where.name} is not read: a template road with the lanes and the length that the drive()s need stands for it")
            elif kind == "path_min_driving_lanes" and arguments:
                self._lanes = max(self._lanes, int(self._amount(arguments[0].items[0], scope, "", "lanes").high))
            elif kind == "path_over_junction":
                before = next((each.items[0] for each in arguments if each.name == "distance_before"), None)
                self._junction = self._amount(before, scope, "m", "distance_before").usual if before else 100.0
                self._notes.append("path_over_junction(): the template crossroads stands for the junction")
            elif kind == "set_position":
                self._notes.append(f"set_position() in line {member.line} is a place on that map: it starts on the template road")
            elif kind not in ("cover", "record", "remove_default") and member.items[0].kind == "member_of" and not self._is_method(member):
                self._refuse(f"the modifier {kind}() of a scenario is not supported", member)

    def _is_method(self, member: Node) -> bool:
        """Return whether a call is of a method, which computes and moves nothing."""
        of = self._names.types.get(self._dotted(member.items[0]).split(".")[0])
        return of is not None and any(each.kind == "def" for each in of.members)


_MODIFIERS: Mapping[str, tuple[str, ...]] = {
    "speed": ("speed", "faster_than", "slower_than"),
    "position": ("distance", "time", "ahead_of", "behind"),
    "lane": ("lane", "right_of", "left_of", "same_as", "side_of", "side"),
    "lateral": ("distance", "side"),
    "change_lane": ("lane_changes", "side"),
    "change_speed": ("speed",),
    "acceleration": ("acceleration",),
}
"""The modifiers of a drive() and their arguments; the first may stand without its name."""
