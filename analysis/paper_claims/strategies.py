"""Section 4.4 and the appendix on demographics: what the methods do with a stand."""

import pandas as pd

from analysis import methods
from analysis.paper_claims.claim import (
    CONTRADICTS,
    IMPLEMENTATION,
    LEAST,
    LEVEL,
    UNTESTABLE,
    Finding,
    Missing,
    Number,
    Row,
    about,
    above,
    all_of,
    below,
    claim,
    finding,
    short,
)
from analysis.paper_claims.evidence import EUPG, WITH_EUPG, difference, first_and_last, only, optional, seeds, unpaired
from analysis.paper_claims.performance import CURRICULUM, GATED, curriculum_beats_gated
from analysis.paper_claims.preference import APART, change, fails_to_follow
from analysis.results import by_year
from analysis.tables.common import paper
from analysis.tables.learned_strategies import numbers

TITLE = "What the methods do with a stand"
MAIN = only("main")
# conifer fractions at evaluation, appendix on demographics
FRACTIONS = {GATED: (0.75, 0.95), CURRICULUM: (0.6, 0.65), EUPG: (0.35, 0.65)}
OLDER = ["deciduous_mature_stems_ha", "deciduous_old_stems_ha"]


def strategy(evidence, script: str, name: str) -> pd.Series:
    """A number of the table of strategies, by training seed."""
    values = evidence.by_seed(numbers, "main", script)[name].astype(float).dropna()
    if values.empty:
        raise Missing(f"an annual record of {script}")
    return values


@claim(
    "PPO Gated ends with the highest conifer fraction (0.75 to 0.95), Curriculum PPO with 0.6 to 0.65, EUPG with "
    "0.35 to 0.65.",
    "Section 4.4, figure 4a; appendix, demographics",
    WITH_EUPG,
    kind=LEVEL,
)
def conifer_fractions(evidence):
    ours = {script: seeds(strategy(evidence, script, "final_conifer_fraction")) for script in FRACTIONS}
    rows = [
        Row(f"conifer fraction in the last year, {methods.title(script)}", f"{low} - {high}", ours[script])
        for script, (low, high) in FRACTIONS.items()
    ]
    answers = (about(ours[script], *FRACTIONS[script], what=methods.title(script)) for script in FRACTIONS)
    return finding(rows, all_of(*answers))


def ordered(evidence, name: str, first: str, second: str, what: str, papers: str = "above 0", least=None):
    """The finding on one method having more of something than another."""
    values = {script: strategy(evidence, script, name) for script in (first, second)}
    apart = (unpaired if EUPG in values else difference)(values[first], values[second])
    rows = [Row(f"{what}, {methods.title(script)}", "", seeds(values[script])) for script in values]
    rows.append(Row("difference", papers, apart))
    return finding(rows, above(apart, least=least, what="the difference"))


@claim(
    "PPO Gated has more conifers than Curriculum PPO.",
    "Section 4.4, figure 4a",
    MAIN,
    why="Both are the same agent; the curriculum is trained on a part of the episodes.",
)
def gated_has_more_conifers(evidence):
    what = "conifer fraction in the last year"
    return ordered(evidence, "final_conifer_fraction", GATED, CURRICULUM, what, "0.1 - 0.35", 0.025)


@claim(
    "PPO Gated keeps denser stands than Curriculum PPO.",
    "Section 4.4, figure 4b, c",
    MAIN,
    why="Both are the same agent; the curriculum is trained on a part of the episodes.",
)
def gated_is_denser(evidence):
    return ordered(evidence, "density", GATED, CURRICULUM, "stems/ha, mean over the years")


@claim("Curriculum PPO keeps denser stands than Variable λ EUPG.", "Section 4.4, figure 4b, c", WITH_EUPG)
def curriculum_is_denser(evidence):
    return ordered(evidence, "density", CURRICULUM, EUPG, "stems/ha, mean over the years")


@claim(
    "Variable λ EUPG falls into inaction: minimal changes.",
    "Section 4.4; table of learned strategies",
    WITH_EUPG,
    note='The appendix says of the same agent that it "exhibits sustained density growth".',
)
def eupg_does_little(evidence):
    done = {
        script: strategy(evidence, script, "planted") + strategy(evidence, script, "thinned")
        for script in (EUPG, GATED, "random_valid")
    }
    apart = seeds(done[EUPG] / done["random_valid"].iloc[0])
    rows = [
        Row(
            f"planted and thinned [stems/ha/yr], {methods.title(script)}",
            "minimal" if script == EUPG else "",
            seeds(done[script]),
        )
        for script in (EUPG, GATED)
    ]
    rows.append(Row("of random valid actions", "", Number(done["random_valid"].iloc[0])))
    rows.append(Row("EUPG over random valid actions", "", apart))
    return finding(rows, below(apart, 0.5, what="the ratio to random actions"))


