import json
import re
import shutil
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from tiny_runs import TINY_RUNS, write_run, write_run_of_three

import boreal_env
from analysis import archive, experiments, make_figures, make_tables, paths, runs, stored
from analysis.results import Results
from analysis.studies.signal_to_noise import CONTRASTS
from analysis.tables import (
    best_known,
    choices,
    curriculum_selection,
    growing_season_correlations,
    learning_difficulty,
    physical_conflicts,
    runtime,
    single_sites,
)
from analysis.tables.common import FORMATS, has_numbers
from cleanrl_style.protocol.fronts import simplex_lattice
from cleanrl_style.protocol.provenance import physics_name

ROOT = Path(__file__).parents[1]
MAIN = ("ppo_curriculum", "boreal-generalist-v0", "vectorization=lockstep")


@pytest.fixture(scope="module", autouse=True)
def no_studies(tmp_path_factory):
    """The project's own studies are not the tests'."""
    with pytest.MonkeyPatch.context() as patch:
        nothing = tmp_path_factory.mktemp("no studies")
        patch.setattr(paths, "studies", lambda quick: nothing)
        yield


def make(runs, folder):
    make_tables.main(make_tables.Args(runs_dir=(runs,), tables_dir=folder))
    main = folder / "main_results.csv"
    return pd.read_csv(main).set_index(["method", "environment", "setting"]) if main.exists() else None


def read(folder, name, index):
    return pd.read_csv(folder / f"{name}.csv").set_index(index)


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """Folder with the tables of the tiny runs."""
    folder = tmp_path_factory.mktemp("tables")
    make(TINY_RUNS, folder)
    return folder


# ------------------------------------------------------------------- the committed runs, by hand


def test_main_results(tables):
    row = read(tables, "main_results", ["method", "environment", "setting"]).loc[MAIN]
    assert row.seeds == 1
    assert row.scalarized == pytest.approx((2 + 1 + 2) / 3)
    assert row.hypervolume == pytest.approx(2 * 4 + 1 * 3 + 1 * 2)  # (0, 2), (1, 1), (2, 0) above (-2, -2)
    assert row.sparsity == pytest.approx(2)
    assert row.cardinality == 3
    # weights w and 1 - w of (0, 2) or (2, 0): twice the larger, on average over 50 weights a little above 1.5
    assert row.expected_utility == pytest.approx(2 * np.mean([max(k, 49 - k) / 49 for k in range(50)]))
    assert row.gain_hypervolume == pytest.approx(1)  # gains (1, 1), (2, 0), (3, -1) above (0, 0)
    assert row.gain_scalarized == pytest.approx((1 + 1 + 3) / 3)
    assert (row.carbon_change, row.thaw_change, row.carbon_slope, row.thaw_slope) == pytest.approx((2, -2, 2, -2))
    assert np.isnan(row.scalarized_low)
    # of six episodes: 2 -+ 3, 1 -+ 2, 2 -+ 1
    assert row.sd_over_episodes == pytest.approx(np.std([-1, 5, -1, 3, 1, 3], ddof=1))
    assert (row.paper_scalarized, row.paper_sd_over_episodes, row.paper_hypervolume) == (8.5, 3.0, 84.3)
    assert row.paper_detail_hypervolume == pytest.approx(119.80, abs=0.005)


def test_strategies_and_fluxes(tables):
    row = read(tables, "learned_strategies", "method").loc["ppo_curriculum"]
    assert (row.density, row.final_density, row.conifer_fraction, row.warming) == pytest.approx((800, 1200, 0.5, 6))
    assert (row.carbon, row.thaw, row.paper_carbon) == pytest.approx((1, 1, 8))
    flux = read(tables, "warming_flux", "formulation")
    assert flux.loc["asymmetric", "zero_change_warming"] == 6 and flux.loc["asymmetric", "seeds"] == 0
    assert flux.paper_warming.tolist() == [0.1, 2.0, 5.0]


def test_runs_that_were_not_timed_are_in_no_number_of_runs():
    timed = pd.DataFrame({"phase": runtime.PHASES, "seconds": 3600.0})
    runs = {"ppo_gated": [timed, timed[:0]], "eupg_var_lambda": [timed[:0]]}
    results = SimpleNamespace(
        first_job=lambda experiment, script: SimpleNamespace(steps=300),
        of=lambda experiment, script: [
            SimpleNamespace(runs=[SimpleNamespace(tables={"timing": table})]) for table in runs.get(script, [])
        ],
    )
    table = runtime.make(results).set_index("quantity")
    assert table.loc["PPO Gated, generalist, 300 steps on one core: training", ["seeds", "ours"]].tolist() == [1, 2.0]
    assert np.isnan(table.seeds["EUPG, generalist, 300 steps on one core: training"])  # run, and not timed
    assert table.seeds["Curriculum PPO, generalist, 300 steps on one core: training"] == 0


