"""New ranges for a user's file are a difference that ``patch`` applies; the file stays."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve
from tests.mining.scenarios.planted import approaches, events, met, sought

from bridgegen.recordings.scenarios.update import in_words, proposed_update
from bridgegen.scenario.language.reader import load, shipped_text

SLOWER = Path(__file__).parents[3] / "docs" / "examples" / "slower-lead.yaml"
TEXT = SLOWER.read_text(encoding="utf-8")
PATCH = shutil.which("patch")


def update(path, found):
    made, _ = met(sought(path), found, path.parent)
    return proposed_update(sought(path), made), made


def patched(path, diff):
    if PATCH is None:
        pytest.skip("there is no patch")
    (path.parent / "d.diff").write_bytes(diff.encode())
    after = path.with_name("after.yaml")
    shutil.copy(path, after)
    subprocess.run([PATCH, "--binary", after, path.parent / "d.diff"], check=True, timeout=60)
    return after


@pytest.mark.parametrize("form", ["as it is", "crlf", "no line end"])
def test_the_patched_file_holds_what_was_seen(tmp_path, form):
    text = {"as it is": TEXT, "crlf": TEXT.replace("\n", "\r\n"), "no line end": TEXT.rstrip()}
    path = tmp_path / "my.yaml"
    path.write_bytes(text[form].encode())
    one, made = update(path, approaches(30))
    assert path.read_bytes() == text[form].encode()
    after = patched(path, one.diff)
    scenario = load(after)
    for name, values in made.rows.items():
        assert scenario.parameters[name].low <= values.min()
        assert scenario.parameters[name].high >= values.max()
    before, then = (each.read_bytes().splitlines() for each in (path, after))
    changed = [(a, b) for a, b in zip(before, then, strict=True) if a != b]
    assert {line.split(b":")[0].strip() for pair in changed for line in pair} <= {b"low", b"high"}
    (low,) = [b for a, b in changed if b"60 km/h" in a]
    assert low.rstrip().endswith(b" km/h # German motorways' minimum")


def test_ranges_are_not_narrowed(tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text(TEXT, encoding="utf-8")
    n = 5
    one, _ = update(path, approaches(
        n, ego_speed=np.linspace(20.0, 25.0, n), relative_speed=np.full(n, 3.0),
        gap=np.full(n, 25.0),
    ))  # fmt: skip
    assert one.diff == ""
    assert all(each.proposed == each.declared for each in one.ranges)


def test_it_says_what_was_seen_and_which_constraints_events_break(tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text(TEXT, encoding="utf-8")
    ego, slower = np.array([20.0, 35.0, 22.0]), np.array([3.0, 3.0, 4.0])
    one, _ = update(path, events("approach", {
        "ego_speed": ego, "relative_speed": slower, "gap": np.array([25.0, 28.0, 3.0]),
    }))  # fmt: skip
    assert (one.events, one.kept) == (3, 2)
    words = "\n".join(in_words(one))
    approve(words, "slower_by", "approach-3", "ego_speed", "20")


def test_an_end_that_the_scenario_cannot_hold_stays_and_it_says_why(tmp_path):
    """Of the template lead-brakes, bodies would start inside each other."""
    path = tmp_path / "my.yaml"
    path.write_bytes(shipped_text("lead-brakes"))
    n = 3
    one, _ = update(path, events("lead-brakes", {
        "ego_speed": np.array([12.0, 13.0, 26.0]), "gap": np.array([0.1, 20.0, 20.0]),
        "deceleration": np.full(n, 3.0), "low_speed": np.full(n, 2.0),
        "lead_time": np.full(n, 2.0), "lane_width": np.full(n, 2.0),
    }))  # fmt: skip
    said = {each.parameter: each for each in one.ranges}
    assert said["gap"].proposed == said["gap"].declared
    approve(said["gap"].remark, "stays")
    assert said["ego_speed"].proposed.high == 26.0
    approve(said["lane_width"].remark)
