"""Reads operational design domains in ASAM OpenODD 1.0's YAML: taxonomy, modules, imports.

Source: ASAM OpenODD 1.0.0 (2025-04-03), chapter 10 (YAML), sections 6.4.3 (semantics of modules)
and 10.4.5 (expressions). What the standard leaves open is read as openodd-py 0.13 does: root
modules must all hold, literals that ranges define are ordered as written, and a value that is
missing puts nothing outside.
"""

import hashlib
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.scenario.language.parameters import nearest
from bridgegen.scenario.language.plain_yaml import MAX_BYTES, MAX_DEPTH, Document, read_plain_yaml

MAX_FILES = 32
MAX_LINE = 4000
"""Most characters of a line: a run's settings take no longer text."""

_TOP = ("IMPORT", "TAXONOMY", "MODULES", "MODULE", "ODD", "COD", "OD", "METADATA", "conversion")
_SECTIONS = ("INCLUDE_AND", "INCLUDE_OR", "EXCLUDE_AND", "EXCLUDE_OR")
_OF_MODULE = (
    *_SECTIONS, "TITLE", "DESCRIPTION", "COMMENT", "ACTIVE", "LABEL", "LABELS", "TAGS", "TAG",
    "KIND", "METADATA",
)  # fmt: skip
UNKNOWN = ("unknown", "none", "null", "undefined")

_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_UNIT = r"([^\s\d.\[\]$*][^\s$*]*)?"
_BOUND = re.compile(rf"(>=|<=|>|<)\s*({_NUMBER})\s*{_UNIT}")
_RANGE = re.compile(rf"\[\s*({_NUMBER})\s*(?:\.\.|,)\s*({_NUMBER})\s*\]\s*{_UNIT}")
_EQUAL = re.compile(rf"({_NUMBER})\s*{_UNIT}")
_ORDERED = re.compile(r"(>=|<=|>|<)\s*([A-Za-z_][\w.+-]*)")
_PARAMETRIC = re.compile(r"[$*]|\.\.")
# What the standard's own examples have and YAML does not: expressions that begin with an operator,
# literals that are truth values as keys, and more than one group of a kind in a section.
_UNQUOTED = re.compile(
    r"^(\s*(?:- )?[^\s#'\":][^#'\":]*:\s+)((?:[<>]=?)\s*[^\s#'\"][^#]*?)(\s+#.*)?$"
)
_LITERAL_KEY = re.compile(r"^(\s+)(true|false|null)(\s*:)", re.IGNORECASE)
_GROUP = re.compile(r"^(\s+(?:- )?)(AND|OR)(\s*:)")

_TYPES = ("float", "double", "integer", "long", "boolean", "shapefile", "string")


@dataclass(frozen=True)
class Condition:
    """What is asked of an attribute.

    Attributes:
        concept: its name, as the file writes it.
        text: the expression, as the file writes it.
        values: of which it is one; empty: it lies in an interval.
        low: of the interval, inclusive unless ``above``.
        high: likewise, unless ``below``.
        above: whether low is outside.
        below: whether high is outside.
        unit: of numbers; "" where the file names none.
        missing: whether it is asked to be missing, or may be.
        problem: why it cannot be judged; "" where it can.
    """

    concept: str
    text: str
    values: tuple[str, ...] = ()
    low: float = -math.inf
    high: float = math.inf
    above: bool = False
    below: bool = False
    unit: str = ""
    missing: bool = False
    problem: str = ""

    @property
    def name(self) -> str:
        """Attribute and expression: ``speed_limit <= 60 km/h``."""
        sign = "" if self.text[:1] in "<>" else "= "
        return f"{self.concept} {sign}{self.text}"


@dataclass(frozen=True)
class Group:
    """Formulas that are joined.

    Attributes:
        sign: "and", "or"; "not" of one formula.
        parts: the formulas.
    """

    sign: str
    parts: "tuple[Condition | Group, ...]"


