"""Recordings as they are read, and what they hold."""

import json
import sys
from typing import TYPE_CHECKING

from bridgegen.screen.live import Live
from bridgegen.screen.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bridgegen.recordings.mine import Mined, Summary


class RecordingsScreen(Live):
    """The bar of the files that are read."""

    def progress(self, done: int, total: int) -> None:
        """Show how many of how many files are done."""
        self.show(what="files", done=done, total=total)


def print_mined(mined: "Mined", *, as_json: bool) -> None:
    """Print what was recorded, then its quality, the files, and on stderr what was left out."""
    for _, texts in mined.skipped:
        for text in texts:
            print(f"bridgegen: warning: skipped: {text}", file=sys.stderr)
    if mined.others:
        print(f"bridgegen: note: {len(mined.others)} files are no recordings", file=sys.stderr)
    if as_json:
        print(json.dumps({
            "recordings": [_facts(one) for one in mined.recordings],
            "skipped": [str(path) for path, _ in mined.skipped],
            "others": [str(path) for path in mined.others],
        }, indent=2))  # fmt: skip
        return
    head = ("recording", "format", "participants", "h", "km", "step [s]", "frame")
    print_table(head, [
        (one.facts.name, one.facts.format,
         ", ".join(f"{count:,} {kind}" for kind, count in one.participants.items()),
         float(f"{one.hours:.4g}"), float(f"{one.kilometres:.4g}"),
         float(f"{one.facts.time_step:.4g}"), one.facts.frame)
        for one in mined.recordings
    ], as_json=False)  # fmt: skip
    print()
    found = [row for row in _quality(mined) if row[1]]
    if found:
        of_rules = ("quality", "recordings", "participants", "count", "first")
        print_table(of_rules, found, as_json=False)
    else:
        print("quality: nothing to clean")
    print(f"\n{'page':<8}{mined.out / 'recordings.html'}")
    print(f"{'tables':<8}{mined.out / 'recordings.csv'}, {mined.out / 'quality.csv'}")


def _quality(mined: "Mined") -> "Iterator[tuple[str, int, int, int, str]]":
    """Yield what cleaning did, rule by rule, of all recordings together."""
    for same in zip(*(one.findings for one in mined.recordings), strict=True):
        applied = [each for each in same if each.count]
        yield (
            same[0].rule.value,
            len(applied),
            sum(each.participants for each in applied),
            sum(each.count for each in applied),
            applied[0].examples[0] if applied else "",
        )


def _facts(one: "Summary") -> dict[str, object]:
    facts = one.facts
    return {
        "name": facts.name, "format": facts.format, "file": facts.source, "frame": facts.frame,
        "map": facts.map, "time_step": facts.time_step, "duration": one.duration,
        "participants": one.participants, "states": one.states, "tracks": one.tracks,
        "hours": one.hours, "km": one.kilometres, "hours_read": one.read_hours,
        "km_read": one.read_kilometres, "notes": facts.notes,
        "quality": [
            {"rule": each.rule.value, "participants": each.participants, "count": each.count,
             "examples": each.examples}
            for each in one.findings
        ],
    }  # fmt: skip
