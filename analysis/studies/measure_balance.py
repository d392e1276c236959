"""Measures the carbon scale of `boreal-balanced-v0`, at which both returns vary equally in its world.

Reference policies, the 25 constant actions and the four fixed strategies, play the same sites and weathers; where an
action is not valid, nothing is done. The spread of a return is its standard deviation between those policies of a site
that a preference chooses between: those that no other beats in both returns. It is pooled over sites. Carbon counts as
the net change over the carbon scale, before penalties and clipping, so that its spread is in proportion to 1 /
carbon_scale; thaw as rewarded.
"""

from dataclasses import dataclass

import numpy as np

import boreal_env
from analysis.metrics import is_nondominated
from baselines_heuristic import conifer_restoration, obeying, plus_100, target_density, zero_change
from cleanrl_style import protocol
from cleanrl_style.protocol import final_info

FIRST_SEED = 2_000_000_000  # met neither in training nor in evaluation


@dataclass
class Args:
    """Prints the carbon scale at which both returns vary equally between the policies that none beats in both."""

    sites: int = 40
    """sites, each with one start and weather, the same for every policy"""
    years: int = 50
    """length of an episode"""


def reference_policies() -> dict:
    """Name -> function of observations (n, d) and masks (n, 25) that gives probabilities (n, 25), all of one action."""
    policies = {f"action {a}": lambda observations, masks, a=a: np.full(len(masks), a) for a in range(25)}
    for strategy in (zero_change, plus_100, target_density, conifer_restoration):
        policies[strategy.__name__.rsplit(".")[-1]] = strategy.policy
    return {name: obeying(policy) for name, policy in policies.items()}


def play(args: Args, **reward) -> np.ndarray:
    """Net carbon change [kgC m-2], carbon and thaw return of every episode, shape (policies, sites, 3)."""
    seeds = [FIRST_SEED + site for site in range(args.sites)]
    envs = boreal_env.BorealVectorEnv(
        args.sites, years=args.years, record_years=True, reward=reward, **boreal_env.BALANCED_WORLD
    )
    columns = ("net_carbon_change_kgc_m2", "carbon_reward", "thaw_reward")
    sums = []
    for policy in reference_policies().values():
        observations, _ = envs.reset(seed=seeds)
        for _ in range(args.years):
            observations, _, _, _, infos = envs.step(policy(observations, envs.action_masks()).argmax(axis=1))
        years = [final_info(infos, site, ["years"])["years"] for site in range(args.sites)]
        sums.append([[record[name].sum() for name in columns] for record in years])
    return np.array(sums)


def unbeaten(sums: np.ndarray) -> np.ndarray:
    """Which policies no other beats in both returns on a site, each once; bool (policies, sites)."""
    return np.column_stack([is_nondominated(site[:, 1:]) for site in sums.swapaxes(0, 1)])


def within_site_spread(sums: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Standard deviation between the chosen policies of a site, pooled over sites; (policies, sites, n) to (n,)."""
    return np.sqrt(sums.var(axis=0, where=chosen[:, :, None]).mean(axis=0))


def main(args: Args) -> None:
    """Play every policy on every site, and print the spreads and the scale that makes them equal."""
    paper = boreal_env.Reward().carbon_scale
    sums = play(args)
    print("mean over the sites   change/scale   carbon     thaw")
    for name, (change, carbon, thaw) in zip(reference_policies(), sums.mean(axis=1), strict=True):
        print(f"{name:20s} {change / paper:+13.3f} {carbon:+8.2f} {thaw:+8.2f}")
    chosen = unbeaten(sums)
    change, carbon, thaw = within_site_spread(sums, chosen)
    if not (change > 0.0 and thaw > 0.0):
        protocol.fail("--sites, --years: too few: on none do two policies differ that no other beats in both returns")
    scale = float(f"{change / thaw:.2g}")
    print(
        f"\nwithin-site standard deviations: of {len(sums)} policies the {chosen.sum(axis=0).mean():.1f} in the mean "
        f"that none beats in both, {args.sites} sites, {args.years} years"
    )
    print(
        f"at carbon_scale {paper:g}: change/scale {change / paper:.4f}, thaw {thaw:.4f}, ratio "
        f"{change / paper / thaw:.4f}; carbon return with penalties {carbon:.3f}"
    )
    print(f"balanced carbon_scale: {change / thaw:.4f}, to two digits {scale:g} kgC m-2 yr-1")
    carbon = within_site_spread(play(args, carbon_scale=scale), chosen)[1]
    print(f"at carbon_scale {scale:g}: carbon return with penalties and clipping {carbon:.3f}")


if __name__ == "__main__":
    main(protocol.parse(Args))
