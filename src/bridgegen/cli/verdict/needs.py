"""Pass criteria and their results as ``needs.json``, which sphinx-needs imports (``needimport``).

Source: sphinx-needs 9.1, "needs.json format" and its default ids and types.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bridgegen import __version__
from bridgegen.assess.criteria import margin_in_words
from bridgegen.base.disk import write_whole
from bridgegen.cli.verdict.fail_if import Outcome, words_of
from bridgegen.cli.verdict.junit import writable
from bridgegen.jobs.search.exported import read_facts
from bridgegen.jobs.search.run import Run

MARK = '"versions"'
"""Text that is in the beginning of each such file."""

_STATUS = {"passed": "met", "failed": "violated", "unknown": "not judged"}


def write_needs(path: Path, run: Run, outcomes: Sequence[Outcome]) -> None:
    """Write a run's pass criteria as needs, and its findings, which violate them, as tests.

    Args:
        path: a new file, or an earlier one.
        run: with an outcome for each of its criteria.
        outcomes: of these, in their order.

    Raises:
        StorageError: it cannot be written, or another kind of file exists.
    """
    writable(path, MARK, "needs.json")
    settings = run.settings
    of = f"{Path(settings.scenario).stem}_{settings.ego}"
    about = {"run": str(run.folder), "tags": ["bridgegen"]}
    facts = {scenario: read_facts(scenario.with_suffix(".json")) for scenario in run.scenarios}
    needs: list[dict[str, Any]] = []
    linked: dict[Path, None] = {}
    for criterion, outcome in zip(run.criteria, outcomes, strict=True):
        asked = criterion.criterion
        margins = {s: f.metrics.get(asked.quantity) for s, f in facts.items()}
        violating = [s for s, m in margins.items() if m and m.value is not None and m.value < 0.0]
        linked |= dict.fromkeys(violating)
        content = f"{asked.states}\n\n{outcome.details}"
        needs.append(
            about
            | {
                "id": _id(of, asked.id),
                "type": "req",
                "title": words_of(asked),
                "status": _STATUS[outcome.verdict],
                "content": content,
                "tags": ["bridgegen", *asked.tags],
                "severity": asked.severity,
                "margin": margin_in_words(criterion.worst, criterion.unit),
                "links": [_id(of, scenario.stem) for scenario in violating],
            }
        )
    for scenario in linked:
        files = " ".join(f.name for f in sorted(scenario.parent.glob(f"{scenario.stem}.*")))
        content = f"``bridgegen simulate {scenario}``\n\nFiles: {files}; playback: {run.report}"
        needs.append(
            about
            | {
                "id": _id(of, scenario.stem),
                "type": "test",
                "title": f"{Path(settings.scenario).stem} {scenario.stem}",
                "status": "failed",
                "content": content,
                "links": [],
            }
        )
    version = {"needs": {need["id"]: need for need in needs}, "needs_amount": len(needs)}
    content = json.dumps(
        {
            "project": "bridgegen",
            "current_version": __version__,
            "versions": {__version__: version},
        },
        indent=2,
        ensure_ascii=False,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, [f"{content}\n".encode()])


def _id(of: str, name: str) -> str:
    """Return an id that sphinx-needs takes: capitals, digits and underscores, at least five."""
    return re.sub("[^A-Z0-9]+", "_", f"BG_{of}_{name}".upper())
