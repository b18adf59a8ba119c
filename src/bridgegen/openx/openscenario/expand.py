"""From a scenario file that refers elsewhere to a scenario that stands by itself.

All of it happens in this one place, when a file is read, so that users of a scenario meet

- no ``CatalogReference``: the entry stands there, with the parameters that it was given;
- no parameters but the scenario's own, declared with a literal; all others are what they stand for
  (see ``scopes``), but where an action or a condition names one it is made one of the scenario's;
- no ``EntitySelection``: its members stand wherever there may be several entities;
- no entity within another: a trailer is one of its own (see ``towing``).

Elements from a catalogue are marked in their lines (`catalogs.CatalogLine`).
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, cast

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.openx.openscenario.catalogs import Catalogs, NoEntryError
from bridgegen.openx.openscenario.declarations import (
    CatalogLocations,
    CatalogReference,
    ParameterDeclaration,
    ParameterDeclarations,
)
from bridgegen.openx.openscenario.element import (
    PARAMETER,
    Child,
    Element,
    declaration,
    rewritten,
    values_of,
    walk,
)
from bridgegen.openx.openscenario.entities import (
    Entities,
    EntityRef,
    ExternalObjectReference,
    MiscObject,
    Pedestrian,
    ScenarioObject,
    Trailer,
    Vehicle,
)
from bridgegen.openx.openscenario.enumerations import ObjectType
from bridgegen.openx.openscenario.pruning import without
from bridgegen.openx.openscenario.reader import shorten
from bridgegen.openx.openscenario.scopes import Binding, Scope, is_made, reads_as_number
from bridgegen.openx.openscenario.storyboard import InitActions, OpenScenario
from bridgegen.openx.openscenario.values import Expr, Kind, Value
from bridgegen.openx.xml import MAX_DEPTH

# --- Several entities under one name, replaced by their names wherever there may be several ---


_KINDS: dict[type[Element], ObjectType] = {
    Vehicle: ObjectType.VEHICLE,
    Pedestrian: ObjectType.PEDESTRIAN,
    MiscObject: ObjectType.MISCELLANEOUS,
    ExternalObjectReference: ObjectType.EXTERNAL,
}


def without_selections(scenario: OpenScenario) -> OpenScenario:
    """Return a scenario in which the members of each selection stand for it.

    They do wherever an element lists entities, and as actors of initial actions. Elsewhere the
    name stays, and refers to no entity.
    """
    selections = scenario.entities.entity_selections
    if not selections:
        return scenario
    objects = scenario.entities.scenario_objects
    members: dict[Any, tuple[Any, ...]] = {}
    for selection in selections:
        found: dict[Any, None] = {}
        for member in selection.members.members:
            if isinstance(member, EntityRef):
                found |= dict.fromkeys(members.get(member.entity_ref, (member.entity_ref,)))
            else:
                found |= dict.fromkeys(_of_kind(objects, member.object_type))
        members[selection.name] = tuple(found)

    def change(element: Element) -> Element:
        if isinstance(element, InitActions):
            privates = tuple(
                replace(private, entity_ref=name)
                for private in element.privates
                for name in members.get(private.entity_ref, (private.entity_ref,))
            )
            return replace(element, privates=privates)
        refs = getattr(element, "entity_refs", None)
        if refs is None:
            return element
        several: tuple[EntityRef, ...] = tuple(
            replace(ref, entity_ref=name)
            for ref in refs
            for name in members.get(ref.entity_ref, (ref.entity_ref,))
        )
        changes: dict[str, Any] = {"entity_refs": several}
        return replace(element, **changes)

    made = rewritten(scenario, change)
    return replace(made, entities=Entities(made.entities.scenario_objects))


def _of_kind(objects: tuple[ScenarioObject, ...], kind: Any) -> list[Any]:
    return [obj.name for obj in objects if _KINDS[type(obj.entity_object)] == kind]


# --- Vehicles that tow others: each trailer an entity of its own ---


def with_trailers_apart(scenario: OpenScenario) -> OpenScenario:
    """Return a scenario in which no vehicle contains another: it names the one that it tows.

    The trailers stand behind all other entities. One keeps its name unless another entity has it;
    then its towing vehicle's stands before it ("Lorry.trailer").
    """
    objects = scenario.entities.scenario_objects
    if not any(_towed(obj) for obj in objects):
        return scenario
    taken = {str(obj.name) for obj in objects}
    apart: list[ScenarioObject] = []
    trailers: list[ScenarioObject] = []
    for obj in objects:
        first, *others = _uncoupled(obj, taken)
        apart.append(first)
        trailers += others
    entities = Entities((*apart, *trailers), scenario.entities.entity_selections)
    return replace(scenario, entities=entities)


def _towed(scenario_object: ScenarioObject) -> ScenarioObject | None:
    """Return the trailer that an entity contains, if it contains one."""
    vehicle = scenario_object.entity_object
    if not isinstance(vehicle, Vehicle) or vehicle.trailer is None:
        return None
    inner = vehicle.trailer.trailer
    return inner if isinstance(inner, ScenarioObject) else None


def _uncoupled(scenario_object: ScenarioObject, taken: set[str]) -> Iterator[ScenarioObject]:
    """Yield an entity, and those that it tows, one behind the other."""
    inner, vehicle = _towed(scenario_object), scenario_object.entity_object
    if inner is None:
        yield scenario_object
        return
    assert isinstance(vehicle, Vehicle)
    assert vehicle.trailer is not None
    name, number = str(inner.name), 1
    while name in taken:
        name = f"{scenario_object.name}.{inner.name}" + (f"_{number}" if number > 1 else "")
        number += 1
    taken.add(name)
    named = Trailer(EntityRef(name, line=inner.line), line=vehicle.trailer.line)
    yield replace(scenario_object, entity_object=replace(vehicle, trailer=named))
    yield from _uncoupled(replace(inner, name=name), taken)


# Entries may name entries, each several others: a few lines of XML can stand for any number of
# elements. Depth alone does not bound that.
MAX_ELEMENTS = 200_000
"""Largest number of elements from catalogues, counted wherever they are put."""

_DECLARED = "parameter_declarations"

E = TypeVar("E", bound=Element)


def expanded(
    file: OpenScenario,
    folder: Path | None,
    place: str,
    skipped: list[str] | None = None,
    warnings: list[str] | None = None,
) -> OpenScenario:
    """Return a scenario that stands by itself.

    Args:
        file: as `bridgegen.openx.openscenario.read.verbatim` returns it.
        folder: of the file, from which its catalogues' paths count; None if it has none.
        place: what to call it in messages.
        skipped: as of `bridgegen.openx.openscenario.read.read`.
        warnings: likewise.

    Raises:
        FileFormatError: parameters that are malformed or do not fit; catalogues or entries that
            are not there, or that go round in circles; all of it at once.
        UnsupportedError: an entry holds what this version does not know.
    """
    # Most files refer to nothing, and their elements are then not built a second time.
    if any(map(_refers, walk(file))):
        file = _Expander(file, folder, place, skipped, warnings).result()
    # Last, because selections and trailers may come from catalogues.
    return with_trailers_apart(without_selections(file))


def _refers(element: Element) -> bool:
    """Return whether an element makes a file one that does not stand by itself."""
    if isinstance(element, ParameterDeclaration):
        return is_made(element) or reads_as_number(element)
    if getattr(element, _DECLARED, None) is not None:
        return not isinstance(element, OpenScenario)
    return isinstance(element, CatalogReference) or any(
        isinstance(value, Expr) and attribute.kind is Kind.BOOLEAN
        for attribute, value in values_of(element)
    )


class _Expander:
    """Goes down a file with the parameters in scope."""

    def __init__(
        self,
        file: OpenScenario,
        folder: Path | None,
        place: str,
        skipped: list[str] | None,
        warnings: list[str] | None,
    ) -> None:
        self._warnings = warnings
        self._file, self._place = file, place
        self._problems: list[tuple[int, str]] = []
        self._elsewhere: list[str] = []
        self._unsupported: list[str] = []
        declared = file.parameter_declarations
        self._declared = () if declared is None else declared.parameters
        self._skipped = skipped
        self._scope = Scope.of_scenario(self._declared, self)
        self._named: dict[int, tuple[Binding, ParameterDeclaration]] = {}
        self._open: list[Element] = []
        self._missing: list[CatalogReference] = []
        self._elements = 0
        # A document without a path has no folder, so nothing that it names can be opened.
        self._catalogs = None if folder is None else self._of(folder, skipped)

    def _of(self, folder: Path, skipped: list[str] | None) -> Catalogs:
        """Return the catalogues by the scenario's own parameters."""
        locations = self._element(self._file.catalog_locations, self._scope, 0)
        return Catalogs(locations, folder, skipped)

    def wrong(self, element: Element, text: str) -> None:
        """Note what is wrong at an element."""
        self._problems.append((element.line, text))

    def doubtful(self, element: Element, text: str) -> None:
        """Note what is wrong and can be made sense of, if that is wanted."""
        if self._skipped is None:
            self.wrong(element, text)
        elif (said := f"{self._place}: {text} (line {element.line})") not in self._skipped:
            self._skipped.append(said)

    def odd(self, element: Element, text: str) -> None:
        """Note what harms nothing unless it is used."""
        said = f"{self._place}: {text} (line {element.line})"
        if self._warnings is not None and said not in self._warnings:
            self._warnings.append(said)

    def result(self) -> OpenScenario:
        """Return the scenario, or raise all problems."""
        made = self._element(replace(self._file, parameter_declarations=None), self._scope, 0)
        made = self._without_missing(made)
        if self._problems or self._elsewhere:
            problems = sorted(dict.fromkeys(self._problems), key=lambda problem: int(problem[0]))
            texts = [f"{self._place}: {text} (line {line})" for line, text in problems]
            raise FileFormatError(*shorten([*texts, *dict.fromkeys(self._elsewhere)]))
        if self._unsupported:
            raise UnsupportedError(*shorten(list(dict.fromkeys(self._unsupported))))
        own = (
            parameter_declaration
            for parameter_declaration in self._declared
            if parameter_declaration.name in self._scope.own
        )
        # Only the scenario's own parameters stay, for they are what a search varies. A parameter
        # made of others is put in its place as a formula, not as a value, so that it varies with
        # them.
        literal = {
            parameter_declaration.name: self._scope.constrained(parameter_declaration)
            for parameter_declaration in own
        }
        declarations = (
            *literal.values(),
            *(parameter_declaration for _, parameter_declaration in self._named.values()),
        )
        return replace(
            made,
            parameter_declarations=ParameterDeclarations(declarations) if declarations else None,
            catalog_locations=CatalogLocations(),
        )

    def _without_missing(self, scenario: OpenScenario) -> OpenScenario:
        """Return a scenario without what catalogues lack, and what that is part of.

        Without its ego, which is the entity of that name or else the first, it would be another.
        """
        left = without(scenario, self._missing)
        names = [str(obj.name) for obj in scenario.entities.scenario_objects]
        # `min` keeps the first of equals: the ego by name, else the first entity.
        ego = min(names, key=lambda name: name.lower() != "ego", default="")
        kept = {str(obj.name) for obj in left.entities.scenario_objects}
        for reference in self._missing:
            if (names and ego not in kept) or any(node is reference for node in walk(left)):
                self.wrong(reference, f"'{reference.entry_name}' cannot be left out")
        return left

    def _element(
        self, element: E, scope: Scope, depth: int, assigned: dict[str, Value] | None = None
    ) -> E:
        """Return an element in which nothing refers to anything but the scenario's parameters."""
        # Counted in entries alone: the file itself is bounded by its size.
        if self._open:
            self._elements += 1
        changes: dict[str, Any] = {}
        declared = getattr(element, _DECLARED, None)
        if declared is not None:
            scope = scope.inner(declared.parameters, self, assigned)
            changes[_DECLARED] = None
        for attribute, value in values_of(element):
            try:
                made = scope.value(attribute, value)
            except FileFormatError as error:
                what = f"{attribute.name} of {type(element).__name__}"
                self.wrong(element, f"{what} {error}")
                continue
            if attribute.means is PARAMETER and value in scope.names:
                made = self._name(scope.names[value])
            if made is not value:
                changes[attribute.field] = made
        for child in declaration(type(element)).children:
            held = getattr(element, child.field)
            if child.field == _DECLARED or held is None:
                continue
            if child.many:
                new = tuple(self._child(candidate, child, scope, depth + 1) for candidate in held)
                if any(a is not b for a, b in zip(new, held, strict=True)):
                    changes[child.field] = new
            elif (item := self._child(held, child, scope, depth + 1)) is not held:
                changes[child.field] = None if _is_no_trailer(item) else item
        return replace(element, **changes) if changes else element

    def _child(self, element: Element, child: Child, scope: Scope, depth: int) -> Element:
        if not isinstance(element, CatalogReference):
            return self._element(element, scope, depth)
        try:
            return self._entry(element, child, scope, depth)
        except UnsupportedError as error:
            self._unsupported += error.problems
        except NoEntryError as error:
            for problem in error.problems:
                self.doubtful(element, problem)
            if self._skipped is not None:
                self._missing.append(element)
        except FileFormatError as error:
            self._elsewhere += error.problems
        return element

    def _entry(
        self, reference: CatalogReference, child: Child, scope: Scope, depth: int
    ) -> Element:
        """Return an entry of a catalogue with the parameters that it is given.

        Raises:
            NoEntryError: it is not there, it holds itself, or too much is.
        FileFormatError: a catalogue's file is malformed.
            UnsupportedError: it holds what this version does not know.
        """
        if self._catalogs is None:
            raise UnsupportedError(
                f"{self._place}: a CatalogReference in a document that has no path is not "
                f"supported (line {reference.line})"
            )
        attributes = declaration(CatalogReference).attributes
        try:
            catalog = scope.text(attributes["catalogName"], reference.catalog_name)
            name = scope.text(attributes["entryName"], reference.entry_name)
            assigned = self._assigned(reference, scope)
        except FileFormatError as error:
            raise NoEntryError(
                *(f"CatalogReference {problem}" for problem in error.problems)
            ) from None
        entry = self._catalogs.entry(catalog, name, child.tags)
        # By identity: two entries of equal contents are two.
        if any(entry is element for element in self._open):
            raise NoEntryError(f"catalogue '{catalog}': the entry '{name}' holds itself")
        # The bound of a file's own depth, for what stands in it may come from elsewhere.
        if depth + _height(entry) > MAX_DEPTH:
            raise NoEntryError(
                f"catalogue '{catalog}': with the entry '{name}' elements nest more than "
                f"{MAX_DEPTH} deep"
            )
        if self._elements > MAX_ELEMENTS:
            raise NoEntryError(
                f"catalogue '{catalog}': entries may add {MAX_ELEMENTS} elements, there are more"
            )
        declared = getattr(entry, _DECLARED, None)
        known = (
            {parameter.name for parameter in declared.parameters} if declared is not None else set()
        )
        # A warning and no error: files of others do it (three of esmini's examples), and nothing
        # depends on it.
        for unknown in sorted(assigned.keys() - known):
            self.odd(
                reference,
                f"catalogue '{catalog}': the entry '{name}' has no parameter '{unknown}'",
            )
        self._open.append(entry)
        try:
            return self._element(entry, scope, depth, assigned)
        finally:
            self._open.pop()

    def _assigned(self, reference: CatalogReference, scope: Scope) -> dict[str, Value]:
        """Return the values that an entry gets, by the scenario's own parameters."""
        given = reference.parameter_assignments
        return {
            assignment.parameter_ref: scope.value(attribute, value)
            for assignment in (() if given is None else given.assignments)
            for attribute, value in values_of(assignment)
            if attribute.field == "value"
        }

    def _name(self, bound: Binding) -> str:
        """Return the name that a parameter has among the scenario's own."""
        name = bound.declaration.name
        if self._scope.own.get(name) is bound:
            return name
        if id(bound) not in self._named:
            taken = {
                *self._scope.own,
                *(parameter_declaration.name for _, parameter_declaration in self._named.values()),
            }
            number, free = 1, name
            while free in taken:
                number += 1
                free = f"{name}_{number}"
            self._named[id(bound)] = bound, replace(bound.declaration, name=free)
        return self._named[id(bound)][1].name


def _is_no_trailer(element: Element) -> bool:
    """Return whether a parameter, meant for the trailer's name, is left empty."""
    if not isinstance(element, Trailer) or not isinstance(element.trailer, EntityRef):
        return False
    return element.trailer.entity_ref == ""


def _height(element: Element) -> int:
    below = [
        _height(item)
        for child in declaration(type(element)).children
        for item in _held(element, child)
    ]
    return 1 + max(below, default=0)


def _held(element: Element, child: Child) -> tuple[Element, ...]:
    held = getattr(element, child.field)
    return cast(tuple[Element, ...], held if child.many else () if held is None else (held,))
