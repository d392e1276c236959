import functools
import re
import shutil
from collections import Counter
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tiny_runs import TINY_RUNS, write_run

from analysis import claims, experiments, methods, metrics, stored
from analysis.paper_claims import (
    asymmetry,
    curriculum,
    environment,
    mechanisms,
    paper_itself,
    performance,
    preference,
    speed,
    summary,
)
from analysis.paper_claims.claim import (
    COMPARED,
    CONTRADICTS,
    FAILS,
    HOLDS,
    KINDS,
    LEAST,
    LEVEL,
    NO_RUNS,
    SEEDS,
    UNDECIDED,
    UNTESTABLE,
    Finding,
    Number,
    Row,
    Undefined,
    about,
    above,
    all_of,
    below,
    opposite,
    share,
    short,
    within,
)
from analysis.paper_claims.evidence import Evidence, optional
from analysis.results import Results
from analysis.studies.mechanism_pairs import MEANS, OFF, PAIRS
from cleanrl_style import protocol
from cleanrl_style.protocol.reference import NOTHING, reference_returns

GENERALIST = "boreal-generalist-v0"
ROOT = Path(__file__).parents[1]


def results_of(runs, studies=None, jobs=None):
    return Results((runs,), jobs or experiments.jobs(), studies or runs / "no studies")


@functools.cache
def evidence_of(runs, studies):
    """Read once for all claims of a test, which writes its runs before it asks for the first."""
    return Evidence(results_of(runs, studies))


def found(claim, runs, studies=None):
    """The finding, and what it says of each quantity."""
    finding = claims.judge(claim, evidence_of(runs, studies))
    return finding, {row.what: row.ours for row in finding.rows}


# ------------------------------------------------------------------------------------------- rules


def seeds(value, low, high, count=5):
    return Number(value, low, high, SEEDS, count)


@pytest.mark.parametrize(
    ("number", "least", "holds"),
    [
        (seeds(1, 0.5, 2), None, True),
        (seeds(-1, -2, -0.5), None, False),
        (seeds(0.2, -1, 1), None, None),
        (seeds(0.2, -1, 1), 3.8, False),
        (seeds(1, 0.5, 2), 3.8, False),
        (seeds(0.2, -1, 5), 3.8, None),
        (seeds(1, 0.5, 2, count=2), 3.8, None),
        (Number(1, over=SEEDS, count=1), None, None),
        (Number(1), None, True),
        (Number(np.nan), None, None),
    ],
)
def test_signs(number, least, holds):
    assert above(number, least=least).holds is holds
    assert below(number.mirrored, least=least).holds is holds


def test_a_verdict_needs_both_intervals():
    number = Number(1, 0.5, 2, SEEDS, 5, -0.1, 1.9)
    assert number.ends == (-0.1, 2) and number.mirrored.ends == (-2, 0.1)
    assert above(number).holds is None and within(number, 0, 2).holds is None
    assert str(number) == "1 [−0.1, 2]"


def test_ranges_and_several_parts():
    assert within(seeds(5, 4, 6), 4, 6).holds is True and within(seeds(5, 4, 6), 4.5, 5.5).holds is None
    assert within(seeds(5, 4, 6), 5.5, 7).holds is None
    assert within(seeds(5, 4, 6), 7, 8).holds is False
    assert about(seeds(9, 8.5, 9.2), 8.5).holds is True and about(Number(9.4), 8.5).holds is False
    assert about(Number(-2.7), -2.5).holds is True
    yes, no, open_ = (above(Number(value), limit) for value, limit in ((1, 0), (-1, 0), (np.nan, 0)))
    assert [all_of(yes, one).holds for one in (yes, open_, no)] == [True, None, False]
    assert all_of(open_, no).holds is False
    assert [opposite(one).holds for one in (yes, no, open_)] == [False, True, None]
    assert all_of(yes, above(seeds(1, 0.5, 2, count=2))).waits and not all_of(yes, above(seeds(0, -1, 1))).waits


def test_why_a_claim_fails_is_known():
    opposite_sign, too_small, too_small_or_opposite = seeds(-2, -3, -1), seeds(0.1, 0.05, 0.2), seeds(0, -0.1, 0.1)
    fails = [above(one, least=0.5) for one in (opposite_sign, too_small, too_small_or_opposite)]
    assert [(one.holds, one.small) for one in fails] == [(False, False), (False, True), (False, True)]
    assert below(seeds(-0.1, -0.2, -0.05), least=0.5).small and not below(seeds(2, 1, 3), least=0.5).small
    holds = above(seeds(2, 1, 3), least=0.5)
    assert all_of(fails[1], holds).small and not all_of(*fails).small and not all_of(holds, holds).small


