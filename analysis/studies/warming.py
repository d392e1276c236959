"""How climate change moves what constant plans can reach, and at which warming no plan keeps the ground frozen.

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
THAW_DEPTH, DEEP, MEAN_AIR = "active_layer_depth_m", "deep_soil_temperature_c", "air_temperature_c"
#: Permafrost volume of the upper 3 m lost per K of the world (IPCC AR6 WGI, section 9.5.2, after Burke et al. 2020).
PUBLISHED_LOSS = (0.20, 0.30)
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
        everyone, [sim.sample_site(k) for k in numbers[:sites]], [open_loop.seeds(k, 0) for k in numbers[:sites]]
    )
    state = first.get_state()
    stands.set_state({name: _repeated(values, len(plans)) for name, values in state.items()})
    reward = boreal_env.Reward.of(None, True)
    columns = {name: np.empty((len(actions), years)) for name in (THAW_DEPTH, DEEP)}
    rewards = np.empty((len(actions), years, 2))
    for year in range(years):
        valid = open_loop.valid_actions(stands.stocks(np.arange(len(actions))))[np.arange(len(actions)), actions]
        carried_out = np.where(valid, actions, boreal_env.NO_CHANGE)
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
        best = {tuple(point) for point in metrics.nondominated(means.to_numpy())}
        found[scenario] = means[[tuple(point) in best for point in means.to_numpy()]].sort_values("carbon_return")
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


def threshold(years: pd.DataFrame, column: str, share: float = 0.5) -> tuple[float, int] | None:
    """Warming and year from which on less than a share of the sites is frozen under SSP5-8.5; None if they stay."""
    rows = years[years.scenario == "ssp585"]
    smooth = rows[column].rolling(LAST, min_periods=1).mean()
    below = rows[smooth < share]
    return None if below.empty else (float(below.warming_k.iloc[0]), int(below.year.iloc[0]))


def deepening(plans: pd.DataFrame) -> pd.DataFrame:
    """By scenario, thaw depth of zero change in 2091-2100 less that without one, on sites that stay frozen in both."""
    rows = plans[plans.action == boreal_env.NO_CHANGE].set_index(["scenario", "site_seed"])
    frozen, depth = rows.frozen_after_76.unstack("scenario"), rows.thaw_depth_after_76_m.unstack("scenario")
    found = {}
    for scenario in SCENARIOS:
        both = (frozen[NONE] == 1) & (frozen[scenario] == 1)
        change = (depth[scenario] - depth[NONE])[both]
        found[scenario] = {
            "sites": int(both.sum()),
            "median": change.median(),
            "low": change.min(),
            "high": change.max(),
        }
        found[scenario] |= {"lost": int(((frozen[NONE] == 1) & (frozen[scenario] == 0)).sum())}
    return pd.DataFrame(found).T


def lost_ground(plans: pd.DataFrame) -> pd.DataFrame:
    """By scenario, of the sites frozen in the end without one: how many no plan keeps, how many some plan keeps
    that no change does not, and the ground's temperature without one [degC]: coldest lost, warmest kept."""
    frozen = plans.pivot(index=["scenario", "site_seed"], columns="action", values="frozen_after_76")
    ground = plans[(plans.scenario == NONE) & (plans.action == boreal_env.NO_CHANGE)].set_index("site_seed")
    ground = ground.deep_after_76_c[ground.frozen_after_76 == 1]
    rows = {}
    for scenario in SCENARIOS:
        here = frozen.loc[scenario].loc[ground.index]
        kept, unmanaged = here.max(axis=1) == 1, here[boreal_env.NO_CHANGE] == 1
        rows[scenario] = {"sites": len(ground), "lost": (~kept).sum(), "saved": (kept & ~unmanaged).sum()}
        rows[scenario] |= {"coldest_lost": ground[~kept].min(), "warmest_kept": ground[kept].max()}
    return pd.DataFrame(rows).T


def plan_name(action: int) -> str:
    """A plan in words."""
    change, mix = (float(value) for value in sim.management.decode(int(action)))
    return "no change" if change == 0 else f"{'plant' if change > 0 else 'cut'} {abs(change):.0f}, {mix:.0%} conifers"


