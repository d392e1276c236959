"""What an environment can do is asked of it, not looked up by its id."""

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from scripts import run_script
from toy_env import ToyEnv, ToyVectorEnv

import boreal_env
from cleanrl_style import ppo_gated, protocol
from cleanrl_style.protocol import task as asked
from cleanrl_style.protocol import training_envs
from sim.block import lanes_for
from sim.stands import available_cores
from sim.task.shifts import SHIFTS

gym.register("short-v0", entry_point="boreal_env:BorealEnv", kwargs={"years": 3})
gym.register("own-masks-v0", entry_point="boreal_env:BorealEnv", kwargs={"harvest_min_class": "old", "years": 3})
gym.register("blind-v0", entry_point="boreal_env:BorealEnv", kwargs={"observation_groups": ("preference", "climate")})
gym.register("contrast-v0", entry_point="boreal_env:BorealEnv", kwargs={"thaw_formulation": "contrast", "years": 3})


def test_a_time_limit_has_no_state_to_go_on_from():
    """It counts the steps of an episode beside the environment: a run that was stopped starts over."""
    limited, free = (gym.make("short-v0", max_episode_steps=steps) for steps in (2, None))
    blocks = training_envs.split_among_workers(1, 1)
    states = [training_envs.InWorker(env, 0, blocks[0]).get_state() for env in (limited, free)]
    assert states[0] is None and states[1] is not None


class WithLuck(gym.ObservationWrapper):
    """An entry more, behind the preference."""

    def __init__(self, env):
        super().__init__(env)
        low, high = (np.insert(bound, 1, bound[1]) for bound in (env.observation_space.low, env.observation_space.high))
        self.observation_space = gym.spaces.Box(low, high, dtype=np.float32)

    def observation(self, observation):
        return np.insert(observation, 1, 0.5).astype(np.float32)


def test_names_of_entries_that_a_wrapper_moved_are_not_believed(tmp_path):
    gym.register("lucky-v0", entry_point=lambda **kwargs: WithLuck(boreal_env.BorealEnv(**kwargs)))
    assert not protocol.Task.of("lucky-v0").site_entries
    pytest.importorskip("pymoo")
    given = ("--env-id", "lucky-v0", "--vectorization", "async", "--run-dir", tmp_path / "run")
    with pytest.raises(SystemExit, match="--env-id lucky-v0: candidates look at entries by name"):
        run_script("cleanrl_style/moea.py", *given)


def test_returns_that_are_not_finite_are_no_row():
    task = protocol.Task("sites-v0", {}, ("carbon", "thaw"))
    with pytest.raises(FloatingPointError, match="sites-v0: an episode's returns are .*nan"):
        task.returns_row(np.array([0.5, 0.5]), np.array([1.0, np.nan]))


def test_sites_of_another_kind_are_not_centred_by_ours():
    task = protocol.Task("sites-v0", {}, ("carbon", "thaw"), site_entries=(43, 44, 45))
    with pytest.raises(SystemExit, match="it observes 3 site parameters, ours 62.*--raw-selector"):
        task.sample_sites(range(3))


def test_what_an_id_was_registered_with_stays():
    """Under --hide-site the groups of its observation, out of the sampled range its own parameters."""
    groups, own = ("preference", "state", "age", "site"), {"latitude_deg": 58.0}
    kwargs = {"observation_groups": groups, "parameter_overrides": own}
    gym.register("narrow-v0", "boreal_env:BorealEnv", kwargs=kwargs)
    args = ppo_gated.Args(env_id="narrow-v0")
    assert protocol.make_task(args, hide_site=True).env_kwargs["observation_groups"] == groups[:-1]
    calmer = protocol.Task.of("narrow-v0").shifted("calmer").env_kwargs["parameter_overrides"]
    assert calmer == {**own, **SHIFTS["calmer"]}


def test_ids_of_the_benchmark():
    task = protocol.Task.of("boreal-generalist-v0")
    assert (task.boreal, task.has_lockstep, task.mode, task.years) == (True, True, "generalist", 50)
    assert task.objectives == ("carbon", "thaw")
    assert task.site_entries == tuple(range(43, 105))
    site_specific = protocol.Task.of("boreal-site-specific-v0")
    assert (site_specific.mode, site_specific.site_entries) == ("site-specific", ())


