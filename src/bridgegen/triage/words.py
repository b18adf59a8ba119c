"""A run's triage in lines of text, for the terminal."""

from bridgegen.regions.words import percent
from bridgegen.triage.record import Mode, Triage


def headline(found: Triage) -> str:
    """Return the number of failure modes, or the least margin, and the share of the space."""
    return found.bound.sentence


def mode_in_words(mode: Mode, found: Triage) -> str:
    """Return a failure mode in one line: count, title, worst severity, robustness, cause, share."""
    parts = [f"{mode.count:>5} × {mode.title}"]
    if mode.conflict == "contact":
        parts.append(f"MAIS3+ {percent(mode.severity)}")
    else:
        parts.append(f"harm {mode.harm:.2f}")
    if mode.robustness is not None:
        robust = "knife-edge" if mode.knife_edge else "robust"
        parts.append(f"{robust} ({percent(mode.robustness)} of its neighbours)")
    parts.append(cause_in_words(mode, found))
    if mode.space.drawn and mode.space.share is not None:
        low, high = percent(mode.space.low), percent(mode.space.high)
        seen = f"{percent(mode.space.share)} of the space ({low} to {high})"
        parts.append(seen if mode.space.harmful else f"at most {high} of the space")
    return "; ".join(part for part in parts if part)


def shortly(mode: Mode) -> str:
    """Return a failure mode in few words: what happens, how often, how severe, its cause."""
    often = f"{mode.count} evaluation" + "s" * (mode.count != 1)
    severe = f"MAIS3+ {percent(mode.severity)}" if mode.conflict == "contact" else ""
    return f"{mode.title}: {', '.join(one for one in (often, severe, mode.cause) if one)}"


def cause_in_words(mode: Mode, found: Triage) -> str:
    """Return a mode's cause, with the fix that shows it and by how much it lowers harm.

    The drop is that of the harmful share of the neighbours, with its 95 % interval, beside the
    drop by a random move of the same size, the placebo.
    """
    near = found.neighbourhood(mode.shown)
    if not mode.cause:
        return ""
    if not mode.tested or near is None or near.placebo is None:
        return f"{mode.cause} (quick)"
    if mode.cause == "sensitive":
        return "sensitive: a small change alone removes the harm"
    fix = near.fix
    if fix is None:
        return "unavoidable: no fix removes it"
    return (
        f"{mode.cause}: {_drop(fix.drop)} if {fix.name} ({_drop(fix.low)} to {_drop(fix.high)}; "
        f"placebo {_drop(near.placebo.drop)})"
    )


def _drop(share: float) -> str:
    """Return the change of a share in percentage points: −50 for a drop by one half."""
    points = round(-100.0 * share)
    return f"{'−' if points < 0 else '+' if points > 0 else '±'}{abs(points)}"