def test_how_much_of_the_smallest_effect_a_failing_interval_reaches():
    far, near = above(seeds(0.1, -0.1, 0.4), least=0.5), above(seeds(0.0, -0.1, 0.1), least=0.5)
    assert (far.reached, near.reached) == pytest.approx((0.8, 0.2))
    assert all_of(far, near).reached == pytest.approx(0.2)  # fails until the least effect is smaller than that
    assert np.isnan([above(seeds(-2, -3, -1), least=0.5).reached, above(seeds(2, 1, 3), least=0.5).reached]).all()
    said = summary.counted(Counter({HOLDS: 1, FAILS: 3}), [far.reached, near.reached])
    assert "3 do not, and" in said and "1 fail since our numbers say otherwise, and 2 since" in said
    assert said.endswith("If a tenth counted, 1 of these 2 would be open.")


def test_a_verdict_of_the_greedy_policies_says_so():
    rows = [Row(performance.SAMPLED, "", seeds(0.1, -1, 1))]
    of_greedy = performance.greedy_finding(rows, above, seeds(2, 1, 3))
    assert of_greedy.verdict == HOLDS and of_greedy.remark.endswith("of the sampled ones: undecided.")
    assert performance.greedy_finding(rows, above, seeds(0.1, -1, 1)).remark == ""
    assert performance.greedy_finding([Row(performance.SAMPLED, "", "not run yet")], above, seeds(2, 1, 3)).remark == ""


def test_numbers_as_text():
    assert [short(x) for x in (-0.123456, 1280.4, 3.8, 0, np.nan)] == ["−0.123", "1,280", "3.8", "0", "?"]
    assert str(seeds(1, -0.5, 2)) == "1 [−0.5, 2]" and seeds(1, 0, 2).basis == "5 training seeds"
    assert str(Number(1, over=SEEDS, count=1)) == "1" and Number(1, over=SEEDS, count=1).basis == "1 training seed"


# ------------------------------------------------------------------------------- the paper by itself


@pytest.mark.parametrize("points", [2, 3, 4])
def test_chance_of_keeping_monotonicity(points):
    orders = [np.diff(order) > 0 for order in permutations(range(points))]
    kept = [(a & b).sum() for a in orders for b in orders]
    counted = np.bincount(kept, minlength=points) / len(kept)
    assert paper_itself.chance_of_kept(points) == pytest.approx(counted)
    assert paper_itself.chance_of_kept(points) @ np.arange(points) == pytest.approx((points - 1) / 4)


def test_slopes_are_tested_against_every_order():
    weights, up = [0.0, 0.5, 1.0], [1.0, 2.0, 3.0]
    table = pd.DataFrame({"lambda_carbon": weights, "carbon_mean": up, "thaw_mean": up[::-1]})
    assert paper_itself.chance_of_slope(table) == pytest.approx(1 / 6)
    assert paper_itself.chance_of_slope(table.assign(carbon_mean=up[::-1], thaw_mean=up)) == 1
    curriculum_ppo = paper_itself.details()["curriculum_ppo"]  # carbon in perfect order, thaw nearly
    assert paper_itself.chance_of_slope(curriculum_ppo) == pytest.approx(1 / 120)


def test_a_fact_has_one_vote():
    every = [one for theme in claims.THEMES for one in theme.CLAIMS]
    again = [one for one in every if one.repeats is not None]
    assert all(one.repeats in every and one.repeats.repeats is None for one in again)
    assert {one.kind for one in every} == {*KINDS}
    findings = {one: claims.Finding([], HOLDS) for one in every}
    assert sum(claims.votes(findings, kind).total() for kind in KINDS) == len(every) - len(again)
    assert sum(one.repeats is performance.curriculum_beats_gated for one in again) == 5
    assert not any(one.kind == LEVEL for one in again)


def test_a_policy_of_one_point_fails_to_follow_everywhere(tmp_path):
    write_run(tmp_path / "collapsed", "ppo_curriculum", 1, (1,) * 3, (2,) * 3, vectorization="lockstep")
    write_run(tmp_path / "follows", "ppo_curriculum", 2, (1, 2, 3), (3, 2, 1), vectorization="lockstep")
    evidence = Evidence(results_of(tmp_path))
    with_ties = preference.violation(evidence, "ppo_curriculum", "violations_or_ties_percent")
    assert with_ties.to_dict() == {1: 100, 2: 0}
    assert preference.violation(evidence, "ppo_curriculum").to_dict() == {2: 0}


