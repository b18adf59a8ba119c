"""An exposure fitted to recorded events: forms chosen, tested, fitted again to resampled events.

Goodness of fit: Kolmogorov's distance, its p value by parametric bootstrap, because the table of
the plain test does not hold for numbers that were fitted (Stute, Gonzáles Manteiga and Presedo
Quindimil, Metrika 40 (1993) 243-256). Dependence: correlation of normal scores (van der Waerden),
or Student's copula where Akaike's criterion prefers it.
Bands: the 2.5 and 97.5 % quantiles of fits to events that were drawn with replacement.
"""

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import scipy

from bridgegen.base.arrays import Float, as_float
from bridgegen.base.errors import InputError
from bridgegen.base.units import percent
from bridgegen.scenario.exposure.candidates import Candidate, candidates, fit
from bridgegen.scenario.exposure.dependence import BETTER, fit_freedom, scatter
from bridgegen.scenario.exposure.exposure import WEIGHED, Exposure
from bridgegen.scenario.exposure.forms import Naming, build_marginal
from bridgegen.scenario.exposure.marginals import Conditional, Form, Marginal
from bridgegen.scenario.exposure.reader import build_exposure, chosen_exposure, exposure_text
from bridgegen.scenario.exposure.tables import cell_reader, read_header, read_table
from bridgegen.scenario.language.exposure_schema import MarginalSection
from bridgegen.scenario.language.parameterisation import Parameterisation
from bridgegen.scenario.language.parameters import Parameter, nearest
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.scenario import LogicalScenario

WIDEST = 0.2
"""Largest error of the data's distribution function, with 95 % confidence."""

LEAST_ROWS = math.ceil(math.log(2.0 / 0.05) / (2.0 * WIDEST**2))
"""Least number of rows of a fit, 47, by the inequality of Dvoretzky, Kiefer, Wolfowitz and
Massart."""

BINS = 20
"""Number of bins in which events are added to a prior."""

