"""A search algorithm of the user's own, named by its file."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, Interrupted, StorageError
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.results.store import Store
from bridgegen.search.algorithms import Problem, Results, get

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
OWN = f"{EXAMPLES}/my_algorithm.py:Neighbours"
CHOSEN = {"ego": "route-follower", "triage": "none", "keep": 1}
OUTSIDERS = {
    "pymoo_search": ["DE"],
    "optuna_search": ["TPE", "CMA"],
    "verifai_search": ["CrossEntropy", "Bandit", "Halton"],
}
"""Classes of the examples, by file, which is called NEEDED_search."""


def rows(folder):
    with Store.open(folder) as store:
        return store.read(0, len(store)).U


def test_it_searches_and_is_resumed_when_it_is_named_again(tmp_path):
    whole = bg.run_search("crossroads-s1", algorithm=OWN, budget=80, out=tmp_path / "a", **CHOSEN)
    assert whole.settings.algorithm == OWN
    assert f"--algorithm {OWN}" in whole.settings.command(tmp_path)
    with refuses(InputError, OWN, "--algorithm"):
        bg.resume(whole.folder)
    with refuses(InputError, "pso"):
        bg.resume(whole.folder, algorithm="pso")

    def stop(progress):
        raise KeyboardInterrupt

    half = {"callbacks": SearchCallbacks(batch=stop), "out": tmp_path / "b"}
    with pytest.raises(Interrupted):
        bg.run_search("crossroads-s1", algorithm=OWN, budget=80, **half, **CHOSEN)
    assert len(rows(tmp_path / "b")) == 40
    bg.resume(tmp_path / "b", algorithm=OWN)
    assert np.array_equal(rows(tmp_path / "b"), rows(whole.folder))


def test_one_of_ours_needs_no_naming_but_may_not_be_another(tmp_path):
    run = bg.run_search(
        "crossroads-s1", algorithm="random", budget=20, out=tmp_path / "a", **CHOSEN
    )
    assert bg.resume(run.folder, algorithm="random").summary.evaluations == 20
    with refuses(InputError, "pso"):
        bg.resume(run.folder, algorithm="pso")


def test_it_is_compared_under_its_class_s_name(tmp_path):
    own = tmp_path / "mine.py"
    own.write_text((EXAMPLES / "my_algorithm.py").read_text("utf-8"), "utf-8")
    call = {
        "algorithms": [f"{own}:Neighbours", "random"], "seeds": 2, "budget": 60, "workers": 1,
        "settings": {"Neighbours": {"step": 0.3}}, "out": tmp_path / "c", "ego": "route-follower",
        "deliver": False,
    }  # fmt: skip
    result = bg.compare("crossroads-s1", **call)
    assert list(result.plan.algorithms) == ["Neighbours", "random"]
    assert result.plan.baseline == "Neighbours"
    folder = tmp_path / "c" / "runs" / "crossroads-s1-Neighbours-0"
    assert bg.Run(folder).settings.settings["step"] == 0.3
    assert f"{own}:Neighbours,random" in result.plan.command()
    with refuses(InputError):
        bg.compare("crossroads-s1", **{**call, "algorithms": [f"{own}:Neighbours", OWN]})
    own.write_text(own.read_text("utf-8") + "# another\n", "utf-8")
    with refuses(StorageError):
        bg.compare("crossroads-s1", **call)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("class Mine:\n    pass", "description"),
        ("import nothing_like_it", "imported"),
    ],
)
def test_a_wrong_one_is_told_before_the_search(tmp_path, text, message):
    path = tmp_path / "mine.py"
    path.write_text(text, "utf-8")
    with refuses(InputError, message):
        bg.run_search("crossroads-s1", algorithm=f"{path}:Mine", out=tmp_path / "r")
    assert not (tmp_path / "r").exists()


def outsider(file: str, name: str):
    needed = file.removesuffix("_search")
    missing = importlib.util.find_spec(needed) is None
    marks = [] if needed == "pymoo" else [pytest.mark.samplers]
    marks.append(pytest.mark.skipif(missing, reason=f"{needed} is not installed"))
    return pytest.param(f"{EXAMPLES / file}.py:{name}", id=name, marks=marks)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of other people's packages
@pytest.mark.parametrize("method", [outsider(f, n) for f, ns in OUTSIDERS.items() for n in ns])
def test_the_examples_of_others_keep_the_protocol(method):
    """The same seed asks for the same rows; failed rows and NaN are survived."""
    kind = get(method)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    asked = []
    for seed in (3, 3, 4):
        search = kind(Problem.unnamed(3), seed)
        found = []
        for k in range(12):
            U = search.ask()
            F = ((U - 0.3) ** 2).sum(axis=1, keepdims=True)
            results = Results.of_F(np.where(k == 5, np.nan, F), ok=np.full(len(U), k != 5))
            search.tell(U, results)
            found.append(U)
        asked.append(np.concatenate(found))
        assert ((asked[-1] >= 0.0) & (asked[-1] <= 1.0)).all()
    assert np.array_equal(asked[0], asked[1])
    if "Halton" not in method:
        assert not np.array_equal(asked[0], asked[2])
    assert np.array_equal(np.random.get_state()[1], before)  # noqa: NPY002
