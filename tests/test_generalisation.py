"""Shifted sites, and the ratios by which a policy generalises, on cases worked by hand."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from playing import quick
from tiny_runs import TINY_RUNS

import sim
from analysis import generalisation, paths, stored
from cleanrl_style import protocol
from cleanrl_style.protocol import provenance, sites
from sim.task.episodes import BALANCED_WORLD
from sim.task.shifts import SHIFTS, shifts_of


def table(seed, *points):
    return pd.DataFrame(points, columns=["carbon_return", "thaw_return"]).assign(site_seed=seed)


# ------------------------------------------------------------------------------------------------- shifted sites


def test_shifts_lie_beside_the_sampled_range_and_within_physical_limits():
    for shift in SHIFTS.values():
        for name, (low, high) in shift.items():
            parameter = sim.SITE_PARAMETERS[name]
            assert parameter.physical_low <= low < high <= parameter.physical_high
            assert high <= parameter.low or parameter.high <= low


@pytest.mark.parametrize("boundary", ["sampled", "balanced"])
def test_a_shifted_environment_has_the_same_sites_but_for_the_shift(boundary):
    world = {**BALANCED_WORLD, "boundary": boundary}
    names = shifts_of(boundary)
    assert len(names) == 4
    for name in (None, *names):
        env = quick(years=1, **world, parameter_overrides=SHIFTS.get(name))
        env.reset(seed=7)
        site_seed = int(env._episodes.site_seeds[0])
        moved = sim.sample_site(site_seed, SHIFTS.get(name))
        differs = {key for key, value in sim.sample_site(site_seed).items() if moved[key] != value}
        assert differs == set(SHIFTS.get(name, {}))
        found = dict(zip(sim.state.PARAMETER_NAMES, env._episodes.stands.parameters[0], strict=True))
        assert all(found[key] == moved[key] for key in differs)


# ------------------------------------------------------------------------------------------------------- ratios


def test_ratios_by_hand():
    """The best front scaled is (0, 1), (1, 0), (0.8, 0.8), of hypervolume 0.64; the policy's point (0.5, 0.5), 0.25."""
    best = table(1, (-2.0, 3.0), (8.0, -7.0), (6.0, 1.0))
    found = generalisation.ratios({"mine": table(1, (3.0, -2.0))}, best).iloc[0]
    assert found.nhgr == pytest.approx(0.25 / 0.64)
    weights = np.linspace(0.0, 1.0, 50)
    known = np.maximum(np.maximum(weights, 1.0 - weights), 0.8).mean()
    assert found.eugr == pytest.approx(0.5 / known)


def test_the_best_front_itself_has_all_and_better_than_it_no_more():
    best = table(1, (0.0, 1.0), (1.0, 0.0), (0.6, 0.6))
    better = table(1, (2.0, 2.0))
    found = generalisation.ratios({"same": best, "better": better}, best).set_index("policy")
    assert found.nhgr["better"] == found.eugr["better"] == 1.0
    assert found.nhgr["same"] == found.eugr["same"] == pytest.approx(1.0)


def test_ratios_hang_on_no_offset_or_unit():
    best, mine = table(1, (0.0, 1.0), (1.0, 0.0), (0.7, 0.7)), table(1, (0.2, 0.9), (0.5, 0.6))
    moved = [one.assign(carbon_return=7.0 * one.carbon_return - 100.0) for one in (best, mine)]
    pd.testing.assert_frame_equal(
        generalisation.ratios({"mine": mine}, best), generalisation.ratios({"mine": moved[1]}, moved[0])
    )


def test_fronts_are_means_by_site_and_weight():
    rows = [(1, 0.0, 1.0, 2.0), (1, 0.0, 3.0, 4.0), (1, 1.0, 5.0, 6.0), (2, 0.0, 7.0, 8.0)]
    evaluation = pd.DataFrame(rows, columns=["site_seed", "preference", "carbon_return", "thaw_return"])
    assert generalisation.fronts(evaluation).to_numpy().tolist() == [[1, 0, 2, 3], [1, 1, 5, 6], [2, 0, 7, 8]]