def test_season_violations_runtime_details(tables):
    season = read(tables, "growing_season_correlations", ["method", "variable"]).loc["ppo_curriculum"]
    # returns of both episodes differ by 6 at each weight, whose means differ: r = cov / (sd sd) = 30 / sqrt(100 * 29/3)
    assert season.r_warm.to_dict() == pytest.approx(
        {"thaw_return": 30 / np.sqrt(100 * 29 / 3), "latent_heat_mj_m2": 1, "ground_shortwave_mj_m2": -1}
    )
    # there are two sites, so the season of leaves orders them as the warm days do, or the other way round
    first, second = (growing_season_correlations.season_of_leaves(seed) for seed in (11, 12))
    np.testing.assert_allclose(season.r, np.sign(second - first) * season.r_warm)
    assert season.paper_r.tolist() == [0.65, 0.82, -0.75]
    violations = read(tables, "lambda_violations", ["method", "environment", "setting"]).loc[MAIN]
    assert (violations.pairs, violations.violations_percent, violations.paper_violations_percent) == (2, 0, 50)
    # of the six orders of three points one has no violation, two have one, three have two
    assert violations.noise_violations_percent == pytest.approx(100 * (0 + 1 + 1 + 1 + 1 + 2) / 12)
    runtime = read(tables, "runtime", "quantity").ours
    what = "Curriculum PPO, generalist, 300,000 steps on one core"
    assert [runtime[f"{what}: {name}"] for name in ("training", "evaluation", "environment")] == pytest.approx(
        [0.2, 0.1, 75]
    )
    details = read(tables, "detailed_objectives", "method").loc["ppo_curriculum"].set_index("weight")
    assert details.index.tolist() == [0, 0.25, 0.5, 0.75, 1]  # the paper's too
    assert details.carbon_return.dropna().tolist() == [0, 1, 2] and details.seeds.tolist() == [1, 0, 1, 0, 1]
    assert details.paper_carbon_mean.tolist() == [2.5, 7.0, 8.5, 9.5, 10.0]
    assert details.carbon_gain.dropna().tolist() == [1, 2, 3]


def test_all_tables_in_all_formats(tables):
    assert len(make_tables.TABLES) == 14
    stems = [path.with_suffix("") for path in tables.glob("*.csv")]
    assert {stem.name for stem in stems} == {
        *("main_results", "detailed_objectives", "lambda_violations", "learned_strategies", "runtime", "warming_flux"),
        *("growing_season_correlations", "curriculum_selection"),
    }
    for stem in stems:
        rows = len(pd.read_csv(stem.with_suffix(".csv")))
        assert len(stem.with_suffix(".md").read_text().splitlines()) == rows + 2
        assert stem.with_suffix(".tex").read_text().count(r" \\") == rows + 1
    contrast = next(line for line in (tables / "warming_flux.md").read_text().splitlines() if "contrast" in line)
    assert contrast.startswith("| contrast | 0 | not run yet |")
    assert r"ppo\_curriculum" in (tables / "main_results.tex").read_text()


def test_the_same_bytes_again(tables, tmp_path):
    make(TINY_RUNS, tmp_path)
    for path in tables.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name


def test_other_formulations_are_judged_by_the_asymmetric_reward_too(tmp_path):
    flags = {"thaw_formulation": "contrast", "vectorization": "lockstep"}
    write_run(tmp_path / "runs" / "contrast", "ppo_gated", **flags)
    file = tmp_path / "runs" / "contrast" / "evaluation.csv"
    table = pd.read_csv(file)
    table.assign(asymmetric_thaw_return=table.thaw_return - 5).to_csv(file, index=False)
    make(tmp_path / "runs", tmp_path / "tables")
    row = read(tmp_path / "tables", "thaw_formulations", "formulation").loc["contrast"]
    assert (row.carbon, row.thaw, row.asymmetric_thaw) == pytest.approx((1, 1, -4))
    # scalarised 2, 1, 2 of the weights 0, 0.5, 1; 5 (1 - w) less
    assert (row.scalarized, row.asymmetric_scalarized) == pytest.approx((5 / 3, 5 / 3 - 2.5))
    assert row.paper_scalarized_mean == 4.9
    assert np.isnan(row.asymmetric_gain)  # without doing nothing on the same episodes
    write_run(tmp_path / "runs" / "zero", "zero_change", carbon=(0, 0, 0), thaw=(-6, -6, -6))
    make(tmp_path / "runs", tmp_path / "tables")
    row = read(tmp_path / "tables", "thaw_formulations", "formulation").loc["contrast"]
    assert row.asymmetric_gain == pytest.approx(row.asymmetric_scalarized + 3)  # thaw -6 at a mean weight of a half


# ---------------------------------------------------------------------------------- rows and runs


def test_seeds_are_aggregated_and_settings_kept_apart(tmp_path):
    for seed in range(1, 5):
        write_run(tmp_path / "runs" / str(seed), "ppo_curriculum", seed, carbon=(seed, 1 + seed, 2 + seed))
    write_run(tmp_path / "runs" / "short", "ppo_curriculum", carbon=(9, 9, 9), total_timesteps=100)
    table = make(tmp_path / "runs", tmp_path / "tables")
    row = table.loc[("ppo_curriculum", "boreal-generalist-v0", "default")]
    # scalarised returns (5 + 1.5 seed) / 3; the interquartile mean of four seeds is that of the middle two
    assert row.seeds == 4
    assert row.scalarized == pytest.approx((5 + 1.5 * 2.5) / 3)
    assert row.scalarized_low < row.scalarized < row.scalarized_high
    short = table.loc[("ppo_curriculum", "boreal-generalist-v0", "total_timesteps=100")]
    assert short.seeds == 1 and short.scalarized == pytest.approx((2 + 5 + 9) / 3)
    assert np.isnan(short.paper_scalarized)  # a control is no row of the paper's


