"""Populations of policies and plans: what a candidate is, what the search finds, and the script."""

import json
import sys
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch
from resumed import assert_goes_on_to_the_same_bytes
from scripts import run_script

import boreal_env
from cleanrl_style import moea, protocol
from cleanrl_style.protocol import run_folder

SCRIPT = "cleanrl_style/moea.py"
QUICK = "quick_env:quick-v0"
NAMES = boreal_env.OBSERVATION_NAMES
CONSTANTS = [12, *range(20, 25), *range(15, 20), *range(5, 10), *range(5)]


def agent_of(genes, gains=((0.0, 0.0),), genome="policy", **shape):
    """An agent with these genes and gains, of an environment that observes everything."""
    wanted = ("year",) if genome == "plan" else moea.INPUTS
    shape = {"inputs": [NAMES.index(name) for name in wanted], "num_blocks": 0, "block_years": 10, **shape}
    agent = moea.Agent(None, **shape, num_candidates=len(genes), num_objectives=len(gains[0]))
    agent.genes.copy_(torch.from_numpy(np.asarray(genes, dtype=float)))
    agent.gains.copy_(torch.tensor(gains))
    return agent


def observed(number, **values):
    """Observations (number, entries) of random numbers, but for these entries."""
    table = np.random.default_rng(0).random((number, len(NAMES)))
    for name, value in values.items():
        table[:, NAMES.index(name)] = value
    return table.astype(np.float32)


# -------------------------------------------------------------------------------------------------- a candidate


@pytest.mark.parametrize("genome, blocks", [("policy", 0), ("plan", 5)])
def test_the_first_candidates_are_the_constant_plans(genome, blocks):
    features = blocks or 1 + len(moea.INPUTS)
    first = moea.first_candidates(genome, 30, features, np.random.default_rng(1))
    assert first.shape == (30, 2 * features) and np.abs(first).max() <= 1
    agent = agent_of(first, genome=genome, num_blocks=blocks)
    for year in (0, 17, 49):
        actions = agent.get_action(observed(30, year=year / 50), np.ones((30, 25), bool), np.arange(30))
        # without a change of the density the conifer share says nothing
        assert actions[:21].tolist() == CONSTANTS
    assert moea.first_candidates(genome, 8, features, np.random.default_rng(1)).shape[0] == 8


def test_a_plan_has_an_action_for_each_block_of_years():
    genes = [np.ravel([(1, 1), (1, -1), (0, 0), (-1, 0), (0.5, 0.5)])]
    agent = agent_of(genes, genome="plan", num_blocks=5)
    years = np.arange(50)
    actions = agent.get_action(observed(50, year=years / 50), np.ones((50, 25), bool), np.zeros(50, int))
    assert actions.tolist() == np.repeat([24, 20, 12, 2, 18], 10).tolist()


def test_a_policy_sees_its_inputs_and_nothing_else():
    genes = np.zeros((1, 1 + len(moea.INPUTS), 2))
    genes[0, 1 + moea.INPUTS.index("density"), 0] = -1.0
    agent = agent_of(genes.reshape(1, -1))
    actions = agent.get_action(observed(3, density=[0.0, 0.5, 1.0]), np.ones((3, 25), bool), np.zeros(3, int))
    assert actions.tolist() == [22, 12, 2]


def test_what_cannot_be_done_is_left_undone():
    genes = moea.first_candidates("plan", 2, 5, np.random.default_rng(0))
    masks = np.ones((1, 25), bool)
    masks[:, 15:] = False
    assert agent_of(genes, genome="plan", num_blocks=5).get_action(observed(1), masks, np.array([1])) == [12]


def test_the_candidate_with_most_gain_at_the_weights_acts():
    genes = moea.first_candidates("plan", 21, 5, np.random.default_rng(0))[[0, 1, 5]]
    policy = moea.make_policy(agent_of(genes, ((2.0, 2.0), (3.0, 0.0), (0.0, 2.5)), "plan", num_blocks=5))
    seen = observed(3)
    seen[:, 0] = (0.0, 0.4, 1.0)  # thaw alone: the third; gains 2, 1.2, 1.5: the first; carbon alone: the second
    chosen = policy(seen, np.ones((3, 25), bool), None)
    assert chosen.sum(axis=1).tolist() == [1, 1, 1]
    assert chosen.argmax(axis=1).tolist() == [24, 12, 20]


# ---------------------------------------------------------------------------------------------------- the search