@dataclass(frozen=True)
class Odd:
    """An operational design domain.

    Attributes:
        name: of its file, without its ending.
        title: of its first root module; its name where it has none.
        path: of its file, as found.
        files: the lines of each file that it was read from, by name; its own first.
        formula: what a situation inside keeps.
        taxonomy: for each concept of the taxonomy, by name: its literals, each with the formula
            that defines it if there is one; a text for what is no category.
        conversions: further units: by type of unit and unit, factor and offset from another unit.
        notes: what is not read of its files.
    """

    name: str
    title: str
    path: str
    files: Mapping[str, tuple[str, ...]] = field(repr=False)
    formula: "Condition | Group" = field(repr=False)
    taxonomy: "Mapping[str, str | Mapping[str, Condition | Group | None]]" = field(repr=False)
    conversions: Mapping[str, Mapping[str, tuple[str, float, float]]] = field(repr=False)
    notes: tuple[str, ...] = ()

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the contents of all its files."""
        lines = (line for name in sorted(self.files) for line in (name, *self.files[name]))
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All that it asks, in the order of its files."""
        return tuple(dict.fromkeys(_conditions(self.formula)))

    def to_record(self) -> dict[str, Any]:
        """Return it as JSON's types: what a run keeps of it."""
        files = {name: list(lines) for name, lines in self.files.items()}
        return {"path": self.path, "sha256": self.digest, "files": files}


def read_odd(path: Path | str) -> Odd:
    """Read an ODD's file, and those beside it that it imports.

    Raises:
        FileFormatError: no OpenODD 1.0, or one that contradicts itself; all that was found.
        InputError: a file is missing.
    """
    path = Path(path)
    files: dict[str, tuple[str, ...]] = {}
    documents: list[Document] = []
    notes: list[str] = []
    waiting = [path.name]
    while waiting:
        name = waiting.pop(0)
        if name in files:
            continue
        if len(files) == MAX_FILES:
            raise FileFormatError(f"an ODD may have {MAX_FILES} files ({path})")
        text = _text(path.parent / name, path.parent)
        files[name] = tuple(text.splitlines())
        documents.append(_document(files[name], name))
        for other in _imports(documents[-1]):
            if Path(other).suffix.lower() in (".yaml", ".yml"):
                waiting.append(other)
            else:
                notes.append(f"{other} is not read")
    return _odd(str(path.resolve()), files, documents, notes)


def odd_of(record: Mapping[str, Any]) -> Odd:
    """Return an ODD of what `Odd.to_record` returns.

    Raises:
        FileFormatError: it is damaged.
    """
    try:
        files = {str(name): tuple(map(str, lines)) for name, lines in record["files"].items()}
        found = _odd(str(record["path"]), files, [_document(v, k) for k, v in files.items()], [])
        if found.digest != record["sha256"]:
            raise ValueError("its digest is another one")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise FileFormatError(f"a recorded ODD is damaged: {error}") from None
    return found


def odd_in(document: Document) -> Odd:
    """Return the ODD of the sections of a module, as a scenario file states them.

    Raises:
        FileFormatError: it is none; all that was found.
    """
    root = ("ODD", "ego")
    lines = {(*root, *path): line for path, line in document.lines.items()}
    module = Document({"ODD": {"ego": document.data}}, lines, document.place)
    return _odd(document.place, {}, [module], [])


def _text(path: Path, folder: Path) -> str:
    # A strangers' ODD names files: none outside its folder is read, by whatever link.
    if not path.resolve().is_relative_to(folder.resolve()):
        raise FileFormatError(f"an ODD imports files beside it only, got {path}")
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
        text = data.decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise FileFormatError(f"not UTF-8 at byte {error.start} ({path})") from None
    if len(data) > MAX_BYTES or any(len(line) > MAX_LINE for line in text.splitlines()):
        raise FileFormatError(f"a file has {MAX_BYTES} bytes, a line {MAX_LINE} at most ({path})")
    return text


