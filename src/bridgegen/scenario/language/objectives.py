"""The ``objective`` of a scenario file: built, with the rules that it must keep."""

import math
from collections.abc import Callable
from typing import Literal

from bridgegen.scenario.language.plain_yaml import Path
from bridgegen.scenario.language.scenario import ObjectiveSpec, Term
from bridgegen.scenario.language.schema import ObjectiveSection
from bridgegen.scenario.language.thresholds import Thresholds

PAPERS = ObjectiveSpec((Term("d_min", 0.8297), Term("v_d", 0.1703)), "fixed", "raw", gated=False)
"""The paper's objective and thresholds (Section V, Table III), which count implausible traffic."""

HARM = ObjectiveSpec((Term("harm", 1.0),), "fixed", "raw", rule="harm")
"""Default objective: how much a scenario is a failure of the ego; see
``assess/conflict/harm.py``."""

_CRITICAL: Path = ("objective", "critical")


def read_objective(given: ObjectiveSection, report: Callable[[str, Path], None]) -> ObjectiveSpec:
    """Return what a scenario optimises, and report its problems.

    Args:
        given: the file's section.
        report: gets a problem and its path.
    """
    seen: set[str] = set()
    for number, term in enumerate(given.terms):
        path: Path = ("objective", "terms", number)
        if term.metric in seen:
            report(f"the metric '{term.metric}' occurs twice", path)
        seen.add(term.metric)
        if given.weights == "entropy" and term.weight is not None:
            report(f"weights by entropy leave no weight to {term.metric}", path)
        elif given.weights == "fixed" and not 0.0 < (term.weight or 0.0) < math.inf:
            report(
                f"fixed weights need one greater than 0 for {term.metric}, got {term.weight}",
                path,
            )
    limits = {} if isinstance(given.critical, str) else given.critical.model_dump()
    for key, value in list(limits.items()):
        if not 0.0 <= value < math.inf:
            report(f"{key} must be at least 0 and finite, got {value}", (*_CRITICAL, key))
            del limits[key]
    terms = tuple(Term(section.metric, section.weight) for section in given.terms)
    rule: Literal["harm", "thresholds", "criteria"] = "thresholds"
    if isinstance(given.critical, str):
        rule = given.critical
    return ObjectiveSpec(terms, given.weights, given.scale, Thresholds(**limits), rule)
