"""From individuals to the picture of five columns; see `picture`."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import pyoxigraph as ox

from bridgegen.pages.picture import Box, Fact, Link, Parameter, Picture, Reason
from bridgegen.scenario.ontology.graph import Individuals, as_number
from bridgegen.scenario.ontology.phrases import Phrase, Phrases, property_label, unit_of, value_text
from bridgegen.scenario.ontology.structure import Members, texts
from bridgegen.scenario.ontology.vocabulary import TYPE, Subject, bg, local_name, tbox
from bridgegen.scenario.ontology.words import Violation

# --- Which parameter of the search space gives which value of a file's individuals ---


class Bindings:
    """The parameters of a file, and the values that they give.

    Attributes:
        parameters: per individual that is one.
    """

    def __init__(self, members: Members) -> None:
        self._members = members
        self.parameters = {
            node: Parameter(
                members.name(node),
                self._text(node, "has_unit"),
                self._number(node, "has_low"),
                self._number(node, "has_high"),
                self._text(node, "has_expression"),
            )
            for node in members.nodes
            if members.is_a(node, "Parameter")
        }

    def of(self, node: Subject, term: ox.NamedNode) -> str:
        """Return the name of the parameter that gives a property's value, or nothing."""
        if node in self.parameters:
            return self.parameters[node].name
        for item in self._members.values(node).get(bg("has_parameter"), ()):
            if isinstance(item, Subject) and item in self.parameters:
                binds = texts(self._members.values(item).get(bg("binds_property"), ()))
                if local_name(term) in binds:
                    return self.parameters[item].name
        return ""

    def bound(self, phrase: Phrase) -> list[tuple[str, float]]:
        """Return the parameters that give the values of a phrase, with the values."""
        found: list[tuple[str, float]] = []
        for node, term in phrase.bound:
            name = self.of(node, term)
            for value in self._members.values(node).get(term, ()) if name else ():
                number = as_number(value) if isinstance(value, ox.Literal) else None
                if number is not None and (name, number) not in found:
                    found.append((name, number))
        return found

    def _number(self, node: Subject, name: str) -> float | None:
        found = self._members.values(node).get(bg(name), [])
        return as_number(found[0]) if found and isinstance(found[0], ox.Literal) else None

    def _text(self, node: Subject, name: str) -> str:
        return next(iter(texts(self._members.values(node).get(bg(name), ()))), "")


FEW = 4
"""Number of lines of a box that are shown at first, unless more are searched parameters or
phrases."""

_IN_WORDS = ("Action", "Condition", "ConditionGroup", "Trigger")
_OF_AN_EVENT = (bg("has_what"), bg("has_when"))
_UNSAID = frozenset({TYPE, bg("has_name"), bg("has_parameter"), bg("constraint")})
_CALLED = {"has_init_action": "at first", "has_position": "at"}
_EVENTS_LAYER = 4
_DIGITS = re.compile(r"([0-9]+)")


def paint(
    individuals: Individuals, violations: Sequence[Violation] = (), checked: str = ""
) -> Picture:
    """Return the picture of a file's individuals.

    Args:
        individuals: of a scenario or a road network; invalid ones are shown unchanged.
        violations: the result of `bridgegen.scenario.ontology.check.check`.
        checked: what it checks, in words.
    """
    return _Painter(individuals, violations).picture(checked)


@dataclass
class _Sketch:
    """An unfinished box: its lines, and the label of each link."""

    layer: int
    lines: list[tuple[str, Phrase]] = field(default_factory=list)
    links: dict[Subject, str] = field(default_factory=dict)


