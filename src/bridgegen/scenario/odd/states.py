"""What a scenario states of an operational design domain: quantities of its parameters, and facts.

``taxonomy.yaml`` has the attributes by their names in files, each with its evidence.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, cast

from bridgegen.base.errors import FileFormatError
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.roads import Quantity, RoadsSpec
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.named_models import MODELS
from bridgegen.scenario.odd.reader import UNKNOWN, Condition, Group, Odd
from bridgegen.scenario.participants import PARTICIPANTS

CLOSE = 1e-9
"""Relative difference by which a number may miss a limit, for rounding alone."""

STRAIGHT = 1e6
"""Radius [m] of what is no bend, and of no other quantity that a scenario states."""

MOST_CONDITIONS = 5_000

LONG = 100_000
"""Most characters of a formula that an ODD's conditions make."""


@dataclass(frozen=True)
class Concept:
    """An attribute that scenarios state.

    Attributes:
        name: in ``taxonomy.yaml``.
        at: where it stands in ISO 34503's taxonomy.
        quantity: its evidence; "" for none.
        bands: values, each with what the quantity is above and at most; None: never.
        facts: values, each with a fact; "true" alone: it is true or false.
        types: values, each with types of participants; likewise.
    """

    name: str
    at: str
    quantity: str = ""
    bands: Mapping[str, Sequence[float] | None] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    types: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Table:
    """What ``taxonomy.yaml`` holds.

    Attributes:
        quantities: by name: formula, unit, what it measures, and between what it lies.
        concepts: by the names that files write, in lower case.
        units: by what they measure: the factor into the first.
        terms: of the ontology, by evidence: what states it.
        attributes: of the standard, by group, each with its evidence and a note.
        tags: of ASAM OpenLABEL, each with its evidence.
    """

    quantities: Mapping[str, Mapping[str, Any]]
    concepts: Mapping[str, Concept]
    units: Mapping[str, Mapping[str, float]]
    terms: Mapping[str, Sequence[str]]
    attributes: Mapping[str, Mapping[str, str]]
    tags: Mapping[str, Any]


@cache
def table() -> Table:
    """Return the attributes of scenarios."""
    path = Path(__file__).with_name("taxonomy.yaml")
    data: Any = read_plain_yaml(path.read_bytes(), path.name).data
    concepts: dict[str, Concept] = {}
    for name, entry in data["concepts"].items():
        facts = entry.get("facts") or ({"true": entry["fact"]} if "fact" in entry else {})
        types = entry.get("types") or {}
        types = {"true": types} if isinstance(types, list) else types
        found = Concept(
            name, entry["at"], entry.get("quantity", ""), entry.get("bands") or {}, facts, types
        )
        concepts |= dict.fromkeys((name, *entry.get("also", ())), found)
    rest = (data[name] for name in ("units", "terms", "attributes", "tags"))
    return Table(data["quantities"], concepts, *rest)


def concept_of(name: str) -> Concept | None:
    """Return the attribute that a file's name stands for; None where no scenario states it."""
    known = table().concepts
    name = name.strip().lower()
    return known.get(name) or known.get(name.rpartition(".")[2] if _is_path(name) else name)


@dataclass(frozen=True)
class Term:
    """Something that holds for some rows: a formula, and the condition that it comes from.

    Attributes:
        formula: of parameters and derived quantities, 1 or 0.
        said: the condition as the file has it.
    """

    formula: Expression
    said: str


