"""The part of the page that counts events, and sets them against scenarios."""

from collections.abc import Sequence
from html import escape

from bridgegen.recordings.cells import html_table
from bridgegen.recordings.events.find import FoundEvents
from bridgegen.recordings.events.of_scenarios import ScenarioEvents
from bridgegen.recordings.events.tables import (
    FOLDER,
    TABLE,
    against_in_words,
    kind_rows,
    rates_in_words,
)


def events_section(found: Sequence[FoundEvents], scenarios: Sequence[ScenarioEvents]) -> str:
    """Return the cards of events and of scenarios."""
    of_scenarios = (
        "scenario", "event", "rows", "incomplete", "per hour", "per 1000 km", "not given",
    )  # fmt: skip
    hours, km, all_hours, all_km = (
        sum(getattr(one, name) for one in found)
        for name in ("hours", "kilometres", "all_hours", "all_kilometres")
    )
    kinds = [
        [kind, f"{count:,}", per_hour, per_km, refused]
        for kind, count, per_hour, per_km, refused in kind_rows(found)
    ]
    met = [
        [one.scenario, one.kind, f"{one.complete:,}", f"{one.incomplete:,}",
         *rates_in_words(one.encounters), ", ".join(one.unmapped) or "–"]
        for one in scenarios
    ]  # fmt: skip
    against = "".join(
        f"<li>{escape(one.scenario)}: {escape(text)}</li>"
        for one in scenarios
        for text in against_in_words(one)
    )
    heard = f"<ul>{against}</ul>" if against else "<p>Nothing.</p>"
    return (
        f"<div class='card'><div class='wide'>"
        f"{html_table(['event', 'count', 'per hour', 'per 1000 km', 'refused'], kinds)}</div>"
        f"<p class='muted'>All are in {TABLE}. Rates are those of {hours:.4g} h and {km:.4g} km of "
        f"motor vehicles on lanes (from crossing on in this table, {all_hours:.4g} h and "
        f"{all_km:.4g} km, on lanes or not), each of which is the ego in turn, less the "
        "share of events that the recording cuts off; in brackets the exact 95 % interval of a "
        "Poisson process."
        "</p></div>"
        f"<div class='card'><h3>Scenarios</h3><div class='wide'>"
        f"{html_table(of_scenarios, met)}"
        f"</div><p class='muted'>A row of parameters per event is in {FOLDER}/SCENARIO.csv.</p>"
        f"</div><div class='card'><h3>What the events say against ranges and constraints</h3>"
        f"{heard}</div>"
    )
