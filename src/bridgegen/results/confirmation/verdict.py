"""The result of a confirmation in sentences."""

from collections.abc import Sequence

from bridgegen.results.confirmation.differences import PARTED
from bridgegen.results.confirmation.schema import Scenario
from bridgegen.results.confirmation.summary import ConfirmationSummary, Spread, summarise

NAMED = 10
"""Maximum number of scenarios that are named."""


def name_of(one: Scenario) -> str:
    """Return the name of a scenario: that of its files, or its evaluation, counted from 1."""
    return one.name or f"evaluation {one.evaluation + 1}"


def sentences(label: str, scenarios: Sequence[Scenario]) -> list[str]:
    """Return how many scenarios are confirmed, then by how much they differ.

    Args:
        label: the other simulator.
        scenarios: that were run there.
    """
    s = summarise(scenarios)
    if not s.ran:
        return [f"None of {s.scenarios} scenarios ran in {label}."]
    low, high = (f"{100.0 * end:.0f}" for end in s.interval)
    line = f"{s.confirmed} of {s.ran} confirmed in {label} (95 %: {low}–{high} %)"
    lost = [
        name_of(one) + (" (knife-edge)" if one.knife_edge else "")
        for one in scenarios
        if one.confirmed is False
    ]
    if lost:
        more = ", …" if len(lost) > NAMED else ""
        line += f"; {len(lost)} not: {', '.join(lost[:NAMED])}{more}"
    if s.not_run:
        line += f"; {s.not_run} not run (neither confirmed nor refuted)"
    return [f"{line}.", *_robust(s), *_differences(s)]


def _robust(s: ConfirmationSummary) -> list[str]:
    """Return how many robust and how many knife-edge scenarios are confirmed."""
    parts = [
        f"{confirmed} of {ran} {kind}"
        for (ran, confirmed), kind in ((s.robust, "robust"), (s.knife_edge, "knife-edge"))
        if ran
    ]
    if not parts:
        return []
    return [
        f"Confirmed: {', '.join(parts)}. A knife-edge scenario is harmful in fewer than half of "
        "its neighbours."
    ]


def _differences(s: ConfirmationSummary) -> list[str]:
    parts = filter(
        None,
        [
            _spread("harm", s.harm, ""),
            _spread("d_min", s.d_min, "m"),
            _spread("v_d", s.v_d, "m/s"),
            _spread("first collision", s.contact, "s"),
        ],
    )
    lines = [f"Differences, median (largest): {', '.join(parts)}."]
    if s.parted.median is None:
        lines.append(f"No entity deviates by more than {PARTED:g} m.")
    else:
        lines.append(
            f"In {s.parted.n} of {s.ran} an entity deviates by more than {PARTED:g} m, first at "
            f"{s.parted.median:.2f} s (median)."
        )
    both, here, there = s.contacts
    if here or there:
        lines.append(f"Collisions: {both} in both, {here} only here, {there} only there.")
    return lines


def _spread(name: str, one: Spread, unit: str) -> str:
    if one.median is None or one.max is None:
        return ""
    return f"{name} {one.median:.3f} ({one.max:.3f}) {unit}".rstrip()
