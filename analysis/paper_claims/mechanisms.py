"""Tables of mechanisms: thaw formulations, the growing season, physical conflicts, and the trade-off itself."""

import numpy as np
import pandas as pd

from analysis.paper_claims.claim import (
    CONTROL,
    LEAST,
    LEVEL,
    QUARTER,
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
    read_twice,
    share,
    short,
    within,
)
from analysis.paper_claims.evidence import FRONTS, difference, mean_of, only, optional, seeds
from analysis.studies.mechanism_pairs import ALL_ON, PAIRS, effects
from analysis.tables.common import paper
from analysis.tables.growing_season_correlations import SEASON_PAIRS, VARIABLES, correlations
from analysis.tables.thaw_formulations import asymmetric_numbers, replicates_of, run_numbers

TITLE = "Physics and mechanisms"
THAW, MAIN = only("main", "thaw"), only("main")
STUDY = "python analysis/studies/mechanism_pairs.py"


def formulation(evidence, name: str, function) -> pd.DataFrame:
    """Numbers of the runs trained on a formulation of the thaw reward, by training seed."""
    found = replicates_of(evidence.results, name)
    if not found:
        raise Missing(f"ppo_gated trained on {name}")
    return pd.DataFrame([function(one) for one in found], index=[one.runs[0].arguments["seed"] for one in found])


def gains_of(evidence, name: str) -> pd.Series:
    """Gain, under the asymmetric reward, of the runs trained on a formulation, by training seed."""
    table = formulation(evidence, name, lambda one: asymmetric_numbers(evidence.results, one))
    if "asymmetric_gain" not in table:
        raise Missing("zero_change on the same episodes")
    return table.asymmetric_gain


def warming(one) -> dict:
    """Heat into the ground under a run's policy [MJ m-2 yr-1]."""
    return one.mean_of_years(["boundary_warming_mj_m2"])


@claim(
    "The asymmetric thaw reward is the hardest: contrast and raw degree-days score higher, if only marginally.",
    "Table 3",
    THAW,
    note="Judged by gains over doing nothing under the asymmetric reward, of the same episodes: each formulation has a "
    "unit of its own, and where warming weighs less the same ground returns more, whatever was learnt. No least "
    "effect is asked for, since the paper's is marginal.",
)
def asymmetric_is_hardest(evidence):
    table = paper("thaw_formulations", index_col="formulation").scalarized_mean
    own = {name: formulation(evidence, name, run_numbers) for name in table.index}
    apart = {
        name: difference(own[name].scalarized, own["asymmetric"].scalarized) for name in ("contrast", "raw_degree_days")
    }
    rows = [
        Row(
            f"scalarised, {name.replace('_', ' ')} less asymmetric",
            short(table[name] - table["asymmetric"]),
            apart[name],
        )
        for name in apart
    ]
    gains = {name: gains_of(evidence, name) for name in own}
    rows += [
        Row(f"gain under the asymmetric reward, trained on {name.replace('_', ' ')}", "", seeds(gains[name]))
        for name in gains
    ]
    more = {name: difference(gains[name], gains["asymmetric"]) for name in apart}
    rows += [Row(f"gain, {name.replace('_', ' ')} less asymmetric", "above 0", more[name]) for name in more]
    answers = (above(number, what="each difference of gains") for number in more.values())
    return finding(rows, all_of(*answers))


@claim("Carbon is the same under all three thaw rewards: 7.8, 7.6 and 7.9.", "Table 3", THAW)
def carbon_is_the_same(evidence):
    table = paper("thaw_formulations", index_col="formulation").carbon_mean
    own = {name: formulation(evidence, name, run_numbers).carbon for name in table.index}
    rows = [Row(f"carbon return, {name.replace('_', ' ')}", f"{table[name]:g}", seeds(own[name])) for name in own]
    apart = {name: difference(own[name], own["asymmetric"]) for name in ("contrast", "raw_degree_days")}
    rows += [
        Row(f"{name.replace('_', ' ')} less asymmetric", short(table[name] - table["asymmetric"]), apart[name])
        for name in apart
    ]
    return finding(rows, all_of(*(within(number, -LEAST, LEAST, "each difference") for number in apart.values())))