def test_intervals_of_correlations_and_shares():
    r = mechanisms.correlation(pd.Series([0.5, 0.5]), 103)
    assert (r.value, r.low, r.high) == (0.5, pytest.approx(0.339, abs=0.001), pytest.approx(0.632, abs=0.001))
    assert r.basis == "103 sites"
    split = share(3, 5, SEEDS)
    assert split.value == 0.6 and split.ends == pytest.approx((0.2307, 0.8824), abs=1e-3)


def test_at_most_half_violated_by_chance():
    # two pairs: the chance that one or both are kept is 1 less that none is
    assert paper_itself.chance_of_at_most(50, 2) == pytest.approx(1 - paper_itself.chance_of_kept(3)[0])
    assert paper_itself.chance_of_at_most(100, 5) == pytest.approx(1)


def test_the_papers_tables(tmp_path):
    verdicts = {claim: found(claim, tmp_path)[0].verdict for claim in paper_itself.CLAIMS}
    contradict = {claim for claim, verdict in verdicts.items() if verdict == CONTRADICTS}
    assert verdicts[paper_itself.control_by_chance] == HOLDS
    assert contradict == {paper_itself.spreads, paper_itself.strategies, paper_itself.gated_warming}
    assert verdicts[paper_itself.hypervolumes] == verdicts[paper_itself.heuristic_hypervolumes] == UNTESTABLE
    assert verdicts[paper_itself.scalarised] == verdicts[paper_itself.violations] == HOLDS
    assert found(paper_itself.hypervolumes, tmp_path)[1]["hypervolume, Curriculum PPO"] == "120 from its details"
    heuristics = found(paper_itself.heuristic_hypervolumes, tmp_path)[1]
    assert heuristics["hypervolume, Zero change (scalarised −2.5)"] == "at most 0 as one point"
    assert heuristics["hypervolume, Target density 1000 (scalarised 4.3)"] == "at most 39.7 as one point"  # 6.3 squared
    # weights 0 and 1 have the spread of thaw and of carbon alone; the means are 7.8 .. 10
    assert "at most 1.65" in found(paper_itself.spreads, tmp_path)[1]["standard deviation, Curriculum PPO"]


def test_actions_and_parameters(tmp_path):
    finding, ours = found(environment.unique_actions, tmp_path)
    assert finding.verdict == HOLDS and ours["actions that can differ in effect"].value == 25 - 4
    assert found(environment.listed_parameters, tmp_path)[1]["of them with a range in the paper"].value == 34
    assert found(environment.steps_of_a_year, tmp_path)[0].verdict == HOLDS


# ------------------------------------------------------------------------------------- runs, by hand


def test_one_seed_is_no_verdict():
    finding, ours = found(performance.CLAIMS[0], TINY_RUNS)
    assert finding.verdict == COMPARED  # a level, whatever the number of seeds
    assert ours["scalarised return"].value == pytest.approx(5 / 3) and ours["scalarised return"].count == 1
    assert ours["the same less zero change, same episodes"].value == pytest.approx(5 / 3)  # (1 + 1 + 3) / 3
    assert ours["share of the site in the variance of thaw returns (`analysis/studies/variance.py`)"] == "not run yet"
    finding, ours = found(preference.curriculum_follows, TINY_RUNS)
    assert finding.verdict == UNDECIDED and finding.waits
    assert [ours[f"{name} return, weight 1 less weight 0"].value for name in ("carbon", "thaw")] == [2, -2]


@pytest.fixture
def five_seeds(tmp_path):
    """Five seeds of the curriculum, at 8.5 to 8.9 for every weight, and of gated PPO, at 4.7."""
    for seed in range(1, 6):
        better = (8.4 + seed / 10,) * 3
        write_run(tmp_path / f"c{seed}", "ppo_curriculum", seed, better, better, vectorization="lockstep")
        write_run(tmp_path / f"g{seed}", "ppo_gated", seed, (4.7,) * 3, (4.7,) * 3, vectorization="lockstep")
    return tmp_path


