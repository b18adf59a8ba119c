"""How far a run's screen and its simulator agree, in words, and as the page shows it."""

from collections.abc import Mapping
from typing import Any

from bridgegen.pages.notes import box_in_words
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.screened import Agreement

_THIRDS = ("lowest", "middle", "highest")


def sentences(found: Agreement) -> list[str]:
    """Return what both simulators did and in what they agree, a sentence each."""
    screen, simulator = found.screen, found.simulator
    said = [
        f"{screen} made {found.screen_evaluations:,} of {found.screen_budget:,} evaluations; "
        f"{found.compared:,} scenarios ran in both simulators."
    ]
    if found.ended_after is not None:
        said.append(
            f"{screen} was given up after {found.ended_after:,} evaluations: {found.ended_because}."
        )
    if not found.compared:
        return said
    claimed = found.both + found.screen_only
    others = found.simulator_only + found.neither
    said.append(
        f"Of {claimed:,} that are critical in {screen}, {found.both:,} are critical in {simulator}"
        f"; of {others:,} others, {found.simulator_only:,}."
    )
    if found.rank_correlation is None:
        said.append("The rank correlation is undefined: one simulator gives all the same result.")
    else:
        said.append(f"Rank correlation of the objectives: {found.rank_correlation:.2f}.")
    if found.screen_only:
        said.append(
            f"Critical in {screen} only: {found.false_early:,} in the first half of them, "
            f"{found.false_late:,} in the second."
        )
    return said


def place_in_words(found: Agreement, space: SearchSpace | None = None) -> str:
    """Return where both simulators differ most; empty where that is not significant.

    Args:
        found: the agreement.
        space: the search space, for values in units.
    """
    place = found.place
    if place is None:
        return ""
    if space is not None and place.parameter in space.variables:
        where = box_in_words({place.parameter: (place.low, place.high)}, space)
    else:
        third = _THIRDS[min(2, round(3 * place.low))]
        where = f"{place.parameter} is in the {third} third of its range"
    return (
        f"They differ most where {where}: the mean difference of the objectives is "
        f"{place.inside:.3g} there, {place.outside:.3g} elsewhere."
    )


def in_a_line(found: Agreement) -> str:
    """Return the agreement in one line."""
    n = found.both + found.screen_only
    rank = "–" if found.rank_correlation is None else f"{found.rank_correlation:.2f}"
    ended = "" if found.ended_after is None else f"; given up after {found.ended_after:,}"
    return (
        f"{found.screen}: {found.screen_evaluations:,} evaluations; of {n:,} critical there "
        f"{found.both:,} are in {found.simulator}; rank correlation {rank}{ended}"
    )


def screened_payload(notes: Mapping[str, Any], space: SearchSpace) -> dict[str, Any] | None:
    """Return what the page shows of a screen; None where the run has none, or no notes yet.

    Raises:
        ValueError: the notes are damaged.
    """
    found = Agreement.from_notes(notes)
    if found is None:
        return None
    place = place_in_words(found, space)
    return {
        "screen": found.screen,
        "simulator": found.simulator,
        "sentences": [*sentences(found), *([place] if place else [])],
        "counts": [[found.both, found.screen_only], [found.simulator_only, found.neither]],
    }
