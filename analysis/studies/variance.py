"""Splits the variance of both returns, and of one year's rewards, into site, weather and policy.

    python analysis/studies/variance.py

Every site has weathers of its own and is played under each with every policy (a balanced design, weathers nested in
sites). What is left for the last component, weather x policy, is no error: the simulator has none. Sites are sampled
as the environment samples them, each with its own start. The shares are those of this set of policies: wilder ones
would have a larger share.
"""

import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import sim
from analysis import paths, stored
from analysis.studies import open_loop
from cleanrl_style import protocol

YEARS = 50
FACTORS = ("site", "weather", "policy")
CHUNK = 128  # stands in lockstep
REPETITIONS = 1000  # of the bootstrap over sites

#: Name -> (density index, mix index) of the years before and after the tenth.
POLICIES = {
    "zero change": ((2, 2), (2, 2)),
    "+100 conifers": ((4, 4), (4, 4)),
    "+100 half": ((4, 2), (4, 2)),
    "+100 deciduous": ((4, 0), (4, 0)),
    "+100 conifers for ten years": ((4, 4), (2, 2)),
    "+100 deciduous for ten years": ((4, 0), (2, 2)),
    "+50 half": ((3, 2), (3, 2)),
    "-50 half": ((1, 2), (1, 2)),
}


@dataclass
class Args:
    """Splits the variance of returns and of one year's rewards into site, weather and policy."""

    sites: int = 48
    """sampled sites"""
    weathers: int = 8
    """weathers of each"""
    quick: bool = False
    """4 sites and 2 weathers, only to show that everything works"""
    output_dir: Path | None = None
    """folder of the tables (None: results/variance, or results/quick/variance)"""


def plans(years: int) -> np.ndarray:
    """Actions of POLICIES, (policies, years)."""
    pairs = np.array([([early] * 10 + [late] * years)[:years] for early, late in POLICIES.values()])
    return 5 * pairs[:, :, 0] + pairs[:, :, 1]


def play(site_seeds: list[int], weathers: int) -> np.ndarray:
    """Rewards of the whole design, (sites, weathers, policies, years, 2)."""
    each = plans(YEARS)
    design = [(site, weather, policy) for site in site_seeds for weather in range(weathers) for policy in each]
    progress = protocol.Progress("variance", len(design), "episodes")
    rewards = []
    for first in range(0, len(design), CHUNK):
        sites, dice, actions = zip(*design[first : first + CHUNK], strict=True)
        seeds = [open_loop.own_seeds(site, weather, weathers) for site, weather in zip(sites, dice, strict=True)]
        rewards.append(open_loop.play([sim.sample_site(site) for site in sites], seeds, actions).rewards)
        progress.show(first + len(sites))
    return np.concatenate(rewards).reshape(len(site_seeds), weathers, len(each), YEARS, 2)


def variance_components(values: np.ndarray) -> pd.Series:
    """Variance components of values (sites, weathers, policies), where every site has weathers of its own.

    Site, weather and policy are drawn at random; "weather" is that within a site. The components estimate variances
    that add up to that of a value drawn at random, by the expected mean squares. They are unbiased, hence may be
    negative where the true component is near zero; they are left so. With one weather a site the weather's is in the
    site's, and weather x policy in site x policy.
    """
    sites, weathers, policies = values.shape
    freedom = max(weathers - 1, 1)
    mean, of_site, of_policy = (values.mean(axis=axes, keepdims=True) for axes in ((0, 1, 2), (1, 2), (0, 1)))
    of_weather, of_both = (values.mean(axis=axis, keepdims=True) for axis in (2, 1))
    site, weather, policy, both, rest = (
        (deviations**2).sum() * values.size / deviations.size / degrees
        for deviations, degrees in (
            (of_site - mean, sites - 1),
            (of_weather - of_site, sites * freedom),
            (of_policy - mean, policies - 1),
            (of_both - of_site - of_policy + mean, (sites - 1) * (policies - 1)),
            (values - of_weather - of_both + of_site, sites * freedom * (policies - 1)),
        )
    )
    return pd.Series(
        {
            "site": (site - weather - both + rest) / (weathers * policies),
            "weather": (weather - rest) / policies,
            "policy": (policy - both) / (sites * weathers),
            "site x policy": (both - rest) / weathers,
            "weather x policy": rest,
        }
    )


def shares(components: pd.Series) -> pd.Series:
    """Components over their sum."""
    return components / components.sum()


def split(values: np.ndarray) -> pd.DataFrame:
    """Components, their shares and the shares' 95 % interval over resampled sites, the policies held.

    values : (sites, weathers, policies). The intervals are a little narrow: resampled sites vary less than sites.
    """
    components = variance_components(values)
    generator = np.random.default_rng(0)
    resampled = [
        shares(variance_components(values[generator.integers(len(values), size=len(values))]))
        for _ in range(REPETITIONS)
    ]
    low, high = np.percentile(resampled, [2.5, 97.5], axis=0)
    table = pd.DataFrame({"variance": components, "share": shares(components), "share_low": low, "share_high": high})
    return table.rename_axis("component").reset_index()


def split_years(rewards: np.ndarray) -> pd.DataFrame:
    """The same for the reward of one year, the mean over the years; rewards (sites, weathers, policies, years)."""
    yearly = [variance_components(rewards[..., year]) for year in range(rewards.shape[-1])]
    components = pd.concat(yearly, axis=1).mean(axis=1)
    table = pd.DataFrame({"variance": components, "share": shares(components)})
    return table.rename_axis("component").reset_index()


