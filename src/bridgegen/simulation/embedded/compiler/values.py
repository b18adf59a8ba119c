"""Parameters and variables that change as the scenario runs, and dates, as numbers."""

import math
from datetime import UTC, datetime

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.parameters import kind_of
from bridgegen.openx.openscenario.values import Kind, Value
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.tables import Tables

EQUALITY = (codes.EQUAL, codes.NOT_EQUAL)


class Values:
    """The parameters and variables that conditions compare or actions set, numbered as they come.

    A text is a number of its own, a date the seconds since 1970, true is 1.

    Attributes:
        slots: of their first values.
    """

    def __init__(self, tables: Tables, scenario: osc.OpenScenario) -> None:
        self._tables = tables
        self._texts: dict[str, float] = {}
        self._numbers: dict[tuple[str, str], int] = {}
        self.slots: list[int] = []
        parameters, variables = scenario.parameter_declarations, scenario.variable_declarations
        self._declared: dict[tuple[str, str], tuple[Kind, Value]] = {}
        for one in parameters.parameters if parameters else ():
            kind = kind_of(one.parameter_type)
            first: Value = osc.ParameterRef(f"${one.name}") if kind.is_number else one.value
            self._declared["parameter", one.name] = kind, first
        for other in variables.variables if variables else ():
            kind = kind_of(other.variable_type)
            self._declared["variable", other.name] = kind, other.value

    def number(self, element: Element, what: str, name: str) -> int:
        """Return the number of a parameter or variable; one that is not declared is taken down."""
        key = (what, name)
        if key not in self._declared:
            self._tables.unsupported(element, f"{what} '{name}', which is not declared,")
            return 0
        if key not in self._numbers:
            kind, first = self._declared[key]
            value = first if isinstance(first, osc.ParameterRef) else self._read(kind, first)
            self._numbers[key] = len(self.slots)
            self.slots.append(self._tables.slot(value if value is not None else math.nan))
        return self._numbers[key]

    def value(self, element: Element, what: str, name: str, text: Value) -> Value:
        """Return what a text is as a value of a parameter or variable: a number, or its source."""
        kind, _ = self._declared.get((what, name), (Kind.STRING, ""))
        if self._is_number(text) and kind not in (Kind.STRING, Kind.DATE_TIME):
            return text
        value = self._read(kind, text)
        if value is None:
            what = f"value=\"{text}\" for {what} '{name}' ({kind.value})"
            self._tables.unsupported(element, what)
            return 0.0
        return value

    def is_ordered(self, what: str, name: str) -> bool:
        """Return whether values of a parameter or variable can be greater or less."""
        return self._declared.get((what, name), (Kind.STRING, ""))[0] is not Kind.STRING

    def _is_number(self, value: Value) -> bool:
        """Return whether a value is computed, or a number of the file's parameters."""
        if isinstance(value, osc.ParameterRef):
            return value.name in self._tables.parameters
        return isinstance(value, osc.Expr)

    def _read(self, kind: Kind, value: Value) -> float | None:
        text = self._tables.text(value) if isinstance(value, osc.ParameterRef) else str(value)
        if kind is Kind.STRING:
            return self._texts.setdefault(text, float(len(self._texts)))
        if kind is Kind.DATE_TIME:
            return seconds(text)
        if text in ("true", "false"):
            return float(text == "true")
        try:
            number = float(text)
        except ValueError:
            return None
        return number if math.isfinite(number) else None


def seconds(date: str) -> float | None:
    """Return a date's seconds since 1970, in UTC where it names no zone; None if it is none."""
    try:
        moment = datetime.fromisoformat(date)
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