GRID = 201
"""Number of points at which a density and its band are known."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class ParameterFit:
    """How the values of one parameter are distributed.

    Attributes:
        name: of the parameter.
        unit: of it.
        values: ``(n,)`` that were fitted, ascending.
        section: the form as a file has it.
        marginal: the form.
        form: it in words.
        ranking: the form that was taken, then the others, best first, each with its criterion.
        distance: Kolmogorov's, of data and form; NaN for single values.
        p: the probability of a larger distance if the form were true; NaN likewise.
        at: ``(GRID,)`` values; those that it takes, for single values.
        density: ``(GRID,)`` of the form; probabilities, for single values.
        band: ``(2, GRID)`` the 95 % band of the density.
        quantiles: ``(n,)`` of the form at (i - 0.5)/n, for a quantile plot.
        envelope: ``(2, n)`` within which 95 % of each ordered value lie if the form is true.
    """

    name: str
    unit: str
    values: Float
    section: dict[str, Any]
    marginal: Form
    form: str
    ranking: tuple[tuple[str, float], ...]
    distance: float
    p: float
    at: Float
    density: Float
    band: Float
    quantiles: Float
    envelope: Float


@dataclass(frozen=True)
class Fit:
    """An exposure and what it was fitted to.

    Attributes:
        exposure: the same as reading ``text`` gives.
        text: the file.
        rows: events that were given.
        used: of them, those with all values in the scenario's ranges.
        infeasible: of these, how many break a constraint of the scenario, by rule.
        outside: a sentence for each parameter with values outside its range.
        parameters: by name.
        correlated: the parameters of ``correlation``.
        correlation: ``(d, d)`` of normal scores.
        correlation_band: ``(2, d, d)`` its 95 % band.
        freedom: degrees of freedom of Student's copula; None: it is Gaussian.
        replicates: exposures of the same forms, fitted to resampled events: how uncertain the data
            leave it.
        seed: of all chance.
        notes: what else there is to know, a sentence each.
    """

    exposure: Exposure
    text: str
    rows: int
    used: int
    infeasible: dict[str, int]
    outside: tuple[str, ...]
    parameters: dict[str, ParameterFit]
    correlated: tuple[str, ...]
    correlation: Float
    correlation_band: Float
    freedom: float | None
    replicates: tuple[Exposure, ...]
    seed: int
    notes: tuple[str, ...]

    def facts(self) -> Iterator[str]:
        """Yield what was found, a few words each."""
        yield f"{self.used:,} of {self.rows:,} events fitted"
        encounters = self.exposure.encounters
        if encounters is not None:
            for unit, rate in (("h", encounters.per_hour), ("km", encounters.per_km)):
                if rate is not None:
                    yield rate.in_words(unit)
        yield f"{percent(self.exposure.feasible_share.estimate)} keep the constraints"
        yield f"seed {self.seed}"
        if self.exposure.weighed:
            yield f"{percent(LEAST_ROWS / (self.used + LEAST_ROWS))} of it is the prior"

    def remarks(self) -> list[str]:
        """Return what a reader must know, a sentence each."""
        broken = [f"{count} events break '{rule}'" for rule, count in self.infeasible.items()]
        return [*self.outside, *broken, *self.notes]


def fit_exposure(
    scenario: LogicalScenario,
    events: str | Path | Mapping[str, npt.ArrayLike],
    *,
    hours: float | None = None,
    km: float | None = None,
    ignore: Sequence[str] = (),
    others: Literal["uniform", "default"] | None = None,
    source: str | None = None,
    prior: str | Path | Exposure | None = None,
    parameterisation: Parameterisation | None = None,
    replicates: int = 200,
    seed: int = 0,
    progress: Progress | None = None,
) -> Fit:
    """Fit the exposure of a scenario to recorded events.

    Args:
        scenario: of which the events are encounters.
        events: a table (.csv) with a row per event and a column per parameter, in the scenario's
            units; or columns by name, ``(n,)`` each.
        hours: of driving in which all events were counted [h].
        km: likewise [km].
        ignore: columns that are no parameters.
        others: searched parameters that have no column: spread evenly, or at their default.
        source: where the events come from, for the file.
        prior: an exposure that counts as `LEAST_ROWS` events besides these, see `_weighted`; as for
            `chosen_exposure`.
        parameterisation: what the parameters leave out of recorded events, for the file.
        replicates: how many times events are resampled, and how many samples the p values take.
        seed: of all chance, at least 0.
        progress: called with the number of parameters done, and of all.

    Raises:
        FileFormatError: the table cannot be read.
        InputError: a column that is no parameter, too few rows, a column with one value, or what
            the exposure then breaks.
    """
    if replicates < 20:
        raise InputError(f"replicates must be at least 20 for a 95 % band, got {replicates}")
    if seed < 0:
        raise InputError(f"seed must be at least 0, got {seed}")
    columns, origin = _columns(scenario, events, ignore)
    rest = [name for name in scenario.space().variables if name not in columns]
    if rest and others is None:
        raise InputError(
            f"{len(rest)} searched parameters have no column: add --without-column uniform or "
            f"default (in Python others=…): {', '.join(rest)}"
        )
    rows = len(next(iter(columns.values())))
    inside, outside = _inside(scenario, columns)
    used = int(inside.sum())
    before = None if prior is None else chosen_exposure(scenario, prior)
    if used < (LEAST_ROWS if before is None else 1):
        raise InputError(
            f"a fit needs {LEAST_ROWS} events in the scenario's ranges, got {used} of {rows}: "
            f"fewer leave the distribution function unknown by more than {WIDEST:g} (95 %); "
            "with --prior EXPOSURE, fewer are weighed against an exposure that you trust",
            *outside,
        )
    columns = {name: np.ascontiguousarray(column[inside]) for name, column in columns.items()}
    if before is None:
        _refuse_constant(scenario, columns)
    fitted: dict[str, ParameterFit] = {}
    refits: dict[str, list[Form]] = {}
    # The same resampled events for all parameters: rows are drawn whole, which keeps their
    # dependence.
    draws = [_generator(seed, 0, k).integers(0, used, used) for k in range(replicates)]
    for number, (name, values) in enumerate(columns.items()):
        if progress is not None:
            progress(number, len(columns))
        parameter = scenario.parameters[name]
        if before is None:
            fitted[name], refits[name] = _fit_parameter(parameter, values, draws, seed, number)
        else:
            fitted[name], refits[name] = _weighted(
                parameter, values, draws, before.marginals[name], seed, number
            )
    correlated = tuple(name for name in columns if not scenario.parameters[name].kind.apart)
    scores = np.array([_normal_scores(columns[name]) for name in correlated])
    correlation = _correlation(scores)
    freedom, gain = math.inf, 0.0
    if before is None:
        freedom, gain = fit_freedom(correlated, scores, correlation)
        correlation = scatter(scores, correlation, freedom)
    extreme = (
        f"parameters are extreme together: Student's copula with {freedom:g} degrees of freedom is "
        f"better than the Gaussian one by {gain:.1f} of Akaike's criterion"
    )
    again = (
        np.array([_normal_scores(columns[name][rows]) for name in correlated]) for rows in draws
    )
    resampled = np.array([scatter(item, _correlation(item), freedom) for item in again])
    weighed = ""
    if before is not None:
        freedom = before.copula.freedom
        share = used / (used + LEAST_ROWS)
        at = [before.names.index(name) for name in correlated]
        known = before.copula.matrix[np.ix_(at, at)]
        correlation = share * correlation + (1.0 - share) * known
        resampled = share * resampled + (1.0 - share) * known
        weighed = (
            f"{WEIGHED} {used} events count {percent(share)}, and {percent(1.0 - share)} "
            f"is the prior ({before.source.strip().rstrip('.')})."
        )
    data: dict[str, Any] = {
        "exposure_of": scenario.name,
        "exposure": {
            "source": " ".join(filter(None, [_source(source, origin, used), weighed])),
            **({"others": others} if others else {}),
            "parameters": {name: parameter_fit.section for name, parameter_fit in fitted.items()},
            "dependence": {
                "correlation": _pairs(correlated, correlation),
                **({"degrees_of_freedom": freedom} if math.isfinite(freedom) else {}),
            },
            **({"parameterisation": parameterisation.model_dump()} if parameterisation else {}),
        },
    }
    # The fitted exposure is read from the text that is written, so that the file gives the same
    # distribution as the fit, rounding included.
    exposure, infeasible = _built(data, scenario, columns)
    if hours is not None or km is not None:
        given = {"hours": hours, "km": km}
        data["exposure"]["encounters"] = {
            # Only events that the distribution can give: rates and shapes then speak of the same
            # encounters.
            "count": used - sum(infeasible.values()),
            **{key: float(value) for key, value in given.items() if value is not None},
            "source": f"Events in the scenario's ranges that keep its constraints, {origin}.",
        }
        exposure, _ = _built(data, scenario, columns)
    if progress is not None:
        progress(len(columns), len(columns))
    return Fit(
        exposure=exposure,
        text=exposure_text(data),
        rows=rows,
        used=used,
        infeasible=infeasible,
        outside=outside,
        parameters=fitted,
        correlated=correlated,
        correlation=correlation,
        correlation_band=np.quantile(resampled, [0.025, 0.975], axis=0),
        freedom=freedom if math.isfinite(freedom) else None,
        replicates=_replicated(exposure, refits, correlated, resampled),
        seed=seed,
        notes=(
            *([weighed] if weighed else []),
            *([extreme] if gain >= BETTER else []),
            *_notes(exposure, scenario, columns),
        ),
    )


def _columns(
    scenario: LogicalScenario,
    events: str | Path | Mapping[str, npt.ArrayLike],
    ignore: Sequence[str],
) -> tuple[dict[str, Float], str]:
    """Return the columns of the scenario's parameters, in its order, and where they come from."""
    path = None if isinstance(events, Mapping) else Path(events)
    header = tuple(events) if isinstance(events, Mapping) else read_header(Path(events))
    parameters = scenario.parameters
    where = f" ({path}, line 1)" if path else ""
    problems = [
        f"ignore names the column '{name}', which there is not{nearest(name, header)}{where}"
        for name in ignore
        if name not in header
    ]
    for name in header:
        if name in ignore:
            continue
        if name not in parameters:
            problems.append(
                f"the column '{name}' is no parameter of {scenario.name}"
                f"{nearest(name, parameters)}; ignore it by --ignore {name}{where}"
            )
        elif parameters[name].low == parameters[name].high:
            problems.append(f"{name} does not vary in {scenario.name}: ignore its column{where}")
    wanted = [name for name in parameters if name in header and name not in ignore]
    if not wanted and not problems:
        problems.append(f"the events must have a column of a parameter of {scenario.name}{where}")
    if problems:
        raise InputError(*problems)
    if path is not None:
        readers = {name: cell_reader(parameters[name]) for name in wanted}
        columns = read_table(path, readers).columns
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:12]
        return columns, f"{path.name} (SHA-256 {digest}…)"
    assert isinstance(events, Mapping)
    return {name: as_float(name, events[name], (None,)) for name in wanted}, "given as arrays"


