"""From the scenario of an OpenSCENARIO DSL file to the data of a YAML scenario file."""

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bridgegen.base.errors import ScenarioError, UnsupportedError
from bridgegen.scenario.language.dsl.amounts import (
    Amount,
    Amounts,
    Guard,
    Scope,
    number,
    refuse,
    unit_of,
)
from bridgegen.scenario.language.dsl.names import ACTORS, Names, Type
from bridgegen.scenario.language.dsl.parser import COMPOSITIONS, Node
from bridgegen.scenario.language.dsl.phases import Actor, Phase, Phases
from bridgegen.scenario.language.plain_yaml import Document
from bridgegen.scenario.participants import PARTICIPANTS

NEVER = 1e5
"""Time of what does not happen in a row [s]."""

OPEN_PHASE = 10.0
"""Duration of a phase that states none [s]; ours."""

MOST_STEPS = 300

STEP = 0.05
"""Time step [s]."""

_EGOS = ("ego", "ego_vehicle", "sut", "dut")
_CONDITIONS = {
    "time_to_collision": ("ttc", "s"),
    "time_headway": ("headway", "s"),
    "object_distance": ("distance", "m"),
    "space_gap": ("gap", "m"),
}


def read_dsl(path: Path) -> Document:
    """Return an ``.osc`` file as the document of a scenario file, with its lines.

    Raises:
        FileFormatError: it, or a file that it imports, is missing or not of the grammar.
        ScenarioError: names that are declared twice or not at all, or values of another unit.
        UnsupportedError: what logical scenarios have no words for, with the line.
    """
    names = Names(path)
    names.stop()
    return _Story(names, path).document()


def dotted(node: Node) -> str:
    """Return the name that a node spells: ``ego.drive``."""
    return f"{dotted(node.items[0])}.{node.name}" if node.kind == "member_of" else node.name


def _drives(node: Node) -> Iterator[str]:
    """Yield who drives in a part of a scenario."""
    for each in node.every():
        if each.kind == "drive":
            yield dotted(each.items[0].items[0]).rpartition(".")[0]


