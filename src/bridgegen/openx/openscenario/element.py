"""How the model is declared: dataclass fields are the XML attributes and child elements.

One declaration serves reading, writing and checking. A field's annotation defines everything:

- an alias of ``values`` (``Double``, ``String``, …) or an enumeration: an attribute, whose XML name
  is the field's in camelCase;
- an ``Element`` class: a child of that tag; a union of classes: a choice of one of them;
- ``tuple[X, ...]``: any number of them, ``Annotated[…, AtLeast(1)]`` one or more;
- ``… | None``: optional;
- ``Annotated[X, Tag("StartTrigger")]``: the tag, where it is not the class's name, one for each
  class of a choice; ``Alias("…")``: another tag that files have for it;
- ``Annotated[X, OrInFiles(Y)]``: a file may have a ``Y`` there; `bridgegen.openx.openscenario.read`
  puts an ``X`` in its place;
- ``Annotated[X, BARE]``: what ``X`` holds may stand there without it, and is read as if in it;
- ``Annotated[X, ENTITY]`` and the like: the name of something that is declared elsewhere;
- ``Annotated[str, TEXT]``: the element's own text.
"""

import re
import sys
import types
import typing
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Annotated, Any, TypeVar, Union, cast, get_args, get_origin

from bridgegen.openx.openscenario.values import Expr, Kind, ParameterRef


@dataclass(frozen=True)
class Element:
    """An element of an OpenSCENARIO file.

    Attributes:
        line: where it stands in the file that it was read from, for messages; 0 if it was not
            read. Two elements are equal wherever they stand.
    """

    line: int = field(default=0, compare=False, repr=False, kw_only=True)


@dataclass(frozen=True)
class Tag:
    """The tag of a child, where it differs from its class's name."""

    name: str


@dataclass(frozen=True)
class AtLeast:
    """The least number of repeated children."""

    count: int


@dataclass(frozen=True)
class Range:
    """The range of a number: the standard's, or what is left of it by the meaning of the number.

    Attributes:
        low: the least.
        high: the greatest; `FINITE` where it may be any but infinite.
        above: whether ``low`` itself is outside.
    """

    low: float
    high: float = float("inf")
    above: bool = False


FINITE = sys.float_info.max
"""End of a range that excludes infinite values: of sizes, places and target speeds."""


FiniteDouble = Annotated[float | ParameterRef | Expr, Kind.DOUBLE, Range(-FINITE, FINITE)]


@dataclass(frozen=True)
class Alias:
    """Another tag of a child, which is read and never written."""

    name: str


@dataclass(frozen=True)
class OrInFiles:
    """A class that may stand for a child in a file, and does in no scenario that was read."""

    cls: type[Element]


class Meaning(StrEnum):
    """What a field means beyond its type."""

    TEXT = "the element's text"
    ENTITY = "the name of an entity"
    ROAD = "the id of a road"
    RAW = "as it stands, even where it begins with $"
    NAME = "the name of what it declares, with or without $"
    PARAMETER = "the name of a parameter, with or without $"
    VARIABLE = "the name of a variable, with or without $"
    MONITOR = "the name of a monitor, with or without $"
    BARE = "the children of the child may stand in its place"


TEXT, ENTITY, ROAD = Meaning.TEXT, Meaning.ENTITY, Meaning.ROAD
NAME = Meaning.NAME
PARAMETER, VARIABLE, MONITOR = Meaning.PARAMETER, Meaning.VARIABLE, Meaning.MONITOR
RAW, BARE = Meaning.RAW, Meaning.BARE
_DECLARED_NAMES = (NAME, PARAMETER, VARIABLE, MONITOR)


