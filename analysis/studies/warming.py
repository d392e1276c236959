"""How climate change moves what constant plans can reach, and at which warming even the best loses the frozen ground.

    python analysis/studies/warming.py

Every action every year, where it can be carried out, in the world of `boreal-balanced-v0` without a scenario and under
each of the three, from 2025 to 2100, on sites drawn as an episode draws them, one start and weather each; returns are
of the first 50 years. Leaves results/studies/warming.csv, a row a scenario, site and plan, warming_years.csv, a row a
scenario and year, docs/images/warming.png and docs/warming.md, which has it in words.
"""

import textwrap
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import make_scenarios, metrics, paths, stored
from analysis.studies import open_loop
from analysis.tables.common import markdown
from cleanrl_style import protocol
from sim.scenario import FIRST_YEAR, check_scenario
from sim.task.episodes import BALANCED_WORLD

SITES = 32
YEARS = 76
RETURN_YEARS = boreal_env.DEFAULT_YEARS
LAST = 10  # years that a state is a mean of
NEAR_SURFACE_M = 3.0  # near-surface permafrost, as in IPCC AR6 WGI, 9.5.2: of the upper 3 m
NONE, *SCENARIOS = "none", *sim.SCENARIOS
#: Every action but those that change nothing, and that once.
PLANS = [a for a in range(sim.management.NUM_ACTIONS) if sim.management.decode(a)[0] or a == boreal_env.NO_CHANGE]
THAW_DEPTH, DEEP = "active_layer_depth_m", "deep_soil_temperature_c"
#: Ground by its temperature without a scenario [degC]: the table's columns, coldest first.
GROUND = (-np.inf, -4.0, -2.0, np.inf)
GROUND_NAMES = ("colder than -4 °C", "of -4 to -2 °C", "warmer than -2 °C")
PAGE, FIGURE = Path("docs/warming.md"), Path("docs/images/warming.png")


@dataclass
class Args:
    """Plays constant plans without and under the scenarios of climate change."""

    sites: int = SITES
    """sites, drawn as an episode draws them"""
    quick: bool = False
    """3 sites, 6 years, four plans, into results/quick/studies, without page and figure"""


def play(scenario: str, sites: int, years: int, plans: list[int]) -> dict[str, np.ndarray]:
    """What every plan (first axis) gives on every site (second): rewards (.., years, 2) and columns by year."""
    numbers = [open_loop.FIRST_SITE_SEED + k for k in range(sites)] * len(plans)
    actions = np.repeat(plans, sites)
    stands = sim.Stands(len(actions), scenario=None if scenario == NONE else scenario, **BALANCED_WORLD)
    everyone = np.arange(sites)
    # The first state hangs on no plan: it is spun up once.
    first = sim.Stands(sites, **BALANCED_WORLD)
    first.start(
        everyone,
        [sim.sample_site(number) for number in numbers[:sites]],
        [open_loop.seeds(number, k) for k, number in enumerate(numbers[:sites])],
    )
    state = first.get_state()
    stands.set_state({name: _repeated(values, len(plans)) for name, values in state.items()})
    reward = boreal_env.Reward.of(None, True)
    columns = {name: np.empty((len(actions), years)) for name in (THAW_DEPTH, DEEP)}
    rewards = np.empty((len(actions), years, 2))
    for year in range(years):
        valid = open_loop.valid_actions(stands.stocks(np.arange(len(actions))))
        carried_out = boreal_env.where_valid(actions, valid)
        record = stands.step(carried_out)
        parts = boreal_env.rewards_of_year(record, carried_out, reward, "asymmetric")
        rewards[:, year] = np.column_stack([parts["carbon_reward"], parts["thaw_reward"]])
        for name, values in columns.items():
            values[:, year] = record[:, sim.RECORD_NAMES.index(name)]
    shape = (len(plans), sites)
    return {
        name: values.reshape(*shape, *values.shape[1:]) for name, values in (columns | {"rewards": rewards}).items()
    }


def _repeated(values, times: int):
    return values * times if isinstance(values, list) else np.concatenate([values] * times)


