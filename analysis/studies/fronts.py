"""How far the two objectives pull apart, site by site: fronts of non-dominated plans, found by NSGA-II.

    python analysis/studies/fronts.py                        # 12 sites that span the ranges
    python analysis/studies/fronts.py --without-mechanisms   # 3 typical ones, each mechanism of the physics off in turn

A plan is an action for every block of five years. It is sought on four weathers of the site and reported on sixteen
others, as returns and as gains: the return less that of zero change on the same weather. A front's ends, the plans with
the highest mean of either return, are chosen on half of the sixteen; their gains and distance are those of the other
half. Needs `pip install -e ".[planners]"`.
A site is one table in results/fronts; a command that was stopped goes on with the next.
"""

import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

import sim
from analysis import paths, stored
from analysis.metrics import hypervolume, is_nondominated
from analysis.studies import genes as plan_genes
from analysis.studies import open_loop
from analysis.studies.genes import Budget
from analysis.studies.open_loop import GAINS, RETURNS, with_gains
from cleanrl_style import protocol
from cleanrl_style.flags import require

YEARS = 50
BLOCK_YEARS = 5
FULL = Budget(population=36, generations=14, weathers=4, report_weathers=16)
SMALL = Budget(population=24, generations=8, weathers=2, report_weathers=6)
QUICK = Budget(population=16, generations=3, weathers=1, report_weathers=2)
ALL_ON = "all on"
STAND = [
    "density_stems_ha",
    "conifer_fraction",
    "planted_stems_ha",
    "planted_conifers_ha",
    "thinned_stems_ha",
    "clipped_thaw_years",
]


@dataclass
class Args:
    """Finds the non-dominated open-loop plans of sites that span the ranges, and what lies on their fronts."""

    sites: int | None = None
    """how many sites (None: 12, or 3 without mechanisms, which is the most)"""
    without_mechanisms: bool = False
    """on each site, all mechanisms on, then each off in turn, with a smaller search"""
    quick: bool = False
    """a search that only shows that everything works, on fewer sites"""
    seed: int = 1
    """of the search"""
    output_dir: Path | None = None
    """folder of the tables (None: results/fronts, or results/quick/fronts)"""


# ------------------------------------------------------------------------------------------------ one site


