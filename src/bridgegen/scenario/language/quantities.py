"""Numbers of a scenario file: constants, or names of parameters in the right unit."""

import math
from collections.abc import Mapping, Set

from bridgegen.scenario.language.parameters import Axis, Derived, Parameter, nearest
from bridgegen.scenario.language.plain_yaml import Document, Path
from bridgegen.scenario.language.roads import Quantity


class Quantities:
    """Checks each number that a file states, and collects what is wrong.

    Attributes:
        problems: the rules that are broken, with their lines.
        used: the parameters that are referred to.

    Args:
        document: the scenario file.
        parameters: what may be referred to.
        derived: likewise; they follow from the parameters, and have no range of their own.
        declared: all names, also of what is declared wrongly: no reason to call it unknown.
    """

    def __init__(
        self,
        document: Document,
        parameters: Mapping[str, Parameter],
        derived: Mapping[str, Derived],
        declared: Set[str],
    ) -> None:
        self.document = document
        self.parameters, self.derived, self.declared = parameters, derived, declared
        self.problems: list[str] = []
        self.used: set[str] = set()

    def report(self, problem: str, path: Path) -> None:
        """Record a problem with its line."""
        self.problems.append(f"{problem} ({self.document.at(path)})")

    def check(
        self, value: Quantity, unit: str, path: Path, *, low: float = 0.0, above: bool = False
    ) -> None:
        """Check a constant, or a reference, that must be ≥ ``low`` (> it, if ``above``)."""
        label = ".".join(str(part) for part in path)
        limit = "finite" if low == -math.inf else f"at least {low:g}"
        rule = f"{label} [{unit}] must be {f'greater than {low:g}' if above else limit}"
        if not isinstance(value, str):
            if not (value > low if above else value >= low) or math.isinf(value):
                extra = "" if low == -math.inf else " and finite"
                self.report(f"{rule}{extra}, got {value}", path)
            return
        self.used.add(value)
        one = self.parameters.get(value) or self.derived.get(value)
        if one is None:
            if value not in self.declared:
                hint = nearest(value, [*self.parameters, *self.derived])
                self.report(f"{label} names the unknown parameter '{value}'{hint}", path)
            return
        if isinstance(one, Parameter) and one.kind.names:
            self.report(
                f"{label} needs a number, '{value}' is a category: derive a number from it", path
            )
        elif one.unit != unit:
            self.report(f"{label} needs a parameter in {unit}, '{value}' is in {one.unit}", path)
        elif isinstance(one, Parameter) and (one.low < low or (above and one.low == low)):
            self.report(f"{rule}, '{value}' goes down to {one.low:g}", path)
        if one.axis is Axis.STATIC:
            self.report(
                f"{label} must not depend on the static axis, '{value}' does: "
                "one storyboard serves every road network",
                path,
            )