def _inside(
    scenario: LogicalScenario, columns: Mapping[str, Float]
) -> tuple[npt.NDArray[np.bool_], tuple[str, ...]]:
    """Return the rows with all values in their ranges, and a sentence for each that has others."""
    count = len(next(iter(columns.values())))
    good = np.ones(count, np.bool_)
    sentences = []
    for name, values in columns.items():
        parameter = scenario.parameters[name]
        if len(values) != count:
            raise InputError(f"columns must have the same length, got {count} and {len(values)}")
        mine = (parameter.low <= values) & (values <= parameter.high)
        kept = parameter.kind.kept(values)
        if kept is not None and not kept[0].all():
            raise InputError(f"{name} must be {kept[1]}, got {values[~kept[0]][0]:g}")
        if not mine.all():
            low, high = min(parameter.low, values.min()), max(parameter.high, values.max())
            sentences.append(
                f"{name} [{parameter.unit}]: {count - int(mine.sum())} of {count} values are "
                "outside "
                f"{parameter.low:g} to {parameter.high:g}; low: {low:g}, high: {high:g} would hold "
                "them"
            )
        good &= mine
    return good, tuple(sentences)


def _refuse_constant(scenario: LogicalScenario, columns: Mapping[str, Float]) -> None:
    problems = [
        f"{name} [{scenario.parameters[name].unit}] has one value, {values[0]:g}, in all rows: "
        f"ignore its column"
        for name, values in columns.items()
        if values.min() == values.max() and not scenario.parameters[name].kind.apart
    ]
    if problems:
        raise InputError(*problems)


