"""The file in which a person keeps the status of failure modes."""

from contextlib import suppress

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.errors import FileFormatError
from bridgegen.jobs.dashboard.status_file import (
    MOST_TEXT,
    Decision,
    add_decisions,
    read_status_file,
)

TEXT = """\
# Our modes; ask Ada.
modes:
# the one of the review in March
- id: fm-b
  status: accepted   # by the safety board
  scenario: 'cut-in'
  driver: 'stack'
  title: 'runs into a car'
  note: |
    Two lines
    of a note.

# waits for 1.3
- id: fm-d
  status: fixed
  scenario: 'cut-out'
"""


@pytest.fixture
def path(tmp_path):
    made = tmp_path / "failure-modes.yaml"
    made.write_text(TEXT, "utf-8")
    return made


def test_it_says_what_a_person_set(path):
    found = read_status_file(path)
    assert [found.status(one) for one in ("fm-b", "fm-d", "fm-x")] == ["accepted", "fixed", "new"]
    assert found.note("fm-b") == "Two lines\nof a note.\n"


def test_without_a_file_all_is_new(tmp_path):
    assert read_status_file(tmp_path / "none.yaml").status("fm-b") == "new"


def test_adding_keeps_every_line_of_the_person(path):
    new = [Decision("fm-a", "new", "cut-in", "stack", "hits 'it': # here"), Decision("fm-b", "new")]
    assert add_decisions(path, read_status_file(path), new) == 1
    head, rest = TEXT.split("modes:\n")
    text = path.read_text("utf-8")
    assert text.startswith(f"{head}modes:\n- id: fm-a\n")
    assert text.endswith(rest)
    assert yaml.safe_load(path.read_text("utf-8"))["modes"][0] == {
        "id": "fm-a", "status": "new", "scenario": "cut-in", "driver": "stack",
        "title": "hits 'it': # here",
    }  # fmt: skip


def test_a_comment_stays_above_its_block(path):
    file = read_status_file(path)
    add_decisions(path, file, [Decision("fm-c", "new", "cut-in", "stack")])
    text = path.read_text("utf-8")
    assert "# waits for 1.3\n- id: fm-d" in text
    assert "# the one of the review in March\n- id: fm-b" in text
    order = [text.index(f"id: {one}") for one in ("fm-b", "fm-c", "fm-d")]  # by scenario
    assert order == sorted(order)


def test_blocks_may_be_indented(path):
    path.write_text(TEXT.replace("\n", "\n  ").replace("  modes:", "modes:"), "utf-8")
    add_decisions(path, read_status_file(path), [Decision("fm-a", "new", "cut-in", "stack")])
    assert "\n  - id: fm-a\n    status: new\n" in path.read_text("utf-8")
    assert len(read_status_file(path).decisions) == 3


def test_a_file_that_cannot_be_added_to_is_left_alone(path):
    path.write_text(f"{TEXT}...\n", "utf-8")
    with pytest.raises(FileFormatError, match="nothing behind the last"):
        add_decisions(path, read_status_file(path), [Decision("fm-z", "new", "z", "stack")])
    assert path.read_text("utf-8") == f"{TEXT}...\n"


def test_adding_twice_changes_nothing(path):
    new = [Decision("fm-a", "new", "cut-in", "stack")]
    add_decisions(path, read_status_file(path), new)
    once = path.read_bytes()
    assert add_decisions(path, read_status_file(path), new) == 0
    assert path.read_bytes() == once


def test_two_people_who_add_in_another_order_write_the_same(tmp_path):
    some = [Decision(f"fm-{k}", "new", f"s{k % 3}", "stack", "x") for k in range(6)]
    one, two = tmp_path / "one.yaml", tmp_path / "two.yaml"
    for path, order in ((one, some), (two, some[::-1])):
        for each in order:
            add_decisions(path, read_status_file(path), [each])
    assert one.read_bytes() == two.read_bytes()


@pytest.mark.parametrize(
    ("given_", "told"),
    [
        ("modes:\n- id: fm-a\n  status: wontfix\n", r"new, known, accepted or fixed.*'wontfix'.*3"),
        ("modes:\n- id: fm-a\n", r"needs 'status'.*line 2"),
        ("modes:\n- status: new\n", r"needs 'id'.*line 2"),
        ("modes:\n- id: 12\n  status: new\n", r"id must be a text.*line 2"),
        ("modes:\n- id: fm-a\n  status: new\n  ticket: 7\n", r"unknown key 'ticket'.*line 4"),
        ("modes:\n- {id: a, status: new}\n- {id: a, status: new}\n", r"'a' is there twice.*line 3"),
        ("modes:\n- nothing\n", r"must be a block.*line 2"),
        ("modes: [{id: a, status: new}, {id: b, status: new}]\n", "a line of its own.*line 1"),
        ("modes:\n-\n  id: a\n  status: new\n", "a line of its own.*line 3"),
        ("modes: 3\n", "a list 'modes'"),
        ("others: []\n", "a list 'modes'"),
        ("modes:\n<<<<<<< ours\n- id: fm-a\n", "line [23]"),
        ("modes: &a []\n", "anchors are refused"),
        (f"modes:\n- id: fm-a\n  status: new\n  note: {'x' * (MOST_TEXT + 1)}\n", "2001.*line 4"),
    ],
)
def test_what_is_wrong_is_said_with_the_line(tmp_path, given_, told):
    path = tmp_path / "failure-modes.yaml"
    path.write_text(given_, "utf-8")
    with pytest.raises(FileFormatError, match=told):
        read_status_file(path)


def test_all_problems_are_said_at_once(tmp_path):
    path = tmp_path / "failure-modes.yaml"
    path.write_text("modes:\n- id: a\n  status: x\n- id: b\n  status: y\n", "utf-8")
    with pytest.raises(FileFormatError) as error:
        read_status_file(path)
    assert len(error.value.problems) == 2


@given(st.lists(st.tuples(st.text(max_size=40), st.text(max_size=40)), max_size=6))
def test_any_text_is_read_again(tmp_path_factory, texts):
    path = tmp_path_factory.mktemp("status") / "failure-modes.yaml"
    some = [Decision(f"fm-{k}", "known", one, "stack", two) for k, (one, two) in enumerate(texts)]
    add_decisions(path, read_status_file(path), some)
    found = read_status_file(path).decisions
    assert set(found) == {one.id for one in some}
    for one in some:
        plain = "".join(c if c.isprintable() else "\ufffd" for c in one.title)
        assert found[one.id].title == plain


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("status") / "failure-modes.yaml"
    path.write_bytes(b"modes:\n" + data)
    with suppress(FileFormatError):
        assert set(read_status_file(path).blocks) == set(read_status_file(path).decisions)
