"""``failures.yaml``: what people write in it stays, and it is untrusted."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.results.failures import (
    FILE,
    MOST_TEXT,
    OLD_FILE,
    Failure,
    read_failures,
    read_old_file,
    write_failures,
)

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
    write_failures(read_failures(tmp_path), kept)
    assert dict(read_failures(tmp_path).failures) == kept
    assert read_failures(tmp_path).failures["b"].severity == 0.30000000000000004
    assert read_failures(tmp_path).failures["b"].criteria == [rule]


def test_what_people_write_stays_as_another_block_comes(tmp_path):
    write_failures(read_failures(tmp_path), {"b": failure("b"), "d": failure("d")})
    path = tmp_path / FILE
    text = path.read_text("utf-8")
    text = text.replace("  d:\n", "  # seen on the road in May\n\n  # twice\n  d:\n")
    text = text.replace("status: new", "status: known   # JIRA-3", 1)
    text = text.replace('comment: ""', "comment: |\n      to be fixed in 2.1\n      by Ann", 1)
    path.write_text(text, "utf-8")
    before = read_failures(tmp_path)
    approve(before.failures["b"].comment, "2.1")
    write_failures(before, {"c": failure("c")})
    lines = path.read_text("utf-8").splitlines()
    new = [line for line in lines if line not in text.splitlines()]
    assert new == ["  c:", "    files: [c.xosc]"]  # all else as it was
    assert [line for line in lines if line.startswith("  ") and line.endswith(":")] == [
        "  b:", "  c:", "  d:",
    ]  # fmt: skip
    assert lines.index("  # twice") == lines.index("  d:") - 1
    approve(lines, "status")


def test_a_changed_block_keeps_status_and_comment_as_they_are_written(tmp_path):
    write_failures(read_failures(tmp_path), {"b": failure("b")})
    path = tmp_path / FILE
    text = path.read_text("utf-8").replace("  b:\n", "  # above\n  b:\n")
    path.write_text(text.replace("status: new", "status: 'accepted' # by Ann"), "utf-8")
    before = read_failures(tmp_path)
    write_failures(before, {"b": before.failures["b"].model_copy(update={"harm": 1.0})})
    after = path.read_text("utf-8")
    assert "  # above\n  b:\n" in after
    approve(after, "accepted")
    assert read_failures(tmp_path).failures["b"].harm == 1.0


def test_of_a_changed_block_only_values_that_differ_are_written_anew(tmp_path):
    rule = {"id": "R-1", "formula": "ttc >= 1.5 s"}
    kept = {"b": failure("b", minimal="needs x", seed=3), "c": failure("c", violates=[rule])}
    write_failures(read_failures(tmp_path), kept)
    path = tmp_path / FILE
    text = path.read_text("utf-8")
    text = text.replace("    cause: planning\n", "\n    # why?\n    cause: planning  # sure\n")
    path.write_text(text.replace("    seed: 3", "    # mine\n    seed: 3"), "utf-8")
    before = path.read_text("utf-8").splitlines()
    more = {"minimal": "", "violates": [rule], "seed": 4, "status": "fixed"}
    changed = {"b": failure("b", **more), "c": failure("c", harm=1.0)}
    write_failures(read_failures(tmp_path), changed)
    assert dict(read_failures(tmp_path).failures) == changed
    after = path.read_text("utf-8").splitlines()
    assert [one for one in before if one not in after] == ["    minimal: needs x", "    seed: 3"]
    assert [one for one in after if one not in before] == [
        "    status: fixed", "    seed: 4", "    harm: 1.0",
    ]  # fmt: skip
    assert after.index("    # mine") == after.index("    seed: 4") - 1
    assert after.count("    violates:") == 1
    first = after.index("    violates:")  # of b, before the keys that stand behind it in a block
    assert first < after.index("    driver: route-follower")


def test_a_comment_of_several_lines_costs_no_other_block_its_own(tmp_path):
    write_failures(read_failures(tmp_path), {"b": failure("b"), "c": failure("c")})
    path = tmp_path / FILE
    text = path.read_text("utf-8").replace('comment: ""', "comment: |\n      one\n      two", 1)
    path.write_text(text.replace("  c:\n", "  # c's\n  c:\n"), "utf-8")
    before = read_failures(tmp_path)
    changed = before.failures["b"].model_copy(update={"harm": 1.0})
    write_failures(before, {"b": changed})
    assert read_failures(tmp_path).failures["b"] == changed
    assert "  # c's\n  c:\n" in path.read_text("utf-8")


def test_another_layout_is_understood(tmp_path):
    write_failures(read_failures(tmp_path), {"b": failure("b")})
    path = tmp_path / FILE
    lines = path.read_text("utf-8").splitlines()
    start = lines.index("failures:")
    wide = [line.replace("    ", "          ").replace("  b:", "     b:") for line in lines[start:]]
    path.write_text("\n".join(wide), "utf-8")
    before = read_failures(tmp_path)
    write_failures(before, {"a": failure("a")})
    assert [*read_failures(tmp_path).failures] == ["a", "b"]
    text = path.read_text("utf-8")
    assert text.endswith("\n".join(wide[1:]) + "\n")
    assert "     a:\n       title:" in text


TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=60)


@given(st.dictionaries(st.from_regex(r"[a-z0-9][a-z0-9-]{0,8}", fullmatch=True),
                       st.tuples(TEXT, TEXT, TEXT), max_size=4))  # fmt: skip
def test_any_text_is_kept(tmp_path_factory, texts):
    folder = tmp_path_factory.mktemp("index")
    kept = {
        id: failure(id, title=a, comment=b, scenario=c) for id, (a, b, c) in texts.items()
    }  # fmt: skip
    write_failures(read_failures(folder), kept)
    once = (folder / FILE).read_bytes()
    read = read_failures(folder)
    assert dict(read.failures) == kept
    assert [*read.failures] == sorted(kept)
    write_failures(read, {})
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
        read_failures(folder)
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
        ("    harm: 0.6016747515838474\n", "", "failures.b must have the key 'harm'"),
        ("failures:", "failures: &a", "anchors are refused"),
        ("failures:", "modes:", "unknown key 'modes'"),
    ],
)  # fmt: skip
def test_a_damaged_index_is_refused_with_its_line(tmp_path, old, new, words):
    write_failures(read_failures(tmp_path), {"b": failure("b")})
    path = tmp_path / FILE
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), "utf-8")
    with pytest.raises(FileFormatError) as refused:
        read_failures(tmp_path)
    problems = "\n".join(refused.value.problems)
    assert words in problems
    assert f"{FILE}, line" in problems


def test_a_file_belongs_to_one_failure(tmp_path):
    write_failures(read_failures(tmp_path), {"b": failure("b"), "c": failure("c")})
    path = tmp_path / FILE
    path.write_text(path.read_text("utf-8").replace("[c.xosc]", "[b.xosc]"), "utf-8")
    with refuses(FileFormatError, "b.xosc"):
        read_failures(tmp_path)


def test_an_index_without_failures_is_one(tmp_path):
    assert dict(read_failures(tmp_path).failures) == {}
    (tmp_path / FILE).write_text("# none any more\nfailures:\n")
    assert dict(read_failures(tmp_path).failures) == {}


# ---- blocks of a dashboard, and of people ----

TEXT = """\
# Our modes; ask Ada.
failures:
# the one of the review in March
  fm-d:
    status: accepted   # by the safety board
    scenario: cut-in
    title: 'runs into a car'
    comment: |
      Two lines
      # of a note.

  # waits for 1.3
  fm-b:
    status: fixed
    comment:
