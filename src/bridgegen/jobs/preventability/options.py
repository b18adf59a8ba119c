"""What a preventability map can be asked, and the figures that it states."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bridgegen.engine.options import file_forms
from bridgegen.engine.options.forms import FIXED, NAMES, PATH, Form
from bridgegen.engine.options.option import DRIVER, OUTPUT, option
from bridgegen.jobs.frame import DRIVERS, OF_SCENARIO, DriveOptions, Job, SimulatingOptions

if TYPE_CHECKING:
    from bridgegen.jobs.preventability.grid import GridAxis

MODELS = ("un-r157", "fsm")
"""The models of UN R157, annex 3: a collision that one of them avoids is preventable."""


def _axes(grid: Any) -> list[str]:
    """Return the texts of axes that texts or `GridAxis` state."""
    if not isinstance(grid, Mapping):
        return list(grid or ())
    return [f"{name}={item.low}:{item.high}:{item.n}" for name, item in grid.items()]


def _repeated(spelling: str, texts: Sequence[str]) -> list[str]:
    return [word for text in texts for word in (spelling, text)]


GRID = Form(
    list[str],
    words=lambda spelling, grid: _repeated(spelling, _axes(grid)),
    in_file=file_forms.TEXTS,
    valid=lambda grid: isinstance(grid, Mapping | Sequence) and not isinstance(grid, str),
    must="axes by the names of parameters, or texts NAME=LOW:HIGH:N",
)


@dataclass(frozen=True, kw_only=True)
class MapOptions(DriveOptions, SimulatingOptions):
    """The options of ``map_preventability``."""

    scenario: str | Path = field(kw_only=False, metadata=OF_SCENARIO)
    ego: str | Sequence[str] = field(
        kw_only=False,
        metadata=option(
            DRIVERS,
            "Driver under test; may be repeated, or several separated by commas: these are "
            "compared.",
            group=DRIVER,
            names="driver",
        ),
    )
    grid: "Mapping[str, GridAxis] | Sequence[str] | None" = field(
        default=None,
        metadata=option(
            GRID,
            "An axis: NAME=LOW:HIGH:N; may be repeated. The first is the pictures' X axis, the "
            "second Y; pictures differ in the others.",
            shown="that of the regulation's scenario",
        ),
    )
    models: Sequence[str] = field(
        default=MODELS,
        metadata=option(
            NAMES,
            "A collision is preventable if one of these drivers avoids it.",
            shown=",".join(MODELS),
            group=DRIVER,
            names="driver",
        ),
    )
    fixed: Mapping[str, float | str] = field(
        default_factory=dict,
        metadata=option(
            FIXED,
            "Hold another parameter at a value.",
            spelling="--fix",
            hint="NAME=VALUE; may be repeated.",
            names="parameter",
        ),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "The map's folder; a stopped map is resumed.",
            shown="preventability/SCENARIO",
            group=OUTPUT,
        ),
    )


FIGURES = {
    "avoided": "cells in which the driver does not collide",
    "preventable": "cells in which it collides, and a model does not",
    "unpreventable": "cells in which it collides, and so do all models",
    "not_applicable": "cells whose values break a constraint, or whose traffic is implausible",
    "no_result": "cells in which the driver failed, or a model that decides",
    "avoided_share": "avoided / cells that apply and have a result",
    "preventable_share": "preventable / the same",
    "unpreventable_share": "unpreventable / the same",
}
"""The figures of a map, for each driver, that ``--fail-if`` accepts."""

JOB = Job(
    name="preventability",
    options=MapOptions,
    function="bridgegen.jobs.preventability.preventability:map_preventability",
    help="""Map which scenarios of a grid a driver avoids.

    And which of its collisions the driver models of UN R157 avoid. Writes arrays and a page.
    """,
    figures=FIGURES,
    example="preventable > 0",
)