TABLE_3 = {
    "scalarized_sd": ("sd over episodes", "scalarized_std"),
    "carbon_sd": ("sd of carbon", "carbon_std"),
    "thaw": ("thaw return", "thaw_mean"),
    "thaw_sd": ("sd of thaw", "thaw_std"),
    "hypervolume": ("hypervolume of returns", "hypervolume"),
    "sparsity": ("sparsity of returns", "sparsity"),
}


@claim(
    "Thaw returns are 1.5, 2.1 and 2.4, hypervolumes 23.6, 25.4 and 26.1, sparsities 0.09, 0.08 and 0.08.",
    "Table 3",
    THAW,
    note="The columns of the table that the claims above have not. A sparsity is of a front of two points or more.",
    kind=LEVEL,
)
def columns_of_table_3(evidence):
    table, rows = paper("thaw_formulations", index_col="formulation"), []
    for name in table.index:
        own = formulation(evidence, name, run_numbers)
        rows += [
            Row(f"{what}, {name.replace('_', ' ')}", f"{table[theirs][name]:g}", optional(lambda c=own[c]: seeds(c)))
            for c, (what, theirs) in TABLE_3.items()
        ]
    return finding(rows, about(rows[0].ours, table.scalarized_std.iloc[0]))


@claim(
    "Under the asymmetric reward agents avoid warming; under raw degree-days they accept it (0.1 against 5.0 MJ).",
    "Table of thaw penalties",
    THAW,
    why="The site sets the warming flux far more than any policy does, so a penalty on it changes little.",
)
def asymmetric_avoids_warming(evidence):
    table = paper("thaw_formulations", index_col="formulation").warming_flux_mj
    column = "boundary_warming_mj_m2"
    flux = {name: formulation(evidence, name, warming)[column] for name in ("asymmetric", "raw_degree_days")}
    apart = difference(flux["raw_degree_days"], flux["asymmetric"])
    rows = [
        Row(f"warming, {name.replace('_', ' ')} [MJ/m2/yr]", short(table[name]), seeds(flux[name])) for name in flux
    ]
    papers = table["raw_degree_days"] - table["asymmetric"]
    rows.append(Row("raw degree-days less asymmetric", short(papers), apart))
    return finding(rows, above(apart, least=QUARTER * papers, what="the difference"))


@claim(
    "Agents of the asymmetric reward keep the warming flux near 0.1 MJ.", "Table of thaw penalties", MAIN, kind=LEVEL
)
def warming_is_small(evidence):
    flux = seeds(formulation(evidence, "asymmetric", warming)["boundary_warming_mj_m2"])
    zero = evidence.replicates("main", "zero_change")[0].mean_of_years(["boundary_warming_mj_m2"])
    rows = [
        Row("warming [MJ/m2/yr]", "about 0.1", flux),
        Row("warming of zero change", "", Number(zero["boundary_warming_mj_m2"])),
    ]
    return finding(rows, below(flux, 0.5))


def correlation(by_seed: pd.Series, sites: int) -> Number:
    """A correlation over sites, mean over training seeds, which share the sites, with Fisher's interval."""
    if by_seed.dropna().empty:
        raise Missing("a run that has the number")
    mean = float(by_seed.mean())
    z, half_width = np.arctanh(np.clip(mean, -1 + 1e-9, 1 - 1e-9)), 1.96 / np.sqrt(max(sites - 3, 1))
    low, high = (float(np.tanh(z + side * half_width)) for side in (-1, 1))
    return Number(mean, low, high, "sites", sites)