def test_five_seeds_are_enough(five_seeds):
    finding, ours = found(performance.CLAIMS[0], five_seeds)
    assert finding.verdict == COMPARED and not finding.rule
    assert ours["scalarised return"].value == pytest.approx(8.7) and ours["scalarised return"].low < 8.7
    finding, ours = found(performance.curriculum_beats_gated, five_seeds)
    assert finding.verdict == HOLDS
    assert ours["scalarised, Curriculum less Gated"].value == pytest.approx(4.0)
    assert found(performance.gated_beats_eupg, five_seeds)[0].verdict == NO_RUNS
    # the same at every weight: it does not follow the preference
    assert found(preference.gated_does_not_follow, five_seeds)[0].verdict == HOLDS
    assert found(preference.curriculum_follows, five_seeds)[0].verdict == FAILS


def test_claims_on_eupg_are_undecided_where_masks_decide(five_seeds):
    """Gated's return is 4.7 in the mean; with masks EUPG's is far below it, without masks far above."""
    for seed in range(1, 6):
        write_run(five_seeds / f"e{seed}", "eupg_var_lambda", seed, (0.4,) * 3, (0.4,) * 3, vectorization="lockstep")
    finding, ours = found(performance.gated_beats_eupg, five_seeds)
    assert finding.verdict == HOLDS and finding.remark.endswith(f"EUPG without masks: {NO_RUNS}.")

    flags = {"vectorization": "lockstep", "masks": False}
    for seeds, verdict, remark in (
        ((1, 2, 3), HOLDS, "EUPG without masks: too few training seeds."),
        ((4, 5), UNDECIDED, f"EUPG with masks: {HOLDS}. Without: {FAILS}."),
    ):
        evidence_of.cache_clear()
        for seed in seeds:
            write_run(five_seeds / f"u{seed}", "eupg_var_lambda", seed, (9.0 + seed,) * 3, (9.0,) * 3, **flags)
        finding, ours = found(performance.gated_beats_eupg, five_seeds)
        assert finding.verdict == verdict and finding.remark == remark
    assert ours["scalarised, Gated less EUPG"].low > 0.0
    assert ours["scalarised, Gated less EUPG; EUPG without masks"].high < 0.0
    # a claim on others has one reading, and of a level no verdict is told
    assert found(performance.curriculum_beats_gated, five_seeds)[0].verdict == HOLDS
    finding, ours = found(performance.VALUES[performance.EUPG], five_seeds)
    assert finding.verdict == COMPARED and not finding.remark
    assert ours["scalarised return; EUPG without masks"].value > ours["scalarised return"].value + 5.0


def test_a_claim_fails_by_a_small_effect_if_it_does_in_both_readings():
    row = Row("difference", "", Number(1.0, 0.9, 1.1))
    by_sign, by_size = Finding([row], FAILS), Finding([row], FAILS, small=True, reached=0.5)
    assert not claims.of_both(by_size, by_sign).small
    smaller = claims.of_both(by_size, replace(by_size, reached=0.2))
    assert smaller.small and smaller.reached == 0.2 and smaller.rows == [row]
    assert claims.of_both(by_size, Finding([row], HOLDS)).verdict == UNDECIDED
    untestable = Finding([row], UNTESTABLE)
    assert claims.of_both(untestable, untestable) == untestable


def test_a_claim_on_eupg_names_the_runs_without_masks(tmp_path):
    jobs = experiments.jobs(seeds=[1, 2])
    evidence = Evidence(results_of(tmp_path / "runs", write_everything(tmp_path, jobs), jobs))
    for claim in (claim for theme in claims.THEMES for claim in theme.CLAIMS):
        evidence.asked_for_eupg = False
        claims.measure(claim, evidence)
        assert not evidence.asked_for_eupg or "variants" in claim.command.split()


def test_no_difference_is_not_reproduced(tmp_path):
    for seed in range(1, 6):
        for script in ("ppo_curriculum", "ppo_gated"):
            write_run(tmp_path / f"{script}{seed}", script, seed, (1, 2, 4), (3, 2, 1), vectorization="lockstep")
    finding, ours = found(performance.curriculum_beats_gated, tmp_path)
    assert ours["scalarised, Curriculum less Gated"].ends == (0, 0) and finding.verdict == FAILS
    assert found(preference.curriculum_follows, tmp_path)[0].verdict == HOLDS
    assert found(preference.gated_does_not_follow, tmp_path)[0].verdict == FAILS
    finding, ours = found(preference.gated_always_violates, tmp_path)
    assert ours["violations %"].value == 0 and finding.verdict == FAILS


