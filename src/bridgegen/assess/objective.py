"""Metrics → F, what a search minimises; and which scenarios count as critical.

The paper's fitness grows with criticality, so F = −fitness. Its single objective is a weighted sum
of metrics; the weights are fixed, or come from the entropy of a random sample (Eqs. 4 to 7). The
default is ``harm`` (`bridgegen.assess.conflict.harm`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from math import isfinite
from typing import Any, Literal, Self, get_args

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.harm import NEAR_MISS, Count
from bridgegen.assess.conflict.quantities import HARM, HARM_ANY
from bridgegen.assess.criteria import quantity
from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, as_float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.scenario.language.thresholds import Thresholds

Weights = Literal["fixed", "entropy"]
Scale = Literal["raw", "standardised"]
Objectives = Literal["one", "many"]
Rule = Literal["harm", "thresholds", "criteria"]
"""Rule by which a scenario is critical: its harm, the paper's thresholds, or a violated
criterion."""

RULES: tuple[Rule, ...] = get_args(Rule)

CLASSIFYING = ("n_collision", "d_min", "v_d")
"""The metrics that the paper's thresholds read."""

# The unit of a metric in the paper's fitness, as a factor on ours: its v_d is in km/h.
PAPER_FACTOR = {"v_d": 3.6}


@dataclass(frozen=True)
class Objective:
    """The rule that turns metrics into F and decides which scenarios are critical.

    Every metric is first positivised, x' = value where larger is more critical and −value where
    smaller is, values beyond the metric's cap counting as the cap. Then, on the scale

    - ``raw``: x' in the paper's units, so that F = 0.8297·d_min [m] − 0.1703·v_d [km/h] is the
      paper's;
    - ``standardised``: r = (x' − low) / span with the sample's minimum and range (Eq. 4). r is not
      clipped, for a search is meant to leave the sample's range.

    ``one`` objective is F = −Σ w·x'; ``many`` are a column −x' per term, in which weights have no
    part. Build one by ``Objective.build``; ``to_dict`` and ``from_dict`` keep it exactly.

    Attributes:
        names: the terms' metrics.
        weights: one per term, ≥ 0; 1 each with ``many``.
        scale: "raw" or "standardised".
        objectives: "one" or "many".
        thresholds: when a scenario is critical by the rule "thresholds".
        rule: what makes a scenario critical: "harm", a collision or near miss of the ego's (see
            `bridgegen.assess.conflict.harm`), "thresholds", or "criteria", a violation of one of
            ``criteria``.
        count: whose conflicts count as harm: "ego", those that the ego is responsible for or could
            have prevented; or "any".
        low: the sample's least x' per term; empty on the raw scale.
        span: the sample's range of x' per term, > 0; empty on the raw scale.
        criteria: the names of the margins that make a scenario critical below 0 by the rule
            "criteria"; else empty.
        gated: whether implausible scenarios are neither critical nor fit. Only the paper's
            evaluation counts them, as printed.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    scale: Scale = "raw"
    objectives: Objectives = "one"
    thresholds: Thresholds = field(default_factory=Thresholds)
    low: tuple[float, ...] = ()
    span: tuple[float, ...] = ()
    rule: Rule = "thresholds"
    count: Count = "ego"
    criteria: tuple[str, ...] = ()
    gated: bool = True

    def __post_init__(self) -> None:
        for name in self.names:
            quantity(name)
        _choice("scale", self.scale, ("raw", "standardised"))
        _choice("number of objectives", self.objectives, ("one", "many"))
        _choice("rule of what is critical", self.rule, RULES)
        _choice("conflicts that count", self.count, ("ego", "any"))
        n = len(self.names)
        n_scale = n if self.scale == "standardised" else 0
        problems = []
        if (self.rule == "criteria") != bool(self.criteria):
            problems.append(f"rule {self.rule} with criteria {list(self.criteria)}")
        if not n or len(set(self.names)) < n:
            problems.append(f"an objective needs metrics, each once, got {list(self.names)}")
        if len(self.weights) != n or not all(isfinite(w) and w >= 0.0 for w in self.weights):
            problems.append(f"an objective needs {n} finite weights ≥ 0, got {list(self.weights)}")
        elif n and not any(self.weights):
            problems.append("an objective needs a weight > 0, all are 0")
        if len(self.low) != n_scale or not all(isfinite(value) for value in self.low):
            problems.append(f"'low' needs {n_scale} finite numbers, got {list(self.low)}")
        if len(self.span) != n_scale or not all(isfinite(s) and s > 0.0 for s in self.span):
            problems.append(f"'span' needs {n_scale} finite numbers > 0, got {list(self.span)}")
        if problems:
            raise InputError(*problems)

    @classmethod
    def build(
        cls,
        terms: Sequence[tuple[str, float | None]],
        *,
        weights: Weights = "fixed",
        scale: Scale = "raw",
        objectives: Objectives = "one",
        thresholds: Thresholds | None = None,
        rule: Rule = "thresholds",
        count: Count = "ego",
        criteria: Sequence[str] = (),
        gated: bool = True,
        sample: tuple[npt.ArrayLike, Sequence[str]] | None = None,
    ) -> Self:
        """Return the objective, its weights and scale taken from a random sample where asked to.

        Args:
            terms: metric and weight; the weight is None with entropy weights, and has no part in
                many objectives.
            weights: "fixed", or "entropy" of the sample.
            scale: "raw" or "standardised" by the sample.
            objectives: "one" weighted sum, or "many", one per term (weights are then not used).
            thresholds: when a scenario is critical; the paper's by default.
            rule: "harm", "thresholds" or "criteria".
            criteria: the margins that count by the rule "criteria".
            gated: whether implausible scenarios are neither critical nor fit.
            count: whose conflicts count as harm: "ego" or "any". With "any", the term ``harm``
                means ``harm_any``.
            sample: metrics ``(m, M)`` of m random scenarios and the M columns' names; failed rows
                (NaN) are left out. Needed where ``needs_sample`` says so.

        Raises:
            UnknownNameError: no such metric, way of weighting, scale or number of objectives.
            InputError: a weight is missing, superfluous or not a finite number ≥ 0; a metric comes
                twice; every scenario of the sample failed.
            ValueError: the sample is missing or lacks a column.
        """
        if count == "any":
            terms = [(HARM_ANY if name == HARM else name, weight) for name, weight in terms]
        names = tuple(name for name, _ in terms)
        for name in names:
            quantity(name)
        _choice("way of weighting", weights, ("fixed", "entropy"))
        wrong = [n for n, w in terms if (w is None) == (weights == "fixed")]
        if wrong and objectives == "one":
            need = "need a weight for" if weights == "fixed" else "leave no place for a weight of"
            raise InputError(*(f"{weights} weights {need} {name}" for name in wrong))
        resolved = tuple(1.0 if w is None or objectives == "many" else float(w) for _, w in terms)
        low: tuple[float, ...] = ()
        span: tuple[float, ...] = ()
        if needs_sample(weights, scale, objectives):
            if sample is None:
                raise ValueError(f"{weights} weights on the {scale} scale need a sample")
            x = positivised(*sample, names)
            x = x[~np.isnan(x).any(axis=1)]
            if not len(x):
                raise InputError("an objective needs a sample, and every scenario of it failed")
            least, extent = _range(x)
            if scale == "standardised":
                low, span = tuple(least.tolist()), tuple(extent.tolist())
            if weights == "entropy" and objectives == "one":
                resolved = tuple(entropy_weights((x - least) / extent).tolist())
        given = thresholds or Thresholds()
        return cls(
            names,
            resolved,
            scale,
            objectives,
            given,
            low,
            span,
            rule,
            count,
            tuple(criteria),
            gated,
        )

    @property
    def n_obj(self) -> int:
        """Columns of F."""
        return 1 if self.objectives == "one" else len(self.names)

    @property
    def harm(self) -> str:
        """The quantity that the rule "harm" reads."""
        return HARM_ANY if self.count == "any" else HARM

    @property
    def classifying(self) -> tuple[str, ...]:
        """The quantities that the rule reads."""
        if self.rule == "criteria":
            return self.criteria
        return (self.harm,) if self.rule == "harm" else CLASSIFYING

    @property
    def needed_metrics(self) -> tuple[str, ...]:
        """The quantities that F and the rule read, each once, the terms' first."""
        return tuple(dict.fromkeys((*self.names, *self.classifying)))

    def F(
        self, metrics: npt.ArrayLike, names: Sequence[str], fit: npt.ArrayLike = True
    ) -> tuple[Float, Bool]:
        """Return F and which rows of it are results.

        Args:
            metrics: ``(N, M)``, in the metrics' units, NaN where the scenario failed.
            names: of the M columns; more than the objective's may be there.
            fit: ``(N,)`` bool, False where a scenario is no result whatever its metrics say.

        Returns:
            F: ``(N, n_obj)`` float64, finite, smaller is more critical.
            ok: ``(N,)`` bool, False where the scenario failed. F of such a row is a filler that no
            scenario is worse than, F of all metrics at their caps, and no result.

        Raises:
            ValueError: a column is missing.
        """
        x = self._scaled(positivised(metrics, names, self.names))
        ok: Bool = np.logical_not(np.isnan(x).any(axis=1)) & np.asarray(fit, dtype=np.bool_)
        caps = np.array([[quantity(name).cap for name in self.names]])
        # A failed row counts as one whose metrics are all at their caps: no scenario is less
        # critical.
        x[~ok] = self._scaled(positivised(caps, self.names, self.names))
        if self.objectives == "many":
            return 0.0 - x, ok
        # Column by column: a matrix product's rounding may depend on the number of rows.
        total = np.zeros(len(x))
        for j, weight in enumerate(self.weights):
            total -= weight * x[:, j]
        return total[:, np.newaxis], ok

    def critical(self, metrics: npt.ArrayLike, names: Sequence[str]) -> Bool:
        """Return which scenarios are critical, ``(N,)`` bool; failed ones are not.

        Raises:
            ValueError: a column is missing.
        """
        values = as_float("metrics", metrics, (None, len(names)), finite=False)
        if self.rule == "harm":
            harmful: Bool = values[:, _column(names, self.harm)] >= NEAR_MISS
            return harmful
        if self.rule == "criteria":
            columns = [_column(names, name) for name in self.criteria]
            violated: Bool = np.any(values[:, columns] < 0.0, axis=1)
            return violated
        n_collision, d_min, v_d = (values[:, _column(names, name)] for name in CLASSIFYING)
        limit = self.thresholds
        close = (d_min < limit.d_min_below) & (v_d >= limit.v_d_at_least)
        critical: Bool = (n_collision > limit.n_collision_above) | close
        return critical

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON's types; ``from_dict`` gives back an equal objective."""
        return {
            key: list(value) if isinstance(value, tuple) else value
            for key, value in asdict(self).items()
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Return the objective that ``to_dict`` wrote.

        Raises:
            InputError: a key is unknown or missing, or a value breaks a rule.
        """
        if not isinstance(data, Mapping):
            raise InputError(f"not an objective: {data!r}")
        # Earlier versions had no others.
        data = {"rule": "thresholds", "count": "ego", "criteria": [], **data}
        data = {"gated": data["rule"] != "thresholds", **data}
        if odd := set(data) ^ {field.name for field in fields(cls)}:
            raise InputError(f"unknown or missing keys of an objective: {sorted(odd)}")
        try:
            values: dict[str, Any] = {
                key: tuple(value) if isinstance(value, list) else value
                for key, value in data.items()
            }
            values["thresholds"] = Thresholds(**data["thresholds"])
            return cls(**values)
        except (AttributeError, OverflowError, TypeError, ValueError) as error:
            raise InputError(f"not an objective: {error}") from None

    def _scaled(self, x: Float) -> Float:
        if self.scale == "standardised":
            scaled: Float = (x - np.array(self.low)) / np.array(self.span)
        else:
            scaled = x * np.array([PAPER_FACTOR.get(name, 1.0) for name in self.names])
        return scaled


def needs_sample(weights: Weights, scale: Scale, objectives: Objectives = "one") -> bool:
    """Whether an objective of this kind is built from a random sample."""
    return scale == "standardised" or (weights == "entropy" and objectives == "one")


def positivised(metrics: npt.ArrayLike, names: Sequence[str], wanted: Sequence[str]) -> Float:
    """Return the wanted columns as x', larger = more critical, capped; ``(N, len(wanted))``."""
    values = as_float("metrics", metrics, (None, len(names)), finite=False)
    x = np.empty((len(values), len(wanted)))
    for j, name in enumerate(wanted):
        metric = quantity(name)
        column = metric.sign * values[:, _column(names, name)]
        x[:, j] = np.maximum(column, metric.sign * metric.cap)
    return x


def entropy_weights(R: npt.ArrayLike) -> Float:
    """Return the entropy weight of every metric.

    Args:
        R: ``(m, n)``, n standardised metrics r ≥ 0 (Eq. 4) of m ≥ 1 scenarios.

    Returns:
        ``(n,)`` float64, ≥ 0, of sum 1. A constant column carries no information and weighs 0; if
        all are constant (as always with m = 1), none is better than another and all weigh 1/n.

    Raises:
        ValueError: not a finite matrix of numbers ≥ 0 with a row and a column.

    Source: paper, Eqs. 5 to 7. Eq. 6 is printed with a sum over the metrics j; read over the
    samples i, for an entropy needs Σ_i p_ij = 1. p ln p is 0 at p = 0.
    """
    r = as_float("R", R, (None, None))
    if not r.size or (r < 0.0).any():
        raise ValueError(f"R must be a matrix of numbers ≥ 0, got shape {r.shape}")
    m, n = r.shape
    varies = r.max(axis=0) > r.min(axis=0)
    if not varies.any():
        return np.full(n, 1.0 / n)
    total = np.where(varies, r.sum(axis=0), 1.0)
    p = r / total
    E = -(p * elementary.log(np.where(p > 0.0, p, 1.0))).sum(axis=0) / elementary.log(m)
    information = np.where(varies, np.maximum(1.0 - E, 0.0), 0.0)
    if not information.any():  # all vary by less than rounding can tell
        information = varies.astype(np.float64)
    weights: Float = information / information.sum()
    return weights


def _range(x: Float) -> tuple[Float, Float]:
    """Least value and range per column; 1 for a constant one: changes then count as they are."""
    least, extent = x.min(axis=0), np.ptp(x, axis=0)
    return least, np.where(extent > 0.0, extent, 1.0)


def _column(names: Sequence[str], name: str) -> int:
    if name not in names:
        raise ValueError(f"metrics need a column '{name}', there are {list(names)}")
    return list(names).index(name)


def _choice(kind: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise UnknownNameError(kind, value, known)
