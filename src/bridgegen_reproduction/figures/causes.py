"""Why critical scenarios with the reference driver are critical, as bars."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bridgegen_reproduction.figures.look import SIZE, Theme, legend, panels, title_of
from bridgegen_reproduction.perception import CAUSES, Causes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HATCHES = ("", "////", "....", "xx")


def causes(found: Sequence[Causes], theme: Theme) -> "Figure":
    """Draw, for each scenario and method, the shares of the causes of all critical scenarios."""
    from matplotlib.patches import Patch

    figure, (axes,) = panels(1, 0.9 + 0.21 * max(len(found), 3), theme)
    axes.grid(visible=False, axis="y")
    colours = (theme.colours[0], theme.colours[4], theme.colours[5], theme.grid)
    place, places, names = 0.0, [], []
    last = None
    for item in found:
        if last is not None and item.scenario != last:
            place += 0.6
        last, left = item.scenario, 0.0
        for count, colour, hatch in zip(item.by_cause, colours, _HATCHES, strict=True):
            if count:
                width = 100.0 * count / item.critical
                axes.barh(
                    place,
                    width,
                    left=left,
                    height=0.74,
                    color=colour,
                    hatch=hatch,
                    edgecolor=theme.muted,
                    linewidth=0.6,
                )
                left += width
        axes.text(
            101.5,
            place,
            f"{item.critical:,} of {item.evaluations:,}",
            va="center",
            fontsize=SIZE - 0.5,
            color=theme.ink,
        )
        places.append(place)
        names.append(f"S{item.scenario[-1]}  {title_of(item.algorithm)}")
        place += 1.0
    axes.set_yticks(places, names, color=theme.ink)
    axes.set_ylim(max(place - 0.4, 0.6), -0.6)
    axes.set_xlim(0, 118)
    axes.set_xticks(range(0, 101, 20))
    axes.set_xlabel(
        "share of the critical scenarios [%]; beside: how many, of how many evaluations"
    )
    words = ("perception: vanish when it is ideal", "planning", "control", "unavoidable")
    legend(
        figure,
        [
            Patch(facecolor=colour, hatch=hatch, edgecolor=theme.muted, label=word)
            for colour, hatch, word in zip(colours, _HATCHES, words, strict=True)
        ],
        theme,
    )
    assert len(words) == len(CAUSES)
    return figure