def test_heuristics_are_paired_over_episodes(tmp_path):
    write_run(tmp_path / "zero", "zero_change", carbon=(0,) * 3, thaw=(0,) * 3)
    write_run(tmp_path / "plus", "plus_100", carbon=(1,) * 3, thaw=(2,) * 3)
    write_run(tmp_path / "penalised", "plus_100", carbon=(-4,) * 3, thaw=(2,) * 3, masks=False)
    finding, ours = found(performance.planting_is_worst, tmp_path)
    # gains 1 and 2 on both episodes: 1.5 over symmetric weights; the paper's plant on when a stand is full, and pay
    assert ours[performance.OBEYING].ends == (1.5, 1.5)
    assert ours["scalarised, +100 a year less zero change"].ends == (-1.0, -1.0)
    assert (finding.verdict, finding.remark) == (UNDECIDED, f"Without masks: {HOLDS}. With masks: {FAILS}.")


def test_that_management_can_is_shown_by_one_strategy_that_does(tmp_path):
    write_run(tmp_path / "zero", "zero_change", carbon=(0,) * 3, thaw=(0,) * 3)
    write_run(tmp_path / "plus", "plus_100", carbon=(-1,) * 3, thaw=(2,) * 3)
    write_run(tmp_path / "conifers", "conifer_restoration", carbon=(0,) * 3, thaw=(-1,) * 3)
    finding, ours = found(mechanisms.management_protects, tmp_path)
    assert finding.verdict == HOLDS and ours["thaw gain over zero change, +100 a year"].value == 2
    assert ours["thaw gain over zero change, conifer restoration"].value == -1


def test_a_sentence_says_what_its_number_is_over():
    sentence = summary.Sentence(performance.curriculum_beats_gated, "x", "Yes", "No", "Open")
    row = Row("x", "4", seeds(1, 0.5, 2, count=3))
    said = sentence.text(7, Finding([row], UNDECIDED))
    both = replace(sentence, beside="y").text(7, Finding([row, Row("y", "", seeds(1, -1, 3))], UNDECIDED))
    assert "the paper's 4; y: 1 [−1, 3]; [claim 7]" in both
    assert said == "Open (x: 1 [0.5, 2] over 3 training seeds, the paper's 4; [claim 7](#claim-7))."


def test_what_is_learnt_is_measured_from_doing_nothing(tmp_path):
    studies = tmp_path / "studies"
    rows = [
        {
            "env_id": GENERALIST,
            "action": action,
            "episode": k,
            "seed": k,
            "carbon_return": 1.0 + (action == 20) + k,
            "thaw_return": -1.0 + k,
        }
        for action in range(15, 25)
        for k in (0, 1)
    ]
    stored.write(studies / "constant_plans.csv", pd.DataFrame(rows), {})
    runs = tmp_path / "runs"
    write_run(runs / "nothing", "zero_change", carbon=(0.5,) * 3, thaw=(-3.5,) * 3)
    for seed in range(1, 6):
        for weight in experiments.WEIGHTS:
            write_run(
                runs / f"{seed}-{weight}",
                "eupg_fixed_lambda",
                seed,
                (1.5,),
                (-3.0,),
                (weight,),
                preference=weight,
                vectorization="lockstep",
            )
    finding, ours = found(asymmetry.carbon_is_learnt, runs, studies)
    # doing nothing: 0.5; the best plan for carbon: 2.5; the agent: 1.5
    assert ours["carbon return less that of doing nothing, same sites"].value == pytest.approx(1)
    assert ours["the same of the best constant plan"].value == pytest.approx(2)
    assert ours["share of it learnt"].value == pytest.approx(0.5) and finding.verdict == HOLDS
    finding, ours = found(asymmetry.thaw_is_not_learnt, runs, studies)
    assert ours["share of it learnt"].value == pytest.approx(0.5 / 3) and finding.verdict == HOLDS
    finding, ours = found(asymmetry.asymmetry, runs, studies)
    assert ours["carbon less thaw"].value == pytest.approx(1 / 3) and finding.verdict == HOLDS


