"""The criteria of a scenario, checked against what its rollouts hold, and their margins."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from math import isnan
from typing import Literal

import numpy as np

from bridgegen.assess.conflict import quantities
from bridgegen.assess.criteria.signals import OF_DOMAIN, SIGNALS, read
from bridgegen.assess.metrics import Need
from bridgegen.base.arrays import Float
from bridgegen.base.errors import BridgeGenError, InputError
from bridgegen.scenario.language.criteria import ANY, Criterion
from bridgegen.scenario.language.parameters import at
from bridgegen.scenario.stl import (
    TINY,
    Dimension,
    Reading,
    check_units,
    dimension_of_unit,
    horizon,
    readings,
    robustness,
)
from bridgegen.simulation.rollout import Rollout

LARGEST = 1000.0
"""Largest magnitude of a margin, in its unit; larger ones count as this: an objective needs finite
numbers."""


@dataclass(frozen=True)
class CriterionResult:
    """How one scenario meets a criterion.

    Attributes:
        criterion: it.
        margin: > 0 where it is met, < 0 where it is violated; NaN where the scenario failed.
        unit: of the margin; "1" of a mixture or a number.
    """

    criterion: Criterion
    margin: float
    unit: str

    @property
    def verdict(self) -> Literal["met", "violated", "unknown"]:
        """Whether it is met."""
        if isnan(self.margin):
            return "unknown"
        return "met" if self.margin > 0.0 else "violated"


class Monitor:
    """The criteria of one scenario.

    Attributes:
        criteria: in order, each id once.
        units: of their margins, one for each; "1" of a mixture or a number.
        metrics: the names of the metrics that they read.
    """

    def __init__(
        self,
        criteria: Sequence[Criterion],
        entities: Sequence[str],
        held: Collection[Need],
        duration: float,
        source: str,
        has_odd: bool = False,
    ) -> None:
        """Check criteria.

        Args:
            criteria: each id once.
            entities: the names of the rollouts' entities, the ego first.
            held: what the rollouts hold besides motion; see `bridgegen.assess.metrics.require`.
            duration: the longest that a scenario lasts [s].
            source: of the rollouts, for messages.
            has_odd: whether the ego has an operational design domain that a drive can leave.

        Raises:
            InputError: a signal, entity or metric is unknown, units do not agree, or a formula
                looks beyond the end; all problems at once.
        """
        self.criteria = tuple(criteria)
        self._entities, self._has_odd = tuple(entities), has_odd
        problems, metrics = list[str](), list[str]()
        for criterion in criteria:
            wrong = self._problems(criterion, duration)
            for reading in readings(criterion.formula):
                if not reading.is_signal and reading.name in quantities.QUANTITIES:
                    metrics.append(reading.name)
                    try:
                        quantities.require([reading.name], held, source)
                    except BridgeGenError as error:
                        wrong += error.problems
            where = at(criterion.place)
            problems += [
                f"criterion {criterion.id}: {each}{where}" for each in dict.fromkeys(wrong)
            ]
        if problems:
            raise InputError(*problems)
        self.units = tuple(unit_of(criterion) for criterion in criteria)
        self.metrics = tuple(dict.fromkeys(metrics))

    def __len__(self) -> int:
        return len(self.criteria)

    def __iter__(self) -> Iterator[Criterion]:
        return iter(self.criteria)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the margins as quantities."""
        return tuple(criterion.quantity for criterion in self.criteria)

    def margins(self, rollout: Rollout) -> Float:
        """Return the margin of every criterion in every scenario.

        Returns:
            ``(N, C)`` float64: > 0 where a criterion is met, < 0 where it is violated, within
            ±LARGEST; NaN where the scenario failed.
        """
        n = rollout.shape[0]
        out = np.full((n, len(self.criteria)), np.nan)
        ok = np.asarray(rollout.status) == 0
        if not ok.any():
            return out
        n_steps = np.asarray(rollout.n_steps, dtype=np.int64)

        def given(reading: Reading) -> Float:
            if reading.is_signal:
                return read(rollout, reading.name, reading.of)
            values = quantities.evaluate(rollout, [reading.name])
            return np.where(np.isnan(values), 0.0, values)  # of failed rows, which are left out

        for j, criterion in enumerate(self.criteria):
            found = robustness(criterion.formula, given, n_steps, rollout.time_step)
            out[ok, j] = np.clip(found[ok], -LARGEST, LARGEST)
        return out

    def results(self, rollout: Rollout, row: int) -> tuple[CriterionResult, ...]:
        """Return how one scenario of a rollout meets each criterion."""
        if not self.criteria:
            return ()
        margins = self.margins(rollout)[row].tolist()
        results = zip(self.criteria, margins, self.units, strict=True)
        return tuple(CriterionResult(*result) for result in results)

    def _problems(self, criterion: Criterion, duration: float) -> list[str]:
        """Return what is wrong with a criterion."""
        problems = [
            problem
            for each in readings(criterion.formula)
            for problem in self._reading_problems(each)
        ]
        wrong, _ = check_units(criterion.formula, _dimension)
        ahead = horizon(criterion.formula)
        # The tolerance is for sums of bounds such as 0.1 + 0.2, which round upwards.
        if ahead > duration * (1.0 + 1e-9):
            wrong.append(
                f"'{criterion.states}' looks {ahead:g} s ahead, and the scenario ends at "
                f"{duration:g} s"
            )
        return problems + wrong

    def _reading_problems(self, reading: Reading) -> list[str]:
        where = f" (column {reading.column})"
        if not reading.is_signal:
            if reading.name in quantities.QUANTITIES:
                return []
            hint = _near(reading.name, quantities.QUANTITIES)
            return [
                f"unknown metric '{reading.name}'{hint or '; see bridgegen list metrics'}{where}"
            ]
        pair = len(reading.of) > 1
        known = [name for name, signal in SIGNALS.items() if signal.pair == pair]
        known_as = self._entities[0] if self._entities else "ego"
        problems = []
        if reading.name not in known:
            form = (
                f"{reading.name} to {reading.of[-1]}" if pair else f"{reading.of[0]}.{reading.name}"
            )
            names = ", ".join(known)
            hint = _near(reading.name, known) or f"; known: {names}"
            problems.append(f"unknown signal '{form}'{hint}{where}")
        entity = reading.of[-1]
        if reading.name in OF_DOMAIN and not (self._has_odd and entity in ("ego", known_as)):
            problems.append(
                f"'{entity}.{reading.name}' needs an ego that can leave an ODD (odd: or "
                f"--odd){where}"
            )
        others = (ANY, *self._entities[1:]) if pair else ("ego", *self._entities)
        if entity not in others:
            kind = "other participant" if pair else "participant"
            hint = _near(entity, others) or f"; known: {', '.join(dict.fromkeys(others))}"
            problems.append(f"unknown {kind} '{entity}'{hint}{where}")
        return problems


def margin_in_words(margin: float, unit: str, digits: int = 4) -> str:
    """Return a margin with its unit; 0 where the sides of a comparison are equal."""
    if isnan(margin):
        return "unknown"
    value = 0.0 if abs(margin) <= TINY else margin
    return f"{value:.{digits}g}" + ("" if unit == "1" else f" {unit}")


def unit_of(criterion: Criterion) -> str:
    """Return the unit of a criterion's margin; "1" of a mixture of units, or of a number."""
    dimension = check_units(criterion.formula, _dimension)[1]
    return "1" if dimension is None else str(dimension)


def _dimension(reading: Reading) -> Dimension | None:
    """Return the dimension of what a formula reads; None if it is unknown."""
    if reading.is_signal:
        return dimension_of_unit(SIGNALS[reading.name].unit) if reading.name in SIGNALS else None
    known = quantities.QUANTITIES.get(reading.name)
    return None if known is None else dimension_of_unit(known.unit)


def _near(name: str, known: Collection[str]) -> str:
    """Return the nearest of known names as the end of a message, or nothing."""
    near = get_close_matches(name, list(known), 1)
    return f"; did you mean '{near[0]}'?" if near else ""
