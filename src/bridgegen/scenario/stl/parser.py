"""From texts to formulas.

    always(ego.a > -8 m/s²)
    min(gap to bv) > 2 m while ego.v > 5 m/s
    eventually[0, 3](ego.v < 1) or ttc >= 1.5 s

The words of temporal operators are rtamt's.
"""

import re
from dataclasses import dataclass, replace
from math import inf
from typing import Literal, NoReturn

from bridgegen.base.errors import InputError
from bridgegen.scenario.stl import formula as f
from bridgegen.scenario.stl.dimensions import NONE, SYMBOLS, Dimension, in_si
from bridgegen.scenario.stl.formula import Formula, Interval, Reading, Term

MAX_TEXT = 2000
"""Largest number of characters of a formula."""

MAX_TOKENS = 500
"""Largest number of names, numbers and signs of a formula."""

MAX_DEPTH = 60
"""Largest depth of parentheses and operators inside one another."""

MAX_NUMBER = 1e30
"""Largest number in a formula, as written."""

_TEMPORAL = ("always", "eventually", "historically", "once")
_BINARY = ("until", "since")
_FUNCTIONS = ("abs", "min", "max", "first", "last")
_WORDS = {
    *_TEMPORAL,
    *_BINARY,
    *_FUNCTIONS,
    "and",
    "or",
    "not",
    "implies",
    "while",
    "to",
    "any",
}

_UNIT = "|".join(re.escape(symbol) for symbol in sorted(SYMBOLS, key=len, reverse=True))
# A unit ends where no letter or sign of a unit follows: the m of "2 min(...)" is none.
_TOKEN = re.compile(
    rf"""\s*(?:
    (?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{{1,3}})?)
        (?:\s*(?P<unit>{_UNIT})(?![\w²³^/]))?
    |(?P<name>[^\W\d]\w*)
    |"(?P<quoted>[^"\n]{{1,200}})"
    |(?P<sign><->|->|<=|>=|==|!=|[-+*/()<>,.:\[\]])
    )""",
    re.VERBOSE,
)


@dataclass(frozen=True)
class _Token:
    kind: Literal["number", "name", "quoted", "sign", "end"]
    text: str
    column: int
    unit: str = ""


def parse(text: str) -> Formula:
    """Return the formula that a text states.

    Raises:
        InputError: the text is no formula; says where. Or a signal is compared outside all temporal
            operators, or a metric inside one.
    """
    if len(text) > MAX_TEXT:
        raise InputError(f"a formula has at most {MAX_TEXT} characters, got {len(text)}")
    reader = _Reader(text)
    found = reader.implication()
    reader.expect_end()
    if isinstance(found, f.Constant | Reading | f.Arithmetic | f.Function | f.Whole):
        reader.fail("a formula compares something, 'ttc >= 1.0' say")
    _check_times(found, text, inside=False)
    return found


def _check_times(reading: f.Part, text: str, *, inside: bool) -> None:
    """Check that signals are read inside temporal operators, and metrics outside.

    Raises:
        InputError: they are not.
    """
    if isinstance(reading, Reading) and reading.is_signal != inside:
        if reading.is_signal:
            raise InputError(
                f"{reading} changes over time, so a formula says when it is compared: "
                f"always(...), eventually(...), min(...), max(...), first(...) or last(...), "
                f"got '{text}' (column {reading.column})"
            )
        raise InputError(
            f"{reading.name} is no signal, and always(...), eventually(...) and the like compare "
            "signals (ego.v, gap to any); a metric, one number of the whole scenario, is compared "
            f"outside, got '{text}' (column {reading.column})"
        )
    for part in f.parts(reading):
        _check_times(
            part, text, inside=inside or isinstance(reading, f.Temporal | f.Until | f.Whole)
        )


