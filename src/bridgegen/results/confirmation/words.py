"""A confirmation in sentences: its result; where and why two rollouts diverge."""

import math
from collections.abc import Sequence

from bridgegen.assess.conflict.findings import with_whom
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.assess.criteria import margin_in_words
from bridgegen.assess.objective import Rule
from bridgegen.results.confirmation.differences import (
    DIVERGED,
    TRACE,
    Approach,
    BoxSizes,
    Divergence,
    EntityDivergence,
    EventTimes,
    LightTimes,
)
from bridgegen.results.confirmation.record import Differences, Margin, Outcome, Scenario
from bridgegen.results.confirmation.summary import ConfirmationSummary, Spread, summarise
from bridgegen.scenario.language.thresholds import Thresholds

NARROW = (0.25, 0.25)
"""Largest difference from a threshold of d_min [m] and of v_d [m/s] with which a scenario misses it
narrowly."""

NARROW_HARM = 0.02
"""Largest difference of harm from the threshold with which a scenario misses it narrowly."""

TURNED = math.radians(10.0)
"""Difference of the direction of travel beyond which it is reported [rad]."""

MOST_OFF = 3
"""Maximum number of entities with small deviations that are named."""

LIGHTS = ("off", "red", "red and yellow", "yellow", "green")


def explanation(
    here: Outcome,
    there: Outcome,
    found: Differences,
    limits: Thresholds,
    rule: Rule = "thresholds",
) -> str:
    """Explain why a scenario is, or is not, critical there.

    If it is not, the explanation is what differs up to the closest approach here: without these
    differences it would be as close there. Later differences are not named.

    Args:
        here: the outcome here.
        there: the outcome there.
        found: how the rollouts differ.
        limits: when a scenario is critical by the rule "thresholds".
        rule: what makes a scenario critical.
    """
    verdict = []
    if not there.critical:
        verdict = _verdict(here, there, limits, rule)
    contacts = _contacts(here, there)
    if there.critical or found.closest is None:
        return " ".join([*verdict, *contacts, *_story(found)])
    if there.contact or found.closest.distance > 0.0:  # else it is in the sentence on contacts
        contacts.append(_closest(found.closest))
    return " ".join([*verdict, *contacts, *_until(found, found.closest.time)])


def _verdict(here: Outcome, there: Outcome, limits: Thresholds, rule: Rule) -> list[str]:
    """Return why a scenario is not critical there."""
    if rule == "criteria":
        return [
            f"{name} is met there: its margin is {_margin(there.margins[name])} there, "
            f"{_margin(margin)} here."
            for name, margin in here.margins.items()
            if margin.value < 0.0 and name in there.margins
        ]
    return [_less_harm(here, there) if rule == "harm" else _miss(here, there, limits)]


def _margin(margin: Margin) -> str:
    return margin_in_words(margin.value, margin.unit, 3)


def _less_harm(here: Outcome, there: Outcome) -> str:
    """Return why a scenario is not critical there by harm."""
    if there.d_min is None:
        return "The ego is alone there."
    conflict = with_whom(there.conflict, there.partner)
    if there.conflict_type:
        conflict += f" ({there.conflict_type})"
    if not there.conflict:
        what = "No collision course there"
    elif there.conflict == "collision course":
        what = f"Only a {conflict} there"
    else:
        who = {"other": there.partner, "none": "no participant"}.get(
            there.responsible, there.responsible
        )
        what = f"A {conflict} there, for which {who} is responsible"
    if there.harm is None or here.harm is None:
        return f"{what}."
    narrowly = _narrowly(NEAR_MISS - there.harm, NARROW_HARM)
    return (
        f"{what}: harm is {there.harm:.2f} there, {here.harm:.2f} here, {narrowly}below "
        f"{NEAR_MISS:g}."
    )


