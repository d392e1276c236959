"""Gains, the score, the returns that it is measured by, and what a run says of them at its end."""

import sys
import tokenize
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import sim
from cleanrl_style import protocol
from cleanrl_style.protocol import provenance, reference, score, summary, tracking

PAIR = ["carbon", "thaw"]
WEIGHTS = np.array([(0.0, 1.0), (0.5, 0.5), (1.0, 0.0)])
SITES = np.array([-3.0, 0.0, 9.0])  # what two sites give to all


def episodes(carbon, thaw, **columns):
    """An episode on each site, whose returns are the site's and these."""
    return pd.DataFrame({**columns, "seed": range(3), "carbon_return": SITES + carbon, "thaw_return": 2 * SITES + thaw})


# conifers: thaw; deciduous: carbon; half of both; a fixed strategy, which is no constant plan
PLANS = pd.concat(
    [
        episodes(0, 0, plan="12"),
        episodes(0, 4, plan="24"),
        episodes(4, 0, plan="20"),
        episodes(1, 1, plan="22"),
        episodes(9, 9, plan="target_density"),
    ],
    ignore_index=True,
)


def evaluation(policy, carbon, thaw):
    """A policy with these gains at each of the weights."""
    table = pd.concat(
        [episodes(c, t, policy=policy, preference=w[0]) for c, t, w in zip(carbon, thaw, WEIGHTS, strict=True)],
        ignore_index=True,
    )
    table["scalarized_return"] = protocol.scalarize(score.returns_of(table), score.weights_of(table))
    return table


def compare(greedy, sampled=((0, 0, 0), (0, 0, 0))):
    tables = [evaluation(name, *returns) for name, returns in (("greedy", greedy), ("sampled", sampled))]
    return score.Comparison(pd.concat(tables, ignore_index=True), PLANS)


def test_doing_nothing_scores_0_and_the_best_constant_plans_100():
    comparison = compare(greedy=((0, 0, 4), (4, 4, 0)))
    assert comparison.best_plans[0] == "24" and comparison.best_plans[2] == "20"
    assert comparison.by_weight.best.tolist() == [4, 2, 4]
    assert comparison.score("greedy") == pytest.approx(100) and comparison.score("sampled") == 0
    assert comparison.score("best") == 100
    assert comparison.score("plus_100") == pytest.approx(100 * 1 / (10 / 3))


def test_the_score_is_a_ratio_of_means():
    # 8, 1, -2 of 4, 2, 4: not the mean of 200, 50, -50 %
    assert compare(greedy=((0, 1, -2), (8, 1, 0))).score("greedy") == pytest.approx(100 * 7 / 10)


def test_a_weight_at_which_no_plan_gains_does_no_harm():
    worse = PLANS.assign(thaw_return=PLANS.thaw_return.where(PLANS.plan == "12", PLANS.thaw_return - 100))
    comparison = score.Comparison(compare(greedy=((0, 0, 4), (0, 0, 0))).evaluation, worse)
    assert comparison.best_plans[:2] == ["12", "12"]  # to do nothing is a plan
    assert comparison.score("greedy") == pytest.approx(100)
    nothing = score.Comparison(
        comparison.evaluation, PLANS[PLANS.plan.isin(["12", "22"])].assign(carbon_return=0.0, thaw_return=0.0)
    )
    assert np.isnan(nothing.score("best"))


def test_other_weights_are_refused():
    gained = compare(greedy=((0, 0, 4), (4, 4, 0))).gains
    with pytest.raises(ValueError, match="same weights"):
        score.score(gained["greedy"][gained["greedy"].preference > 0], gained["best"])


def test_how_far_the_preference_is_followed():
    assert score.change(compare(greedy=((1, 2, 4), (3, 2, -1))).gains["greedy"]).tolist() == [3, -4]
    three = pd.DataFrame(
        {
            "weight_a": [1.0, 0.0, 0.0],
            "weight_b": [0.0, 1.0, 0.0],
            "weight_c": [0.0, 0.0, 1.0],
            "a_return": [5.0, 1.0, 2.0],
            "b_return": [0.0, 0.0, 0.0],
            "c_return": [1.0, 1.0, 0.0],
        }
    )
    assert score.change(three).tolist() == [3.5, 0, -1]


