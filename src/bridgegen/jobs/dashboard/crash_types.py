"""How drivers stand in the types of crashes of a typology, weighted by how common these are.

A failure counts in a type where a scenario that realises it fails in a conflict of the type's kind.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from bridgegen.jobs.dashboard.verdicts import Standing, Verdict
from bridgegen.pages.templates import counted
from bridgegen.scenario.typology import (
    CrashType,
    Typology,
    most_harmful,
    shares,
    total_of,
    typologies,
)

TYPOLOGY = "nhtsa-37"
"""The typology whose shares weigh: the only one that counts all crashes."""

FEWEST = 4
"""Number of tried scenarios of a typology from which on a page shows its types."""

LIMITS = (
    "Shares are of crashes of human drivers, and a scenario is one way in which a type happens: "
    "they say where to look first, not how often a driver crashes, and a type without a failure is "
    "not covered by that."
)


@dataclass(frozen=True)
class TypeStanding(Standing):
    """How a driver stands in a type of crash; only modes of the type's kind count.

    Attributes:
        scenarios: that were tried.
        otherwise: those that fail, but in other conflicts or in random draws alone.
    """

    scenarios: tuple[str, ...] = ()
    otherwise: tuple[str, ...] = ()


@dataclass(frozen=True)
class CrashTypes:
    """How all drivers stand in the types of a typology.

    Attributes:
        typology: it.
        drivers: by name.
        lines: the types that were tried, each with a standing for every driver; where some driver
            fails first, then the most harmful, the most common.
    """

    typology: Typology
    drivers: tuple[str, ...]
    lines: tuple[tuple[CrashType, Mapping[str, TypeStanding]], ...]

    @property
    def untried(self) -> tuple[CrashType, ...]:
        """The types of which no scenario was tried."""
        tried = {kind.id for kind, _ in self.lines}
        return tuple(kind for kind in self.typology.types if kind.id not in tried)

    @property
    def limits(self) -> str:
        """What the shares do not say."""
        harm = total_of(self.typology.types, "harm")
        return LIMITS if harm is not None else f"{LIMITS} Shares of harm by type are not known."

    def sentence(self, driver: str) -> str:
        """Return in which types a driver fails, how common these are, and what is not tried."""
        stands = [(kind, each[driver]) for kind, each in self.lines]
        tried = [kind for kind, standing in stands if standing.scenarios]
        fails = [kind for kind, standing in stands if standing.modes]
        left = [kind for kind in self.typology.types if kind not in tried]
        return (
            f"{driver} fails in {len(fails)} of {counted(len(tried), 'type')} of crashes that "
            f"scenarios tried{shares(fails)}; {len(left)} of {len(self.typology.types)} types"
            f"{shares(left)}, were not tried."
        )


def crash_types(stands: Mapping[tuple[str, str], Standing]) -> CrashTypes | None:
    """Return how drivers stand in the types of crashes; None where few scenarios were tried.

    Args:
        stands: by scenario and driver.
    """
    typology = typologies()[TYPOLOGY]
    known = {name for kind in typology.types for name in kind.scenarios}
    if len({scenario for scenario, _ in stands if scenario in known}) < FEWEST:
        return None
    drivers = tuple(sorted({driver for scenario, driver in stands if scenario in known}))
    lines = []
    for kind in most_harmful(typology.types):
        each = {driver: _standing(kind, driver, stands) for driver in drivers}
        if any(standing.scenarios for standing in each.values()):
            lines.append((kind, each))
    lines.sort(key=lambda line: not any(standing.modes for standing in line[1].values()))
    return CrashTypes(typology, drivers, tuple(lines))


def _standing(
    kind: CrashType, driver: str, stands: Mapping[tuple[str, str], Standing]
) -> TypeStanding:
    found = {name: stands[name, driver] for name in kind.scenarios if (name, driver) in stands}
    own = {
        name: [mode for mode in standing.modes if mode.key.conflict_type in kind.conflicts]
        for name, standing in found.items()
    }
    modes = sorted((mode for some in own.values() for mode in some), key=lambda m: -m.severity)
    otherwise = tuple(
        name for name, standing in found.items() if standing.verdict == "fails" and not own[name]
    )
    verdicts = {standing.verdict for standing in found.values()}
    verdict: Verdict = "never tried"
    if modes:
        verdict = "fails"
    elif otherwise or "not judged" in verdicts:
        verdict = "not judged"
    elif found:
        verdict = "no failure found"
    results = tuple(result for standing in found.values() for result in standing.results)
    return TypeStanding(verdict, tuple(modes), results, tuple(found), otherwise)