def test_controls_are_told_apart_by_their_flags(tmp_path):
    for seed in range(1, 6):
        for name, script, returns, flags in (
            ("main", "ppo_curriculum", 2, {}),
            ("coin", "ppo_curriculum", 5, {"selector": "coin"}),
            ("half", "ppo_gated", 1, {"total_timesteps": 150_000}),
            ("double", "ppo_gated", 3, {"total_timesteps": 600_000}),
        ):
            write_run(
                tmp_path / f"{name}{seed}",
                script,
                seed,
                (returns,) * 3,
                (returns,) * 3,
                vectorization="lockstep",
                **flags,
            )
    wanted = {curriculum.same_training: (1, HOLDS), curriculum.coin: (-3, FAILS), curriculum.more_data: (-1, FAILS)}
    for claim, (apart, verdict) in wanted.items():
        finding, ours = found(claim, tmp_path)
        assert (ours["difference, paired by seed"].value, finding.verdict) == (apart, verdict)
    finding, _ = found(curriculum.raw_network, tmp_path)
    assert finding.verdict == NO_RUNS and "--raw-selector" in finding.rule


def test_time_from_the_log_and_the_benchmark(five_seeds):
    (five_seeds / "studies").mkdir()
    benchmark = pd.DataFrame(
        [
            ("episode", "50-year episode, 1 stand", 0.3, 0.2, 0.4, 1.0, 7),
            ("episode", "50-year episode, 16 stands in lockstep, each", 0.05, 0.04, 0.06, 1.0, 7),
            ("episode", "50-year episode, python backend", 134.0, 130.0, 140.0, 400.0, 7),
            ("threads", "1 thread, 64 stands", 9.0, 9.0, 9.0, 1.0, 7),
            ("threads", "16 threads, 64 stands", 90.0, 90.0, 90.0, 10.0, 7),
        ],
        columns=["section", "what", "median", "low", "high", "ratio", "repeats"],
    )
    benchmark.to_csv(five_seeds / "benchmark.csv", index=False)
    studies = five_seeds / "studies"
    finding, ours = found(speed.episode, five_seeds, studies)
    assert finding.verdict == HOLDS and ours["one stand [s]"].value == 0.3
    assert found(speed.pure_python, five_seeds, studies)[0].verdict == COMPARED  # 134 s, of another program
    assert found(speed.workers, five_seeds, studies)[0].verdict == HOLDS  # ten times, the paper's least is four
    finding, ours = found(speed.TRAINING[0], five_seeds)
    assert finding.verdict == HOLDS  # 600 + 120 s
    assert ours["hours of 300,000 steps of PPO in lockstep on one core"].value == pytest.approx(0.2)
    assert found(speed.dollars, five_seeds)[1]["USD a training"].value == pytest.approx(0.3 * 0.68)


# ---------------------------------------------------------------------------------- all of it


def training_episodes(steps, seed):
    generator = np.random.default_rng(seed)
    number = 60
    table = pd.DataFrame(
        {
            "global_step": np.linspace(steps / number, steps, number).astype(int),
            "episode": 1,
            "env": 0,
            "site_seed": generator.integers(1000, size=number),
            "preference": 0.5,
        }
    )
    for name in (
        "carbon_return",
        "thaw_return",
        "scalarized_return",
        "final_density",
        "mean_density",
        "final_conifer_fraction",
        "mean_conifer_fraction",
        "score",
    ):
        table[name] = generator.normal(size=number)
    return table.assign(
        threshold=0.5 + 0.001 * generator.integers(3, size=number), selected=generator.integers(2, size=number)
    )