@claim("PPO Gated plants early and fast; stands thin naturally later.", "Section 4.4, figure 4b", MAIN)
def early_growth(evidence):
    curves = by_year(evidence.replicates("main", GATED), "density_stems_ha")
    decline = seeds(pd.Series(100 * (1 - curves[:, -1] / curves.max(axis=1))))
    peak = seeds(pd.Series(1.0 + curves.argmax(axis=1)))
    rows = [
        Row("year of highest density", "early", peak),
        Row("decline from there to the last year, %", "above 0", decline),
    ]
    early = below(peak, 25.0, what="the year of the peak")
    return finding(rows, all_of(early, above(decline, 1.0, what="the decline")))


def mean_gains(one) -> dict:
    """Mean gains of a replicate over zero change; empty if that was not evaluated."""
    return {} if one.gains is None else one.gains[["carbon_return", "thaw_return"]].mean().to_dict()


def gain(evidence, script: str, objective: str) -> pd.Series:
    """Mean gain in an objective by training seed."""
    table = evidence.by_seed(mean_gains, "main", script)
    if objective not in table:
        raise Missing("zero_change on the same episodes")
    return table[objective]


@claim(
    "PPO Gated farms carbon and fails to protect permafrost.",
    "Section 4.4; table of learned strategies",
    MAIN,
    note="The paper says so beside Curriculum PPO, which protects it.",
)
def gated_fails_permafrost(evidence):
    carbon, thaw = (seeds(gain(evidence, GATED, f"{name}_return")) for name in ("carbon", "thaw"))
    apart = difference(gain(evidence, GATED, "thaw_return"), gain(evidence, CURRICULUM, "thaw_return"))
    rows = [
        Row("carbon gain over zero change", "above 0", carbon),
        Row("thaw gain over zero change", "", thaw),
        Row("thaw gain, Gated less Curriculum", "below 0", apart),
    ]
    fails = below(apart, least=LEAST, what="thaw's difference")
    return finding(rows, all_of(above(carbon, what="carbon's gain"), fails))


@claim(
    "Curriculum PPO protects permafrost better than PPO Gated.",
    "Section 4.4; table of detailed objectives",
    MAIN,
    repeats=curriculum_beats_gated,
)
def curriculum_protects(evidence):
    table = paper("detailed_objectives").groupby("method").thaw_mean.mean()
    papers = table["curriculum_ppo"] - table["ppo_gated"]
    apart = difference(gain(evidence, CURRICULUM, "thaw_return"), gain(evidence, GATED, "thaw_return"))
    rows = [
        Row(f"thaw gain, {methods.title(script)}", "", seeds(gain(evidence, script, "thaw_return")))
        for script in (CURRICULUM, GATED)
    ]
    rows.append(Row("Curriculum less Gated", short(papers), apart))
    return finding(rows, above(apart, least=LEAST, what="the difference"))


def older_deciduous(one) -> dict:
    """Mature and old deciduous stems in the last year, mean over the kept weights."""
    last = one.years[one.years.year == one.years.year.max()]
    return {"stems": last[OLDER].mean().sum()}


@claim("Variable λ EUPG keeps most mature and old deciduous trees.", "Appendix, demographics", WITH_EUPG)
def eupg_keeps_old_trees(evidence):
    stems = {script: evidence.by_seed(older_deciduous, "main", script)["stems"] for script in FRACTIONS}
    apart = [unpaired(stems[EUPG], stems[other]) for other in (GATED, CURRICULUM)]
    rows = [
        Row(f"mature and old deciduous stems/ha, last year, {methods.title(script)}", "", seeds(stems[script]))
        for script in stems
    ]
    rows += [
        Row(f"EUPG less {methods.title(other)}", "above 0", number)
        for other, number in zip((GATED, CURRICULUM), apart, strict=True)
    ]
    return finding(rows, all_of(*(above(number, what="each difference") for number in apart)))


