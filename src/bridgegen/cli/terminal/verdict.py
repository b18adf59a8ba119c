"""Outcomes of criteria on standard error: standard output may be JSON."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bridgegen.cli.verdict.fail_if import Outcome

_WORDS = {"passed": "passed", "failed": "FAILED", "unknown": "NOT JUDGED"}


def print_outcomes(outcomes: "Sequence[Outcome]") -> bool:
    """Print each outcome; return whether all passed."""
    for one in outcomes:
        word = _WORDS[one.verdict]
        print(f"bridgegen: {word}: {one.test} ({one.details})", file=sys.stderr)
    return all(one.verdict == "passed" for one in outcomes)
