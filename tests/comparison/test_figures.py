import numpy as np
import pytest

from bridgegen.comparison import figures
from bridgegen.comparison.drawing import DARK, LIGHT

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_figures_are_pictures_and_the_same_bytes_again(theme):
    shares = {"random": np.array([0.1, 0.2, 0.2]), "pso": np.array([0.8]), "gone": np.array([])}
    drawn = figures.boxes(shares, "random", "R_critic", theme)
    assert drawn.startswith(PNG)
    assert drawn == figures.boxes(shares, "random", "R_critic", theme)
    found = {name: np.outer(values, [1.0, 2.0]) for name, values in shares.items()}
    assert figures.curves(found, [20, 40], "random", "found", theme).startswith(PNG)
    assert figures.curves({"gone": np.empty((0, 2))}, [20, 40], "gone", "f", theme).startswith(PNG)


def test_eighteen_algorithms_look_different():
    names = [f"a{i}" for i in range(19)]
    looks = {(colour, str(style)) for _, colour, style in figures._looks(names, "a0", DARK)}
    assert len(looks) == 19