"""


@pytest.fixture
def path(tmp_path):
    made = tmp_path / FILE
    made.write_text(TEXT, "utf-8")
    return made


def added(path, *ids, **more):
    write_failures(read_failures(path.parent), {id: Failure(title="'it': #", **more) for id in ids})
    return path.read_text("utf-8")


def test_a_block_of_a_dashboard_has_a_status_and_no_files(path):
    found = read_failures(path.parent).failures
    assert [(one.status, one.files) for one in found.values()] == [("accepted", []), ("fixed", [])]
    approve(found["fm-d"].comment)
    assert found["fm-b"].comment == ""


def test_adding_keeps_every_line_and_the_order_of_the_person(path):
    text = added(path, "fm-e", "fm-c", "fm-a")
    assert yaml.safe_load(text)["failures"]["fm-a"] == {
        "title": "'it': #", "status": "new", "comment": "",
    }  # fmt: skip
    assert [*yaml.safe_load(text)["failures"]] == ["fm-a", "fm-c", "fm-d", "fm-b", "fm-e"]
    blocks = [f"  {id}:\n" for id in ("fm-a", "fm-c", "fm-e")]
    rest = '    title: "\'it\': #"\n    status: new\n    comment: ""\n'
    for one in blocks:
        assert one + rest in text
        text = text.replace(one + rest, "")
    assert text == TEXT


def test_a_text_that_ends_like_a_comment_is_none(path):
    text = TEXT.replace("# of a note.\n\n  # waits for 1.3\n", "# of a note.\n")
    path.write_text(text.replace("fm-d", "fm-0"), "utf-8")
    write_failures(read_failures(path.parent), {"fm-a": Failure()})
    found = read_failures(path.parent).failures
    assert [*found] == ["fm-0", "fm-a", "fm-b"]
    approve(found["fm-0"].comment)


def test_both_kinds_of_blocks_stand_in_one_file(path):
    text = added(path, "fm-c", scenario="cut-in")
    write_failures(read_failures(path.parent), {"cut-in-turning-1": failure("cut-in-turning-1")})
    found = read_failures(path.parent)
    head, blocks = text.split("failures:\n")
    assert path.read_text("utf-8").startswith(f"{head}failures:\n  cut-in-turning-1:\n")
    assert path.read_text("utf-8").endswith(blocks)
    assert found.of_file("cut-in-turning-1.xosc")[0] == "cut-in-turning-1"
    assert [bool(one.files) for one in found.failures.values()] == [True, False, False, False]


def test_comments_of_a_file_without_blocks_stay(path):
    for text in ("# mine", "# mine\nfailures:\n", "\ufeff# mine\r\nfailures:\r\n# later\r\n"):
        path.write_bytes(text.encode())
        assert "# mine" in added(path, "fm-a")
        assert ("# later" in text) == ("# later" in path.read_text("utf-8"))
        assert [*read_failures(path.parent).failures] == ["fm-a"]


@pytest.mark.parametrize("text", [f"{TEXT}...\n", "failures: {a: {status: known}} # mine\n"])
def test_a_file_that_cannot_be_added_to_is_left_alone(path, text):
    path.write_text(text, "utf-8")
    with refuses(FileFormatError, "failures"):
        added(path, "fm-z", "Z")
    assert path.read_text("utf-8") == text


def test_two_people_who_add_in_another_order_write_the_same(tmp_path):
    ids = [f"fm-{k}" for k in range(6)]
    for name, order in (("one", ids), ("two", ids[::-1])):
        (tmp_path / name).mkdir()
        for id in order:
            write_failures(read_failures(tmp_path / name), {id: Failure(title=id)})
    assert (tmp_path / "one" / FILE).read_bytes() == (tmp_path / "two" / FILE).read_bytes()


# ---- the file of earlier versions ----

OLD = """\
modes:
# seen first in the review of March
- id: fm-7f3e4f05c4
  status: accepted
  scenario: 'cut-in'
  driver: 'stack.py:Stack'
  title: 'runs into a car'
  note: |
    Two lines
    of a note.
