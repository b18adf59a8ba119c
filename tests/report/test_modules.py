"""The page's JavaScript: how modules are joined, and whether ours fit together."""

import re
import shutil
import subprocess
from collections.abc import Iterator
from importlib.resources import as_file
from itertools import pairwise

import pytest

from bridgegen.pages import page
from bridgegen.pages.page import Module, ModuleError, bundle, in_order

ENTRIES = (*page.SERVED, "show.js", "runs.js", "status.js", "suite.js", "trial.js")
OURS = {
    file.name: Module(file.name, file.read_text("utf-8"))
    for file in page.WEB.iterdir()
    if file.name.endswith(".js")
}


def joined(entries: str, files: dict[str, str]) -> str:
    return bundle(entries.split(), files.get)[0]


# ---- joining ----


def test_a_module_stands_after_those_that_it_imports():
    files = {
        "page.js": 'import { b } from "./b.js";\nimport { a } from "./a.js";\n\na(b);\n',
        "a.js": 'import { b } from "./b.js";\n\nexport function a(x) {\n  return x + b;\n}\n',
        "b.js": "export const b = 1;\n",
    }
    script = joined("page.js", files)
    assert " ".join(script.split()) == "const b = 1; function a(x) { return x + b; } a(b);"


def test_entries_run_in_their_order_and_each_module_once():
    files = {
        "x.js": 'import "./shared.js";\n\nx();\n',
        "y.js": 'import "./shared.js";\n\ny();\n',
        "shared.js": "s();\n",
    }
    assert joined("y.js x.js", files).split() == ["s();", "y();", "x();"]


def test_an_import_of_many_lines_is_read():
    files = {
        "page.js": 'import {\n  a,\n  $,\n} from "./a.js";\n\n$(a);\n',
        "a.js": "export const a = 1;\nexport async function $() {}\n",
    }
    script = joined("page.js", files)
    assert " ".join(script.split()) == "const a = 1; async function $() {} $(a);"


def test_a_style_beside_a_module_comes_with_it():
    files = {
        "page.js": 'import { a } from "./a.js";\n\na;\n',
        "a.js": "export const a = 1;\n",
        "page.css": ".page {}",
        "a.css": ".a {}",
        "other.css": ".other {}",
    }
    assert bundle(["page.js"], files.get)[1].split() == [".a", "{}", ".page", "{}"]


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (
            {
                "page.js": 'import "./a.js";\n',
                "a.js": 'import "./b.js";\n',
                "b.js": 'import "./a.js";\n',
            },
            "circular import: a.js → b.js → a.js",
        ),
        ({"page.js": 'import "./page.js";\n'}, "circular import: page.js → page.js"),
        (
            {"page.js": 'import { b } from "./a.js";\n', "a.js": "const b = 1;\n"},
            "page.js imports `b`, which a.js does not export",
        ),
        ({"page.js": 'import "./a.js";\n'}, "page.js imports a.js, which does not exist"),
        ({}, "the page imports page.js, which does not exist"),
        (
            {"page.js": 'import "./a.js";\nconst b = 1;\n', "a.js": "class b {}\n"},
            "`b` is declared by a.js and by page.js",
        ),
        (
            {"page.js": 'import { b as c } from "./a.js";\n', "a.js": "export const b = 1;\n"},
            "page.js: `b as c` is not a name that can be imported",
        ),
        (
            {"page.js": '// Text.\n\nimport b from "./a.js";\n', "a.js": ""},
            'page.js, line 3: `import b from "./a.js";` is not supported',
        ),
        (
            {"page.js": "const a = 1;\nexport { a };\n"},
            "page.js, line 2: `export { a };` is not supported",
        ),
    ],
)  # fmt: skip
def test_what_does_not_fit_together_is_refused(files, message):
    with pytest.raises(ModuleError) as error:
        joined("page.js", files)
    assert str(error.value) == message


def test_what_is_only_served_asks_the_server():
    assert "fetch(" not in bundle(page.REPORT, page._text)[0]
    assert "fetch(" in bundle(page.SERVED, page._text)[0]


# ---- ours ----


