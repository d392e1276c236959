"""Tables of mechanisms: thaw formulations, the growing season, physical conflicts, and the trade-off itself."""

import pandas as pd

from analysis.paper_claims.claim import (
    QUARTER,
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
    within,
)
from analysis.paper_claims.evidence import FRONTS, difference, mean_of, only, optional, seeds
from analysis.studies.mechanism_pairs import PAIRS
from analysis.tables.common import mean_of_years, paper
from analysis.tables.growing_season_correlations import SEASON_PAIRS, correlations
from analysis.tables.thaw_formulations import replicates_of, run_numbers

TITLE = "Physics and mechanisms"
THAW, MAIN = only("main", "thaw"), only("main")
STUDY = "python analysis/studies/mechanism_pairs.py"


def formulation(evidence, name: str, function) -> pd.DataFrame:
    """Numbers of the runs trained on a formulation of the thaw reward, by training seed."""
    found = replicates_of(evidence.results, name)
    if not found:
        raise Missing(f"ppo_gated trained on {name}")
    return pd.DataFrame([function(one) for one in found], index=[one.runs[0].arguments["seed"] for one in found])


def warming(one) -> dict:
    """Heat into the ground under a run's policy [MJ m-2 yr-1]."""
    return mean_of_years(one, ["boundary_warming_mj_m2"])


@claim("The asymmetric thaw reward is the hardest: contrast and raw degree-days score higher.", "Table 3", THAW,
       note="Another formula is another scale: where warming weighs less, the same ground scores higher, whatever was "
            "learnt. Gains over doing nothing, each in the units of its own reward, say more.")
def asymmetric_is_hardest(evidence):
    table = paper("thaw_formulations", index_col="formulation").scalarized_mean
    own = {name: formulation(evidence, name, run_numbers) for name in table.index}
    apart = {name: difference(own[name].scalarized, own["asymmetric"].scalarized)
             for name in ("contrast", "raw_degree_days")}  # fmt: skip
    rows = [Row(f"scalarised, {name.replace('_', ' ')} less asymmetric",
                short(table[name] - table["asymmetric"]), apart[name]) for name in apart]
    rows += [Row(f"gain over zero change, {name.replace('_', ' ')}", "",
                 optional(lambda name=name: seeds(own[name].get("gain_scalarized", pd.Series(dtype=float)))))
             for name in own]  # fmt: skip
    return finding(rows, all_of(*(above(number, what="each difference") for number in apart.values())))


@claim("Under the asymmetric reward agents avoid warming; under raw degree-days they accept it (0.1 against 5.0 MJ).",
       "Table of thaw penalties", THAW,
       why="The site sets the warming flux far more than any policy does, so a penalty on it changes little.")
def asymmetric_avoids_warming(evidence):
    table = paper("thaw_formulations", index_col="formulation").warming_flux_mj
    column = "boundary_warming_mj_m2"
    flux = {name: formulation(evidence, name, warming)[column] for name in ("asymmetric", "raw_degree_days")}
    apart = difference(flux["raw_degree_days"], flux["asymmetric"])
    rows = [Row(f"warming, {name.replace('_', ' ')} [MJ/m2/yr]", short(table[name]), seeds(flux[name]))
            for name in flux]
    papers = table["raw_degree_days"] - table["asymmetric"]
    rows.append(Row("raw degree-days less asymmetric", short(papers), apart))
    return finding(rows, above(apart, least=QUARTER * papers, what="the difference"))


@claim("Agents of the asymmetric reward keep the warming flux near 0.1 MJ.", "Table of thaw penalties", MAIN,
       why="Most of the flux is the site's; zero change has nearly the same.")
def warming_is_small(evidence):
    flux = seeds(formulation(evidence, "asymmetric", warming)["boundary_warming_mj_m2"])
    zero = mean_of_years(evidence.replicates("main", "zero_change")[0], ["boundary_warming_mj_m2"])
    rows = [Row("warming [MJ/m2/yr]", "about 0.1", flux),
            Row("warming of zero change", "", Number(zero["boundary_warming_mj_m2"]))]
    return finding(rows, below(flux, 0.5))


