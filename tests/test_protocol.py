import contextlib
import json
import signal
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scripts import run_script
from toy_env import LENGTH, optimal_return

from cleanrl_style import protocol
from cleanrl_style.protocol import evaluation, run_folder
from cleanrl_style.protocol.progress import Progress

EVALUATION_COLUMNS = evaluation.evaluation_columns(("carbon", "thaw"))


@dataclass
class Arguments:
    """The arguments that every script has."""

    seed: int = 1
    env_id: str | None = "toy_env:toy-v0"
    mode: str | None = None
    site_seed: int | None = None
    thaw_formulation: str | None = None
    eval_episodes: int = 3
    eval_weights: tuple = (0.0, 0.5, 1.0)
    run_dir: str | None = None
    overwrite: bool = False
    colour: str = field(default="red")


def evaluate(policy, **changes):
    args = Arguments(**changes)
    task = protocol.make_task(args)
    return protocol.evaluate(task, policy, args.eval_weights, args.eval_episodes)


def optimal(observations, masks, accrued_returns):
    """The toy's best policy: plants wherever it may, with the best mix for the preference."""
    mixes = np.linspace(0, 1, 5)
    weights = observations[:, :1]
    mix = (weights * mixes + (1 - weights) * (1 - mixes**2)).argmax(axis=1)
    return np.eye(25)[np.where(masks[:, 15], 15, 0) + mix]


def uniform(observations, masks, accrued_returns):
    return masks / masks.sum(axis=1, keepdims=True)


# --------------------------------------------------------------------------------------------- evaluation


def test_the_optimal_policy_earns_the_optimum():
    episodes, years = evaluate(optimal)
    assert years is None
    assert tuple(episodes.columns) == EVALUATION_COLUMNS
    assert len(episodes) == 2 * 3 * 3
    np.testing.assert_allclose(episodes.scalarized_return, episodes.preference.map(optimal_return), rtol=1e-6)
    np.testing.assert_allclose(
        episodes.scalarized_return,
        episodes.preference * episodes.carbon_return + (1 - episodes.preference) * episodes.thaw_return,
    )


def test_results_do_not_depend_on_the_chunks(monkeypatch):
    whole, _ = evaluate(uniform)
    monkeypatch.setattr(evaluation, "CHUNK", 4)
    pd.testing.assert_frame_equal(whole, evaluate(uniform)[0])


@pytest.mark.parametrize("number", [1, 2, 128, 129, 130, 2000, 4200])
def test_chunks_are_of_one_size(number):
    chunks = evaluation.chunks(number)
    assert [k for chunk in chunks for k in chunk] == list(range(number))
    sizes = [len(chunk) for chunk in chunks]
    assert max(sizes) <= evaluation.CHUNK and min(sizes) > 0.7 * max(sizes)


def test_a_sampled_policy_is_reproducible_and_not_greedy():
    episodes, _ = evaluate(uniform)
    pd.testing.assert_frame_equal(episodes, evaluate(uniform)[0])
    by_policy = [rows.carbon_return.to_numpy() for _, rows in episodes.groupby("policy")]
    assert not np.array_equal(*by_policy)


def test_every_weight_has_the_same_episodes():
    # a policy blind to the preference does the same in them, with the same draws
    episodes, _ = evaluate(uniform)
    sampled = episodes[episodes.policy == "sampled"]
    table = sampled.pivot(index="seed", columns="preference", values="carbon_return")
    assert (table.nunique(axis=1) == 1).all() and table[0.0].nunique() == 3
    assert sampled.seed.min() >= protocol.FIRST_EVALUATION_SEED


def test_the_policy_sees_the_accrued_returns():
    seen = []

    def policy(observations, masks, accrued_returns):
        seen.append(accrued_returns.copy())
        return optimal(observations, masks, accrued_returns)

    episodes, _ = evaluate(policy, eval_weights=(1.0,), eval_episodes=2)
    assert len(seen) == LENGTH  # both policies side by side
    for step, accrued in enumerate(seen):
        np.testing.assert_allclose(accrued, [[step, 0]] * 4)