@dataclass(frozen=True)
class States:
    """What a scenario states.

    Attributes:
        scenario: the scenario.
        facts: that hold in all its rows.
        quantities: formulas by name; of roads none where they are a map's.
        others: for each participant but the ego, the types that it may have, and the parameter that
            chooses one; "" of a single type.
        on_map: whether it takes place on a map, whose roads are not read.
        unread: why it has no more quantities and facts.
    """

    scenario: SearchedScenario
    facts: frozenset[str]
    quantities: Mapping[str, Expression]
    others: tuple[tuple[tuple[str, ...], str], ...]
    on_map: bool = False
    unread: str = "this scenario has none"

    def holds(self, condition: Condition, positive: bool, odd: Odd) -> "bool | str | Term":
        """Say when a condition holds, or when it does not.

        Args:
            condition: of an attribute whose literals no range defines.
            positive: whether it is to hold; of several participants or signs each must then be
                one of the values, and none of them may be otherwise.
            odd: that asks it.

        Returns:
            Always or never; why that cannot be said; or the rows in which it is so.

        Raises:
            FileFormatError: a unit of another dimension.
        """
        if condition.problem:
            return condition.problem
        concept = concept_of(condition.concept)
        if concept is None:
            return "no scenario states it"
        if condition.missing:
            # Whether it is known is a matter of sensors: a scenario has a value.
            named = {*concept.bands, *concept.facts, *concept.types}
            values = tuple(v for v in condition.values if v in named or v not in UNKNOWN)
            if not values:
                return not positive
            condition = replace(condition, values=values)
        if concept.quantity:
            formula = self.quantities.get(concept.quantity)
            if formula is None:
                return self.unread
            return self._of_quantity(formula, condition, concept, positive, odd)
        if not condition.values:
            return f"{condition.text} is none of its values"
        if concept.types:
            return self._of_types(concept, condition, positive)
        return self._of_facts(concept, condition, positive)

    def value(self, concept: Concept, row: Mapping[str, float]) -> "float | list[str] | None":
        """Return an attribute of a row: a number in the quantity's unit, values, or None.

        Args:
            concept: the attribute.
            row: values of parameters and derived quantities, by name.
        """
        if concept.quantity:
            formula = self.quantities.get(concept.quantity)
            if formula is None:
                return None
            x = float(formula.evaluate(row))
            if not concept.bands:
                return x if x < STRAIGHT else None
            return [k for k, v in concept.bands.items() if v is not None and v[0] < x <= v[1]][:1]
        if concept.types:
            kinds = {kind_of(types[round(row[by]) if by else 0]) for types, by in self.others}
            if tuple(concept.types) == ("true",):
                return ["true" if kinds & set(concept.types["true"]) else "false"]
            found = {
                kind: next(k for k, v in concept.types.items() if kind in v)
                for kind in sorted(kinds)
                if any(kind in v for v in concept.types.values())
            }
            return list(found.values())
        known = {value: self._fact(fact) for value, fact in concept.facts.items()}
        if None in known.values():
            return None
        if tuple(concept.facts) == ("true",):
            return ["true" if known["true"] else "false"]
        seen = {concept.facts[value]: value for value in reversed(known) if known[value]}
        return sorted(seen.values())

    def tags(self, row: Mapping[str, float]) -> dict[str, float | bool | None]:
        """Return of each tag of ASAM OpenLABEL whether it holds for a row, or its value.

        Those that this scenario states nothing of are left out.

        Args:
            row: values of parameters and derived quantities, by name.
        """
        found: dict[str, float | bool | None] = {}
        for tag, evidence in table().tags.items():
            if isinstance(evidence, str):
                if (met := self._fact(evidence)) is not None:
                    found[tag] = met
                continue
            quantity, above, up_to, *states = evidence
            formula = self.quantities.get(quantity)
            if formula is not None and formula.names <= row.keys():
                x = float(formula.evaluate(row))
                found[tag] = (x if states else True) if above < x <= up_to else False
            elif not self.on_map and quantity in ("curve_radius", "roundabout_diameter"):
                found[tag] = False
        return found

    # -- evidence ------------------------------------------------------------------------------

    def _fact(self, fact: str) -> bool | None:
        of_roads = fact not in ("never", "always", "jam") and not fact.startswith("participant:")
        if self.on_map and of_roads:
            return None
        return fact == "always" or fact in self.facts

    def _of_facts(self, concept: Concept, condition: Condition, positive: bool) -> "bool | str":
        asked = set(condition.values)
        if tuple(concept.facts) == ("true",):
            met = self._fact(concept.facts["true"])
            if met is None:
                return self.unread
            if asked - {"true", "false"}:
                return f"{condition.text} is none of its values"
            return (("true" if met else "false") in asked) == positive
        known = {value: self._fact(fact) for value, fact in concept.facts.items()}
        if None in known.values():
            return self.unread
        present = {concept.facts[value] for value, met in known.items() if met}
        of_asked = {concept.facts[value] for value in asked & known.keys()}
        strange = sorted(asked - known.keys())
        if positive:
            if present:
                return (
                    present <= of_asked if present & of_asked or not strange else _strange(strange)
                )
            return _strange(strange) if strange else False
        if present & of_asked:
            return False
        return _strange(strange) if strange else True

    def _of_types(
        self, concept: Concept, condition: Condition, positive: bool
    ) -> "bool | str | Term":
        is_flag, asked = tuple(concept.types) == ("true",), set(condition.values)
        strange = sorted(asked - ({"true", "false"} if is_flag else concept.types.keys()))
        if strange:
            return _strange(strange)
        if {"true", "false"} <= asked:
            return positive
        # Of a flag one participant is enough, or none may be; of types each has one that is asked,
        # or none has.
        one_is_enough = is_flag and ("true" in asked) == positive
        wanted = {kind for each in asked for kind in concept.types.get(each, ())}
        wanted = set(concept.types["true"]) if is_flag else wanted
        inside = one_is_enough or (positive and not is_flag)
        certain: list[bool] = []
        varying: list[str] = []
        for types, by in self.others:
            fits = [name for name in types if (kind_of(name) in wanted) == inside]
            if len(fits) in (0, len(types)):
                certain.append(bool(fits))
            else:
                varying.append(" or ".join(f"{by} == {name}" for name in fits))
        if one_is_enough in certain or not varying:
            return any(certain) if one_is_enough else all(certain)
        sign = " or " if one_is_enough else " and "
        return self._term(sign.join(f"({text})" for text in varying), condition, positive)

    def _of_quantity(
        self,
        formula: Expression,
        condition: Condition,
        concept: Concept,
        positive: bool,
        odd: Odd,
    ) -> "bool | str | Term":
        spans = spans_of(condition, concept, odd)
        if isinstance(spans, str):
            return spans
        if not spans:
            return not positive
        pieces = [_inside(formula, *span) for span in spans]
        text = " or ".join(f"({piece})" for piece in pieces)
        return self._term(text if positive else f"not ({text})", condition, positive)

    def _term(self, text: str, condition: Condition, positive: bool) -> "bool | Term":
        categories = {
            name: parameter.kind.names
            for name, parameter in self.scenario.parameters.items()
            if parameter.kind.names
        }
        formula = parse(text, f"of {condition.name}", categories, longest=LONG, deepest=64)
        if not formula.names:
            return bool(formula.evaluate({}))
        return Term(formula, condition.name if positive else f"not {condition.name}")