class _Reader:
    """One text, read from left to right."""

    def __init__(self, text: str) -> None:
        self._text, self._depth = text, 0
        self._tokens: list[_Token] = []
        at = 0
        while text[at:].strip():
            found = _TOKEN.match(text, at)
            if found is None:
                column = at + len(text[at:]) - len(text[at:].lstrip()) + 1
                raise InputError(
                    f"a formula has no sign '{text[column - 1]}', got '{text}' (column {column})"
                )
            kind = str(found.lastgroup if found.lastgroup != "unit" else "number")
            self._tokens.append(
                _Token(kind, found[kind], found.start(kind) + 1, found["unit"] or "")  # type: ignore[arg-type]
            )
            at = found.end()
        if len(self._tokens) > MAX_TOKENS:
            raise InputError(
                f"a formula has at most {MAX_TOKENS} names, numbers and signs, got "
                f"{len(self._tokens)}"
            )
        self._tokens.append(_Token("end", "", len(text) + 1))
        self._at = 0

    @property
    def _now(self) -> _Token:
        return self._tokens[self._at]

    def fail(self, rule: str) -> NoReturn:
        """Refuse the text at the present token."""
        got = f"'{self._now.text}'" if self._now.text else "its end"
        raise InputError(f"{rule}, got {got} in '{self._text}' (column {self._now.column})")

    def expect_end(self) -> None:
        """Refuse what follows a whole formula."""
        if self._now.kind != "end":
            self.fail("a formula ends, or goes on with 'and', 'or', 'implies', 'until' or 'while'")

    def _is(self, *texts: str) -> bool:
        return self._now.kind in ("sign", "name") and self._now.text in texts

    def _take(self) -> _Token:
        self._at += 1
        return self._tokens[self._at - 1]

    def _expect(self, sign: str) -> None:
        if not self._is(sign):
            self.fail(f"a formula needs '{sign}' here")
        self._take()

    def _formula(self, part: f.Part, sign: str) -> Formula:
        if isinstance(part, f.Comparison | f.Not | f.Junction | f.Temporal | f.Until):
            return part
        self.fail(f"'{sign}' joins comparisons, not numbers")

    def _term(self, part: f.Part, sign: str) -> Term:
        if isinstance(part, f.Constant | Reading | f.Arithmetic | f.Function | f.Whole):
            return part
        self.fail(f"'{sign}' joins numbers, not comparisons")

    def implication(self) -> f.Part:
        """Read ``a implies b``, and all that binds more tightly."""
        self._depth += 1
        if self._depth > MAX_DEPTH:
            self.fail(f"a formula is at most {MAX_DEPTH} levels deep")
        left = self._or()
        if self._is("implies", "->"):
            sign = self._take().text
            premise = f.Not(self._formula(left, sign))
            left = f.Junction("or", premise, self._formula(self.implication(), sign))
        self._depth -= 1
        return left

    def _or(self) -> f.Part:
        left = self._and()
        while self._is("or"):
            self._take()
            left = f.Junction("or", self._formula(left, "or"), self._formula(self._and(), "or"))
        return left

    def _and(self) -> f.Part:
        left = self._until()
        while self._is("and"):
            self._take()
            right = self._formula(self._until(), "and")
            left = f.Junction("and", self._formula(left, "and"), right)
        return left

    def _until(self) -> f.Part:
        left = self._unary()
        while self._is(*_BINARY, "while"):
            token = self._take()
            if token.text == "while":
                left = self._restricted(left, self._formula(self._unary(), "while"))
                continue
            interval = self._interval()
            right = self._formula(self._unary(), token.text)
            name: Literal["until", "since"] = "until" if token.text == "until" else "since"
            left = f.Until(name, interval, self._formula(left, token.text), right)
        return left

    def _restricted(self, left: f.Part, condition: Formula) -> Formula:
        """Return ``COMPARISON while FORMULA``: the comparison counts where the formula holds."""
        if not isinstance(left, f.Comparison):
            self.fail("before 'while' stands one comparison, 'min(gap to bv) > 2 m' say")
        extreme = left.left
        if isinstance(extreme, f.Whole):
            # min(x) > c and max(x) < c say something of all instants, min(x) < c and max(x) > c of
            # one at least. So "while" needs no extreme of a part of a recording, which may be
            # empty.
            at_all = (extreme.name == "min") == (left.sign in (">", ">="))
            if extreme.name not in ("min", "max") or left.sign in ("==", "!="):
                self.fail("before 'while' stands min(...) or max(...), compared by <, <=, > or >=")
            each = replace(left, left=extreme.term)
            if not at_all:
                return f.Temporal("eventually", Interval(), f.Junction("and", condition, each))
        else:
            each = left
        return f.Temporal("always", Interval(), f.Junction("or", f.Not(condition), each))

    def _unary(self) -> f.Part:
        if self._is("not"):
            self._take()
            self._depth += 1
            if self._depth > MAX_DEPTH:
                self.fail(f"a formula is at most {MAX_DEPTH} levels deep")
            inside = self._formula(self._unary(), "not")
            self._depth -= 1
            return f.Not(inside)
        if self._is(*_TEMPORAL):
            name = self._take().text
            interval = self._interval()
            self._expect("(")
            inside = self._formula(self.implication(), name)
            self._expect(")")
            return f.Temporal(name, interval, inside)  # type: ignore[arg-type]
        return self._comparison()

    def _interval(self) -> Interval:
        if not self._is("["):
            return Interval()
        self._take()
        low = self._seconds()
        if low == inf:
            self.fail("an interval begins at a finite time")
        if not self._is(",", ":"):
            self.fail("an interval reads [LOW, HIGH] in seconds")
        self._take()
        column = self._now.column
        high = self._seconds()
        self._expect("]")
        if not low <= high:
            raise InputError(
                f"low <= high must hold for the interval [{low:g}, {high:g}] s in '{self._text}' "
                f"(column {column})"
            )
        return Interval(low, high)

    def _seconds(self) -> float:
        token = self._now
        if token.kind == "name" and token.text == "inf":
            self._take()
            return inf
        if token.kind != "number" or (token.unit and SYMBOLS[token.unit][0] != "s"):
            self.fail("an interval reads [LOW, HIGH] in seconds")
        return self._number("s")[0]

    def _comparison(self) -> f.Part:
        left = self._sum()
        found: list[Formula] = []
        while self._is("<", "<=", ">", ">=", "==", "!="):
            token = self._take()
            right = self._term(self._sum(), token.text)
            term = self._term(left, token.text)
            found.append(f.Comparison(token.text, term, right, token.column))  # type: ignore[arg-type]
            left = right
        return f.joined("and", found) if found else left

    def _sum(self) -> f.Part:
        left = self._product()
        while self._is("+", "-"):
            sign = self._take().text
            right = self._term(self._product(), sign)
            left = f.Arithmetic(sign, self._term(left, sign), right)  # type: ignore[arg-type]
        return left

    def _product(self) -> f.Part:
        left = self._signed()
        while self._is("*", "/"):
            sign = self._take().text
            right = self._term(self._signed(), sign)
            left = f.Arithmetic(sign, self._term(left, sign), right)  # type: ignore[arg-type]
        return left

    def _signed(self) -> f.Part:
        minus = 0
        while self._is("+", "-"):
            minus += self._take().text == "-"
        comparison = self._primary()
        if not minus % 2:
            return comparison
        if isinstance(comparison, f.Constant):
            return replace(comparison, value=-comparison.value)
        return f.Arithmetic("*", f.Constant(-1.0, NONE), self._term(comparison, "-"))

    def _primary(self) -> f.Part:
        token = self._now
        if token.kind == "number":
            return f.Constant(*self._number())
        if self._is("("):
            self._take()
            inside = self.implication()
            self._expect(")")
            return inside
        if self._is(*_FUNCTIONS):
            return self._function()
        if token.kind in ("name", "quoted") and not (token.kind == "name" and token.text in _WORDS):
            return self._reading()
        self.fail("a formula needs a quantity or a number here")

    def _number(self, unit: str = "") -> tuple[float, Dimension | None]:
        """Read a number, in ``unit`` if it says none; return it in SI units."""
        token = self._now
        if abs(float(token.text)) > MAX_NUMBER:
            self.fail(f"a number is at most {MAX_NUMBER:g}")
        self._take()
        if token.unit or unit:
            return in_si(token.text, token.unit or unit)
        return float(token.text), None

    def _function(self) -> f.Part:
        name = self._take().text
        self._expect("(")
        terms = [self._term(self._sum(), name)]
        while self._is(","):
            self._take()
            terms.append(self._term(self._sum(), name))
        self._expect(")")
        if name == "abs" or len(terms) > 1:
            if (name == "abs") != (len(terms) == 1) or name in ("first", "last"):
                self.fail(f"{name}(...) takes one quantity")
            return f.Function(name, tuple(terms))  # type: ignore[arg-type]
        return f.Whole(name, terms[0])  # type: ignore[arg-type]

    def _reading(self) -> Reading:
        token = self._take()
        if self._is("."):
            self._take()
            state = self._take()
            if state.kind != "name":
                self._at -= 1
                self.fail("a state of an entity reads ENTITY.STATE, 'ego.v' say")
            return Reading(state.text, (token.text,), token.column)
        if self._is("to"):
            self._take()
            other = self._take()
            if other.kind not in ("name", "quoted"):
                self._at -= 1
                self.fail(f"'{token.text} to' needs an entity, or 'any'")
            return Reading(token.text, ("ego", other.text), token.column)
        if token.kind == "quoted":
            self._at -= 1
            self.fail(f"'{token.text}' is an entity: a state of it reads \"{token.text}\".v")
        return Reading(token.text, (), token.column)
