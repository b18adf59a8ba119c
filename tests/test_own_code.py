"""Code of the user's own: what is a name of it, and what is imported."""

import json
import sys

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.base.plugins import class_of, file_of, is_own, label_of


@pytest.mark.parametrize(
    ("name", "own", "label"),
    [
        ("pso", False, "pso"),
        ("sumo:Krauss", True, "Krauss"),  # whoever knows it by name asks first
        ("a/b.py:Mine", True, "Mine"),
        ("a.b:Mine", True, "Mine"),
        (":Mine", False, ":Mine"),
        ("a.py:not-a-name", False, "a.py:not-a-name"),
    ],
)
def test_names(name, own, label):
    assert is_own(name) == own
    assert label_of(name) == label


def test_a_file_may_be_called_like_a_module(tmp_path):
    path = tmp_path / "json.py"
    path.write_text("class Mine:\n    pass\n", "utf-8")
    assert file_of(f"{path}:Mine") == path
    assert class_of(f"{path}:Mine", "--algorithm").__name__ == "Mine"
    assert sys.modules["json"] is json


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        ("", "Mine", "Mine"),
        ("Mine = 3", "Mine", "Mine"),
        ("1 / 0", "Mine", "ZeroDivisionError"),
        ("def", "Mine", "SyntaxError"),
        ("import no_such_module", "Mine", "imported"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path, text, name, message):
    path = tmp_path / "mine.py"
    path.write_text(text, "utf-8")
    with refuses(InputError, message) as error:
        class_of(f"{path}:{name}", "--algorithm")
    assert len(error.value.problems) == 1
    with refuses(InputError):
        class_of(f"{path}x.py:{name}", "--algorithm")
    with refuses(InputError, "--algorithm"):
        class_of("mine", "--algorithm")