def test_the_drop_is_paired_by_site():
    inside = pd.DataFrame({"policy": "mine", "site_seed": [1, 2, 3], "nhgr": [0.9, 0.5, 0.7], "eugr": 1.0})
    outside = pd.DataFrame({"policy": "mine", "site_seed": [3, 2, 1], "nhgr": [0.5, 0.3, 0.7], "eugr": 0.8})
    found = generalisation.summary({"inside": inside, "calmer": outside}, "inside").set_index("split")
    assert found.nhgr["calmer"] == pytest.approx(0.5) and found.nhgr["inside"] == pytest.approx(0.7)
    drop = found.loc["calmer"]
    assert (drop.nhgr_drop, drop.nhgr_drop_low, drop.nhgr_drop_high) == pytest.approx((0.2, 0.2, 0.2))
    assert drop.eugr_drop == pytest.approx(0.2) and np.isnan(found.nhgr_drop["inside"])


def test_a_split_of_other_sites_has_no_drop():
    one = pd.DataFrame({"policy": "mine", "site_seed": [1, 2], "nhgr": 1.0, "eugr": 1.0})
    found = generalisation.summary({"test": one, "validation": one.assign(site_seed=[3, 4], nhgr=0.5)}, "test")
    assert found.nhgr.tolist() == [1.0, 0.5] and "nhgr_drop" not in found


def test_what_cannot_be_compared_is_refused():
    best = table(1, (0.0, 1.0), (1.0, 0.0))
    with pytest.raises(ValueError, match=r"policy mine: site 1 has not both"):
        generalisation.ratios({"mine": table(2, (0.0, 0.0))}, best)
    with pytest.raises(ValueError, match=r"policy mine: returns of carbon_return, thaw_return are needed"):
        generalisation.ratios({"mine": best.drop(columns="thaw_return")}, best)
    with pytest.raises(ValueError, match=r"evaluation: column preference is missing"):
        generalisation.fronts(best)
    one = pd.DataFrame({"policy": "mine", "site_seed": [1], "nhgr": 1.0, "eugr": 1.0})
    with pytest.raises(ValueError, match=r"split 'c': allowed are a"):
        generalisation.summary({"a": one}, "c")


# ---------------------------------------------------------------------------------------------------- the command

WEIGHTS = (0.0, 1.0)
SEEDS = sites.published_seeds("test")[:2]


