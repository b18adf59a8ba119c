"""A safety case: the goals that decide, and the files."""

import sys
from typing import TYPE_CHECKING

from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from bridgegen.jobs.safety_case import Exported


def print_safety_case(exported: "Exported", *, as_json: bool) -> None:
    """Print the status of the goals of each run, then the files."""
    goals = [(one.id, one.status, one.statement.text) for one in exported.case.main_goals()]
    print_table(("goal", "status", "claim"), goals, as_json=as_json)
    for run, why in exported.unjudged.items():
        said = why.removeprefix("Not judged: ")
        print(f"bridgegen: NOT JUDGED: {run} supports no claim on its driver: {said}",
              file=sys.stderr)  # fmt: skip
    if as_json:
        return
    print(f"\n{'page':<12}{exported.page}")
    print(f"{'case':<12}{exported.file}")
    print(f"{'check it':<12}python {exported.script}")