@pytest.mark.parametrize("algorithm", ["nsga2", "moead"])
@pytest.mark.parametrize("genome", ["policy", "plan"])
def test_the_search_comes_near_the_best_and_is_the_same_again(algorithm, genome):
    """Each gene has one best value, another for each objective: none of them that of a constant plan."""
    pytest.importorskip("pymoo")
    targets = np.resize([0.5, -1.0, 1.0], (2, 10)) * [[1], [-1]]
    args = SimpleNamespace(algorithm=algorithm, genome=genome, seed=2)
    first = moea.first_candidates(genome, 24, 5, np.random.default_rng(2))

    def run(generations, told=()):
        search = moea.make_algorithm(args, first, 2)
        for _, gains in told:
            moea.tell(search, search.ask(), gains)
        told = list(told)
        for _ in range(generations - len(told)):
            asked = search.ask()
            genes = asked.get("X").astype(float)
            gains = -((genes[:, None] - targets) ** 2).mean(axis=2)
            moea.tell(search, asked, gains)
            told.append((genes, gains))
        return told

    told = run(30)
    start, end = (np.concatenate([gains for _, gains in part]) for part in (told[:1], told))
    for weights in ((1, 0), (0.5, 0.5), (0, 1)):
        before, after = (part @ weights for part in (start, end))
        best = -(weights[0] * weights[1] * ((targets[0] - targets[1]) ** 2).mean())
        assert best - after.max() < 0.4 * (best - before.max())
    resumed = run(30, told[:7])
    assert all(
        np.array_equal(*genes) for genes in zip(*([one[0] for one in run] for run in (told, resumed)), strict=True)
    )


def test_the_front_has_no_dominated_candidate():
    gains = np.array([(0.0, 3.0), (1.0, 1.0), (1.0, 2.0), (1.0, 2.0), (3.0, 0.0)])
    genes, kept = moea.nondominated(np.arange(5.0)[:, None], gains)
    assert genes.ravel().tolist() == [0, 2, 4] and kept.tolist() == [[0, 3], [1, 2], [3, 0]]


# ---------------------------------------------------------------------------------------------------- the script


def search(folder, *more, env_id=QUICK, vectorization="lockstep"):
    """Three generations of six candidates on two sites each."""
    given = ("--env-id", env_id, "--vectorization", vectorization, "--total-timesteps", 150, "--eval-episodes", 2)
    weights = ("--eval-weights", 0, 1) if env_id == QUICK else ("--eval-weights", 1, 0, 0, 0, 0.5, 0.5)
    run_script(SCRIPT, *given, *weights, "--population", 6, "--episodes-each", 2, "--run-dir", folder, *more)


@pytest.mark.parametrize(
    "env_id, vectorization, more",
    [
        (QUICK, "async", ("--algorithm", "nsga2")),
        ("timber_env:timber-v0", "lockstep", ("--algorithm", "moead", "--genome", "plan", "--block-years", 2)),
    ],
)
def test_a_search_leaves_a_run_and_goes_on_to_the_same_bytes(env_id, vectorization, more, tmp_path, monkeypatch):
    pytest.importorskip("pymoo")
    monkeypatch.setattr(run_folder, "CHECKPOINT_STEPS", 1)
    whole = tmp_path / "whole"
    given = {"env_id": env_id, "vectorization": vectorization}
    assert_goes_on_to_the_same_bytes(lambda folder: search(folder, *more, **given), tmp_path)
    if vectorization == "async":
        search(tmp_path / "lockstep", *more, env_id=env_id)
        for name in ("episodes.csv", "evaluation.csv"):
            assert (whole / name).read_bytes() == (tmp_path / "lockstep" / name).read_bytes(), name

    updates, episodes = pd.read_csv(whole / "updates.csv"), pd.read_csv(whole / "episodes.csv")
    assert updates.global_step.tolist() == [48, 96, 144] and (np.diff(updates.mean_best_gain) >= 0).all()
    # all candidates of all generations have the same two sites
    assert episodes.site_seed.nunique() == 2 and len(episodes) == 36
    config = json.loads((whole / "config.json").read_text())
    task = protocol.Task.of(env_id)
    again, _ = protocol.evaluate(task, protocol.load_policy(whole), config["arguments"]["eval_weights"], 2)
    pd.testing.assert_frame_equal(pd.read_csv(whole / "evaluation.csv"), again, rtol=1e-6, check_dtype=False)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("--population", 3), r"--population must lie in \[4, 1000\], not 3"),
        (("--episodes-each", 0), r"--episodes-each must lie in \[1, 1000\], not 0"),
        (("--population", 600), "--population x --episodes-each = 1200: at most 1000 is allowed"),
        (("--total-timesteps", 47), "--total-timesteps 47: at least 48, a generation"),
        (("--block-years", 7), "--block-years 7 is for --genome plan"),
        (("--genome", "plan", "--block-years", 51), "--block-years 51: at most the episode's"),
        (("--env-id", "toy_env:toy-lockstep-v0"), "candidates know the boreal environments alone"),
    ],
)
def test_what_cannot_be_searched_is_refused(arguments, message, tmp_path):
    with pytest.raises(SystemExit, match=message):
        search(tmp_path / "run", *arguments)
    assert not (tmp_path / "run").exists()


def test_without_pymoo_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymoo", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "pymoo" else name)
    with pytest.raises(SystemExit, match=r"not installed: pymoo; .* pip install -e \"\.\[planners\]\""):
        search(tmp_path / "run")