def test_the_end_of_a_run_says_it(capsys):
    summary.print_score(PAIR, compare(greedy=((0, 1, -2), (8, 1, 0))))
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("SCORE 70 greedy, 0 sampled: 0 is to do nothing")
    rows = [line.split() for line in lines]
    assert ["0.00", "8.00", "0.00", "1.00", "4.00", "plant", "100", "a", "year,", "100", "%", "conifers"] in rows
    assert ["SCORE", "70", "0", "30", "100"] in [row[:5] for row in rows]
    (followed,) = (line for line in lines if line.startswith("Preference 0 to 1 (carbon should rise, thaw fall): "))
    assert "carbon -2.00 (best constant +4.00), thaw -8.00 (best constant -4.00)" in followed
    assert all(len(line) <= 120 for line in lines)


def test_that_nothing_was_learnt_is_said_of_returns_as_they_ship(capsys, monkeypatch):
    stored = PLANS.assign(thaw_return=PLANS.thaw_return + 4e-5)  # of six digits
    monkeypatch.setattr(sys.modules[__name__], "PLANS", stored)
    for gain, said in ((0.0, 1), (0.01, 0)):
        summary.print_score(PAIR, compare(greedy=((gain,) * 3, (gain,) * 3)))
        assert capsys.readouterr().out.count("it has learnt nothing yet") == said
    summary.print_score(PAIR, compare(greedy=((0.0,) * 3, (0.0,) * 3)), trained=False)
    assert "it has learnt nothing yet" not in capsys.readouterr().out


def test_a_run_that_starts_over_is_another_of_weights_and_biases(tmp_path, monkeypatch):
    asked = []
    wandb = SimpleNamespace(
        init=lambda **kwargs: asked.append(kwargs["id"]), errors=SimpleNamespace(UsageError=OSError)
    )
    monkeypatch.setitem(sys.modules, "wandb", wandb)
    args = SimpleNamespace(track=("wandb",), wandb_project_name="p", env_id="e", seed=1)
    for folder in ("run", "run", "other"):
        (tmp_path / folder).mkdir(exist_ok=True)
        tracking.start(args, "script", tmp_path / folder, {}, 0)
    assert asked[0] == asked[1] != asked[2]


def test_a_tracker_has_a_curve_for_each_weight():
    row = {"global_step": 7, "preference": 0.5, "carbon_gain": 1.0, "plan": "x"}
    assert tracking.numbers("validation", row) == {"validation/0.5/carbon_gain": 1.0}
    assert tracking.numbers("episodes", row) == {"episodes/preference": 0.5, "episodes/carbon_gain": 1.0}
    three = {"global_step": 7, "weight_carbon": 0.5, "weight_thaw": 0.25, "weight_timber": 0.25, "thaw_gain": 2.0}
    assert tracking.numbers("validation", three) == {"validation/0.5/0.25/0.25/thaw_gain": 2.0}


# --------------------------------------------------------------------------------------- of which physics


@pytest.fixture
def task(tmp_path, monkeypatch):
    """The default environment, whose shipped table and cache are of the test; measuring is noted, not done."""
    measured = []

    def measure(task, seeds):
        measured.append(seeds)
        return PLANS[PLANS.seed.isin(seeds)].reset_index(drop=True)

    monkeypatch.setattr(reference, "measure", measure)
    monkeypatch.setattr(reference, "cache_folder", lambda: tmp_path / "cache" / "kernels")
    monkeypatch.setattr(reference, "shipped", lambda env_id: tmp_path / f"{env_id}.csv.gz")
    task = protocol.Task.of("boreal-generalist-v0")
    task.__dict__["measured"] = measured  # a frozen dataclass
    return task


def ship(task, physics):
    reference.write(reference.shipped(task.env_id), PLANS, physics)


def test_what_ships_is_used_without_a_word(task, capsys):
    ship(task, reference.fingerprint(task))
    table = reference.reference_returns(task, [2, 0])
    pd.testing.assert_frame_equal(table, PLANS[PLANS.seed != 1].reset_index(drop=True), check_dtype=False)
    assert task.measured == [] and capsys.readouterr().out == ""


def test_a_table_of_another_physics_is_not_used_and_said_so(task, capsys):
    ship(task, "another")
    for _ in range(2):
        reference.reference_returns(task, [0, 1])
    out = capsys.readouterr().out
    assert "are of another physics" in out and out.count("played once") == 1
    assert task.measured == [[0, 1]]  # then kept


