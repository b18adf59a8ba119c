"""Pages from Jinja templates: one base, one set of macros, and numbers in words.

A page's template stands beside the code that prepares its data, with its style in a ``.css`` of the
same name, and extends ``pages/web/base.html``; ``pages/web/macros.html`` has tables and sections.
What a template prints is escaped, unless it is `Markup` of our own.
"""

import hashlib
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from bridgegen.base.disk import write_whole
from bridgegen.base.units import percent

if TYPE_CHECKING:
    from jinja2 import Environment

ROOT = files("bridgegen")
THEME = ROOT.joinpath("pages/web/theme.js").read_text("utf-8")

STYLES = ("pages/web/base.css", "pages/web/still.css")
"""Style sheets of every page without scripts, before its own."""


def write_page(path: Path, template: str, **values: Any) -> None:
    """Write a page, whole or not at all; see `page`.

    Raises:
        StorageError: it cannot be written.
    """
    write_whole(path, [page(template, **values)])


def page(template: str, *, package: str = "bridgegen", **values: Any) -> bytes:
    """Return a page as UTF-8; what Unicode cannot encode becomes a question mark.

    Args:
        template: its path in the package ("jobs/risk/page.html").
        package: the package.
        values: what it prints; ``css`` is its whole style, by default `style`'s.
    """
    values.setdefault("css", Markup(style(template.removesuffix(".html") + ".css", package)))
    text = _environment(package).get_template(template).render(values)
    return text.encode("utf-8", "replace")


def style(own: str = "", package: str = "bridgegen") -> str:
    """Return the style of a page without scripts: the common one, and its own if there is one."""
    found = [ROOT.joinpath(name) for name in STYLES]
    found += [files(package).joinpath(own)] if own else []
    return "".join(traversable.read_text("utf-8") for traversable in found if traversable.is_file())


@cache
def _environment(package: str) -> "Environment":
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    made = Environment(
        loader=ChoiceLoader([PackageLoader(name, ".") for name in (package, "bridgegen")]),
        autoescape=True,
        # A name that is misspelt in a template fails, and is not an empty text.
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
    made.filters |= {"counted": counted, "shown": shown}
    made.globals["version"] = version("bridgegen")
    # A page without other scripts allows this one by its digest.
    digest = b64encode(hashlib.sha256(THEME.encode()).digest()).decode()
    made.globals["theme"] = {"script": Markup(THEME), "digest": f"sha256-{digest}"}
    return made


@dataclass(frozen=True)
class Banner:
    """The verdict at the top of a page: what failed, how badly, and what to do.

    Attributes:
        text: a sentence.
        kind: "fails", "passes", "open" (not judged), or "": the page gives none.
        word: in capitals, before the sentence.
        command: the next one, if any.
    """

    text: str
    kind: str = ""
    word: str = ""
    command: str = ""


@dataclass(frozen=True)
class Cell:
    """A table's cell that is more than a text, a count, or a pair of a text and a note.

    Attributes:
        text: what it says.
        notes: below it, small.
        kind: class of the text.
        href: where the text leads; nowhere if empty.
        label: of that link for screen readers.
        before: plain text before the link.
        mark: a sign before the text that a screen reader does not say, and its class.
        code: a formula below the text.
        mode: id of the failure mode whose status the text is.
        links: address, text and label of further links, below it.
        more: after these.
        picture: above all of it, `Markup` of ours.
    """

    text: str
    notes: Sequence[str] = ()
    kind: str = ""
    href: str = ""
    label: str = ""
    before: str = ""
    mark: tuple[str, str] | None = None
    code: str = ""
    mode: str = ""
    links: Sequence[tuple[str, str, str]] = ()
    more: str = ""
    picture: str = ""


def shown(value: object) -> object:
    """Return a table's cell: a count with thousands, a dash for None, anything else as it is."""
    if isinstance(value, int):
        return f"{value:,}"
    return "–" if value is None else value


def number(value: float) -> str:
    """Return a number with three digits; small and large ones with a power of ten.

    One that exceeds all floating-point numbers is "beyond 1e308".
    """
    if value == 0.0:
        return "0"
    if not isfinite(value):
        return "beyond 1e308"
    if 1e-3 <= value < 1e4:
        return f"{value:.3g}"
    digits, power = f"{value:.2e}".split("e")
    return f"{digits}e{int(power)}"


def odds(probability: float) -> str:
    """Return a small probability as people read it: "1 in 3,200"; one from 10 % on in per cent."""
    if probability >= 0.1:
        return percent(probability)
    return f"1 in {float(f'{1.0 / probability:.2g}'):,.0f}" if probability > 0.0 else "0"


def counted(count: int, noun: str, many: str = "") -> str:
    """Return a count with its noun: "1 run", "2,000 runs", "3 near misses"."""
    plural = many or noun + ("es" if noun.endswith("s") else "s")
    return f"{count:,} {noun if count == 1 else plural}"


def joined(names: Sequence[str], most: int = 4) -> str:
    """Return names in words: "a, b and 3 others"."""
    if len(names) > most + 1:
        return f"{', '.join(names[:most])} and {len(names) - most:,} others"
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1] if names else ""]))


def when(seconds: float) -> str:
    """Return a time [s since 1970] as a date and time in UTC; a dash beyond the calendar."""
    try:
        return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M")
    except (OverflowError, ValueError, OSError):
        return "–"