class _Story:
    def __init__(self, names: Names, path: Path) -> None:
        self._names, self._path = names, path
        self._amounts = Amounts(names)
        self._phases = Phases(self._amounts)
        self._notes = self._phases.notes
        self._events: dict[str, dict[str, Any]] = {}
        self._guards: list[Guard] = []
        self._since: tuple[list[dict[str, Any]], Amount, str] | None = None
        self._junction: float | None = None
        self._depth = self._steps = 0
        for found in names.types.values():
            for node in (node for member in found.members for node in member.every()):
                if node.kind == "call" and node.items[0].name == "lane" and node.part("arguments"):
                    zero = node.part("arguments")[0].items[0].more.get("value") == 0.0
                    self._phases.from_zero |= zero

    # -- the document ------------------------------------------------------------------------------

    def document(self) -> Document:
        """Return what the file says; see `read_dsl`."""
        name, top = self._top()
        for other in self._names.types.values():
            if other.node.kind in ("scenario", "action"):
                self._roads(other)
        end = self._scenario(top, {}, number(0.0), None)
        actors, line = list(self._phases.actors.values()), top.node.line
        if not actors:
            refuse("a scenario needs the drive() of an actor", top.node)
        duration = round(math.ceil(round(end.high / STEP, 6)) * STEP, 9)
        if not 0.0 < duration <= 1000.0:
            refuse(f"a scenario takes 1,000 s at most, got {end.high:g} s", top.node)
        ego = self._ego(actors)
        actors.sort(key=lambda actor: actor is not ego)
        starts = [actor.at_time(number(0.0)) for actor in actors]
        ends = [1.05 * actor.at_time(number(duration)).high for actor in actors]
        begin = 60.0 - min(0.0, *(at.low for at in starts))
        length = 50.0 * math.ceil((begin + max(*ends, *(at.high for at in starts)) + 100.0) / 50.0)
        if not length <= 10_000.0:
            refuse(f"a road has 10,000 m at most, the actors drive {length:g} m", top.node)
        lanes, limit = self._phases.lanes, min(60.0, max(36.1, math.ceil(self._phases.highest)))
        data: dict[str, Any] = {
            "scenario": re.sub(r"^(?=[^A-Za-z])|[^\w-]", "s", self._path.stem)[:64],
            "title": f"{name} of {self._path.name}",
            "description": f"The scenario {name} of an OpenSCENARIO DSL file.",
            "source": f"{self._path.name}, line {line}.",
            "template": "road" if self._junction is None else "crossroads",
            "roads": {"lanes": lanes, "length": length, "shoulder_width": 2.5}
            | {"speed_limit": limit, "road_type": "motorway"},
        }
        if self._junction is not None:
            data["roads"] = {"lanes_per_direction": lanes, "arm_length": length}
        data |= {"duration": duration, "time_step": STEP, "axes": ["participants"]}
        data["include"] = ["motorway" if self._junction is None else "town", "weather"]
        data |= {"driver": "storyboard", "participants": {}, "events": self._events}
        for actor, at in zip(actors, starts, strict=True):
            key = "ego" if actor is ego else actor.name
            data["participants"][key] = self._participant(actor, key, at + begin, length)
        for event in self._events.values():
            for part in (event, *event["when"]):
                part |= {
                    key: "ego" for key in ("participant", "to", "of") if part.get(key) == ego.name
                }
        self._prune(data)
        if not data["parameters"]:
            data["axes"] = ["weather"]
            self._notes.append("the file has no ranges: a search varies the weather")
        if any(event["participant"] == "ego" for event in self._events.values()):
            what = "it moves as the file says, unless --ego names a driver, which decides itself"
            self._notes.append(f"the ego, {ego.name}: {what}")
        lines = {("participants",): line, ("events",): line, **self._amounts.lines}
        return Document(data, lines, str(self._path), notes=tuple(dict.fromkeys(self._notes)))

    def _participant(self, actor: Actor, key: str, at: Amount, length: float) -> dict[str, Any]:
        lane = actor.lanes[0] if actor.lanes else self._phases.lanes
        self._amounts.lines[("participants", key)] = actor.node.line
        start: dict[str, Any] = {"lane": lane}
        end: dict[str, Any] = {"lane": lane, "distance": length - 20.0}
        if self._junction is not None:
            start, end = start | {"leg": "A", "way": "in"}, end | {"leg": "C", "way": "out"}
            at = number(self._junction + 60.0) - at
        start["distance"] = self._amounts.written(at, f"{key}_start", "m", actor.node)
        if not actor.offset.fixed or actor.offset.low:
            start["offset"] = self._amounts.written(actor.offset, f"{key}_aside", "m", actor.node)
        speed = actor.speed or number(0.0)
        found: dict[str, Any] = {"type": actor.type, "start": start}
        found["speed"] = self._amounts.written(speed, f"{key}_start_speed", "m/s", actor.node)
        found["exceeds_limit"] = "The file states its speed."
        changes = [event for event in self._events.values() if "lane_change" in event]
        moves = any(event["participant"] == actor.name for event in changes)
        if key == "ego" or (self._junction is not None and not moves):
            found["end"] = end
        fastest = 1.1 * max(each.speed.high for each in actor.way)  # a sample may miss the highest
        if fastest > PARTICIPANTS[actor.type].body.max_speed:
            found["body"] = {"max_speed": float(math.ceil(fastest))}
            what = f"faster than a {actor.type} usually is: its body allows it"
            self._notes.append(f"{key} drives up to {fastest / 1.1:.3g} m/s, {what}")
        return found

    def _prune(self, data: dict[str, Any]) -> None:
        """Add what is declared, but what nothing reads."""
        sections = self._amounts.sections
        data |= sections
        tables, idle = (sections["parameters"], sections["derived"]), [""]
        while idle:
            formulas = [item["value"] for item in sections["derived"].values()]
            parts = (data["participants"], data["events"], sections["bounds"], formulas)
            words = set(re.findall(r"\w+", repr(parts)))
            idle = [name for table in tables for name in table if name not in words]
            for table in tables:
                for name in idle:
                    table.pop(name, None)

    def _top(self) -> tuple[str, Type]:
        """Return the scenario to run: ``top``, or the last one that no other calls."""
        able = {
            name: found
            for name, found in self._names.types.items()
            if any(member.kind == "do" for member in found.members)
        }
        members = [member for found in able.values() for member in found.members]
        drives = [each for member in members for each in member.every() if each.kind == "drive"]
        called = {dotted(each.items[0].items[0]) for each in drives}
        free = [name for name in able if name not in called]
        if not free:
            what = "no scenario with a do is declared, there is nothing to run"
            raise UnsupportedError(f"{what} ({self._path})")
        name = "top" if "top" in free else free[-1]
        if len(free) > 1:
            self._notes.append(f"of the scenarios {', '.join(free)}, {name} is run")
        return name, able[name]

    def _ego(self, actors: list[Actor]) -> Actor:
        for actor in sorted(actors, key=lambda a: (*_EGOS, a.name).index(a.name)):
            if actor.name in _EGOS or actor.node.more.get("of") in _EGOS:
                return actor
        self._notes.append(f"no actor is called ego: {actors[0].name} is")
        return actors[0]

    # -- roads and coverage ------------------------------------------------------------------------

    def _roads(self, of: Type) -> None:
        """Take in what a scenario asks of its road, and what of it is to be covered."""
        scope = Scope(of, {})
        for member in of.members:
            kind, given = dotted(member.items[0]) if member.items else "", member.part("arguments")
            if member.kind != "call" or kind.split(".")[0] in self._names.types:
                continue  # a method computes, and moves nothing
            named = {each.name: each.items[0] for each in given}
            match kind.split(".")[-1]:
                case "set_map":
                    where = named.get("", member)
                    where = self._names.fields.get(where.name, where)
                    where = where.more.get("value") or where
                    what = "a template road stands for it, as long and wide as the file needs"
                    self._notes.append(f"the map {where.name} is not read: {what}")
                case "path_min_driving_lanes" if given:
                    count = self._amounts.amount(given[0].items[0], scope, "", "lanes")
                    self._phases.lanes = max(self._phases.lanes, int(min(count.high, 6.0)))
                case "path_over_junction":
                    before = named.get("distance_before")
                    at = before and self._amounts.amount(before, scope, "m", "distance_before")
                    self._junction = float(at.values[0]) if at else 100.0
                    self._notes.append("the template crossroads stands for the path's junction")
                case "set_position":
                    what = "is a place on that map: the actor starts on the template road"
                    self._notes.append(f"set_position() in line {member.line} {what}")
                case "cover" | "record":
                    self._cover(member, named, scope)
                case other:
                    refuse(f"{other}() of a scenario is not supported", member)

    def _cover(self, member: Node, named: Mapping[str, Node], scope: Scope) -> None:
        of = named.get("expression", named.get("", member))
        unit = unit_of(scope.of.fields.get(of.name))
        text = self._amounts.amount(of, scope, unit, of.name).text if unit is not None else ""
        if text in self._amounts.sections["parameters"]:
            self._notes.append(f"the coverage of {text} is in the report, as of each parameter")
        else:
            what = "covers no range of the file and is left out"
            self._notes.append(f"{member.items[0].name}() in line {member.line} {what}")

    # -- compositions ------------------------------------------------------------------------------

    def _scenario(
        self, of: Type, given: Mapping[str, Amount], start: Amount, length: Amount | None
    ) -> Amount:
        self._depth += 1
        if self._depth > 16:
            refuse("scenarios call each other 16 deep at most", of.node)
        for member in of.members:
            if member.kind == "do":
                start = self._do(member.items[0], Scope(of, given), start, length, "")
            elif member.kind == "on":
                refuse("'on' is not supported: a phase ends by a duration or until", member)
        self._depth -= 1
        return start

    def _do(
        self, node: Node, scope: Scope, start: Amount, length: Amount | None, label: str
    ) -> Amount:
        """Go through a member of a do; return when it ends."""
        label, self._steps = node.name or label, self._steps + 1
        if self._steps > MOST_STEPS:
            refuse(f"a scenario has {MOST_STEPS} phases at most, also by calls of others", node)
        if node.kind in COMPOSITIONS:
            for each in node.part("arguments"):
                if each.name != "duration":
                    refuse(f"{node.kind}() has a duration alone, got '{each.name}'", each)
                name = f"{label or node.kind}_duration"
                length = self._duration(each.items[0], scope, name)
            if node.part("given"):
                refuse(f"'with' of a {node.kind} is not supported, of a drive() it is", node)
            end = self._composed(node, scope, start, length, label)
            return end if length is None or node.kind == "one_of" else start + length
        if node.kind == "wait":
            return self._ended(node.items[0], scope, start, None, f"{label or 'wait'}_duration")
        if node.kind in ("emit", "call"):
            return start  # nothing listens to it
        call, name = node.items[0], dotted(node.items[0].items[0])
        of = self._names.types.get(name)
        if of is not None and any(member.kind == "do" for member in of.members):
            given = {}
            for each in call.part("arguments"):
                if (unit := unit_of(of.fields.get(each.name))) is None:
                    refuse(f"{name}() has no field '{each.name}' that is a number", each)
                given[each.name] = self._amounts.amount(each.items[0], scope, unit, each.name)
            self._amounts.forget(name)
            return self._scenario(of, given, start, length)
        if name.split(".")[-1] != "drive":
            refuse(f"'{name}()' is not supported, drive() is", node)
        return self._drive(node, scope, start, length, label)

    def _composed(
        self, node: Node, scope: Scope, start: Amount, length: Amount | None, label: str
    ) -> Amount:
        members, ends = node.part("members"), []
        if node.kind == "serial":
            for member in members:
                start = self._do(member, scope, start, length if len(members) == 1 else None, label)
            return start
        if node.kind == "parallel":
            driving = {name for member in members for name in _drives(member)}

            def awaits(member: Node) -> int:  # those whose place others decide come after them
                others = driving - {*_drives(member)}
                return len(others & {each.name for each in member.every() if each.kind == "name"})

            ends = [
                self._do(member, scope, start, length, label)
                for member in sorted(members, key=awaits)
            ]
            return max(ends, key=lambda end: end.high)
        options = [member.name or f"option_{k}" for k, member in enumerate(members, 1)]
        if len(members) == 1:
            return self._do(members[0], scope, start, length, label)
        guards = self._amounts.choice(f"{label or 'one'}_of", options, node)
        before, after = self._phases.actors, []
        for guard, option, member in zip(guards, options, members, strict=True):
            self._phases.actors = dict(before)
            self._guards.append(guard)
            name = f"{label}_{option}".strip("_")
            ends.append(self._do(member, scope, start, length, name))
            self._guards.pop()
            after.append(self._phases.actors)
        return self._phases.merged(node, guards, ends, after)

    def _drive(
        self, node: Node, scope: Scope, start: Amount, length: Amount | None, label: str
    ) -> Amount:
        who = dotted(node.items[0].items[0]).rpartition(".")[0]
        who = who or next((name for name in _EGOS if name in scope.of.fields), "ego")
        actor = self._actor(who, scope, node)
        name, until = f"{actor.name}_{label or 'drives'}", None
        for each in node.items[0].part("arguments"):
            if each.name == "duration":
                length = self._duration(each.items[0], scope, f"{name}_duration")
            elif each.name not in ("", "adjust"):
                refuse(f"drive() has a duration alone, got '{each.name}'", each)
        phase = Phase(actor, scope, start, number(OPEN_PHASE), name, node)
        for member in node.part("given"):
            if member.kind == "until":
                until = member.items[0]
            else:
                phase.ask(member)
        if until is not None and until.kind == "call" and until.items[0].name == "elapsed":
            length = self._ended(until, scope, start, None, f"{name}_duration") - start
            until = None
        if length is None:
            self._notes.append(f"the phase in line {node.line} has no duration: {OPEN_PHASE:g} s")
        phase.length = length or phase.length
        event = self._phases.drive(phase)
        if event:
            key = name if name not in self._events else f"{name}_{len(self._events)}"
            when = self._when(start, node, key)
            self._events[key] = {"participant": actor.name, **event, "when": when}
            self._amounts.lines[("events", key)] = node.line
        if until is None:
            return start + phase.length
        return self._ended(until, scope, start, phase.length, name, actor.name)

    def _actor(self, name: str, scope: Scope, node: Node, depth: int = 0) -> Actor:
        scopes = [scope.of, *self._names.types.values()]
        fields = [each.fields for each in scopes if each.node.kind in ("scenario", "action")]
        declared = next((each[name] for each in fields if name in each), None)
        if declared is None and name not in _EGOS:
            raise ScenarioError(f"no actor '{name}' is declared ({node.place})")
        other = declared.more["value"] if declared is not None else None
        if other is not None and depth < 8:
            return self._actor(dotted(other), scope, node, depth + 1)
        kind = str(declared.more["of"]) if declared is not None else "vehicle"
        known = self._names.types.get(kind)
        while kind not in ACTORS and known is not None and known.node.more["base"]:
            kind = str(known.node.more["base"])
            known = self._names.types.get(kind)
        if kind not in ACTORS and (known is None or known.node.kind != "actor"):
            refuse(f"{name} is of type {kind}, which is no vehicle", node)
        found = Actor(name, ACTORS.get(kind, "car"), declared or node)
        return self._phases.actors.setdefault(name, found)

    # -- times and conditions ----------------------------------------------------------------------

    def _when(self, time: Amount, node: Node, name: str) -> list[dict[str, Any]]:
        """Return what starts an event at a time of the scenario."""
        if self._since is not None and time.values[0] >= self._since[1].values[0]:
            conditions, base, marker = self._since
            later = time - base
            if later.fixed and later.low == 0.0 and not self._guards:
                self._since = conditions, base, marker or name
                return [dict(each) for each in conditions]
            if not marker or not later.fixed or self._guards:
                refuse("after a condition, the next begins at once or a fixed time later", node)
            return [{"kind": "began", "event": marker, "value": round(later.low, 9)}]
        for guard in self._guards:
            time = guard.chosen(time, number(NEVER))
        value = self._amounts.written(time, f"{name}_time", "s", node)
        return [{"kind": "time", "value": value}]

    def _duration(self, node: Node, scope: Scope, name: str) -> Amount:
        found = self._amounts.amount(node, scope, "s", name)
        if not found.low > 0.0:
            refuse(f"{name} must be greater than 0 s, got {found.low:g} s", node)
        return found

    def _ended(
        self, happens: Node, scope: Scope, start: Amount, length: Amount | None, name: str,
        who: str = "",
    ) -> Amount:  # fmt: skip
        """Return when a wait or an until ends."""
        while happens.kind == "call" and happens.items[0].name in ("elapsed", "rise", "fall"):
            given = happens.part("arguments")
            if len(given) != 1:
                refuse(f"{happens.items[0].name}() has one value", happens)
            if happens.items[0].name == "elapsed":
                return start + self._duration(given[0].items[0], scope, name)
            happens = given[0].items[0]
        sign, items = happens.name, happens.items
        if happens.kind != "operation" or sign not in ("<", "<=", ">", ">="):
            refuse("wait and until end by elapsed(), or by a comparison", happens)
        if self._guards or self._since:
            refuse("one wait or until may end by a condition, outside of a one_of", happens)
        of = dotted(items[0].items[0] if items[0].kind == "call" else items[0]).split(".")
        who = self._actor(of[0], scope, happens).name if len(of) > 1 else who
        found: dict[str, Any] = {"kind": "speed", "of": who}
        unit = "m/s"
        if of[-1] in _CONDITIONS and sign[0] == "<" and items[0].part("arguments"):
            kind, unit = _CONDITIONS[of[-1]]
            arguments = {each.name: each.items[0] for each in items[0].part("arguments")}
            other = arguments.get("reference", arguments.get("", happens))
            found |= {"kind": kind, "to": self._actor(other.name, scope, happens).name}
        elif of[-1] != "speed" or sign[0] != ">" or not who:
            known = ", ".join(_CONDITIONS)
            refuse(f"a condition is a speed above, or below a value one of {known}", happens)
        value = self._amounts.amount(items[1], scope, unit, f"{name}_until")
        found["value"] = self._amounts.written(value, f"{name}_until", unit, happens)
        end = start + (length or number(OPEN_PHASE))
        also = self._when(end, happens, name) if length is not None else []
        self._since, self._phases.lost = ([found, *also], end, ""), True
        return end
