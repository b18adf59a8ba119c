"""What a minimal scenario needs: bounds of its parameters, stated only where probes confirm them.

Each parameter that is not nominal is moved alone, towards its nominal value and away from it, in
steps until the harm ends; bisection finds the bound more precisely, and the bound is rounded
inwards before it is verified. A condition is confirmed where harm of any mode is absent outside
(one step beyond each bound, with the nominal value, and with 95 % of random values farther out, the
other conditions met) and where all corners of the region of all confirmed conditions and all of 40
random points inside are harmful. (If 38 were enough, one region in five passed in which only nine
points of ten are.) A parameter whose condition is not confirmed stays at its value: it is an
example.

Constraints tie parameters together. Where one stops a move before the harm ends, the condition has
that end, too: with other values of the other parameters more would be feasible, and nothing is
known of it. What no condition names is at its default in all probes, or as near to it as the
constraints allow, so it follows the values that a condition leaves open.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.triage.moves import nearest, searched
from bridgegen.search.triage.record import Condition, Probes

# Conditions that moved one parameter at a time were harmless one step outside for 54 % of 133, and
# 34 % of random points inside were harmful. With these probes, of 1,680 fresh points inside 99.7 %
# were harmful, of 1,436 outside 1.3 %.
INSIDE, OUTSIDE = 40, 20
"""Numbers of random probes inside all conditions, and outside each one."""

SURE = 0.95
"""Least share of random probes outside that are not harmful."""

_DRAWS = 10  # random points for each probe inside, for constraints may leave some no room
_CORNERS = 16  # of the region of all conditions; of more conditions than four, at random
_AHEAD, _HALVINGS = 6, 5  # steps tried at a time to find a bound; bisections of the last one
_STREAM = 20  # a random stream of its own under the seed
_UNITLESS = ("1", "count", "?")
_NOISE = "with these random numbers (noise key in its file)"


class _SpentError(Exception):
    """No simulations are left."""


@dataclass(frozen=True)
class _Span:
    """The values of one parameter for which the harm persists, all else as in the scenario.

    Attributes:
        low: smallest value.
        high: largest value.
        below: whether the harm ends below ``low``, within the range.
        above: whether it ends above ``high``.
        closed: whether a constraint ends the other side, before the end of the range.
    """

    low: float
    high: float
    below: bool
    above: bool
    closed: bool = False


class Conditions:
    """Finds the conditions of one minimal scenario.

    Args:
        pipeline: the run's, one that ``tries``.
        x: ``(len(space.names),)``, the minimal scenario.
        base: the row whose random numbers it uses.
        steps: ``(n_var,)`` > 0, of each searched parameter.
        noise_key: of those numbers; the probes follow from it and the seed.
        seed: of the run.
        most: simulations at most.
    """

    def __init__(
        self,
        pipeline: Pipeline,
        x: Float,
        base: Float,
        steps: Float,
        noise_key: int,
        seed: int,
        most: int,
    ) -> None:
        self._pipeline, self._space, self._base, self._left = pipeline, pipeline.space, base, most
        self._x = self._v = searched(self._space, x[np.newaxis])[0]
        self._named: list[int] = []
        self._region: Float = self._v[np.newaxis]
        self._nominal = searched(self._space, self._space.row({})[np.newaxis])[0]
        self._steps = steps
        self._kinds = [self._space.parameters[name].kind for name in self._space.variables]
        self._random = np.random.Generator(np.random.PCG64([seed, _STREAM, noise_key]))

    def find(self, needed: Sequence[int]) -> tuple[list[Condition], Probes, str]:
        """Return the condition of each parameter, and the probes inside the confirmed ones.

        The last one says in words which other parameters are not at default, see `others`.

        Args:
            needed: columns of the searched parameters that are not nominal. A further one that is
                not as near to its default as constraints allow is an example.
        """
        defaults = np.array([self._space.defaults[name] for name in self._space.variables])
        self._v = defaults
        self._v[list(needed)] = self._x[list(needed)]
        near = searched(self._space, nearest(self._space, self._v[np.newaxis]))[0]
        further = np.flatnonzero(np.abs(near - self._x) > 1e-9 * self._steps).tolist()
        self._v[further] = self._x[further]
        self._named = [*needed, *(i for i in further if i not in needed)]
        confirmed: dict[int, tuple[_Span, Probes]] = {}
        inside = Probes(rows=0, harmful=0)
        with suppress(_SpentError):
            confirmed, inside = self._confirmed(self._spans(needed))
        conditions = [self._condition(i, confirmed.get(i)) for i in self._named]
        rows = [self._x[np.newaxis], *([self._region] if confirmed else [])]
        X = nearest(self._space, np.concatenate(rows))
        return (
            conditions,
            inside,
            others(self._space, X, [condition.name for condition in conditions]),
        )

    def _harmful(self, V: Float) -> tuple[Bool, Float]:
        """Return which rows are harmful, in any mode, and their feasible values ``(n, n_var)``."""
        if len(V) > self._left:
            # What is not confirmed within the budget becomes an example, never a condition.
            raise _SpentError
        self._left -= len(V)
        X = nearest(self._space, V)
        noise = np.broadcast_to(self._base, X.shape)
        return self._pipeline.try_all(X, noise=noise).harmful, searched(self._space, X)

    def _moved(self, moves: Sequence[tuple[int, float]]) -> Float:
        """Return the scenario's values ``(n, n_var)``, each row with one parameter moved."""
        V = np.tile(self._v, (len(moves), 1))
        for row, (i, value) in enumerate(moves):
            V[row, i] = value
        return V

    def _spans(self, needed: Sequence[int]) -> dict[int, _Span]:
        """Return where each parameter's harm ends, if it has ended with the nominal value."""
        # Harm of any mode: where another one takes over with the nominal value, the condition does
        # not decide.
        harmless = ~self._harmful(self._moved([(i, self._nominal[i]) for i in needed]))[0]
        asked = [i for i, item in zip(needed, harmless.tolist(), strict=True) if item]
        single = [i for i in asked if self._kinds[i].names]
        spans = {i: _Span(self._v[i], self._v[i], below=True, above=True) for i in single}
        ways = [(i, way) for i in asked if i not in spans for way in (-1.0, 1.0)]
        ends = self._bisected(self._scanned(ways))
        for i in (number for number in asked if number not in single):
            (low, below), (high, above) = ends[i, -1.0], ends[i, 1.0]
            if not (below if self._v[i] > self._nominal[i] else above):
                continue  # the nominal value cannot be had without moving other parameters
            parameter = self._space.parameters[self._space.variables[i]]
            least = not below and low > parameter.low + 1e-9 * self._steps[i]
            most = not above and high < parameter.high - 1e-9 * self._steps[i]
            # Inwards, and before it is verified: what is printed is what was tested.
            low = self._rounded(i, low, 1.0) if below or least else low
            high = self._rounded(i, high, -1.0) if above or most else high
            spans[i] = _Span(low, high, below, above, closed=least or most)
        return {i: spans[i] for i in asked if i in spans}

    def _scanned(
        self, ways: Sequence[tuple[int, float]]
    ) -> dict[tuple[int, float], tuple[float, float | None]]:
        """Return per parameter and direction the last harmful value, and the harmless one beyond.

        The latter is None where the harm persists to the end of what the parameter can be.
        """
        found: dict[tuple[int, float], tuple[float, float | None]] = {}
        last = {pair: float(self._v[pair[0]]) for pair in ways}
        while len(found) < len(ways):
            open_ = [pair for pair in ways if pair not in found]
            moves = [
                (i, last[i, way] + way * k * self._steps[i])
                for i, way in open_
                for k in range(1, _AHEAD + 1)
            ]
            harmful, values = self._harmful(self._moved(moves))
            for n, (i, way) in enumerate(open_):
                for k in range(n * _AHEAD, (n + 1) * _AHEAD):
                    value = float(values[k, i])
                    moves_on = way * (value - last[i, way]) > 1e-9 * self._steps[i]
                    if not moves_on:
                        found[i, way] = last[i, way], None
                    elif not harmful[k]:
                        found[i, way] = last[i, way], value
                    if (i, way) in found:
                        break
                    last[i, way] = value
        return found

    def _bisected(
        self, ends: Mapping[tuple[int, float], tuple[float, float | None]]
    ) -> dict[tuple[int, float], tuple[float, bool]]:
        """Return the last harmful value of each, and whether the harm ends beyond it."""
        inner = {name: inside for name, (inside, _) in ends.items()}
        outer = {name: outside for name, (_, outside) in ends.items() if outside is not None}
        fine = [pair for pair in outer if not self._kinds[pair[0]].apart]
        for _ in range(_HALVINGS if fine else 0):
            halves = [(i, 0.5 * (inner[i, way] + outer[i, way])) for i, way in fine]
            harmful, values = self._harmful(self._moved(halves))
            for k, (i, way) in enumerate(fine):
                (inner if harmful[k] else outer)[i, way] = float(values[k, i])
        return {name: (value, name in outer) for name, value in inner.items()}

    def _rounded(self, i: int, value: float, inwards: float) -> float:
        """Return a bound of few digits, moved inwards by less than half a step, not past ``v``."""
        if self._kinds[i].apart or self._kinds[i].turn is not None:
            return value
        digits = -math.floor(math.log10(0.5 * self._steps[i]))
        for more in range(6):
            grid = 10.0 ** (digits + more)
            found = (math.ceil(value * grid) if inwards > 0.0 else math.floor(value * grid)) / grid
            if inwards * (self._v[i] - found) >= 0.0:
                return found
        return value

    def _confirmed(
        self, spans: Mapping[int, _Span]
    ) -> tuple[dict[int, tuple[_Span, Probes]], Probes]:
        """Return the spans that probes confirm together, each with its probes outside."""
        left = dict(spans)
        outside = self._pruned(left)
        while left:
            inside = self._tested(left)
            if inside is None:
                continue  # probes outside are dearer: they wait until all is well inside
            if outside.keys() == left.keys():
                return {i: (left[i], outside[i]) for i in left}, inside
            tested, outside = left.copy(), self._pruned(left)
            if left == tested:
                return {i: (left[i], outside[i]) for i in left}, inside
        return {}, Probes(rows=0, harmful=0)

    def _pruned(self, left: dict[int, _Span]) -> dict[int, Probes]:
        """Drop spans, the worst first, until no harm is outside; return the others' probes."""
        while left:
            outside = {i: self._outside(i, left) for i in left}
            worst = max(left, key=lambda i: outside[i][1])
            if outside[worst][1] <= 1.0 - SURE:
                return {i: probes for i, (probes, _) in outside.items()}
            del left[worst]
        return {}

    def _tested(self, left: dict[int, _Span]) -> Probes | None:
        """Return the random probes inside; None if a probe is harmless: then drop a span."""
        corners, V = self._corners(left), self._inside(left)
        probes = np.concatenate([corners, V])
        harmful, _ = self._harmful(probes)
        if 2 * len(V) >= INSIDE and harmful.all():
            self._region = probes
            return Probes(rows=len(V), harmful=len(V))
        # A region is slanted, and the product of intervals holds much that is harmless: the
        # parameter that tells these points apart becomes an example instead of a condition.
        del left[self._telling(probes, harmful, left)]
        return None

    def _telling(self, V: Float, harmful: Bool, spans: Mapping[int, _Span]) -> int:
        """Return the parameter that differs most between the harmful rows and the others."""
        if not harmful.any() or harmful.all():  # the latter of too few that are feasible
            return max(spans)

        def apart(i: int) -> float:
            width = max(spans[i].high - spans[i].low, 1e-300)
            return abs(float(V[harmful, i].mean() - V[~harmful, i].mean())) / width

        return max(spans, key=apart)

    def _drawn(self, spans: Mapping[int, _Span], n: int) -> Float:
        """Return random values that meet all conditions, ``(n, n_var)``, feasible or not."""
        V = np.tile(self._v, (n, 1))
        for i, span in spans.items():
            share = self._random.random(n)
            V[:, i] = span.low + share * (span.high - span.low)
        return V

    def _inside(self, spans: Mapping[int, _Span]) -> Float:
        """Return feasible random values that meet all conditions, ``INSIDE`` if there are."""
        return self._meeting(self._drawn(spans, INSIDE * _DRAWS), spans)[:INSIDE]

    def _corners(self, spans: Mapping[int, _Span]) -> Float:
        """Return the feasible corners of the region that the conditions state."""
        which = np.array(list(product((False, True), repeat=len(spans))))
        if len(which) > _CORNERS:
            which = which[self._random.choice(len(which), _CORNERS, replace=False)]
        V = np.tile(self._v, (len(which), 1))
        for (i, span), high in zip(spans.items(), which.T, strict=True):
            V[:, i] = np.where(high, span.high, span.low)
        return np.unique(self._meeting(V, spans), axis=0)

    def _meeting(self, V: Float, spans: Mapping[int, _Span]) -> Float:
        """Return the values that stay as they are stated when all constraints are kept."""
        V = searched(self._space, nearest(self._space, V))
        fine = np.ones(len(V), dtype=np.bool_)
        for i in self._named:
            low, high = (spans[i].low, spans[i].high) if i in spans else (self._v[i], self._v[i])
            slack = 1e-9 * self._steps[i]
            fine &= (V[:, i] >= low - slack) & (V[:, i] <= high + slack)
        return V[fine]

    def _outside(self, i: int, spans: Mapping[int, _Span]) -> tuple[Probes, float]:
        """Probe outside one condition.

        Returns:
            The probes, and the harmful share of the random ones; 1 if another one is harmful.
        """
        span, step = spans[i], self._steps[i]
        parameter = self._space.parameters[self._space.variables[i]]
        V = self._drawn(spans, OUTSIDE)
        fixed = [(i, self._nominal[i])]
        if parameter.kind.names:
            others = [k for k in range(len(parameter.kind.names)) if k != span.low]
            V[:, i] = self._random.choice(others, OUTSIDE)
        else:
            # A step away from the bound: closer than that, the statement is only as exact as its
            # digits.
            beyond = []
            if span.below:
                fixed.append((i, span.low - step))
                beyond.append((parameter.low, max(parameter.low, span.low - step)))
            if span.above:
                fixed.append((i, span.high + step))
                beyond.append((min(parameter.high, span.high + step), parameter.high))
            V[:, i] = self._within(beyond)
        harmful, values = self._harmful(np.concatenate([self._moved(fixed), V]))
        # What other parameters leave no room for is no probe.
        is_outside = (values[:, i] < span.low) | (values[:, i] > span.high)
        harmful &= is_outside
        probes = Probes(rows=int(is_outside.sum()), harmful=int(harmful.sum()))
        if harmful[: len(fixed)].any():
            return probes, 1.0
        return probes, float(harmful.sum()) / max(int(is_outside[len(fixed) :].sum()), 1)

    def _within(self, intervals: Sequence[tuple[float, float]]) -> Float:
        """Return random values of some intervals, as many of each as it is wide."""
        widths = np.array([high - low for low, high in intervals])
        at = self._random.random(OUTSIDE) * widths.sum()
        which = np.minimum(np.searchsorted(np.cumsum(widths), at, "right"), len(widths) - 1)
        start = np.concatenate([[0.0], np.cumsum(widths)])[which]
        values: Float = np.array([low for low, _ in intervals])[which] + at - start
        return values

    def _condition(self, i: int, confirmed: tuple[_Span, Probes] | None) -> Condition:
        name, v, nominal = self._space.variables[i], float(self._v[i]), float(self._nominal[i])
        span, outside = confirmed or (_Span(v, v, below=True, above=True), None)
        sign: Literal[">=", "<="] = ">=" if v > nominal else "<="
        near, far, ends = (
            (span.low, span.high, span.above) if sign == ">=" else (span.high, span.low, span.below)
        )
        return Condition(
            name=name,
            unit=self._space.parameters[name].unit,
            sign=sign,
            limit=near,
            until=far if (ends or span.closed) and confirmed else None,
            step=float(self._steps[i]),
            value=v,
            nominal=nominal,
            needs=_words(self._space, name, span),
            outside=outside,
        )


