"""Chooses the sites that methods are evaluated on, of many candidates, by their parameters alone.

    python analysis/choose_sites.py          # half a minute

200 test and 100 validation sites whose distribution is that of all sites in what decides gains: the boundary's
temperature less the air's, winter snow, wind, latitude. A site is the one that its episode's seed draws; candidates
are seeds that no training uses. Each next site is the one that brings the energy distance between the chosen ones and
all candidates down the most (support points, Mak and Joseph 2018, found greedily), so that any first ones are balanced
too. Writes cleanrl_style/protocol/evaluation_sites.csv.
"""

from dataclasses import dataclass
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd
from scipy import stats
from scipy.spatial.distance import cdist

import sim
from analysis import paths
from cleanrl_style import protocol
from cleanrl_style.flags import TEST_SITES
from cleanrl_style.protocol import sites
from sim.physical_constants import FREEZING_POINT_K

NUMBERS = {"test": TEST_SITES, "validation": 100}


@dataclass
class Args:
    """Chooses the sites of the evaluation."""

    candidates: int = 10_000
    """seeds to choose from"""
    path: Path = Path("cleanrl_style", "protocol", sites.TABLE)
    """table to write"""


def site_seed_of(seed: int) -> int:
    """The site of an episode whose environment is reset with this seed."""
    return int(gym.utils.seeding.np_random(seed)[0].integers(2**31))


def strata(site: dict[str, float]) -> dict[str, float]:
    """What decides gains, of a site's parameters."""
    boundary = site["deep_boundary_temperature_k"] - FREEZING_POINT_K
    return {
        "boundary_less_air_k": boundary - site["mean_annual_temperature_c"],
        "winter_snow_mm_day": site["winter_snow_prob"] * site["winter_snow_mm_day"],
        "wind_speed_m_s": site["wind_speed_m_s"],
        "latitude_deg": site["latitude_deg"],
    }


def support_points(values: np.ndarray, number: int, barred=()) -> list[int]:
    """Rows of values (n, k), in the order in which they are chosen, none of `barred`. Distances are between ranks."""
    ranks = stats.rankdata(values, axis=0) / len(values)
    to_all = np.concatenate([cdist(part, ranks).mean(axis=1) for part in np.array_split(ranks, 20)])
    to_all[list(barred)] = np.inf
    to_chosen, chosen = np.zeros(len(values)), []
    for k in range(number):
        best = int(np.argmin(to_all - to_chosen / (k + 1)))
        chosen.append(best)
        to_all[best] = np.inf
        to_chosen += cdist(ranks, ranks[[best]])[:, 0]
    return chosen


def main(args: Args) -> None:
    """Choose and write."""
    if args.candidates < sum(NUMBERS.values()):
        protocol.fail(f"--candidates {args.candidates}: at least {sum(NUMBERS.values())}, as many as are chosen")
    paths.make_file_writable("--path", args.path)
    seeds = sites.FIRST_EVALUATION_SEED + np.arange(args.candidates)
    table = pd.DataFrame({"seed": seeds, "site_seed": [site_seed_of(int(seed)) for seed in seeds]})
    values = pd.DataFrame([strata(sim.sample_site(seed)) for seed in table.site_seed])
    rows, parts = [], []
    for split, number in NUMBERS.items():
        chosen = support_points(values.to_numpy(), number, barred=rows)
        rows += chosen
        part = pd.concat([table, values.round(4)], axis=1).iloc[chosen]
        part.insert(0, "split", split)
        parts.append(part)
    with protocol.replacing(args.path) as file:
        pd.concat(parts).to_csv(file, index=False, lineterminator="\n")
    print(f"{args.path}: {len(rows)} sites of {args.candidates}")


if __name__ == "__main__":
    main(protocol.parse(Args))