@claim(
    "PPO Gated's density generalises from training to evaluation, Variable λ EUPG's does not.",
    "Appendix, training dynamics",
    WITH_EUPG,
    note="The density in training is of sampled actions, that of the evaluation's annual record of greedy ones; with "
    "the sampled policy's record it could be tested. Training draws new sites in every episode, from the "
    "evaluation's distribution.",
)
def density_generalises(evidence):
    shift = {}
    for script in (GATED, EUPG):
        late = evidence.by_seed(late_density, "main", script)["late"]
        shift[script] = 100 * (strategy(evidence, script, "final_density") / late - 1).abs()
    apart = unpaired(shift[EUPG], shift[GATED])
    rows = [
        Row(
            f"density at evaluation against late training, difference in %, {methods.title(script)}",
            "small" if script == GATED else "large",
            seeds(shift[script]),
        )
        for script in shift
    ]
    rows.append(Row("EUPG less PPO Gated", "above 0", apart))
    return Finding(rows, UNTESTABLE)


def late_density(one) -> dict:
    """Mean density at an episode's end in the last tenth of a run's training [stems ha-1]."""
    return {"late": first_and_last(one.runs[0], "final_density")[1]}


@claim(
    "Carbon's gradient overpowers thaw's in PPO Gated.",
    "Section 4.4; table of learned strategies",
    only("main", "variants", "difficulty"),
    note="The runs log losses, not the gradient of each objective; with the norms of both in every update it could "
    "be tested. What can be seen is what becomes of the policy if advantages are normalised for each objective "
    "apart.",
)
def gradient_dominance(evidence):
    rows = [
        Row(
            f"{name}, weight 1 less weight 0, {what}",
            "",
            optional(lambda n=name, e=experiment, f=flags: seeds(change(evidence, n, e, GATED, **f))),
        )
        for name in ("carbon", "thaw")
        for what, experiment, flags in (
            ("PPO Gated", "main", {}),
            ("per-objective advantages, no entropy bonus", "variants", APART),
        )
    ]
    gradient = evidence.results.study("gradient_noise")
    if gradient is not None:
        script = gradient[(gradient.utility == "future") & (gradient.baseline == "none")].set_index("objective")
        rows += [
            Row(f"square of the noise in EUPG's gradient of {name}, before training", "", Number(script.noise[name]))
            for name in ("carbon", "thaw")
        ]
    return Finding(rows, UNTESTABLE)


@claim(
    "PPO Gated and Curriculum PPO gain more carbon than Variable λ EUPG.", "Appendix, individual objectives", WITH_EUPG
)
def both_gain_more_carbon(evidence):
    gains = {script: gain(evidence, script, "carbon_return") for script in (GATED, CURRICULUM, EUPG)}
    apart = {script: unpaired(gains[script], gains[EUPG]) for script in (GATED, CURRICULUM)}
    rows = [
        Row(f"carbon gain over zero change, {methods.title(script)}", "", seeds(values))
        for script, values in gains.items()
    ]
    rows += [Row(f"{methods.title(script)} less EUPG", "above 0", number) for script, number in apart.items()]
    return finding(rows, all_of(*(above(number, least=LEAST, what="each difference") for number in apart.values())))


eupg_does_not_follow = fails_to_follow(
    EUPG, "Variable λ EUPG fails to follow the preference.", "Abstract; table of learned strategies"
)


@claim(
    "Curriculum PPO's stands allow for longer growing seasons.",
    "Section 4.4",
    MAIN,
    why="The growing season is a parameter of the site in the paper's own observation, between the days of first "
    "growth and of fall; days on which the air is warm enough, as logged here, no stand changes either.",
    kind=IMPLEMENTATION,
)
def longer_season(evidence):
    days = {script: evidence.by_seed(mean_season, "main", script).days for script in (CURRICULUM, "zero_change")}
    apart = Number(days[CURRICULUM].mean() - days["zero_change"].iloc[0])  # exact: no seed and no action changes it
    return finding(
        [Row("growing season less that of zero change, same episodes [days]", "above 0", apart)],
        above(apart, least=1.0, what="the difference"),
        CONTRADICTS,
    )


def mean_season(one) -> dict:
    """Mean growing season of the evaluation's episodes [days]."""
    return {"days": one.evaluation.growing_season_days.mean()}


CLAIMS = (
    conifer_fractions,
    gated_has_more_conifers,
    gated_is_denser,
    curriculum_is_denser,
    eupg_does_little,
    early_growth,
    gated_fails_permafrost,
    curriculum_protects,
    eupg_keeps_old_trees,
    density_generalises,
    gradient_dominance,
    longer_season,
    both_gain_more_carbon,
    eupg_does_not_follow,
)
