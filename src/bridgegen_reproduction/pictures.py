"""Every figure of Section V, drawn from the results of the runs, for both pages and for papers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.jobs.compare.record import points
from bridgegen.jobs.compare.result import Comparison
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.structure import LAYERS
from bridgegen_reproduction import paper
from bridgegen_reproduction.document import Picture
from bridgegen_reproduction.figures.causes import causes
from bridgegen_reproduction.figures.crossroads import collision_points, crossing_of
from bridgegen_reproduction.figures.distributions import Violin, iterations, violins
from bridgegen_reproduction.figures.fronts import curves_of, hypervolume_and_spread
from bridgegen_reproduction.figures.look import DARK, LIGHT, Theme, pdf, png
from bridgegen_reproduction.figures.ontology import ontology, picture_of
from bridgegen_reproduction.protocol import PRINTED
from bridgegen_reproduction.runs import Run, of
from bridgegen_reproduction.story import Found

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw = Callable[[Theme], "Figure"]


def pictures(found: Found, printed: Comparison) -> dict[str, Picture]:
    """Return the figures by name; those of which there is nothing to draw are not among them."""
    drawn = {}
    for name, caption, draw in _drawings(found, printed):
        figure = draw(LIGHT)
        light = png(figure)
        figure.set_layout_engine("none")  # the PDF is laid out as the PNG was
        drawn[name] = Picture(name, caption, light, png(draw(DARK)), pdf(figure))
    return drawn


def _drawings(found: Found, printed: Comparison) -> Iterator[tuple[str, str, Draw]]:
    seeds = found.protocol.seeds
    of_seeds = "one seed" if seeds == 1 else f"{seeds} seeds"
    for group, methods in paper.GROUPS.items():
        runs = {
            m.algorithm: these
            for m in methods
            if (these := of(found.runs, PRINTED, paper.MAIN, m.algorithm))
        }
        if not runs:
            continue
        kind = "one objective" if group == "single" else "many objectives"
        yield (
            f"{group}-iterations",
            f"S4, {kind}: d_min and v_d over the iterations; median and quartiles of the "
            f"evaluations of an iteration, {of_seeds}.",
            partial(iterations, runs, ("d_min", "v_d")),
        )
        quantities = ("d_min", "v_d", "fitness") if group == "single" else ("d_min", "v_d")
        columns = {
            quantity: {name: _violin(group, name, quantity, these) for name, these in runs.items()}
            for quantity in quantities
        }
        yield (
            f"{group}-violins",
            f"S4, {kind}: {', '.join(quantities)} of all evaluations, {of_seeds}, beside the "
            "paper’s means and medians"
            + (" (its fitness of PSO is a misprint)." if group == "single" else "."),
            partial(violins, columns),
        )
    yield from _fronts(found, printed)
    if any(cause.critical for cause in found.causes):
        yield (
            "causes",
            "With the reference driver: why critical scenarios are critical, by scenario and "
            f"method, {of_seeds} together.",
            partial(causes, found.causes),
        )
    yield from _places(found)


def _violin(group: str, algorithm: str, quantity: str, runs: Sequence[Run]) -> Violin:
    told = paper.RESULTS[group, algorithm]
    nan = float("nan")
    return Violin(
        paper.TITLES[algorithm],
        np.concatenate([getattr(run, quantity) for run in runs]),
        (told.get(f"avg_{quantity}", nan), told.get(f"median_{quantity}", nan)),
    )


def _fronts(found: Found, printed: Comparison) -> Iterator[tuple[str, str, Draw]]:
    if paper.MAIN not in printed.measured:
        return
    names = [group.algorithm for group in paper.GROUPS["many"]]
    curves = curves_of(printed.records, printed.measured[paper.MAIN], names)
    at = points(found.protocol.budget).tolist()
    yield (
        "hypervolume-spread",
        "S4, many objectives: hypervolume and spread of what was found, over the evaluations; "
        "medians and quartiles over the seeds.",
        partial(hypervolume_and_spread, curves, at),
    )


def _places(found: Found) -> Iterator[tuple[str, str, Draw]]:
    crossings = {}
    for scenario in found.protocol.scenarios:
        keys = [
            (part, cell)
            for part, cell in found.protocol.cells()
            if part is PRINTED and cell.scenario == scenario and (part.name, cell) in found.runs
        ]
        if keys:
            runs = [found.runs[part.name, cell] for part, cell in keys]
            crossings[scenario] = crossing_of(found.protocol.run_folder(*keys[0]), runs)
    if crossings:
        yield (
            "collision-points",
            "Where the ego and the background vehicle meet: the middle of their overlap at the "
            "first contact, of all methods’ critical scenarios; lines are their routes.",
            partial(collision_points, crossings),
        )
    main = load(paper.shipped(paper.MAIN))
    assert isinstance(main, LogicalScenario)
    picture = picture_of(main)
    yield (
        "ontology",
        "S4 in the ontology: classes (in italics) and individuals in five layers, at the defaults.",
        partial(ontology, picture, _names(LAYERS)),
    )


def _names(layers: Mapping[int, str]) -> list[str]:
    return [layers[number] for number in sorted(layers)]
