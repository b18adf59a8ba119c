"""The loop of docs/remote-drivers.md, which uses none of our code."""

import re
import shlex
import sys
from pathlib import Path

import numpy as np
from tests.ego.remote.asked import N, observation, scene

from bridgegen.drivers.driver_process import DriverProcess

PAGE = Path(__file__).parents[3] / "docs" / "remote-drivers.md"


def test_the_loop_of_the_page_drives(tmp_path):
    (code,) = re.findall(r"```python\n(import struct.*?)```", PAGE.read_text("utf-8"), re.S)
    (tmp_path / "loop.py").write_text(code, "utf-8")
    driver = DriverProcess(f"exec:{shlex.join([sys.executable, str(tmp_path / 'loop.py')])}")
    for _ in range(2):
        driver.reset(N, scene())
        acceleration, curvature = driver.act(observation())
        assert acceleration.tolist() == [1.0, 1.0, 1.0]
        assert curvature.tolist() == [0.0, 0.0, 0.0]
    driver.close()


def test_the_loop_in_json_drives_without_dependencies(tmp_path):
    (code,) = re.findall(r"```python\n(import json, struct.*?)```", PAGE.read_text("utf-8"), re.S)
    assert len(code.splitlines()) <= 40
    (tmp_path / "loop.py").write_text(code, "utf-8")
    # -S: no package is there.
    words = [sys.executable, "-S", str(tmp_path / "loop.py")]
    driver = DriverProcess(f"exec:{shlex.join(words)}")
    seen = observation()
    known = (seen.tracks[:, :, 0] == 2).any(axis=1)
    wanted = np.where(known, np.minimum(seen.target_speed, 10.0), seen.target_speed)
    for _ in range(2):
        driver.reset(N, scene())
        acceleration, curvature = driver.act(seen)
        assert acceleration.tolist() == np.clip(wanted - seen.v, -3.0, 2.0).tolist()
        assert curvature.tolist() == [0.0, 0.0, 0.0]
    driver.close()