class _Painter:
    """Sketches every box, assigns the violations, and assembles the picture."""

    def __init__(self, individuals: Individuals, violations: Sequence[Violation]) -> None:
        self.members = Members(individuals)
        self.phrases = Phrases(self.members)
        self.violations = violations
        self.bindings = Bindings(self.members)
        self.parameters = self.bindings.parameters
        self.sketches = {
            node: _Sketch(layer)
            for node in self.members.nodes
            if (layer := self._column(node)) is not None
        }
        self.ids = _unique(list(self.sketches))
        for node, sketch in self.sketches.items():
            self._describe(node, sketch)

    def picture(self, checked: str) -> Picture:
        members, scenarios = self.members, self._scenarios()
        facts = [
            Fact(property_label(term), ", ".join(self._shown(node, term)))
            for node in scenarios
            for term in (bg("has_duration"), bg("has_time_step"))
            if self._shown(node, term)
        ]
        facts += [
            self._fact(parameter.name, phrase, self._homes[1])
            for node, parameter in self.parameters.items()
            if (phrase := self._carried_by_itself(node, parameter)) is not None
        ]
        boxes = self._boxes()
        tops = scenarios or [
            sketch for sketch in self.sketches if members.is_a(sketch, "RoadNetwork")
        ]
        shown = [
            *facts,
            *(fact for box in boxes for item in (box, *box.inside) for fact in item.facts),
        ]
        used = {name for fact in shown for name, _ in fact.bound}
        return Picture(
            name=", ".join(map(members.name, tops)),
            facts=tuple(facts),
            boxes=boxes,
            parameters={item.name: item for item in self.parameters.values() if item.name in used},
            violations=tuple(
                Reason(": ".join(filter(None, (v.individual, v.parameter or v.property))), str(v))
                for v in self.violations
            ),
            homeless=tuple(self._homes[1]),
            left_out=self._left_out(scenarios),
            checked=checked,
        )

    def _carried_by_itself(self, node: Subject, parameter: Parameter) -> Phrase | None:
        """Return the value of a parameter that no other individual carries."""
        for term in (bg("has_value"), bg("has_word")):
            found = self.members.values(node).get(term, ())
            if shown := [value_text(v, parameter.unit) for v in found if isinstance(v, ox.Literal)]:
                return Phrase(", ".join(shown), [(node, term)], [node])
        return None

    # -- what is a box -------------------------------------------------------------------------

    def _column(self, node: Subject) -> int | None:
        members = self.members
        if any(members.is_a(node, cls) for cls in _IN_WORDS):
            return None
        layer = members.layer(node)
        return _EVENTS_LAYER if layer is None and members.is_a(node, "Event") else layer

    def _scenarios(self) -> list[Subject]:
        return [node for node in self.members.nodes if self.members.is_a(node, "Scenario")]

    def _left_out(self, scenarios: list[Subject]) -> tuple[str, ...]:
        in_phrases = {
            node for sketch in self.sketches.values() for _, p in sketch.lines for node in p.nodes
        }
        shown = in_phrases | set(scenarios) | self.sketches.keys() | self.parameters.keys()
        return tuple(
            sorted(self.members.name(node) for node in self.members.nodes if node not in shown)
        )

    # -- what is in it -------------------------------------------------------------------------

    def _describe(self, node: Subject, sketch: _Sketch) -> None:
        values = {
            term: found for term, found in self.members.values(node).items() if term not in _UNSAID
        }
        targets = {
            term: [node for node in found if isinstance(node, Subject)]
            for term, found in values.items()
        }
        for term, others in targets.items():
            for other in others:
                self._follow(node, other, (term,), set())
            if term not in _OF_AN_EVENT:
                for other in others:
                    if other not in self.sketches:
                        sketch.lines.append((_called(term), self.phrases.say(other)))
        what, when = (targets.get(term, []) for term in _OF_AN_EVENT)
        if what or when:
            sketch.lines.append(("", self.phrases.event(what, when)))
        order = _order()
        last = len(order)
        # Quantities before ids and kinds.
        for term in sorted(
            values, key=lambda value: (not unit_of(value), order.get(local_name(value), last))
        ):
            shown = self._shown(node, term)
            if shown:
                phrase = Phrase(", ".join(shown), [(node, term)], [node])
                sketch.lines.append((property_label(term), phrase))
        # Searched parameters and phrases come first: they characterise this scenario.
        sketch.lines.sort(
            key=lambda line: line[1].nodes == [node] and not self.bindings.bound(line[1])
        )

    def _shown(self, node: Subject, term: ox.NamedNode) -> list[str]:
        found = self.members.values(node).get(term, ())
        return [value_text(item, unit_of(term)) for item in found if isinstance(item, ox.Literal)]

    def _follow(
        self, box: Subject, node: Subject, path: tuple[ox.NamedNode, ...], seen: set[Subject]
    ) -> None:
        """Link a box to those that a node reaches through individuals without a box."""
        if node in self.parameters or node in seen or node == box:
            return
        if node in self.sketches:
            links, label = self.sketches[box].links, _path_label(path)
            known = links.get(node)
            links[node] = label if known in (None, label) else f"{known}; {label}"
            return
        seen.add(node)
        for term, found in self.members.values(node).items():
            for item in found:
                if isinstance(item, Subject) and term != TYPE:
                    self._follow(box, item, (*path, term), seen)

    def _fact(self, label: str, phrase: Phrase, broken: Sequence[int]) -> Fact:
        bound = self.bindings.bound(phrase)
        names = {name for name, _ in bound}
        values = {(node.value, local_name(term)) for node, term in phrase.bound}
        wrong = any(
            violation.parameter in names
            if violation.parameter
            else any((iri, violation.property) in values for iri in violation.nodes)
            for violation in (self.violations[number] for number in broken)
        )
        return Fact(label, phrase.text, tuple(bound), wrong)

    # -- what is wrong with it -----------------------------------------------------------------

    @cached_property
    def _homes(self) -> tuple[dict[Subject, list[int]], list[int]]:
        """Each box's violations, and those that concern no box."""
        owners: dict[str, list[Subject]] = {}
        for box, sketch in self.sketches.items():
            about = {box} | {node for _, phrase in sketch.lines for node in phrase.nodes}
            # A parameter's violations are shown wherever it gives a value.
            named = {name for _, phrase in sketch.lines for name, _ in self.bindings.bound(phrase)}
            about |= {
                node for node, parameter in self.parameters.items() if parameter.name in named
            }
            for node in about:
                owners.setdefault(node.value, []).append(box)
        found: dict[Subject, list[int]] = {}
        homeless = []
        for number, violation in enumerate(self.violations):
            boxes = [box for iri in violation.nodes for box in owners.get(iri, ())]
            for box in dict.fromkeys(boxes):
                found.setdefault(box, []).append(number)
            if not boxes:
                homeless.append(number)
        return found, homeless

    # -- the boxes -----------------------------------------------------------------------------

    def _boxes(self) -> tuple[Box, ...]:
        made = {node: self._box(node, sketch) for node, sketch in self.sketches.items()}
        inside: dict[Subject, list[Box]] = {}
        for node, box in made.items():
            actor = self._actor(node)
            if actor is not None:
                inside.setdefault(actor, []).append(box)
        top = [
            replace(box, inside=tuple(sorted(inside.get(node, ()), key=_by_id)))
            for node, box in made.items()
            if self._actor(node) is None
        ]
        rank = {self.members.class_label(cls): k for k, cls in enumerate(tbox().subclasses)}
        last = len(rank)
        return tuple(
            sorted(top, key=lambda box: (box.layer, rank.get(box.cls, last), box.cls, _by_id(box)))
        )

    def _actor(self, node: Subject) -> Subject | None:
        """Return the participant whose box holds an event that has no layer of its own."""
        if self.members.layer(node) is not None:
            return None
        for item in self.members.values(node).get(bg("has_who"), ()):
            if isinstance(item, Subject) and self.members.layer(item) == _EVENTS_LAYER:
                return item
        return None

    def _box(self, node: Subject, sketch: _Sketch) -> Box:
        broken = tuple(self._homes[0].get(node, ()))
        facts = [self._fact(label, phrase, broken) for label, phrase in sketch.lines]
        telling = sum(
            bool(phrase.nodes != [node] or self.bindings.bound(phrase) or fact.wrong)
            for (_, phrase), fact in zip(sketch.lines, facts, strict=True)
        )
        links = sorted(sketch.links.items(), key=lambda link: _natural(self.ids[link[0]]))
        return Box(
            id=self.ids[node],
            name=self.members.name(node),
            cls=self.members.class_label(self.members.class_of(node)),
            layer=sketch.layer,
            facts=tuple(sorted(facts, key=lambda fact: not fact.wrong)),
            links=tuple(Link(label, self.ids[to]) for to, label in links),
            broken=broken,
            shown=max(telling, min(FEW, len(facts))),
        )


