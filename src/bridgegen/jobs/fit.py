"""From a table of events to the files of a fit."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal, cast

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, StorageError
from bridgegen.openx.openscenario.exposure import distribution_xml, left_out
from bridgegen.pages.exposure import refuse_other_page, write_page
from bridgegen.scenario.exposure.fit import Fit, Progress, fit_exposure
from bridgegen.scenario.exposure.reader import refuse_other_file, write_exposure
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.odd.bounding import bounded
from bridgegen.scenario.odd.reader import read_odd

_OTHERS = ("uniform", "default")
REPLAY_DRIVERS = "reference,un-r157"
"""Drivers that replay recorded events by default."""


def write_fit(
    scenario: str,
    events: Path,
    *,
    out: Path,
    page: Path | None = None,
    xosc: Path | None = None,
    hours: float | None = None,
    km: float | None = None,
    ignore: Sequence[str] = (),
    others: str | None = None,
    source: str | None = None,
    prior: str | None = None,
    odd: Path | None = None,
    recordings: Sequence[Path] = (),
    road_map: Path | None = None,
    replay_drivers: str = REPLAY_DRIVERS,
    replicates: int = 200,
    seed: int = 0,
    progress: Progress | None = None,
    replayed: Progress | None = None,
    notes: list[str] | None = None,
) -> tuple[Fit, tuple[Path, ...]]:
    """Fit a scenario's exposure to events, and write it, its page and its distribution.

    Args:
        scenario: a name, or the path of a YAML file.
        events: a table (.csv).
        out: the exposure's file.
        page: of the fit; ``out`` with the ending ``.html`` by default.
        xosc: an OpenSCENARIO file with the distributions; none by default.
        hours: see `bridgegen.scenario.exposure.fit.fit_exposure`, as all that follow.
        km: likewise.
        ignore: likewise.
        others: likewise.
        source: likewise.
        prior: likewise.
        odd: operational design domain within which events count: of the others none is fitted.
        recordings: files or folders; their events of this scenario are replayed beside their
            parameterised twins.
        road_map: of the recordings, see `bridgegen.recordings.twins.twins_of`.
        replay_drivers: names of drivers that ship, separated by commas; "none": no replays.
        replicates: see `fit_exposure`.
        seed: likewise.
        progress: likewise.
        replayed: is told how many of how many batches of replays are done.
        notes: takes what the OpenSCENARIO file leaves out, a sentence each.

    Returns:
        The fit, and the files that were written.

    Raises:
        InputError: what cannot be fitted.
        StorageError: another file is in a place, or it cannot be written.
    """
    if others is not None and others not in _OTHERS:
        raise InputError(f"--without-column must be {' or '.join(_OTHERS)}, got '{others}'")
    page = page or out.with_suffix(".html")
    refuse_other_file(out)
    refuse_other_page(page)
    if xosc is not None and xosc.exists():
        raise StorageError(f"{xosc}: exists already, and is not overwritten")
    logical, drivers = load(scenario), replay_drivers.split(",")
    if odd is not None:
        logical = cast(LogicalScenario, bounded(logical, domain := read_odd(odd)))
        source = f"{source or ''} Inside the ODD {domain.name}.".strip()
    twins = None
    if recordings and replay_drivers != "none":
        if not out.parent.is_dir():  # minutes of replays must not be lost
            raise StorageError(f"{out}: there is no folder {out.parent}")
        # Late, because it compiles: a fit without recordings simulates nothing.
        from bridgegen.recordings.twins import twins_of

        twins = twins_of(logical, recordings, drivers, road_map, replayed)
    made = fit_exposure(
        logical,
        events,
        hours=hours,
        km=km,
        ignore=ignore,
        others=cast(Literal["uniform", "default"] | None, others),
        source=source,
        prior=prior,
        parameterisation=twins,
        replicates=replicates,
        seed=seed,
        progress=progress,
    )
    write_exposure(out, made.text)
    write_page(page, made, out)
    if xosc is None:
        return made, (out, page)
    date = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
    write_whole(xosc, [distribution_xml(made.exposure, date=date)])
    if notes is not None:
        notes += left_out(made.exposure)
    return made, (out, page, xosc)