def _miss(here: Outcome, there: Outcome, limits: Thresholds) -> str:
    """Return by how much a scenario misses a threshold."""
    if there.d_min is None:
        return "The ego is alone there."
    far = there.d_min - limits.d_min_below
    if far >= 0.0:
        narrowly = _narrowly(far, NARROW[0])
        known = "" if here.d_min is None else f", {here.d_min:.2f} m here"
        return (
            f"d_min is {there.d_min:.2f} m there{known}: {narrowly}{_length(far)} m above the "
            "threshold."
        )
    v_d = there.v_d or 0.0
    slow = limits.v_d_at_least - v_d
    narrowly = _narrowly(slow, NARROW[1])
    return (
        f"It comes as close as {there.d_min:.2f} m there, but v_d is {v_d:.2f} m/s: "
        f"{narrowly}{_length(slow)} m/s below the threshold."
    )


def _length(value: float) -> str:
    """Return a number with two decimals, or with one digit if it is smaller."""
    return f"{value:.2f}" if value >= 0.005 else f"{value:.1g}"


def _narrowly(by: float, limit: float) -> str:
    return "narrowly, " if by <= limit else ""


def _contacts(here: Outcome, there: Outcome) -> list[str]:
    a, b = here.contact, there.contact
    if a and not b:
        return [f"No contact there; here with {a.entity} at {a.time:.2f} s."]
    if b and not a:
        return [f"A contact with {b.entity} at {b.time:.2f} s there, none here."]
    if a and b and a.entity != b.entity:
        return [f"The first contact is with {b.entity} there, with {a.entity} here."]
    return []


def _closest(approach: Approach) -> str:
    what = f"first contact here is with {approach.entity}"
    if approach.distance > 0.0:
        what = f"closest approach here is to {approach.entity}, {_length(approach.distance)} m,"
    return f"The {what} at {approach.time:.2f} s."


def _until(found: Differences, time: float) -> list[str]:
    """Return the differences up to the closest approach, in order of time."""
    sentences = _always(found)
    if not found.diverged:
        sentences.append(f"Until then no entity deviates by more than {TRACE:g} m.")
    before = [
        (divergence.since, 1, _divergence(divergence, first=not k))
        for k, divergence in enumerate(found.diverged)
    ]
    before += [(event.first, 0, _event(event)) for event in found.events if event.first <= time]
    before += [(light.time, 0, _light(light)) for light in found.lights if light.time <= time]
    return [*sentences, *(text for *_, text in sorted(before, key=lambda pair: pair[:2]))]


def _divergence(divergence: Divergence, *, first: bool) -> str:
    sentences = (
        f"{divergence.entity} diverges{' first,' if first else ''} from {divergence.since:.2f} s "
        "on: "
    )
    if divergence.only is not None:
        return f"{sentences}at {divergence.time:.2f} s it is present only {divergence.only}."
    assert divergence.gap is not None
    assert divergence.along is not None
    assert divergence.across is not None
    assert divergence.speed is not None
    ahead = abs(divergence.along) >= abs(divergence.across)
    parts = [
        (abs(divergence.along), "behind" if divergence.along < 0.0 else "ahead"),
        (abs(divergence.across), "to the right" if divergence.across < 0.0 else "to the left"),
    ]
    largest, other = parts if ahead else parts[::-1]
    shown = (largest, *([other] if other[0] >= 0.005 else []))
    where = ", ".join(f"{by:.2f} m {side}" for by, side in shown)
    return (
        f"{sentences}at {divergence.time:.2f} s it deviates by {divergence.gap:.2f} m, mainly "
        f"{'longitudinally' if ahead else 'laterally'} ({where}), and {_pace(divergence.speed)}"
        f"{_direction(divergence.turn)}."
    )


def _always(found: Differences) -> list[str]:
    """Return the differences from the start."""
    sentences = [f"{name} does not exist there." for name in found.only_here]
    sentences += [f"{name} exists only there." for name in found.only_there]
    return sentences + [_box(box) for box in found.boxes]


def _story(found: Differences) -> list[str]:
    """Return the differences up to the first divergence, in order of time."""
    sentences = _always(found)
    if not found.partings:
        return [*sentences, f"No entity deviates by more than {DIVERGED:g} m."]
    first = found.partings[0]
    before: list[tuple[float, str]] = []
    before += [(event.first, _event(event)) for event in found.events if event.first <= first.time]
    before += [(light.time, _light(light)) for light in found.lights if light.time <= first.time]
    sentences += [text for _, text in sorted(before)]
    if not before:
        sentences.append("No event and no light differs before the first divergence.")
    sentences.append(_parting(first))
    together = {parting.entity for parting in found.partings[1:] if parting.time <= first.time}
    if off := [offset for offset in found.offsets if offset.entity not in together][:MOST_OFF]:
        others = [f"{offset.entity} deviated by {offset.gap:.2f} m" for offset in off]
        sentences.append(f"By then {', '.join(others)}.")
    if first.entity != found.partings[-1].entity:
        later = [f"{parting.entity} at {parting.time:.2f} s" for parting in found.partings[1:]]
        sentences.append(f"Then {', '.join(later)}.")
    return sentences


