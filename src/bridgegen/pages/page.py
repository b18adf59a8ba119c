"""Assembles the page: template, style, scripts and the data, in one file."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

from markupsafe import Markup

from bridgegen.base.disk import write_whole
from bridgegen.pages import templates
from bridgegen.pages.data import ReportData
from bridgegen.pages.payload import to_json
from bridgegen.pages.sections import SECTIONS

# --- Joins the page's modules and styles into one script and one style ---
# A page is one file that is opened from disk, where a browser loads no module. So the modules are
# joined here, each after those that it imports, into one scope: ``import`` statements and the word
# ``export`` are removed, names keep their meaning. Two forms are supported, at the start of a line:
# ``import { a, b } from "./x.js";`` (or ``import "./x.js";``), and ``export`` before a
# ``function``, # ``class``, ``const`` or ``let`` that declares one name.


# A bundler would need Node where the package is built; 150 lines here do, since imports have one
# form and anything else is an error.
IMPORT = re.compile(r'^import (?:\{([^{}]*)\} from )?"\./([\w.-]+\.js)";\n', re.MULTILINE)
DECLARED = re.compile(
    r"^(export )?(?:(?:async )?function\*?|class|const|let|var) ([\w$]+)", re.MULTILINE
)
STATEMENT = re.compile(r"^(?:import|export)\b.*", re.MULTILINE)
NAME = re.compile(r"[\w$]+")


class ModuleError(Exception):
    """The modules cannot be joined; the message names the place."""


@dataclass(frozen=True)
class Module:
    """One JavaScript module.

    Attributes:
        name: of its file ("table.js").
        text: all of it.
    """

    name: str
    text: str

    @cached_property
    def imports(self) -> dict[str, tuple[str, ...]]:
        """The modules that it imports, in order, and which names of each.

        Raises:
            ModuleError: a name is imported under another name, or as a default.
        """
        found: dict[str, tuple[str, ...]] = {}
        for names, module in IMPORT.findall(self.text):
            listed = [part.strip() for part in names.split(",") if part.strip()]
            for item in listed:
                if not NAME.fullmatch(item):
                    raise ModuleError(f"{self.name}: `{item}` is not a name that can be imported")
            found[module] = (*found.get(module, ()), *listed)
        return found

    @cached_property
    def declared(self) -> list[str]:
        """All names that it declares."""
        return [name for _, name in DECLARED.findall(self.text)]

    @cached_property
    def exported(self) -> list[str]:
        """The names that other modules may import."""
        return [name for export, name in DECLARED.findall(self.text) if export]

    @cached_property
    def body(self) -> str:
        """The text without imports and exports.

        Raises:
            ModuleError: an import or export of another form, with its line.
        """
        text = DECLARED.sub(lambda m: m[0].removeprefix("export "), IMPORT.sub("", self.text))
        if left := STATEMENT.search(text):
            line = self.text[: self.text.index(left[0])].count("\n") + 1
            raise ModuleError(f"{self.name}, line {line}: `{left[0]}` is not supported")
        return text


@dataclass
class _Graph:
    """The modules that were read, each after those that it imports."""

    read: Callable[[str], str | None]
    done: dict[str, Module] = field(default_factory=dict)
    open: list[str] = field(default_factory=list)

    def add(self, name: str, importer: str = "") -> Module:
        if name in self.done:
            return self.done[name]
        # A circle would leave a name used before its declaration, which only a browser would show.
        if name in self.open:
            circle = " → ".join([*self.open[self.open.index(name) :], name])
            raise ModuleError(f"circular import: {circle}")
        text = self.read(name)
        if text is None:
            raise ModuleError(f"{importer or 'the page'} imports {name}, which does not exist")
        module = Module(name, text)
        self.open.append(name)
        for other, names in module.imports.items():
            exported = self.add(other, name).exported
            for item in names:
                if item not in exported:
                    raise ModuleError(f"{name} imports `{item}`, which {other} does not export")
        self.open.pop()
        self.done[name] = module
        return module


def in_order(entries: Iterable[str], read: Callable[[str], str | None]) -> list[Module]:
    """Return modules and all that they import, each once and after those that it imports.

    Args:
        entries: names of modules, in the order in which they run.
        read: returns the text of a file by its name; None where there is no such file.

    Raises:
        ModuleError: a module that does not exist, an import of what is not exported, a circular
            import, or two modules that declare the same name.
    """
    graph = _Graph(read)
    for name in entries:
        graph.add(name)
    owner: dict[str, str] = {}
    for module in graph.done.values():
        for name in module.declared:
            # One scope holds all modules: two equal names would be one.
            if name in owner:
                raise ModuleError(f"`{name}` is declared by {owner[name]} and by {module.name}")
            owner[name] = module.name
    return list(graph.done.values())


def bundle(entries: Iterable[str], read: Callable[[str], str | None]) -> tuple[str, str]:
    """Return the script and the style of a page.

    The style is that of the ``x.css`` beside every ``x.js``, in the order of the modules.

    Args:
        entries: names of modules, in the order in which they run.
        read: returns the text of a file by its name; None where there is no such file.

    Raises:
        ModuleError: as of `in_order`, or an import or export of an unknown form.
    """
    modules = in_order(entries, read)
    styles = (read(module.name.removesuffix(".js") + ".css") for module in modules)
    script = "\n".join(module.body for module in modules)
    return script, "\n".join(style for style in styles if style is not None)


WEB = files("bridgegen.pages").joinpath("web")

REPORT = (*(section.module for section in SECTIONS), "page.js")
"""Modules of the report, besides those that they import."""

SERVED = ("motion.js", *REPORT, "live.js", "status.js")
"""Modules of a served report; a page on disk makes no requests."""


def write_report(path: Path, data: ReportData) -> None:
    """Write the report as one self-contained HTML file.

    The write is atomic: to a temporary file beside it, which is then renamed.

    Raises:
        StorageError: the file cannot be written (no such folder, read-only, disk full).
    """
    write_whole(Path(path), [report_page(data)])


def report_page(
    data: ReportData, *, live: bool = False, also: Mapping[str, Any] | None = None, **more: Any
) -> bytes:
    """Return the report as HTML.

    Args:
        data: of the report.
        live: whether ``bridgegen open`` serves it, so that it can request updates.
        also: what its data hold besides, by key.
        **more: values of the template: "home", "verdict", "trail".
    """
    title = f"{data.summary.scenario}: {data.summary.title}"
    modules, connect = (SERVED, "self") if live else (REPORT, "none")
    # The data are cut to what the code leaves of the page's size.
    code = len(_page("page.html", modules, title, "", connect=connect, **more))
    text = to_json(data, live=live, code=code, also=also)
    return _page("page.html", modules, title, text, connect=connect, **more)


def write_page(path: Path, entry: str, title: str, data: str, **more: Any) -> None:
    """Write a page, whole or not at all.

    Args:
        path: of the page.
        entry: a module of ``web`` with a template beside it ("show.js", "show.html").
        title: plain text.
        data: JSON that is safe inside a ``<script>`` element, see `payload.script_json`.
        **more: values of the template: "verdict", "heading".

    Raises:
        StorageError: the file cannot be written.
    """
    write_whole(path, [page_of(entry, title, data, **more)])


def page_of(entry: str, title: str, data: str, **more: Any) -> bytes:
    """Return a page; see `write_page`."""
    return _page(entry.replace(".js", ".html"), (entry,), title, data, **more)


def code_of(entry: str) -> int:
    """Return how many characters a page has besides its title and data; see `write_page`."""
    return len(page_of(entry, "", ""))


def _page(template: str, modules: tuple[str, ...], title: str, data: str, **more: Any) -> bytes:
    script, style = _bundled(modules)
    return templates.page(
        f"pages/web/{template}", title=title, css=style, script=script, data=Markup(data), **more
    )


def scripted(entry: str) -> tuple[Markup, Markup]:
    """Return the script of a module, and its style without the common one."""
    script, style = bundle([entry], _text)
    return Markup(script), Markup(style)


@cache
def _bundled(entries: tuple[str, ...]) -> tuple[Markup, Markup]:
    """Return the script and the style of a page."""
    script, style = bundle(entries, _text)
    return Markup(script), Markup(f"{_text('base.css')}{style}")


def _text(name: str) -> str | None:
    file = WEB.joinpath(name)
    return file.read_text("utf-8") if file.is_file() else None
