import importlib
import json
from collections import Counter
from pathlib import Path

import pytest
from scripts import run_script
from tiny_runs import TINY_RUNS

import boreal_env
from analysis import experiments, methods, reproduce, runs
from cleanrl_style import protocol
from cleanrl_style.ppo_gated import Args

COUNTS = {
    "main": 1 + len(methods.STRATEGIES) + len(experiments.UNMASKED) + 10 * len(methods.LEARNERS),
    "balanced": len(methods.STRATEGIES) + 10 * len(methods.LEARNERS),
    "group": 35,
    "outside": 10 * len(methods.OUTSIDE),
    "planners": 20,
    "bandit": 10,
    "worlds": 15,
    "fixed": 25,
    "site": 45,
    "thaw": 12,
    "controls": 20,
    "variants": 35,
    "mechanisms": 2,
    "difficulty": 2,
    "budgets": 35,
}


def test_experiments():
    jobs = experiments.jobs()
    assert Counter(job.experiment for job in jobs) == COUNTS
    assert [job.experiment for job in jobs] == sorted((job.experiment for job in jobs), key=list(COUNTS).index)
    assert len({job.command for job in jobs}) == len(jobs)
    # heuristics first, then a seed of every method before the next
    trained = [(job.script, job.flags["seed"]) for job in jobs if job.experiment == "main" and job.trains]
    assert trained == [(script, seed) for seed in range(1, 11) for script in methods.LEARNERS]
    assert sum(job.steps for job in jobs if job.experiment == "main") == len(trained) * 300_000
    assert len(experiments.jobs(["fixed", "site"], [2])) == 5 + 9


def test_a_job_knows_its_run():
    job = next(job for job in experiments.jobs(["site"]) if job.flags.get("preference") == 0.25)
    assert job.command == (
        "python cleanrl_style/eupg_fixed_lambda.py --seed 1 --vectorization lockstep "
        "--preference 0.25 --mode site-specific --site-seed 1"
    )
    assert (job.env_id, job.steps) == ("boreal-site-specific-v0", 100_000)
    config = {
        "script": "eupg_fixed_lambda",
        "arguments": {
            "seed": 1,
            "env_id": "boreal-site-specific-v0",
            "vectorization": "lockstep",
            "preference": 0.25,
            "mode": "site-specific",
            "site_seed": 1,
        },
        "not_default": {"vectorization": "lockstep", "preference": 0.25, "site_seed": 1},
    }
    assert job.made(config)
    assert not job.made(config | {"arguments": config["arguments"] | {"seed": 2}})
    assert not job.made(config | {"not_default": {"learning_rate": 0.1}})
    assert not job.made(config | {"script": "ppo_gated"})


def test_a_variant_knows_its_run():
    job = next(job for job in experiments.jobs(["variants"]) if "reward_scales" in job.flags)
    assert experiments.jobs(["outside"], [2])[0].command == "python analysis/outside/pcn.py --seed 2"
    assert job.command == ("python cleanrl_style/ppo_gated.py --seed 1 --vectorization lockstep --reward-scales 1.11 1")
    args = Args(vectorization="lockstep", reward_scales=experiments.REWARD_SCALES)
    protocol.make_task(args)
    config = {"script": "ppo_gated", "arguments": vars(args), "not_default": protocol.not_default(args)}
    config = json.loads(json.dumps(config))
    assert job.made(config) and job.row[2] == runs.setting(config["not_default"], args.mode)
    balanced = boreal_env.Reward().carbon_scale / boreal_env.BALANCED_CARBON_SCALE
    assert experiments.REWARD_SCALES == (pytest.approx(balanced, abs=0.005), 1.0)


def test_agents_of_one_site_are_a_row_of_their_own():
    in_one_world = runs.setting({"site_seed": 3}, runs.SITE_SPECIFIC)
    assert (in_one_world, runs.setting({"site_seed": 3}, "generalist")) == ("default", "site_seed=one")


def test_every_row_has_its_first_job():
    rows = [job.row for job in experiments.jobs() if not job.is_study]
    assert ("ppo_gated", "boreal-generalist-v0", "total_timesteps=150000, vectorization=lockstep") in rows
    assert ("ppo_curriculum", "boreal-generalist-v0", "raw_selector=True, vectorization=lockstep") in rows
    assert ("ppo_gated", "boreal-generalist-v0", "thaw_formulation=contrast, vectorization=lockstep") in rows


def test_commands_say_what_their_jobs_mean(monkeypatch):
    for job in experiments.jobs(seeds=[1]):
        if not job.trains or job.script in methods.OUTSIDE:
            continue
        script = importlib.import_module(job.path.removesuffix(".py").replace("/", "."))
        monkeypatch.setattr("sys.argv", [job.path, *job.arguments])
        args = protocol.parse(script.Args)
        assert {name: getattr(args, name) for name in job.flags} == job.flags, job.command


def test_quick_has_every_kind_of_job():
    quick, full = experiments.quick_jobs(), experiments.jobs()
    assert {(job.experiment, job.script) for job in quick} == {(job.experiment, job.script) for job in full}
    assert all(job.steps <= experiments.QUICK_ROUND["total_timesteps"] for job in quick)
    assert len({job.command for job in quick}) == len(quick)
    # a folder is of the same run, whatever is asked for
    alone = [job for name in COUNTS for job in experiments.quick_jobs((name,))]
    assert [job.command for job in alone] == [job.command for job in quick]


def test_list_prints_the_commands(capsys):
    run_script("analysis/reproduce.py", "--list", "--only", "thaw", "--seeds", "3")
    assert capsys.readouterr().out.splitlines() == [
        "python baselines_heuristic/zero_change.py --thaw-formulation contrast",
        "python baselines_heuristic/zero_change.py --thaw-formulation raw_degree_days",
        "python cleanrl_style/ppo_gated.py --seed 3 --vectorization lockstep --thaw-formulation contrast",
        "python cleanrl_style/ppo_gated.py --seed 3 --vectorization lockstep --thaw-formulation raw_degree_days",
    ]


def test_a_seed_that_no_experiment_has_is_refused():
    with pytest.raises(SystemExit, match="--seeds 99: allowed are 1, 2, 3"):
        run_script("analysis/reproduce.py", "--list", "--seeds", "99")


def test_quick_runs_have_one_seed():
    with pytest.raises(SystemExit, match="--seeds is not for --quick, whose runs have seed 1"):
        reproduce.main(reproduce.Args(quick=True, seeds=(7,)))


def test_what_trains_nothing_can_be_run_alone(capsys):
    run_script("analysis/reproduce.py", "--list", "--only", "main", "balanced", "--untrained")
    strategies = [f"python baselines_heuristic/{script}.py" for script in methods.STRATEGIES]
    assert capsys.readouterr().out.splitlines() == [
        *strategies,
        "python analysis/studies/constant_plans.py",
        *(f"python baselines_heuristic/{script}.py --no-masks" for script in experiments.UNMASKED),
        *(f"{line} --env-id boreal-balanced-v0" for line in strategies),
    ]


def test_finished_runs_are_recognised(tmp_path):
    configs = reproduce.finished_configs(TINY_RUNS, Path(tmp_path))
    done = {
        (job.script, job.flags.get("seed")) for job in experiments.jobs() if any(job.made(config) for config in configs)
    }
    assert done == {("ppo_curriculum", 1), ("zero_change", None)}
