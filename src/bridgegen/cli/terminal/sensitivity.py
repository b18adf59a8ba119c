"""Which constants the verdicts of a run hang on, as a table."""

from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import print_table

if TYPE_CHECKING:
    from bridgegen.search.sensitivity import Sensitivity

LEAST_EFFECT = 0.005
"""The least mu* for which a factor that changes no verdict is listed."""


class SensitivityProgress(Live):
    """The live progress: evaluations with other constants."""

    def say(self, text: str) -> None:
        """Print how much is to be done."""
        self.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def progress(self, done: int, total: int) -> None:
        """Show how many evaluations are done, and how many there are at most."""
        self.show(what="varying constants", done=done, total=total)


def print_sensitivity(run: Path, found: "Sensitivity", *, as_json: bool) -> None:
    """Print what each constant moves, then the findings that hang on one."""
    from bridgegen.base.units import percent
    from bridgegen.jobs.search.report import SENSITIVITY
    from bridgegen.jobs.search.sensitivity import in_a_sentence, shares

    if as_json:
        print(found.model_dump_json(indent=2))
        return
    moved = [one for one in shares(found) if one.flips or one.alone or one.mu_star >= LEAST_EFFECT]
    if moved:
        print_table(
            ("constant or parameter", "verdict changes", "trajectories", "mu* of harm", "alone"),
            [
                (
                    one.name,
                    percent(one.share),
                    f"{one.flips} of {one.of}",
                    f"{one.mu_star:.3f}",
                    f"{one.alone} of {len(found.findings)}" if one.kind == "constant" else "",
                )
                for one in moved
            ],
            as_json=False,
            texts=1,
        )
        print()
    for finding in found.findings:
        if finding.sentences:
            print(f"evaluation {finding.evaluation + 1}: {finding.title}")
        for sentence in finding.sentences:
            print(f"    {sentence}")
    print(f"{in_a_sentence(found)}.")
    if found.left_out:
        print(
            f"{found.left_out} more were not analysed: --findings, --budget, or a verdict that is "
            "not reproduced."
        )
    print(f"{found.evaluations:,} evaluations, seed {found.seed}: {run / SENSITIVITY}")