def compared(returns: np.ndarray) -> dict[str, float]:
    """The objectives' standard deviations and their ratio, of all and of what the policy decides; its share on a site.

    returns : (sites, weathers, policies, 2), carbon then thaw. What the policy decides is its component and that of
    site x policy; its share on a site is of what is left without the site's.
    """
    components = {name: variance_components(returns[..., k]) for k, name in enumerate(open_loop.OBJECTIVES)}
    decided = {name: of["policy"] + of["site x policy"] for name, of in components.items()}
    sd = {name: np.sqrt(of.sum()) for name, of in components.items()}
    return {
        **{f"standard deviation, {name}": value for name, value in sd.items()},
        "thaw over carbon": sd["thaw"] / sd["carbon"],
        "thaw over carbon, decided": np.sqrt(decided["thaw"] / decided["carbon"]),
        **{f"decided on a site, {name}": decided[name] / of.drop("site").sum() for name, of in components.items()},
    }


def with_intervals(returns: np.ndarray) -> pd.DataFrame:
    """`compared` with its 95 % intervals over resampled sites, a row a quantity."""
    generator = np.random.default_rng(0)
    resampled = pd.DataFrame(
        [compared(returns[generator.integers(len(returns), size=len(returns))]) for _ in range(REPETITIONS)]
    )
    table = pd.DataFrame(
        {"value": compared(returns), "low": resampled.quantile(0.025), "high": resampled.quantile(0.975)}
    )
    return table.rename_axis("quantity").reset_index()


def site_effect(site_means: np.ndarray, features: pd.DataFrame) -> dict[str, float]:
    """Shares of the variance between sites that linear regressions explain, adjusted for their number of terms.

    site_means : mean return of each site, (n,), which has a part of its weathers' variance; features :
    `open_loop.site_features` of each.
    """
    temperature, snow = ["boundary_above_air_k"], ["snow_mm_day"]
    explained = {
        "boundary minus air": _explained(site_means, features[temperature]),
        "snow": _explained(site_means, features[snow]),
        "both": _explained(site_means, features[temperature + snow]),
    }
    return explained | {"rest": 1.0 - explained["both"]}


def _explained(y: np.ndarray, x: pd.DataFrame) -> float:
    design = np.column_stack([np.ones(len(x)), x])
    residual = y - design @ np.linalg.lstsq(design, y)[0]
    freedom = len(y) - design.shape[1]
    return 1.0 - (residual**2).sum() / freedom / y.var(ddof=1)


def main(args: Args) -> None:
    """Play the design, split the variances, write and print the tables."""
    if args.quick:
        args.sites, args.weathers = 4, 2
    if args.sites < 4 or args.weathers < 2:
        sys.exit(f"error: --sites >= 4 and --weathers >= 2 are allowed, not {args.sites}, {args.weathers}")
    folder = args.output_dir or paths.results(args.quick) / "variance"
    paths.make_writable("--output-dir", folder)
    settings = asdict(args) | {"output_dir": None}
    site_seeds = [open_loop.FIRST_SITE_SEED + k for k in range(args.sites)]
    rewards = play(site_seeds, args.weathers)
    returns = rewards.sum(axis=3)
    gains = returns - returns[:, :, :1]
    features = pd.DataFrame([open_loop.site_features(sim.sample_site(seed)) for seed in site_seeds])

    components, explained = [], []
    for k, name in enumerate(open_loop.OBJECTIVES):
        components += [
            split(returns[..., k]).assign(value="return", objective=name),
            split_years(rewards[..., k]).assign(value="one year", objective=name),
        ]
        explained.append({"objective": name, **site_effect(returns[..., k].mean(axis=(1, 2)), features)})
    components, explained = pd.concat(components, ignore_index=True), pd.DataFrame(explained)
    columns = [f"{name}_{what}" for what in ("return", "gain") for name in open_loop.OBJECTIVES]
    values = np.concatenate([returns, gains], axis=-1)
    policies = pd.DataFrame(values.mean(axis=(0, 1)), columns=columns)
    policies.insert(0, "policy", list(POLICIES))
    index = pd.MultiIndex.from_product([site_seeds, range(args.weathers), POLICIES], names=FACTORS)
    episodes = pd.DataFrame(values.reshape(-1, 4), index=index, columns=columns).reset_index()
    tables = {
        "components": components,
        "compared": with_intervals(returns),
        "site_effect": explained,
        "policies": policies,
        "episodes": episodes,
    }
    for name, table in tables.items():
        stored.write(folder / f"{name}.csv", table, settings)
    report(components, explained, policies)
    print(f"\nwrote {', '.join(tables)} to {folder}")


def report(components: pd.DataFrame, explained: pd.DataFrame, policies: pd.DataFrame) -> None:
    """Print the tables."""
    wide = components.pivot(index="component", columns=["value", "objective"], values="share")
    order = list(dict.fromkeys(components.component))
    print("\nshare of the variance, %\n" + (100 * wide.loc[order]).to_string(float_format="%.1f"))
    whole = components[components.value == "return"].set_index(["objective", "component"])
    for name in open_loop.OBJECTIVES:
        of = whole.loc[name]
        print(
            f"{name} return: standard deviation {of.variance.sum() ** 0.5:.2f}; site {of.share['site']:.1%} "
            f"({of.share_low['site']:.1%} to {of.share_high['site']:.1%} over resampled sites)"
        )
    print("\nof the variance between sites, explained by\n" + explained.to_string(index=False, float_format="%.2f"))
    print("\n" + policies.to_string(index=False, float_format="%+.2f"))


if __name__ == "__main__":
    main(protocol.parse(Args))
