"""The items of a dossier as data: what each chapter asks for, and what fills it.

A template has ids of numbers in braces. An item is a gap where a number that it needs is missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from bridgegen.jobs.credibility.known_answers import data

CHAPTERS = {
    "1": "Purpose and scope",
    "2": "Toolchain, versions, people",
    "3": "Models, assumptions, range of validity",
    "4": "Input data and their pedigree",
    "5": "Verification of code",
    "6": "Verification of calculation",
    "7": "Sensitivity",
    "8": "Validation",
    "9": "Uncertainty budget",
    "10": "Scope of use",
    "11": "Traceability",
}

SOURCES = {
    "EU": "Regulation (EU) 2022/1426, Annex III, part 4: credibility of virtual tests. Chapters "
    "known, clauses not read [R].",
    "UN": "UN regulation and GTR on automated driving systems (ECE/TRANS/WP.29/2026/137, "
    "GRVA/2026/3): virtual tests with credibility. That it asks is read [V]; clauses not read.",
    "NATM": "New Assessment/Test Method for Automated Driving (UNECE): capability, accuracy, "
    "correctness, usability, fitness for purpose. Chapters known, clauses not read [R].",
    "GB": "GB 47955-2026, annex on the credibility of simulation tests. Named by summaries [A]; "
    "clauses not read.",
    "34506": "ISO/PAS 34506, qualification of virtual test environments, in preparation. Not "
    "public; clauses not read [R].",
    "26262": "ISO 26262-8, clause 11, confidence in software tools. Clause not read [R].",
    "17025": "ISO/IEC 17025, competence of laboratories: traceable, repeatable, with uncertainty. "
    "Named for laboratories in the UN's papers [V]; clauses not read.",
}
"""Texts that ask for the items; [V] read, [A] known from a summary, [R] recalled."""

COMMON = ("EU", "UN", "NATM")


@dataclass(frozen=True)
class Asked:
    """An item before it is filled.

    Attributes:
        id: "6.1"; its chapter's number first.
        title: of it.
        claim: template; of an item for people, the question.
        how: it is measured.
        again: the command that measures it anew.
        needs: names of numbers of all runs without which it is a gap; some, nothing measures yet.
        gap: what is missing then.
        fill: the command that fills the gap.
        note: why it is filled in part only.
        form: key of ``yours.yaml``, of an item for people.
        sources: keys of `SOURCES`.
        details: templates of further sentences; one with a number that is missing is left out.
    """

    id: str
    title: str
    claim: str = ""
    how: str = ""
    again: str = ""
    needs: Sequence[str] = ()
    gap: str = ""
    fill: str = ""
    note: str = ""
    form: str = ""
    sources: Sequence[str] = COMMON
    details: Sequence[str] = ()


RECOMPUTE = "python recompute.py"
SENSITIVITY = "bridgegen analyse sensitivity RUN"
"""The command that writes ``sensitivity.json`` into a run's folder."""
_AGAIN, _CONFIRM = "bridgegen resume RUN", "bridgegen confirm RUN"
_FULL = "bridgegen search SCENARIO --triage full"
_RANDOM = "bridgegen search SCENARIO --algorithm random"
_FIT = "bridgegen fit SCENARIO EVENTS --recordings TRAFFIC --out RUN/exposure.yaml"
_RECORDED = (
    "{all.recorded} of {all.runs} runs have exposure.yaml with recorded events that were replayed "
    "beside their parameterised twins."
)
_TWINS = (
    "Verdicts with the others as recorded and as the parameters say, all else the same; recall, "
    "precision, F1 (de Gelder and Op den Camp, arXiv:2409.01117). Figures are in that file."
)
_UNTWINNED = "recorded events that were replayed beside their parameterised twins"
_UNCONFIRMED = "No run is confirmed in another simulator"
_CHOSEN = (
    "They are chosen and not drawn: the interval is that of as many random ones. Clopper and "
    "Pearson (1934)."
)
_ERROR = (
    "Findings at the time step, its half, quarter and eighth: the difference from the eighth, and "
    "from Richardson's extrapolation to a step of 0, by the order observed at the three finest "
    "steps where it is 0.5 to 2, else by the first order, which the scheme promises (triggers, "
    "drivers and contacts act at instants). Times Roache's factor of safety (1998), 1.25 or 3, it "
    "is his grid convergence index. Stated is 1.25 times the widest difference of two of the four, "
    "and of time and place what dt/8 resolves: it is to hold of a single finding."
)


