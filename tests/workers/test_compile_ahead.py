"""A process that compiles beside this one: it is only a help."""

import pytest

from bridgegen.engine.workers import compile_ahead
from bridgegen.engine.workers.compile_ahead import compiled_ahead
from bridgegen.engine.workers.recipe import Recipe


def touch(path: str) -> None:
    with open(path, "w") as file:
        file.write("done")


class Beside:
    """Stands for the process: it follows the recipe at once."""

    begun = ended = 0

    def __init__(self, said, errors) -> None:
        Beside.begun += 1

    def call(self, function, recipe) -> None:
        function(recipe)

    def end(self) -> None:
        Beside.ended += 1


@pytest.fixture
def beside(monkeypatch):
    monkeypatch.setattr(compile_ahead, "Process", Beside)
    monkeypatch.setattr(compile_ahead, "is_compiled", lambda: False)
    monkeypatch.setattr(compile_ahead.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(compile_ahead.numba.config, "DISABLE_JIT", 0)
    Beside.begun = Beside.ended = 0
    return monkeypatch


def test_it_follows_the_recipe_and_ends_with_the_block(beside, tmp_path):
    with compiled_ahead(Recipe.of(touch, str(tmp_path / "a"))) as is_shared:
        assert is_shared
        assert (tmp_path / "a").read_text() == "done"
        assert Beside.ended == 0
    assert (Beside.begun, Beside.ended) == (1, 1)


@pytest.mark.parametrize("why", ["compiled", "one core", "no JIT"])
def test_there_is_none_where_it_would_not_help(beside, tmp_path, why):
    if why == "compiled":
        beside.setattr(compile_ahead, "is_compiled", lambda: True)
    elif why == "one core":
        beside.setattr(compile_ahead.os, "cpu_count", lambda: 1)
    else:
        beside.setattr(compile_ahead.numba.config, "DISABLE_JIT", 1)
    with compiled_ahead(Recipe.of(touch, str(tmp_path / "a"))) as is_shared:
        assert not is_shared
    assert Beside.begun == 0


def test_where_no_process_can_begin_this_one_goes_on_alone(beside, tmp_path):
    def refuse(*_, **__):
        raise OSError("no more processes")

    beside.setattr(compile_ahead, "Process", refuse)
    with compiled_ahead(Recipe.of(touch, str(tmp_path / "a"))) as is_shared:
        assert not is_shared


def test_a_pipeline_s_recipe_compiles_in_another_process_what_is_needed_later(tmp_path):
    """The real thing, with kernels that are compiled: it ends without an error."""
    from bridgegen.engine.options import PipelineOptions
    from bridgegen.engine.pipeline import Pipeline, _compile_ahead
    from bridgegen.scenario.language.reader import load

    scenario = load("crossroads-s4")
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="reference", causes=True))
    pipeline._recipe_of(_compile_ahead).make()
