import json

import numpy as np
import pandas as pd
import pytest
from tiny_runs import write_run

import boreal_env
import sim
from analysis import experiments, stored
from analysis.results import Results
from analysis.studies import distance_to_best, open_loop
from analysis.studies.distance_to_best import BEST_OF_ALL, BEST_OF_SITE, GAINS
from analysis.tables import distance_to_best as share_table

SITES = (open_loop.FIRST_SITE_SEED + 3, open_loop.FIRST_SITE_SEED + 8)
WEATHERS = (4, 5)


def plans_of(plans: dict) -> pd.DataFrame:
    """(kind, actions) -> mean (carbon, thaw), half a unit more or less on either weather; zero change has -1, -2."""
    rows = [
        {
            "kind": kind,
            "actions": actions,
            "weather": weather,
            "carbon_return": carbon + sign / 2 - 1,
            "thaw_return": thaw + sign / 2 - 2,
        }
        for (kind, actions), (carbon, thaw) in plans.items()
        for weather, sign in zip(WEATHERS, (-1, 1), strict=True)
    ]
    return pd.DataFrame(rows)


HAND = plans_of(
    {
        ("constant", "12 12"): (0, 0),
        ("constant", "24 24"): (1, 2),
        ("constant", "20 20"): (2, -1),
        ("front", "24 20"): (2, 1),
        ("front", "24 24"): (0.5, 4),
        ("front", "20 12"): (3, -2),
    }
)


@pytest.fixture
def fronts_dir(tmp_path, monkeypatch):
    """Fronts of two sites, whose table says that they are of the physics "here"; studies go to a folder of the test."""
    for site in SITES:
        stored.write(tmp_path / "fronts" / f"{site}-all-on.csv", HAND, {"physics": "here", "case": [site, "all on"]})
    monkeypatch.setattr(distance_to_best, "FRONTS_DIR", tmp_path / "fronts")
    monkeypatch.setattr(distance_to_best.open_loop, "fingerprint", lambda: "here")
    monkeypatch.setattr(distance_to_best.paths, "studies", lambda quick: tmp_path / "studies")
    return tmp_path / "fronts"


# ------------------------------------------------------------------------------------------- by hand


def test_gains_and_the_best_of_a_hand_case():
    plans = open_loop.with_gains(HAND)
    zero = plans[plans.actions == "12 12"]
    assert (zero[GAINS] == 0).all(axis=None)
    gains = distance_to_best.gains_of(plans)
    assert gains.shape == (6, 2, 2)
    best = {weight: distance_to_best.best_at(gains, weight)["best_scalarized_gain"] for weight in (0, 0.5, 1)}
    assert best == {0: 4, 0.5: 2.25, 1: 3}
    # the front above (0, -2), its worst in thaw: (2, 1) has 2 x 3, (1, 2) adds 1 x 1, (0.5, 4) 0.5 x 2, (3, -2) nothing
    points, plans = np.array([(1.0, 0.0), (-1.0, 5.0)]), gains.mean(axis=1)
    assert distance_to_best.hypervolume_share(points, plans) == pytest.approx(1 * 2 / 8)
    assert distance_to_best.hypervolume_share(plans, plans) == 1


def test_the_best_constant_plans():
    other = plans_of({("constant", "12 12"): (0, 0), ("constant", "24 24"): (1, -4), ("constant", "20 20"): (1.5, 1)})
    plans = {1: open_loop.with_gains(HAND), 2: open_loop.with_gains(other)}
    table = distance_to_best.constant_plans(plans, (0.0, 1.0)).set_index(["method", "weight", "site"]).sort_index()
    # thaw gains of 24 are 2 and -4, of 20 -1 and 1; carbon gains of 24 are 1 and 1, of 20 2 and 1.5
    of_site, of_all = (table.loc[method, "scalarized_gain"] for method in (BEST_OF_SITE, BEST_OF_ALL))
    assert of_site.loc[0.0].tolist() == [2, 1] and of_site.loc[1.0].tolist() == [2, 1.5]
    assert of_all.loc[0.0].tolist() in ([0, 0], [-1, 1]) and of_all.loc[1.0].tolist() == [2, 1.5]
    assert (table.scalarized_gain_error == 0).all()  # a gain is the same on either weather


def test_where_nothing_can_be_gained_there_is_no_share():
    flat = open_loop.with_gains(plans_of({("constant", "12 12"): (0, 0), ("front", "24 12"): (1, 0)}))
    row = dict.fromkeys(distance_to_best.KEY, "") | {
        "site": 7,
        "carbon_gain": 0.5,
        "thaw_gain": 0.0,
        "scalarized_gain_error": 0.1,
    }
    table = pd.DataFrame([row | {"weight": 0.0, "scalarized_gain": 0.0}, row | {"weight": 1.0, "scalarized_gain": 0.5}])
    share = distance_to_best.complete(table, {7: flat}).set_index("weight").share
    assert np.isnan(share[0.0]) and share[1.0] == 0.5
    assert distance_to_best.complete(table, {7: flat}).hypervolume_share.isna().all()