def test_an_environment_of_ours_under_another_id_loses_nothing(tmp_path, monkeypatch):
    """Annual record, compilation before workers, hidden site, lockstep with a preference: all without the id's help."""
    compiled = []
    monkeypatch.setattr(training_envs, "compile_physics", lambda lanes, later=(): compiled.append((lanes, later)))
    run_script(
        "cleanrl_style/eupg_fixed_lambda.py",
        *("--env-id", "short-v0", "--hide-site", "--vectorization", "lockstep", "--preference", 0.25),
        *("--num-envs", 2, "--total-timesteps", 12, "--eval-episodes", 2, "--run-dir", tmp_path),
    )
    training, evaluation = (lanes_for(stands, available_cores()) for stands in (2, 4))  # 4: under both policies
    assert compiled == [([training], {evaluation})]
    years = pd.read_csv(tmp_path / "evaluation_years.csv")
    assert years.year.max() == 3 and "biomass_kgc_m2" in set(years.variable)
    episodes = pd.read_csv(tmp_path / "episodes.csv")
    assert len(episodes) == 4 and (episodes.preference == 0.25).all() and episodes.final_density.notna().all()


def test_its_length_is_asked():
    with pytest.raises(SystemExit, match="an episode of each environment: 6 steps"):
        run_script("cleanrl_style/eupg_var_lambda.py", "--env-id", "short-v0", "--num-envs", 2, "--total-timesteps", 4)


def test_its_own_thaw_formulation_stays():
    task = protocol.Task.of("contrast-v0")
    assert task.thaw_formulation == "contrast"
    with pytest.raises(SystemExit, match="contradicts --env-id contrast-v0, which is generalist"):
        run_script("cleanrl_style/ppo_gated.py", "--env-id", "contrast-v0", "--mode", "site-specific")


@pytest.mark.parametrize("env_id", ["short-v0", "own-masks-v0", "blind-v0", "toy-v0"])
def test_masks_are_the_environments_own(env_id):
    task = protocol.Task.of(env_id)
    assert (task.masks is None) == (env_id in ("blind-v0", "toy-v0"))
    envs = gym.vector.SyncVectorEnv([task.make, task.make])
    observations, _ = envs.reset(seed=3)
    expected = np.stack([env.unwrapped.action_masks() for env in envs.envs])
    np.testing.assert_array_equal(task.action_masks(envs, observations), expected)


def test_an_observation_without_the_preference_is_for_a_fixed_one_alone(tmp_path):
    gym.register("no-preference-v0", entry_point="boreal_env:BorealEnv", kwargs={"observation_groups": ("state",)})
    assert not protocol.Task.of("no-preference-v0").observes_preference
    with pytest.raises(SystemExit, match="its observation lacks the preference"):
        run_script("cleanrl_style/ppo_gated.py", "--env-id", "no-preference-v0", "--run-dir", tmp_path / "run")


class OfThree(gym.Wrapper):
    """Another number of objectives than what it wraps."""

    reward_dim, objective_names = 3, ("x", "y", "z")


def test_a_wrappers_own_objectives_count():
    assert asked._check_spaces(OfThree(gym.make("boreal-generalist-v0"))) == ("x", "y", "z")


def test_objectives_have_names():
    assert protocol.Task.of("toy_env:toy-three-v0").objectives == ("carbon", "thaw", "variety")

    class Unnamed(ToyEnv):
        pass

    gym.register("unnamed-v0", entry_point=Unnamed)
    assert protocol.Task.of("unnamed-v0").objectives == ("carbon", "thaw")


def test_rows_of_two_and_of_three_objectives():
    two = protocol.Task.of("toy_env:toy-v0").returns_row(np.array([0.25, 0.75]), np.array([4.0, 8.0]))
    assert two == {"preference": 0.25, "carbon_return": 4, "thaw_return": 8, "scalarized_return": 7}
    three = protocol.Task.of("toy_env:toy-three-v0").returns_row(np.array([0.25, 0.25, 0.5]), np.array([4.0, 8.0, 2.0]))
    assert list(three) == [
        *("weight_carbon", "weight_thaw", "weight_variety"),
        *("carbon_return", "thaw_return", "variety_return", "scalarized_return"),
    ]
    assert three["scalarized_return"] == 4


