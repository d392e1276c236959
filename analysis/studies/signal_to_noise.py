"""How well one action can be told from another: its effect on each return, against the noise a policy gradient sees.

    python analysis/studies/signal_to_noise.py

In one year of an episode a stand takes one of two actions; site, past, coming weather and all later dice of the policy
are the same in both. The difference of what follows is the action's effect, free of noise but for what differs between
sites and weathers; the spread of the same sums between episodes is the noise in which a policy gradient has to find
it. Leaves results/studies/signal_to_noise.csv, one row a case, objective and weighting of the years to come, and
results/studies/signal_to_noise_years.csv, the effect year by year. docs/learning.md says what it is for.

Columns: `effect`, mean over the sites of the difference of the return to go; `rms_effect`, its root mean square over
the pairs; `noise`, standard deviation of the return to go over sites, pasts and weathers; `site_noise`, about each
site's mean; `state_noise`, about the mean of each site and past; `episodes`, `site_episodes` and `state_episodes`,
what each noise makes of the effect; `weighting` of the rewards to come: `return` 1 each, `discounted` 0.99 to the
number of years, `GAE` (0.99 * 0.95) to it; `carried`, the effect under a weighting over the undiscounted, none where
that cannot be told from nothing; `years_0_5` and so on, shares of the effect, signs aside, by the years after the
action. Ends `_low` and `_high` are 95 % intervals, a bootstrap over the sites; `inf` where the effect's interval
includes none. Year `every` is either action in every year, against the noise of a whole episode. A pair counts where
both actions are valid.
"""

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import paths, stored
from analysis.studies import open_loop
from cleanrl_style import protocol
from sim.draws import streams_of

YEARS = 50
CHUNK = 128  # stands in lockstep
REPETITIONS = 1000  # of the bootstrap over sites
Z = 1.96  # of a 95 % interval

ACTIONS = {"nothing": boreal_env.NO_CHANGE, "conifers": 24, "deciduous": 20, "thin": 2}
#: Name -> the action and the one it is compared with, of ACTIONS. Planting and thinning are of 100 stems/ha.
CONTRASTS = {
    "plant conifers": ("conifers", "nothing"),
    "conifers, not deciduous": ("conifers", "deciduous"),
    "thin": ("thin", "nothing"),
}
UNIFORM, PLANTING = "uniform", "+100 half conifers"
REFERENCES = (UNIFORM, PLANTING)  # policies before and after the action
ALONE = "the action alone"  # the reference where the action is taken every year, wherever it is valid
EVERY = "every"
#: Weight of a reward from one year to the next in the sum that judges an action: EUPG's, PPO's with a critic that
#: sees the action's effect in the next state, and PPO's generalised advantage with one that does not.
WEIGHTINGS = {"return": 1.0, "discounted": 0.99, "GAE": 0.99 * 0.95}
EQUAL = "equal weights"
OBJECTIVES = (*open_loop.OBJECTIVES, EQUAL)
PERIODS = {"years_0_5": slice(0, 5), "years_5_20": slice(5, 20), "years_20_50": slice(20, 50)}  # after the action


class Design(NamedTuple):
    """Sampled sites; on each, weathers of its own before the action, and after each several that may follow."""

    sites: int
    pasts: int
    futures: int
    years: tuple[int, ...]  # in which the action is taken, rising, the first 0

    def seeds(self) -> list[int]:
        """Seeds of the sites."""
        return [open_loop.FIRST_SITE_SEED + k for k in range(self.sites)]

    def past_seeds(self, site: int, past: int) -> sim.Seeds:
        """Seeds of what comes before the action on a site, counted from 0."""
        return open_loop.own_seeds(self.seeds()[site], past, self.pasts * (1 + self.futures))

    def future_seeds(self, site: int, past: int, future: int) -> sim.Seeds:
        """Seeds of what follows: no past's, and no other site's."""
        weather = self.pasts + past * self.futures + future
        return open_loop.own_seeds(self.seeds()[site], weather, self.pasts * (1 + self.futures))


FULL = Design(sites=24, pasts=2, futures=3, years=(0, 5, 15, 30))
QUICK = Design(sites=3, pasts=2, futures=2, years=(0, 5))