def test_sampling_follows_the_probabilities():
    probabilities = np.tile([0.0, 0.25, 0.0, 0.75, 0.0], (10_000, 1))
    actions = evaluation.choose_actions(probabilities, np.random.default_rng(0).random(10_000))
    assert set(actions) == {1, 3}
    assert (actions == 3).mean() == pytest.approx(0.75, abs=0.02)
    extremes = evaluation.choose_actions(probabilities[:2], np.array([0.0, np.nextafter(1, 0)]))
    assert extremes.tolist() == [1, 3]
    assert evaluation.choose_actions(probabilities[:1], None).tolist() == [3]


@pytest.mark.parametrize(
    "given, message",
    [
        (lambda masks: np.ones((len(masks), 3)) / 3, r"shape \(18, 25\) is allowed, got \(18, 3\)"),
        (lambda masks: np.zeros(len(masks)), r"shape \(18, 25\) is allowed, got \(18,\)"),
        (lambda masks: np.ones(masks.shape), r"sums of 1 are allowed, got 1 and 25"),
        (
            lambda masks: np.eye(25)[[0] * len(masks)] * 2 - np.eye(25)[[1] * len(masks)],
            r"none below 0 .* got -1 and 1",
        ),
    ],
)
def test_what_is_no_distribution_of_actions_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        evaluate(lambda observations, masks, accrued_returns: given(masks))


def spoiling(observations, masks, accrued_returns):
    """A policy, as a list, that spoils what it is given."""
    accrued_returns += 100.0
    return (masks / masks.sum(axis=1, keepdims=True)).tolist()