def test_a_subclass_without_a_vector_form_is_evaluated_in_a_plain_loop():
    class Mine(boreal_env.BorealEnv):
        pass

    gym.register("mine-v0", entry_point=Mine, kwargs={"years": 2})
    task = protocol.Task.of("mine-v0")
    assert task.boreal and not task.has_lockstep
    episodes, _ = protocol.evaluate(task, lambda o, m, r: np.eye(25)[np.full(len(o), 12)], [0.5], 1, ("greedy",))
    assert np.isfinite(episodes.scalarized_return).all()


class Doubled(gym.ObservationWrapper):
    """Observes twice the density, as if it had been normalised otherwise."""

    def observation(self, observation):
        observation = observation.copy()
        observation[1:] *= 2.0
        return observation


def doubled(**kwargs):
    return Doubled(boreal_env.BorealEnv(**kwargs))


gym.register("doubled-v0", entry_point=doubled, kwargs={"years": 3})


def test_a_wrapped_environment_of_ours_is_asked_for_its_masks():
    task = protocol.Task.of("doubled-v0")
    assert task.boreal and not task.bare and task.masks is None
    assert training_envs.InWorker(task.make(), 0, range(1)).get_state() is None  # a wrapper may have a state


class NextStepEnvs(ToyVectorEnv):
    metadata = {**ToyVectorEnv.metadata, "autoreset_mode": gym.vector.AutoresetMode.NEXT_STEP}


class DeafEnvs(ToyVectorEnv):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed)


class SummedEnvs(ToyVectorEnv):
    def step(self, actions):
        observations, rewards, *rest = super().step(actions)
        return observations, rewards.sum(axis=1), *rest


@pytest.mark.parametrize(
    "envs, what",
    [
        (NextStepEnvs, "SAME_STEP"),
        (DeafEnvs, "each its own of reset"),
        (SummedEnvs, r"rewards of shape \(2, 2\), not \["),
    ],
)
def test_a_vector_environment_that_is_otherwise_than_ours_is_refused(envs, what):
    gym.register("otherwise-v0", entry_point=ToyEnv, vector_entry_point=envs)
    try:
        with pytest.raises(ValueError, match=f"its vector environment must .*{what}"):
            protocol.Task.of("otherwise-v0")
    finally:
        gym.registry.pop("otherwise-v0")


class Halved(boreal_env.BorealEnv):
    def step(self, action):
        observation, reward, *rest = super().step(action)
        return observation, reward / 2, *rest


@pytest.mark.parametrize(
    "envs, what",
    [
        (
            {"entry_point": lambda: Doubled(boreal_env.BorealEnv(years=2))},
            "hand its arguments on to BorealEnv: .*'record_years'",
        ),
        (
            {"entry_point": Halved, "vector_entry_point": boreal_env.BorealVectorEnv, "kwargs": {"years": 2}},
            r"its vector environment pays \[.*\] for what the single one pays \[",
        ),
    ],
)
def test_what_an_evaluation_would_play_otherwise_is_refused_before_a_training(envs, what):
    gym.register("otherwise-v0", **envs)
    try:
        with pytest.raises(ValueError, match=what):
            protocol.Task.of("otherwise-v0")
    finally:
        gym.registry.pop("otherwise-v0")


def test_a_subclass_of_ours_has_no_lockstep_that_would_ignore_it():
    with pytest.raises(TypeError, match="Halved: lockstep is of BorealEnv itself"):
        Halved(years=2).lockstep(2)


@pytest.mark.parametrize("reward, shown", [(1.0, "1.0"), (np.ones(3), r"\[1.0, 1.0, 1.0\]")])
def test_a_reward_of_another_number_is_refused_before_a_file_is_written(reward, shown, tmp_path):
    class Paying(ToyEnv):
        def step(self, action):
            observation, _, *rest = super().step(action)
            return observation, reward, *rest

    gym.register("paying-v0", entry_point=Paying)
    try:
        with pytest.raises(SystemExit, match=rf"paying-v0: step must give rewards of shape \(2,\), not {shown}$"):
            run_script("cleanrl_style/ppo_gated.py", "--env-id", "paying-v0", "--run-dir", tmp_path / "run")
    finally:
        gym.registry.pop("paying-v0")
    assert not list(tmp_path.iterdir())