def spans_of(
    condition: Condition, concept: Concept, odd: Odd
) -> "str | list[tuple[float, float, bool, bool]]":
    """Return the intervals of a quantity that a condition asks, or why they cannot be said.

    Each has its ends, and whether each of these is outside.
    """
    if condition.values:
        strange = sorted(set(condition.values) - concept.bands.keys())
        if strange:
            return _strange(strange)
        bands = (concept.bands[value] for value in condition.values)
        return [(band[0], band[1], True, False) for band in bands if band is not None]
    if concept.bands:
        return f"{condition.text} is none of its values"
    low, high = (in_unit(x, condition, concept, odd) for x in (condition.low, condition.high))
    if low > high:
        raise FileFormatError(f"{condition.name}: no value is in it ({odd.path})")
    return [(low, high, condition.above, condition.below)]


def _strange(values: Iterable[str]) -> str:
    return f"no scenario states {', '.join(values)}"


def _is_path(name: str) -> bool:
    return re.search(r"\.(occurrence|count|confidence|probability|duration|depth)", name) is None


def _inside(formula: Expression, low: float, high: float, above: bool, below: bool) -> str:
    """Return the formula of whether a quantity lies in an interval."""
    parts = []
    # Only a constant may miss a limit by rounding: of 50 km/h, say, that the file gives in m/s.
    close = 0.0 if formula.names else CLOSE
    if math.isfinite(low):
        limit = low + (close if above else -close) * abs(low)
        parts.append(f"({formula}) {'>' if above else '>='} {limit!r}")
    if math.isfinite(high):
        limit = high + (-close if below else close) * abs(high)
        parts.append(f"({formula}) {'<' if below else '<='} {limit!r}")
    return " and ".join(parts) or "1 == 1"