- id: fm-2
  status: fixed
  note:
"""


def test_the_old_file_is_read(tmp_path):
    assert read_old_file(tmp_path) == {}
    (tmp_path / OLD_FILE).write_text(OLD, "utf-8")
    assert read_old_file(tmp_path) == {
        "fm-7f3e4f05c4": Failure(
            title="runs into a car", status="accepted", comment="Two lines\nof a note.\n",
            scenario="cut-in", driver="stack.py:Stack",
        ),
        "fm-2": Failure(status="fixed"),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("modes:\n- id: fm-a\n  status: wontfix\n", "accepted"),
        ("modes:\n- id: fm-a\n", "status"),
        ("modes:\n- {id: a, status: new}\n- {id: a, status: new}\n", "line 3"),
        ("modes:\n- nothing\n", "line 2"),
        ("others: []\n", "others"),
        ("modes: &a []\n", "anchors"),
        (f"modes:\n- id: a\n  status: new\n  note: {'x' * (MOST_TEXT + 1)}\n", "line 4"),
    ],
)
def test_what_is_wrong_with_the_old_file_is_said_with_the_line(tmp_path, text, told):
    (tmp_path / OLD_FILE).write_text(text, "utf-8")
    with refuses(FileFormatError, told):
        read_old_file(tmp_path)