def _box(box_sizes: BoxSizes) -> str:
    (a, b, c), (p, q, r) = box_sizes.here, box_sizes.there
    return (
        f"{box_sizes.entity} is a box of {p:.2f} m × {q:.2f} m, centre {r:.2f} m ahead, there; "
        f"{a:.2f} m × {b:.2f} m, {c:.2f} m here."
    )


def _event(event_times: EventTimes) -> str:
    if event_times.there is None:
        return f"{event_times.name} began at {event_times.here:.2f} s here and never there."
    if event_times.here is None:
        return f"{event_times.name} began at {event_times.there:.2f} s there and never here."
    late = event_times.there - event_times.here
    return (
        f"{event_times.name} began {abs(late):.2f} s {'later' if late > 0.0 else 'earlier'} there, "
        f"at {event_times.there:.2f} s."
    )


def _light(light_times: LightTimes) -> str:
    here, there = (
        LIGHTS[state] if 0 <= state < len(LIGHTS) else f"state {state}"
        for state in (light_times.here, light_times.there)
    )
    return (
        f"The light {light_times.name} is {there} there and {here} here from "
        f"{light_times.time:.2f} s on."
    )


def _parting(parting: EntityDivergence) -> str:
    if parting.only is not None:
        return (
            f"{parting.entity} diverges first: at {parting.time:.2f} s it is present only "
            f"{parting.only}."
        )
    assert parting.gap is not None
    assert parting.along is not None
    assert parting.across is not None
    assert parting.speed is not None
    along = abs(parting.along) >= abs(parting.across)
    sides = ("ahead", "behind") if along else ("to the left", "to the right")
    where = sides[(parting.along if along else parting.across) < 0.0]
    return (
        f"{parting.entity} diverges first: at {parting.time:.2f} s it is {parting.gap:.2f} m away "
        "there, "
        f"{where}, and {_pace(parting.speed)}{_direction(parting.turn)}; deviating since "
        f"{parting.since:.2f} s."
    )


def _pace(speed: float) -> str:
    """Return the difference of an entity's speed in words."""
    if abs(speed) < 0.05:
        return "as fast"
    return f"{abs(speed):.2f} m/s {'faster' if speed > 0.0 else 'slower'}"


def _direction(turn: float | None) -> str:
    """Return the difference of an entity's direction of travel in words, if it is large."""
    if turn is None or abs(turn) <= TURNED:
        return ""
    side = "left" if turn > 0.0 else "right"
    return f", moving {math.degrees(abs(turn)):.0f}° to the {side} of its direction here"


# --- The result of a confirmation in sentences ---


NAMED = 10
"""Maximum number of scenarios that are named."""


def name_of(scenario: Scenario) -> str:
    """Return the name of a scenario: that of its files, or its evaluation, counted from 1."""
    return scenario.name or f"evaluation {scenario.evaluation + 1}"


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
        name_of(scenario) + (" (knife-edge)" if scenario.knife_edge else "")
        for scenario in scenarios
        if scenario.confirmed is False
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
        lines.append(f"No entity deviates by more than {DIVERGED:g} m.")
    else:
        lines.append(
            f"In {s.parted.n} of {s.ran} an entity deviates by more than {DIVERGED:g} m, first at "
            f"{s.parted.median:.2f} s (median)."
        )
    both, here, there = s.contacts
    if here or there:
        lines.append(f"Collisions: {both} in both, {here} only here, {there} only there.")
    return lines


def _spread(name: str, spread: Spread, unit: str) -> str:
    if spread.median is None or spread.max is None:
        return ""
    return f"{name} {spread.median:.3f} ({spread.max:.3f}) {unit}".rstrip()