# -------------------------------------------------------------------------------------------- playing


def test_agents_meet_the_episodes_of_the_plans():
    cases = [(SITES[0], 4), (SITES[1], 5)]
    envs = distance_to_best.OnSites(cases, years=2)
    observations, _ = envs.reset(seed=[1, 2], options={"preference": np.array([0.25, 0.75])})
    played = open_loop.play(
        [sim.sample_site(site) for site, _ in cases], [open_loop.seeds(*case) for case in cases], [[24, 24], [20, 20]]
    )
    names = list(envs.observation_names)
    assert observations[:, 0].tolist() == [0.25, 0.75]
    density = played.start["density_stems_ha"]
    np.testing.assert_allclose(1500 * observations[:, names.index("density")], density, rtol=1e-6)
    first = names.index(f"site_{next(iter(sim.SITE_PARAMETERS))}")
    np.testing.assert_array_equal(observations[:, first:], boreal_env.sample_site_observations(SITES))
    for year in range(2):
        rewards = envs.step(np.array([24, 20]))[1]
        np.testing.assert_allclose(rewards, played.rewards[:, year], rtol=1e-6)


def test_a_strategy_plays_once_for_all_weights(monkeypatch):
    class Short(distance_to_best.OnSites):
        def __init__(self, cases, **kwargs):
            super().__init__(cases, years=2, **kwargs)

    monkeypatch.setattr(distance_to_best, "OnSites", Short)
    plans = {site: open_loop.with_gains(HAND) for site in SITES}
    done = []
    table = distance_to_best.judge(distance_to_best.strategy("zero_change"), {}, plans, (0.0, 1.0), False, done.append)
    assert sum(done) == 4 and len(table) == 4 and set(table.policy) == {"sampled"}
    seeds = [open_loop.seeds(SITES[1], weather) for weather in WEATHERS]
    returns = open_loop.play([sim.sample_site(SITES[1])] * 2, seeds, [[12, 12]] * 2).returns()
    returns -= [[-1.5, -2.5], [-0.5, -1.5]]  # zero change on either weather, as the plans have it
    of_site = table[table.site == SITES[1]]
    np.testing.assert_allclose(of_site[GAINS].to_numpy(), np.tile(returns.mean(axis=0), (2, 1)), atol=2e-6)
    np.testing.assert_allclose(of_site.scalarized_gain, returns.mean(axis=0)[::-1], atol=2e-6)


def test_an_agent_plays_what_it_was_trained_to_observe(tmp_path, monkeypatch):
    monkeypatch.setattr(distance_to_best.protocol, "load_policy", lambda folder: folder)
    for arguments, size in (({}, 105), ({"hide_site": True}, 43)):
        policy, kwargs = distance_to_best.agent_policy(tmp_path, {"script": "ppo_gated", "arguments": arguments})
        envs = distance_to_best.OnSites([(SITES[0], 4)], **kwargs)
        assert policy == tmp_path and envs.reset(seed=0, options={"preference": 0.5})[0].shape == (1, size)


# -------------------------------------------------------------------------------------------- the table


@pytest.fixture
def calls(monkeypatch):
    """Methods evaluated since the list was emptied; evaluation itself is replaced by fixed gains."""
    methods = []

    def judge(policy, kwargs, plans, weights, learnt, played):
        methods.append(policy)
        rows = [
            {"site": site, "policy": kind, "weight": weight, **distance_to_best.means_of(np.ones((2, 2)), weight)}
            for site in plans
            for kind in (("greedy", "sampled") if learnt else ("sampled",))
            for weight in weights
        ]
        return pd.DataFrame(rows)

    monkeypatch.setattr(distance_to_best, "judge", judge)
    monkeypatch.setattr(distance_to_best, "agent_policy", lambda folder, config: (folder.name, {}))
    monkeypatch.setattr(distance_to_best, "strategy", lambda name: name)
    monkeypatch.setattr("analysis.methods.STRATEGIES", ("zero_change",))
    return methods


def add_run(folder, *arguments, **named):
    write_run(folder, *arguments, **named)
    (folder / "policy.pt").touch()


def evaluate(runs, calls, **arguments):
    calls.clear()
    distance_to_best.main(distance_to_best.Args(runs_dir=runs, **arguments))
    return list(calls)


