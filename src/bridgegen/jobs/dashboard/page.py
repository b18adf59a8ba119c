"""The dashboard's page: one file without scripts, which needs no network."""

from importlib.metadata import version

from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.markup import base_of, counted, text
from bridgegen.jobs.dashboard.page_modes import modes_part
from bridgegen.jobs.dashboard.page_odd import odd_part
from bridgegen.jobs.dashboard.page_requirements import requirements_part
from bridgegen.jobs.dashboard.page_results import problems_part, results_part
from bridgegen.jobs.dashboard.page_trends import trends_part
from bridgegen.jobs.dashboard.sentences import failing_sentence, requirements_sentence
from bridgegen.pages.page import write_still_page

_PARTS = (
    ("modes", "Failing now"),
    ("requirements", "Requirements"),
    ("trends", "Trends"),
    ("odd", "Coverage"),
    ("results", "All results"),
    ("problems", "Not read"),
)


def write_page(found: Dashboard) -> None:
    """Write the page, whole or not at all.

    Raises:
        StorageError: it cannot be written.
    """
    base = base_of(found.project.folder, found.page)
    parts = [
        _head(found),
        modes_part(found, base),
        requirements_part(found, base),
        trends_part(found, base),
        odd_part(found),
        results_part(found, base),
        problems_part(found),
        f'<footer class="muted">BridgeGen {text(version("bridgegen"))}. Made of what was in the '
        "folder; the same command makes it again.</footer>",
    ]
    title = f"{found.project.folder.name or 'project'}: dashboard – BridgeGen"
    body = "\n".join(filter(None, parts)).encode("utf-8", "replace")
    write_still_page(found.page, "dashboard.html", title, body)


def _head(found: Dashboard) -> str:
    figures, problems = found.figures, found.project.problems
    nouns = {
        "runs": ("run", ""),
        "suites": ("suite", ""),
        "maps": ("preventability map", ""),
        "comparisons": ("comparison", ""),
        "scenarios": ("scenario", ""),
        "drivers": ("driver", ""),
        "evaluations": ("evaluation", ""),
    }
    facts = [counted(int(figures[name]), *noun) for name, noun in nouns.items() if figures[name]]
    items = "".join(f"<li>{text(one)}</li>" for one in facts)
    if problems:
        items += f'<li class="warn">{text(counted(len(problems), "problem"))}</li>'
    sentences = (failing_sentence(found), requirements_sentence(found))
    lead = "".join(f"<p>{text(one)}</p>" for one in sentences if one)
    links = "".join(
        f'<a href="#{key}">{text(title)}</a>'
        for key, title in _PARTS
        if key != "problems" or problems
    )
    return (
        f"<h1>{text(found.project.folder.name or 'Project')}</h1>"
        f'<ul class="facts" aria-label="What is here">{items}</ul>'
        f'<div class="card lead">{lead}</div><nav aria-label="Sections">{links}</nav>'
    )