def test_a_policy_that_changes_what_it_is_given_changes_no_return():
    task = protocol.Task.of("boreal-balanced-v0", years=1)
    evaluation, _ = protocol.evaluate(task, spoiling, [0.5], 1, policies=("greedy",))
    assert evaluation[["carbon_return", "thaw_return"]].abs().to_numpy().max() <= 1.0


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"policies": "greedy"}, "policies 'greedy': a list or tuple of greedy, sampled is allowed"),
        ({"policies": ("best",)}, r"policies \('best',\): a list or tuple of greedy, sampled is allowed"),
        ({"policies": ()}, "policies"),
        ({"weights": 0.5}, "weights 0.5: a list of at least one is allowed"),
        ({"weights": []}, "weights"),
        ({"weights": [0.5, 0.5]}, "each is allowed once"),
        ({"episodes": 1.5}, "1.5 episodes: a whole number, 1 or more, is allowed"),
        ({"episodes": True}, "True episodes: a whole number"),
        ({"task": "boreal-balanced-v0"}, r"task 'boreal-balanced-v0': protocol.Task.of\(env_id\) gives one"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(changes, message):
    asked = {"task": protocol.Task.of("boreal-balanced-v0"), "policy": uniform, "weights": [0.5], "episodes": 1}
    with pytest.raises(ValueError, match=message):
        protocol.evaluate(**asked | changes)


@pytest.mark.parametrize("uniforms", [None, np.array([0.5])])
def test_a_diverged_policy_is_refused(uniforms):
    with pytest.raises(FloatingPointError, match="diverged"):
        evaluation.choose_actions(np.full((1, 25), np.nan), uniforms)


def test_statistics_of_the_annual_record():
    records = [
        {"year": np.array([1, 2]), "density": np.array([1.0, 2.0]) * k, "fraction": np.full(2, k)} for k in range(5)
    ]
    table = evaluation.summarize_years({"policy": "greedy", "preference": 0.5}, records).set_index(["variable", "year"])
    assert len(table) == 4
    row = table.loc[("density", 2)]
    assert (row["mean"], row.p50, row.p10, row.p90) == (4.0, 4.0, 0.8, 7.2)
    assert row.sd == pytest.approx(np.std([0, 2, 4, 6, 8]))
    assert table.loc[("fraction", 1), "mean"] == 2


def test_boreal_environments_are_evaluated_on_the_same_sites_with_their_annual_record():
    def zero_change(observations, masks, accrued_returns):
        return np.eye(25)[np.full(len(observations), 12)]

    episodes, years = evaluate(zero_change, env_id="boreal-generalist-v0", eval_episodes=2, eval_weights=(0.0, 1.0))
    paired = episodes.groupby("seed")[["site_seed", "carbon_return", "thaw_return"]]
    assert paired.nunique().eq(1).all(axis=None)
    assert episodes.site_seed.nunique() == 2
    assert episodes[list(evaluation.EVALUATION_INFO)].gt(0).all(axis=None)
    one_policy = years[(years.policy == "greedy") & (years.preference == 1)]
    density = one_policy[one_policy.variable == "density_stems_ha"]
    assert density.year.tolist() == list(range(1, 51))
    assert (density.p10 <= density["mean"]).all() and (density["mean"] <= density.p90).all()


def test_a_greedy_policy_in_site_specific_mode_is_evaluated_once():
    episodes, _ = evaluate(uniform, env_id="boreal-site-specific-v0", eval_episodes=2, eval_weights=(0.0,))
    assert episodes.policy.value_counts().to_dict() == {"sampled": 2, "greedy": 1}


def test_other_thaw_formulations_are_also_judged_by_the_asymmetric_one():
    def plus_100(observations, masks, accrued_returns):
        return np.eye(25)[np.full(len(observations), 22)]

    given = dict(env_id="boreal-generalist-v0", eval_episodes=1, eval_weights=(0.5,))
    own, _ = evaluate(plus_100, **given)
    other, _ = evaluate(plus_100, thaw_formulation="contrast", **given)
    assert tuple(own.columns) == EVALUATION_COLUMNS
    assert tuple(other.columns) == (*EVALUATION_COLUMNS, evaluation.ASYMMETRIC)
    np.testing.assert_allclose(other.asymmetric_thaw_return, own.thaw_return, rtol=1e-6)
    assert not np.allclose(other.thaw_return, own.thaw_return)


def test_the_asymmetric_return_of_a_record_by_hand():
    """Years of -2.5 x 8 / 40, of 20 / 40, and two beyond what a year can earn or lose."""
    record = {
        "boundary_cooling_mj_m2": np.array([0.0, 20.0, 0.0, 500.0]),
        "boundary_warming_mj_m2": np.array([8.0, 0.0, 400.0, 0.0]),
    }
    assert evaluation.asymmetric_thaw_return(record) == pytest.approx(-0.5 + 0.5 - 1.0 + 1.0)
    without_the_last = {name: values[:3] for name, values in record.items()}
    assert evaluation.asymmetric_thaw_return(without_the_last) == pytest.approx(-1.0)


# --------------------------------------------------------------------------------------------- run folder


def make_run(folder, overwrite=False, **changes):
    args = Arguments(run_dir=str(folder), overwrite=overwrite, **changes)
    return protocol.Run(args, protocol.make_task(args), "script", episodes=("step", "value"))


def test_rows_are_on_disk_at_once(tmp_path):
    run = make_run(tmp_path / "run")
    run.log("episodes", {"step": np.int64(1), "value": 1 / 3})
    run.log("episodes", {"step": 2})
    assert (tmp_path / "run" / "episodes.csv").read_text() == "step,value\n1,0.333333333\n2,\n"
    with pytest.raises(ValueError):
        run.log("episodes", {"steps": 3})


def test_replacing_keeps_the_old_file_if_writing_fails(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError), protocol.replacing(path) as file:
        file.write(b"half")
        raise RuntimeError
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]
    with protocol.replacing(path) as file:
        file.write(b"new")
    assert path.read_bytes() == b"new" and list(tmp_path.iterdir()) == [path]