def _words(space: SearchSpace, name: str, span: _Span) -> str:
    """Return the values of a span as people read them: "≥ 3.4 m/s", "from 3.4 to 7 m/s"."""
    parameter = space.parameters[name]
    unit = "" if parameter.unit in _UNITLESS or parameter.kind.names else f" {parameter.unit}"
    text = parameter.kind.text(span.low, _number), parameter.kind.text(span.high, _number)
    low, high = span.low, span.high
    both = (span.below and span.above) or span.closed
    if text[0] == text[1]:
        said = f"= {text[0]}{unit}"
    elif both or parameter.kind.turn is not None:  # neither end of a turn is lower
        said = f"from {text[0]} to {text[1]}{unit}"
    elif span.below:
        said, high = f"≥ {text[0]}{unit}", parameter.high
    else:
        said, low = f"≤ {text[1]}{unit}", parameter.low
    return f"{said} ({parameter.prior.words(low, high)})" if parameter.prior else said


def _number(value: float) -> str:
    """Return a number of four digits; 0 for next to nothing."""
    return f"{value:.4g}" if abs(value) >= 1e-4 else "0"


def others(space: SearchSpace, X: Float, named: Sequence[str]) -> str:
    """Return in words which parameters that no condition names are not at default; "" if none.

    Args:
        space: the search space.
        X: ``(N, len(space.names))``, the minimal scenario, then others of which the conditions
            speak. What is at default in the first alone is named without a value.
        named: the parameters that conditions name.
    """
    moved: list[str] = []
    fixed: list[str] = []
    for name, parameter in space.parameters.items():
        unit = "" if parameter.unit in _UNITLESS or parameter.kind.names else f" {parameter.unit}"
        values, default = X[:, space.index(name)], parameter.kind.text(parameter.default, _number)
        if name in named or all(
            parameter.kind.text(v, _number) == default for v in np.unique(values)
        ):
            continue
        value = parameter.kind.text(values[0], _number)
        text = name if value == default else f"{name} {value}{unit}"
        (fixed if name in space.fixed else moved).append(text)
    allowed = f" or as near as bounds allow ({', '.join(moved)})" if moved else ""
    return allowed + (f" or fixed ({', '.join(fixed)})" if fixed else "")


def sentence(conditions: Sequence[Condition], rest: str = "", *, draws: bool = False) -> str:
    """Return when the driver fails, in words: conditions that are confirmed, then examples.

    Args:
        conditions: all.
        rest: which other parameters are not at default, see `others`.
        draws: whether the driver draws random numbers, to which the statement is then confined.
    """
    noise = f", {_NOISE}" if draws else ""
    if not conditions:
        return f"fails already with all parameters at their defaults{rest}{noise}"
    needs = [
        f"{condition.name} {condition.needs}" for condition in conditions if condition.confirmed
    ]
    examples = [
        f"{condition.name} {condition.needs}" for condition in conditions if not condition.confirmed
    ]
    end = f", other parameters at default{rest}{noise}"
    if not needs:
        return f"fails, for example, with {_listed(examples)}{end}"
    if not examples:
        return f"fails if {_listed(needs)}{end}"
    return f"with {_listed(examples)}, for example, fails if {_listed(needs)}{end}"


def _listed(texts: Sequence[str]) -> str:
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} and {texts[-1]}"