def correlation_claim(variable: str, statement: str, why: str):
    """The claim on a correlation with the growing season, by the paper's definition: days between leaf dates."""
    papers = paper("growing_season_correlations", index_col="variable").r
    name = VARIABLES[variable]

    @claim(
        statement,
        "Section 4.4, table of correlations",
        MAIN,
        why=why,
        note="The paper does not say which season it correlates: that between the dates of leaves, which it observes "
        "as a parameter of the site, or that of warm days, which is the climate's. The paper's sign is judged by both, "
        "over sites: training seeds play the same ones, and say nothing of others.",
    )
    def correlated(evidence):
        tables = {
            script: evidence.by_seed(correlations, "main", script) for script in ("ppo_curriculum", "zero_change")
        }
        replicates = evidence.replicates("main", "ppo_curriculum")
        sites = replicates[0].evaluation.seed.nunique()
        ours, warm = (
            correlation(tables["ppo_curriculum"][name].astype(float), sites) for name in (variable, f"warm_{variable}")
        )
        rows = [
            Row("r, Curriculum PPO", f"{papers[name]:+.2f}".replace("-", "−"), ours),
            Row("r, zero change", "", Number(tables["zero_change"][variable].iloc[0])),
            Row("r with the days above 5 °C, Curriculum PPO", "", warm),
        ]
        if variable == "thaw_return":
            gain = tables["ppo_curriculum"].r_gain.astype(float)
            rows.append(Row("r of the gain over zero change", "", optional(lambda: correlation(gain, sites))))
        with_sign = above if papers[name] > 0 else below
        by_leaves, by_warmth = (
            finding(rows, with_sign(r, least=QUARTER * abs(papers[name]), what="r")) for r in (ours, warm)
        )
        return read_twice(by_leaves, by_warmth, ("By the season of leaves", "By warm days"))

    return correlated


DRAWN = "The dates of leaves are drawn around what the latitude has, and say little of the climate. "
WARM = "By warm days, which are the climate's, a long season is a mild one: "
SEASON_CORRELATIONS = (
    correlation_claim(
        "thaw_return",
        "Longer growing seasons go with better thaw protection (r = +0.65).",
        DRAWN + WARM + "mild air above a boundary of fixed temperature drives heat down.",
    ),
    correlation_claim(
        "latent_heat_mj_m2",
        "Longer growing seasons go with more latent heat (r = +0.82).",
        DRAWN + WARM + "warm air evaporates more.",
    ),
    correlation_claim(
        "ground_shortwave_mj_m2",
        "Longer growing seasons go with less radiation on the ground (r = −0.75).",
        DRAWN + WARM + "days without snow let more sunlight reach the ground.",
    ),
)


WITHOUT = {"fire": "fire", "interception": "interception", "moss": "moss and organic layer"}


def effect(evidence, pair: str, variable: str, off: str = ALL_ON) -> Number:
    """Mean effect of a pair over its sites, upper less lower, with a mechanism switched off."""
    return mean_of(effects(evidence.study("mechanism_pairs"), pair, variable, off), "sites")


@claim(
    "A longer growing season protects permafrost: leaves for more days.",
    "Section 4.4, figure 4d",
    STUDY,
    note="Where the paper correlates across sites, this changes one thing: the dates of leaves, on the same sites "
    "and weathers. Stands are left alone. In autumn, which has most of the effect, it is by the snow that late leaves "
    "catch: without interception it has the other sign, so that shade and transpiration, which the paper names, do not "
    "explain it. In spring it stays without interception, as the paper has it.",
)
def season_of_leaves(evidence):
    pair = SEASON_PAIRS["leaves"]
    ours = effect(evidence, pair, "thaw_return")
    rows = [
        Row(f"thaw return, {pair}", "above 0", ours),
        Row("without interception", "", effect(evidence, pair, "thaw_return", "interception")),
    ]
    for part in ("leaves 20 days earlier in spring", "leaves 20 days longer in autumn"):
        rows.append(Row(f"thaw return, {part}", "", effect(evidence, part, "thaw_return")))
        rows.append(Row("without interception", "", effect(evidence, part, "thaw_return", "interception")))
    return finding(rows, above(ours, what="the effect"))


@claim(
    "A longer growing season protects permafrost: more warm days, in a milder climate.",
    "Section 4.4, figure 4d (our control)",
    STUDY,
    why="Leaves come and go on the same dates; air that is milder above a boundary that does not follow drives "
    "heat down.",
    note="The paper's season is between the dates of leaves, which the claim before this one changes.",
    kind=CONTROL,
)
def season_of_climate(evidence):
    pair = SEASON_PAIRS["climate"]
    rows = [
        Row(f"thaw return, {pair}", "above 0", effect(evidence, pair, "thaw_return")),
        Row("growing season [days]", "longer", effect(evidence, pair, "growing_season_days")),
    ]
    return finding(rows, above(rows[0].ours, what="the effect"))