def test_a_method_that_no_experiment_has_is_in_every_table_of_methods(tmp_path):
    write_run(tmp_path / "runs" / "zero", "zero_change")
    write_run(tmp_path / "runs" / "own", "ppo_mine", carbon=(1, 1, 2), thaw=(2, 3, 0), vectorization="lockstep")
    write_run(tmp_path / "runs" / "other", "ppo_mine", weights=(0.2, 0.8), carbon=(0, 1), thaw=(1, 0), clip_coef=0.1)
    years = tmp_path / "runs" / "other" / "evaluation_years.csv"
    pd.read_csv(years).assign(preference=0.2).to_csv(years, index=False)
    write_run(tmp_path / "runs" / "balanced", "ppo_mine", env_id="boreal-balanced-v0")
    make(tmp_path / "runs", tmp_path / "tables")
    key = ("ppo_mine", "boreal-generalist-v0", "vectorization=lockstep")
    index = ["method", "environment", "setting"]
    rows = {
        name: read(tmp_path / "tables", name, index).loc[[key]]
        for name in (
            "main_results",
            "lambda_violations",
            "learned_strategies",
            "growing_season_correlations",
            "detailed_objectives",
        )
    }
    assert rows["main_results"].seeds.tolist() == [1]
    assert rows["lambda_violations"].violations_percent.tolist() == [50]  # thaw rises from weight 0 to 0.5
    assert rows["learned_strategies"].carbon.tolist() == pytest.approx([4 / 3])
    assert len(rows["growing_season_correlations"]) == 3
    assert rows["detailed_objectives"].thaw_gain.notna().all()
    strategies = read(tmp_path / "tables", "learned_strategies", index)
    assert strategies.index[-2:].tolist() == [("ppo_mine", key[1], "clip_coef=0.1"), key]
    # its annual record is of weights that tables do not read
    assert np.isnan(strategies.density.iloc[-2]) and strategies.carbon.iloc[-2] == 0.5
    violations = read(tmp_path / "tables", "lambda_violations", index)
    assert "zero_change" not in violations.index.get_level_values("method")


def write_agent_of_one_weight(runs, seed, weight, **more):
    write_run(
        runs / f"{seed}-{weight}",
        "eupg_fixed_lambda",
        seed,
        carbon=(weight,),
        thaw=(1 - weight,),
        weights=(weight,),
        preference=weight,
        vectorization="lockstep",
        **more,
    )


def test_agents_of_one_weight_form_a_front(tmp_path, capsys):
    for seed in (1, 2):
        for weight in (0.0, 0.25, 0.5, 0.75, 1.0)[: 5 if seed == 1 else 4]:
            write_agent_of_one_weight(tmp_path / "runs", seed, weight)
    write_agent_of_one_weight(tmp_path / "runs", 1, 0.9)
    row = make(tmp_path / "runs", tmp_path / "tables").loc[
        ("eupg_fixed_lambda", "boreal-generalist-v0", "vectorization=lockstep")
    ]
    assert row.seeds == 1 and row.cardinality == 5 and row.sparsity == pytest.approx(2 * 0.25**2)
    said = capsys.readouterr().err
    assert "eupg_fixed_lambda, boreal-generalist-v0, seed 2: partial, without the agents of the weights 1" in said
    assert "1-0.9: of the weight 0.9, which the experiment has not" in said


def test_seeds_of_other_weights_are_no_replicates(tmp_path, capsys):
    """Where no experiment says which weights there are, it is those of an evaluation: one weight is no front."""
    for seed, weight in ((1, 0.0), (2, 1.0)):
        write_agent_of_one_weight(tmp_path / "runs", seed, weight, env_id="boreal-balanced-v0")
    write_run(tmp_path / "runs" / "zero", "zero_change")
    table = make(tmp_path / "runs", tmp_path / "tables")
    assert "boreal-balanced-v0" not in table[table.seeds > 0].index.get_level_values("environment")
    said = capsys.readouterr().err
    assert "seed 1: partial, without the agents of the weights 0.25, 0.5, 0.75, 1" in said
    assert "seed 2: partial, without the agents of the weights 0, 0.25, 0.5, 0.75" in said


def test_rows_without_runs_are_named_with_their_command(tmp_path, capsys):
    write_run(tmp_path / "runs" / "zero", "zero_change")
    table = make(tmp_path / "runs", tmp_path / "tables")
    out = capsys.readouterr().out
    assert table.loc[MAIN].seeds == 0 and np.isnan(table.loc[MAIN].scalarized)
    assert "not run yet" in (tmp_path / "tables" / "main_results.md").read_text()
    missing = out.partition("Of the project's experiments ")[2].splitlines()
    assert int(missing[0].split()[0]) > 20 and missing[0].endswith(" rows and studies are not there, or not whole:")
    assert missing[1].startswith("  python baselines_heuristic/") and "zero_change" not in missing[1] + missing[2]
    assert missing[4].endswith(" more; `python analysis/reproduce.py --list` names all, without --list makes them")
    assert re.findall(r"^ *(\w+) +boreal-", out, re.M) == ["zero_change"]  # printed are rows with runs alone
    assert "physical_conflicts: python analysis/" in out


