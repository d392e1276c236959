import json

import numpy as np
import pandas as pd
import pytest

from analysis import make_tables
from analysis.evaluation import EVALUATION_COLUMNS

WEIGHTS = [0.0, 0.5, 1.0]


def write_run(folder, script, seed=1, carbon=(0, 1, 2), thaw=(2, 1, 0), env_id="boreal-generalist-v0",
              **not_default):
    """A finished run whose mean returns per weight are the given ones."""
    rows = []
    for policy, shift in (("greedy", 100.0), ("sampled", 0.0)):
        for weight, c, t in zip(WEIGHTS, carbon, thaw, strict=True):
            for episode, site in enumerate((-1.0, 1.0)):
                rows.append({"policy": policy, "preference": weight, "episode": episode, "seed": episode,
                             "carbon_return": c + site + shift, "thaw_return": t + 3 * site + shift})
    episodes = pd.DataFrame(rows, columns=EVALUATION_COLUMNS)
    w = episodes.preference
    episodes["scalarized_return"] = w * episodes.carbon_return + (1 - w) * episodes.thaw_return
    folder.mkdir(parents=True)
    episodes.to_csv(folder / "evaluation.csv", index=False)
    arguments = {"seed": seed, "env_id": env_id, "thaw_formulation": "asymmetric", "site_seed": None,
                 "eval_weights": WEIGHTS, "eval_episodes": 2, **not_default}
    config = {"script": script, "arguments": arguments, "not_default": not_default}
    (folder / "config.json").write_text(json.dumps(config))


def make(tmp_path):
    make_tables.main(tmp_path / "runs", tmp_path / "tables")
    table = pd.read_csv(tmp_path / "tables" / "main_results.csv")
    return table.set_index(["method", "environment", "setting"])


DEFAULT = ("ppo_curriculum", "boreal-generalist-v0", "default")


def test_without_runs_it_names_the_commands(tmp_path):
    with pytest.raises(SystemExit) as exit:
        make_tables.main(tmp_path / "runs", tmp_path / "tables")
    assert exit.value.code not in (0, None)
    for command in ("python cleanrl_style/ppo_curriculum.py --seed 1",
                    "python baselines_heuristic/zero_change.py --seed 1 --env-id boreal-balanced-v0"):
        assert command in str(exit.value)
    assert not (tmp_path / "tables").exists()


def test_metrics_of_one_run_beside_the_papers(tmp_path):
    write_run(tmp_path / "runs" / "whatever", "ppo_curriculum")
    write_run(tmp_path / "runs" / "zero", "zero_change", carbon=(-1, -1, -1), thaw=(1, 1, 1))
    row = make(tmp_path).loc[DEFAULT]
    assert row.seeds == 1
    assert row.scalarized == pytest.approx((2 + 1 + 2) / 3)
    assert row.hypervolume == pytest.approx(2 * 4 + 1 * 3 + 1 * 2)  # (0, 2), (1, 1), (2, 0) above (-2, -2)
    assert row.sparsity == pytest.approx(2)
    assert row.gain_hypervolume == pytest.approx(3 * 3 + 1 * 2 + 1 * 1)  # gains (1, 1), (2, 0), (3, -1)
    assert row.gain_scalarized == pytest.approx((1 + 1 + 3) / 3)
    assert row.violations_percent == 0
    assert np.isnan(row.scalarized_low)
    assert (row.paper_scalarized, row.paper_sd_over_episodes, row.paper_hypervolume) == (8.5, 3.0, 84.3)
    assert row.paper_detail_hypervolume == pytest.approx(119.80, abs=0.005)
    assert row.paper_violations_percent == 50


