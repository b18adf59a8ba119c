"""A message is held against the approved one; the file of these has no more than the tests meet."""

import json

import pytest
from tests import approval
from tests.approval import approve, approved, is_there, refuses


@pytest.fixture
def table(request, monkeypatch):
    """The approved messages of this test."""
    messages: list[str] = []
    monkeypatch.setattr(approval, "approved", lambda: {request.node.nodeid: messages})
    monkeypatch.setattr(request.config.option, "approve_messages", False)
    return messages


def test_every_entry_is_that_of_a_test():
    assert [test for test in approved() if not is_there(test)] == []


def test_another_wording_and_another_error_fail(table):
    table += ["ValueError: speed must be > 0 m/s"] * 3
    with refuses(ValueError, "speed", "m/s"):
        raise ValueError("speed must be > 0 m/s")
    with pytest.raises(pytest.fail.Exception, match="reworded"), refuses(ValueError):
        raise ValueError("reworded")
    with pytest.raises(pytest.fail.Exception, match="TypeError"), refuses(Exception):
        raise TypeError("speed must be > 0 m/s")
    with pytest.raises(pytest.fail.Exception, match="not approved yet"):
        approve("one more")


def test_what_a_message_is_about_must_be_in_it(table):
    with pytest.raises(AssertionError, match="gap"), refuses(ValueError, "gap"):
        raise ValueError("must be > 0 m")


def test_the_words_of_python_and_of_folders_are_none_of_ours(table, tmp_path):
    table.append("ValueError: <tmp>/a.json: cannot be read: <JSONDecodeError>")
    with refuses(ValueError, tmp_path):
        try:
            json.loads("{")
        except ValueError as error:
            raise ValueError(f"{tmp_path}/a.json: cannot be read: {error}") from None


def test_of_several_lines_those_count_that_name_it(table):
    table.append("gap 3 m")
    approve("gap 3 m\nspeed 4 m/s", "gap")