def test_other_arguments_are_refused_and_named(tmp_path):
    make_run(tmp_path, colour="red")
    before = (tmp_path / "config.json").read_bytes()
    with pytest.raises(
        SystemExit,
        match="colour red there, blue now; eval_episodes 3 there, 4 now|"
        "eval_episodes 3 there, 4 now; colour red there, blue now",
    ):
        make_run(tmp_path, colour="blue", eval_episodes=4)
    assert (tmp_path / "config.json").read_bytes() == before


def test_a_run_without_a_checkpoint_starts_again_and_keeps_its_times(tmp_path):
    run = make_run(tmp_path)
    run.log("episodes", {"step": 1, "value": 1.0})
    run.time("rollout", 1, 2.5)
    with (tmp_path / "timing.csv").open("a") as file:
        file.write("rollout,2,0")  # what a full disk may leave of a row
    again = make_run(tmp_path)
    assert again.checkpoint is None
    assert (tmp_path / "episodes.csv").read_text() == "step,value\n"
    again.time("rollout", 1, 3.5)
    timing = pd.read_csv(tmp_path / "timing.csv")
    assert timing.seconds.tolist() == [2.5, 3.5] and timing.elapsed_seconds.is_monotonic_increasing


def test_overwrite_starts_over(tmp_path):
    make_run(tmp_path).time("rollout", 1, 2.5)
    (tmp_path / "checkpoint.pt").write_bytes(b"of another run")
    make_run(tmp_path, overwrite=True, colour="blue")
    assert json.loads((tmp_path / "config.json").read_text())["arguments"]["colour"] == "blue"
    assert {path.name for path in tmp_path.iterdir()} == {"config.json", "episodes.csv", "timing.csv"}
    assert len(pd.read_csv(tmp_path / "timing.csv")) == 0


def test_foreign_folders_are_never_touched(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    for overwrite in (False, True):
        with pytest.raises(SystemExit, match="no config.json"):
            make_run(tmp_path, overwrite=overwrite)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_another_programs_folder_is_never_overwritten(tmp_path):
    (tmp_path / "config.json").write_text('{"model_type": "bert"}')
    (tmp_path / "checkpoint.pt").write_text("precious")
    with pytest.raises(SystemExit, match="not a run's folder"):
        make_run(tmp_path, overwrite=True)
    assert (tmp_path / "checkpoint.pt").read_text() == "precious"


def test_a_damaged_configuration_is_named(tmp_path):
    (tmp_path / "config.json").write_text("{")
    with pytest.raises(SystemExit, match="config.json is damaged"):
        make_run(tmp_path)


def test_unwritable_folders_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit, match="cannot write there"):
        make_run(tmp_path / "file" / "run")


