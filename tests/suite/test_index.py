"""The index of a suite that grows: what people write in it stays, and it is untrusted."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.errors import FileFormatError
from bridgegen.jobs.suite.index import FILE, Failure, Index, read_index, write_index

MODE = {
    "title": "runs into the rear of a car (ego responsible: did not brake)",
    "scenario": "cut-in", "conflict": "contact", "type": "front-to-rear striking",
    "responsible": "ego", "rule": "rear distance", "partner": "car", "place": "",
    "cause": "planning", "driver": "route-follower", "found": "suite", "version": "0.1.0",
    "harm": 0.6016747515838474, "severity": 0.1 + 0.2,
}  # fmt: skip


def failure(id="b", **more):
    return Failure(**{**MODE, "files": [f"{id}.xosc"], **more})


def test_what_is_written_is_read_to_the_bit(tmp_path):
    rule = {"id": "R-1.2", "formula": "ttc >= 1.5 s", "text": 'a "quoted" text: #1', "tags": ["a"]}
    kept = {"b": failure(violates=[rule], seed=3, count="any", minimal="needs x >= 3; all else")}
    write_index(tmp_path, Index({}), kept)
    assert dict(read_index(tmp_path).failures) == kept
    assert read_index(tmp_path).failures["b"].severity == 0.30000000000000004
    assert read_index(tmp_path).failures["b"].criteria == [rule]


def test_what_people_write_stays_as_another_block_comes(tmp_path):
    write_index(tmp_path, Index({}), {"b": failure("b"), "d": failure("d")})
    path = tmp_path / FILE
    text = path.read_text("utf-8")
    text = text.replace("  d:\n", "  # seen on the road in May\n\n  # twice\n  d:\n")
    text = text.replace("status: new", "status: known   # JIRA-3", 1)
    text = text.replace('comment: ""', "comment: |\n      to be fixed in 2.1\n      by Ann", 1)
    path.write_text(text, "utf-8")
    before = read_index(tmp_path)
    assert before.failures["b"].comment == "to be fixed in 2.1\nby Ann\n"
    write_index(tmp_path, before, {**before.failures, "c": failure("c")})
    lines = path.read_text("utf-8").splitlines()
    new = [line for line in lines if line not in text.splitlines()]
    assert new == ["  c:", "    files: [c.xosc]"]  # all else as it was
    assert [line for line in lines if line.startswith("  ") and line.endswith(":")] == [
        "  b:", "  c:", "  d:",
    ]  # fmt: skip
    assert lines.index("  # twice") == lines.index("  d:") - 1
    assert "    status: known   # JIRA-3" in lines


def test_a_changed_block_keeps_status_and_comment_as_they_are_written(tmp_path):
    write_index(tmp_path, Index({}), {"b": failure("b")})
    path = tmp_path / FILE
    text = path.read_text("utf-8").replace("  b:\n", "  # above\n  b:\n")
    path.write_text(text.replace("status: new", "status: 'accepted' # by Ann"), "utf-8")
    before = read_index(tmp_path)
    write_index(tmp_path, before, {"b": before.failures["b"].model_copy(update={"harm": 1.0})})
    after = path.read_text("utf-8")
    assert "  # above\n  b:\n" in after
    assert "    status: 'accepted' # by Ann\n" in after
    assert read_index(tmp_path).failures["b"].harm == 1.0


def test_a_comment_of_several_lines_costs_no_other_block_its_own(tmp_path):
    write_index(tmp_path, Index({}), {"b": failure("b"), "c": failure("c")})
    path = tmp_path / FILE
    text = path.read_text("utf-8").replace('comment: ""', "comment: |\n      one\n      two", 1)
    path.write_text(text.replace("  c:\n", "  # c's\n  c:\n"), "utf-8")
    before = read_index(tmp_path)
    changed = before.failures["b"].model_copy(update={"harm": 1.0})
    write_index(tmp_path, before, {**before.failures, "b": changed})
    assert read_index(tmp_path).failures["b"] == changed
    assert "  # c's\n  c:\n" in path.read_text("utf-8")


def test_another_layout_is_understood(tmp_path):
    write_index(tmp_path, Index({}), {"b": failure("b")})
    path = tmp_path / FILE
    lines = path.read_text("utf-8").splitlines()
    start = lines.index("failures:")
    wide = [line.replace("    ", "          ").replace("  b:", "     b:") for line in lines[start:]]
    path.write_text("\n".join(wide), "utf-8")
    before = read_index(tmp_path)
    write_index(tmp_path, before, {**before.failures, "a": failure("a")})
    assert [*read_index(tmp_path).failures] == ["a", "b"]


TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=60)


@given(st.dictionaries(st.from_regex(r"[a-z0-9][a-z0-9-]{0,8}", fullmatch=True),
                       st.tuples(TEXT, TEXT, TEXT), max_size=4))  # fmt: skip
def test_any_text_is_kept(tmp_path_factory, texts):
    folder = tmp_path_factory.mktemp("index")
    kept = {
        id: failure(id, title=a, comment=b, scenario=c) for id, (a, b, c) in texts.items()
    }  # fmt: skip
    write_index(folder, Index({}), kept)
    once = (folder / FILE).read_bytes()
    read = read_index(folder)
    assert dict(read.failures) == kept
    write_index(folder, read, read.failures)
    assert (folder / FILE).read_bytes() == once


@given(st.one_of(st.binary(max_size=80), TEXT.map(str.encode),
                 TEXT.map(lambda text: f"failures:\n  a: {text}\n".encode())))  # fmt: skip
def test_any_file_is_an_index_or_one_error(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("index")
    (folder / FILE).write_bytes(data)
    problem = problem_of(folder)
    assert problem == "" or FILE in problem


def problem_of(folder):
    try:
        read_index(folder)
        return ""
    except FileFormatError as error:
        return str(error)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("status: new", "status: wontfix", "failures.b.status must be 'new', 'known'"),
        ("    harm:", "    hram:", "unknown key 'hram' in failures.b; did you mean 'harm'?"),
        ("[b.xosc]", "[../../etc/passwd]", "failures.b.files.0"),
        ("harm: 0.6", "harm: 1.6", "failures.b.harm"),
        ("    cause:", "    violates: [{id: R-1, formula: 'always('}]\n    cause:",
         "criterion R-1: "),
        ("failures:", "failures: &a", "anchors are refused"),
    ],
)  # fmt: skip
def test_a_damaged_index_is_refused_with_its_line(tmp_path, old, new, words):
    write_index(tmp_path, Index({}), {"b": failure("b")})
    path = tmp_path / FILE
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), "utf-8")
    with pytest.raises(FileFormatError) as refused:
        read_index(tmp_path)
    problems = "\n".join(refused.value.problems)
    assert words in problems
    assert f"{FILE}, line" in problems


def test_a_file_belongs_to_one_failure(tmp_path):
    write_index(tmp_path, Index({}), {"b": failure("b"), "c": failure("b")})
    with pytest.raises(FileFormatError, match=r"two failures have the file b\.xosc"):
        read_index(tmp_path)


def test_an_index_without_failures_is_one(tmp_path):
    assert read_index(tmp_path) is None
    (tmp_path / FILE).write_text("# none any more\nfailures:\n")
    assert dict(read_index(tmp_path).failures) == {}
