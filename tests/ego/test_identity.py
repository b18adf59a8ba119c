"""Which driver a result is of: its digest, its identity and what it is called."""

import hashlib
import shutil

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.identity import (
    Identity,
    checked_name,
    digest_of,
    identity_of,
    labels_of,
)


def test_a_class_is_known_by_its_file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_bytes(b"class Mine: ...")
    assert digest_of(f"{path}:Mine") == hashlib.sha256(b"class Mine: ...").hexdigest()


def test_a_command_is_known_by_its_program_and_the_files_that_it_is_given(tmp_path):
    script, weights = tmp_path / "drive.sh", tmp_path / "weights"
    for path in (script, weights):
        path.write_text("first", "utf-8")
    name = f"exec:sh {script} --weights {weights}"
    found = [digest_of(name)]
    for path in (script, weights):
        path.write_text("second one", "utf-8")
        found.append(digest_of(name))
    assert len(set(found)) == 3
    assert digest_of(name) == found[-1]
    assert digest_of(f"exec:cat {script} --weights {weights}") not in found


def test_nothing_is_known_of_a_server_or_of_what_ships(tmp_path):
    for name in ("connect:localhost:5555", f"unix:{tmp_path}", "reference", "exec:'", "a.b:C"):
        assert digest_of(name) == ""


def test_the_modules_beside_a_file_that_it_imports_belong_to_it(tmp_path):
    path, helper, far = (tmp_path / f"{name}.py" for name in ("mine", "helper", "far"))
    path.write_text("import os, helper\nclass Mine: ...", "utf-8")
    helper.write_text("from far import gap\nimport mine  # and back", "utf-8")
    far.write_text("gap = 1.0", "utf-8")
    (tmp_path / "other.py").write_text("1", "utf-8")
    found = [digest_of(f"{path}:Mine")]
    (tmp_path / "other.py").write_text("2", "utf-8")
    assert digest_of(f"{path}:Mine") == found[0]
    for file in (path, helper, far):
        file.write_text(file.read_text("utf-8") + "\n", "utf-8")
        found.append(digest_of(f"{path}:Mine"))
    assert len(set(found)) == 4
    copy = tmp_path / "moved"
    copy.mkdir()
    for file in (path, helper, far):
        shutil.copy(file, copy)
    assert digest_of(f"{copy / 'mine.py'}:Mine") == found[-1]


def test_a_file_that_is_no_python_is_known_by_its_bytes(tmp_path):
    path = tmp_path / "mine.py"
    path.write_bytes(b"\0 import helper (")
    assert digest_of(f"{path}:Mine") == hashlib.sha256(b"\0 import helper (").hexdigest()


def test_one_content_is_one_driver_whatever_its_path():
    here, there = (identity_of(f"{path}mine.py:V2", "d1") for path in ("", "../jb/"))
    assert here == there == Identity("V2", "d1:V2")
    assert identity_of("mine.py:V1", "d1") != here  # another class of the file
    assert identity_of("mine.py:V2", "d1", "planner 7").name == "planner 7"
    assert identity_of("a.fmu", "d2").name == "a.fmu"


def test_a_result_without_a_digest_is_known_by_what_was_typed():
    assert identity_of("old/mine.py:V2", "") == Identity("old/mine.py:V2", "old/mine.py:V2")
    assert identity_of("reference", "").name == "reference"


def test_other_contents_under_a_name_are_called_changed():
    drivers = [Identity("V2", "a"), Identity("V1", "b"), Identity("V2", "c"), Identity("V2", "a"),
               Identity("V2", "d")]  # fmt: skip
    assert labels_of(drivers) == ["V2", "V1", "V2 (changed)", "V2", "V2 (changed 2)"]


@pytest.mark.parametrize("name", ["", "  ", "two\nlines", "\u202ebidi", "x" * 81])
def test_a_name_is_a_line(name):
    with refuses(InputError, "--name", "80"):
        checked_name(name)
    assert checked_name("planner 7, <b>") == "planner 7, <b>"