def _called(term: ox.NamedNode) -> str:
    return _CALLED.get(local_name(term)) or property_label(term)


def _path_label(path: Sequence[ox.NamedNode]) -> str:
    """Return the label of the first property on a path that is more than "has …", else the last."""
    names = [local_name(term) for term in path]
    labels = [tbox().labels.get(name, name) for name in names if name not in _CALLED]
    telling = [label for label in labels if not label.startswith("has ")]
    return telling[0] if telling else labels[-1].removeprefix("has ")


def _unique(nodes: Sequence[Subject]) -> dict[Subject, str]:
    """Return the end of each node's IRI, with a number where it is a duplicate."""
    found: dict[Subject, str] = {}
    used: set[str] = set()
    for node in nodes:
        name, number = local_name(node), 1
        while name in used:
            number += 1
            name = f"{local_name(node)} ({number})"
        used.add(name)
        found[node] = name
    return found


@cache
def _order() -> dict[str, int]:
    """Return the place of each property in the ontology."""
    return {name: place for place, name in enumerate(tbox().ranges)}


def _natural(text: str) -> list[tuple[int, str]]:
    """Return a key that sorts lane 2 before lane 10."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in _DIGITS.split(text)]


def _by_id(box: Box) -> list[tuple[int, str]]:
    return _natural(box.id)
