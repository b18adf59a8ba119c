"""Marks are put on where `.ci/run` looks for them: in the test files, by their full name."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_marks_stand_in_test_files_alone():
    looked_for = re.findall(r'\$\(marked "?([\w|]+)"?\)', (ROOT / ".ci" / "run").read_text("utf-8"))
    assert len(looked_for) == 3
    mark = re.compile(rf"(pytest\.)?\bmark\.({'|'.join(looked_for)})\b|add_marker")
    found = [
        (path.name, match)
        for path in sorted((ROOT / "tests").rglob("*.py"))
        for match in mark.finditer(path.read_text("utf-8"))
        if path != Path(__file__)
    ]
    assert {match[2] for _, match in found} == {*"|".join(looked_for).split("|")}
    assert [name for name, match in found if not (match[1] and name.startswith("test_"))] == []