def study(site_seed: int, budget: Budget, seed: int, years: int, mechanisms=None, played=None) -> pd.DataFrame:
    """Search one site's front; a row for each plan and weather of the report.

    mechanisms : switches, see `sim.Stands`; played : called with the number of episodes just played, if given.
    Columns: kind (front, what the search found, or constant), actions (one a block), weather, RETURNS, STAND.
    """
    from analysis.studies.nsga2 import search

    site = sim.sample_site(site_seed)
    blocks = -(-years // BLOCK_YEARS)
    each = budget.weathers + budget.report_weathers

    def play(genes, weathers):
        plans = plan_genes.plans(genes, BLOCK_YEARS, years).repeat(len(weathers), axis=0)
        seeds = [open_loop.own_seeds(site_seed, weather, each) for weather in weathers] * len(genes)
        episodes = open_loop.play([site] * len(plans), seeds, plans, mechanisms=mechanisms)
        if played:
            played(len(plans))
        return episodes

    def mean_returns(genes):
        return play(genes, range(budget.weathers)).returns().reshape(len(genes), budget.weathers, 2).mean(axis=1)

    found = search(mean_returns, blocks, budget, seed)
    constant = plan_genes.constant_genes(blocks)
    genes = np.concatenate([found, constant])
    weathers = range(budget.weathers, budget.weathers + budget.report_weathers)
    episodes = play(genes, weathers)
    names = [" ".join(map(str, plan)) for plan in plan_genes.plans(genes, 1, blocks)]
    table = pd.DataFrame(
        {
            "kind": np.repeat(["front"] * len(found) + ["constant"] * len(constant), len(weathers)),
            "actions": np.repeat(names, len(weathers)),
            "weather": np.tile(weathers, len(genes)),
        }
    )
    table[RETURNS] = episodes.returns()
    values = (
        episodes.last("density_stems_ha"),
        episodes.last("conifer_fraction"),
        episodes.total("planted_stems_ha"),
        episodes.planted_conifers(),
        episodes.total("thinned_stems_ha"),
        episodes.clipped_years()[:, 1],
    )
    table[STAND] = np.column_stack(values)
    return table


def plan_means(gains: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Means over the weathers of one kind of plans, those that none of the kind dominates, by rising carbon gain."""
    plans = gains[gains.kind == kind].groupby("actions")[RETURNS + GAINS + STAND].mean()
    front = plans[is_nondominated(plans[RETURNS])]
    front = front.assign(conifer_share=front.planted_conifers_ha / front.planted_stems_ha)
    return front.sort_values(GAINS[0])


def timing_share(front: np.ndarray, constant: np.ndarray) -> float:
    """Share of the front's hypervolume in gains that the best constant plans do not reach.

    front, constant : gains (n, 2). Counted from the worst gain of either, or from zero change where that is worse, in
    each objective. Negative where the constant plans, reported on weathers that nobody searched on, come out better.
    """
    reference = np.minimum(np.vstack([front, constant]).min(axis=0), 0.0)
    whole = hypervolume(front, reference)
    return 1.0 - hypervolume(constant, reference) / whole if whole > 0.0 else np.nan


def summarise(table: pd.DataFrame) -> dict:
    """A site's front in a few numbers; its ends are chosen on the first half of the weathers, measured on the others.

    Measured where they are chosen, they would lie apart by chance alone.
    """
    gains = with_gains(table)
    front, constant = plan_means(gains, "front"), plan_means(gains, "constant")
    first, second = np.array_split(np.sort(gains.weather.unique()), 2)
    chosen = plan_means(gains[gains.weather.isin(first)], "front")
    others = gains[(gains.kind == "front") & gains.weather.isin(second)]
    ends = {end: others[others.actions == chosen.index[k]] for end, k in (("thaw_end", 0), ("carbon_end", -1))}
    by_weather = {end: rows.set_index("weather")[GAINS] for end, rows in ends.items()}
    apart = (by_weather["carbon_end"] - by_weather["thaw_end"]) * [1.0, -1.0]
    half_widths = stats.t.ppf(0.975, len(apart) - 1) * apart.std() / np.sqrt(len(apart))
    zero = (others[RETURNS].to_numpy() - others[GAINS].to_numpy()).mean(axis=0)
    summary = {
        "zero_carbon": zero[0],
        "zero_thaw": zero[1],
        "points": len(front),
        "clipped_thaw_years": front.clipped_thaw_years.mean(),
    }
    for name, gain in zip(open_loop.OBJECTIVES, GAINS, strict=True):
        summary[f"{name}_extent"] = apart[gain].mean()
        summary[f"{name}_extent_half_width"] = half_widths[gain]
    summary["timing_share"] = timing_share(front[GAINS].to_numpy(), constant[GAINS].to_numpy())
    for end, rows in ends.items():
        plan = rows[GAINS + STAND].mean()
        plan["conifer_share"] = plan.planted_conifers_ha / plan.planted_stems_ha
        for name in (*GAINS, "conifer_share", "planted_stems_ha", "density_stems_ha", "conifer_fraction"):
            summary[f"{end}_{name}"] = plan[name]
    return summary


# ------------------------------------------------------------------------------------------------ all sites


def cases(args: Args) -> list[tuple[int, str]]:
    """Sites' seeds, and the mechanism that is off on them (or ALL_ON)."""
    if args.without_mechanisms:
        seeds = open_loop.quartile_sites()[: args.sites or (1 if args.quick else None)]
        return [(seed, mechanism) for seed in seeds for mechanism in (ALL_ON, *sim.MECHANISMS)]
    return [(seed, ALL_ON) for seed in open_loop.spanning_sites(args.sites or (2 if args.quick else 12))]


def path_of(folder: Path, site_seed: int, mechanism: str) -> Path:
    """The table of a case."""
    return folder / f"{site_seed}-{mechanism.replace(' ', '-').replace('_', '-')}.csv"


def folder_of(args: Args) -> Path:
    """Where a command's tables are."""
    folder = args.output_dir or paths.results(args.quick) / "fronts"
    return folder / "mechanisms" if args.without_mechanisms else folder


def describe(site_seed: int) -> dict:
    """A site's features and the stand that it starts with."""
    site = sim.sample_site(site_seed)
    start = open_loop.play([site], [open_loop.seeds(site_seed, 0)], np.zeros((1, 0), dtype=int)).start
    stand = {f"start_{name}": start[name][0] for name in ("density_stems_ha", "conifer_fraction", "biomass_kgc_m2")}
    return open_loop.site_features(site) | stand


def most_episodes(budget: Budget) -> int:
    """Episodes of one front; fewer if the last generation has dominated plans."""
    first = len(plan_genes.first_genes(-(-YEARS // BLOCK_YEARS), budget.population, np.random.default_rng(0)))
    searched = first + budget.population * (budget.generations - 1)
    reported = budget.population + len(plan_genes.constant_genes(1))
    return searched * budget.weathers + reported * budget.report_weathers


def main(args: Args) -> None:
    """Search every case that is not finished, write the summary, print it."""
    require("pymoo", extra="planners")
    most = 3 if args.without_mechanisms else open_loop.CANDIDATES
    if args.sites is not None and not 1 <= args.sites <= most:
        sys.exit(f"error: --sites {args.sites}: 1 to {most} are allowed")
    budget = QUICK if args.quick else SMALL if args.without_mechanisms else FULL
    folder, todo = folder_of(args), cases(args)
    settings = {
        "budget": budget._asdict(),
        "seed": args.seed,
        "years": YEARS,
        "block_years": BLOCK_YEARS,
        "columns": RETURNS + STAND,
        "weathers": "each site's own",
    }
    paths.make_writable("--output-dir", folder)
    finished = {case: stored.is_finished(path_of(folder, *case), settings | {"case": case}) for case in todo}
    print(f"{sum(finished.values())} of {len(todo)} fronts are there, in {folder}", flush=True)
    each = most_episodes(budget)
    progress = protocol.Progress("fronts", each * (len(todo) - sum(finished.values())), "episodes")
    for k, case in enumerate(case for case in todo if not finished[case]):
        site_seed, mechanism = case
        switches = None if mechanism == ALL_ON else {mechanism: False}
        table = study(site_seed, budget, args.seed, YEARS, switches, progress.add)
        stored.write(path_of(folder, *case), table, settings | {"case": case})
        progress.add((k + 1) * each - progress.done)  # a search may play fewer

    rows = [
        {
            "site_seed": site_seed,
            "off": mechanism,
            **describe(site_seed),
            **summarise(stored.read(path_of(folder, site_seed, mechanism), text=("actions",))),
        }
        for site_seed, mechanism in todo
    ]
    summary = pd.DataFrame(rows)
    stored.write(folder / "summary.csv", summary, settings | {"arguments": {**asdict(args), "output_dir": None}})
    print_summary(summary)


def print_summary(summary: pd.DataFrame) -> None:
    """The summary, a line a front."""
    print(
        "\n                              boundary  snow    zero change    extent +- 95 %                    clipped"
        "   gains and conifer share at"
    )
    print(
        "site        off             - air [K]  [mm]  carbon   thaw   carbon        thaw    points timing  years"
        "   the thaw end        the carbon end"
    )
    for row in summary.itertuples():
        print(
            f"{row.site_seed}  {row.off:17s} {row.boundary_above_air_k:7.1f} {row.snow_mm_day:5.2f} "
            f"{row.zero_carbon:+7.2f} {row.zero_thaw:+6.1f} "
            f"{row.carbon_extent:6.2f} +-{row.carbon_extent_half_width:4.2f} {row.thaw_extent:5.2f} "
            f"+-{row.thaw_extent_half_width:4.2f} {row.points:4d} {row.timing_share:6.0%} "
            f"{row.clipped_thaw_years:6.1f}   "
            f"{row.thaw_end_carbon_gain:+5.2f} {row.thaw_end_thaw_gain:+6.2f} {row.thaw_end_conifer_share:4.0%}   "
            f"{row.carbon_end_carbon_gain:+5.2f} {row.carbon_end_thaw_gain:+6.2f} "
            f"{row.carbon_end_conifer_share:4.0%}"
        )


if __name__ == "__main__":
    main(protocol.parse(Args))
