"""What a reader did not take as it stands: one sentence per kind of thing, however many."""

from collections.abc import Iterator

SHOWN = 20
"""Largest number of kinds of warnings that are listed."""


class Notes:
    """Collects warnings; of those of one kind the first is told, and how many follow."""

    def __init__(self) -> None:
        self._kinds: dict[str, tuple[int, str, int]] = {}

    def add(self, kind: str, line: int, sentence: str) -> None:
        """Add a warning.

        Args:
            kind: what it has in common with others.
            line: of the file; 0 where it is not known.
            sentence: with the place and the value.
        """
        first_line, first, count = self._kinds.get(kind, (line, sentence, 0))
        self._kinds[kind] = (first_line, first, count + 1)

    def sentences(self, place: str) -> Iterator[str]:
        """Yield the warnings about a file, in the order of their lines."""
        kinds = sorted(self._kinds.values())
        for line, sentence, count in kinds[:SHOWN]:
            more = f" (and {count - 1} more such)" if count > 1 else ""
            where = f"{place}, line {line}" if line else place
            yield f"{where}: {sentence}{more}"
        if len(kinds) > SHOWN:
            yield f"{place}: and {len(kinds) - SHOWN} more kinds of warnings"
