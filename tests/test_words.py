"""One word for each thing, and the words by which a reader finds a page."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.command_lines import commands
from typer.main import get_command

import bridgegen
from bridgegen.cli import app

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
SOURCES = Path(bridgegen.__file__).parent
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]

WORDS = {
    # Names of others; the paper's third layer.
    r"accidents?": ("accident rate", "type of accident", "Accident Analysis",
                    "road works, accidents", "right-turning accidents"),
    r"hits?": (),
    r"encounters?": ("per encounter",),
    r"incidents?": ("boxes and incidents, with CARLA",),
    r"cells?": ("cells of preventability maps",),
    r"near-miss\w*": (),
}  # fmt: skip
"""Words that the glossary has another one for, and phrases in which they may stand."""

EXCEPTIONS = {
    # On the road, an encounter is what an exposure counts; it is no evaluation.
    r"encounters?": ("estimate-risk", "exposure", "recordings", "regions", "risk",
                     "jobs/risk/page", "web/page", "bridgegen analyse regions"),
    # Cells of maps, of a regulation's matrices, of an algorithm's archive, of a notebook.
    r"cells?": ("algorithms", "ci", "packs", "preventability", "python-guide", "suites",
                "jobs/preventability/page"),
    # What CARLA calls what its sensors report.
    r"incidents?": ("carla",),
}  # fmt: skip

TITLES = ("hits a car that crosses", "hits an emergency vehicle that crosses",
          "hits a pedestrian with its front")  # fmt: skip
"""Titles of failure modes: `search/triage/modes.py`."""

FOUND_BY = ("rosbag", "Autoware", "Jupyter", "jaywalking", "installation", "FAQ", "troubleshooting",
            "custom metric", "GitHub Actions", "ROS 2", "uninstall", "OSC2")  # fmt: skip

HOW_TOS = ("estimate-risk", "mine-recordings", "python-guide", "run-a-suite", "set-up-ci", "team",
           "test-my-driver", "write-a-scenario")  # fmt: skip


def prose(path: Path) -> str:
    """Return a page without code, targets of links, and the glossary's table of such words."""
    text = path.read_text("utf-8").partition("## One word for each thing")[0]
    return re.sub(r"```.*?```|`[^`\n]*`|\]\([^)]*\)", " ", text, flags=re.DOTALL)


def template(path: Path) -> str:
    text = re.sub(r"<(style|script)\b.*?</\1>", " ", path.read_text("utf-8"), flags=re.DOTALL)
    return re.sub(r"\{[#%{].*?[#%}]\}|<[^>]*>", " ", text, flags=re.DOTALL)


def texts() -> Iterator[tuple[str, str]]:
    """Yield what a reader sees: pages of the documentation, help texts, templates of pages."""
    for path in PAGES:
        yield path.stem, prose(path)
    for path in SOURCES.rglob("*.html"):
        yield (
            f"{path.parent.relative_to(SOURCES)}/{path.stem}".removeprefix("pages/"),
            template(path),
        )
    for name, command in commands(get_command(app)):
        yield (
            f"bridgegen {name}",
            " ".join(str(getattr(one, "help", "")) for one in (command, *command.params)),
        )


def found(word: str, text: str, allowed: tuple[str, ...] = ()) -> list[str]:
    for phrase in allowed:
        text = re.sub(re.escape(phrase).replace(r"\ ", r"\s+"), " ", text, flags=re.IGNORECASE)
    return re.findall(rf"\b{word}\b", text, re.IGNORECASE)


@pytest.mark.parametrize("word", WORDS)
def test_no_second_word_stands_for_a_thing(word):
    kept = EXCEPTIONS.get(word, ())
    wrong = {
        where: hits
        for where, text in texts()
        if where not in kept and (hits := found(word, text, WORDS[word]))
    }
    assert wrong == {}


def test_messages_use_the_words_too():
    """Titles of failure modes say "hits" of what the ego's front meets."""
    text = (ROOT / "tests" / "messages.txt").read_text("utf-8")
    for word, allowed in ((r"accidents?", ()), (r"hits?", TITLES), (r"near-miss\w*", ())):
        assert found(word, text, allowed) == []


def test_exceptions_are_needed():
    seen = dict(texts())
    for word, names in EXCEPTIONS.items():
        assert [name for name in names if not found(word, seen[name], WORDS[word])] == []


@pytest.mark.parametrize("words", FOUND_BY)
def test_the_search_of_the_site_finds(words):
    """Sphinx indexes the words of prose and headings; options and code need not be known."""
    assert [path.stem for path in PAGES[1:] if found(re.escape(words) + "s?", prose(path))]


@pytest.mark.parametrize("name", HOW_TOS)
def test_a_how_to_is_short_and_leads_to_its_reference(name):
    text = (DOCS / f"{name}.md").read_text("utf-8")
    assert len(text.split()) <= 800
    assert ".md" in text
