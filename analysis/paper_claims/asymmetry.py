"""Section 4.2: carbon is easy to learn, thaw is not; and what agents of one weight do."""

import numpy as np
import pandas as pd

from analysis import metrics
from analysis.experiments import GENERALIST
from analysis.paper_claims.claim import (
    CONTROL,
    LEAST,
    LEVEL,
    QUARTER,
    UNDECIDED,
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
    within,
)
from analysis.paper_claims.evidence import (
    SITES_OF_VARIANCE,
    VARIANCE,
    difference,
    first_and_last,
    mean_of,
    only,
    optional,
    seeds,
    unpaired,
)
from analysis.studies.constant_plans import as_evaluation, best_gains, of_environment
from analysis.tables import single_sites

TITLE = "Learning one objective at a time"
FIXED, SITES = only("main", "fixed"), only("site")
CARBON, THAW = 1.0, 0.0  # weights
OBJECTIVE = {CARBON: "carbon_return", THAW: "thaw_return"}
PART = 0.25  # of what constant plans gain: learnt, if an agent gains more
FEWEST_SITES = 5
NOT_PAIRED = "the same, seeds not paired"
LIMIT = "That a quarter of what the best constant plan gains counts as learnt is our choice; how fast is not judged."

#: What the paper adds to what its thaw agents do.
LACK_OF_LEARNING = (
    'The paper adds that "no strong conclusion can be drawn about the thaw policies as they may be a conservative '
    'result of lack of learning".'
)


def less_nothing(evidence, evaluation: pd.DataFrame, objective: str) -> float:
    """Mean of a return less that of doing nothing on the same episodes."""
    nothing = evidence.replicates("main", "zero_change")[0].evaluation
    if not set(evaluation.seed) <= set(nothing.seed):
        raise Missing("zero_change on the same episodes")
    return metrics.gains(evaluation, nothing)[objective].mean()


def learnt(evidence, weight: float) -> pd.Series:
    """An agent's own return less that of doing nothing, by training seed."""
    return pd.Series(
        {
            run.arguments["seed"]: less_nothing(evidence, run.evaluation, OBJECTIVE[weight])
            for run in evidence.agents("fixed", weight)
        }
    )


def attainable(evidence, weight: float) -> float:
    """What the best constant plan for the weight has over doing nothing."""
    plans = evidence.study("constant_plans")
    best = as_evaluation(of_environment(plans, GENERALIST), (weight,))
    return less_nothing(evidence, best, OBJECTIVE[weight])


def share_learnt(evidence, weight: float) -> pd.Series:
    """Share of the attainable that an agent of one weight has learnt, by training seed."""
    return learnt(evidence, weight) / attainable(evidence, weight)


def rows_of(evidence, weight: float, papers: str) -> list[Row]:
    """The lines of an agent of one weight."""
    name = OBJECTIVE[weight].replace("_", " ")
    return [
        Row(f"{name} less that of doing nothing, same sites", papers, seeds(learnt(evidence, weight))),
        Row("the same of the best constant plan", "", Number(attainable(evidence, weight))),
        Row("share of it learnt", papers, seeds(share_learnt(evidence, weight))),
    ]


@claim(
    "Agents trained for carbon alone learn fast.",
    "Section 4.2, figure 2a",
    FIXED,
    why="EUPG has no baseline: it weighs every action by all that is to come, much of which is the site's.",
    note=LIMIT,
)
def carbon_is_learnt(evidence):
    share = seeds(share_learnt(evidence, CARBON))
    return finding(rows_of(evidence, CARBON, "rises"), above(share, PART, what="the share learnt"))


@claim("Agents trained for thaw alone hardly improve.", "Section 4.2, figure 2a", FIXED, note=LIMIT)
def thaw_is_not_learnt(evidence):
    share = seeds(share_learnt(evidence, THAW))
    return finding(rows_of(evidence, THAW, "hardly rises"), below(share, PART, what="the share learnt"))


@claim(
    "Learning is asymmetric: of what can be gained, agents learn more in carbon than in thaw.",
    "Abstract; section 4.2",
    FIXED,
)
def asymmetry(evidence):
    carbon, thaw = share_learnt(evidence, CARBON), share_learnt(evidence, THAW)
    apart = difference(carbon, thaw)
    rows = [
        Row("share learnt of carbon", "", seeds(carbon)),
        Row("share learnt of thaw", "", seeds(thaw)),
        Row("carbon less thaw", "above 0", apart),
        Row(NOT_PAIRED, "", unpaired(carbon, thaw)),
    ]
    return finding(rows, above(apart, what="the difference"))