def _fit_parameter(
    parameter: Parameter,
    values: Float,
    draws: Sequence[npt.NDArray[np.int64]],
    seed: int,
    number: int,
) -> tuple[ParameterFit, list[Form]]:
    """Return the best form of a parameter's values, and the same form fitted to resampled ones."""
    if parameter.kind.apart:
        return _fit_single(parameter, values, draws)
    low, high = parameter.low, parameter.high
    found = candidates(values, low, high)
    best = found[0]
    marginal = _form(best.section, parameter)
    refits = _refits(best, parameter, (values[rows] for rows in draws))
    n = len(values)
    shares = (np.arange(n) + 0.5) / n
    ordered = np.sort(values)
    distances, sorted_samples = [], []
    refit = partial(fit, recipe=best.recipe, low=low, high=high, near=best.section)
    for k in range(len(draws)):
        # A stream for each parameter and sample: a column more changes the others' p values by
        # nothing.
        uniform = _generator(seed, 1 + number, k).random(n)
        sample = np.sort(_at_share(marginal, uniform))
        again = refit(sample)
        distances.append(_distance(sample, _form(again.section, parameter) if again else marginal))
        sorted_samples.append(sample)
    distance = _distance(ordered, marginal)
    larger = sum(value >= distance for value in distances)
    at = np.linspace(low, high, GRID)
    return ParameterFit(
        name=parameter.name,
        unit=parameter.unit,
        values=ordered,
        section=best.section,
        marginal=marginal,
        form=best.recipe.text,
        ranking=tuple((candidate.recipe.text, candidate.criterion) for candidate in found),
        distance=distance,
        # Plus one, for the data themselves: a p value of 0 would claim more than so many samples
        # can say.
        p=(1 + larger) / (1 + len(draws)),
        at=at,
        density=np.exp(marginal.log_density(at)),
        band=np.quantile(
            [np.exp(shared.log_density(at)) for shared in refits], [0.025, 0.975], axis=0
        ),
        quantiles=_at_share(marginal, shares),
        envelope=np.quantile(sorted_samples, [0.025, 0.975], axis=0),
    ), refits


def _refits(best: Candidate, parameter: Parameter, samples: Any) -> list[Form]:
    """Return the form fitted to other values; where that fails, as it was."""
    made = []
    for sample in samples:
        again = fit(sample, best.recipe, parameter.low, parameter.high, best.section)
        made.append(_form((again or best).section, parameter))
    return made


