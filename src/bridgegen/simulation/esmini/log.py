"""What esmini writes about a scenario: it may fail, and say so nowhere else."""

from pathlib import Path

_MARK = "[error] "
_REMARK = "INFO: "  # esmini marks elements of a map that it skips as errors, with this word
_LONGEST = 300


def error_in(log: Path) -> str | None:
    """Return the first error in a log; None if there is none, or no log.

    Warnings are ignored, and remarks on elements of the map that esmini does not draw: it warns of
    missing 3D models, for example.
    """
    try:
        text = log.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    for line in text.splitlines():
        _, mark, said = line.partition(_MARK)
        if mark and not said.startswith(_REMARK):
            return said.strip()[:_LONGEST]
    return None