def episodes(gain, seeds=SEEDS):
    """Both policies on two sites: carbon `gain` at weight 1, thaw `gain` at weight 0."""
    rows = [
        {"policy": policy, "preference": w, "episode": k, "seed": seed, "site_seed": k}
        | {"carbon_return": k + gain * w, "thaw_return": k + gain * (1 - w), "scalarized_return": k + gain}
        for policy in protocol.POLICIES
        for w in WEIGHTS
        for k, seed in enumerate(seeds)
    ]
    return pd.DataFrame(rows)


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A finished run that gains 2 on the test sites and 1 on all others, where plans gain 4; nothing is simulated."""
    folder = tmp_path / "run"
    folder.mkdir()
    arguments = {"env_id": "boreal-balanced-v0", "mode": "generalist", "seed": 1, "site_seed": None}
    arguments |= {"eval_weights": WEIGHTS, "eval_episodes": 2, "thaw_formulation": "asymmetric"}
    config = {"script": "plus_100", "arguments": arguments, "not_default": {}, "primary_policy": "greedy"}
    config["physics"] = provenance.physics_name()
    (folder / "config.json").write_text(json.dumps(config))
    episodes(2.0).to_csv(folder / "evaluation.csv", index=False)
    shutil.copy(TINY_RUNS / "zero_change" / "timing.csv", folder)
    played = []

    def evaluate(task, policy, weights, number, split):
        played.append((task.env_id, tuple(weights), number, split))
        return episodes(1.0, sites.of_split(task, number, split)[1]), None

    def plans(task, seeds):
        rows = [
            {"plan": plan, "seed": seed, "carbon_return": k + c, "thaw_return": k + t}
            for k, seed in enumerate(seeds)
            for plan, c, t in (("12", 0.0, 0.0), ("20", 4.0, 0.0), ("24", 0.0, 4.0), ("22", 2.0, 2.0))
        ]
        return pd.DataFrame(rows)

    monkeypatch.setattr(protocol, "evaluate", evaluate)
    monkeypatch.setattr(protocol, "load_policy", lambda folder: None)
    monkeypatch.setattr(generalisation.reference, "reference_returns", plans)
    monkeypatch.setattr(generalisation.provenance, "physics_name", lambda: "physics")
    for name in ("studies", "runs", "archive"):
        monkeypatch.setattr(paths, name, lambda name=name: tmp_path / name)
    return folder, played


def judge(folder, **arguments):
    generalisation.main(generalisation.Args(runs=(folder,), episodes=2, **arguments))
    output = folder.parent / "runs" / "generalisation" / "boreal-balanced-v0.csv"
    return stored.read(output).groupby(["split", "policy"])[list(generalisation.RATIOS)].mean()


def test_a_run_is_judged_inside_and_outside(run, capsys):
    folder, played = run
    found = judge(folder)
    shifts = protocol.Task.of("boreal-balanced-v0").shifts
    assert played == [("boreal-balanced-v0", WEIGHTS, 2, shift) for shift in shifts]
    # gains (0, 2), (2, 0) in a scale of 4, of a front (0, 4), (4, 0), (2, 2): no volume above the lowest of all
    assert (found.nhgr == 0).all()
    utility = np.maximum(np.linspace(0, 1, 50), np.linspace(1, 0, 50)).mean()
    of_plans = 4 * utility
    name = next(name for name in found.index.levels[1] if name.endswith("greedy"))
    assert found.eugr["test", name] == pytest.approx(2 * utility / of_plans)
    assert found.eugr[shifts[0], name] == pytest.approx(1 * utility / of_plans)
    out = capsys.readouterr().out
    assert "python analysis/best_plans.py` makes it" in out
    assert "     2     50" in out and "     2     25" in out and "+0.25" in out


def test_ratios_of_archived_runs_lie_by_the_other_studies(run, tmp_path):
    folder, _ = run
    archived = folder.rename(tmp_path / "archive")
    generalisation.main(generalisation.Args(runs=(archived,), episodes=2, split=("calmer",)))
    assert (tmp_path / "studies" / "generalisation" / "boreal-balanced-v0.csv").exists()
    assert not (tmp_path / "runs").exists()


def test_a_run_of_another_physics_is_named(run, capsys):
    folder, _ = run
    config = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps(config | {"physics": "another"}))
    judge(folder, split=("calmer",))
    assert f"{folder}: its test sites are of another source of the simulator" in capsys.readouterr().err


def test_searched_plans_give_rows_of_their_own(run, tmp_path):
    folder, played = run
    table = pd.DataFrame(
        [
            (SEEDS[0], "24", 1, True, 0.0, 8.0),
            (SEEDS[0], "20", 2, True, 8.0, 0.0),
            (SEEDS[0], "12", 3, False, 0.0, 0.0),
        ],
        columns=["seed", "plan", "found", "front", "carbon_return", "thaw_return"],
    )
    stored.write(tmp_path / "studies" / "best_plans" / "boreal-balanced-v0.csv", table, {"physics": "physics"})
    found = judge(folder, split=("validation", "calmer"))
    assert [call[3] for call in played] == ["validation", "calmer"]
    rows = found.loc[generalisation.SEARCHED]
    assert len(rows) == 2 and rows.eugr.tolist() == pytest.approx([0.25, 0.25])


def test_a_split_or_a_run_that_is_not_there(run, tmp_path):
    folder, _ = run
    with pytest.raises(SystemExit, match="--split hotter: allowed are test, validation, warmer_air, .*, outside"):
        judge(folder, split=("hotter",))
    with pytest.raises(SystemExit, match="--episodes 3: .* was evaluated on 2 of the sites"):
        generalisation.main(generalisation.Args(runs=(folder,), episodes=3))
    with pytest.raises(SystemExit, match="--episodes 0: 1 or more are allowed"):
        generalisation.main(generalisation.Args(runs=(folder,), episodes=0))
    with pytest.raises(SystemExit, match="^error: runs: at least one is needed$"):
        generalisation.main(generalisation.Args(runs=()))
    with pytest.raises(SystemExit, match="nowhere: no folder of a run"):
        judge(tmp_path / "nowhere")
    (tmp_path / "config.json").write_text("{")
    with pytest.raises(SystemExit, match=f"{tmp_path}: damaged: config.json"):
        judge(tmp_path)
    with pytest.raises(SystemExit, match="--output .*: the name of a file is allowed"):
        generalisation.main(generalisation.Args(runs=(folder,), output=tmp_path))