def study(args: Args, years: int, plans: list[int]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """A row a scenario, site and plan; and a row a scenario and year."""
    of_plans, of_years = [], []
    for number, scenario in enumerate((NONE, *SCENARIOS)):
        played = play(scenario, args.sites, years, plans)
        returns = played["rewards"][:, :, :RETURN_YEARS]
        frozen = played[THAW_DEPTH] < NEAR_SURFACE_M
        middle = slice(max(min(RETURN_YEARS, years) - LAST, 0), min(RETURN_YEARS, years))
        for k, action in enumerate(plans):
            row = {
                "scenario": scenario,
                "site_seed": open_loop.FIRST_SITE_SEED + np.arange(args.sites),
                "action": action,
            }
            row |= dict(zip(open_loop.RETURNS, returns[k].sum(axis=1).T, strict=True))
            row |= {"clipped_thaw_years": (returns[k, :, :, 1] <= -1.0).sum(axis=1)}
            for what, when in (("after_50", middle), ("after_76", slice(-LAST, None))):
                row |= {
                    f"thaw_depth_{what}_m": played[THAW_DEPTH][k, :, when].mean(axis=1),
                    f"deep_{what}_c": played[DEEP][k, :, when].mean(axis=1),
                    f"frozen_{what}": frozen[k, :, when].all(axis=1).astype(int),
                }
            of_plans.append(pd.DataFrame(row))
        path = check_scenario(None if scenario == NONE else scenario)
        warming = np.zeros(years) if path is None else path.values[:years, path.names.index("warming_k")]
        unchanged = plans.index(boreal_env.NO_CHANGE)
        if number == 0:  # the ground that is frozen in the first years of today's climate
            today = frozen[unchanged, :, :LAST].all(axis=1)
        depth = played[THAW_DEPTH][unchanged][today]
        of_years.append(
            pd.DataFrame(
                {
                    "scenario": scenario,
                    "year": FIRST_YEAR + np.arange(years),
                    "warming_k": warming,
                    "sites": int(today.sum()),
                    "frozen_unchanged": frozen[unchanged][today].mean(axis=0) if today.any() else np.nan,
                    "frozen_any_plan": frozen[:, today].any(axis=0).mean(axis=0) if today.any() else np.nan,
                    "frozen_volume_unchanged": np.clip(NEAR_SURFACE_M - depth, 0.0, None).mean(axis=0) / NEAR_SURFACE_M,
                    "thaw_depth_unchanged_m": np.median(depth, axis=0) if today.any() else np.nan,
                }
            )
        )
    return pd.concat(of_plans, ignore_index=True), pd.concat(of_years, ignore_index=True)


# --------------------------------------------------------------------------------------------- what it says


def fronts(plans: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """By scenario the mean returns of the plans that no other dominates, by action, carbon ascending."""
    found = {}
    for scenario, rows in plans.groupby("scenario", sort=False):
        means = rows.groupby("action")[open_loop.RETURNS].mean()
        found[scenario] = means[metrics.is_nondominated(means)].sort_values("carbon_return")
    return found


def best_plans(plans: pd.DataFrame) -> pd.DataFrame:
    """By scenario: the plan with the best mean return at weights of carbon 0, 0.5 and 1, and what there is besides."""
    rows = []
    for scenario, of in plans.groupby("scenario", sort=False):
        means = of.groupby("action")[open_loop.RETURNS].mean()
        unchanged = means.loc[boreal_env.NO_CHANGE]
        row = {"scenario": scenario, "zero_carbon": unchanged.iloc[0], "zero_thaw": unchanged.iloc[1]}
        for weight in (0.0, 0.5, 1.0):
            action = (means @ [weight, 1.0 - weight]).idxmax()
            row |= {f"best_{weight:g}": action, f"best_{weight:g}_carbon": means.carbon_return[action]}
            row |= {f"best_{weight:g}_thaw": means.thaw_return[action]}
        row["clipped"] = of.clipped_thaw_years.mean() / RETURN_YEARS
        rows.append(row)
    return pd.DataFrame(rows).set_index("scenario")


def moved_sites(plans: pd.DataFrame, weight: float = 0.5) -> pd.Series:
    """By scenario the share of sites whose best plan at this weight is not the one without a scenario."""
    scalarized = plans[open_loop.RETURNS].to_numpy() @ [weight, 1.0 - weight]
    table = plans.assign(value=scalarized).pivot_table(
        index=["scenario", "site_seed"], columns="action", values="value"
    )
    best = table.idxmax(axis=1).unstack("scenario")
    return best.ne(best[NONE], axis=0).mean()


def decades(years: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """First and last year of the ten that `after_50` and `after_76` are of."""
    first, last = years.year.min(), years.year.max()
    middle = min(first + RETURN_YEARS - 1, last)
    return {"after_50": (max(middle - LAST + 1, first), middle), "after_76": (max(last - LAST + 1, first), last)}


def means(years: pd.DataFrame, when: str) -> pd.DataFrame:
    """By scenario the means of one of `decades`; `warming_k` of it is the warming that the page quotes."""
    inside = years.year.between(*decades(years)[when])
    return years[inside].groupby("scenario", sort=False).mean(numeric_only=True)


def always_frozen(plans: pd.DataFrame) -> pd.Series:
    """By site that stays frozen in both decades without a scenario and a plan: the ground's temperature in the last."""
    rows = plans[(plans.scenario == NONE) & (plans.action == boreal_env.NO_CHANGE)].set_index("site_seed")
    return rows.deep_after_76_c[(rows.frozen_after_50 == 1) & (rows.frozen_after_76 == 1)]


def kept(plans: pd.DataFrame, years: pd.DataFrame) -> pd.DataFrame:
    """By warming, a row a scenario and decade: of the sites that are frozen without a scenario, how many doing nothing
    keeps frozen, some plan and no plan; and how many some plan keeps, and the one plan that keeps most of them, by the
    ground's temperature (`GROUND`)."""
    ground = always_frozen(plans)
    classes = pd.cut(ground, GROUND, labels=GROUND_NAMES)
    rows = []
    for when, (first, last) in decades(years).items():
        warming = means(years, when).warming_k
        for scenario in SCENARIOS:
            of = plans[plans.scenario == scenario]
            frozen = of.pivot(index="site_seed", columns="action", values=f"frozen_{when}").loc[ground.index] == 1
            some = frozen.any(axis=1)
            row = {"scenario": scenario, "first": first, "last": last, "warming_k": warming[scenario]}
            row |= {"no_change": frozen[boreal_env.NO_CHANGE].sum(), "some_plan": some.sum(), "no_plan": (~some).sum()}
            row |= {name: some[classes == name].sum() for name in GROUND_NAMES}
            rows.append(row | {one_plan(name): frozen[classes == name].sum().max() for name in GROUND_NAMES})
    return pd.DataFrame(rows).sort_values("warming_k", ignore_index=True)


def deepening(plans: pd.DataFrame) -> pd.DataFrame:
    """By scenario, thaw depth of doing nothing in the last decade less that without a scenario, on sites that are
    frozen in both: in m, and the median in parts; and of all that are frozen without one the share that is lost."""
    rows = plans[plans.action == boreal_env.NO_CHANGE].set_index(["scenario", "site_seed"])
    frozen, depth = rows.frozen_after_76.unstack("scenario") == 1, rows.thaw_depth_after_76_m.unstack("scenario")
    found = {}
    for scenario in SCENARIOS:
        both = frozen[NONE] & frozen[scenario]
        change = (depth[scenario] - depth[NONE])[both]
        found[scenario] = {
            "sites": int(both.sum()),
            "median": change.median(),
            "low": change.min(),
            "high": change.max(),
            "share": (change / depth[NONE][both]).median(),
            "lost": (frozen[NONE] & ~frozen[scenario]).sum() / max(frozen[NONE].sum(), 1),
        }
    return pd.DataFrame(found).T


def plan_name(action: int) -> str:
    """A plan in words."""
    change, mix = (float(value) for value in sim.management.decode(int(action)))
    return (
        "doing nothing" if change == 0 else f"{'plant' if change > 0 else 'cut'} {abs(change):.0f}, {mix:.0%} conifers"
    )


def held(ground: pd.Series) -> dict[str, int]:
    """Number of sites by their ground's temperature."""
    return pd.cut(ground, GROUND, labels=GROUND_NAMES).value_counts().reindex(GROUND_NAMES).to_dict()


def one_plan(name: str) -> str:
    """The column of how many sites of a class of ground one plan for all of them keeps."""
    return f"{name}, one plan"


def answer(table: pd.DataFrame, ground: pd.Series) -> str:
    """By the ground's temperature, between which warmings of the last decade some plan ceases to keep half of it."""
    rows = table[table["last"] == table["last"].max()]
    parts = []
    for name, count in held(ground).items():
        reached = [0.0, *rows.warming_k]
        lost = [k for k, sites in enumerate(rows[name], start=1) if sites < count / 2]
        between = reached[lost[0] - 1 :] if lost else reached[-1:]
        where = ("between {:.1f} and {:.1f} K" if lost else "even {:.1f} K does not").format(*between)
        sites = (f"{sites} at {warming:.1f} K" for warming, sites in zip(rows.warming_k, rows[name], strict=True))
        most = ", ".join(str(sites) for sites in rows[one_plan(name)])
        parts.append(
            f"- Ground {name}: {where}. Of {count} sites some plan keeps {', '.join(sites)}; the best plan for all of "
            f"them keeps {most}."
        )
    return "\n".join(parts)


def page(plans: pd.DataFrame, years: pd.DataFrame) -> str:
    """docs/warming.md."""
    sites, ground, table = plans.site_seed.nunique(), always_frozen(plans), kept(plans, years)
    first, last = ("{}-{}".format(*when) for when in decades(years).values())
    start, end = years.year.min(), years.year.max()
    today = f"{start}-{min(start + LAST - 1, end)}"
    paragraphs = (
        f"*Written by `python analysis/studies/warming.py`.* Constant plans in the world of `boreal-balanced-v0`, "
        f"without a scenario and under three, from {start} to {end}, on {sites} sites; what a scenario is, is in "
        "[model.md](model.md), section 3. **Warming** is always that of boreal land against 1995-2014, in the mean of "
        "ten years; where it is the world's, that is said.",
        f"**By {last}, how much warming takes more than half of the frozen sites, whichever constant plan a site "
        "gets?** It hangs on how cold the ground is. These are few sites, each with one start and one weather, on "
        "which the plan that keeps it is picked afterwards, for each site its own; one plan for all never keeps more:",
        f"Frozen is ground that thaws less than {NEAR_SURFACE_M:.0f} m in each of ten years. In effect that is a deep "
        "node below 0 °C: where its mean passes 0 °C the modelled depth leaps by a metre or more. The ground's "
        f"temperature is that of the deep soil in {last}, without a scenario and without management. All are the same "
        f"{len(ground)} of {sites} sites, those frozen in {first} and in {last} without a scenario. The table goes "
        "by the warming that is reached. That is no threshold: the ground lags behind the warming, and "
        "without a scenario, too, it changes from decade to decade (below the figure):",
        drift(plans, years, today, first, last),
        f"**How does that compare with what is published?** Doing nothing, {last} against the same years without a "
        "scenario. Thaw is the median, with its range, of the sites that are frozen in both; volume is of the sites "
        f"frozen in {today}, the last row of those frozen in {last} without a scenario.",
        "*What may explain what; none of it was tested.* Less is lost per K than AR6 says. The boundary of fixed "
        "temperature at 12 m goes on taking up heat, so that below the upper metres the ground warms less than it "
        "would; and half of these sites are colder than -4 °C, where least is lost. Where the ground stays "
        "frozen, thaw deepens too much under ssp245 and ssp585: the boundary works against that, so it is no "
        "explanation, and we count it as a miss. Peng et al. have all permafrost, most of it north of these sites, "
        "and Stefan's equation. More sites are lost than Peng et al. "
        "lose of their area, and fewer than the middle of the IPCC's ranges under SSP1-2.6 and SSP5-8.5, though inside "
        "both.",
        "**How do the returns move?** Means over the sites of 50 years, carbon and thaw, of doing nothing and of the "
        "best plan for thaw alone, for both alike and for carbon alone; the share of sites whose best plan for both is "
        "another one than without a scenario; and the share of years, of all plans, in which the thaw reward is "
        "clipped at -1.",
    )
    filled = (textwrap.fill(text, 120) for text in paragraphs)
    head, question, defined, drifted, compared, explained, returns = filled
    parts = ["# Warming", head, question, answer(table, ground), defined, ground_table(table, ground)]
    parts += ["![Fronts of constant plans, and the share of sites that stay frozen](images/warming.png)", drifted]
    parts += [compared, published_table(plans, years), explained, returns, returns_table(plans)]
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def drift(plans: pd.DataFrame, years: pd.DataFrame, today: str, first: str, last: str) -> str:
    """How the ground moves without a scenario."""
    none = plans[(plans.scenario == NONE) & (plans.action == boreal_env.NO_CHANGE)]
    cooler = (none.deep_after_76_c - none.deep_after_50_c).mean()
    of_none = years[years.scenario == NONE]
    count = int(of_none.sites.iloc[0])
    before, after = (rows.thaw_depth_unchanged_m.mean() for rows in (of_none.head(LAST), of_none.tail(LAST)))
    return (
        f"**Without a scenario and without management the ground drifts**: {count} of the {len(none)} sites are frozen "
        f"in {today}, {none.frozen_after_50.sum()} in {first}, {none.frozen_after_76.sum()} in {last}; the deep soil "
        f"changes by {cooler:+.2f} K from {first} to {last}, the median thaw depth of the {count} from {before:.2f} to "
        f"{after:.2f} m in all. A count of sites has it in it, so the table has the years; changes below are against "
        f"the same years without a scenario. The figure's right half is of the same {count} sites, frozen in that one "
        "year, not in all of ten."
    )


def ground_table(table: pd.DataFrame, ground: pd.Series) -> str:
    """The answer by the warming reached."""
    names = ("warming [K]", "scenario, years", "frozen, doing nothing", "under some plan", "under no plan")
    names += tuple(f"some plan, ground {name} ({count} sites)" for name, count in held(ground).items())
    rows = [
        (
            f"{row.warming_k:.1f}",
            f"{row.scenario}, {row.first}-{row.last}",
            *(f"{row[name] / max(len(ground), 1):.0%}" for name in ("no_change", "some_plan", "no_plan")),
            *(f"{row[name]}" for name in GROUND_NAMES),
        )
        for _, row in table.iterrows()
    ]
    return markdown(names, rows)


def published_table(plans: pd.DataFrame, years: pd.DataFrame) -> str:
    """Ours by scenario beside published projections."""
    deeper, last = deepening(plans), means(years, "after_76")
    volume = [loss(last, scenario) for scenario in SCENARIOS]
    rows = [
        (
            "thaw, where the ground stays frozen",
            *(f"{r['median']:+.2f} m ({r.low:+.2f} to {r.high:+.2f}), {r.share:+.0%}" for _, r in deeper.iterrows()),
            "less than +30 % for most permafrost by the century's end (Peng et al. 2023, Earth's Future 11)",
        ),
        (
            "frozen volume of the upper 3 m, per K of the world",
            *(f"{-share:+.0%}" for share in volume),
            "-20 to -30 %, up to 3 K of the world, so not for ssp585 (IPCC AR6 WGI, 9.5.2); of the upper 2 m -10 to "
            "-40 % (Burke et al. 2020, Cryosphere 14, 3155)",
        ),
        (
            "sites, or area, with permafrost in the upper 3 m",
            *(f"{-share:+.0%}" for share in deeper.lost),
            "-24 ± 16 % under RCP2.6, -69 ± 20 % under RCP8.5 by 2100 (IPCC SROCC, SPM B1.4); -14 % in the most severe "
            "(Peng et al. 2023, upper 3.5 m)",
        ),
    ]
    warming = (f"{name}, {last.warming_k[name]:.1f} K" for name in SCENARIOS)
    return markdown(("change", *warming, "published"), rows)


def loss(last: pd.DataFrame, scenario: str) -> float:
    """Share of the permafrost's volume lost per K of the world, against no scenario."""
    share = 1.0 - last.frozen_volume_unchanged[scenario] / last.frozen_volume_unchanged[NONE]
    return share / make_scenarios.world_warming(scenario)[-LAST:].mean()


def returns_table(plans: pd.DataFrame) -> str:
    """What plans are worth by scenario."""
    moved = moved_sites(plans)
    names = ("scenario", "doing nothing", "best for thaw", "best for both", "best for carbon", "sites that change plan")
    rows = [
        (
            scenario,
            f"{row.zero_carbon:.2f}, {row.zero_thaw:.2f}",
            *(
                f"{plan_name(row[f'best_{w}'])}: {row[f'best_{w}_carbon']:.2f}, {row[f'best_{w}_thaw']:.2f}"
                for w in ("0", "0.5", "1")
            ),
            f"{moved[scenario]:.0%}",
            f"{row.clipped:.0%}",
        )
        for scenario, row in best_plans(plans).iterrows()
    ]
    return markdown((*names, "clipped"), rows)


def draw(plans: pd.DataFrame, years: pd.DataFrame, path: Path) -> None:
    """Fronts by scenario, and the share of frozen sites by warming."""
    import matplotlib.pyplot as plt

    colours = dict(zip((NONE, *SCENARIOS), ("#333333", "#2a78b5", "#e0a030", "#c0392b"), strict=True))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for scenario, front in fronts(plans).items():
        means = plans[plans.scenario == scenario].groupby("action")[open_loop.RETURNS].mean()
        left.scatter(*means.to_numpy().T, s=8, color=colours[scenario], alpha=0.35, linewidths=0)
        left.plot(front.carbon_return, front.thaw_return, "o-", ms=4, color=colours[scenario], label=scenario)
    left.scatter([], [], s=8, color=colours[NONE], alpha=0.35, linewidths=0, label="plans off the front")
    left.set(
        xlabel="carbon return", ylabel="thaw return", title="Constant plans: mean returns of 50 years, front joined"
    )
    left.legend(frameon=False)
    for scenario in reversed(SCENARIOS):  # the one that warms least on top: it is hidden below no other
        rows = years[years.scenario == scenario]
        for column, style in (("frozen_any_plan", "-"), ("frozen_unchanged", "--")):
            of_ten = rows[["warming_k", column]].rolling(LAST).mean().dropna()
            right.plot(of_ten.warming_k, 100 * of_ten[column], style, color=colours[scenario], lw=1.5)
            right.plot(of_ten.warming_k.tail(1), 100 * of_ten[column].tail(1), "o", ms=4, color=colours[scenario])
    for scenario in SCENARIOS:
        end = years[years.scenario == scenario].warming_k.tail(LAST).mean()
        right.plot([], [], "o-", ms=4, color=colours[scenario], label=f"{scenario}, ends at {end:.1f} K")
    right.plot([], [], "-", color="#333333", label="under some plan")
    right.plot([], [], "--", color="#333333", label="without management")
    right.set(ylim=(0, 103), xlabel="warming, mean of ten years [K]", ylabel="frozen in the upper 3 m [%]")
    right.set_title(f"Of the {years.sites.iloc[0]} sites frozen in {FIRST_YEAR}-{FIRST_YEAR + LAST - 1}")
    right.legend(frameon=False, loc="lower left")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    with protocol.replacing(path) as file:
        figure.savefig(file, format="png", dpi=150, metadata={"Software": None})
    plt.close(figure)


def main(args: Args) -> None:
    """Play what is not finished; write page and figure."""
    years, plans = YEARS, PLANS
    if args.quick:
        args, years, plans = replace(args, sites=3), 6, [0, boreal_env.NO_CHANGE, 20, 24]
    if args.sites == Args.sites and not PAGE.parent.is_dir():
        protocol.fail(f"{PAGE}: no such folder here; this is run in the project's folder")
    folder = paths.studies(args.quick)
    made_by = {"sites": args.sites, "years": years, "plans": plans}
    tables = [folder / "warming.csv", folder / "warming_years.csv"]
    if all(stored.is_finished(path, made_by) for path in tables):
        print(f"{tables[0]} is finished")
    else:
        for path, table in zip(tables, study(args, years, plans), strict=True):
            stored.write(path, table, made_by)
            print(f"wrote {path}")
    if args.quick:
        return
    if args.sites != Args.sites:
        print(f"{PAGE} is of {Args.sites} sites and stays as it is")
    else:
        of_plans, of_years = (stored.read(path) for path in tables)
        with protocol.replacing(PAGE) as file:
            file.write(page(of_plans, of_years).encode())
        draw(of_plans, of_years, FIGURE)
        print(f"wrote {PAGE} and {FIGURE}")


if __name__ == "__main__":
    main(protocol.parse(Args))
