"""The sceneries of a project: each scenario is read once, whatever number of results it has."""

from pathlib import Path

from bridgegen.base.errors import BridgeGenError
from bridgegen.jobs.dashboard.names import scenario_name
from bridgegen.jobs.dashboard.scenery import Scenery, scenery_of
from bridgegen.jobs.search.scenarios import load

Source = tuple[str, str, str, bool]
"""Path or name, distribution, reading of empty triggers ("" for none), whether it is on a map."""


class Sceneries:
    """Reads scenarios, and remembers them."""

    def __init__(self) -> None:
        self._known: dict[Source, tuple[Scenery, str] | None] = {}

    def of(self, source: Source, fingerprint: str = "") -> Scenery | None:
        """Return the scenery of a scenario; None where it cannot be read, or has changed.

        Args:
            source: of the scenario.
            fingerprint: of the scenario when its result was made; "" if that is not known.
        """
        if source not in self._known:
            self._known[source] = self._read(source)
        known = self._known[source]
        if known is None or (fingerprint and known[1] != fingerprint):
            return None
        return known[0]

    def by_name(self, project: Path) -> dict[str, Scenery]:
        """Return all that were read, by the names that results have their scenarios under."""
        return {
            scenario_name(text, project, distribution): known[0]
            for (text, distribution, _, _), known in self._known.items()
            if known is not None
        }

    def _read(self, source: Source) -> tuple[Scenery, str] | None:
        text, distribution, trigger, on_map = source
        try:
            scenario = load(text, distribution or None, trigger or None)
            return scenery_of(scenario, on_map=on_map), scenario.fingerprint
        except (BridgeGenError, OSError, ValueError):  # ValueError: NUL in a path
            return None