@dataclass(frozen=True)
class Attribute:
    """An XML attribute.

    Attributes:
        field: the dataclass field.
        name: in the file.
        kind: its data type; ``STRING`` for an enumeration.
        enum: the enumeration, if it is one.
        required: whether the element must have it.
        is_literal: whether it takes no reference to a parameter.
        takes_expressions: whether it takes ``${…}``.
        limits: the standard's range, if it gives one.
        means: what it names, if anything.
    """

    field: str
    name: str
    kind: Kind
    enum: type[StrEnum] | None
    required: bool
    is_literal: bool
    takes_expressions: bool
    limits: Range | None
    means: Meaning | None

    @property
    def is_entity(self) -> bool:
        """Whether it names an entity."""
        return self.means is ENTITY

    @property
    def is_declared_name(self) -> bool:
        """Whether it names a parameter, a variable or a monitor, which files do with ``$``, too."""
        return self.means in _DECLARED_NAMES


@dataclass(frozen=True)
class Child:
    """A child element, or a choice of them, or a list.

    Attributes:
        field: the dataclass field.
        options: tag → class, all that a file may have.
        tags: class → tag, all that the model may hold.
        at_least: how many there must be.
        many: whether there may be more than one.
        wrapper: the class that holds an option where the file has it bare.
    """

    field: str
    options: dict[str, type[Element]]
    tags: dict[type[Element], str]
    at_least: int
    many: bool
    wrapper: type[Element] | None = None

    def wrapped(self, element: Element) -> Element:
        """Return what the model holds for an element that a file has there."""
        if self.wrapper is None or isinstance(element, self.wrapper):
            return element
        (child,) = declaration(self.wrapper).children
        held: dict[str, Any] = {child.field: element, "line": element.line}
        return self.wrapper(**held)


@dataclass(frozen=True)
class Declaration:
    """What an element's class declares.

    Attributes:
        attributes: by XML name, in order.
        children: in the order that the standard prescribes.
        by_tag: tag → the child that it fills.
        text: the field of the element's text, if it has any.
    """

    attributes: dict[str, Attribute]
    children: tuple[Child, ...]
    by_tag: dict[str, Child]
    text: str | None


# The annotations are worked out when a class is first read or written: at import they would have to
# resolve classes that are declared further down, or in other modules.
_DECLARATIONS: dict[type[Element], Declaration] = {}


def declaration(cls: type[Element]) -> Declaration:
    """Return what a class declares, worked out from its annotations once.

    Raises:
        TypeError: an annotation that declares nothing.
    """
    found = _DECLARATIONS.get(cls)
    if found is None:
        found = _DECLARATIONS[cls] = _declare(cls)
    return found


def _declare(cls: type[Element]) -> Declaration:
    hints = typing.get_type_hints(cls, include_extras=True)
    attributes: dict[str, Attribute] = {}
    children: list[Child] = []
    text = None
    for item in fields(cls):
        if item.name in ("line", "left_hand"):  # no part of a file
            continue
        options, marks, many = _unfold(hints[item.name])
        required = type(None) not in options
        options = [option for option in options if option is not type(None)]
        kinds = [mark for mark in marks if isinstance(mark, Kind)]
        enums = [o for o in options if isinstance(o, type) and issubclass(o, StrEnum)]
        if TEXT in marks:
            text = item.name
        elif kinds or enums:
            limits = [mark for mark in marks if isinstance(mark, Range)]
            name = _camel_case(item.name)
            attributes[name] = Attribute(
                field=item.name,
                name=name,
                kind=kinds[0] if kinds else Kind.STRING,
                enum=enums[0] if enums else None,
                required=required,
                is_literal=ParameterRef not in options,
                takes_expressions=Expr in options,
                limits=limits[0] if limits else None,
                means=next((mark for mark in marks if isinstance(mark, Meaning)), None),
            )
        elif options and all(isinstance(o, type) and issubclass(o, Element) for o in options):
            children.append(_child(item.name, options, marks, many, required))
        else:
            raise TypeError(f"{cls.__name__}.{item.name} declares neither attribute nor child")
    by_tag = {tag: child for child in children for tag in child.options}
    return Declaration(attributes, tuple(children), by_tag, text)


