import json
import os
import signal
from collections import Counter
from pathlib import Path

import pytest
from scripts import run_script
from tiny_runs import TINY_RUNS

import boreal_env
from analysis import experiments, methods, reproduce, runs
from analysis.experiments import Job
from cleanrl_style import protocol
from cleanrl_style.ppo_gated import Args

COUNTS = {
    "main": 2 + len(methods.STRATEGIES) + 10 * len(methods.LEARNERS),
    "balanced": len(methods.STRATEGIES) + 10 * len(methods.LEARNERS),
    "group": 30,
    "outside": 10 * len(methods.OUTSIDE),
    "fixed": 25,
    "site": 45,
    "thaw": 12,
    "controls": 20,
    "variants": 35,
    "mechanisms": 2,
    "single": 6,
    "difficulty": 3,
    "budgets": 10,
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
    job = next(job for job in experiments.jobs(["single"], [2]) if job.trains)
    args = Args(**job.flags)
    protocol.make_task(args)
    config = {"script": "ppo_gated", "arguments": vars(args), "not_default": protocol.not_default(args)}
    config = json.loads(json.dumps(config))
    assert job.made(config) and args.site_seed == experiments.FRONT_SITES[1] and args.mode == "generalist"
    assert runs.setting(config["not_default"], args.mode) == job.row[2] and "site_seed=one" in job.row[2]
    in_one_world = runs.setting({"site_seed": 3}, runs.SITE_SPECIFIC)
    assert (in_one_world, runs.setting({"site_seed": 3}, "generalist")) == ("default", "site_seed=one")


def test_every_row_has_its_first_job():
    rows = [job.row for job in experiments.jobs() if not job.is_study]
    assert ("ppo_gated", "boreal-generalist-v0", "total_timesteps=150000, vectorization=lockstep") in rows
    assert ("ppo_curriculum", "boreal-generalist-v0", "raw_selector=True, vectorization=lockstep") in rows
    assert ("ppo_gated", "boreal-generalist-v0", "thaw_formulation=contrast, vectorization=lockstep") in rows


def test_quick_has_every_kind_of_job():
    quick, full = experiments.quick_jobs(), experiments.jobs()
    assert {(job.experiment, job.script) for job in quick} == {(job.experiment, job.script) for job in full}
    assert all(job.steps <= 2 * experiments.QUICK_STEPS for job in quick)
    assert len({job.command for job in quick}) == len(quick)


def test_list_prints_the_commands(capsys):
    run_script("analysis/reproduce.py", "--list", "--only", "thaw", "--seeds", "3")
    assert capsys.readouterr().out.splitlines() == [
        "python baselines_heuristic/zero_change.py --thaw-formulation contrast",
        "python baselines_heuristic/zero_change.py --thaw-formulation raw_degree_days",
        "python cleanrl_style/ppo_gated.py --seed 3 --vectorization lockstep --thaw-formulation contrast",
        "python cleanrl_style/ppo_gated.py --seed 3 --vectorization lockstep --thaw-formulation raw_degree_days",
    ]


# --------------------------------------------------------------------------------------- the runner

FAKE = """
import os, pathlib, sys, time
name, what = sys.argv[2], sys.argv[4]
marks = pathlib.Path(sys.argv[6])
(marks / f"{name} started").touch()
if hasattr(os, "sched_getaffinity"):
    assert len(os.sched_getaffinity(0)) == 1
print("training 40/100 steps", flush=True)
if what == "fails":
    sys.exit("error: this one fails")
if what == "waits":
    time.sleep(60)
if what == "is slow":
    time.sleep(1)
if what == "reads a":
    assert (marks / "a done").exists()
(marks / f"{name} done").touch()
"""


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """Makes jobs of a script that fails, waits or ends, and a function of a job that says whether it has ended."""
    script = tmp_path / "fake.py"
    script.write_text(FAKE)
    monkeypatch.setattr(Job, "path", property(lambda self: str(script)))
    monkeypatch.setattr(Job, "steps", property(lambda self: 100))

    def job(name, what="ends"):
        return Job("main", "fake", {"name": name, "what": what, "marks": tmp_path})

    def finished(job):
        return (tmp_path / f"{job.flags['name']} done").exists()

    return job, finished, tmp_path


def run(jobs, fake, cores=(0, 1)):
    known = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
    return reproduce.run_jobs(jobs, fake[2] / "logs", known[: len(cores)], fake[1], poll=0.02)


def test_a_failed_job_is_named_and_the_rest_goes_on(fake, capsys):
    job = fake[0]
    failed = run([job("a"), job("b", "fails"), job("c"), job("d")], fake)
    out = capsys.readouterr().out
    assert [one.flags["name"] for one in failed] == ["b"]
    assert "FAILED: python" in out and "--name b --what fails" in out and "error: this one fails" in out
    assert "3/4 jobs, 300 of 300 steps" in out
    assert all((fake[2] / f"{name} done").exists() for name in "acd")


def test_a_study_that_reads_runs_starts_when_those_before_it_have_ended(fake, monkeypatch):
    monkeypatch.setattr(experiments, "READING", ("reader",))
    reader = Job("main", "reader", {"name": "b", "what": "reads a", "marks": fake[2]})
    assert run([fake[0]("a", "is slow"), reader, fake[0]("c")], fake) == []
    assert fake[1](reader)


def test_finished_jobs_are_not_started_again(fake, capsys):
    job = fake[0]
    run([job("a"), job("b", "fails")], fake)
    for path in fake[2].glob("* started"):
        path.unlink()
    assert run([job("a"), job("b")], fake) == []
    assert [path.name for path in fake[2].glob("* started")] == ["b started"]
    assert "2/2 jobs, 200 of 200 steps" in capsys.readouterr().out


def test_stopping_ends_the_children(fake, monkeypatch):
    begun = []

    def start(*args):
        begun.append(true_start(*args))
        return begun[-1]

    def sleep(seconds):
        true_sleep(seconds)
        if begun[0].log.exists() and begun[0].steps() == 40:
            monkeypatch.setattr(reproduce.time, "sleep", true_sleep)  # waiting for the process sleeps too
            raise KeyboardInterrupt

    true_start, true_sleep = reproduce.start, reproduce.time.sleep
    monkeypatch.setattr(reproduce, "start", start)
    monkeypatch.setattr(reproduce.time, "sleep", sleep)
    with pytest.raises(KeyboardInterrupt):
        run([fake[0]("a", "waits")], fake)
    assert begun[0].process.returncode == -signal.SIGTERM


def test_finished_runs_are_recognised(tmp_path):
    configs = reproduce.finished_configs(TINY_RUNS, Path(tmp_path))
    done = {
        (job.script, job.flags.get("seed")) for job in experiments.jobs() if any(job.made(config) for config in configs)
    }
    assert done == {("ppo_curriculum", 1), ("zero_change", None)}