def correlation_claim(variable: str, statement: str, why: str):
    """The claim on a correlation with the growing season."""
    papers = paper("growing_season_correlations", index_col="variable").r
    name = {"thaw_return": "thaw_reward", "latent_heat_mj_m2": "latent_heat",
            "ground_shortwave_mj_m2": "ground_radiation"}[variable]  # fmt: skip

    @claim(statement, "Section 4.4, table of correlations", MAIN, why=why)
    def correlated(evidence):
        tables = {script: evidence.by_seed(correlations, "main", script)
                  for script in ("ppo_curriculum", "zero_change")}  # fmt: skip
        ours = seeds(tables["ppo_curriculum"][variable].astype(float))
        rows = [Row("r, Curriculum PPO", f"{papers[name]:+.2f}".replace("-", "−"), ours),
                Row("r, zero change", "", Number(tables["zero_change"][variable].iloc[0]))]
        if variable == "thaw_return":
            gain = tables["ppo_curriculum"].r_gain.astype(float)
            rows.append(Row("r of the gain over zero change", "", optional(lambda: seeds(gain))))
        return finding(rows, within(ours, papers[name] - 0.15, papers[name] + 0.15, "r"))

    return correlated


ACROSS = "Sites differ in everything at once: a long season is a mild climate."
SEASON_CORRELATIONS = (
    correlation_claim("thaw_return", "Longer growing seasons go with better thaw protection (r = +0.65).",
                      ACROSS + " Mild air above a boundary of fixed temperature drives heat down."),
    correlation_claim("latent_heat_mj_m2", "Longer growing seasons go with more transpiration (r = +0.82).", ACROSS),
    correlation_claim("ground_shortwave_mj_m2",
                      "Longer growing seasons go with less radiation on the ground (r = −0.75).",
                      ACROSS + " Days without snow let more sunlight reach the ground."),
)  # fmt: skip


def effect(evidence, pair: str, variable: str) -> Number:
    """Mean effect of a pair over its sites, upper less lower."""
    table = evidence.study("mechanism_pairs")
    sites = table[table.pair == pair]
    return mean_of((sites[f"upper_{variable}"] - sites[f"lower_{variable}"]).to_numpy(), "sites")


@claim("A longer growing season protects permafrost: leaves for more days.", "Section 4.4, figure 4d", STUDY,
       note="Where the paper correlates across sites, this changes one thing: the dates of leaves, on the same sites "
            "and weathers. Stands are left alone.")
def season_of_leaves(evidence):
    pair = SEASON_PAIRS["leaves"]
    ours = effect(evidence, pair, "thaw_return")
    return finding([Row(f"thaw return, {pair}", "above 0", ours)], above(ours, what="the effect"))


@claim("A longer growing season protects permafrost: a milder climate.", "Section 4.4, figure 4d", STUDY,
       why="A milder climate lengthens the season and warms the ground, and the second outweighs all shading.")
def season_of_climate(evidence):
    pair = SEASON_PAIRS["climate"]
    rows = [Row(f"thaw return, {pair}", "above 0", effect(evidence, pair, "thaw_return")),
            Row("growing season [days]", "longer", effect(evidence, pair, "growing_season_days"))]
    return finding(rows, above(rows[0].ours, what="the effect"))


@claim("A longer season of leaves brings more transpiration and less sun on the ground.", "Section 4.4", STUDY)
def season_and_fluxes(evidence):
    pair = SEASON_PAIRS["leaves"]
    latent, ground = (effect(evidence, pair, name) for name in ("latent_heat_mj_m2", "ground_shortwave_mj_m2"))
    rows = [Row("latent heat [MJ/m2/yr]", "more", latent), Row("shortwave on the ground [MJ/m2/yr]", "less", ground)]
    return finding(rows, all_of(above(latent, what="latent heat"), below(ground, what="shortwave")))


def conflict_claim(variable: str, start: str, statement: str, rule, why: str, beside: str | None = None):
    """The claim on a row of the table of physical conflicts; beside : how another pair, shown too, begins."""
    table = paper("physical_conflicts", index_col="variable").loc[variable]
    pair = next(name for name in PAIRS if name.startswith(start))
    others = [name for name in PAIRS if beside and name.startswith(beside)]

    @claim(statement, "Table of physical conflicts", STUDY, why=why)
    def conflict(evidence):
        carbon, thaw = (effect(evidence, pair, f"{name}_return") for name in ("carbon", "thaw"))
        rows = [Row(f"carbon return, {pair}", table.carbon, carbon), Row("thaw return", table.permafrost, thaw)]
        rows += [Row(what, "", effect(evidence, pair, name)) for name, what in (
            ("boundary_warming_mj_m2", "warming [MJ/m2/yr]"), ("peak_swe_mm", "peak snow [mm]"),
            ("ground_shortwave_mj_m2", "shortwave on the ground [MJ/m2/yr]"))]  # fmt: skip
        rows += [Row(f"{name} return, {other}", "", effect(evidence, other, f"{name}_return"))
                 for other in others for name in ("carbon", "thaw")]  # fmt: skip
        return finding(rows, rule(carbon, thaw))

    return conflict