def test_ones_own_rows_stand_once_more_below_the_projects(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(paths, "there", lambda folder: tmp_path / folder)
    write_run(tmp_path / "results" / "runs" / "zero_change", "zero_change")
    write_run(tmp_path / "runs" / "mine", "ppo_group")
    make_tables.main(make_tables.Args())
    below = capsys.readouterr().out.split("Yours, once more:")[1]
    assert re.findall(r"^ *(\w+) +boreal-", below, re.M) == ["ppo_group"]
    make_tables.main(make_tables.Args(runs_dir=(tmp_path / "runs",)))
    assert "Yours" not in capsys.readouterr().out


def test_runs_that_cannot_be_used_are_named(tmp_path, capsys):
    runs = tmp_path / "runs"
    names = ("good", "unfinished", "config", "truncated", "columns", "infinite", "partial", "broken-years", "twin")
    for name in (*names, "without-any-steps", "text-for-numbers", "half-a-line", "no-settings"):
        write_run(runs / name, "ppo_curriculum", seed=1 if name == "twin" else len(name) + 20)
    write_run(runs / "zz-first", "ppo_curriculum", seed=1)
    (runs / "unfinished" / "evaluation.csv").unlink()
    (runs / "config" / "config.json").write_text('{"script": "ppo_curriculum"}')
    for name, change in [
        ("truncated", lambda table: table.iloc[:-1]),
        ("columns", lambda table: table.drop(columns="thaw_return")),
        ("infinite", lambda table: table.assign(thaw_return=np.inf)),
    ]:
        file = runs / name / "evaluation.csv"
        change(pd.read_csv(file)).to_csv(file, index=False)
    (runs / "partial" / "episodes.csv").unlink()
    file = runs / "without-any-steps" / "episodes.csv"
    pd.read_csv(file).drop(columns="global_step").to_csv(file, index=False)
    file = runs / "text-for-numbers" / "episodes.csv"
    file.write_text(re.sub(r"^\d+,", "x,", file.read_text(), count=2, flags=re.M))
    (runs / "broken-years" / "evaluation_years.csv").write_bytes(b"")
    (runs / "half-a-line" / "timing.csv").write_text("phase,glo")
    file = runs / "no-settings" / "config.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"not_default": []}))
    table = make(runs, tmp_path / "tables")
    assert table.loc[("ppo_curriculum", "boreal-generalist-v0", "default")].seeds == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 12
    for name, reason in [
        ("unfinished", "no evaluation.csv"),
        ("config", "config.json"),
        ("truncated", "5 episodes"),
        ("columns", "the returns of ['carbon'] lacks the column weight_carbon"),
        ("infinite", "not finite"),
        ("partial", "partial: it has no episodes.csv"),
        ("without-any-steps", "damaged: episodes.csv lacks the column global_step"),
        ("text-for-numbers", "damaged: episodes.csv, line 2: global_step is 'x', not a number"),
        ("broken-years", "damaged: evaluation_years.csv"),
        ("half-a-line", "damaged: timing.csv does not end with a newline"),
        ("no-settings", "damaged: config.json (TypeError('not_default is [], not of dict'))"),
        ("zz-first", "the same run as"),
    ]:
        assert sum(str(runs / name) + ":" in line and reason in line for line in lines) == 1, name


def test_a_log_that_was_cut_short_and_a_run_without_config_are_named(tmp_path, capsys):
    runs = tmp_path / "runs"
    for name in ("good", "cut", "header", "no-config"):
        write_run(runs / name, "ppo_curriculum", seed=len(name) + 20)
    write_run(runs / "short", "ppo_curriculum", total_timesteps=40, num_envs=32)  # ended before its first episode did
    for name, rows in (("cut", 1), ("header", 0), ("short", 0)):
        file = runs / name / "episodes.csv"
        pd.read_csv(file).iloc[:rows].to_csv(file, index=False)
    (runs / "no-config" / "config.json").unlink()
    make(runs, tmp_path / "tables")
    assert sorted(capsys.readouterr().err.splitlines()) == [
        f"left out: {runs}/cut: damaged: episodes.csv ends at step 75000 of 300000",
        f"left out: {runs}/header: damaged: episodes.csv ends at step 0 of 300000",
        f"left out: {runs}/no-config: damaged: it has no config.json",
    ]


def test_the_same_run_in_two_folders_counts_once(tmp_path, capsys):
    for name in ("runs", "archive"):
        shutil.copytree(TINY_RUNS / "curriculum", tmp_path / name / "curriculum")
    make_tables.main(make_tables.Args(runs_dir=(tmp_path / "archive", tmp_path / "runs"), tables_dir=tmp_path / "t"))
    assert read(tmp_path / "t", "main_results", ["method", "environment", "setting"]).loc[MAIN].seeds == 1
    assert "left out" not in capsys.readouterr().err


def test_elsewhere_the_repositorys_results_are_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert paths.there(paths.archive()) == ROOT / "results" / "runs"
    assert paths.there(paths.archive(quick=True)) == paths.archive(quick=True)
    paths.archive().mkdir(parents=True)
    assert paths.there(paths.archive()) == paths.archive()


def test_of_two_that_differ_the_run_of_this_physics_counts(tmp_path, capsys):
    """An older archive does not hide a run that was made anew."""
    for name, carbon in (("archive", (0, 1, 2)), ("runs", (3, 4, 5))):
        write_run(tmp_path / name / "run", "ppo_curriculum", carbon=carbon, vectorization="lockstep")
    roots = (tmp_path / "archive", tmp_path / "runs")
    archived, again = (root / "run" / "config.json" for root in roots)
    archived.write_text(json.dumps({**json.loads(archived.read_text()), "physics": None}))
    for physics, counts, other in ((None, *roots), (physics_name(), *roots[::-1])):
        again.write_text(json.dumps({**json.loads(again.read_text()), "physics": physics}))
        make_tables.main(make_tables.Args(runs_dir=roots, tables_dir=tmp_path / "t"))
        row = read(tmp_path / "t", "main_results", ["method", "environment", "setting"]).loc[MAIN]
        assert row.seeds == 1 and row.scalarized == pytest.approx((5 if counts == roots[0] else 5 + 4.5) / 3)
        assert f"left out: {other}/run: other results than {counts}/run, which counts" in capsys.readouterr().err


def test_gains_need_zero_change_on_the_same_episodes(tmp_path, capsys):
    write_run(tmp_path / "runs" / "ours", "ppo_curriculum", vectorization="lockstep")
    write_run(tmp_path / "runs" / "zero", "zero_change", env_id="boreal-balanced-v0")
    assert np.isnan(make(tmp_path / "runs", tmp_path / "tables").loc[MAIN].gain_hypervolume)
    assert "zero_change.py" in capsys.readouterr().out


def test_the_score_of_both_policies(tmp_path, monkeypatch):
    """Best constant plans: 4, 2 and 2 of weights 0, 0.5 and 1."""
    zero = dict(carbon=(0, 0, 0), thaw=(0, 0, 0))
    write_run(tmp_path / "runs" / "zero", "zero_change", **zero, vectorization="lockstep")
    for seed in (1, 2):
        write_run(tmp_path / "runs" / str(seed), "ppo_gated", seed=seed, carbon=(0, 0, 2), thaw=(4, seed, 0))
    plans = [
        {"env_id": MAIN[1], "action": action, "seed": seed, "carbon_return": c + site, "thaw_return": t + 3 * site}
        for action, c, t in ((12, 0, 0), (20, 2, 0), (24, 0, 4))
        for seed, site in ((0, -1.0), (1, 1.0))
    ]
    stored.write(tmp_path / "studies" / "constant_plans.csv", pd.DataFrame(plans), {})
    monkeypatch.setattr(paths, "studies", lambda quick: tmp_path / "studies")
    table = make(tmp_path / "runs", tmp_path / "tables")
    row = table.loc[("ppo_gated", MAIN[1], "default")]
    # gains 4, 0.5 or 1, 2 of the greedy policy, of 4, 2, 2
    assert row.score_greedy == pytest.approx(100 * (6.5 + 7) / 2 / 8)
    assert row.score_greedy_low <= row.score_greedy <= row.score_greedy_high
    assert row.score_sampled == pytest.approx(row.score_greedy + 100 * 100 * 3 / 8)  # 100 more of both returns
    assert row.gain_scalarized == pytest.approx((6.5 + 7) / 6) and row.seeds_to_tell == 23
    assert table.score_greedy["best_constant_mix", MAIN[1], "default"] == pytest.approx(100)
    assert table.score_greedy["zero_change"].dropna().tolist() == [0]


def test_what_a_choice_is_worth(tmp_path):
    """The changed one gains 2, 1 and 1 less at weights 0, 0.5 and 1, where the best constant plans have 4, 2 and 2."""
    plans = [
        {"env_id": MAIN[1], "action": action, "seed": seed, "carbon_return": c, "thaw_return": t}
        for action, c, t in ((boreal_env.NO_CHANGE, 0, 0), (20, 2, 2), (24, 0, 4))
        for seed in (0, 1)
    ]
    stored.write(tmp_path / "studies" / "constant_plans.csv", pd.DataFrame(plans), {})
    flags = {"vectorization": "lockstep"}
    for seed in (1, 2, 3):
        write_run(tmp_path / f"default{seed}", "ppo_group", seed, (1, 2, 3), (5, 4, 3), **flags)
    for seed in (2, 3):
        write_run(tmp_path / f"changed{seed}", "ppo_group", seed, (2, 2, 2), (3, 2, 1), ent_coef=0.0, **flags)
    table = choices.make(Results((tmp_path,), experiments.jobs(), tmp_path / "studies"))
    row = table.set_index(["method", "environment", "setting"]).loc[
        "ppo_group", MAIN[1], "ent_coef=0.0, vectorization=lockstep"
    ]
    assert row.seeds == 2
    # mean loss of (2 + (0 + 2) / 2 + 1) / 3 of a mean (4 + 2 + 2) / 3 that the plans have; all sites and seeds alike
    assert (row.score_greedy, row.score_greedy_low, row.score_greedy_high) == pytest.approx((-50, -50, -50))
    assert row.score_sampled == pytest.approx(-50)
    assert (row.carbon_change, row.thaw_change) == pytest.approx((-2, 0))  # 0 instead of 2, -2 as before
    assert (table.seeds == 0).sum() == len(table) - 1


def test_shares_of_the_best_known_plans(tmp_path, monkeypatch):
    """On two sites, one of them searched: doing nothing has 0, the best plans 4 of thaw or 2 of carbon.

    Action 20 gains there, and loses more on the other site: over both the best constant plan is doing nothing.
    """
    runs, nothing = tmp_path / "runs", (0,) * 5
    weights = best_known.WEIGHTS
    write_run(runs / "zero", "zero_change", carbon=nothing, thaw=nothing, weights=weights)
    for seed in (1, 2):
        write_run(
            runs / str(seed), "ppo_gated", seed=seed, carbon=(0, 0, 0, 0, 1), thaw=(seed, 0, 0, 0, 0), weights=weights
        )
    plans = [("12 12 12 12 12", 0, 0), ("20 20 20 20 20", 1, 0), ("20 20 12 12 12", 2, 0), ("24 24 12 12 12", 0, 4)]
    plans.append(("22 22 12 12 12", 1, 1))
    rows = [
        {"seed": 0, "plan": plan, "found": k, "carbon_return": c - 1.0, "thaw_return": t - 3.0}
        | {"front": k > 1, "half": k > 1, "constant": k < 2}
        for k, (plan, c, t) in enumerate(plans)
    ]
    stored.write(tmp_path / "studies" / "best_plans" / f"{MAIN[1]}.csv", pd.DataFrame(rows), {})
    everywhere = [
        {"env_id": MAIN[1], "action": action, "seed": seed, "carbon_return": carbon, "thaw_return": 0.0}
        for seed, action, carbon in ((0, 12, 0.0), (0, 20, 1.0), (1, 12, 0.0), (1, 20, -3.0))
    ]
    stored.write(tmp_path / "studies" / "constant_plans.csv", pd.DataFrame(everywhere), {})
    monkeypatch.setattr(paths, "studies", lambda quick: tmp_path / "studies")
    make(runs, tmp_path / "tables")
    table = read(tmp_path / "tables", "best_known", ["method", "policy"])
    row = table.loc[("ppo_gated", "greedy")]
    assert (row.seeds, row.sites) == (2, 1)
    assert row[["share_0", "share_0.25", "share_1"]].tolist() == pytest.approx([100 * 1.5 / 4, 0, 50])
    assert row.share == pytest.approx(100 * (1.5 + 1) / (4 + 3 + 2 + 1.5 + 2))
    # sampled has 100 more of both, greedy only ends
    assert table.loc[("ppo_gated", "sampled")].nhgr == 1 and row.nhgr == 0
    assert 0 < row.eugr < 1
    for name in best_known.BLIND:
        carbon = 0 if name == "best_constant_mix" else 50
        assert table.xs(name).iloc[0][["share_0", "share_1"]].tolist() == pytest.approx([0, carbon])


def test_the_score_of_three_objectives(tmp_path, monkeypatch):
    """Best constant plans: 4 of timber, 2 of each other, and no run of zero change: that plan is one of them."""
    runs, objectives = tmp_path / "runs", ("carbon", "thaw", "timber")
    write_run_of_three(runs / "ours", "ppo_gated", [(1, 0, 0), (0, 1, 0), (0, 0, 3)])
    plans = [
        {"env_id": "timber_env:timber-v0", "action": action, "seed": seed}
        | {f"{name}_return": value + site for name, value in zip(objectives, values, strict=True)}
        for action, values in ((12, (0, 0, 0)), (20, (2, 0, 0)), (24, (0, 2, 0)), (0, (0, 0, 4)))
        for seed, site in ((0, -1.0), (1, 1.0))
    ]
    others = [{"env_id": MAIN[1], "action": k, "seed": 0, "carbon_return": 0.0, "thaw_return": 0.0} for k in (12, 24)]
    stored.write(tmp_path / "studies" / "constant_plans.csv", pd.DataFrame([*others, *plans]), {})
    monkeypatch.setattr(paths, "studies", lambda quick: tmp_path / "studies")
    make(runs, tmp_path / "tables")
    table = read(tmp_path / "tables", "main_results_timber-v0", "method")
    assert table.score_greedy["ppo_gated"] == pytest.approx(100 * (1 + 1 + 3) / (2 + 2 + 4))
    assert table.score_greedy["best_constant_mix"] == pytest.approx(100)
    assert table.gain_hypervolume["ppo_gated"] == 0  # each point gains in one objective alone
    # of a lattice of 15 weights
    weights = table.loc["best_constant_mix"]
    assert weights.gain_scalarized == pytest.approx(
        np.mean([max(2 * a, 2 * b, 4 * c) for a, b, c in simplex_lattice(3, 4)])
    )


def test_a_policy_without_preference_has_neither_sparsity_nor_response(tables):
    key = ("zero_change", "boreal-generalist-v0", "default")
    row = read(tables, "main_results", ["method", "environment", "setting"]).loc[key]
    assert np.isnan(row.sparsity) and np.isnan(row.carbon_change)
    assert row.hypervolume == pytest.approx(1 * 3) and row.gain_hypervolume == 0


def test_three_objectives_have_tables_of_their_own(tables, tmp_path):
    runs = tmp_path / "runs"
    shutil.copytree(TINY_RUNS / "curriculum", runs / "curriculum")
    shutil.copytree(TINY_RUNS / "zero_change", runs / "zero_change")
    write_run_of_three(runs / "zero", "zero_change", np.zeros((3, 3)))
    for seed in (1, 2):
        write_run_of_three(runs / f"ours {seed}", "ppo_gated", seed * np.eye(3), seed)
    archive.archive(runs, tmp_path / "archive")
    for name, folder in (("tables", runs), ("of archive", tmp_path / "archive")):
        make(folder, tmp_path / name)
    written = {path.name for path in (tmp_path / "tables").iterdir()} - {path.name for path in tables.iterdir()}
    stems = ("main_results_timber-v0", "detailed_objectives_timber-v0")
    assert written == {f"{stem}.{end}" for stem in stems for end in ("csv", "md", "tex")}
    for path in (tmp_path / "tables").iterdir():
        assert path.read_bytes() == (tmp_path / "of archive" / path.name).read_bytes()
        if path.name not in written:  # what is known of two objectives stays as it is
            assert path.read_bytes() == (tables / path.name).read_bytes()

    main = read(tmp_path / "tables", stems[0], "method")
    assert main.loc["ppo_gated", ["seeds", "cardinality"]].tolist() == [2, 3]
    # corners of 1 and of 2, from -2: 3 boxes of 2 x 2 x (2 + k) that share one of 2 x 2 x 2
    assert main.hypervolume["ppo_gated"] == pytest.approx(np.mean([8 + 3 * 4 * k for k in (1, 2)]))
    assert main.gain_scalarized["ppo_gated"] == main.scalarized["ppo_gated"] == pytest.approx(1.5)
    assert main.timber_change["ppo_gated"] == pytest.approx(1.5) and np.isnan(main.timber_change["zero_change"])
    details = read(tmp_path / "tables", stems[1], ["method", "weight_carbon", "weight_thaw", "weight_timber"])
    row = details.loc[("ppo_gated", 0, 0, 1)]
    assert row[["carbon_return", "thaw_return", "timber_return", "timber_gain"]].tolist() == pytest.approx(
        [0, 0, 1.5, 1.5]
    )
    assert len(details) == 6


# ------------------------------------------------------------------------------ tables of studies


class Studies:
    """Stands for Results, with one study."""

    def __init__(self, table, curricula=()):
        self.table, self.curricula = pd.DataFrame(table), curricula

    def study(self, name):
        return self.table

    def of(self, experiment, script):
        return self.curricula


def test_physical_conflicts():
    pair = next(name for name in physical_conflicts.PAIRS if name.startswith("conifer fraction"))
    table = {"site_seed": range(4)}
    for name in physical_conflicts.EFFECTS:
        table |= {f"lower_{name}": 0.0, f"upper_{name}": [1.0, 2.0, 3.0, 2.0]}
    table["upper_thaw_return"] = [-1.0, -1.2, -0.8, 0.2]
    table |= {"lower_thaw_clipped_years": [0, 0, 1, 0], "upper_thaw_clipped_years": [0, 2, 1, 0]}
    tables = [pd.DataFrame(table).assign(pair=name, off="all on") for name in physical_conflicts.PAIRS]
    table["upper_thaw_return"] = 4.0
    tables += [
        pd.DataFrame(table).assign(pair=name, off=off)
        for name in physical_conflicts.PAIRS
        for off in ("interception", "moss", "fire")
    ]
    row = physical_conflicts.make(Studies(pd.concat(tables))).set_index("change").loc[pair]
    assert (row.sites, row.carbon_return, row.thaw_return) == pytest.approx((4, 2, -0.7))
    half_width = 3.182446 * np.sqrt(2 / 3) / 2  # t of 3 degrees of freedom, sd of the four, root of four
    assert (row.carbon_return_low, row.carbon_return_high) == pytest.approx((2 - half_width, 2 + half_width))
    assert row.conflict == "unclear"  # thaw's interval is 0.98 on either side
    assert row.share_of_sites_in_conflict == 75 and row.paper_conflict == "yes (direct)"
    assert (row.clipped_sites, row.thaw_without_interception, row.carbon_without_fire) == (2, 4, 2)


def test_verdict():
    assert physical_conflicts.verdict((1, 0.5), (-1, 0.5)) == "yes"
    assert physical_conflicts.verdict((-1, 0.5), (-1, 0.5)) == "no"
    assert physical_conflicts.verdict((1, 0.5), (-1, 1.5)) == "unclear"


def test_curriculum_selection():
    sites = {
        "seed": 1,
        "site_seed": range(4),
        "selected": [1, 1, 0, 0],
        "latitude_deg": [60, 62, 58, 60],
        "warming_mj_m2": [4, 6, 8, 10],
        "cooling_mj_m2": 1,
        "thaw_return": [1, 1, 2, 2],
    }
    table = curriculum_selection.make(Studies(sites)).set_index("category")
    assert table.latitude.tolist() == [61, 59, 2] and table.warming.tolist() == [5, 9, -4]
    assert table.paper_warming.dropna().tolist() == [0.5, 8.0]


def test_single_sites(tmp_path):
    jobs = [job for job in experiments.jobs(seeds=[1, 2]) if job.experiment == "site" and not job.is_study]
    for number, job in enumerate(jobs):
        if not job.trains:
            flags = {"env_id": job.env_id, "carbon": (1, 1, 1), "thaw": (2, 2, 2)} | job.flags
            write_run(tmp_path / str(number), job.script, **flags)
        elif job.flags.get("baseline") == "others" and job.flags["site_seed"] == 1:
            flags = {"env_id": job.env_id, "weights": (job.flags["preference"],)} | job.flags
            write_run(tmp_path / str(number), job.script, carbon=(5,), thaw=(7,), **flags)
    studies = tmp_path / "studies"
    plans = pd.DataFrame(
        {"site_seed": 1, "action": [boreal_env.NO_CHANGE, 24], "carbon_return": [1, 4], "thaw_return": [1, 2]}
    )
    stored.write(studies / "constant_plans_of_sites.csv", plans, {})
    table = single_sites.make(Results((tmp_path,), jobs, studies)).set_index("site_seed")
    assert table.index.tolist() == ["1", "mean"]
    row = table.loc["1"]
    assert (row.thaw_baseline, row.carbon_baseline) == (7 - 2, 5 - 1)
    assert (row.thaw_plan, row.carbon_plan) == (1, 3)
    assert np.isnan(row.thaw_eupg) and np.isnan(row.thaw_total)


def test_a_table_without_numbers_is_named_and_removed(tmp_path, capsys):
    stale = [tmp_path / f"{name}{end}" for name in ("physical_conflicts", "main_results_timber-v0") for end in FORMATS]
    for path in [*stale, tmp_path / "mine.csv"]:
        path.touch()
    make(TINY_RUNS, tmp_path)
    assert not any(path.exists() for path in stale) and (tmp_path / "mine.csv").exists()
    assert "physical_conflicts: python analysis/reproduce.py --only mechanisms\n" in capsys.readouterr().out


def test_every_table_and_figure_names_its_command():
    for module in (*make_tables.TABLES, *make_figures.FIGURES):
        for command in module.MADE_BY.split(" && "):
            script, *words = command.removeprefix("python ").split(" --only ")
            assert (ROOT / script).exists() and {*" ".join(words).split()} <= {*experiments.EXPERIMENTS}, module


def test_numbers_of_the_paper_are_none_of_ours():
    table = pd.DataFrame({"method": ["a"], "seeds": [0], "paper_x": [1.0], "x": [np.nan], "source": ["y"]})
    assert not has_numbers(table, list(table)) and has_numbers(table.assign(x=0.0), list(table))


def test_a_choice_that_all_years_bear_on():
    years = pd.DataFrame({"year": ["25", "0", "every"], "effect": [-1.0, -1.0, 9.0], "noise": [2.0, 2.0, 9.0]})
    # effects of 1 to year 25, then falling to 0 at year 50: 38.5 of one year's, and four times that of variance
    whole = 26 + np.linspace(1, 0, 26)[1:-1].sum()
    assert learning_difficulty.shared_episodes(years, "noise") == pytest.approx((2 * 1.96) ** 2 * 4 * whole / whole**2)


def test_what_learning_is_up_against(tmp_path):
    names = ("contrast", "objective", "weighting", "year")
    cases = product(CONTRASTS, ("carbon", "thaw"), ("return", "discounted", "GAE"), ("0", "5", "every"))
    numbers = {
        "effect": 1.0,
        "effect_low": 0.5,
        "effect_high": 2.0,
        "carried": 0.25,
        "site_episodes": 7.0,
        "site_noise": 1.0,
        "noise": 2.0,
        "years_20_50": 0.5,
    }
    rows = [numbers | dict(zip(names, case, strict=True)) | {"reference": "uniform"} for case in cases]
    untold = {"contrast": "thin", "objective": "carbon", "weighting": "return"}
    rows = [row | {"effect_low": -0.5} if untold.items() <= row.items() else row for row in rows]
    stored.write(tmp_path / "studies" / "signal_to_noise.csv", pd.DataFrame(rows), {})
    parts = pd.DataFrame(
        {
            "component": ["site", "policy"] * 2,
            "objective": ["carbon"] * 2 + ["thaw"] * 2,
            "value": "return",
            "share": [0.4, 0.6, 0.9, 0.1],
        }
    )
    stored.write(tmp_path / "variance" / "components.csv", parts, {})
    gradients = pd.DataFrame(
        {
            "utility": "total",
            "baseline": "none",
            "objective": ["carbon", "thaw", "preference"],
            "episodes": [20.0, np.inf, 1.0],
            "episodes_low": [10.0, 90.0, 1.0],
            "episodes_high": [30.0, np.inf, 1.0],
        }
    )
    stored.write(tmp_path / "studies" / "gradient_noise.csv", gradients, {})
    results = Results((TINY_RUNS,), experiments.jobs(), tmp_path / "studies")
    table = learning_difficulty.make(results).set_index(["of", "quantity"])
    assert table.loc[("variance of returns", "site %"), ["carbon", "thaw"]].tolist() == [40, 90]
    assert table.loc[("thin", "effect on the return"), ["thaw", "thaw_low", "thaw_high"]].tolist() == [1, 0.5, 2]
    late = table.loc[("thin", "effect that comes after 20 years %"), ["carbon", "thaw"]]
    assert np.isnan(late.carbon) and late.thaw == 50  # an effect that may be nothing has no late share
    assert table.loc[("thin", "effect that GAE rewards carry %"), "carbon"] == 25
    gradient = table.loc[(learning_difficulty.GRADIENT, "episodes, total utility, baseline: none")]
    assert gradient[["carbon", "carbon_low", "thaw", "thaw_low"]].tolist() == [20, 10, np.inf, 90]
    nothing = learning_difficulty.make(Results((TINY_RUNS,), experiments.jobs(), TINY_RUNS / "no studies"))
    assert all(text.startswith("not run yet: python analysis/") for text in nothing.quantity)


# ----------------------------------------------------------------------------------- where they come from and go


@pytest.mark.parametrize("module", [make_tables, make_figures])
def test_folders_without_runs_are_named_in_one_line_and_nothing_is_written(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match=r"^error: --runs-dir .*nowhere: no such folder$"):
        module.main(module.Args(runs_dir=(tmp_path / "nowhere",)))
    with pytest.raises(
        SystemExit,
        match=r"^error: no finished run under .*; `python \S+zero_change.py` makes .*analysis/reproduce.py.*$",
    ):
        module.main(module.Args(runs_dir=(tmp_path,)))
    assert not any(tmp_path.iterdir())


def test_a_users_tables_lie_beside_the_users_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_tables.main(make_tables.Args(runs_dir=(TINY_RUNS,)))
    assert {path.relative_to(tmp_path).parts[:2] for path in tmp_path.rglob("*.csv")} == {("runs", "tables")}


def test_the_committed_tables_are_of_the_committed_runs():
    """As many seeds a row as the archive has folders; others are rows of other tables."""
    table = pd.read_csv(ROOT / "results" / "tables" / "main_results.csv")
    made = {
        (row.method, row.environment, frozenset(row.setting.removeprefix("default").split(", "))): row.seeds
        for row in table.itertuples()
    }
    others = re.compile("eupg_fixed_lambda|preference=|thaw_formulation=|boreal-(?!generalist|balanced)")
    rows = [path for path in (ROOT / "results" / "runs").glob("*/*") if not others.search(str(path))]
    assert len(rows) > 30
    for path in rows:
        env_id, version, setting = path.name.partition("-v0")
        key = path.parent.name, env_id + version, frozenset(setting.removeprefix("-").split("-"))
        assert made.get(key) == len(list(path.glob("seed*"))), f"{key}: make_tables.py, as results/README.md says"


def test_a_study_of_another_simulator_is_named_once(tmp_path, capsys):
    for name, made_by in (("mine", stored.with_physics({})), ("other", {"physics": "another"}), ("unsaid", {})):
        (tmp_path / f"{name}.csv").write_text(f"# {json.dumps(made_by)}\nvalue\n1.0\n")
        for _ in range(2):
            assert Results((), experiments.jobs(), tmp_path).study(name).value.tolist() == [1.0]
    assert capsys.readouterr().err.splitlines() == [
        f"{tmp_path / 'other.csv'}: made with another source of the simulator; its command makes it anew"
    ]


def test_a_seed_that_comes_twice_at_a_weight_is_refused():
    table = pd.DataFrame({"preference": [0.0, 0.0, 1.0, 1.0], "seed": [1, 2, 1, 1], "carbon_return": 0.0})
    arguments = {"eval_weights": [0, 1], "eval_episodes": 2, "mode": "generalist"}
    with pytest.raises(ValueError, match="lacks episodes"):
        runs.check_policy(table.assign(thaw_return=0.0), "greedy", arguments, ["carbon", "thaw"])