@dataclass
class Args:
    """Measures the effects of actions on both returns and the noise around them."""

    quick: bool = False
    """3 sites and 12 years, into results/quick/studies"""


# ------------------------------------------------------------------------------------------------ episodes


def order(reference: str, dice, years: int) -> np.ndarray:
    """Every year's actions in the order in which the policy would take them, the first valid one, (years, 25).

    The first valid one of a random order is a uniform draw of the valid ones, and two stands that take the same dice
    differ in it only where the first stand's action is not valid in the second.
    """
    if reference == UNIFORM:
        numbers = np.tile(np.arange(sim.management.NUM_ACTIONS), (years, 1))
        return np.random.default_rng(dice).permuted(numbers, axis=1)
    return fixed(22, years)


def fixed(action: int, years: int) -> np.ndarray:
    """The order of a policy that takes this action where it is valid, else none, (years, 25)."""
    return np.tile(list(dict.fromkeys((action, boreal_env.NO_CHANGE, *range(sim.management.NUM_ACTIONS)))), (years, 1))


def advance(stands: sim.Stands, orders: np.ndarray) -> np.ndarray:
    """Step stands through the years of their orders (n, years, 25); rewards (n, years, 2)."""
    everyone = np.arange(len(orders))
    rewards = np.empty((*orders.shape[:2], 2))
    for year in range(orders.shape[1]):
        valid = open_loop.valid_actions(stands.stocks(everyone))
        first = np.take_along_axis(valid, orders[:, year], axis=1).argmax(axis=1)
        actions = orders[everyone, year, first]
        rewards[:, year] = open_loop.rewards_of_year(stands.step(actions), actions)
    return rewards


def branch(state: dict, rows, seeds, **arguments) -> sim.Stands:
    """Stands that go on from rows of a `sim.Stands.get_state`, each with its own dice from here on; arguments : of
    `sim.Stands`."""
    stands = sim.Stands(len(rows), **arguments)
    chosen = {name: state[name][rows] for name in ("parameters", "state", "record", "years")}
    stands.set_state({**chosen, "streams": np.array([streams_of(one) for one in seeds]), "seeds": seeds})
    return stands


def pasts(design: Design) -> dict[int, dict]:
    """States of the stands at the beginning of each of the design's years; rows: reference, site, past."""
    cases = list(product(REFERENCES, range(design.sites), range(design.pasts)))
    stands = sim.Stands(len(cases))
    seeds = [design.past_seeds(site, past) for _, site, past in cases]
    stands.start(np.arange(len(cases)), [sim.sample_site(design.seeds()[site]) for _, site, _ in cases], seeds)
    states, now = {}, 0
    for year in design.years:
        if year > now:
            orders = [order(reference, [design.seeds()[site], past], year)[now:] for reference, site, past in cases]
            advance(stands, np.array(orders))
        states[year], now = stands.get_state(), year
    return states


def play(design: Design, years: int, states: dict[int, dict], played) -> dict[int, np.ndarray]:
    """Year of the action -> rewards from then on, (references, sites, pasts, futures, ACTIONS, years, 2).

    NaN where the action is not valid in that year; played : called with the number of stand-years just simulated.
    """
    shape = (len(REFERENCES), design.sites, design.pasts)
    rewards = {}
    for year, state in states.items():
        stands = sim.Stands(len(state["years"]))
        stands.set_state(state)
        valid = open_loop.valid_actions(stands.stocks(np.arange(stands.number)))[:, list(ACTIONS.values())]
        valid = np.repeat(valid.reshape(*shape, 1, len(ACTIONS)), design.futures, axis=3)
        left = years - year
        rewards[year] = np.full((*valid.shape, left, 2), np.nan)
        for chunk in chunks(np.argwhere(valid)):
            rows = np.ravel_multi_index(chunk[:, :3].T, shape)
            seeds, orders = [], []
            for reference, site, past, future, action in chunk:
                seeds.append(design.future_seeds(site, past, future))
                dice = [design.seeds()[site], past, future, 1]
                orders.append(order(REFERENCES[reference], dice, left))
                orders[-1][0, 0] = list(ACTIONS.values())[action]
            rewards[year][tuple(chunk.T)] = advance(branch(state, rows, seeds), np.array(orders))
            played(len(chunk) * left)
    return rewards