@claim("A longer season of leaves brings more transpiration and less sun on the ground.", "Section 4.4", STUDY)
def season_and_fluxes(evidence):
    pair = SEASON_PAIRS["leaves"]
    water, ground = (effect(evidence, pair, name) for name in ("transpiration_mm", "ground_shortwave_mj_m2"))
    rows = [
        Row("transpiration [mm/yr]", "more", water),
        Row("shortwave on the ground [MJ/m2/yr]", "less", ground),
        Row("latent heat [MJ/m2/yr]", "", effect(evidence, pair, "latent_heat_mj_m2")),
    ]
    return finding(rows, all_of(above(water, what="transpiration"), below(ground, what="shortwave")))


def off(evidence, pair: str, objective: str, mechanism: str) -> Row:
    """The line of a pair's effect with a mechanism switched off."""
    return Row(
        f"{objective} return without {WITHOUT[mechanism]}", "", effect(evidence, pair, f"{objective}_return", mechanism)
    )


def conflict_claim(variable: str, start: str, statement: str, rule, why: str, *beside: str):
    """The claim on a row of the table of physical conflicts.

    rule : of its effects on carbon and thaw; None where the pair does not test what the paper means. beside : how other
    pairs, shown too, begin.
    """
    table = paper("physical_conflicts", index_col="variable").loc[variable]
    pair = next(name for name in PAIRS if name.startswith(start))
    others = [name for name in PAIRS if name.startswith(beside)] if beside else []

    @claim(statement, "Table of physical conflicts", STUDY, why=why if rule else "", note="" if rule else why)
    def conflict(evidence):
        carbon, thaw = (effect(evidence, pair, f"{name}_return") for name in ("carbon", "thaw"))
        rows = [Row(f"carbon return, {pair}", table.carbon, carbon), Row("thaw return", table.permafrost, thaw)]
        rows += [
            Row(what, "", effect(evidence, pair, name))
            for name, what in (
                ("boundary_warming_mj_m2", "warming [MJ/m2/yr]"),
                ("active_layer_depth_m", "active layer [m]"),
                ("peak_swe_mm", "peak snow [mm]"),
                ("ground_shortwave_mj_m2", "shortwave on the ground [MJ/m2/yr]"),
                ("gpp_kgc_m2", "gross photosynthesis [kgC/m2/yr]"),
                ("autotrophic_respiration_kgc_m2", "respiration of plants [kgC/m2/yr]"),
            )
        ]
        rows += [
            off(evidence, pair, name, mechanism)
            for name, mechanism in (("carbon", "fire"), ("thaw", "interception"), ("thaw", "moss"))
        ]
        for other in others:
            rows += [
                Row(f"{name} return, {other}", "", effect(evidence, other, f"{name}_return"))
                for name in ("carbon", "thaw")
            ]
            rows += [off(evidence, other, "thaw", mechanism) for mechanism in ("interception", "moss")]
        return finding(rows, rule(carbon, thaw)) if rule else Finding(rows, UNTESTABLE)

    return conflict


STEM_PAIR, PLANTING_PAIR, WEAK_WIND_PAIR = (
    next(name for name in PAIRS if name.startswith(start))
    for start in ("stem density", "planting, none", "in wind of 1 m/s")
)
WITHOUT_SNOW = "thaw return without interception"
IN_WEAK_WIND = f"{WITHOUT_SNOW}, {WEAK_WIND_PAIR}"


def interception_adds(evidence, pair: str) -> Number:
    """What snow caught by the canopy adds to a pair's effect on the thaw return: the effect with it less without."""
    study = evidence.study("mechanism_pairs")
    with_it, without = (effects(study, pair, "thaw_return", off) for off in (ALL_ON, "interception"))
    return mean_of(with_it - without, "sites")