def write_everything(folder, jobs):
    """A finished run of every job and a table of every study, of random numbers."""
    generator = np.random.default_rng(0)
    for number, job in enumerate(jobs):
        if job.is_study:
            continue
        flags = {name: value for name, value in job.flags.items() if name not in ("seed", "run_dir")}
        weights = (flags["preference"],) if "preference" in flags else (0.0, 0.5, 1.0)
        returns = generator.normal(size=(2, len(weights)))
        run = folder / "runs" / str(number)
        write_run(
            run, job.script, job.flags.get("seed", 1), *returns, weights=weights, **{"env_id": job.env_id} | flags
        )
        if "thaw_formulation" in flags:
            table = pd.read_csv(run / "evaluation.csv")
            table.assign(asymmetric_thaw_return=table.thaw_return).to_csv(run / "evaluation.csv", index=False)
        if job.trains:
            training_episodes(flags.get("total_timesteps", 300_000), number).to_csv(run / "episodes.csv", index=False)
    studies = folder / "studies"
    names = ["carbon_return", "thaw_return", "thaw_clipped_years", *MEANS]
    cases = pd.DataFrame([(pair, off) for pair in PAIRS for off in OFF] * 4, columns=["pair", "off"])
    pairs = pd.DataFrame(
        generator.normal(size=(len(cases), 2 * len(names))),
        columns=[f"{side}_{name}" for side in ("lower", "upper") for name in names],
    )
    stored.write(studies / "mechanism_pairs.csv", cases.join(pairs), {})
    of_sites = pd.DataFrame(
        [(site, action, *generator.normal(size=2)) for site in experiments.SITE_SEEDS for action in range(25)],
        columns=["site_seed", "action", "carbon_return", "thaw_return"],
    )
    stored.write(studies / "constant_plans_of_sites.csv", of_sites, {})
    plans = pd.DataFrame(
        [
            (env, action, seed, *generator.normal(size=2))
            for env in (GENERALIST, "boreal-balanced-v0")
            for action in range(15, 25)
            for seed in (0, 1)
        ],
        columns=["env_id", "action", "seed", "carbon_return", "thaw_return"],
    )
    stored.write(studies / "constant_plans.csv", plans, {})
    sites = pd.DataFrame(
        generator.normal(size=(12, 4)), columns=["latitude_deg", "warming_mj_m2", "cooling_mj_m2", "thaw_return"]
    )
    stored.write(studies / "site_warming.csv", sites.assign(seed=[1, 1, 2, 2] * 3, selected=[0, 1] * 6), {})
    write_fronts_and_variance(folder, generator)
    return studies


def write_fronts_and_variance(folder, generator):
    """Both studies beside the others' folder, of random numbers."""
    objectives = ("carbon", "thaw")
    columns = [f"zero_{name}" for name in objectives]
    columns += [f"{name}_{what}" for name in objectives for what in ("extent", "extent_half_width")]
    ends = ("carbon_gain", "thaw_gain", "conifer_share", "conifer_fraction", "density_stems_ha")
    columns += [f"{name}_end_{what}" for name in objectives for what in ends]
    summary = pd.DataFrame(generator.uniform(size=(12, len(columns))), columns=columns)
    stored.write(folder / "fronts" / "summary.csv", summary, {})
    parts = ("site", "weather", "policy", "site x policy", "weather x policy")
    shares = pd.DataFrame(
        [(value, name, part) for value in ("return", "one year") for name in objectives for part in parts],
        columns=["value", "objective", "component"],
    )
    shares["share"] = shares["variance"] = 1 / len(parts)
    shares = shares.assign(share_low=shares.share - 0.05, share_high=shares.share + 0.05)
    stored.write(folder / "variance" / "components.csv", shares, {})
    quantities = ["thaw over carbon", "thaw over carbon, decided"]
    quantities += [f"{what}, {name}" for what in ("standard deviation", "decided on a site") for name in objectives]
    compared = pd.DataFrame({"quantity": quantities, "value": 1.0, "low": 0.9, "high": 1.1})
    stored.write(folder / "variance" / "compared.csv", compared, {})


BENCHMARKED = {speed.episode, speed.pure_python, speed.workers, speed.solver_share, speed.memory, speed.memory_of_all}


def test_the_jobs_fill_every_claim(tmp_path):
    jobs = experiments.jobs(seeds=[1, 2])
    studies = write_everything(tmp_path, jobs)
    evidence = Evidence(results_of(tmp_path / "runs", studies, jobs))
    every = [claim for theme in claims.THEMES for claim in theme.CLAIMS]
    findings = {claim: claims.judge(claim, evidence) for claim in every}
    assert {claim.statement for claim, one in findings.items() if one.verdict == NO_RUNS} == {
        claim.statement for claim in BENCHMARKED
    }  # no benchmark was run
    assert all(one.rows for one in findings.values() if one.verdict != NO_RUNS)
    assert not [row for one in findings.values() for row in one.rows if row.ours == "not run yet"]
    for one in summary.SENTENCES:
        assert one.row in {row.what for row in findings[one.claim].rows}


@pytest.mark.slow
def test_quick_jobs_raise_nothing(tmp_path):
    jobs = experiments.quick_jobs()
    studies = write_everything(tmp_path, jobs)
    text, counts = claims.document(results_of(tmp_path / "runs", studies, jobs))
    assert counts[NO_RUNS] < counts.total() / 3 and "## What has been run" in text


