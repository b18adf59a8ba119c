"""Declaration of a model dataclass's XML form: once, for reader and writer alike.

Each field names the attribute or the child elements that it stands for; its Python type says
what may be in it. `plan` turns a class into the list of its fields.
"""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from functools import cache
from types import UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

DECORATION = "DECORATION"
"""The class attribute that marks a record without influence on driving.

One that cannot be read is left out, and an impossible value of an attribute that it may lack is
passed over; warnings say so.
"""

Role = Literal["attribute", "child", "children", "choice", "ids", "text"]
_REQUIRED = object()


@dataclass(frozen=True, slots=True)
class Form:
    """A field's form in XML.

    Attributes:
        role: an attribute; one child element; any number of them (a tuple); one of several
            elements told apart by their tags; whole numbers that children carry in ``id`` (a
            tuple); a child's text.
        path: the attribute's name, or the tags that lead from the element to the child.
        unit: of a number, for messages.
        low: smallest number allowed.
        above: the number must be greater than this.
        high: largest absolute value allowed.
        words: the texts allowed; empty allows all.
        least: fewest children allowed.
        fallback: what a missing or impossible value is read as, with a warning; None: that is an
            error.
        decoration: of children: one that cannot be read is left out, with a warning.
    """

    role: Role
    path: tuple[str, ...]
    unit: str = ""
    low: float | None = None
    above: float | None = None
    high: float | None = None
    words: tuple[str, ...] = ()
    least: int = 0
    fallback: Any = None
    decoration: bool = False


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a class of the model.

    Attributes:
        name: in Python.
        form: in XML.
        types: what a value may be: ``float``, ``int``, ``bool``, ``str``, or the child's class.
        tags: per tag of a choice, the class.
        required: a file must have it.
        default: what it is where the file has none.
    """

    name: str
    form: Form
    types: tuple[type, ...]
    tags: Mapping[str, type]
    required: bool
    default: Any


def attribute(
    name: str,
    *,
    default: Any = _REQUIRED,
    unit: str = "",
    low: float | None = None,
    above: float | None = None,
    high: float | None = None,
    words: tuple[str, ...] = (),
    fallback: Any = None,
) -> Any:
    """Declare an attribute; without ``default`` or ``fallback`` a file must have it."""
    form = Form("attribute", (name,), unit, low, above, high, words, fallback=fallback)
    return _field(form, default)


def child(path: str) -> Any:
    """Declare a child element that may be absent; ``path`` as in ``link/predecessor``."""
    return _field(Form("child", tuple(path.split("/"))), None)


def only_child(path: str, *, fallback: Any = None) -> Any:
    """Declare a child element that a file must have, if there is no ``fallback``."""
    return _field(Form("child", tuple(path.split("/")), fallback=fallback), _REQUIRED)


def children(path: str, *, least: int = 0, decoration: bool = False) -> Any:
    """Declare child elements of one tag, in the file's order, of which it must have ``least``."""
    return _field(Form("children", tuple(path.split("/")), least=least, decoration=decoration), ())


def choice() -> Any:
    """Declare exactly one child of the classes in the field's type, told apart by ``TAG``."""
    return _field(Form("choice", ()), _REQUIRED)


def ids(path: str) -> Any:
    """Declare children that carry nothing but a whole number ``id``."""
    return _field(Form("ids", tuple(path.split("/"))), ())


def text(path: str) -> Any:
    """Declare the text of a child that may be absent."""
    return _field(Form("text", tuple(path.split("/"))), None)


ID = Field("id", Form("attribute", ("id",)), (int,), {}, True, None)
"""The number that a child declared by `ids` carries."""


@cache
def plan(cls: type) -> tuple[Field, ...]:
    """Return the fields of a class of the model, in the order of the declaration."""
    hints = get_type_hints(cls)
    found = []
    for item in fields(cls):
        if "form" not in item.metadata:  # no part of a file
            continue
        form: Form = item.metadata["form"]
        types = _types(hints[item.name])
        found.append(
            Field(
                name=item.name,
                form=form,
                types=types,
                tags={kind.TAG: kind for kind in types} if form.role == "choice" else {},
                required=item.default is MISSING,
                default=None if item.default is MISSING else item.default,
            )
        )
    return tuple(found)


def _field(form: Form, default: Any) -> Any:
    metadata = {"form": form}
    if default is _REQUIRED:
        return field(metadata=metadata)
    return field(default=default, metadata=metadata)


def _types(hint: Any) -> tuple[Any, ...]:
    """Return the plain types of an annotation: of ``tuple[X, ...]``, ``X | None``, ``X | Y``."""
    if get_origin(hint) is tuple:
        return _types(get_args(hint)[0])
    if isinstance(hint, UnionType):
        return tuple(kind for kind in get_args(hint) if kind is not type(None))
    return (hint,)
