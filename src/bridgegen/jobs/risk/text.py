"""A risk in words."""

from collections.abc import Iterator

from bridgegen.base.units import percent
from bridgegen.jobs.frame import Table
from bridgegen.jobs.risk.cross_simulator import Elsewhere, Ratio
from bridgegen.jobs.risk.estimators.total import Total
from bridgegen.jobs.risk.estimators.weighted import Probability
from bridgegen.jobs.risk.extremes import Extreme
from bridgegen.jobs.risk.options import WORDS
from bridgegen.jobs.risk.outcomes import EVENTS, DataBand
from bridgegen.jobs.risk.result import PAGE, Risk
from bridgegen.pages.templates import number
from bridgegen.scenario.exposure.exposure import Rate
from bridgegen.scenario.typology import published


def sentence(risk: Risk) -> str:
    """Return what a risk says, in one or two sentences, and what of its exposure is a prior."""
    return " ".join(filter(None, [_sentence(risk), risk.exposure.weighed]))


def _sentence(risk: Risk) -> str:
    p, what_ = risk.probability(risk.event), what(risk.event, risk.count)
    if p is None:
        reason = risk.findings[risk.event].doubt
        return f"How likely {what_} is, is not known: {reason}. {_advice(risk)}."
    if p.estimate == 0.0:
        return (
            f"Of {risk.weighted.rows:,} encounters none was {what_}: with 95 % confidence the "
            f"probability is below {number(p.upper)} per encounter (rule of three)."
        )
    return (
        f"The probability of {what_} is {number(p.estimate)} per encounter (95 %: {number(p.low)} "
        f"to {number(p.high)})."
    )


def what(event: str, count: str) -> str:
    """Return an event in words, with which conflicts count."""
    if count == "any":
        return WORDS[event]
    return f"{WORDS[event]} that the ego is responsible for or could have prevented"


def lines(risk: Risk) -> Iterator[str | Table]:
    """Yield what the terminal shows of a risk: its sentence, its table, and what to know."""
    yield f"{sentence(risk)}\n"
    met = risk.exposure.encounters
    units = [item for item in ("h", "km") if met is not None and getattr(met, _AMOUNTS[item])]
    rows = []
    for words, name, finding in risk.stated:
        row = [words, *interval(finding.probability), f"{finding.hits:,.0f}"]
        row += [rate_text(None if name is None else risk.rate(name, unit)) for unit in units]
        rows.append(row)
    head = ("", "per encounter", "95 %", "below (95 %)", "effective rows")
    yield Table((*head, *(f"per {unit}" for unit in units)), rows)
    if (odd := risk.exposure.scenario.odd) is not None:
        yield f"{odd.label}: probabilities are per encounter inside it; rates are not known"
    for doubt in risk.weighted.doubts:
        yield f"\ndoubt       {doubt}"
    yield f"\n{'method':<12}{risk.estimated.method}: {risk.estimated.why}"
    if risk.check is not None:
        value, width, _ = interval(risk.check.probability(EVENTS[risk.event].score))
        yield f"{'check':<12}{value} ({width}) in {risk.check.evaluations:,} by mc"
    if risk.extreme is not None:
        found = risk.findings["collision"].probability
        yield f"{'near misses':<12}{extreme_sentence(risk.extreme, found)}"
    if risk.data is not None:
        yield f"{'data':<12}{data_sentence(risk.data)}"
    for crash in crashes(risk):
        yield f"{'crashes':<12}{crash}"
    yield f"{'parameters':<12}{risk.exposure.left_out}"
    if risk.elsewhere is not None:
        yield f"{'elsewhere':<12}{elsewhere_sentence(risk.elsewhere)}"
    yield f"{'page':<12}{risk.folder / PAGE}"


def crashes(risk: Risk) -> Iterator[str]:
    """Yield which published types of crashes, of human drivers, the scenario is one way of."""
    for each in published(risk.exposure.scenario.name):
        year = "" if str(each["year"]) in each["of"] else f", {each['year']}"
        yield (
            f"{each['type']} is the type of {percent(each['percent'] / 100)} of {each['of']}{year} "
            f"({each['source']}): of human drivers, no risk of the ego's"
        )


_AMOUNTS = {"h": "hours", "km": "km"}


def _advice(risk: Risk) -> str:
    """Return what to do if a risk is not known; mc always states one."""
    return {
        "subset": "Method importance looks elsewhere, too; mc assumes nothing",
        "stratified": "Method importance is for rarer harm; mc assumes nothing",
    }.get(risk.estimated.method, "Method mc assumes nothing")


def data_sentence(band: DataBand) -> str:
    """Return how much few data leave open, in a sentence."""
    if band.low is None or band.high is None:
        return (
            f"Few data: {band.left_out} of {band.exposures} exposures of resampled events have "
            "harmful encounters where hardly any were simulated, so how much the data leave open "
            "is not known."
        )
    return (
        f"Few data: with exposures of resampled events the estimate is {number(band.low)} to "
        f"{number(band.high)} (95 % of {band.exposures})."
    )


def extreme_sentence(found: Extreme, p: Probability | None) -> str:
    """Return how likely collisions are by near misses, and whether that agrees, in a sentence."""
    if found.doubt:
        return f"Near misses do not say how likely collisions are: {found.doubt}."
    return near_misses(found, p)


def near_misses(
    found: Extreme | Total, p: Probability | Total | None, per: str = "encounter", size: float = 1.0
) -> str:
    """Return how often collisions happen by near misses, and whether that agrees, in a sentence."""
    low, middle, high = (number(size * end) for end in (found.low, found.estimate, found.high))
    if p is None:
        agrees = "the simulations do not say how often"
    elif found.high < p.low or p.high < found.low:
        many = "more" if found.high < p.low else "fewer"
        agrees = f"that disagrees with the simulations, by which there are {many}"
    else:
        agrees = "that agrees with the simulations"
    often = f"happens {middle} times per {per} (bootstrap, 95 %: {low} to {high})"
    if found.high == 0.0:
        often = "does not happen: all extremes stop short of it"
    return (
        "By near misses alone (extreme values of the time to collision, extrapolated) a collision "
        f"{often}; {agrees}."
    )


def elsewhere_sentence(found: Elsewhere) -> str:
    """Return how likely the event is in another simulator, in one or two sentences."""
    if found.factor is None:
        return (
            f"In {found.simulator} the event may be more or less likely; how much is not known: "
            f"{found.doubt}."
        )
    failed = f" {found.failed} rows have no result there." if found.failed else ""
    return (
        f"In {found.simulator} the event is {_ratio(found.factor)} times as likely: "
        f"{percent(found.confirmed.estimate)} of the probability here are confirmed, and "
        f"{percent(found.new.estimate)} as much comes from rows that are only close to harm here. "
        f"{found.rows} rows were simulated there; harm that is far from harm here was not looked "
        f"for.{failed}"
    )


def _ratio(ratio: Ratio) -> str:
    return f"{ratio.estimate:.3g} (95 %: {ratio.low:.3g} to {ratio.high:.3g})"


def rate_text(rate: Rate | None) -> str:
    """Return a rate as text: its estimate, or what it is below if nothing was counted."""
    if rate is None:
        return "–"
    return number(rate.estimate) if rate.estimate > 0.0 else f"< {number(rate.high)}"


def interval(p: Probability | None) -> tuple[str, str, str]:
    """Return a probability, its interval and its upper bound as texts; dashes without one."""
    if p is None:
        return "not known", "–", "–"
    return number(p.estimate), f"{number(p.low)} to {number(p.high)}", number(p.upper)