def _error(number: str, quantity: str, title: str, unit: str) -> Asked:
    def of(name: str) -> str:
        return f"{{all.{name}:{quantity}}}"

    return Asked(
        number,
        f"Numerical error of the {title}",
        f"|q(dt) − q(dt/8)|: median {of('error_median')}{unit}, 95 % quantile {of('error_q95')}"
        f"{unit}, of {of('series')} findings. Extrapolated to a step of 0: median "
        f"{of('extrapolated_median')}{unit}, 95 % quantile {of('extrapolated_q95')}{unit}; grid "
        f"convergence index, 95 % quantile {of('gci_q95')}{unit}. Stated: median "
        f"{of('stated_median')}{unit}, 95 % quantile {of('stated_q95')}{unit}.",
        how=_ERROR if quantity == "time" else "As 6.3.",
        again=_AGAIN,
        needs=(f"error_q95:{quantity}",),
        gap="No finding has results at the time step and at its half, quarter and eighth",
        fill=_FULL,
        details=(
            f"The observed order is defined in {of('orders')} of {of('series')} findings; "
            f"{of('unchanged')} do not change at all. In the others the results do not converge "
            "monotonically, and the extrapolation is an indication.",
            f"Median of the observed order: {of('order_median')}.",
        ),
    )


def _steps(number: str, kind: str, title: str, noun: str, how: str) -> Asked:
    at = ", ".join(f"{{all.{kind}_kept:{s}}} of {{all.{kind}_at:{s}}} at dt/{s}" for s in (2, 4, 8))
    return Asked(
        number,
        title,
        f"{{all.{kind}_stable}} of {{all.{kind}}} {noun} keep verdict and kind of conflict at each "
        f"fraction of the time step, {{all.{kind}_flips}} do not: 95 % interval of their share "
        f"{{all.{kind}_flips_low}} to {{all.{kind}_flips_high}}.",
        how=how,
        again=_AGAIN,
        needs=(f"{kind}_flips",),
        gap=f"No run has {noun} at fractions of the time step",
        fill=_FULL,
        details=(f"Kept: {at}.",),
    )


ORACLES = (
    ("UN R157's models: the Commission's code (JRC-FSM), cut-ins with the ego at 20 to 130 km/h",
     "tests/ego/test_preventable.py::test_it_counts_the_crashes_that_the_commissions_code_counts"),
    ("driver un-r157: the same code, cut-ins with the ego at 50 to 130 km/h",
     "tests/ego/test_un_r157_kernels.py"
     "::test_it_crashes_in_the_cut_ins_in_which_the_commissions_code_does"),
    ("single-track vehicle: CommonRoad's vehicle models, at 15 to 22 m/s and up to 8.3 m/s² across",
     "tests/simulation/embedded/chassis/test_single_track.py"
     "::test_standard_manoeuvres_are_as_commonroad_s_model_has_them_to_a_hundredth"),
    ("multi-body vehicle: CommonRoad's vehicle models, at 15 to 22 m/s and up to 8.6 m/s² across",
     "tests/simulation/embedded/chassis/test_multi_body.py"
     "::test_standard_manoeuvres_are_as_commonroad_s_model_has_them"),
    ("motion of storyboards: esmini",
     "tests/simulation/esmini/test_simulator.py::test_it_is_as_here"),
    ("robustness of formulas: rtamt", "tests/stl/test_robustness.py::test_rtamt_agrees"),
    ("contact of boxes: shapely", "tests/simulation/test_boxes.py::test_agrees_with_shapely"),
    ("time to collision: the published definition of TwoDimTTC",
     "tests/metrics/test_ttc.py::test_agrees_with_the_published_definition"),
    ("RSS: Intel's ad-rss-lib", "tests/metrics/test_ad_rss.py::test_following_another"),
    ("elementary functions: mpmath",
     "tests/test_elementary.py::test_the_error_is_within_its_bound"),
)  # fmt: skip
"""What is compared with what, and the test that does so in the source."""

