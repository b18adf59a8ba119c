"""What makes a job fail: comparisons of figures with numbers, read, and held against a result.

    r_critic > 0.1
    d_min < 2 and v_d >= 1

A figure that is NaN cannot be judged. That is no pass: where nothing was measured, nothing is safe.
"""

import operator
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from math import isfinite, isnan
from typing import Literal

from bridgegen.errors import BridgeGenError, InputError, UnknownNameError

_OPERATORS: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
_COMPARISON = re.compile(
    r"\s*([A-Za-z][A-Za-z0-9_.-]*)\s*(<=|>=|==|!=|<|>)\s*"
    r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,4})?)\s*",
    re.ASCII,
)
_AND = re.compile(r"\band\b", re.ASCII)

Verdict = Literal["passed", "failed", "unknown"]


@dataclass(frozen=True)
class Comparison:
    """A figure beside a number.

    Attributes:
        figure: its name.
        sign: one of < <= > >= == !=.
        number: finite, in the figure's unit.
    """

    figure: str
    sign: str
    number: float

    def holds(self, value: float) -> bool:
        """Say whether a value, not NaN, compares so."""
        return _OPERATORS[self.sign](value, self.number)


@dataclass(frozen=True)
class Outcome:
    """What a test of a result came to.

    Attributes:
        test: what must be, in words.
        verdict: "unknown" where a figure that decides it is NaN.
        said: the figures, in words.
        figures: the names of those that it looks at.
    """

    test: str
    verdict: Verdict
    said: str
    figures: tuple[str, ...] = ()


@dataclass(frozen=True)
class Criterion:
    """When a job fails: if all of its comparisons hold.

    Attributes:
        text: as the user wrote it, spaces evened out.
        comparisons: at least one.
    """

    text: str
    comparisons: tuple[Comparison, ...]

    @property
    def figures(self) -> tuple[str, ...]:
        """The names of what is compared."""
        return tuple(dict.fromkeys(one.figure for one in self.comparisons))

    def judge(self, values: Mapping[str, float]) -> Outcome:
        """Hold it against the figures of a result; NaN is a figure that nobody knows."""
        known = [one for one in self.comparisons if not isnan(values[one.figure])]
        verdict: Verdict = "failed" if len(known) == len(self.comparisons) else "unknown"
        if any(not one.holds(values[one.figure]) for one in known):
            verdict = "passed"
        said = ", ".join(f"{name} {_told(values[name])}" for name in self.figures)
        return Outcome(f"not {self.text}", verdict, said, self.figures)


def _told(value: float) -> str:
    return "cannot be told" if isnan(value) else f"= {value:.6g}" if isfinite(value) else "= inf"


def read_criteria(texts: Iterable[str], known: Collection[str]) -> tuple[Criterion, ...]:
    """Read criteria.

    Args:
        texts: ``FIGURE < NUMBER`` (or <=, >, >=, ==, !=), several joined by ``and``.
        known: the figures that there are.

    Raises:
        InputError: a text that is no criterion, or a figure that is unknown; all of them at once.
    """
    found, problems = [], list[str]()
    for text in texts:
        try:
            found.append(_read(text, known))
        except BridgeGenError as error:
            problems += error.problems
    if problems:
        raise InputError(*problems)
    return tuple(found)


def _read(text: str, known: Collection[str]) -> Criterion:
    comparisons = []
    for part in _AND.split(text):
        match = _COMPARISON.fullmatch(part)
        number = float(match[3]) if match else float("nan")
        if match is None or not isfinite(number):
            raise InputError(
                "--fail-if must read FIGURE < NUMBER (or <=, >, >=, ==, !=), several joined by "
                f"'and', got '{text}'"
            )
        if match[1] not in known:
            raise UnknownNameError("figure of --fail-if", match[1], known)
        comparisons.append(Comparison(match[1], match[2], number))
    return Criterion(" ".join(text.split()), tuple(comparisons))