KEYWORDS = {*re.findall(r"\w+", """
    as async await break case catch class const continue default delete do else export extends
    false finally for from function get if import in instanceof let new null of return set
    static super switch this throw true try typeof undefined var void while yield
""")}  # fmt: skip
CONTEXTUAL = {"as", "async", "from", "get", "of", "static"}
"""Those that may be names as well."""
GLOBALS = {*re.findall(r"\w+", """
    ArrayBuffer BigInt BigInt64Array BigUint64Array DataView Date Int8Array MediaRecorder
    MessageChannel WebAssembly Worker
    Array Blob Boolean CSS CustomEvent DecompressionStream Error Event Float64Array Infinity
    Int32Array IntersectionObserver JSON Map Math Number Object Path2D ResizeObserver Response Set
    String TextDecoder TypeError URL Uint8Array addEventListener atob clearTimeout
    decodeURIComponent document encodeURIComponent fetch getComputedStyle history innerHeight
    innerWidth localStorage location matchMedia navigator performance Promise
    requestAnimationFrame sessionStorage setTimeout window
""")}  # fmt: skip
TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/)|(?P<text>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')"""
    r"""|(?P<number>\d[\w.]*)|(?P<name>[A-Za-z_$][\w$]*)|(?P<sign>=>|\?\.(?!\d)|\.\.\.|.)""",
    re.DOTALL,
)
REGEX = re.compile(r"/(?:\\.|\[(?:\\.|[^\]\\])*\]|[^/\\\[\n])+/[a-z]*")


def tokens(text: str) -> list[str]:
    """Return names, signs and placeholders for literals; what stands in templates' ${} as well."""
    found: list[str] = []
    _tokens(text, 0, found, inside=False)
    return found


def _tokens(text: str, at: int, found: list[str], *, inside: bool) -> int:
    depth = 0
    while at < len(text):
        last = found[-1] if found else ""
        if text[at] == "`":
            at = _template(text, at + 1, found)
            continue
        operand = last in (")", "]", "}", '""') or (
            last not in KEYWORDS - CONTEXTUAL and last[:1].isalnum()
        )
        if text[at] == "/" and text[at + 1] not in "/*" and not operand:
            at = REGEX.match(text, at).end()
            found.append('""')
            continue
        match = TOKEN.match(text, at)
        at = match.end()
        if match["skip"]:
            continue
        depth += {"{": 1, "}": -1}.get(match[0], 0)
        if inside and depth < 0:
            return at
        found.append('""' if match["text"] else "0" if match["number"] else match[0])
    return at


def _template(text: str, at: int, found: list[str]) -> int:
    while text[at] != "`":
        if text.startswith("${", at):
            found.append("(")
            at = _tokens(text, at + 2, found, inside=True)
            found.append(")")
        else:
            at += 2 if text[at] == "\\" else 1
    found.append('""')
    return at + 1


def is_name(token: str) -> bool:
    return bool(re.fullmatch(r"[A-Za-z_$][\w$]*", token)) and token not in KEYWORDS


def close(all_: list[str], at: int) -> int:
    """Return the place of the bracket that closes the one at a place."""
    depth = 0
    for k in range(at, len(all_)):
        depth += (all_[k] in "([{") - (all_[k] in ")]}")
        if depth == 0:
            return k
    raise AssertionError("brackets do not balance")


def bound(all_: list[str]) -> Iterator[str]:
    """Yield the names that are declared anywhere, parameters included; some that are not, too."""
    for k, (one, after) in enumerate(pairwise(all_)):
        if one in ("const", "let", "var"):
            yield from declarators(all_, k + 1)
        elif one in ("class", "function", "static") and is_name(after):
            yield after
        elif one == "import" and after == "{":
            yield from filter(is_name, all_[k + 2 : close(all_, k + 1)])
        elif is_name(one) and after == "=>":
            yield one
        elif one == "(":
            end = close(all_, k)
            if all_[end + 1 : end + 2] in (["=>"], ["{"]) and all_[k - 1] not in (
                "if", "while", "switch",
            ):  # fmt: skip
                yield from filter(is_name, all_[k + 1 : end])
                yield all_[k - 1]  # a method


def declarators(all_: list[str], k: int) -> Iterator[str]:
    """Yield the names of one const or let."""
    while True:
        end = close(all_, k) + 1 if all_[k] in "[{" else k + 1
        yield from filter(is_name, all_[k:end])
        while all_[end] not in (",", ";", ")", "of", "in"):
            end = close(all_, end) + 1 if all_[end] in "([{" else end + 1
        if all_[end] != ",":
            return
        k = end + 1