ASKED: tuple[Asked, ...] = (
    Asked("1.1", "Purpose", "Which decisions rest on these results, and what would follow if they "
          "were wrong?", form="purpose", sources=(*COMMON, "GB")),
    Asked("1.2", "Operational design domain", "For which operational design domain are the results "
          "used, and what of it do the scenarios leave out?", form="odd"),
    Asked("1.3", "What was simulated", "{all.evaluations} evaluations in {all.runs} runs; "
          "{all.failed} have no result.", how="Rows of run.sqlite.", again=RECOMPUTE),
    Asked("2.1", "Versions", "Versions of BridgeGen that made the runs: {all.versions}. Installed "
          "with the one that wrote this: {all.installed} distributions, listed below.",
          how="run.sqlite; importlib.metadata. sbom.cdx.json lists them with licences (CycloneDX).",
          again="python -m pip list",
          sources=(*COMMON, "26262")),
    Asked("2.2", "People", "Who operates the tool, with which competence, and who reviews?",
          form="people", sources=(*COMMON, "17025")),
    Asked("2.3", "Confidence in the tool", "Which use cases, tool impact and error detection (TI, "
          "TD) apply, and which tool confidence level follows?", form="tool_confidence",
          sources=("26262",), details=["A proposal to the people who decide:", *(
              f"{use}. If not so, {impact}: {ti}. Seen by {seen}: {td}."
              for use, impact, ti, seen, td in data()["features"].values())]),
    Asked("3.1", "Assumptions", "What the models assume and leave out, by the simulators and "
          "drivers of the runs; sources are in docs/limits.md and docs/simulator.md.",
          note="words, without a measured range of validity"),
    Asked("3.2", "Validity of the models", "For which vehicles and manoeuvres are the models "
          "valid, and by which measurements?", form="model_validity"),
    Asked("4.1", "Digests", "{all.files} files have their SHA-256 below: evaluations, failure "
          "modes, scenarios, maps, distributions and drivers, as far as these are files.",
          how="hashlib.", again=RECOMPUTE, sources=(*COMMON, "17025")),
    Asked("4.2", "Pedigree", "Where do scenarios, maps and recordings come from, and who checked "
          "them?", form="pedigree"),
    Asked("5.1", "Bits of this machine", "{all.bits_different} of {all.bits_compared} digests of "
          "elementary functions, motion and metrics differ from the published ones.",
          how="10,000 arguments a function; motion and metrics of 10,000 rows.",
          again="bridgegen doctor", sources=(*COMMON, "17025")),
    Asked("5.2", "Independent oracles", "Tests of the source compare these parts with independent "
          "code or definitions.", how="Each test fails where they disagree.",
          again="pytest TEST, in the source", sources=(*COMMON, "26262"),
          note="tests are in the source and not in the package: this command does not run them",
          details=[f"{what} ({test})" for what, test in ORACLES]),
    Asked("5.3", "Mutation score and coverage", "Of {all.mutants} faults that were injected into "
          "kernels, the validation suite sees {all.mutants_seen}: {all.mutants_known} by a known "
          "answer or a law, the others by published bits alone.", needs=("mutants",),
          how="One fault at a time in a copy of the package, listed before the suite was written; "
          "those who wrote it knew the list.", again="python tools/faults.py, in the source",
          sources=("26262", *COMMON), gap="This package has no record of injected faults",
          details=("Of {all.random} operators of kernels that were changed by chance, which nobody "
                   "knew before, it saw {all.random_seen}: {all.random_known} by a known answer or "
                   "a law. The chosen faults are no sample: do not read their share as a rate.",),
          note="of this release, not of this machine"),
    Asked("5.4", "Validation suite", "{all.cases} cases were run on this machine: {all.cases_wrong}"
          " have a wrong answer, {all.cases_bits} other bits than the published ones.",
          how="Closed forms, published numbers, laws, and published bits: validation.json.",
          again="bridgegen credibility --validate", needs=("cases",), sources=("26262", *COMMON),
          gap="The suite was not run with this dossier",
          fill="bridgegen credibility RUN --validate"),
    Asked("5.5", "Known faults", "{all.known_faults} faults that were found later concern the "
          "versions of these runs, or may.", how="The list that this release keeps.",
          again="bridgegen credibility RUN", sources=("26262", *COMMON)),
    _steps("6.1", "findings", "Findings at finer steps", "findings",
           "The worst of each failure mode and each exported scenario, at the scenario's step, its "
           "half, quarter and eighth. They are chosen and not drawn: the interval is that of as "
           "many random ones."),
    _steps("6.2", "sample", "Evaluations without failure at finer steps",
           "evaluations without failure",
           "A sample, evenly spread over each run. Clopper and Pearson (1934), for independent "
           "draws; evaluations of an optimiser are not independent."),
    _error("6.3", "time", "time of the conflict", " s"),
    _error("6.4", "place", "place of the conflict", " m"),
    _error("6.5", "speed", "speed of the ego", " m/s"),
    _error("6.6", "harm", "harm", ""),
    _error("6.7", "severity", "severity", ""),
    Asked("6.8", "Repeatability", "{all.same} of {all.checked} evaluations that were simulated "
          "again at the scenario's step have the harm of run.sqlite, to the last bit.",
          how="step_checks of triage.json against run.sqlite.", again=_AGAIN, needs=("same",),
          gap="No evaluation was simulated again", fill=_FULL, sources=("17025", *COMMON)),
    Asked("7.1", "Sensitivity to constants of the models",
          "{all.sensitivity} of {all.runs} runs have sensitivity.json.", again=SENSITIVITY,
          needs=("sensitivity",), note="its figures are in that file, and not repeated here",
          gap="No run has sensitivity.json: which constant of the models moves which verdict is "
          "not known", fill=SENSITIVITY),
    Asked("8.1", "Other simulators", "Exported scenarios, simulated again elsewhere.", how=_CHOSEN,
          again=_CONFIRM, needs=("confirmed:1",), gap=_UNCONFIRMED, fill=_CONFIRM),
    Asked("8.2", "Recordings", _RECORDED, how=_TWINS, again=_FIT, needs=("recorded",),
          note="two simulations are compared, and neither with what the recorded drivers did",
          gap=f"No run has exposure.yaml with {_UNTWINNED}", fill=_FIT),
    Asked("8.3", "Real tests: area metric", "{all.tests} tests in {all.comparisons} comparisons: "
          "{all.accepted} within the threshold, {all.refused} not, {all.undecided} not decided, "
          "{all.without} without a threshold, {all.valueless} without a simulated value.",
          how="Area between the two empirical distributions (Ferson, Oberkampf and Ginzburg, 2008; "
          "ASME V&V 20 and 10; not read for this). Interval: bootstrap over tests from 6 on "
          "(95 % percentiles; of normal errors 85 % with 6 tests, 93 % with 20), "
          "widened by the mean stated uncertainty. Accepted: its upper end is at most the "
          "threshold.", again=RECOMPUTE, needs=("comparisons",), sources=(*COMMON, "17025"),
          gap="No result of a proving ground or a road test is compared: measured.csv has none",
          details=("Comparisons of fewer than 6 tests, whose intervals leave chance out: "
                   "{all.few}.",)),
    Asked("8.4", "Proving ground: how it was measured", "Which results of a proving ground or of "
          "road tests were compared, by which measure and threshold?", form="proving_ground"),
    Asked("9.1", "Sampling", "The harmful share of each searched space, with its interval.",
          how="Random draws; Clopper and Pearson (1934), rounded outwards.", again=RECOMPUTE,
          needs=("shares",), gap="No run estimates the harmful share of its space", fill=_RANDOM),
    Asked("9.2", "Data: exposure", "{all.distributions} of {all.runs} runs draw their parameters "
          "from a distribution.", how="Settings in run.sqlite.", again=RECOMPUTE,
          needs=("distributions",), note="without an interval of its own; bridgegen risk states "
          "one", fill="bridgegen risk SCENARIO --exposure FILE",
          gap="No run has an exposure: parameters are even over their ranges, and a share of the "
          "space is no rate on roads"),
    Asked("9.3", "Model form: other simulators", "As 8.1.", how=_CHOSEN, again=_CONFIRM,
          needs=("confirmed:1",), gap=_UNCONFIRMED, fill=_CONFIRM),
    Asked("9.4", "Numerical: the time step", "{all.findings_flips_low} to "
          "{all.findings_flips_high} of findings, and {all.sample_flips_low} to "
          "{all.sample_flips_high} of evaluations without failure, depend on the step.",
          how="As 6.1 and 6.2.", again=_AGAIN, needs=("findings_flips", "sample_flips"),
          gap="Findings, or a sample of the others, were not simulated at finer steps",
          fill=_FULL),
    Asked("9.5", "Parameterisation", "As 8.2.", how=_TWINS, again=_FIT, needs=("recorded",),
          note="of the events of those recordings and the drivers that are named, not of the run's",
          gap="What the parameters leave out of what was recorded is not known: no run has "
          f"exposure.yaml with {_UNTWINNED}", fill=_FIT),
    Asked("9.6", "Combined: sampling and time step", "Upper bounds of the harmful share at a finer "
          "time step.", again=RECOMPUTE, needs=("combined",), fill=_RANDOM,
          how="high + (1 − high) · f: high is the upper end of 9.1, f that of the share of "
          "evaluations without failure that fail, or have no result, at a finer step. Both hold "
          "together with 95 % (Bonferroni). Only of runs whose rows no algorithm chose.",
          note="model form, data and parameterisation stay apart: their figures are of chosen "
          "scenarios or missing, and no shares of the same rows",
          gap="No run has both an interval of its own random rows and a sample at finer steps"),
    Asked("10.1", "Evaluated ranges", "{all.bins_evaluated} of {all.bins_all} bins of the searched "
          "parameters hold an evaluation.", again="bridgegen analyse coverage RUN",
          how="Each parameter's range in bins; one that constraints exclude counts, too.",
          note="one parameter at a time; outside the ranges nothing is claimed"),
    Asked("10.2", "Validated region", "Scenarios with a region in which there is evidence: "
          "{all.regions}. Beyond a region, figures of its runs are extrapolated.",
          how="Least and greatest value of each numeric parameter in "
          "rows that are confirmed in another simulator, or accepted beside a real test; not "
          "every point between them is.", again=RECOMPUTE, needs=("regions",), fill=_CONFIRM,
          note="rows span a region, and do not fill it",
          gap="No region is validated: no row is confirmed in another simulator, or accepted "
          "beside a real test, so each result is an extrapolation"),
    Asked("11.1", "Each run again", "Commands with seeds make {all.runs} runs again; the list of "
          "runs has them.", how="Settings in run.sqlite.", again="the commands of the list",
          sources=(*COMMON, "17025")),
)  # fmt: skip
"""All items; what runs and package add to one is in `bridgegen.jobs.credibility.export`."""

FORM = {item.form: item.claim for item in ASKED if item.form}
"""The questions for people by the key of ``yours.yaml``."""
