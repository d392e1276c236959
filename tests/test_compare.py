"""Two methods are compared by their difference on the same sites."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scripts import ROOT
from tiny_runs import write_run

from analysis import compare
from analysis.results import Results

RUNS, BALANCED = ROOT / "results" / "runs", "boreal-balanced-v0-vectorization=lockstep"


def test_a_method_is_not_told_from_itself(capsys):
    folder = RUNS / "plan_regression" / BALANCED
    compare.main(compare.Args(folder, folder))
    first, second, greedy, sampled = capsys.readouterr().out.splitlines()
    assert first.removeprefix("first") == second.removeprefix("second")
    for line in (greedy, sampled):
        assert "+0.0 points [-" in line and ": not told apart" in line


def test_what_has_other_signs_in_no_interval_is_told_apart(capsys):
    compare.main(compare.Args(RUNS / "ppo_gated" / BALANCED, RUNS / "plan_regression" / BALANCED))
    first, second, greedy, _ = capsys.readouterr().out.splitlines()
    assert greedy.startswith("greedy: first less second -") and ": told apart" in greedy
    ours, theirs = (float(line.split(", score ")[1].split()[0]) for line in (first, second))
    assert float(greedy.split()[4]) == pytest.approx(ours - theirs, abs=1.1)


def test_a_single_training_has_no_interval(capsys):
    folder = RUNS / "plan_regression" / BALANCED
    compare.main(compare.Args(folder / "seed1", folder))
    assert "[" not in capsys.readouterr().out.splitlines()[2]


def test_scores_of_another_utility_than_the_weighted_sum_are_marked(tmp_path, capsys):
    linear = RUNS / "ppo_gated" / BALANCED / "seed1"
    chebyshev = tmp_path / "ppo_gated" / f"{BALANCED}-scalarization=chebyshev" / "seed1"
    shutil.copytree(linear, chebyshev)
    config = json.loads((linear / "config.json").read_text())
    config["arguments"]["scalarization"] = config["not_default"]["scalarization"] = "chebyshev"
    (chebyshev / "config.json").write_text(json.dumps(config))
    compare.main(compare.Args(chebyshev, linear))
    [marked] = [line for line in capsys.readouterr().out.splitlines() if "weighted sum" in line]
    assert marked.startswith(f"{chebyshev}: ")


@pytest.mark.parametrize(
    "first, second, wrong",
    [
        (
            "plan_regression",
            "plan_regression",
            "plan_regression holds runs of 2 settings; give one of .*/boreal-balanced-v0",
        ),
        (f"plan_regression/{BALANCED}", "nothing", "nothing: no such folder"),
        (
            f"plan_regression/{BALANCED}",
            "plan_regression/boreal-generalist-v0-vectorization=lockstep",
            "evaluated differently: --env-id boreal-balanced-v0 .*, and --env-id boreal-generalist-v0 ",
        ),
        (
            f"ppo_group/{BALANCED}",
            "ppo_group/boreal-warming-v0-vectorization=lockstep",
            "evaluated differently|no constant",
        ),
    ],
)
def test_what_cannot_be_compared_is_named(first, second, wrong):
    with pytest.raises(SystemExit, match=wrong):
        compare.main(compare.Args(RUNS / first, RUNS / second))


def test_both_intervals_have_to_tell(monkeypatch, capsys):
    monkeypatch.setattr(compare.metrics, "welch_interval", lambda *_: (-1.0, 1.0))
    compare.main(compare.Args(RUNS / "ppo_gated" / BALANCED, RUNS / "plan_regression" / BALANCED))
    assert ": not told apart" in capsys.readouterr().out.splitlines()[2]


def test_what_so_many_seeds_tell():
    assert compare.told_from(np.array([-1.0, 1.0]) / 2**0.5, 17) == pytest.approx(1.0)


def test_other_weights_are_refused(monkeypatch):
    def row(*weights):
        evaluation = pd.DataFrame({"preference": weights, "carbon_return": 0.0, "thaw_return": 0.0})
        runs = [SimpleNamespace(arguments={"eval_weights": weights, "eval_episodes": 1})]
        return ("script", "env", "default"), [SimpleNamespace(evaluation=evaluation, plans=None, runs=runs)]

    rows = iter([row(0.0, 1.0), row(0.0, 0.5)])
    monkeypatch.setattr(compare, "row_of", lambda folder: next(rows))
    with pytest.raises(
        SystemExit, match="--eval-weights 0 1 --eval-episodes 1, and --env-id env --eval-weights 0 0.5 "
    ):
        compare.main(compare.Args(RUNS, RUNS))


def test_seeds_of_two_versions_of_a_script_are_named(tmp_path):
    for seed, source in ((1, "a"), (2, "b"), (3, "a")):
        folder = tmp_path / "ppo_group" / "boreal-generalist-v0" / f"seed{seed}"
        write_run(folder, "ppo_group", seed=seed)
        config = json.loads((folder / "config.json").read_text())
        (folder / "config.json").write_text(json.dumps({**config, "source": source}))
    results = Results.load(False, (tmp_path,))
    (line,) = results.of_several_sources()
    assert "its seeds were trained by 2 versions of ppo_group.py: 1 3, and 2; --overwrite" in line
    assert list(results.own) == [("ppo_group", "boreal-generalist-v0", "default")]
    assert Results.load(False, (RUNS / "plan_regression",)).own == {}  # the archive's