def test_kept_returns_that_are_damaged_are_measured_again(task, tmp_path):
    for _ in range(2):
        expected = reference.reference_returns(task, [0, 1])
    (kept,) = (tmp_path / "cache" / reference.FOLDER).iterdir()
    kept.write_bytes(kept.read_bytes()[:-20])
    pd.testing.assert_frame_equal(reference.reference_returns(task, [0, 1]), expected, check_dtype=False)
    assert task.measured == [[0, 1]] * 2 and list(kept.parent.iterdir()) == [kept]


def test_other_episodes_and_environments_are_measured(task):
    ship(task, reference.fingerprint(task))
    reference.reference_returns(task, [0, 99])
    other = protocol.Task.of("boreal-generalist-v0", thaw_formulation="contrast")
    reference.reference_returns(other, [0])
    assert task.measured == [[0, 99], [0]]
    assert reference.reference_returns(protocol.Task.of("toy_env:toy-v0"), [0]) is None


def test_returns_of_a_table_or_a_file_are_not_kept(task, tmp_path):
    """What tells two of them apart is not in their `repr`."""
    scenario = pd.DataFrame({"year": np.arange(2025, 2101), "warming_k": 1.0})
    for arguments in ({"scenario": scenario}, {"timber": str(Path(sim.__file__).with_name("timber_prices.csv"))}):
        assert not all(map(reference.is_plain, arguments.values()))
    other = protocol.Task.of("boreal-balanced-v0", scenario=scenario)
    for _ in range(2):
        reference.reference_returns(other, [0])
    assert task.measured == [[0], [0]]
    assert all(map(reference.is_plain, ({"a": (1.0, None)}, [True, "finland"])))


def test_the_fingerprint_is_of_what_numbers_depend_on(task, monkeypatch):
    physics = reference.fingerprint(task)
    assert physics == reference.fingerprint(
        protocol.Task.of("boreal-generalist-v0", observation_groups=("preference", "state"))
    )
    assert physics != reference.fingerprint(protocol.Task.of("boreal-balanced-v0"))
    source = provenance.bare('"""Of x."""\n\nx = "# 1"  # one\n\n\ndef f():\n    """Two."""\n    return x\n')
    assert source == 'x = "# 1"\ndef f():\n    return x'
    assert provenance.bare("x = 1\n") != provenance.bare("x = 2\n")
    simulator = Path(sim.__file__).parent
    assert all((simulator / name).exists() for name in provenance.NO_PHYSICS)
    for path in simulator.rglob("*.py"):
        with path.open(encoding="utf-8") as file:
            comments = [
                token.string for token in tokenize.generate_tokens(file.readline) if token.type == tokenize.COMMENT
            ]
        found = provenance.TEXT_OR_COMMENT.finditer(path.read_text(encoding="utf-8"))
        assert [one[0] for one in found if one["text"] is None] == comments


def test_the_same_returns_have_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        reference.write(tmp_path / name, PLANS, "physics")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    table, physics = reference.read(tmp_path / "a")
    pd.testing.assert_frame_equal(table, PLANS, check_dtype=False)
    assert physics == "physics"


def test_a_site_that_is_always_the_same_is_measured_once(task):
    one = protocol.Task.of("boreal-site-specific-v0")
    table = reference.reference_returns(one, [0, 1, 2])
    assert task.measured == [[0]] and set(table.seed) == {0, 1, 2}


def test_the_best_plan_is_that_of_the_mean():
    plans = [episodes(0, 0, plan="12"), episodes(np.array([0, 0, 12]), 0, plan="20"), episodes(1, 0, plan="22")]
    plans = pd.concat(plans).assign(carbon_return=lambda table: table.carbon_return - np.tile(SITES, 3))
    assert set(score.best_constant_plans(plans, np.array([[1.0, 0.0]])).plan) == {"20"}


def test_the_hypervolume_of_gains_is_above_doing_nothing():
    gained = pd.DataFrame({"preference": [0.0, 1.0], "carbon_return": [1.0, 2.0], "thaw_return": [3.0, 2.0]})
    assert score.gain_hypervolume(gained) == pytest.approx(5)


def test_as_many_other_weights_are_refused():
    gained = compare(greedy=((0, 0, 4), (4, 4, 0))).gains
    others = gained["greedy"].assign(preference=gained["greedy"].preference.replace(0.5, 0.25))
    with pytest.raises(ValueError, match="same weights"):
        score.score(others, gained["best"])