def _fit_single(
    parameter: Parameter, values: Float, draws: Sequence[npt.NDArray[np.int64]]
) -> tuple[ParameterFit, list[Form]]:
    """Return the shares of single values."""

    def section(sample: Float) -> dict[str, Any]:
        seen, counts = np.unique(np.round(sample), return_counts=True)
        written = [parameter.kind.written(item) for item in seen.tolist()]
        return {"distribution": "discrete", "values": written, "weights": counts.tolist()}

    best = section(values)
    at = np.unique(np.round(values))
    marginal = _form(best, parameter)
    refits = [_form(section(values[rows]), parameter) for rows in draws]
    with np.errstate(divide="ignore"):
        densities = [np.exp(refit.log_density(at)) for refit in refits]
    nothing = np.empty(0)
    return ParameterFit(
        name=parameter.name,
        unit=parameter.unit,
        values=np.sort(values),
        section=best,
        marginal=marginal,
        form="shares",
        ranking=(),
        distance=math.nan,
        p=math.nan,
        at=at,
        density=np.exp(marginal.log_density(at)),
        band=np.quantile(densities, [0.025, 0.975], axis=0),
        quantiles=nothing,
        envelope=np.empty((2, 0)),
    ), refits


def _weighted(
    parameter: Parameter,
    values: Float,
    draws: Sequence[npt.NDArray[np.int64]],
    before: Marginal | Conditional,
    seed: int,
    number: int,
) -> tuple[ParameterFit, list[Form]]:
    """Return the mean of a Dirichlet distribution's posterior: a histogram, or shares.

    The prior counts as `LEAST_ROWS` events, spread over `BINS` bins or single values as it says;
    the events are added to these. Then n events have the weight n / (n + LEAST_ROWS).

    Source: Ferguson, A Bayesian analysis of some nonparametric problems, Annals of Statistics 1
    (1973) 209-230, section 5a.
    """
    if isinstance(before, Conditional):
        raise InputError(
            f"the prior of {parameter.name} depends on other parameters; a prior must say how it "
            "is distributed by itself"
        )
    low, high, is_apart = parameter.low, parameter.high, parameter.kind.apart
    if is_apart:
        at = np.arange(math.ceil(low), math.floor(high) + 1.0)
        edges = np.append(at - 0.5, at[-1] + 0.5)
        chances = np.exp(before.log_density(at))
    else:
        at, edges = np.linspace(low, high, GRID), np.linspace(low, high, BINS + 1)
        chances = np.diff(before.tails(edges)[0])
    chances = chances / chances.sum()

    def section(sample: Float) -> dict[str, Any]:
        weights = LEAST_ROWS * chances + np.histogram(sample, edges)[0]
        if not is_apart:
            return {
                "distribution": "histogram",
                "edges": edges.tolist(),
                "weights": [float(f"{weight:.6g}") for weight in weights],
            }
        there = [(float(v), float(f"{w:.6g}")) for v, w in zip(at, weights, strict=True) if w > 0.0]
        return {
            "distribution": "discrete",
            "values": [parameter.kind.written(value) for value, _ in there],
            "weights": [weight for _, weight in there],
        }

    best, ordered, n = section(values), np.sort(values), len(values)
    marginal = _form(best, parameter)
    assert not isinstance(marginal, Conditional)
    refits = [_form(section(values[rows]), parameter) for rows in draws]
    with np.errstate(divide="ignore"):
        densities = [np.exp(refit.log_density(at)) for refit in refits]
    samples = [
        np.sort(_at_share(marginal, _generator(seed, 1 + number, k).random(n)))
        for k in range(len(draws))
    ]
    return ParameterFit(
        name=parameter.name,
        unit=parameter.unit,
        values=ordered,
        section=best,
        marginal=marginal,
        form="prior and events",
        ranking=(),
        distance=math.nan if is_apart else _distance(ordered, marginal),
        # Not tested: the prior is not of these events, and may well be another distribution.
        p=math.nan,
        at=at,
        density=np.exp(marginal.log_density(at)),
        band=np.quantile(densities, [0.025, 0.975], axis=0),
        quantiles=_at_share(marginal, (np.arange(n) + 0.5) / n),
        envelope=np.quantile(samples, [0.025, 0.975], axis=0),
    ), refits


