"""``validated.json`` of a dossier: the ranges in which there is evidence for a scenario."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.base.records import read_model

FILE, MOST_NAMED, MOST_LETTERS = "validated.json", 3, 2000

_Text = Annotated[str, Field(max_length=MOST_LETTERS)]


class Region(BaseModel):
    """What the rows of a scenario span that have evidence; between them nothing is claimed.

    Attributes:
        scenario: its name.
        fingerprint: digest of it.
        vehicle: of the ego, with which it holds.
        evidence: in words.
        ranges: of each parameter that is a number: least, greatest, and unit.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    scenario: _Text
    fingerprint: _Text
    vehicle: _Text
    evidence: _Text
    ranges: dict[_Text, tuple[float, float, _Text]]

    def side(self, name: str) -> str:
        """Return the range of a parameter in words."""
        low, high, unit = self.ranges[name]
        return f"{name} {low:.4g} to {high:.4g} {unit.removesuffix('1')}".rstrip()


class Validated(BaseModel):
    """The regions of a dossier."""

    regions: Annotated[tuple[Region, ...], Field(max_length=10_000)] = ()


def regions_beside(folder: Path) -> list[Region]:
    """Return the regions of the dossier of a run, or of the project that it is in.

    Raises:
        FileFormatError: a file is damaged.
        StorageError: one cannot be read.
    """
    inside = folder.resolve()
    paths = [place / "dossier" / FILE for place in (inside, *inside.parents[:2])]
    found = [read_model(path, Validated, _not_ours) for path in paths]
    return [region for one in found if one is not None for region in one.regions]


def _not_ours(path: Path, why: str) -> FileFormatError:
    return FileFormatError(f"{path}: must be what 'bridgegen credibility' writes: {why}")


def extrapolated(
    regions: Sequence[Region], fingerprint: str, vehicle: str, names: Sequence[str], X: Float
) -> tuple[Int, str]:
    """Return which findings lie outside the region of their scenario, and a warning.

    Without any region nothing is outside of one, and nothing is said.

    Args:
        regions: the first one of the scenario counts.
        fingerprint: of the scenario.
        vehicle: of the ego.
        names: of the columns; those without a range are not compared.
        X: ``(N, len(names))``, the findings.
    """
    own = [one for one in regions if (one.fingerprint, one.vehicle) == (fingerprint, vehicle)]
    if not own or not len(X):
        rows = np.arange(len(X) if regions else 0)
        return rows, "this scenario is outside all regions that are validated" * bool(len(rows))
    over = np.zeros_like(X)
    for k, name in enumerate(names):
        low, high, _ = own[0].ranges.get(name, (-np.inf, np.inf, ""))
        over[:, k] = np.maximum(np.maximum(X[:, k] - high, low - X[:, k]), 0.0)
    count, rows = (over > 0.0).sum(axis=0), np.flatnonzero(over.any(axis=1))
    worst = [k for k in np.argsort(-count, kind="stable").tolist() if count[k]]
    said = [f"{own[0].side(names[k])}, finding {X[over[:, k].argmax(), k]:.4g}" for k in worst]
    more = [f"and {len(said) - MOST_NAMED} more parameters"] if said[MOST_NAMED:] else []
    text = (
        f"{len(rows)} of {len(X)} findings lie outside the region for which the models were "
        f"validated: {'; '.join(said[:MOST_NAMED] + more)}. It is that of {own[0].evidence}"
    )
    return rows, text[:MOST_LETTERS] * bool(worst)