def play_every_year(design: Design, years: int, state: dict, played) -> np.ndarray:
    """Rewards when every year has the same action, (sites, pasts, futures, ACTIONS, years, 2)."""
    cases = np.array(list(np.ndindex(design.sites, design.pasts, design.futures, len(ACTIONS))))
    rewards = []
    for chunk in chunks(cases):
        seeds = [design.future_seeds(site, past, future) for site, past, future, _ in chunk]
        orders = [fixed(list(ACTIONS.values())[action], years) for action in chunk[:, 3]]
        # the first reference's first past is row 0 of each site: in year 0 they do not differ
        rewards.append(advance(branch(state, chunk[:, 0] * design.pasts, seeds), np.array(orders)))
        played(len(chunk) * years)
    return np.concatenate(rewards).reshape(design.sites, design.pasts, design.futures, len(ACTIONS), years, 2)


def chunks(cases: np.ndarray) -> list[np.ndarray]:
    """The cases in parts of at most CHUNK."""
    return [cases[first : first + CHUNK] for first in range(0, len(cases), CHUNK)]


# ---------------------------------------------------------------------------------------------- statistics


def weighed(rewards: np.ndarray, weighting: float) -> np.ndarray:
    """Sums over the years (..., years, 2), each year's weight `weighting` times the last's; (..., OBJECTIVES)."""
    sums = np.tensordot(rewards, weighting ** np.arange(rewards.shape[-2]), axes=(-2, 0))
    return np.concatenate([sums, sums.mean(axis=-1, keepdims=True)], axis=-1)


def by_site(first: np.ndarray, second: np.ndarray) -> pd.DataFrame:
    """What each site adds to the estimates: values of either action (sites, pasts, futures), NaN where not valid.

    Columns: pairs; effect, square (means over the pairs); first, second (means of the values); and sums of squares
    about the site's mean and about the mean of each past, with their degrees of freedom.
    """
    there = ~np.isnan(first - second)
    values = np.where(there, [first, second], 0.0)  # (2, sites, pasts, futures)
    difference = values[0] - values[1]
    pairs, each_past = there.sum(axis=(1, 2)), there.sum(axis=2)
    means = values.sum(axis=(2, 3)) / np.maximum(pairs, 1)
    past_means = values.sum(axis=3) / np.maximum(each_past, 1)
    about_site = np.where(there, values - means[:, :, None, None], 0.0)
    about_past = np.where(there, values - past_means[..., None], 0.0)
    return pd.DataFrame(
        {
            "pairs": pairs,
            "effect": difference.sum(axis=(1, 2)) / np.maximum(pairs, 1),
            "square": (difference**2).sum(axis=(1, 2)) / np.maximum(pairs, 1),
            "first": means[0],
            "second": means[1],
            "site_squares": (about_site**2).sum(axis=(0, 2, 3)),
            "site_freedom": 2 * np.maximum(pairs - 1, 0),
            "past_squares": (about_past**2).sum(axis=(0, 2, 3)),
            "past_freedom": 2 * np.maximum(each_past - 1, 0).sum(axis=1),
        }
    )[pairs > 0].reset_index(drop=True)


