"""A dashboard: one bar for the folders that are read, then what fails."""

import json
from typing import TYPE_CHECKING

from bridgegen.cli.terminal.live import Live

if TYPE_CHECKING:
    from bridgegen.jobs.dashboard import Dashboard

MOST_MODES = 12
"""Failure modes that are printed."""


class DashboardScreen(Live):
    """The live progress of a dashboard."""

    def begun(self, number: int, total: int) -> None:
        """Show how many folders are read."""
        self.show(what="folders", done=number, total=total, facts="")


def print_dashboard(found: "Dashboard", *, as_json: bool = False) -> None:
    """Print what fails now, in two sentences and by failure mode; then the files."""
    from bridgegen.jobs.dashboard.sentences import failing_sentence, requirements_sentence

    if as_json:
        print(json.dumps(_facts(found), indent=2, ensure_ascii=False))
        return
    print(failing_sentence(found))
    if words := requirements_sentence(found):
        print(words)
    for one in found.failing[:MOST_MODES]:
        status = "regression" if one.is_regression else one.status
        print(f"  {status:<11}{one.key.id}  {one.key.scenario}, {one.key.driver}: {one.title}")
    if len(found.failing) > MOST_MODES:
        print(f"  and {len(found.failing) - MOST_MODES:,} more")
    for problem in found.project.problems[:MOST_MODES]:
        print(f"  not read    {problem.place}: {problem.why}")
    if len(found.project.problems) > MOST_MODES:
        print(f"  and {len(found.project.problems) - MOST_MODES:,} more are not read")
    for note in found.notes[:MOST_MODES]:
        print(f"{'note':<12}{note}")
    if found.added:
        print(f"{'statuses':<12}{found.status_path}: {found.added:,} added as new")
    print(f"{'page':<12}{found.page}")


def _facts(found: "Dashboard") -> dict[str, object]:
    return {
        "page": str(found.page),
        "figures": found.figures,
        "added": found.added,
        "modes": [
            {
                "id": one.key.id,
                "status": one.status,
                "comment": one.comment,
                "decided": one.decided,
                "fails_now": one.fails_now,
                "regression": one.is_regression,
                "scenario": one.key.scenario,
                "driver": one.key.driver,
                "title": one.title,
                "evaluations": one.count,
                "severity": one.severity,
                "results": [result.source for result in one.results],
            }
            for one in found.modes
        ],
        "notes": list(found.notes),
        "problems": [{"place": one.place, "why": one.why} for one in found.project.problems],
    }