def _form(section: dict[str, Any], parameter: Parameter) -> Form:
    """Return what a section of a fit stands for."""
    given = MarginalSection.model_validate(section)
    made = build_marginal(given, parameter, Naming(frozenset(), {}, None), "")
    assert not isinstance(made, Conditional)
    return made


def _at_share(marginal: Marginal, share: Float) -> Float:
    return marginal.value(np.minimum(share, 1.0 - share), share > 0.5)


def _distance(ordered: Float, marginal: Marginal) -> float:
    """Return Kolmogorov's distance between ordered values and a distribution."""
    below, _ = marginal.tails(ordered)
    n = len(ordered)
    steps = np.arange(n + 1) / n
    return float(max((steps[1:] - below).max(), (below - steps[:-1]).max()))


def _normal_scores(values: Float) -> Float:
    ranks = scipy.stats.rankdata(values)
    scores: Float = scipy.special.ndtri(ranks / (len(values) + 1.0))
    return scores


def _correlation(scores: Float) -> Float:
    """Return correlations ``(d, d)``; 0 where resampled values are all the same."""
    d = len(scores)
    matrix = np.eye(d)
    for i in range(d):
        for j in range(i):
            over = math.sqrt(float((scores[i] ** 2).sum() * (scores[j] ** 2).sum()))
            value = float((scores[i] * scores[j]).sum()) / over if over > 0.0 else 0.0
            matrix[i, j] = matrix[j, i] = value
    return matrix


def _pairs(names: Sequence[str], matrix: Float) -> list[dict[str, Any]]:
    return [
        {"between": [names[j], names[i]], "value": round(float(matrix[i, j]), 4)}
        for i in range(len(names))
        for j in range(i)
    ]


def _source(source: str | None, origin: str, used: int) -> str:
    fitted = f"Fitted by BridgeGen {version('bridgegen')} to {used} events, {origin}."
    return f"{source} {fitted}" if source else fitted


def _built(
    data: dict[str, Any], scenario: LogicalScenario, columns: Mapping[str, Float]
) -> tuple[Exposure, dict[str, int]]:
    """Return the exposure of a file's data, and how many events break which constraint first."""
    document = read_plain_yaml(exposure_text(data).encode(), "the fitted exposure")
    exposure = build_exposure(document.below("exposure"), scenario, None)
    X = exposure.rows(columns)
    infeasible: dict[str, int] = {}
    left = np.ones(len(X), np.bool_)
    for rule, bad in exposure.broken(X):
        if count := int((bad & left).sum()):
            infeasible[rule] = count
        left &= ~bad
    return exposure, infeasible


def _replicated(
    exposure: Exposure,
    refits: Mapping[str, Sequence[Form]],
    correlated: tuple[str, ...],
    matrices: Float,
) -> tuple[Exposure, ...]:
    names = exposure.names
    places = [names.index(name) for name in correlated]
    made = []
    for k, matrix in enumerate(matrices):
        whole = np.eye(len(names))
        whole[np.ix_(places, places)] = matrix
        marginals = {
            name: refits[name][k] if name in refits else marginal
            for name, marginal in exposure.marginals.items()
        }
        copula = replace(exposure.copula, rows=tuple(map(tuple, whole.tolist())))
        made.append(replace(exposure, marginals=marginals, copula=copula))
    return tuple(made)


def _notes(
    exposure: Exposure, scenario: LogicalScenario, columns: Mapping[str, Float]
) -> tuple[str, ...]:
    notes = []
    share = exposure.feasible_share
    if share.estimate < 0.95:
        rule, rejected = next(iter(share.rejected.items()))
        notes.append(
            f"{percent(1.0 - share.estimate)} of the fitted distribution break a constraint and "
            f"are cut off, most by '{rule}' ({percent(rejected)}): the constraints deform what was "
            "fitted"
        )
    for name, values in columns.items():
        names = scenario.parameters[name].kind.names
        if unseen := [text for k, text in enumerate(names) if k not in values]:
            notes.append(f"{name}: no event has {', '.join(unseen)}; their probability is 0")
    return tuple(notes)


def _generator(*key: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(key)))