def used(all_: list[str]) -> Iterator[str]:
    """Yield the names that are read: neither a member nor a key."""
    for k, one in enumerate(all_):
        before, after = all_[k - 1] if k else "", all_[k + 1] if k + 1 < len(all_) else ""
        key = after == ":" and before in ("{", ",")
        if is_name(one) and before not in (".", "?.") and not key:
            yield one


def undefined(text: str) -> set[str]:
    all_ = tokens(text)
    return {*used(all_)} - {*bound(all_)} - GLOBALS


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("f(x);", {"f", "x"}),
        ("const a = 1, { b, k: [c] } = a;\nf(a, b, c);", {"f"}),
        ("const g = (x, { y }) => x + y + z;", {"z"}),
        ("class A {\n  static B = b;\n  draw(c) {\n    c.f(this.g, h);\n  }\n}\n", {"b", "h"}),
        ("const t = `a ${b.c} d ${`${e}`}`;", {"b", "e"}),
        ("const o = { a: b, c };", {"b", "c"}),
        ('const r = /[/"]a"/.test(q); // not x\n/* y */', {"q"}),
        ("for (const [k, v] of list) k + v;", {"list"}),
        ('import { a } from "./a.js";\n\na ? b : c;', {"b", "c"}),
        ("if (a) {\n  a();\n}", {"a"}),
    ],
)
def test_names_that_nothing_declares_are_found(text, missing):
    assert undefined(text) == missing


@pytest.mark.parametrize("module", OURS.values(), ids=OURS)
def test_every_name_is_declared_or_imported(module):
    assert undefined(module.text) == set()


@pytest.mark.parametrize("module", OURS.values(), ids=OURS)
def test_every_name_of_a_module_is_used(module):
    told = [one for names in module.imports.values() for one in names]
    assert len(told) == len(set(told))
    in_module = tokens(re.sub(r"^import [^;]*;", "", module.text, flags=re.MULTILINE))
    names = [*used(in_module)]
    assert [one for one in told if one not in names] == []
    wanted = {one for other in OURS.values() for one in other.imports.get(module.name, ())}
    assert [one for one in module.exported if one not in wanted] == []
    private = {*module.declared} - {*module.exported}
    assert [one for one in private if names.count(one) < 2] == []


@pytest.mark.parametrize("module", OURS.values(), ids=OURS)
def test_a_statement_declares_one_name(module):
    """Of the others at the start of a line no second module would be warned."""
    lines = [line for line in module.body.split("\n") if re.match(r"(const|let|var) ", line)]
    for line in lines:
        assert re.match(r"(const|let|var) [\w$]+ = ", line), line
    all_ = tokens(module.body)
    depth = 0
    for k, one in enumerate(all_):
        depth += (one in "([{") - (one in ")]}")
        if depth == 0 and one in ("const", "let"):
            assert len([*declarators(all_, k + 1)]) == 1, all_[k : k + 4]


def test_every_module_of_ours_is_used():
    needed = {module.name for module in in_order(page.SERVED, page._text)}
    needed |= {
        module.name
        for module in in_order(
            ["show.js", "runs.js", "status.js", "suite.js", "trial.js"], page._text
        )
    }
    assert needed == {*OURS} - {"theme.js"}  # a script of its own, in every page


@pytest.mark.parametrize(
    "entries",
    [page.REPORT, page.SERVED, ("show.js",), ("runs.js",), ("suite.js",), ("trial.js",)],
    ids=str,
)
def test_node_reads_what_is_joined(tmp_path, entries):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    (tmp_path / "page.cjs").write_text(f'"use strict";\n{bundle(entries, page._text)[0]}', "utf-8")
    found = subprocess.run(
        [node, "--check", tmp_path / "page.cjs"], capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr


def test_types_fit():
    tsc = shutil.which("tsc")
    if tsc is None:
        pytest.skip("tsc is not installed")
    with as_file(page.WEB) as web:
        found = subprocess.run(
            [tsc, "-p", web / "jsconfig.json"], capture_output=True, text=True, check=False
        )
    assert found.returncode == 0, found.stdout
