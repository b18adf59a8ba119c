"""One judgement per finding: what braking, fixes and careful drivers say of it, reconciled.

Two judges ask whether a conflict could have been avoided. The conflict analysis asks it of the
careful driver of UN R157, who brakes some time after the risk arose. The neighbours ask it of each
fix, another driver among them, who may yield before there is a risk. Where they differ, the
sentence says which of them says what.
"""

from bridgegen.assess.cause import Cause
from bridgegen.base.physics import CAREFUL_REACTION
from bridgegen.search.triage.record import Neighbourhood, Treatment

BRAKING = f"braking {CAREFUL_REACTION:g} s after the risk arose"

_IN_ONE_REPLAY = "in one replay"
_FIXES = {
    Cause.PERCEPTION.label: "ideal perception",
    Cause.VEHICLE_DYNAMICS.label: "a kinematic vehicle",
    Cause.CONTROL.label: "ideal control or a dry road",
}


def judgement(
    cause: str, near: Neighbourhood | None, *, preventable: bool | None, responsible: str
) -> str:
    """Return in one clause what caused a finding, and what would have avoided it; "" if unknown.

    Args:
        cause: its label; tested by its neighbours if they are given with fixes, else quick.
        near: its neighbours, if they were simulated.
        preventable: whether the careful driver of UN R157 would have avoided it by braking; None
            where that is not known.
        responsible: label of the responsible party.
    """
    tested = near if near is not None and near.cause else None
    if not cause:
        return ""
    if cause == "sensitive" and tested is not None:
        rest = tested.rows - tested.harmful
        return (
            "root cause not known: a small change of the parameters alone prevents it in "
            f"{rest} of {tested.rows} nearby scenarios"
        )
    if cause == "not known":
        return "root cause not known: too few nearby scenarios have a result with each fix"
    if cause == Cause.UNAVOIDABLE.label:
        return _unavoidable(tested, preventable, responsible)
    fix = tested.fix if tested is not None else None
    where = _IN_ONE_REPLAY
    if tested is not None and fix is not None:
        where = f"in {fix.gone} of {_harmful(tested, fix)} nearby scenarios"
    driver = _driver(fix)
    if preventable is False:
        does = f"a driver that yields earlier{driver} does"
        if cause != Cause.PLANNING.label:
            does = f"{_FIXES[cause]} does"
        return f"root cause {cause}: {BRAKING} would not have avoided it; {does}, {where}"
    helps = _FIXES.get(cause, f"a careful driver{driver}")
    return f"root cause {cause}: {helps} prevents it {where}"


def _unavoidable(tested: Neighbourhood | None, preventable: bool | None, responsible: str) -> str:
    """Return that no fix was found, with those that were tried: another driver may cope."""
    where, which = _IN_ONE_REPLAY, ""
    if tested is not None:
        where = "in a significant share of nearby scenarios"
        which = f" ({', '.join(fix.name for fix in tested.fixes)})"
    none = f"none of the fixes that were tried{which}"
    if preventable:
        return f"root cause not found: {BRAKING} would have avoided it, but {none} does {where}"
    said = "unavoidable by what was tried:"
    if responsible in ("ego", "shared"):  # it could have kept its duty
        said = "root cause not found: the ego is responsible, but"
    braking = f", nor would {BRAKING}" if preventable is False else ""
    return f"{said} {none} prevents it {where}{braking}"


def _harmful(near: Neighbourhood, fix: Treatment) -> int:
    """Return how many of the neighbours that have a result with a fix are harmful without it."""
    return min(near.harmful, fix.rows) if fix.before is None else fix.before


def _driver(fix: Treatment | None) -> str:
    """Return the name of a careful driver in brackets."""
    if fix is None or not fix.name.endswith(" drives"):
        return ""
    return f" ({fix.name.removesuffix(' drives')})"