@claim(
    "Single sites show the same: carbon is learnt, thaw is not.",
    "Section 4.2, figure 2b",
    SITES,
    note="Fewer than five sites leave it undecided.",
)
def asymmetry_on_single_sites(evidence):
    def progress(weight):
        known = {}
        for run in evidence.agents("site", weight):
            first, last = first_and_last(run, OBJECTIVE[weight])
            spread, _ = first_and_last(run, OBJECTIVE[weight], "std")
            known[run.arguments["site_seed"]] = (last - first) / spread
        return pd.Series(known).replace([np.inf, -np.inf], np.nan).dropna()

    carbon, thaw = progress(CARBON), progress(THAW)
    common = carbon.index.intersection(thaw.index)
    if common.empty:
        raise Missing("agents of both weights on one site")
    apart = mean_of(carbon[common] - thaw[common], "sites")
    unit = "last less first tenth of training, in standard deviations of the first"
    rows = [
        Row(f"carbon: {unit}", "rises", mean_of(carbon, "sites")),
        Row(f"thaw: {unit}", "hardly rises", mean_of(thaw, "sites")),
        Row("carbon less thaw", "above 0", apart),
    ]
    rows += [
        Row(
            f"{name} over zero change in the evaluation, agents of {name} alone",
            "",
            optional(lambda weight=weight: mean_of(own_gains(evidence, weight), "sites")),
        )
        for name, weight in (("carbon", CARBON), ("thaw", THAW))
    ]
    answer = all_of(above(apart, what="the difference"), below(mean_of(thaw, "sites"), 1.0, what="thaw's progress"))
    return Finding(rows, UNDECIDED, answer.rule) if len(common) < FEWEST_SITES else finding(rows, answer)


def own_gains(evidence, weight: float, **flags) -> pd.Series:
    """Gain over zero change in what an agent of one weight was trained for, by the site that it was trained on."""
    gains = single_sites.own_gains(evidence.replicates("site", "eupg_fixed_lambda", **flags), weight)
    if gains.empty:
        raise Missing("zero_change on these sites")
    return gains


def constant_gains(evidence, weight: float) -> pd.Series:
    """What the best constant plan gains over zero change on each of the single sites."""
    return best_gains(evidence.study("constant_plans_of_sites"), OBJECTIVE[weight])


MISSED = "what of the best constant plan's thaw gain agents of thaw alone miss, `--baseline others`"


@claim(
    "Delay by itself keeps thaw from being learnt, where sites and weathers make no noise.",
    "Section 4.2 and 5 (our control, on single sites)",
    only("main", "site"),
    why="Episodes of site-specific mode differ in the agent's actions alone, so there is no noise but theirs; the "
    "delay is there. EUPG weighs every action by all that is to come, and thaw's is large beside what a policy "
    "moves. With the mean of the batch's other episodes taken off the expected gradient is as it is, and the delay "
    "is as it is too.",
    note="The paper names delay and noise together; the noise of sites is judged below.",
    kind=CONTROL,
)
def physics_hides_thaw(evidence):
    gains = {
        (name, baseline): mean_of(own_gains(evidence, weight, **flags), "sites")
        for name, weight in (("thaw", THAW), ("carbon", CARBON))
        for baseline, flags in (("no baseline, as the paper", {}), ("`--baseline others`", {"baseline": "others"}))
    }
    rows = [
        Row(f"{name} over zero change, agents of {name} alone, {baseline}", "", number)
        for (name, baseline), number in gains.items()
    ]
    rows.append(
        Row(
            "thaw over zero change, agents of thaw alone, whole return (`--utility total`)",
            "",
            optional(lambda: mean_of(own_gains(evidence, THAW, utility="total"), "sites")),
        )
    )
    rows += [
        Row(
            f"{name} over zero change of the best of 25 constant plans",
            "",
            optional(lambda weight=weight: mean_of(constant_gains(evidence, weight), "sites")),
        )
        for name, weight in (("thaw", THAW), ("carbon", CARBON))
    ]
    learnt = own_gains(evidence, THAW, baseline="others")
    missed = mean_of((constant_gains(evidence, THAW)[learnt.index] - learnt).dropna(), "sites")
    rows.append(Row(MISSED, "", missed))
    return finding(rows, above(missed, least=LEAST, what="what is not learnt"))


def at_the_end(evidence, weight: float, column: str) -> pd.Series:
    """Mean of a column of the training episodes in the last tenth, by training seed."""
    return pd.Series(
        {run.arguments["seed"]: first_and_last(run, column)[1] for run in evidence.agents("fixed", weight)}
    )


@claim(
    "Carbon agents raise the density to 1280 stems/ha.",
    "Section 4.2, figure 2c",
    FIXED,
    why="Density after fifty years is a balance of planting and self-thinning, whose strength is a property of the "
    "simulator; densities of two simulators need not agree.",
    kind=LEVEL,
)
def carbon_density(evidence):
    density = seeds(at_the_end(evidence, CARBON, "final_density"))
    return finding([Row("stems/ha at an episode's end, last tenth of training", "1280", density)], about(density, 1280))