def _document(lines: tuple[str, ...], place: str) -> Document:
    read = []
    for number, line in enumerate(lines, 1):
        line = _LITERAL_KEY.sub(r'\1"\2"\3', _GROUP.sub(rf"\1\2@{number}\3", line))
        if found := _UNQUOTED.match(line):
            quoted = found[2].strip().replace("\\", "\\\\")
            # '>-', '>+' and a sole '>' begin a block of text
            if quoted.strip("<>=+-0123456789 "):
                line = f'{found[1]}"{quoted}"{found[3] or ""}'
        read.append(line)
    return read_plain_yaml("\n".join(read).encode(), place)


def _imports(document: Document) -> list[str]:
    given = document.data.get("IMPORT") if isinstance(document.data, dict) else None
    names = given if isinstance(given, list) else [given] if given is not None else []
    if wrong := [name for name in names if not isinstance(name, str) or "\0" in name]:
        raise FileFormatError(f"IMPORT names files, got {wrong[0]!r} ({document.at(('IMPORT',))})")
    return [str(name) for name in names]


class _Problems(list[str]):
    def at(self, document: Document, path: tuple[str | int, ...], problem: str) -> None:
        self.append(f"{problem} ({document.at(path)})")


def _odd(
    path: str, files: dict[str, tuple[str, ...]], documents: list[Document], notes: list[str]
) -> Odd:
    problems = _Problems()
    taxonomy: dict[str, Any] = {}
    modules: dict[str, tuple[Document, str, dict[str, Any]]] = {}
    conversions: dict[str, dict[str, tuple[str, float, float]]] = {}
    for document in documents:
        data = document.data
        if not isinstance(data, dict) or not data.keys() & set(_TOP):
            known = ", ".join(_TOP[:5])
            problems.at(document, (), f"an OpenODD 1.0 file has one of {known}")
            continue
        for key in data.keys() - set(_TOP):
            what = f"'{key}' is no part of an OpenODD 1.0 file"
            problems.at(document, (key,), f"{what}; known: {', '.join(_TOP)}{nearest(key, _TOP)}")
        if isinstance(given := data.get("TAXONOMY"), dict):
            taxonomy |= _concepts(given)
        conversions |= _conversions(data.get("conversion"), document, problems)
        for key in ("MODULES", "MODULE", "ODD"):
            given = data.get(key) or {}
            if not isinstance(given, dict):
                problems.at(document, (key,), f"{key} is a mapping of modules")
                continue
            for name, body in given.items():
                if name in modules:
                    problems.at(document, (key, name), f"the module '{name}' is there twice")
                if not isinstance(body, dict):
                    problems.at(document, (key, name), f"the module '{name}' is a mapping")
                    continue
                modules[name] = document, key, body
    if problems:
        raise FileFormatError(*problems)
    if not modules:
        raise FileFormatError(f"an ODD needs a module, under ODD or MODULES ({documents[0].place})")
    return _Modules(taxonomy, modules, problems).odd(path, files, conversions, notes)