def page(plans: pd.DataFrame, years: pd.DataFrame) -> str:
    """docs/warming.md."""
    best, moved, deeper = best_plans(plans), moved_sites(plans), deepening(plans)
    today = int(years.sites.iloc[0])
    sites = plans.site_seed.nunique()
    last = years[years.year > years.year.max() - LAST].groupby("scenario", sort=False).mean(numeric_only=True)
    lines = [
        f"| {name} | {row.zero_carbon:.2f}, {row.zero_thaw:.2f} | "
        + " | ".join(
            f"{plan_name(row[f'best_{w}'])}: {row[f'best_{w}_carbon']:.2f}, {row[f'best_{w}_thaw']:.2f}"
            for w in ("0", "0.5", "1")
        )
        + f" | {moved[name]:.0%} | {row.clipped:.0%} |"
        for name, row in best.iterrows()
    ]
    frozen = [
        f"| {name} | {row.warming_k:.1f} | {row.frozen_unchanged:.0%} | {row.frozen_any_plan:.0%} | "
        f"{row.thaw_depth_unchanged_m:.2f} | {loss(last, name)} |"
        for name, row in last.iterrows()
    ]
    depths = "; ".join(
        f"{name} {row['median']:+.2f} m ({row.low:+.2f} to {row.high:+.2f} on {row.sites:.0f} sites; "
        f"{row.lost:.0f} lost)"
        for name, row in deeper.iterrows()
    )
    lost = "; ".join(
        f"{name} {row.lost:.0f} of {row.sites:.0f} (some plan keeps {row.saved:.0f} that no change loses)"
        + (f", the coldest of {row.coldest_lost:.1f} °C" if row.lost else "")
        + f", the warmest ground that is kept {row.warmest_kept:.1f} °C"
        for name, row in lost_ground(plans).iterrows()
    )
    end = years.year.max()
    then = f"{end - LAST + 1}-{end}"
    wrapped = [
        textwrap.fill(text, 120)
        for text in (
            f"*Written by `python analysis/studies/warming.py`.* Constant plans in the world of `boreal-balanced-v0`, "
            f"without a scenario and under three, from {FIRST_YEAR} to {end}, on {sites} sites; what a scenario is, "
            "is in [model.md](model.md), section 3.",
            f"**At which warming does no plan keep the ground frozen?** Of the {sites} sites {today} have permafrost "
            f"in the upper {NEAR_SURFACE_M:.0f} m in the first {LAST} years of today's climate. {sentence(years)} It "
            f"hangs on how cold the ground is now. By {then} no plan keeps, of the sites frozen then without a "
            f"scenario: {lost}. Where it stays, thaw is deeper by {then} (no change, under a scenario less without): "
            f"{depths}.",
            f"The models of CMIP6 lose {PUBLISHED_LOSS[0]:.0%} to {PUBLISHED_LOSS[1]:.0%} of the permafrost of the "
            "upper 3 m per K of the world, up to 3 K (IPCC AR6 WGI, section 9.5.2, after Burke et al. 2020, Cryosphere "
            "14, 3155); Peng et al. (2023, Earth's Future 11) find thaw less than 30 % deeper by the century's end "
            "for most of it. Ours hangs on a boundary of fixed temperature at 12 m, which goes on taking up heat: "
            "below the upper metres the ground warms less than it would.",
            "**How do the returns move?** Means over the sites of 50 years, carbon and thaw, of no change and of the "
            "best plan for thaw alone, for both alike and for carbon alone; the share of sites whose best plan "
            "for both is another one than without a scenario; and the share of years, of all plans, in which the thaw "
            "reward is clipped at -1.",
        )
    ]
    of_ground = (
        "scenario",
        "warming [K]",
        "frozen, no change",
        "frozen under some plan",
        "median thaw depth, no change [m]",
        "permafrost of the upper 3 m lost, per K of the world",
    )
    of_returns = (
        "scenario",
        "no change",
        "best for thaw",
        "best for both",
        "best for carbon",
        "sites that change plan",
        "clipped",
    )
    parts = [
        "# Warming",
        wrapped[0],
        "![Fronts of constant plans, and the share of sites that stay frozen](images/warming.png)",
        wrapped[1],
        f"Of the {today} sites, in the mean of the last {LAST} years:",
        "\n".join([*header(of_ground), *frozen]),
        wrapped[2],
        wrapped[3],
        "\n".join([*header(of_returns), *lines]),
    ]
    return "\n\n".join(parts) + "\n"


