"""A risk in words."""

from math import isfinite

from bridgegen.jobs.risk.elsewhere import Elsewhere, Ratio
from bridgegen.jobs.risk.estimators.weighted import Probability
from bridgegen.jobs.risk.outcomes import WORDS, DataBand
from bridgegen.jobs.risk.result import Risk
from bridgegen.scenario.exposure.exposure import Rate


def number(value: float) -> str:
    """Return a number with three digits; small ones with a power of ten.

    A rate per unit so short that it exceeds all numbers is "beyond 1e308".
    """
    if value == 0.0:
        return "0"
    if not isfinite(value):
        return "beyond 1e308"
    if 1e-3 <= value < 1e4:
        return f"{value:.3g}"
    digits, power = f"{value:.2e}".split("e")
    return f"{digits}e{int(power)}"


def sentence(risk: Risk) -> str:
    """Return what a risk says, in one or two sentences."""
    p, what = risk.probability(risk.event), WORDS[risk.event]
    if risk.count == "ego":
        what = f"{what} that the ego is responsible for or could have prevented"
    if p is None:
        reason = risk.findings[risk.event].doubt
        return f"How likely {what} is, is not known: {reason}. {_advice(risk)}."
    if p.estimate == 0.0:
        return (
            f"Of {risk.weighted.rows:,} encounters none was {what}: with 95 % confidence the "
            f"probability is below {number(p.upper)} per encounter (rule of three)."
        )
    return (
        f"The probability of {what} is {number(p.estimate)} per encounter (95 %: {number(p.low)} "
        f"to {number(p.high)})."
    )


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
        f"{found.confirmed.estimate:.0%} of the probability here are confirmed, and "
        f"{found.new.estimate:.0%} as much comes from rows that are only close to harm here. "
        f"{found.rows} rows were simulated there; harm that is far from harm here was not looked "
        f"for.{failed}"
    )


def _ratio(one: Ratio) -> str:
    return f"{one.estimate:.3g} (95 %: {one.low:.3g} to {one.high:.3g})"


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