def _concepts(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the leaves of a taxonomy by name; of a category its literals, with what defines it."""
    found: dict[str, Any] = {}
    for name, value in given.items():
        if isinstance(value, list):
            found[name] = {_word(item): None for item in value}
        elif isinstance(value, dict):
            # Literals are defined by expressions of one and the same concept; a record holds types.
            keys = {tuple(item) if isinstance(item, dict) else () for item in value.values()}
            by_range = len(keys) == 1 and len(next(iter(keys))) == 1
            leaves = [each for item in value.values() if by_range for each in item.values()]
            if by_range and not any(isinstance(each, dict) or _is_type(each) for each in leaves):
                found[name] = dict(value)
            else:
                found |= {name: "record"} | _concepts(value)
        else:
            found[name] = str(value)
    return found


def _is_type(value: Any) -> bool:
    return isinstance(value, str) and value.partition(" ")[0] in _TYPES


def _conversions(given: Any, document: Document, problems: _Problems) -> dict[str, Any]:
    found: dict[str, dict[str, tuple[str, float, float]]] = {}
    try:
        for kind, bases in (given or {}).items():
            for base, units in bases.items():
                for unit, law in units.items():
                    scale, offset = float(law["scale"]), float(law.get("offset", 0.0))
                    if not (math.isfinite(scale) and scale and math.isfinite(offset)):
                        raise ValueError
                    found.setdefault(kind, {})[unit] = base, scale, offset
    except (AttributeError, KeyError, TypeError, ValueError):
        problems.at(document, ("conversion",), "conversion reads TYPE: UNIT: UNIT: scale, offset")
    return found


def _word(value: Any) -> str:
    """Return a literal as text: a truth value as OpenODD writes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


@dataclass
class _Modules:
    """Makes formulas of modules."""

    taxonomy: dict[str, Any]
    modules: dict[str, tuple[Document, str, dict[str, Any]]]
    problems: _Problems
    referred: set[str] = field(default_factory=set)

    def odd(
        self,
        path: str,
        files: dict[str, tuple[str, ...]],
        conversions: Mapping[str, Any],
        notes: list[str],
    ) -> Odd:
        """Return what the modules say together."""
        self.labels: dict[str, list[str]] = {}
        for name, (_, _, body) in self.modules.items():
            for key in ("LABEL", "LABELS"):
                given = body.get(key) or []
                for label in [given] if isinstance(given, str) else given:
                    self.labels.setdefault(str(label), []).append(name)
        self.made: dict[str, Condition | Group] = {}
        for name in self.modules:
            self._module(name, ())
        of_odd = [name for name, (_, key, _) in self.modules.items() if key == "ODD"]
        roots = [
            name
            for name in of_odd or self.modules
            if name not in self.referred and self._is_active(name)
        ]
        if not roots and not self.problems:
            self.problems.append(f"no active module is a root: others refer to each ({path})")
        literals = {
            name: value
            if isinstance(value, str)
            else {
                literal: None
                if conditions is None
                else Group("and", tuple(_condition(*item) for item in conditions.items()))
                for literal, conditions in value.items()
            }
            for name, value in self.taxonomy.items()
        }
        if self.problems:
            raise FileFormatError(*self.problems)
        title = str(self.modules[roots[0]][2].get("TITLE") or Path(path).stem)
        formula = Group("and", tuple(self.made[name] for name in roots))
        if not any(True for _ in _conditions(formula)):
            raise FileFormatError(f"the ODD is empty: it asks nothing ({path})")
        stem = Path(path).stem
        return Odd(stem, title, path, files, formula, literals, conversions, tuple(notes))

    def _is_active(self, name: str) -> bool:
        return self.modules[name][2].get("ACTIVE") is not False

    def _module(self, name: str, inside: tuple[str, ...]) -> "Condition | Group":
        if name in self.made:
            return self.made[name]
        document, key, body = self.modules[name]
        path = (key, name)
        if len(inside) > MAX_DEPTH:
            self.problems.at(document, path, f"modules may refer {MAX_DEPTH} deep")
            return Group("and", ())
        if name in inside:
            cycle = " → ".join((*inside[inside.index(name) :], name))
            self.problems.at(document, path, f"modules refer to each other: {cycle}")
            return Group("and", ())
        for each in body.keys() - set(_OF_MODULE):
            hint = nearest(each, _OF_MODULE)
            self.problems.at(document, (*path, each), f"'{each}' is no part of a module{hint}")
        found = [each for each in _SECTIONS if each in body]
        kinds = [each.partition("_")[0] for each in found]
        if len(kinds) != len(set(kinds)):
            what = f"a module has one INCLUDE and one EXCLUDE at most, got {', '.join(found)}"
            self.problems.at(document, path, what)
        elif not found:
            self.problems.at(document, path, f"the module '{name}' has no INCLUDE and no EXCLUDE")
        parts: list[Condition | Group] = []
        for each in found:
            kind, _, sign = each.partition("_")
            section = self._section(
                body[each], sign.lower(), document, (*path, each), (*inside, name)
            )
            if section is not None:
                parts.append(section if kind == "INCLUDE" else Group("not", (section,)))
        self.made[name] = Group("and", tuple(parts))
        return self.made[name]

    def _section(
        self,
        given: Any,
        sign: str,
        document: Document,
        path: tuple[str | int, ...],
        inside: tuple[str, ...],
    ) -> Group | None:
        if not isinstance(given, dict) or not given:
            self.problems.at(document, path, f"{path[-1]} is a mapping of conditions")
            return None
        parts: list[Condition | Group] = []
        for key, value in given.items():
            here = (*path, key)
            group = key.partition("@")[0]
            if key == "METADATA":
                continue
            if group in ("AND", "OR") and ("@" in key or isinstance(value, dict)):
                section = self._section(value, group.lower(), document, here, inside)
                parts += [section] if section is not None else []
            elif key in self.modules or key in self.labels:
                # A truth value as text: the standard's examples quote some.
                if str(value).lower() not in ("true", "false"):
                    self.problems.at(
                        document, here, f"the module '{key}' is true or false, got {value!r}"
                    )
                    continue
                names = [key] if key in self.modules else self.labels[key]
                self.referred |= set(names)
                active = [name for name in names if self._is_active(name)]
                if active:
                    met = Group("or", tuple(self._module(name, inside) for name in active))
                    parts.append(met if str(value).lower() == "true" else Group("not", (met,)))
            elif isinstance(value, list) and value and all(isinstance(x, dict) for x in value):
                parts += [_condition(name, each) for item in value for name, each in item.items()]
            else:
                parts.append(_condition(key, value))
        return Group(sign, tuple(parts)) if parts else None


def _condition(concept: str, value: Any) -> Condition:
    """Return a condition of an expression in YAML."""
    text = _word(value) if not isinstance(value, list) else ", ".join(map(_word, value))
    made = Condition(concept, text)
    if isinstance(value, dict):
        return replace(made, text="…", problem="its expression is a mapping")
    if value is None or (isinstance(value, str) and value.lower() in UNKNOWN):
        return replace(made, text=text if value else "unknown", values=(text,), missing=True)
    if isinstance(value, list):
        words = tuple(_word(item) for item in value)
        if any(_PARAMETRIC.search(word) for word in words):
            return replace(made, problem="its expression has parameters")
        return replace(made, values=words, missing=any(word in UNKNOWN for word in words))
    if isinstance(value, bool):
        return replace(made, values=(text,))
    if isinstance(value, int | float):
        return replace(made, low=float(value), high=float(value))
    if found := _BOUND.fullmatch(text):
        sign, number, unit = found[1], float(found[2]), found[3] or ""
        if sign in (">", ">="):
            return replace(made, low=number, above=sign == ">", unit=unit)
        return replace(made, high=number, below=sign == "<", unit=unit)
    if found := _RANGE.fullmatch(text):
        low, high = float(found[1]), float(found[2])
        return replace(made, low=low, high=high, unit=found[3] or "")
    if found := _EQUAL.fullmatch(text):
        return replace(made, low=float(found[1]), high=float(found[1]), unit=found[2] or "")
    if found := _ORDERED.fullmatch(text):
        return replace(made, values=(found[1], found[2]))
    if _PARAMETRIC.search(text) or text[:1] in "<>":
        return replace(made, problem="its expression has parameters")
    return replace(made, values=(text,))


def _conditions(formula: "Condition | Group") -> Iterator[Condition]:
    if isinstance(formula, Condition):
        yield formula
    else:
        for part in formula.parts:
            yield from _conditions(part)
