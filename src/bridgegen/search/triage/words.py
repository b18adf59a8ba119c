"""A run's triage in lines of text, for the terminal."""

from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent
from bridgegen.search.triage.influence import ends_in_words, in_words
from bridgegen.search.triage.modes import of_found
from bridgegen.search.triage.record import Mode, Triage


def headline(found: Triage) -> str:
    """Return the number of failure modes, or the least margin, and the share of the space."""
    return found.bound.sentence


def covered(found: Triage | None) -> tuple[int, int] | None:
    """Return how many fresh random failures are of a mode that was found, of how many; or None."""
    if found is None or found.fresh is None or not found.bound.harmful:
        return None
    return of_found(range(1, len(found.modes) + 1), found.fresh.failures)


def covered_in_words(found: Triage) -> str:
    """Return the share of fresh random failures that is of a mode that was found, or ""."""
    if (counts := covered(found)) is None:
        return ""
    known, every = counts
    low, high = (percent(end) for end in clopper_pearson(known, every))
    share = f"{percent(known / every)} ({low} to {high}, 95 % confidence)"
    return f"{known} of the {every} that fail, {share}, are of a failure mode found"


def mode_in_words(mode: Mode, found: Triage) -> str:
    """Return a failure mode in one line: count, title, worst severity, robustness, cause, share.

    The cause is one judgement, see `bridgegen.search.triage.judgement`.
    """
    parts = [f"{mode.count:>5} × {mode.title}"]
    if mode.conflict == "contact":
        parts.append(f"MAIS3+ {percent(mode.severity)}")
    else:
        parts.append(f"harm {mode.harm:.2f}")
    parts.append(f"P {mode.probability.sentence}" if mode.probability else "")
    parts.append(robustness_in_words(mode, found))
    parts += [step_in_words(mode, found), repeats_in_words(mode, found)]
    parts.append(mode.judgement or mode.cause)
    if mode.space.drawn and mode.space.share is not None:
        low, high = percent(mode.space.low), percent(mode.space.high)
        seen = f"{percent(mode.space.share)} of the space ({low} to {high})"
        parts.append(seen if mode.space.harmful else f"at most {high} of the space")
    return "; ".join(part for part in parts if part)


def parameters_in_words(found: Triage) -> str:
    """Return which parameters matter most, and at the end of whose range failures lie, if any."""
    text, ends = in_words(found.influences), ends_in_words(found.influences)
    if text:
        text = f"{text}: distance of failures from other rows, 0 to 1"
    return "; ".join([*([text] if text else []), *(f"{end}: widen the range?" for end in ends[:1])])


def step_in_words(mode: Mode, found: Triage) -> str:
    """Return how the verdict on the evaluation that stands for a mode hangs on the time step."""
    check = found.step_check(mode.shown)
    return check.sentence if check else ""


def repeats_in_words(mode: Mode, found: Triage) -> str:
    """Return how many repeats of the evaluation that stands for a mode fail, and of its rows."""
    again, chance = found.of_repeats(mode.shown), found.chance(mode)
    if again is None or chance is None:
        return ""
    rows = sum(item.mode == mode.number for item in found.repeated)
    of_all = "of {} rows P {:.2f}, 95 %: {:.2f} to {:.2f}".format(rows, *chance)
    return f"{again.sentence}; {of_all}" if rows > 1 else again.sentence


def all_repeats_in_words(found: Triage) -> str:
    """Return how many evaluations repeat their verdict, in words; "" if none was made again."""
    again, lost = [i for i in found.repeated if i.repeats], sum(i.lost for i in found.repeated)
    changed = [item for item in again if not item.agrees]
    passed = sum(not item.failed for item in changed)
    text = f"{len(changed) or 'none'} of {len(again)} scenarios that were evaluated again change "
    text += f"their verdict{f' ({passed} passed at first)' if passed else ''}"
    text += f"; {lost} repeats without a result" if lost else ""
    return text if found.repeated else ""


def steps_in_words(found: Triage) -> str:
    """Return how many verdicts are the same at fractions of the time step; "" if unchecked."""
    checks = found.step_checks
    if not checks:
        return ""
    parts = []
    for fails, what in ((True, "findings"), (False, "evaluations without failure")):
        some = [check for check in checks if check.at[0].harmful is fails]
        same = sum(check.stable for check in some)
        parts += [f"{same} of {len(some)} {what} keep their verdict"] if some else []
    steps = [f"{checks[0].time_step / one.steps:g}" for one in checks[0].at]
    return f"{', '.join(parts)} at time steps of {', '.join(steps)} s"


def shortly(mode: Mode) -> str:
    """Return a failure mode in few words: what happens, how often, how severe, its cause."""
    often = f"{mode.count} evaluation" + "s" * (mode.count != 1)
    severe = f"MAIS3+ {percent(mode.severity)}" if mode.conflict == "contact" else ""
    cause = mode.judgement.partition(":")[0] or mode.cause
    return f"{mode.title}: {', '.join(name for name in (often, severe, cause) if name)}"


def robustness_in_words(mode: Mode, found: Triage) -> str:
    """Return how many neighbours of the evaluation that stands for a mode fail, too."""
    near = found.neighbourhood(mode.shown)
    if mode.robustness is None:
        return ""
    if near is None or not near.rows:
        return f"also fails in {percent(mode.robustness)} of its nearby scenarios"
    if mode.knife_edge:
        again = found.of_repeats(mode.shown)
        if again is not None and not again.agrees:  # no edge: it passes without any change
            return f"fails in {near.harmful} of {near.rows} nearby scenarios"
        return f"knife-edge: fails in only {near.harmful} of {near.rows} nearby scenarios"
    share = "all " if near.harmful == near.rows else f"{near.harmful} of "
    return f"also fails in {share}{near.rows} nearby scenarios"
