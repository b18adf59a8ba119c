"""A map, finished or not: its figures, and the files and folder that hold it."""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.base.disk import write_whole, writing_whole
from bridgegen.base.extras import is_installed
from bridgegen.base.records import read_bytes
from bridgegen.base.units import percent
from bridgegen.jobs.frame import Judged, Table
from bridgegen.jobs.preventability.classes import CellClass, Codes, Outcome, classes
from bridgegen.jobs.preventability.grid import Grid
from bridgegen.jobs.preventability.options import FIGURES
from bridgegen.results.folder import claim

if TYPE_CHECKING:
    from bridgegen.jobs.preventability.pictures import CellPicture
    from bridgegen.scenario.language.scenario import SearchedScenario

ARRAYS, TABLE, SUMMARY, PAGE = "map.npz", "map.parquet", "summary.json", "preventability.html"

GROUP = 1_048_576
"""Number of rows of a row group of the table."""


@dataclass(frozen=True)
class PreventabilityMap:
    """Which cells of a grid drivers avoid, and which could be avoided.

    Attributes:
        scenario: the logical scenario.
        grid: the cells.
        drivers: the drivers under test, by name.
        models: the drivers that decide whether a collision is preventable.
        outcomes: ``(D, *grid.shape)`` int8, an `Outcome` of each of ``simulated``.
        command: the command line that makes it.
        folder: of its files.
    """

    scenario: "SearchedScenario"
    grid: Grid
    drivers: tuple[str, ...]
    models: tuple[str, ...]
    outcomes: Codes
    command: str
    folder: Path

    @property
    def page(self) -> Path:
        """The page with the pictures."""
        return self.folder / PAGE

    @property
    def simulated(self) -> tuple[str, ...]:
        """The drivers, then the models that are not among them."""
        return simulated(self.drivers, self.models)

    @cached_property
    def classes(self) -> Mapping[str, Codes]:
        """By driver the `CellClass` of each cell, ``grid.shape`` int8."""
        flat = self.outcomes.reshape(len(self.simulated), -1)
        at = [self.simulated.index(name) for name in self.models]
        return {
            name: classes(flat[self.simulated.index(name)], flat[at]).reshape(self.grid.shape)
            for name in self.drivers
        }

    def counts(self, driver: str) -> dict[CellClass, int]:
        """Return the number of cells of each class."""
        found = np.bincount(self.classes[driver].ravel(), minlength=len(CellClass))
        return {class_: int(found[class_]) for class_ in CellClass}

    def figures(self, driver: str) -> dict[str, Any]:
        """Return a driver's numbers of cells, and shares of those that apply and have a result."""
        counts = self.counts(driver)
        judged = sum(counts[class_] for class_ in CellClass if class_ < CellClass.NOT_APPLICABLE)
        names = {class_: class_.name.lower() for class_ in CellClass}
        shares = {
            f"{names[class_]}_share": counts[class_] / judged if judged else None
            for class_ in CellClass
            if class_ < CellClass.NOT_APPLICABLE
        }
        return {
            "driver": driver,
            **{names[class_]: counts[class_] for class_ in CellClass},
            **shares,
        }

    @property
    def work(self) -> str:
        """How many cells there are."""
        return f"{self.grid.cells:,} cells"

    def to_json(self) -> list[dict[str, Any]]:
        """Return the figures of each driver."""
        return [self.figures(name) for name in self.drivers]

    def shown(self) -> list[str | Table]:
        """Return what the terminal shows: each driver's cells by class, and the files."""
        figures = self.to_json()
        rows = [
            (figure["driver"], *(_cell(figure, kind) for kind in CellClass)) for figure in figures
        ]
        head = ("driver", *(kind.name.lower().replace("_", " ") for kind in CellClass))
        return [Table(head, rows), f"\n{'page':<12}{self.page}", f"{'arrays':<12}{self.folder}"]

    def judged(self) -> list[Judged]:
        """Return each driver's figures; NaN: of outcomes, where no cell has any."""
        return [self._judged(name) for name in self.drivers]

    def _judged(self, driver: str) -> Judged:
        known, name = self.figures(driver), self.scenario.name
        holds = any(known[item] for item in ("avoided", "preventable", "unpreventable"))
        figures = {
            figure: known[figure]
            if holds or figure in ("not_applicable", "no_result")
            else float("nan")
            for figure in FIGURES
        }
        facts = {"scenario": name, "ego": driver, "models": ", ".join(self.models)}
        for axis, unit, v in zip(self.grid.names, self.grid.units, self.grid.values, strict=True):
            facts[f"axis {axis}"] = f"{v[0]:.6g} to {v[-1]:.6g} {unit}, {len(v)} values"
        counts = ((item, count) for item, count in figures.items() if not item.endswith("_share"))
        return Judged(
            suite=f"{name} preventability",
            group=f"bridgegen.{name}.{driver.replace('.', '_')}",
            test="the map has results",
            holds=holds,
            details=", ".join(f"{item} {count:.0f}" for item, count in counts),
            figures=figures,
            facts=facts | {"command": self.command, "page": str(self.page)},
            of=driver,
        )

    def write(self, pictures: Sequence["CellPicture"] = ()) -> tuple[Path, ...]:
        """Write arrays, figures, the page, and a table where the extra for Parquet is there.

        Args:
            pictures: cells that the page plays.

        Raises:
            StorageError: they cannot be written.
        """
        from bridgegen.jobs.preventability.page import write_page

        paths = [self.folder / ARRAYS, self.folder / SUMMARY, self.folder / PAGE]
        data = io.BytesIO()
        arrays: dict[str, Any] = {
            f"axis_{name}": values
            for name, values in zip(self.grid.names, self.grid.values, strict=True)
        }
        arrays["drivers"], arrays["simulated"] = np.array(self.drivers), np.array(self.simulated)
        arrays["classes"] = np.stack([self.classes[name] for name in self.drivers])
        arrays["outcomes"] = self.outcomes
        np.savez_compressed(data, **arrays)
        write_whole(paths[0], [data.getvalue()])
        figures = {
            "scenario": self.scenario.name,
            "grid": self.grid.to_dict(),
            "cells": self.grid.cells,
            "models": list(self.models),
            "drivers": [self.figures(name) for name in self.drivers],
        }
        write_whole(paths[1], [json.dumps(figures, indent=1).encode()])
        write_page(paths[2], self, pictures)
        # The table is a copy for other tools; the arrays hold all of it, and pyarrow (150 MB) is an
        # extra.
        if is_installed("parquet"):
            paths.append(self.folder / TABLE)
            self._write_table(paths[-1])
        return tuple(paths)

    def _write_table(self, path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as parquet

        text = pa.dictionary(pa.int32(), pa.string())
        fields = [(name, pa.float64()) for name in self.grid.names]
        schema = pa.schema([*fields, *((name, text) for name in self.drivers)])
        labels = pa.array([class_.label for class_ in CellClass])
        with (
            writing_whole(path) as file,
            parquet.ParquetWriter(file, schema, compression="zstd") as writer,
        ):
            for start in range(0, self.grid.cells, GROUP):
                cells = np.arange(start, min(start + GROUP, self.grid.cells))
                at = np.unravel_index(cells, self.grid.shape)
                columns: list[Any] = [
                    values[i] for values, i in zip(self.grid.values, at, strict=True)
                ]
                for codes in self.classes.values():
                    index = pa.array(codes.ravel()[cells].astype(np.int32))
                    columns.append(pa.DictionaryArray.from_arrays(index, labels))
                writer.write_table(pa.table(columns, schema=schema))


def _cell(figures: Mapping[str, Any], kind: CellClass) -> str:
    count, share = figures[kind.name.lower()], figures.get(f"{kind.name.lower()}_share")
    return f"{count:,} {percent(share)}" if isinstance(share, float) else f"{count:,}"


def simulated(drivers: Sequence[str], models: Sequence[str]) -> tuple[str, ...]:
    """Return the drivers, then the models that are not among them."""
    return (*drivers, *(model for model in models if model not in drivers))


# --- A map's folder: what it is a map of, and the outcomes of the chunks of cells that are done ---


CHUNK = 16_384
"""Number of cells of a chunk: what is lost at most when a map is stopped. No result depends on
it."""

SETTINGS = "map.json"
CHUNKS = "chunks"


class ChunkStore:
    """The chunks of a map, a file each, which a later call with the same settings reads.

    Args:
        folder: of the map; made if it does not exist.
        settings: what the outcomes depend on, as JSON's types.
        drivers: how many outcomes a cell has.
        cells: how many cells the map has.

    Raises:
        StorageError: the folder holds another map or something else, or cannot be written.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any], drivers: int, cells: int) -> None:
        self.folder, self._drivers, self._cells = folder, drivers, cells
        claim(folder, settings, file=SETTINGS, pieces=CHUNKS, what="map")

    @property
    def count(self) -> int:
        """The number of chunks."""
        return -(-self._cells // CHUNK)

    def bounds(self, i: int) -> tuple[int, int]:
        """Return the numbers of a chunk's first cell and of the one after its last."""
        return i * CHUNK, min((i + 1) * CHUNK, self._cells)

    def read(self, i: int) -> Codes | None:
        """Return a chunk's outcomes, ``(drivers, n)``; None if it is not there, whole and sound."""
        start, stop = self.bounds(i)
        try:
            # A pickle would be code, and the folder may come from others. Whatever is wrong with a
            # chunk, it is simulated again: the file is a saving, not a source.
            found = np.load(io.BytesIO(read_bytes(self._path(i))), allow_pickle=False)
        except (OSError, ValueError, EOFError):
            return None
        if not isinstance(found, np.ndarray) or found.dtype != np.int8:
            return None
        if found.shape != (self._drivers, stop - start):
            return None
        return found if np.isin(found, list(Outcome)).all() else None

    def write(self, i: int, outcomes: Codes) -> None:
        """Keep a chunk's outcomes, whole or not at all.

        Raises:
            StorageError: it cannot be written.
        """
        data = io.BytesIO()
        np.save(data, outcomes, allow_pickle=False)
        write_whole(self._path(i), [data.getvalue()])

    def _path(self, i: int) -> Path:
        return self.folder / CHUNKS / f"{i:06d}.npy"