def in_unit(value: float, condition: Condition, concept: Concept, odd: Odd) -> float:
    """Return a number of a condition in the unit of its quantity.

    Raises:
        FileFormatError: it has a unit of another dimension.
    """
    entry = table().quantities[concept.quantity]
    known = table().units.get(entry["measures"], {})
    unit, factor, offset = condition.unit, 1.0, 0.0
    for _ in range(4):  # a file's own units may stand on each other
        if unit in known or (law := odd.conversions.get(entry["measures"], {}).get(unit)) is None:
            break
        # "x unit" = scale · base + offset
        unit, factor, offset = law[0], factor / law[1], (offset - law[2]) / law[1]
    if not unit and entry["measures"] != "fraction":
        unit = entry["unit"]  # a bare number is in the quantity's unit
    unit = unit or "1"
    if unit not in known:
        raise FileFormatError(
            f"{condition.name}: '{condition.unit}' is no unit of {entry['measures']}; known: "
            f"{', '.join(name for name in known if name)} ({odd.path})"
        )
    return (value * factor + offset) * known[unit] / known[entry["unit"]]


# -- what a logical scenario states ----------------------------------------------------------------


def states_of(scenario: SearchedScenario, *, on_map: bool = False) -> States:
    """Return what a scenario states.

    Args:
        scenario: the scenario.
        on_map: whether it takes place on a map, whose roads are not read.

    Raises:
        UnsupportedError: one of which nothing is read.
    """
    if not isinstance(scenario, LogicalScenario):
        return cast(States, scenario.states())
    others = tuple(
        (each.types or (each.model or each.type,), each.type_by)
        for each in scenario.participants
        if each.name != "ego"
    )
    facts = facts_of_types(others)
    facts |= {"participant:emergency" for each in scenario.participants if each.siren}
    facts |= {"jam"} if scenario.story.jams else set()
    facts |= {"road works", "warning sign"} if scenario.story.works else set()
    measures: dict[str, Quantity] = {"ego_speed": scenario.ego.speed}
    measures |= {name: name for name in (*scenario.parameters, *(d.name for d in scenario.derived))}
    measures["ego_speed"] = scenario.ego.speed
    if not on_map:
        facts |= facts_of_roads(scenario.roads)
        if scenario.ego.start.leg != "ramp":
            facts.discard("slip road")  # there is one, and the ego is not on it
        measures |= _measures_of(scenario.roads)
    else:
        for name in scenario.roads.knobs:
            measures.pop(name, None)
    formulas = {}
    for name, entry in table().quantities.items():
        names = re.findall(r"\{(\w+)\}", entry["formula"])
        if all(each in measures for each in names):
            text = re.sub(r"\{(\w+)\}", lambda found: str(measures[found[1]]), entry["formula"])
            formulas[name] = parse(text, longest=LONG)
    more = {"unread": "the roads of a map are not read"} if on_map else {}
    return States(scenario, frozenset(facts), formulas, others, on_map, **more)


def facts_of_types(others: Iterable[tuple[Iterable[str], str]]) -> set[str]:
    """Return which participants there are; see `States.others`."""
    found = {f"participant:{kind_of(name)}" for types, _ in others for name in types}
    return found - {"participant:other"}  # an obstacle


def kind_of(name: str) -> str:
    """Return the kind of a participant by the taxonomy's classes: a van is with the cars."""
    if name in MODELS:
        name = MODELS[name].type
    if name not in PARTICIPANTS:
        return "car"  # a vehicle by its model's name
    return name if name == "emergency" else PARTICIPANTS[name].seen_as.name


