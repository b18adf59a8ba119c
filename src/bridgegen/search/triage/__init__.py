"""From harmful rows to findings: robustness, causes, failure modes, minimal scenarios, bounds."""

from bridgegen.search.triage.record import (
    JSON_FILE,
    Bound,
    Condition,
    Estimate,
    Least,
    Minimal,
    Mode,
    Neighbourhood,
    Treatment,
    Triage,
    read_record,
    write_record,
)

__all__ = ["JSON_FILE", "Bound", "Condition", "Estimate", "Least", "Minimal", "Mode",
           "Neighbourhood", "Treatment", "Triage", "read_record", "write_record"]  # fmt: skip