def test_folder_names_say_what_is_not_default(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for changes, name in [
        ({}, "toy-v0"),
        ({"colour": "blue"}, "toy-v0-colour=blue"),
        ({"eval_weights": (0.0, 0.25)}, "toy-v0-eval_weights=0,0.25"),
    ]:
        args = Arguments(**changes)
        assert str(protocol.Run(args, protocol.make_task(args), "script").folder) == f"runs/script/{name}/seed1"


def test_a_name_is_one_folder_whatever_a_flag_of_ones_own_holds(tmp_path):
    changed = {"teacher": "../../runs/x/policy.pt", "layers": ("wide", "deep"), "file": Path("a/b")}
    name = run_folder.folder_name("toy-v0", changed)
    assert name == "toy-v0-teacher=..-..-runs-x-policy.pt-layers=wide,deep-file=a-b"


def test_a_name_too_long_for_a_folder_ends_in_its_hash():
    first, second = (run_folder.folder_name("toy-v0", {"eval_weights": tuple(np.arange(n) / 100)}) for n in (100, 101))
    assert first != second and first.startswith("toy-v0-eval_weights=0,0.01,")
    assert {len(first), len(second)} == {run_folder.LONGEST_NAME}


def test_progress_is_shown_at_once_and_at_the_end(capsys):
    progress = Progress("training", 1000, "steps", objectives=("carbon", "thaw"))
    for done in range(1, 1001):
        progress.returns.append((1.0, -2.0))
        progress.show(done)
    first, *_, last = capsys.readouterr().out.splitlines()
    assert first.startswith("training 1/1,000 steps") and last.startswith("training 1,000/1,000 steps")
    assert "carbon +1.00, thaw -2.00" in last


def test_summary_of_a_run_is_a_picture_and_a_table(tmp_path, capsys):
    run_script(
        "cleanrl_style/ppo_curriculum.py",
        "--env-id",
        "toy_env:toy-v0",
        "--run-dir",
        tmp_path,
        "--total-timesteps",
        80,
        "--num-envs",
        2,
        "--eval-episodes",
        1,
        "--eval-weights",
        0,
        0.5,
    )
    assert (tmp_path / "summary.png").read_bytes().startswith(b"\x89PNG")
    lines = capsys.readouterr().out.splitlines()
    table = lines[next(i for i, line in enumerate(lines) if line.startswith("weight")) :]
    assert [line.split()[0] for line in table[1:4]] == ["0.00", "0.50", "mean"]
    assert {len(line.split()) for line in table[:4]} == {7}


@pytest.mark.parametrize("script", ["ppo_gated", "eupg_var_lambda"])
def test_an_environment_need_not_mind_its_types(tmp_path, script):
    rollout = ("--rollout-steps", 20) if script == "ppo_gated" else ()
    run_script(
        f"cleanrl_style/{script}.py",
        "--env-id",
        "toy_env:loose-toy-v0",
        "--run-dir",
        tmp_path,
        "--num-envs",
        2,
        "--total-timesteps",
        40,
        "--eval-episodes",
        2,
        "--eval-weights",
        0,
        1,
        *rollout,
    )
    assert len(pd.read_csv(tmp_path / "evaluation.csv")) == 8


def test_an_environment_without_a_valid_action_is_refused(tmp_path):
    with pytest.raises(SystemExit, match="hopeless-toy-v0: .* at least one of them true"):
        run_script("cleanrl_style/ppo_gated.py", "--env-id", "toy_env:hopeless-toy-v0", "--run-dir", tmp_path)
    assert not list(tmp_path.iterdir())


def test_an_interrupt_that_a_library_swallowed_comes_again():
    run = SimpleNamespace(stopped=False)
    with contextlib.suppress(KeyboardInterrupt):
        protocol.Run._stop(run, signal.SIGTERM, None)
    with pytest.raises(KeyboardInterrupt):
        protocol.Run.time(run, "update", 0, 0.0)


def test_each_episode_has_its_own_dice(monkeypatch):
    seen, choose = [], evaluation.choose_actions

    def spy(probabilities, uniforms):
        if uniforms is not None:
            seen.append(uniforms)
        return choose(probabilities, uniforms)

    monkeypatch.setattr(evaluation, "choose_actions", spy)
    evaluate(uniform, eval_weights=(1.0,), eval_episodes=2)
    assert len(set(seen[0])) == 2


def test_probabilities_that_are_nearly_one_in_sum_are_refused():
    with pytest.raises(ValueError, match="sums of 1"):
        evaluation.check_probabilities(np.full((1, 25), 1.05 / 25), (1, 25))


class OfUnequalLength:
    """Two stands, whose episodes end after one year and after three; each year pays 1 of both."""

    year = 0

    def reset(self, seed, options):
        return np.zeros((2, 3)), {}

    def step(self, actions):
        self.year += 1
        return np.zeros((2, 3)), np.ones((2, 2)), np.array([True, self.year == 3]), np.zeros(2, bool), {}


def test_what_comes_after_an_episode_s_end_is_not_counted():
    task = SimpleNamespace(num_objectives=2, action_masks=lambda envs, observations: np.ones((2, 25), bool))
    weights, greedy = np.full((2, 2), 0.5), np.ones(2, bool)
    returns, _ = evaluation.play(task, OfUnequalLength(), lambda *_: np.eye(25)[[12, 12]], weights, [1, 2], greedy)
    assert returns.tolist() == [[1, 1], [3, 3]]