def facts_of_roads(roads: RoadsSpec) -> set[str]:
    """Return the facts of a scenario's roads."""
    template, knobs = roads.template, roads.knobs
    facts = {
        "traffic lane",
        "marked",
        f"{'left' if roads.left_hand else 'right'}-hand traffic",
        roads.road_type,
    }
    facts |= {"slip road", "divided"} if template == "merge" else set()
    if template in ("crossroads", "t-junction"):
        facts |= {template, "undivided"}
        facts.add("junction without lights" if roads.signals == "none" else "traffic lights")
    if template == "roundabout":
        facts |= {"roundabout", "undivided"}
    if template == "road":
        facts.add("divided" if knobs["lanes_against"] == 0 else "undivided")
    facts |= {"no junction"} if template in ("road", "merge") else set()
    facts |= {"pavement"} if knobs["sidewalk_width"] != 0 else set()
    facts |= {"shoulder"} if knobs["shoulder_width"] != 0 else set()
    if roads.crosswalk_at is not None or any(leg.crosswalk for leg in roads.legs.values()):
        facts.add("crosswalk")
    signs = any(leg.sign for leg in roads.legs.values()) or roads.signals != "none"
    return facts | {"regulatory sign" if signs else "no sign"}


def _measures_of(roads: RoadsSpec) -> dict[str, Quantity]:
    knobs = roads.knobs
    found: dict[str, Quantity] = dict(knobs) | {"grade": knobs.get("grade", 0.0)}
    if "lanes" not in knobs:
        found["lanes"] = knobs["lanes_per_direction"]
    if roads.template != "roundabout":
        found.pop("radius", None)
        bends = [name for each in roads.segments for name in (each.curvature, each.end_curvature)]
        tightest = "0"
        for bend in dict.fromkeys(bends):
            tightest = f"max({tightest}, abs({bend}))"
        # 5,000 km of radius is straight, and a finite number.
        found["curve_radius"] = f"1/max({tightest}, 2e-7)"
    return found


def literals_of(condition: Condition, odd: Odd) -> tuple[str, ...]:
    """Return the values of a condition; of one above or below a literal, in the order as written.

    Ranges induce the order (section 10.2.2.3), whose example has it as it is written.
    """
    defined = odd.taxonomy.get(condition.concept)
    sign, *rest = condition.values or ("",)
    if isinstance(defined, Mapping) and sign in ("<", "<=", ">", ">=") and rest[0] in defined:
        names, at = list(defined), list(defined).index(rest[0])
        ends = {"<": (0, at), "<=": (0, at + 1), ">": (at + 1, None), ">=": (at, None)}[sign]
        return tuple(names[slice(*ends)])
    return condition.values


def size_of(odd: Odd) -> int:
    """Return the number of conditions that an ODD asks, with those that define its literals.

    Raises:
        FileFormatError: literals define each other, or they are more than `MOST_CONDITIONS`.
    """
    sizes: dict[int, int] = {}

    def size(part: Condition | Group, inside: tuple[str, ...]) -> int:
        # Modules are shared, and counted once for each that refers to them: two that refer twice
        # to the next, 32 deep, ask 2³² conditions.
        if id(part) in sizes:
            return sizes[id(part)]
        parts: Sequence[Condition | Group] = ()
        if isinstance(part, Group):
            parts = part.parts
        elif isinstance(meant := resolved(part, odd), Group):
            if part.concept in inside:
                cycle = " → ".join((*inside, part.concept))
                raise FileFormatError(f"literals define each other: {cycle} ({odd.path})")
            parts, inside = meant.parts, (*inside, part.concept)
        found = sum(size(each, inside) for each in parts) or 1
        if found > MOST_CONDITIONS:
            what = f"an ODD may ask {MOST_CONDITIONS:,} conditions, with those of modules that"
            raise FileFormatError(f"{what} several others refer to ({odd.path})")
        sizes[id(part)] = found
        return found

    return size(odd.formula, ())


def resolved(condition: Condition, odd: Odd) -> "Condition | Group":
    """Return what defines a condition's literals, where the ODD's taxonomy says it."""
    defined = odd.taxonomy.get(condition.concept)
    if not isinstance(defined, Mapping) or condition.problem or not condition.values:
        return condition
    values = literals_of(condition, odd)
    formulas = [formula for value in values if (formula := defined.get(value)) is not None]
    if values and len(formulas) == len(values):
        return Group("or", tuple(formulas))
    return replace(condition, values=values)
