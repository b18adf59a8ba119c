"""Build a wheel that carries the compiled simulator, for this Python and x86-64-v3 processors.

    python -m venv .venv && .venv/bin/pip install -c constraints.txt . wheel
    .venv/bin/python tools/build_wheel.py --out dist

It builds the wheel as `pip wheel` does, compiles every kernel that the catalogue's scenarios
and the shipped drivers need in a copy of it, adds that code, and packs it again under a tag of its
platform. See ``bridgegen.base.compilation.folder`` for when an installation uses it.
"""

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLATFORM = "manylinux_2_28_x86_64"
COMPILE = """
import numpy as np
from importlib.resources import files
from bridgegen.drivers.drivers import DRIVERS
from bridgegen.base.errors import BridgeGenError
from bridgegen.scenario.language.reader import load
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline

for file in sorted(files("bridgegen.scenario.catalogue").iterdir()):
    if not file.name.endswith(".yaml"):
        continue
    for driver in (None, *DRIVERS):
        try:
            scenario = load(file.name.removesuffix(".yaml"))
            space = scenario.space()
            pipeline = Pipeline(scenario, space, PipelineOptions(ego=driver, causes=True))
        except BridgeGenError:  # a part that scenarios share, or a driver from elsewhere
            continue
        pipeline.choose_objective()
        pipeline.evaluate(space.decode(np.random.default_rng(0).random((64, space.n_var))))
"""
DESCRIBE = """
import json
from bridgegen.base.compilation.folder import BASELINE, described, features
print(json.dumps([described(), BASELINE, features()]))
"""


def main() -> None:
    """Build the wheel that the arguments name."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("dist"), help="folder of the wheel")
    out = parser.parse_args().out
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        parser.error(
            f"wheels are for Linux on x86_64, this is {sys.platform}, {platform.machine()}"
        )
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        build = ("-m", "pip", "wheel", "--no-deps", "--wheel-dir", str(place), str(ROOT))
        subprocess.run([sys.executable, *build], check=True, stdout=subprocess.DEVNULL)
        (plain,) = place.glob("*.whl")
        with zipfile.ZipFile(plain) as archive:
            archive.extractall(place / "unpacked")
        add_kernels(place / "unpacked", place / "cache")
        tag(place / "unpacked")
        pack = ("-m", "wheel", "pack", str(place / "unpacked"), "--dest-dir", str(out))
        subprocess.run([sys.executable, *pack], check=True)


def add_kernels(package_home: Path, cache: Path) -> None:
    """Compile the kernels of an unpacked wheel, and put their code into it."""
    environment = {**os.environ, "PYTHONPATH": str(package_home), "PYTHONDONTWRITEBYTECODE": "1"}

    def python(code: str, **more: str) -> str:
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment | more, cwd=package_home,
            stdout=subprocess.PIPE, text=True, check=True,
        )  # fmt: skip
        return done.stdout

    facts, baseline, features = json.loads(python(DESCRIBE))
    machine = {"NUMBA_CPU_NAME": baseline, "NUMBA_CPU_FEATURES": features}
    python(COMPILE, NUMBA_CACHE_DIR=str(cache), **machine)
    (compiled,) = cache.iterdir()
    carried = package_home / "bridgegen" / "_kernels"
    shutil.copytree(compiled, carried, ignore=shutil.ignore_patterns("*.lock"))
    (carried / "machine.json").write_text(json.dumps(facts), "utf-8")


def tag(package_home: Path) -> None:
    """Say in an unpacked wheel for which Python and platform it is."""
    (about,) = package_home.glob("*.dist-info/WHEEL")
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    lines = [line for line in about.read_text("utf-8").splitlines() if line]
    kept = [line for line in lines if not line.startswith(("Tag:", "Root-Is-Purelib:"))]
    kept += ["Root-Is-Purelib: false", f"Tag: {python}-none-{PLATFORM}"]
    about.write_text("\n".join(kept) + "\n", "utf-8")


if __name__ == "__main__":
    main()
