import importlib.util
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as gymnasium_check
from gymnasium.vector import AutoresetMode
from tests.approval import refuses

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.search.algorithms.environment import ScenarioEnv, ScenarioVectorEnv
from bridgegen.search.algorithms.observation import ENCODINGS


@pytest.fixture(scope="module")
def pipeline():
    scenario = load("crossroads-s2")
    made = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    made.choose_objective()
    return made


@pytest.mark.parametrize("action", ENCODINGS)
def test_gymnasium_has_nothing_to_say(action, pipeline):
    environment = ScenarioEnv(pipeline, action=action, horizon=3)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        gymnasium_check(environment)
    # Not registered, so that there is no spec to make another one from.
    assert all("spec" in str(one.message) for one in said), [str(one.message) for one in said]


def test_a_step_is_a_row_and_its_results(pipeline):
    environment = ScenarioEnv(pipeline, step=0.1, horizon=2)
    here = np.full(10, 0.95)
    first, info = environment.reset(seed=1, options={"row": here})
    np.testing.assert_allclose(first[:10], 0.9, rtol=1e-6)
    assert info["row"].tolist() == here.tolist()
    observation, reward, terminated, truncated, info = environment.step(np.ones(10, np.float32))
    np.testing.assert_allclose(info["row"], 0.95)  # 1.05, reflected
    result = pipeline.evaluate(pipeline.space.decode(info["row"][np.newaxis]))
    assert reward == -result.F[0, 0]
    assert info["metrics"].tobytes() == result.metrics[0].tobytes()
    assert info["critical"] == result.critical[0]
    assert (terminated, truncated) == (False, False)
    assert environment.observation_space.contains(observation)
    assert environment.step(np.zeros(10, np.float32))[2:4] == (False, True)


def test_a_row_as_an_action(pipeline):
    environment = ScenarioEnv(pipeline, action="row")
    environment.reset(seed=0)
    info = environment.step(np.linspace(-1.0, 1.0, 10).astype(np.float32))[4]
    np.testing.assert_allclose(info["row"], np.linspace(0.0, 1.0, 10), atol=1e-7)


def test_it_ends_at_harm_only_if_it_is_to(pipeline):
    rng = np.random.default_rng(0)
    U = rng.random((400, 10))
    critical = U[pipeline.evaluate(pipeline.space.decode(U)).critical][0]
    stay = np.zeros(10, np.float32)
    for until, ends in ((False, False), (True, True)):
        environment = ScenarioEnv(pipeline, until_critical=until, horizon=1)
        environment.reset(options={"row": critical})
        _, _, terminated, truncated, info = environment.step(stay)
        assert info["critical"]
        assert (terminated, truncated) == (ends, not ends)


def test_forty_are_one_batch_and_what_single_ones_would_be(pipeline, monkeypatch):
    batches, evaluate = [], pipeline.evaluate

    def counting(X):
        batches.append(len(X))
        return evaluate(X)

    monkeypatch.setattr(pipeline, "evaluate", counting)
    forty = ScenarioVectorEnv(pipeline, horizon=2)
    assert forty.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    together, _ = forty.reset(seed=7)
    rng = np.random.default_rng(3)
    actions = [rng.uniform(-1, 1, (40, 10)).astype(np.float32) for _ in range(5)]
    seen = [forty.step(one) for one in actions]
    assert batches == [40] * 6
    assert forty.observation_space.contains(seen[0][0])
    assert [one[3].all() for one in seen] == [False, True, False, False, True]
    assert seen[2][1].tolist() == [0.0] * 40  # where they begin anew
    monkeypatch.undo()
    for k in (0, 17, 39):
        alone = ScenarioEnv(pipeline, horizon=2)
        assert alone.reset(seed=7 + k)[0].tobytes() == together[k].tobytes()
        for action, (observations, rewards, _, truncated, infos) in zip(actions, seen, strict=True):
            if infos["row"][k].tobytes() and rewards[k] == 0.0:
                assert alone.reset()[0].tobytes() == observations[k].tobytes()
                continue
            one = alone.step(action[k])
            assert one[0].tobytes() == observations[k].tobytes()
            assert (one[1], one[3]) == (rewards[k], truncated[k])


def test_gymnasiums_wrappers_take_the_forty(pipeline):
    forty = gymnasium.wrappers.vector.RecordEpisodeStatistics(
        ScenarioVectorEnv(pipeline, num_envs=3, horizon=2)
    )
    forty.reset(seed=0)
    stay = np.zeros((3, 10), np.float32)
    forty.step(stay)
    infos = forty.step(stay)[4]
    assert infos["episode"]["l"].tolist() == [2, 2, 2]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"horizon": 0}, "horizon"),
        ({"step": 0.0}, "step"),
        ({"step": float("nan")}, "step"),
        ({"action": "jump"}, "jump"),
        ({"ego": "reference"}, "pipeline"),
    ],
)
def test_wrong_settings_are_named(settings, message, pipeline):
    with refuses(InputError, message):
        ScenarioEnv(pipeline, **settings)


def test_wrong_inputs_are_named(pipeline):
    with refuses(UnknownNameError, "crossroads-s1"):
        ScenarioEnv("crossroads-s11")
    with refuses(InputError, "num_envs"):
        ScenarioVectorEnv(pipeline, 0)
    environment = ScenarioEnv(pipeline)
    with refuses(InputError, "row", "10"):
        environment.reset(options={"row": [2.0] * 10})
    with refuses(InputError):
        environment.reset(options={"rows": 1})
    environment.reset()
    with pytest.raises(ValueError, match="finite numbers"):
        environment.step(np.full(10, np.nan, np.float32))
    with refuses(InputError, "40"):
        ScenarioVectorEnv(pipeline).reset(seed=[1, 2])


def test_stable_baselines_has_nothing_to_say(pipeline):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env

    check_env(ScenarioEnv(pipeline, horizon=3), warn=True)  # warnings are errors here


def test_stable_baselines_learns_in_the_forty(pipeline):
    models = pytest.importorskip("stable_baselines3")
    from bridgegen.search.algorithms.environment_sb3 import ScenarioVecEnv

    environment = ScenarioVecEnv(pipeline, num_envs=8, horizon=2)
    environment.seed(3)
    first = environment.reset()
    again = ScenarioVectorEnv(pipeline, num_envs=8, horizon=2)
    assert again.reset(seed=3)[0].tobytes() == first.tobytes()
    model = models.PPO("MlpPolicy", environment, n_steps=4, batch_size=32, n_epochs=1, device="cpu")
    model.learn(32)
    assert model.num_timesteps == 32
    environment.reset()
    stay = np.zeros((8, 10), np.float32)
    environment.step(stay)
    observations, rewards, dones, infos = environment.step(stay)
    assert dones.all()
    assert all(one["TimeLimit.truncated"] for one in infos)
    ends = np.stack([one["terminal_observation"] for one in infos])
    assert (ends[:, :10] != observations[:, :10]).any(axis=1).all()
    assert np.isfinite(rewards).all()


def test_the_documented_agent_learns(pipeline):
    """In docs/agents.md; its environment is a pipeline here, which is prepared already."""
    path = Path(__file__).parents[2] / "docs" / "examples" / "my_agent.py"
    spec = importlib.util.spec_from_file_location("my_agent", path)
    my_agent = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(my_agent)
    forty = ScenarioVectorEnv(pipeline, action="row", horizon=1000)
    shares = my_agent.cross_entropy(forty, 15)
    assert shares[0] < 0.1  # random sampling has 1.4 %
    assert np.mean(shares[-3:]) > 0.7