def estimates(sites: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Effect and noises of `by_site`'s columns, each (..., sites): a row of sites, or resampled ones.

    effect : mean over the sites; rms_effect : root mean square over pairs. Standard deviations of a value: noise, over
    sites and all dice; site_noise, about the site's mean; state_noise, about the mean of what is known when the action
    is taken. The signal to noise is the effect over each of them.
    """
    with np.errstate(invalid="ignore"):  # NaN where no site, or no past, has two pairs
        site_variance = sites["site_squares"].sum(axis=-1) / sites["site_freedom"].sum(axis=-1)
        state_variance = sites["past_squares"].sum(axis=-1) / sites["past_freedom"].sum(axis=-1)
    # the variance of the sites' means has some of the variance within them, which is not to count twice
    between = (sites["first"].var(axis=-1, ddof=1) + sites["second"].var(axis=-1, ddof=1)) / 2
    variance = between + site_variance * (1 - (1 / sites["pairs"]).mean(axis=-1))
    effect = sites["effect"].mean(axis=-1)
    noises = {"noise": variance**0.5, "site_noise": site_variance**0.5, "state_noise": state_variance**0.5}
    return {
        "effect": effect,
        "rms_effect": sites["square"].mean(axis=-1) ** 0.5,
        **noises,
        **{name.replace("noise", "signal_to_noise"): effect / noise for name, noise in noises.items()},
    }


def episodes_needed(signal_to_noise):
    """Episodes, half of them with either action, at which the 95 % interval of the difference is as wide as it.

    The standard error of the difference of two means of n / 2 episodes each is 2 noise / sqrt(n). With so many the
    difference is found significant in half of the experiments; in 80 % with twice as many.
    """
    ratio = np.asarray(signal_to_noise, dtype=float)
    return np.where(ratio > 0, (2 * Z / np.where(ratio > 0, ratio, 1.0)) ** 2, np.inf)


def resampled(sites: pd.DataFrame) -> dict[str, np.ndarray]:
    """The columns with REPETITIONS rows of sites drawn with replacement."""
    drawn = np.random.default_rng(0).integers(len(sites), size=(REPETITIONS, len(sites)))
    return {name: column.to_numpy(dtype=float)[drawn] for name, column in sites.items()}


def summarise(first: np.ndarray, second: np.ndarray) -> dict:
    """Estimates with 95 % bootstrap intervals over the sites, and episodes needed; NaN for fewer than two sites."""
    sites = by_site(first, second)
    row = {"sites": len(sites), "pairs": int(sites.pairs.sum())}
    if len(sites) < 2:
        return row
    estimate = estimates({name: column.to_numpy(dtype=float) for name, column in sites.items()})
    spread = estimates(resampled(sites))
    for name, value in estimate.items():
        row[name] = value
        row[f"{name}_low"], row[f"{name}_high"] = np.percentile(spread[name], [2.5, 97.5])
    sign = np.sign(estimate["effect"])
    for name in ("", "site_", "state_"):
        ratio = f"{name}signal_to_noise"
        ends = sorted(sign * row[f"{ratio}{end}"] for end in ("_low", "_high"))
        row[f"{name}episodes"] = episodes_needed(sign * row[ratio])
        row[f"{name}episodes_low"], row[f"{name}episodes_high"] = episodes_needed(ends[::-1])
    return row


def mean_effect(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Mean effect of each site with pairs, (sites, ...), of values (sites, pasts, futures, ...)."""
    difference = (first - second).reshape(len(first), -1, *first.shape[3:])
    there = ~np.isnan(difference).reshape(*difference.shape[:2], -1).any(axis=2)
    return np.array([one[valid].mean(axis=0) for one, valid in zip(difference, there, strict=True) if valid.any()])


def time_shares(curve: np.ndarray) -> dict[str, float]:
    """Shares of each of PERIODS in an effect, year by year (years,); signs aside, so that they add up to 1."""
    sums = {name: abs(curve[period].sum()) for name, period in PERIODS.items()}
    return {name: value / sum(sums.values()) for name, value in sums.items()}


def table_of_years(curves: np.ndarray) -> pd.DataFrame:
    """Mean over the sites of the effect in each year after the action, with its interval; curves (sites, years)."""
    drawn = np.random.default_rng(0).integers(len(curves), size=(REPETITIONS, len(curves)))
    low, high = np.percentile(curves[drawn].mean(axis=1), [2.5, 97.5], axis=0)
    return pd.DataFrame(
        {
            "years_after": np.arange(curves.shape[1]),
            "effect": curves.mean(axis=0),
            "effect_low": low,
            "effect_high": high,
        }
    )


def analyse(cases) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Both tables, of ((reference, year), rewards (sites, pasts, futures, ACTIONS, years, 2)), ... ."""
    rows, curves = [], []
    for ((reference, year), rewards), (contrast, names) in product(cases, CONTRASTS.items()):
        first, second = (rewards[:, :, :, list(ACTIONS).index(name)] for name in names)
        whole = mean_effect(first, second)
        sums = {name: [weighed(side, weight) for side in (first, second)] for name, weight in WEIGHTINGS.items()}
        for k, objective in enumerate(OBJECTIVES):
            case = {"reference": reference, "contrast": contrast, "year": year, "objective": objective}
            shares = {}
            if len(whole) > 1 and objective != EQUAL:
                curves.append(table_of_years(whole[..., k]).assign(**case))
                shares = time_shares(whole[..., k].mean(axis=0))
            # an advantage judges one action; for a plan there is the return alone
            for weighting in WEIGHTINGS if year != EVERY else ("return",):
                row = summarise(*(side[..., k] for side in sums[weighting]))
                rows.append(case | {"weighting": weighting} | row | (shares if weighting == "return" else {}))
    table = pd.DataFrame(rows)
    key = ["reference", "contrast", "year", "objective"]
    whole = table[table.weighting == "return"].set_index(key)
    # what an advantage carries of an effect that is not told from none is no number
    whole = whole.effect.where(whole.effect_low * whole.effect_high > 0)
    table["carried"] = table.effect / whole.loc[pd.MultiIndex.from_frame(table[key])].to_numpy()
    years = pd.concat(curves, ignore_index=True)
    return table, years[[*key, "years_after", "effect", "effect_low", "effect_high"]]


# -------------------------------------------------------------------------------------------------- main


def study(design: Design, years: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Both tables of a design, in episodes of so many years."""
    arms = len(REFERENCES) * design.sites * design.pasts * design.futures * len(ACTIONS)
    most = arms * sum(years - year for year in design.years) + arms // len(REFERENCES) * years
    progress = protocol.Progress("effects", most, "stand-years at most")
    states = pasts(design)
    cases = [((ALONE, EVERY), play_every_year(design, years, states[0], progress.add))]
    for year, rewards in play(design, years, states, progress.add).items():
        cases += [((reference, str(year)), rewards[k]) for k, reference in enumerate(REFERENCES)]
    return analyse(cases)


def report(table: pd.DataFrame) -> None:
    """Print the effects, the noise and the episodes needed."""
    print(
        "\nEffect of an action on the rest of the episode, noise of the same sum, episodes to tell the two actions "
        "apart\n(undiscounted; 95 % intervals over sites)"
    )
    print(
        f"{'reference':19s} {'contrast':24s} {'year':>5s} {'objective':13s} {'effect':>24s} {'noise':>6s} "
        f"{'of site':>7s} {'of state':>8s} {'episodes':>10s} {'site base':>10s} {'state base':>10s} {'0-5':>5s} "
        f"{'5-20':>5s} {'20-50':>5s}"
    )
    for row in table[(table.weighting == "return") & table.effect.notna()].itertuples():
        shares = [] if pd.isna(row.years_0_5) else [row.years_0_5, row.years_5_20, row.years_20_50]
        interval = f"{row.effect:+.4f} [{row.effect_low:+.3f}, {row.effect_high:+.3f}]"
        needed = (row.episodes, row.site_episodes, row.state_episodes)
        print(
            f"{row.reference:19s} {row.contrast:24s} {row.year:>5s} {row.objective:13s} {interval:>24s} "
            f"{row.noise:6.2f} {row.site_noise:7.2f} {row.state_noise:8.2f} "
            f"{' '.join(f'{n:10,.0f}' for n in needed)} {' '.join(f'{share:5.0%}' for share in shares)}"
        )


def main(args: Args) -> None:
    """Play and analyse, unless the tables are there."""
    design, years = (QUICK, 12) if args.quick else (FULL, YEARS)
    folder = paths.studies(args.quick)
    files = [folder / f"signal_to_noise{end}.csv" for end in ("_years", "")]
    settings = {
        **design._asdict(),
        "episode_years": years,
        "actions": ACTIONS,
        "contrasts": CONTRASTS,
        "weightings": WEIGHTINGS,
        "weathers": "each site's own",
    }
    if all(stored.is_finished(path, settings) for path in files):
        print(f"{files[-1]} is finished")
        report(stored.read(files[-1], text=("year",)))
        return
    table, curves = study(design, years)
    for path, one in zip(files, (curves, table), strict=True):
        stored.write(path, one, settings)
    report(table)
    print(f"\nwrote {' and '.join(map(str, files))}")


if __name__ == "__main__":
    main(protocol.parse(Args))
