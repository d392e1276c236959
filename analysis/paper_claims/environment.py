"""Section 3 and appendix C: spaces, scales, and what an episode can yield."""

import numpy as np

import boreal_env
import sim
from analysis.paper_claims.claim import (
    CONTRADICTS,
    IMPLEMENTATION,
    LEVEL,
    Number,
    Row,
    about,
    all_of,
    claim,
    equals,
    finding,
    within,
)
from analysis.paper_claims.evidence import FRONTS, PAPER_ALONE, VARIANCE
from analysis.tables.common import paper
from sim.state import DAYS

TITLE = "The environment"
# Entries of the observation by component, table 1; the last is left out in site-specific mode.
COMPONENTS = (4, 6, 17, 10, 2, 3, 1, 62)
STEP_MINUTES = 30
OPTIMUM = 50.0


@claim(
    "The 25 actions are unique: five density changes times five conifer fractions.",
    "Section 3.2; table of actions",
    PAPER_ALONE,
    note="Every code is another pair. Without planting or thinning the conifer fraction has nothing to act on, so that "
    "five of them do the same.",
    kind=IMPLEMENTATION,
)
def unique_actions(evidence):
    density, mix = sim.management.decode(np.arange(sim.management.NUM_ACTIONS))
    different = len({(d, m if d else None) for d, m in zip(density, mix, strict=True)})
    codes = Number(sim.management.NUM_ACTIONS)
    unique = len(set(zip(density, mix, strict=True)))
    rows = [
        Row("codes of actions", "25", codes),
        Row("pairs of density change and conifer fraction", "25", Number(unique)),
        Row("actions that can differ in effect", "", Number(different)),
    ]
    return finding(rows, equals(unique, 25, "the number of different pairs"))


@claim(
    "An observation has 105 entries, 43 without the site's parameters.",
    "Table 1; table of the observation",
    kind=IMPLEMENTATION,
)
def observation_entries(evidence):
    entries = len(boreal_env.OBSERVATION_NAMES)
    own = entries - len(sim.OBSERVED_SITE_PARAMETERS)
    rows = [
        Row("entries", f"{sum(COMPONENTS)} by its components", Number(entries)),
        Row("entries without the site", f"{sum(COMPONENTS[:-1])} by its components", Number(own)),
    ]
    whole = equals(sum(COMPONENTS), entries, "the sum of the components")
    return finding(rows, all_of(whole, equals(sum(COMPONENTS[:-1]), own, "that without the site's")))


@claim(
    "The sampling ranges of the site's parameters are listed comprehensively.",
    "Table of sampling ranges",
    PAPER_ALONE,
    note="The ranges that it does not list are those of its published code.",
    kind=IMPLEMENTATION,
)
def listed_parameters(evidence):
    listed = Number(sum("table of sampling ranges" in one.source for one in sim.SITE_PARAMETERS.values()))
    rows = [
        Row("site parameters in the observation", str(COMPONENTS[-1]), Number(len(sim.OBSERVED_SITE_PARAMETERS))),
        Row("of them with a range in the paper", "all", listed),
    ]
    return finding(rows, equals(listed.value, COMPONENTS[-1], "the number listed"), CONTRADICTS)


@claim("A year is 17,520 steps of the physics.", "Appendix, runtime", kind=IMPLEMENTATION)
def steps_of_a_year(evidence):
    ours = Number(DAYS * 24 * 60 // STEP_MINUTES)
    papers = paper("runtime", index_col="quantity").loc["physics_steps_per_year", "low"]
    return finding([Row("steps a year", f"{papers:,.0f}", ours)], equals(ours.value, papers, "the number"))


@claim(
    "Both rewards have comparable scales for optimisation.",
    "Appendix, reward function",
    VARIANCE,
    why="The range of a year's reward is the same by construction; how much of it is used is not. A real stand's "
    "carbon changes by a small part of the scale, while heat through the boundary differs from site to site by "
    "as much as the scale. `boreal-balanced-v0` has the carbon scale at which policies move both alike.",
    kind=IMPLEMENTATION,
)
def comparable_scales(evidence):
    ratio = evidence.compared("thaw over carbon")
    carbon, thaw = (evidence.compared(f"standard deviation, {name}") for name in ("carbon", "thaw"))
    rows = [
        Row("standard deviation of the carbon return, over sites, weathers and policies", "", carbon),
        Row("the same of the thaw return", "", thaw),
        Row("thaw over carbon", "comparable", ratio),
        Row("thaw over carbon, of what the policy decides", "", evidence.compared("thaw over carbon, decided")),
    ]
    return finding(rows, within(ratio, 0.5, 2.0, "thaw over carbon"))


@claim(
    "An optimal policy returns about 50 in either objective over 50 years.",
    "Appendix, reward function",
    FRONTS,
    why="A carbon return of the number of years needs the scale's uptake every year, far more than boreal stands "
    "take up, and would fill both pools to the limits that the reward itself penalises well before the end. "
    "The thaw return is bounded by the heat that the climate drives through the boundary.",
    kind=LEVEL,
)
def optimum(evidence):
    fronts, reward = evidence.beside("fronts/summary.csv"), boreal_env.Reward()
    best = {
        name: Number((fronts[f"zero_{name}"] + fronts[f"{name}_end_{name}_gain"]).max()) for name in ("carbon", "thaw")
    }
    full = (reward.biomass_limit + reward.soil_limit) / reward.carbon_scale
    rows = [
        Row(f"best {name} return of any plan found, on the best of {len(fronts)} sites", "about 50", best[name])
        for name in best
    ]
    rows.append(Row("carbon return of filling empty pools to the paper's limits", "", Number(full)))
    return finding(rows, all_of(*(about(number, OPTIMUM, what=name) for name, number in best.items())))


CLAIMS = (unique_actions, observation_entries, listed_parameters, steps_of_a_year, comparable_scales, optimum)