def opposed(carbon: Number, thaw: Number):
    """Carbon gains, permafrost loses."""
    return all_of(above(carbon, what="carbon"), below(thaw, what="thaw"))


def together(carbon: Number, thaw: Number):
    """Both gain."""
    return all_of(above(carbon, what="carbon"), above(thaw, what="thaw"))


CONFLICTS = (
    conflict_claim("stem density", "stem density", "More stems store carbon and cost permafrost.", opposed,
                   "Trees of either kind shade the ground and catch snow, which thins what insulates it in winter."),
    conflict_claim("conifer fraction", "conifer fraction", "More conifers store carbon and warm the ground: they "
                   "conflict directly.", opposed,
                   "In stands left alone the species hardly differ in carbon; planted, deciduous trees take up more. "
                   "Conifers build the thicker organic layer, which insulates more when thawed than when frozen; "
                   "without it deciduous trees protect better at most sites tried (see where the objectives conflict, "
                   "in `docs/model.md`).", "planting 100"),
    conflict_claim("LAI", "LAI", "More leaf area serves both objectives.", together,
                   ""),
)  # fmt: skip


@claim("Carbon and permafrost conflict: management has to trade one for the other.", "Abstract; section 4.3", FRONTS,
       note="Non-dominated plans of single sites, found by NSGA-II; extents are between the ends of a front, and count "
            "if both are larger than twice their standard error.")
def trade_off(evidence):
    fronts = evidence.beside("fronts/summary.csv")
    wide = ((fronts.carbon_extent > 2 * fronts.carbon_extent_error)
            & (fronts.thaw_extent > 2 * fronts.thaw_extent_error))  # fmt: skip
    rows = [Row(f"sites with a front that is no point, of {len(fronts)}", "all", Number(wide.sum())),
            Row("median extent in carbon return", "", Number(fronts.carbon_extent[wide].median())),
            Row("median extent in thaw return", "", Number(fronts.thaw_extent[wide].median()))]
    return finding(rows, above(Number(wide.mean()), 0.5, what="the share of sites"))


@claim("Management can enhance the protection of permafrost.", "Abstract; section 5", FRONTS)
def management_protects(evidence):
    fronts = evidence.beside("fronts/summary.csv")
    gain = mean_of(fronts.thaw_end_thaw_gain.to_numpy(), "sites")
    rows = [Row("thaw gain over zero change of each site's best plan", "above 0", gain)]
    return finding(rows, above(gain))


@claim("Carbon is stored best by dense stands of conifers.", "Abstract; table of learned strategies", FRONTS,
       why="Deciduous trees close their canopy sooner and use light better, by the constants of the literature.")
def carbon_wants_conifers(evidence):
    fronts = evidence.beside("fronts/summary.csv")
    share = mean_of(fronts.carbon_end_conifer_share.to_numpy(), "sites")
    density = mean_of(fronts.carbon_end_density_stems_ha.to_numpy(), "sites")
    rows = [Row("conifer share of what the carbon end of the front plants", "high", share),
            Row("its density after 50 years [stems/ha]", "high", density)]
    return finding(rows, above(share, 0.5, what="the share of conifers"))


@claim("Mixed species of moderate density protect permafrost best.", "Abstract; section 4.4", FRONTS,
       why="Conifers build the thicker organic layer, which insulates more when thawed than when frozen. Which species "
           "protects better is not robust: see `docs/sensitivity.md`.")
def mixtures_protect(evidence):
    fronts = evidence.beside("fronts/summary.csv")
    ends = {name: fronts[f"thaw_end_{name}"].dropna().to_numpy()
            for name in ("conifer_share", "conifer_fraction", "density_stems_ha")}  # fmt: skip
    fraction = mean_of(ends["conifer_fraction"], "sites")
    rows = [Row("conifer fraction of the stand at the thaw end of the front, last year", "0.6 - 0.65", fraction),
            Row("conifer share of what it plants", "", mean_of(ends["conifer_share"], "sites")),
            Row("its density after 50 years [stems/ha]", "moderate", mean_of(ends["density_stems_ha"], "sites"))]
    return finding(rows, about(fraction, 0.6, 0.65))


CLAIMS = (asymmetric_is_hardest, asymmetric_avoids_warming, warming_is_small, *SEASON_CORRELATIONS, season_of_leaves,
          season_of_climate, season_and_fluxes, *CONFLICTS, trade_off, management_protects, carbon_wants_conifers,
          mixtures_protect)  # fmt: skip
