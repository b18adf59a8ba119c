"""Who is where, how fast and on which lane, from phase to phase of a scenario.

A phase's drive() changes an actor's speed and lane, as an event. What the file says of a phase's
end decides the speed that leads there. Distances are between reference points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from bridgegen.scenario.language.dsl.amounts import Amount, Amounts, Guard, Scope, number, refuse
from bridgegen.scenario.language.dsl.parser import Node

RATE = 3.0
"""Acceleration to a speed that holds throughout a phase [m/s²]; comfortable; ours."""

FREE = (8.0, 14.0)
"""Speeds where a file leaves them open [m/s]: 29 to 50 km/h; ours."""

MOST_LANES = 6
_UNKNOWN = 0

MODIFIERS: Mapping[str, tuple[str, ...]] = {
    "speed": ("speed",),
    "position": ("distance", "ahead_of", "behind"),
    "lane": ("lane", "right_of", "left_of", "same_as"),
    "lateral": ("distance", "side"),
    "change_lane": ("lane_changes", "side"),
    "change_speed": ("speed",),
    "acceleration": ("acceleration",),
    "keep_lane": (),
    "keep_speed": (),
}
"""The modifiers of a drive() and their arguments; the first may stand without its name."""

_NOTHING = number(0.0)


class Stretch(NamedTuple):
    """How an actor moves from a time on: ``within`` a time, or by `RATE`, to another speed."""

    start: Amount
    at: Amount
    before: Amount
    speed: Amount
    within: Amount | None


@dataclass(frozen=True)
class Actor:
    """A participant, as far as its scenario has been gone through.

    Attributes:
        name: in the file.
        type: of participant.
        node: its declaration.
        lanes: at the start, and now; None: no phase has said.
        offset: from its lane's centre at the start [m].
        at: its place at the start, along the road from where the first one stands [m].
        speed: at the start [m/s].
        way: its stretches so far.
    """

    name: str
    type: str
    node: Node
    lanes: tuple[int, int] | None = None
    offset: Amount = _NOTHING
    at: Amount | None = None
    speed: Amount | None = None
    way: tuple[Stretch, ...] = ()

    @property
    def now(self) -> Amount:
        """Its speed at the end of its last phase [m/s]."""
        return self.way[-1].speed if self.way else self.speed or _NOTHING

    def at_time(self, time: Amount) -> Amount:
        """Return its place at a time [m]."""
        if not self.way:
            return self.at or _NOTHING
        begun = [each for each in self.way if each.start.values[0] <= time.values[0] + 1e-9]
        start, at, before, speed, within = begun[-1] if begun else self.way[0]
        since, gain = time - start, speed - before
        if since.fixed and since.low == 0.0:
            return at
        if within is None:
            return at + speed * since - gain * abs(gain) / (2.0 * RATE)
        if since.text == within.text:
            return at + (before + speed) * within / 2.0
        if since.values[0] < within.values[0]:
            return at + before * since + gain * since * since / within / 2.0
        return at + speed * since - gain * within / 2.0


@dataclass
class Phase:
    """A drive() of an actor.

    Attributes:
        actor: who drives.
        scope: what names mean.
        start: when it begins [s].
        length: how long it takes [s].
        name: of what is made of it.
        node: the drive().
        asked: its modifiers and their arguments, by name and when they hold: ``lane end``.
        event: what becomes of it.
        begins: the place at which it begins, where the file says it [m].
    """

    actor: Actor
    scope: Scope
    start: Amount
    length: Amount
    name: str
    node: Node
    asked: dict[str, dict[str, Node]] = field(default_factory=dict)
    event: dict[str, Any] = field(default_factory=dict)
    begins: Amount | None = None

    def ask(self, member: Node) -> None:
        """Take in a modifier, or a keep() of the speed."""
        arguments: dict[str, Node] = {}
        if member.kind == "keep":
            limit = member.items[0]
            if limit.name not in ("==", "in") or limit.items[0].name != "speed":
                refuse("keep() of a drive() gives its speed a value (==) or a range (in)", member)
            kind, arguments = "speed", {"": limit.items[1]}
        elif member.kind != "call":
            refuse(f"'{member.kind}' of a drive() is not supported", member)
        else:
            kind = member.items[0].name
            if kind not in MODIFIERS:
                refuse(f"{kind}() is not supported; {', '.join(MODIFIERS)} are", member)
            known = MODIFIERS[kind]
            for each in member.part("arguments"):
                key = "" if each.name in known[:1] else each.name
                if (key and key not in (*known, "at")) or key in arguments:
                    refuse(f"{kind}() has {', '.join(known)} and at, got '{key}'", each)
                arguments[key] = each.items[0]
        when = arguments.pop("at").name if "at" in arguments else "all"
        key = f"{kind} {when}"
        if when not in ("all", "start", "end") or key in self.asked:
            refuse(f"{kind}() holds at start, at end or throughout, once each", member)
        self.asked[key] = {**arguments, "node": member}


class Phases:
    """The actors, and what their phases do to them.

    Attributes:
        actors: by name.
        lanes: how many the road has.
        notes: what a reader should know.
        highest: the highest speed of any [m/s].
    """

    def __init__(self, amounts: Amounts) -> None:
        self._amounts = amounts
        self.actors: dict[str, Actor] = {}
        self.lanes, self.highest = 1, 0.0
        self.notes: list[str] = []
        self.from_zero = False
        """Whether the file counts lanes from 0 on."""
        self.lost = False
        """Whether places are unknown, since a condition of a row has decided when a phase began."""

    def lane(self, actor: Actor, node: Node) -> int:
        """Return the lane that an actor is on; the right one where nothing has been said."""
        actor = self.actors[actor.name]
        if actor.lanes is None:
            self.actors[actor.name] = replace(actor, lanes=(self.lanes, self.lanes))
        lane = (actor.lanes or (self.lanes, self.lanes))[1]
        if lane == _UNKNOWN:
            refuse(f"the lane of {actor.name} is another in each alternative of a one_of", node)
        return lane

    def place(self, name: str, time: Amount) -> Amount:
        """Return where an actor is at a time [m]; one without a place is given one."""
        actor = self.actors[name]
        if actor.at is None and not actor.way:
            at = 30.0 * sum(other.at is not None for other in self.actors.values())
            if at:
                self.notes.append(f"{name} has no position: it starts {at:g} m ahead")
            self.actors[name] = actor = replace(actor, at=number(at))
        return actor.at_time(time)

    def drive(self, phase: Phase) -> dict[str, Any]:
        """Take in a phase; return its event, empty where nothing changes."""
        name, first = phase.actor.name, not phase.actor.way
        if not first and phase.start.values[0] < phase.actor.way[-1].start.values[0] - 1e-9:
            refuse(f"{name} drives in two phases at once", phase.node)
        self._change_lanes(phase, first)
        self._aside(phase, first)
        before, speed, within = self._speeds(phase, first)
        if speed.low < 0.0:
            refuse(f"{name} would drive backwards at {speed.low:.3g} m/s", phase.node)
        self.highest = max(self.highest, speed.high, before.high)
        if first:
            if (begins := self._begins(phase)) is not None:
                at = begins - before * phase.start
                at = self._amounts.short(at, f"{phase.name}_from", "m", phase.node)
                self.actors[name] = replace(self.actors[name], at=at)
            at = self.place(name, _NOTHING)
            opening = Stretch(_NOTHING, at, before, before, None)
            self.actors[name] = replace(self.actors[name], speed=before, way=(opening,))
        if speed.text != before.text:
            phase.event["speed"] = self._written(speed, phase, "speed", "m/s")
            if within is None:
                phase.event["rate"] = RATE
            else:
                phase.event["time"] = self._written(within, phase, "takes", "s")
        actor, end = self.actors[name], phase.start + phase.length
        way = Stretch(phase.start, actor.at_time(phase.start), before, speed, within)
        actor = replace(actor, way=(*actor.way, way))
        at = self._amounts.short(actor.at_time(end), f"{phase.name}_to", "m", phase.node)
        way = Stretch(end, at, speed, speed, None)
        self.actors[name] = replace(actor, way=(*actor.way, way))
        return phase.event

    def _written(self, amount: Amount, phase: Phase, what: str, unit: str) -> float | str:
        return self._amounts.written(amount, f"{phase.name}_{what}", unit, phase.node)

    def _said(self, phase: Phase, key: str, unit: str) -> Amount | None:
        """Return the value of a modifier."""
        if key not in phase.asked:
            return None
        kind = key.split()[0]
        if "" not in (given := phase.asked[key]):
            refuse(f"{kind}() needs a value", given["node"])
        return self._amounts.amount(given[""], phase.scope, unit, f"{phase.name}_{kind}")

    def _target(self, phase: Phase, given: Mapping[str, Node], time: Amount) -> Amount:
        """Return the place that position() asks for at a time."""
        side = next((key for key in ("ahead_of", "behind") if key in given), None)
        if side is None or "" not in given or given[side].name == phase.actor.name:
            refuse("position() is a distance ahead_of or behind another actor", given["node"])
        name = f"{phase.name}_distance"
        away = self._amounts.amount(given[""], phase.scope, "m", name)
        other = self.place(self.known(given[side]).name, time)
        return other + away if side == "ahead_of" else other - away

    def _begins(self, phase: Phase) -> Amount | None:
        """Return where an actor's first phase begins, if the file says it."""
        asked = phase.asked.get("position start") or phase.asked.get("position all")
        if asked is not None and phase.begins is None:
            phase.begins = self._target(phase, asked, phase.start)
        return phase.begins

    def known(self, node: Node) -> Actor:
        """Return the actor of a name."""
        if node.name not in self.actors:
            refuse(f"'{node.name}' does not drive before or beside this phase", node)
        return self.actors[node.name]

    def _speeds(self, phase: Phase, first: bool) -> tuple[Amount, Amount, Amount | None]:
        """Return the speed at a phase's start, the one that it leads to, and within which time."""
        asked, actor = phase.asked, self.actors[phase.actor.name]
        always, start, end = (
            self._said(phase, f"speed {w}", "m/s") for w in ("all", "start", "end")
        )
        change, rate = (
            next((self._said(phase, key, unit) for key in asked if key.startswith(kind)), None)
            for kind, unit in (("change_speed", "m/s"), ("acceleration", "m/s²"))
        )
        before = (start or always) if first else actor.now
        if start is not None and not first and start.text != actor.now.text:
            node = asked["speed start"]["node"]
            refuse("a phase begins as the one before ends: say speed(…, at: end) there", node)
        if "position end" in asked and not (always or end or change or rate):
            return self._to_position(phase, before)
        if before is None and end is not None:
            before = end
        if before is None:
            other = asked.get("position all", {})
            beside = other.get("ahead_of", other.get("behind"))
            if beside is not None:
                before = self.known(beside).now
            else:
                before = self._amounts.parameter(f"{actor.name}_speed", "m/s", *FREE, actor.node)
                self.notes.append(f"{actor.name} has no speed: {FREE[0]:g} to {FREE[1]:g} m/s")
        if end is not None:
            return before, end, phase.length
        name = f"{phase.name}_speed"
        if rate is not None:
            gained = before + rate * phase.length
            return before, self._amounts.short(gained, name, "m/s", phase.node), phase.length
        if change is not None:
            return before, self._amounts.short(before + change, name, "m/s", phase.node), None
        return before, always or before, None

    def _to_position(
        self, phase: Phase, before: Amount | None
    ) -> tuple[Amount, Amount, Amount | None]:
        """Return, likewise, the speeds that lead to where an actor is to be at a phase's end."""
        given, node = phase.asked["position end"], phase.asked["position end"]["node"]
        if self.lost:
            refuse("after a condition nobody knows how far others are: no position at end", node)
        own = self.actors[phase.actor.name]
        begins = None if own.way else self._begins(phase)
        goal = self._target(phase, given, phase.start + phase.length)
        mean = (goal - (begins or self.place(own.name, phase.start))) / phase.length
        speed = mean if before is None else mean * 2.0 - before
        if speed.low < 0.0 < speed.high:
            what = "cannot be there in every row: it does not drive backwards"
            self.notes.append(f"{own.name} {what} ({node.place})")
            speed = speed.least(0.0)
        speed = self._amounts.short(speed, f"{phase.name}_speed", "m/s", node)
        return (speed, speed, None) if before is None else (before, speed, phase.length)

    def _change_lanes(self, phase: Phase, first: bool) -> None:
        changes = [key for key in phase.asked if key.startswith("change_lane")]
        for key in ("lane start", "lane all", "lane end", *changes):
            if (given := phase.asked.get(key)) is None:
                continue
            actor, node = self.actors[phase.actor.name], given["node"]
            target = self._lane_of(phase, given, key in changes)
            if not 1 <= target <= MOST_LANES:
                what = f"lanes are 1, the leftmost, to {MOST_LANES}"
                refuse(f"{what}; {actor.name} would be on lane {target}", node)
            self.lanes = max(self.lanes, target)
            if actor.lanes is None and key in ("lane start", "lane all"):
                self.actors[actor.name] = replace(actor, lanes=(target, target))
                continue
            lane = self.lane(actor, node)
            if key == "lane start" and target != lane:
                refuse(f"a phase begins as the one before ends: {actor.name} is on {lane}", node)
            if target != lane:
                time = phase.length if phase.length.high <= 8.0 else number(5.0)
                time_ = self._written(time, phase, "takes", "s")
                phase.event["lane_change"] = {"lanes": lane - target, "time": time_}
                lanes = self.actors[actor.name].lanes or (lane, lane)
                self.actors[actor.name] = replace(self.actors[actor.name], lanes=(lanes[0], target))

    def _lane_of(self, phase: Phase, given: Mapping[str, Node], changes: bool) -> int:
        """Return the lane that lane() or change_lane() asks for."""
        side = next((key for key in ("right_of", "left_of", "same_as") if key in given), "")
        said, node, by = given.get(""), given["node"], 1
        if said is not None and said.kind == "range" and changes:
            low, high = (self._names_number(item) for item in said.items)
            room = self.lane(phase.actor, node) - 1
            if given.get("side", node).name == "right":
                room = self.lanes - room - 1
            if not low <= max(room, 1) < high and low != high:
                refuse("a change of lanes is by one number of them, not a range", said)
            self.notes.append(
                f"change_lane() is by {low}: the road has no more lanes ({node.place})"
            )
            by = low
        elif said is not None and not (changes and said.kind == "name"):
            count = self._amounts.amount(said, phase.scope, "", f"{phase.name}_lane")
            if not count.fixed or count.low != int(count.low):
                refuse("a lane is one whole number", node)
            by = int(count.low)
        if changes:
            side = given.get("side", given.get("", node)).name
            if side not in ("left", "right"):
                refuse("change_lane() needs a side, left or right", node)
            return self.lane(phase.actor, node) + (-by if side == "left" else by)
        if not side and said is None:
            refuse("lane() is a number, or left_of, right_of or same_as another actor", node)
        if not side:
            return by + self.from_zero
        if given[side].name == phase.actor.name:
            refuse(f"{phase.actor.name} cannot be {side.replace('_', ' ')} itself", node)
        shift = {"right_of": by, "left_of": -by, "same_as": 0}[side]
        return self.lane(self.known(given[side]), node) + shift

    @staticmethod
    def _names_number(node: Node) -> int:
        value = node.more.get("value")
        if not isinstance(value, float) or not 1.0 <= value <= MOST_LANES or node.name:
            refuse(f"a number of lanes is 1 to {MOST_LANES}", node)
        return int(value)

    def _aside(self, phase: Phase, first: bool) -> None:
        for key in ("lateral start", "lateral all", "lateral end"):
            if (aside := self._said(phase, key, "m")) is None:
                continue
            side = phase.asked[key].get("side")
            if side is not None and side.name not in ("left", "right"):
                refuse("the side of lateral() is left or right", side)
            if side is not None and side.name == "right":
                aside = number(0.0) - aside
            actor = self.actors[phase.actor.name]
            if first and key != "lateral end":
                self.actors[actor.name] = replace(actor, offset=aside)
            else:
                offset = self._written(aside, phase, "aside", "m")
                phase.event["lane_offset"] = {"offset": offset}

    def merged(
        self, node: Node, guards: Sequence[Guard], ends: Sequence[Amount],
        alternatives: Sequence[Mapping[str, Actor]],
    ) -> Amount:  # fmt: skip
        """Take in what the alternatives of a one_of lead to; return when it ends."""

        def chosen(each: Sequence[Amount], name: str, unit: str) -> Amount:
            found = each[-1]
            for guard, amount in zip(guards[-2::-1], each[-2::-1], strict=True):
                found = guard.chosen(amount, found)
            return self._amounts.short(found, name, unit, node)

        end = chosen(ends, "one_of_ends", "s")
        for name in dict.fromkeys(name for each in alternatives for name in each):
            able = [each[name] for each in alternatives if name in each]
            each = [actors.get(name, able[0]) for actors in alternatives]
            begun = [actor.lanes for actor in able if actor.lanes is not None]
            if len({lanes[0] for lanes in begun}) > 1:
                refuse(f"{name} starts on one lane in all alternatives of a one_of", node)
            lanes = begun[0] if begun else None
            if lanes is not None and len(set(begun)) > 1:
                lanes = (lanes[0], _UNKNOWN)
            first = next((actor.speed for actor in able if actor.speed is not None), _NOTHING)
            speed = chosen([actor.speed or first for actor in each], f"{name}_first_speed", "m/s")
            now = chosen([actor.now for actor in each], f"{name}_speed", "m/s")
            places = [actor.at_time(end) for actor, end in zip(each, ends, strict=True)]
            at = next((actor.at for actor in able if actor.at is not None), _NOTHING)
            there = chosen(places, f"{name}_at", "m")
            way = (Stretch(_NOTHING, at, speed, speed, None), Stretch(end, there, now, now, None))
            self.actors[name] = replace(able[0], lanes=lanes, at=at, speed=speed, way=way)
        return end