@claim(
    "More stems store carbon; to permafrost they are a benefit by the snow they catch and a cost by what they absorb.",
    "Section 1; table of physical conflicts",
    STUDY,
    why="The rows say which part has the other sign. Carbon is that of stems which are planted: a denser first stand "
    "starts with more and gains less, and the carbon return counts what is gained alone.",
    note="By its introduction less snow on the ground lets the cold in, and large gains of energy in summer can "
    "overwhelm that. Its table has an arrow down, which elsewhere in it is harm, for interception as for absorption, "
    "and calls the conflict complex; the claim is the introduction's. What absorption does is not seen alone: without "
    "interception shade, transpiration, wind and the organic layer are left, too. They help where winds are as "
    "sampled, and harm in weak wind, so the claim is judged by both.",
)
def stems(evidence):
    carbon, thaw = (effect(evidence, STEM_PAIR, f"{name}_return") for name in ("carbon", "thaw"))

    def rest_of(pair):
        return effect(evidence, pair, "thaw_return", "interception")

    caught, rest = interception_adds(evidence, STEM_PAIR), rest_of(STEM_PAIR)
    rows = [
        Row(f"carbon return, {STEM_PAIR}", "", carbon),
        Row("carbon gained [kgC/m2/yr]", "", effect(evidence, STEM_PAIR, "net_carbon_change_kgc_m2")),
        off(evidence, STEM_PAIR, "carbon", "fire"),
        Row("thaw return that interception adds", "benefit (introduction); down (table)", caught),
        Row(WITHOUT_SNOW, "cost (absorption)", rest),
        Row("thaw return, both", "complex", thaw),
        *(
            Row(what, "", effect(evidence, STEM_PAIR, name))
            for name, what in (("active_layer_depth_m", "active layer [m]"), ("peak_swe_mm", "peak snow [mm]"))
        ),
    ]
    for other in (name for name in PAIRS if name.startswith(("planting, none", "in wind"))):
        up = "up (more biomass)" if other == PLANTING_PAIR else ""
        rows += [
            Row(f"{name} return, {other}", papers, effect(evidence, other, f"{name}_return"))
            for name, papers in (("carbon", up), ("thaw", ""))
        ]
        rows.append(Row("thaw return that interception adds there", "", interception_adds(evidence, other)))
        rows.append(Row(f"{WITHOUT_SNOW}, {other}", "", rest_of(other)))
    planted = effect(evidence, PLANTING_PAIR, "carbon_return")
    by_winds = (
        finding(
            rows,
            all_of(
                above(planted, what="carbon of planting"),
                above(caught, what="what interception adds"),
                below(left, what="the rest"),
            ),
        )
        for left in (rest, rest_of(WEAK_WIND_PAIR))
    )
    return read_twice(*by_winds, ("In winds as sampled", "In wind of 1 m/s, of planting"))


def opposed(carbon: Number, thaw: Number):
    """Carbon gains, permafrost loses."""
    return all_of(above(carbon, what="carbon"), below(thaw, what="thaw"))


CONFLICTS = (
    stems,
    conflict_claim(
        "conifer fraction",
        "conifer fraction",
        "More conifers store carbon and warm the ground: they conflict directly.",
        opposed,
        "Stands of conifers left alone burn more (by a hazard that we read as a day's, the paper as a year's), and "
        "where nothing burns what they store is not told from it. Planted, "
        "deciduous trees take up more. Where there is no organic layer, which insulates more when thawed than when "
        "frozen, the sign turns, and planted deciduous trees protect better; whether it is that conifers build a "
        "thicker one was not separated, as a common first layer is soon each species' own (see where the objectives "
        "conflict, in `docs/model.md`).",
        "conifers 0.2",
        "planting 100",
    ),
    conflict_claim(
        "LAI",
        "LAI",
        "More leaf area serves both objectives.",
        None,
        "Leaf area is a trait of the site here: more of it takes up more and respires more still, and does not make "
        "trees grow faster, which is what the paper means. Of its two halves the one on permafrost can be seen.",
    ),
)


