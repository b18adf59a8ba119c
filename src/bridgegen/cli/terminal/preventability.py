"""A preventability map: one bar for its cells, then its table."""

from typing import TYPE_CHECKING

from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from bridgegen.jobs.preventability import CellClass, PreventabilityMap
    from bridgegen.jobs.preventability.preventability import MapCallbacks


class MapScreen(Live):
    """A map's live progress."""

    @property
    def callbacks(self) -> "MapCallbacks":
        """The callbacks for a map."""
        from bridgegen.jobs.preventability.preventability import MapCallbacks

        return MapCallbacks(
            compile=self.say_compiling,
            cells=lambda done, total: self.show(what="cells", done=done, total=total),
        )


def print_map(result: "PreventabilityMap", seconds: float, *, as_json: bool) -> None:
    """Print the cells of each driver by class, as ``summary.json`` calls them; then the files."""
    from bridgegen.jobs.preventability import CellClass

    figures = [result.figures(name) for name in result.drivers]
    if as_json:
        head = tuple(figures[0])
        print_table(head, [tuple(one.values()) for one in figures], as_json=True)
        return
    rows = [(one["driver"], *(_cell(one, kind) for kind in CellClass)) for one in figures]
    head = ("driver", *(kind.name.lower().replace("_", " ") for kind in CellClass))
    print_table(head, rows, as_json=False)
    print(f"\n{'page':<12}{result.page}")
    print(f"{'arrays':<12}{result.folder}")
    print(f"{'wall time':<12}{seconds:.1f} s, {result.grid.cells:,} cells")


def _cell(figures: dict[str, object], kind: "CellClass") -> str:
    count, share = figures[kind.name.lower()], figures.get(f"{kind.name.lower()}_share")
    return f"{count:,} {share:.1%}" if isinstance(share, float) else f"{count:,}"