def header(names: tuple[str, ...]) -> list[str]:
    """The first two lines of a Markdown table."""
    return [f"| {' | '.join(names)} |", "|---" * len(names) + "|"]


def loss(last: pd.DataFrame, scenario: str) -> str:
    """Permafrost volume lost per K of global warming, against no scenario."""
    if scenario == NONE:
        return "-"
    share = 1.0 - last.frozen_volume_unchanged[scenario] / last.frozen_volume_unchanged[NONE]
    return f"{share / make_scenarios.world_warming(scenario)[-LAST:].mean():.0%}"


def sentence(years: pd.DataFrame) -> str:
    """The answer."""
    parts = []
    for column, who in (("frozen_unchanged", "without management"), ("frozen_any_plan", "under the best plan of each")):
        found = threshold(years, column)
        if found:
            parts.append(f"{who} half of them are no longer frozen from {found[0]:.1f} K on ({found[1]})")
        else:
            rows = years[years.scenario == "ssp585"].tail(LAST)
            most = f"{rows.warming_k.iloc[-1]:.1f} K"
            parts.append(f"{who} {rows[column].mean():.0%} of them are still frozen at {most} ({rows.year.iloc[-1]})")
    return f"Under SSP5-8.5, {parts[0]}; {parts[1]}."


def draw(plans: pd.DataFrame, years: pd.DataFrame, path: Path) -> None:
    """Fronts by scenario, and the share of frozen sites by warming."""
    import matplotlib.pyplot as plt

    colours = dict(zip((NONE, *SCENARIOS), ("#333333", "#2a78b5", "#e0a030", "#c0392b"), strict=True))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for scenario, front in fronts(plans).items():
        means = plans[plans.scenario == scenario].groupby("action")[open_loop.RETURNS].mean()
        left.scatter(*means.to_numpy().T, s=8, color=colours[scenario], alpha=0.35, linewidths=0)
        left.plot(front.carbon_return, front.thaw_return, "o-", ms=4, color=colours[scenario], label=scenario)
    left.set(
        xlabel="carbon return", ylabel="thaw return", title="Constant plans: mean returns of 50 years, front joined"
    )
    left.legend(frameon=False)
    for scenario in SCENARIOS:
        rows = years[years.scenario == scenario]
        for column, style in (("frozen_any_plan", "-"), ("frozen_unchanged", "--")):
            share = rows[column].rolling(LAST, min_periods=1).mean()
            right.plot(rows.warming_k, 100 * share, style, color=colours[scenario], lw=1.5)
    right.plot([], [], "-", color="#333333", label="under some plan")
    right.plot([], [], "--", color="#333333", label="without management")
    right.set(ylim=(0, 103), xlabel="warming against 1995-2014 [K]", ylabel="sites still frozen in the upper 3 m [%]")
    right.set_title("Of the sites frozen today, 2025 to 2100")
    right.legend(frameon=False, loc="lower left")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150, metadata={"Software": None})
    plt.close(figure)


def main(args: Args) -> None:
    """Play what is not finished; write page and figure."""
    years, plans = YEARS, PLANS
    if args.quick:
        args, years, plans = replace(args, sites=3), 6, [0, boreal_env.NO_CHANGE, 20, 24]
    folder = paths.studies(args.quick)
    made_by = {"sites": args.sites, "years": years, "plans": plans, "physics": open_loop.fingerprint()}
    tables = [folder / "warming.csv", folder / "warming_years.csv"]
    if all(stored.is_finished(path, made_by) for path in tables):
        print(f"{tables[0]} is finished")
    else:
        for path, table in zip(tables, study(args, years, plans), strict=True):
            stored.write(path, table, made_by)
            print(f"wrote {path}")
    if not args.quick:
        of_plans, of_years = (stored.read(path) for path in tables)
        PAGE.write_text(page(of_plans, of_years), encoding="utf-8")
        draw(of_plans, of_years, FIGURE)
        print(f"wrote {PAGE} and {FIGURE}")


if __name__ == "__main__":
    main(protocol.parse(Args))