def test_the_document(tmp_path, capsys):
    for name in ("first", "second"):
        claims.main(claims.Args(runs_dir=(TINY_RUNS,), output=tmp_path / name / "claims.md"))
    text = (tmp_path / "first" / "claims.md").read_text()
    assert text == (tmp_path / "second" / "claims.md").read_text()
    numbers = [int(number) for number in re.findall(r"^### (\d+)\. ", text, re.MULTILINE)]
    assert numbers == list(range(1, len(numbers) + 1)) and len(numbers) >= 30
    assert {*re.findall(r"\(#(claim-\d+)\)", text)} == {*re.findall(r'id="(claim-\d+)"', text)}
    facts = sum(one.repeats is None for theme in claims.THEMES for one in theme.CLAIMS)
    assert f"{len(numbers)} claims on {facts} facts:" in text and f": {facts} facts" in capsys.readouterr().out
    assert len(re.findall(r"^\d+\. ", text[: text.index("## How it is judged")], re.MULTILINE)) == 10
    lacking = "Not run yet: `python analysis/reproduce.py --only main controls` (python cleanrl_style/ppo_curriculum.py"
    assert f"{lacking} --seed 1 --vectorization lockstep --selector coin is lacking)" in text
    jobs = [job for job in experiments.jobs(("main",)) if not job.is_study]
    assert f"| `main` | 2 | {len(jobs)} | `constant_plans`" in text


@pytest.mark.slow
def test_the_committed_document_shows_the_committed_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    claims.main(claims.Args(output=tmp_path / "reproduction.md"))
    assert (tmp_path / "reproduction.md").read_bytes() == (ROOT / "docs/reproduction.md").read_bytes()


def test_a_document_of_ones_own_runs_lies_beside_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").mkdir()
    shutil.copytree(TINY_RUNS, tmp_path / "runs")
    claims.main(claims.Args(runs_dir=(Path("runs"),)))
    assert (tmp_path / "runs" / "reproduction.md").is_file() and not any((tmp_path / "docs").iterdir())


def test_a_number_that_runs_do_not_have_is_not_called_not_run():
    def undefined():
        raise Undefined("none: the same returns at every weight")

    assert optional(undefined) == "none: the same returns at every weight"


def test_without_runs_it_says_which_command_makes_them(tmp_path):
    (tmp_path / "none").mkdir()
    claims.main(claims.Args(runs_dir=(tmp_path / "none",), output=tmp_path / "claims.md"))
    assert "Not run yet: `python analysis/reproduce.py --only main`" in (tmp_path / "claims.md").read_text()


def test_prose_has_no_numbers():
    for theme in claims.THEMES:
        for claim in theme.CLAIMS:
            prose = re.sub(r"`[^`]*`", "", claim.why + claim.note)  # but in names of files and environments
            assert not re.search(r"\d", prose), claim.statement


def test_least_effect_is_a_quarter_of_the_best_constant_plans_gain():
    task = protocol.Task.of(GENERALIST)
    plans = reference_returns(task, protocol.evaluation_seeds(task, 200))  # as they ship: nothing is played
    columns = metrics.return_columns(task.objectives)
    nothing = plans[plans.plan == NOTHING].set_index("seed")[columns]
    gains = plans[plans.plan.str.isdigit()].reset_index(drop=True)
    gains[columns] -= nothing.loc[gains.seed].to_numpy()
    best = metrics.best_constant_plans(gains, np.array([[w, 1 - w] for w in experiments.WEIGHTS]))
    assert metrics.mean_scalarized(best) / 4 == pytest.approx(LEAST, abs=0.01)


def test_a_partial_archive_has_a_verdict_where_it_can(tmp_path):
    """Three seeds of one method, fixed strategies, and nothing else: no claim on a training is judged."""
    for script in methods.STRATEGIES:
        write_run(tmp_path / "runs" / script, script)
    for script in experiments.UNMASKED:
        write_run(tmp_path / "runs" / f"{script} unmasked", script, masks=False)
    for seed in (1, 2, 3):
        write_run(tmp_path / "runs" / str(seed), "ppo_gated", seed, vectorization="lockstep")
    results = results_of(tmp_path / "runs", tmp_path / "studies")
    text, _ = claims.document(results)
    assert "Not run yet: `python analysis/reproduce.py --only main" in text
    gated = claims.judge(performance.gated_beats_heuristics, Evidence(results))
    assert gated.verdict == UNDECIDED and gated.waits
    assert claims.judge(performance.curriculum_beats_gated, Evidence(results)).verdict == NO_RUNS
    assert re.search(r"\| `main` \| 11 \| \d+ \| `constant_plans` \(not yet\)", text)