@claim(
    "Carbon and permafrost conflict: management has to trade one for the other.",
    "Abstract; section 4.3",
    FRONTS,
    note="Non-dominated plans of single sites, found by NSGA-II; extents are between the ends of a front, which are "
    "chosen on some weathers and measured on others, and count if the intervals of both lie above zero.",
)
def trade_off(evidence):
    fronts = evidence.beside("fronts/summary.csv")
    wide = (fronts.carbon_extent > fronts.carbon_extent_half_width) & (
        fronts.thaw_extent > fronts.thaw_extent_half_width
    )
    wide_share = share(int(wide.sum()), len(fronts), "sites")
    rows = [
        Row("share of sites with a front that is no point", "often", wide_share),
        Row("median extent in carbon return", "", Number(fronts.carbon_extent[wide].median())),
        Row("median extent in thaw return", "", Number(fronts.thaw_extent[wide].median())),
    ]
    return finding(rows, above(wide_share, 0.5, what="the share of sites"))


@claim(
    "Management can enhance the protection of permafrost.",
    "Abstract; section 5",
    MAIN,
    note="Strategies obey masks here, as in our tables. One that does shows that management can. Judged by planting, a "
    "strategy of the paper's that was not sought for a site: the best of many plans gains nearly by construction.",
)
def management_protects(evidence):
    gain, share = thaw_gain(evidence, "plus_100")
    best = optional(lambda: mean_of(evidence.beside("fronts/summary.csv").thaw_end_thaw_gain.to_numpy(), "sites"))
    rows = [
        Row("thaw gain over zero change, +100 a year", "above 0", gain),
        Row("% of episodes in which it gains", "", share),
        Row("thaw gain over zero change, conifer restoration", "", thaw_gain(evidence, "conifer_restoration")[0]),
        Row("the best known plan of each site of `analysis/studies/fronts.py`", "", best),
    ]
    return finding(rows, above(gain, what="the gain of planting"))


def thaw_gain(evidence, script: str) -> tuple[Number, Number]:
    """A fixed strategy's gain in thaw, mean over episodes, and in how many of them it gains [%]."""
    gains = evidence.replicates("main", script)[0].gains
    if gains is None:
        raise Missing("zero_change on the same episodes")
    by_site = gains.groupby("seed").thaw_return.mean()
    return mean_of(by_site, "evaluation episodes"), Number(100 * (by_site > 0).mean())


@claim(
    "Carbon is stored best by dense stands of conifers.",
    "Abstract; table of learned strategies",
    FRONTS,
    why="Deciduous trees close their canopy sooner and use light better, by the constants of the literature.",
)
def carbon_wants_conifers(evidence):
    fronts = evidence.beside("fronts/summary.csv")
    share = mean_of(fronts.carbon_end_conifer_share.to_numpy(), "sites")
    density = mean_of(fronts.carbon_end_density_stems_ha.to_numpy(), "sites")
    rows = [
        Row("conifer share of what the carbon end of the front plants", "high", share),
        Row("its density after 50 years [stems/ha]", "high", density),
    ]
    return finding(
        rows, all_of(above(share, 0.5, what="the share of conifers"), above(density, 1000.0, what="the density"))
    )


@claim(
    "Mixed species of moderate density protect permafrost while they store carbon.",
    "Abstract; section 4.4",
    FRONTS,
    note="The paper says so of its balanced strategy, gives its density no number, and has most cooling with few, "
    "deciduous stems. Beside it stand the thaw ends of our fronts, whose stands are dense. Which species protects "
    "better is not robust: see `docs/sensitivity.md`.",
)
def mixtures_protect(evidence):
    fronts = evidence.beside("fronts/summary.csv")
    fronts = fronts[fronts.thaw_end_thaw_gain > 0.0]
    rows = [
        Row(what, papers, mean_of(fronts[f"thaw_end_{name}"].dropna().to_numpy(), "sites"))
        for name, what, papers in (
            ("conifer_fraction", "conifer fraction of the stand at the thaw end of the front, last year", "0.6 - 0.65"),
            ("conifer_share", "conifer share of what it plants", ""),
            ("density_stems_ha", "its density after 50 years [stems/ha]", "moderate"),
        )
    ]
    return Finding(rows, UNTESTABLE)


CLAIMS = (
    asymmetric_is_hardest,
    carbon_is_the_same,
    columns_of_table_3,
    asymmetric_avoids_warming,
    warming_is_small,
    *SEASON_CORRELATIONS,
    season_of_leaves,
    season_of_climate,
    season_and_fluxes,
    *CONFLICTS,
    trade_off,
    management_protects,
    carbon_wants_conifers,
    mixtures_protect,
)
