"""Whether a driver is still the one that a result is of."""

import hashlib

from bridgegen.drivers.identity import digest_of


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
