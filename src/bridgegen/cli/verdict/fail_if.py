"""Fail conditions: comparisons of figures with numbers, applied to a result.

    r_critic > 0.1
    d_min < 2 and v_d >= 1

A figure that is NaN cannot be judged, and that is not a pass.
"""

import operator
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from math import isfinite, isnan
from typing import TYPE_CHECKING, Literal

from bridgegen.assess.criteria import CriterionResult, margin_in_words
from bridgegen.base.errors import BridgeGenError, InputError, UnknownNameError

if TYPE_CHECKING:
    from bridgegen.scenario.language.criteria import Criterion

_OPERATORS: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
_COMPARISON = re.compile(
    r"\s*([A-Za-z][A-Za-z0-9_.:-]*)\s*(<=|>=|==|!=|<|>)\s*"
    r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,4})?)\s*",
    re.ASCII,
)
_AND = re.compile(r"\band\b", re.ASCII)

Verdict = Literal["passed", "failed", "unknown"]


@dataclass(frozen=True)
class Comparison:
    """A comparison of a figure with a number.

    Attributes:
        figure: its name.
        sign: one of < <= > >= == !=.
        number: finite, in the figure's unit.
    """

    figure: str
    sign: str
    number: float

    def holds(self, value: float) -> bool:
        """Return whether it holds for a value that is not NaN."""
        return _OPERATORS[self.sign](value, self.number)


@dataclass(frozen=True)
class Outcome:
    """The outcome of one test of a result.

    Attributes:
        test: the requirement, in words.
        verdict: "unknown" if a decisive figure is NaN.
        details: the values of the figures, in words.
        figures: the names of the figures that it uses.
    """

    test: str
    verdict: Verdict
    details: str
    figures: tuple[str, ...] = ()


@dataclass(frozen=True)
class FailCondition:
    """What fails a result: all of its comparisons hold.

    Attributes:
        text: the user's text with single spaces.
        comparisons: at least one.
    """

    text: str
    comparisons: tuple[Comparison, ...]

    @property
    def figures(self) -> tuple[str, ...]:
        """The names of the figures that it compares."""
        return tuple(dict.fromkeys(comparison.figure for comparison in self.comparisons))

    def judge(self, values: Mapping[str, float]) -> Outcome:
        """Apply it to the figures of a result; NaN is an unknown figure."""
        known = [
            comparison for comparison in self.comparisons if not isnan(values[comparison.figure])
        ]
        # Three values: where one comparison is known not to hold, the condition does not hold,
        # whatever the unknown ones are.
        verdict: Verdict = "failed" if len(known) == len(self.comparisons) else "unknown"
        if any(not comparison.holds(values[comparison.figure]) for comparison in known):
            verdict = "passed"
        details = ", ".join(f"{name} {_value_text(values[name])}" for name in self.figures)
        return Outcome(f"not {self.text}", verdict, details, self.figures)


def unless_judged(
    outcomes: Iterable[Outcome], why: str, known: Collection[str] = ()
) -> tuple[Outcome, ...]:
    """Return the outcomes of a result; where it is not judged, none on the ego passes.

    Args:
        outcomes: of its conditions and criteria.
        why: it is not judged; "" if it is.
        known: figures that are known all the same, as they are not of the ego.
    """

    def passes(outcome: Outcome) -> bool:
        return bool(outcome.figures) and {*outcome.figures} <= {*known}

    return tuple(
        replace(outcome, verdict="unknown", details=f"{outcome.details}; not judged: {why}")
        # A failure stays one: a driver that fails outside its domain has failed.
        if why and outcome.verdict == "passed" and not passes(outcome)
        else outcome
        for outcome in outcomes
    )


def outcome_of(criterion_result: CriterionResult) -> Outcome:
    """Return whether a scenario meets a pass criterion, as an outcome."""
    verdict: Verdict = "unknown"
    if criterion_result.verdict != "unknown":
        verdict = "passed" if criterion_result.verdict == "met" else "failed"
    margin = margin_in_words(criterion_result.margin, criterion_result.unit, 6)
    return Outcome(
        words_of(criterion_result.criterion),
        verdict,
        f"margin {margin}, {criterion_result.criterion.states}",
    )


def words_of(criterion: "Criterion") -> str:
    """Return a pass criterion's id and requirement, as the name of a test."""
    return f"{criterion.id}: {criterion.text or criterion.states}"


def _value_text(value: float) -> str:
    return "= n/a (NaN)" if isnan(value) else f"= {value:.6g}" if isfinite(value) else "= inf"


def read_conditions(texts: Iterable[str], known: Collection[str]) -> tuple[FailCondition, ...]:
    """Read conditions.

    Args:
        texts: ``FIGURE < NUMBER`` (or <=, >, >=, ==, !=), several joined by ``and``.
        known: the names of all figures.

    Raises:
        InputError: a text is not a condition, or a figure is unknown; all problems at once.
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


def _read(text: str, known: Collection[str]) -> FailCondition:
    comparisons = []
    for part in _AND.split(text):
        match = _COMPARISON.fullmatch(part)
        number = float(match[3]) if match else float("nan")
        # "1e999" matches and is infinite.
        if match is None or not isfinite(number):
            raise InputError(
                "--fail-if must read FIGURE < NUMBER (or <=, >, >=, ==, !=), several joined by "
                f"'and', got '{text}'"
            )
        if match[1] not in known:
            raise UnknownNameError("figure of --fail-if", match[1], known)
        comparisons.append(Comparison(match[1], match[2], number))
    return FailCondition(" ".join(text.split()), tuple(comparisons))