def test_seeds_are_aggregated_and_settings_kept_apart(tmp_path):
    for seed in range(1, 5):
        write_run(tmp_path / "runs" / str(seed), "ppo_curriculum", seed, carbon=(seed, 1 + seed, 2 + seed))
    write_run(tmp_path / "runs" / "short", "ppo_curriculum", carbon=(9, 9, 9), total_timesteps=100)
    table = make(tmp_path)
    row = table.loc[DEFAULT]
    # scalarised returns (5 + 1.5 seed) / 3; the interquartile mean of four seeds is that of the middle two
    assert row.seeds == 4
    assert row.scalarized == pytest.approx((5 + 1.5 * 2.5) / 3)
    assert row.scalarized_low < row.scalarized < row.scalarized_high
    short = table.loc[("ppo_curriculum", "boreal-generalist-v0", "total_timesteps=100")]
    assert short.seeds == 1 and short.scalarized == pytest.approx((2 + 5 + 9) / 3)


def test_rows_without_runs_are_named_with_their_command(tmp_path, capsys):
    write_run(tmp_path / "runs" / "zero", "zero_change")
    table = make(tmp_path)
    out = capsys.readouterr().out
    assert table.loc[DEFAULT].seeds == 0 and np.isnan(table.loc[DEFAULT].scalarized)
    assert "no run yet" in (tmp_path / "tables" / "main_results.md").read_text()
    assert "python cleanrl_style/ppo_curriculum.py --seed 1\n" in out
    assert "python baselines_heuristic/zero_change.py --seed 1\n" not in out


def test_runs_that_cannot_be_used_are_named(tmp_path, capsys):
    runs = tmp_path / "runs"
    for name in ("good", "unfinished", "config", "truncated", "columns", "infinite", "twin"):
        write_run(runs / name, "ppo_curriculum", seed=1 if name == "twin" else len(name))
    write_run(runs / "zz-first", "ppo_curriculum", seed=1)
    (runs / "unfinished" / "evaluation.csv").unlink()
    (runs / "config" / "config.json").write_text('{"script": "ppo_curriculum"}')
    for name, change in [("truncated", lambda table: table.iloc[:-1]),
                         ("columns", lambda table: table.drop(columns="thaw_return")),
                         ("infinite", lambda table: table.assign(thaw_return=np.inf))]:
        file = runs / name / "evaluation.csv"
        change(pd.read_csv(file)).to_csv(file, index=False)
    table = make(tmp_path)
    assert table.loc[DEFAULT].seeds == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 6
    for name, reason in [("unfinished", "no evaluation.csv"), ("config", "config.json"),
                         ("truncated", "5 episodes"), ("columns", "lacks the column thaw_return"),
                         ("infinite", "not finite"), ("zz-first", "the same run as")]:
        assert sum(str(runs / name) + ":" in line and reason in line for line in lines) == 1, name


def test_gains_need_zero_change_on_the_same_episodes(tmp_path, capsys):
    write_run(tmp_path / "runs" / "ours", "ppo_curriculum")
    write_run(tmp_path / "runs" / "zero", "zero_change", env_id="boreal-balanced-v0")
    assert np.isnan(make(tmp_path).loc[DEFAULT].gain_hypervolume)
    assert "zero_change.py" in capsys.readouterr().out


def test_a_policy_without_preference_has_neither_sparsity_nor_violations(tmp_path):
    write_run(tmp_path / "runs" / "zero", "zero_change", carbon=(1, 1, 1), thaw=(0, 0, 0))
    row = make(tmp_path).loc[("zero_change", "boreal-generalist-v0", "default")]
    assert np.isnan(row.sparsity) and np.isnan(row.violations_percent)
    assert row.hypervolume == pytest.approx(6) and row.gain_hypervolume == pytest.approx(4)


def test_all_formats_have_the_same_rows(tmp_path):
    write_run(tmp_path / "runs" / "ours", "ppo_curriculum")
    rows = len(make(tmp_path))
    tables = tmp_path / "tables"
    assert len((tables / "main_results.md").read_text().splitlines()) == rows + 2
    latex = (tables / "main_results.tex").read_text()
    assert latex.count(r"\\") == rows + 1 and r"ppo\_curriculum" in latex
    details = pd.read_csv(tables / "detailed_objectives.csv")
    assert details.weight.tolist() == WEIGHTS and details.carbon_return.tolist() == [0, 1, 2]
    assert details.paper_carbon_mean.tolist() == [2.5, 8.5, 10.0]