def _child(
    field_name: str, options: list[type[Element]], marks: list[Any], many: bool, required: bool
) -> Child:
    tags = [mark.name for mark in marks if isinstance(mark, Tag)]
    names = tags if tags else [option.__name__ for option in options]
    by_name = dict(zip(names, options, strict=True))
    by_name |= {mark.cls.__name__: mark.cls for mark in marks if isinstance(mark, OrInFiles)}
    # Before the aliases come in: those are read and never written.
    by_class = {cls: tag for tag, cls in by_name.items()}
    by_name |= {mark.name: options[0] for mark in marks if isinstance(mark, Alias)}
    wrapper = options[0] if BARE in marks else None
    if wrapper is not None:
        by_name |= declaration(wrapper).children[0].options
    counts = [mark.count for mark in marks if isinstance(mark, AtLeast)]
    at_least = counts[0] if counts else int(required and not many)
    return Child(field_name, by_name, by_class, at_least, many, wrapper)


def _unfold(hint: Any) -> tuple[list[Any], list[Any], bool]:
    """Return an annotation's alternatives, its marks, and whether it is a tuple of any length."""
    origin = get_origin(hint)
    if origin is typing.Annotated:
        base, *marks = get_args(hint)
        options, inner, many = _unfold(base)
        return options, [*marks, *inner], many
    if origin in (Union, types.UnionType):
        parts = [_unfold(arg) for arg in get_args(hint)]
        return (
            [option for options, _, _ in parts for option in options],
            [mark for _, marks, _ in parts for mark in marks],
            any(many for _, _, many in parts),
        )
    if origin is tuple:
        options, marks, _ = _unfold(get_args(hint)[0])
        return options, marks, True
    return [hint], [], False


def _camel_case(name: str) -> str:
    return re.sub(r"_([a-z0-9])", lambda match: match[1].upper(), name.rstrip("_"))


def children_of(element: Element) -> Iterator[tuple[str, Element]]:
    """Yield an element's children with their tags, in the standard's order."""
    for child in declaration(type(element)).children:
        value = getattr(element, child.field)
        for item in value if child.many else () if value is None else (value,):
            yield child.tags[type(item)], item


def is_wrapper(element: Element, child: Element) -> bool:
    """Return whether what a child of an element holds may stand there without the child."""
    wrappers = (item.wrapper for item in declaration(type(element)).children)
    return any(wrapper is not None and isinstance(child, wrapper) for wrapper in wrappers)


def walk(element: Element) -> Iterator[Element]:
    """Yield an element and all below it, parents first."""
    yield element
    for _, child in children_of(element):
        yield from walk(child)


def values_of(element: Element) -> Iterator[tuple[Attribute, Any]]:
    """Yield an element's attributes that are present, with their values."""
    for attribute in declaration(type(element)).attributes.values():
        value = getattr(element, attribute.field)
        if value is not None:
            yield attribute, value


E = TypeVar("E", bound=Element)


def rewritten(element: E, change: Callable[[Element], Element]) -> E:
    """Return an element in which all below it, and then itself, are what ``change`` makes of them.

    Args:
        element: stays as it is.
        change: takes an element and returns one of the same class.
    """
    changes: dict[str, Any] = {}
    for child in declaration(type(element)).children:
        value = getattr(element, child.field)
        if child.many:
            changes[child.field] = tuple(rewritten(item, change) for item in value)
        elif value is not None:
            changes[child.field] = rewritten(value, change)
    return cast(E, change(replace(element, **changes)))


def references(element: Element) -> frozenset[str]:
    """Return the names of all parameters that an element and all below it refer to."""
    return frozenset(
        name
        for node in walk(element)
        for _, value in values_of(node)
        if isinstance(value, ParameterRef | Expr)
        for name in value.names
    )