def test_only_what_the_table_lacks_is_evaluated(fronts_dir, calls, tmp_path):
    runs, path = tmp_path / "runs", tmp_path / "studies" / "distance_to_best.csv"
    add_run(runs / "b", "ppo_gated", seed=2)
    write_run(runs / "no agent", "ppo_gated", seed=3)
    add_run(runs / "elsewhere", "ppo_unknown")
    (runs / "damaged").mkdir()
    for name in ("config.json", "evaluation.csv", "policy.pt"):
        (runs / "damaged" / name).touch()
    assert evaluate(runs, calls) == ["zero_change", "b"]
    first = path.read_bytes()
    assert evaluate(runs, calls) == [] and path.read_bytes() == first
    assert evaluate(runs, calls, overwrite=True) == ["zero_change", "b"] and path.read_bytes() == first

    add_run(runs / "a", "ppo_gated", seed=1)
    add_run(runs / "one site", "ppo_gated", seed=1, site_seed=SITES[1])
    add_run(runs / "another site", "ppo_gated", seed=1, site_seed=17)
    add_run(runs / "one weight", "eupg_fixed_lambda", preference=0.5)
    add_run(runs / "one world", "ppo_gated", env_id="boreal-site-specific-v0", site_seed=SITES[1])
    assert evaluate(runs, calls) == ["a", "one site", "one weight"]
    whole = path.read_bytes()
    path.unlink()  # in another order the bytes are the same
    evaluate(runs, calls)
    assert path.read_bytes() == whole

    table = stored.read(path, text=distance_to_best.TEXT)
    assert set(table[table.trained_on != ""].site) == {SITES[1]}
    assert set(table[table.trained_for != ""].weight) == {0.5}
    assert (table[table.trained_for == ""].hypervolume_share.notna()).all()
    agent = table[(table.method == "ppo_gated") & (table.site == SITES[0]) & (table.weight == 0.5)]
    # returns of 1, 1 are gains of 1 over nothing here: of the best 2.25
    assert agent.share.to_numpy() == pytest.approx(np.full(4, 1 / 2.25))


def test_a_run_made_anew_takes_the_place_of_the_old(fronts_dir, calls, tmp_path):
    runs, path = tmp_path / "runs", tmp_path / "studies" / "distance_to_best.csv"
    add_run(runs / "a", "ppo_gated")
    evaluate(runs, calls)
    before = stored.read(path, text=distance_to_best.TEXT)
    config = json.loads((runs / "a" / "config.json").read_text())
    (runs / "a" / "config.json").write_text(json.dumps(config | {"commit": "another"}))
    assert evaluate(runs, calls) == ["a"]
    after = stored.read(path, text=distance_to_best.TEXT)
    assert len(after) == len(before) and set(after.run) & set(before.run) == {""}


def test_refusals(fronts_dir, calls, tmp_path, monkeypatch):
    evaluate(tmp_path / "runs", calls)
    monkeypatch.setattr(distance_to_best, "WEIGHTS", (0.0, 1.0))
    with pytest.raises(SystemExit, match="--overwrite starts over"):
        evaluate(tmp_path / "runs", calls)
    evaluate(tmp_path / "runs", calls, overwrite=True)
    monkeypatch.setattr(distance_to_best.open_loop, "fingerprint", lambda: "another")
    with pytest.raises(SystemExit, match="of another physics; `python analysis/studies/fronts.py`"):
        evaluate(tmp_path / "runs", calls)
    monkeypatch.setattr(distance_to_best, "FRONTS_DIR", tmp_path / "nowhere")
    with pytest.raises(SystemExit, match="no fronts in"):
        evaluate(tmp_path / "runs", calls)


def test_the_table_of_shares(fronts_dir, calls, tmp_path):
    for seed in (1, 2):
        add_run(tmp_path / "runs" / f"all {seed}", "ppo_gated", seed=seed)
    add_run(tmp_path / "runs" / "one", "ppo_gated", site_seed=SITES[1])
    evaluate(tmp_path / "runs", calls)
    results = Results((tmp_path / "runs",), experiments.jobs(), tmp_path / "studies")
    table = share_table.make(results).set_index(["method", "setting", "policy", "sites"])
    row = table.loc[("ppo_gated", "default", "greedy", "2, all")]
    assert row.seeds == 2 and row["share_0.5"] == pytest.approx(100 / 2.25)
    assert row["share_0.5_low"] == row["share_0.5"]
    alone = table.xs("1, with agents of their own", level="sites")
    assert alone.loc[("ppo_gated", "site_seed=one", "greedy")].seeds == 1
    assert alone.loc[("ppo_gated", "default", "greedy")].seeds == 2
    assert table.loc[("zero_change", "", "sampled", "2, all"), "share_1"] == pytest.approx(100 / 3)
    missing = share_table.make(Results((tmp_path / "runs",), experiments.jobs(), tmp_path / "no studies"))
    assert missing.method.tolist() == ["not run yet"]
