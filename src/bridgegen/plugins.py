"""What installed packages add to BridgeGen, by entry points: algorithms, metrics, simulators."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bridgegen.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@dataclass(frozen=True)
class PlugIns:
    """One kind of things that packages may add.

    Attributes:
        kind: what one is, for messages: "algorithm".
        group: of the entry points.
    """

    kind: str
    group: str

    def names(self, ours: Collection[str]) -> list[str]:
        """Return all names, ours first; imports no other package."""
        return [*ours, *sorted(set(self._points()) - set(ours))]

    def load(self, name: str, ours: Collection[str]) -> Any:
        """Return what an installed package offers by a name; None where the name is ours alone.

        Args:
            name: of it.
            ours: the names that BridgeGen itself takes.

        Raises:
            UnknownNameError: nobody offers it; names the nearest.
            InputError: it cannot be loaded, or takes a name that is in use.
        """
        added = self._points().get(name, [])
        if len(added) > (0 if name in ours else 1):
            places = [*(["bridgegen"] if name in ours else []), *(one.value for one in added)]
            raise InputError(
                f"{self.kind} '{name}' is declared more than once: {', '.join(places)}"
            )
        if name in ours:
            return None
        if not added:
            raise UnknownNameError(self.kind, name, self.names(ours))
        try:
            return added[0].load()
        except Exception as error:  # whatever a stranger's module raises while it is imported
            raise InputError(
                f"{self.place(name)} cannot be loaded: {type(error).__name__}: {error}"
            ) from error

    def place(self, name: str) -> str:
        """Return what a plug-in is and where it is declared, for messages."""
        values = ", ".join(one.value for one in self._points().get(name, []))
        return f"{self.kind} '{name}' ({values}, entry point of '{self.group}')"

    def _points(self) -> dict[str, list["EntryPoint"]]:
        from importlib.metadata import entry_points

        found: dict[str, list[EntryPoint]] = {}
        for point in entry_points(group=self.group):
            # A package installed twice (a wheel beside an editable copy) lists the same twice.
            if all(point.value != other.value for other in found.setdefault(point.name, [])):
                found[point.name].append(point)
        return found