@claim("Thaw agents stay at 1000 to 1020 stems/ha.", "Section 4.2, figure 2c", FIXED, note=LACK_OF_LEARNING, kind=LEVEL)
def thaw_density(evidence):
    density = seeds(at_the_end(evidence, THAW, "final_density"))
    return finding(
        [Row("stems/ha at an episode's end, last tenth of training", "1000 - 1020", density)],
        about(density, 1000, 1020),
    )


@claim("Carbon agents end with denser stands than thaw agents.", "Section 4.2, figure 2c", FIXED, note=LACK_OF_LEARNING)
def carbon_is_denser(evidence):
    apart = difference(at_the_end(evidence, CARBON, "final_density"), at_the_end(evidence, THAW, "final_density"))
    return finding([Row("stems/ha, carbon less thaw agents", "260 - 280", apart)], above(apart, least=QUARTER * 260))


@claim(
    "Carbon agents leave the conifer fraction as it is.",
    "Section 4.2, figure 2d",
    FIXED,
    why="Deciduous trees use light better and close their canopy sooner, so carbon asks for them.",
)
def carbon_keeps_species(evidence):
    changes = pd.Series(
        {
            run.arguments["seed"]: np.diff(first_and_last(run, "final_conifer_fraction"))[0]
            for run in evidence.agents("fixed", CARBON)
        }
    )
    change = seeds(changes)
    return finding(
        [Row("conifer fraction, last less first tenth of training", "about 0", change)], within(change, -0.05, 0.05)
    )


@claim(
    "Thaw agents make stands deciduous.",
    "Section 4.2, figure 2d",
    FIXED,
    why="Conifers build the thicker organic layer here, which insulates more when thawed than when frozen.",
    note=LACK_OF_LEARNING,
)
def thaw_goes_deciduous(evidence):
    fraction = seeds(at_the_end(evidence, THAW, "final_conifer_fraction"))
    return finding(
        [Row("conifer fraction at an episode's end, last tenth of training", "below 0.5", fraction)],
        below(fraction, 0.5),
    )


@claim("Mixed weights lead to the highest conifer fractions.", "Figure 2d", FIXED)
def mixed_weights_have_most_conifers(evidence):
    ends = {weight: at_the_end(evidence, weight, "final_conifer_fraction") for weight in (THAW, CARBON)}
    inner = [at_the_end(evidence, weight, "final_conifer_fraction") for weight in (0.25, 0.5, 0.75)]
    mixed = pd.concat(inner, axis=1).mean(axis=1)
    apart = {what: difference(mixed, ends[weight]) for what, weight in (("carbon", CARBON), ("thaw", THAW))}
    rows = [Row("conifer fraction of agents of mixed weights, mean", "", seeds(mixed))]
    rows += [Row(f"less that of {what} agents", "above 0", apart[what]) for what in apart]
    return finding(rows, all_of(*(above(number, what="each difference") for number in apart.values())))


def share(evidence, objective: str, component: str) -> Number:
    """Share of a component in the variance of 50-year returns, with its interval over resampled sites."""
    table = evidence.beside("variance/components.csv")
    row = table[(table.value == "return") & (table.objective == objective)].set_index("component").loc[component]
    return Number(row.share, row.share_low, row.share_high, SITES_OF_VARIANCE)


@claim(
    "The site decides about thaw, whatever the management.",
    "Appendix, site influence; section 4.3",
    VARIANCE,
    note="It describes how sites are sampled: boundary and climate are drawn independently of each other.",
)
def site_decides_thaw(evidence):
    site = share(evidence, "thaw", "site")
    rows = [
        Row("share of the site in the variance of thaw returns", "major", site),
        Row("share of the policy", "", share(evidence, "thaw", "policy")),
    ]
    return finding(rows, above(site, 0.5, what="the site's share"))


@claim(
    "Carbon gives clear feedback on actions, thaw a noisy one.",
    "Sections 4.2 and 5",
    VARIANCE,
    note="Over all sites, which is what a policy gradient without a critic sees.",
)
def carbon_feedback_is_clear(evidence):
    carbon, thaw = share(evidence, "carbon", "policy"), share(evidence, "thaw", "policy")
    rows = [
        Row("share of the policy in the variance of carbon returns", "high", carbon),
        Row("share of the policy in the variance of thaw returns", "low", thaw),
        Row("the same on one site: carbon", "", evidence.compared("decided on a site, carbon")),
        Row("thaw", "", evidence.compared("decided on a site, thaw")),
    ]
    return finding(rows, all_of(above(carbon, 0.1, what="carbon's share"), below(thaw, 0.1, what="thaw's share")))


CLAIMS = (
    carbon_is_learnt,
    thaw_is_not_learnt,
    asymmetry,
    asymmetry_on_single_sites,
    physics_hides_thaw,
    carbon_density,
    thaw_density,
    carbon_is_denser,
    carbon_keeps_species,
    thaw_goes_deciduous,
    mixed_weights_have_most_conifers,
    site_decides_thaw,
    carbon_feedback_is_clear,
)
