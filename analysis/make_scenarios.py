"""Writes sim/scenarios.csv, the paths of climate and carbon dioxide of boreal land, from published data.

    python analysis/make_scenarios.py --atlas <folder> --concentrations <file>

Three steps, so that the warming is what the IPCC assesses and not what the hottest models give:

1. How much warmer the world gets than in 1995-2014: the best estimates of IPCC AR6 WGI, Table SPM.1, by straight lines
   through the middles of their periods, and on to 2100.
2. How many times as much boreal land warms: by scenario the median over the CMIP6 models of the IPCC's Atlas, of their
   warming from 1995-2014 to 2081-2100 in West Siberia, East Siberia and north-western North America (equal weights),
   over that of the world. And how unevenly over the year: the part of the warming that goes with the seasons (its first
   harmonic, in phase with a warmest day of 17 July), per degree of its mean.
3. Precipitation: 4 % more per degree of local warming. The Atlas has for North Asia 2080-2099, against 1981-2000, 3.0 K
   and 9 % in summer and 4.9 K and 22 % in winter under RCP4.5, 5.6 K and 9 % and 9.7 K and 56 % under RCP8.5 (section
   Atlas.5.2.5): over the mean of both seasons 3.9 and 4.2 % per degree.

Carbon dioxide is Meinshausen et al. (2020)'s, the yearly means that CMIP6 was given.

--atlas : the folder CMIP6_tas_landsea of github.com/IPCC-WG1/Atlas, datasets-aggregated-regionally (Iturbide et al.
2020, 10.5194/essd-12-2959-2020; CC-BY 4.0); a copy is in github.com/traupach/warming_levels, data.
--concentrations : rcmip-concentrations-annual-means-5-1-0.csv (10.5281/zenodo.4589756), or its part in the Python
package fair 1.6.4, fair/SSPs/data.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from cleanrl_style.flags import fail, parse
from cleanrl_style.protocol import replacing

SCENARIOS = ("ssp126", "ssp245", "ssp585")
REGIONS = ["WSB", "ESB", "NWN"]
BEFORE, AFTER = (1995, 2014), (2081, 2100)
YEARS = np.arange(2015, 2101)

#: Warming of the world above 1850-1900 [K] in 1995-2014, 2021-2040, 2041-2060 and 2081-2100 (AR6 WGI, Table SPM.1; the
#: first is observed, section A.1.2 and Cross-Section Box TS.1).
MIDDLES = (2004.5, 2030.5, 2050.5, 2090.5)
WORLD = {"ssp126": (0.85, 1.5, 1.7, 1.8), "ssp245": (0.85, 1.5, 2.0, 2.7), "ssp585": (0.85, 1.6, 2.4, 4.4)}
PRECIPITATION_PER_DEGREE = 0.04
WARMEST_DAY = 198
CARBON_DIOXIDE = "Atmospheric Concentrations|CO2"
FILE = Path(__file__).resolve().parent.parent / "sim" / "scenarios.csv"
SOURCE = """\
# Boreal land by scenario and year, against 1995-2014: warming [K], half-range over the year of that warming [K, below 0
# where winters warm more], precipitation [factor], carbon dioxide [ppm]. Written by analysis/make_scenarios.py from
# IPCC AR6 WGI Table SPM.1, the IPCC Atlas' CMIP6 models (Iturbide et al. 2020, CC-BY 4.0; section Atlas.5.2.5 for
# precipitation) and Meinshausen et al. (2020, Geosci. Model Dev. 13, 3571).
"""


@dataclass
class Args:
    """Writes sim/scenarios.csv from the IPCC Atlas' regional means and the concentrations of CMIP6."""

    atlas: Path
    """folder of CMIP6_<model>_<experiment>_<run>.csv"""
    concentrations: Path
    """csv of yearly concentrations by Scenario, Region and Variable"""


def concentrations(path: Path) -> pd.DataFrame:
    """The world's carbon dioxide by scenario; ends the command with one line for a file that is no such table."""
    try:
        table = pd.read_csv(path)
    except (ValueError, OSError) as error:
        fail(f"--concentrations {path}: {' '.join(str(error).split())}")
    lacking = [name for name in ("Scenario", "Region", "Variable", *YEARS.astype(str)) if name not in table]
    if lacking:
        fail(f"--concentrations {path}: it has no column {lacking[0]}")
    return table[(table.Region == "World") & (table.Variable == CARBON_DIOXIDE)].set_index("Scenario")


def monthly_means(path: Path, years: tuple[int, int]) -> pd.DataFrame | None:
    """Means by month (12, regions) over the years, both included; None if some are missing."""
    table = pd.read_csv(path, comment="#", index_col="date")
    months = table.index.str.split("-", expand=True).to_frame(index=False).astype(int)
    months = months.set_axis(["year", "month"], axis=1)
    inside = months.year.between(*years).to_numpy()
    if inside.sum() != 12 * (years[1] - years[0] + 1):
        return None
    return table[inside].groupby(months.month[inside].to_numpy()).mean()


def amplification(folder: Path) -> pd.DataFrame:
    """By scenario, medians over the models of the world's warming [K], of boreal over global warming, and of boreal
    warming's seasonal half-range over its mean."""
    season = np.cos(2.0 * np.pi * ((np.arange(12) + 0.5) * 365 / 12 - WARMEST_DAY) / 365)
    rows = []
    for past in sorted(folder.glob("CMIP6_*_historical_*.csv")):
        model = re.fullmatch(r"CMIP6_(.+)_historical_.+\.csv", past.name).group(1)
        before = monthly_means(past, BEFORE)
        for scenario in SCENARIOS:
            paths = sorted(folder.glob(f"CMIP6_{model}_{scenario}_*.csv"))
            after = monthly_means(paths[0], AFTER) if paths else None
            if before is None or after is None:
                continue
            warming = after - before
            boreal = warming[REGIONS].mean(axis=1).to_numpy()
            world = warming["world"].mean()
            half_range = 2.0 * (boreal * season).mean()
            rows.append((scenario, world, boreal.mean() / world, half_range / boreal.mean()))
    models = pd.DataFrame(rows, columns=["scenario", "world", "boreal", "season"]).groupby("scenario")
    return models.median().assign(models=models.size())


def world_warming(scenario: str) -> np.ndarray:
    """Warming of the world above 1995-2014 [K], of each of `YEARS`."""
    middles, warming = np.array(MIDDLES), np.array(WORLD[scenario])
    beyond = np.diff(warming)[-1] / np.diff(middles)[-1] * (YEARS - middles[-1])
    inside = np.interp(YEARS, middles, warming)
    return np.where(YEARS > middles[-1], warming[-1] + beyond, inside) - warming[0]


def main(args: Args) -> None:
    """Write the table, and print what it follows from."""
    ppm = concentrations(args.concentrations)
    if not any(args.atlas.glob("CMIP6_*_historical_*.csv")):
        fail(f"--atlas {args.atlas}: a folder with CMIP6_<model>_historical_<run>.csv is allowed")
    factors = amplification(args.atlas)
    for scenario in SCENARIOS:
        if scenario not in factors.index:
            fail(f"--atlas {args.atlas}: it has no CMIP6_<model>_{scenario}_<run>.csv of a model with the past")
        if scenario not in ppm.index:
            fail(f"--concentrations {args.concentrations}: it lacks {scenario}")
    print(factors.round(3).to_string())
    tables = []
    for scenario in SCENARIOS:
        warming = factors.boreal[scenario] * world_warming(scenario)
        table = {
            "scenario": scenario,
            "year": YEARS,
            "warming_k": warming.round(2),
            "warming_amplitude_k": (factors.season[scenario] * warming).round(2),
            "precipitation_factor": (1.0 + PRECIPITATION_PER_DEGREE * warming).round(3),
            "co2_ppm": ppm.loc[scenario, YEARS.astype(str)].to_numpy(float).round(1),
        }
        tables.append(pd.DataFrame(table))
    with replacing(FILE) as file:
        file.write((SOURCE + pd.concat(tables).to_csv(index=False, lineterminator="\n")).encode())
    print(f"wrote {FILE}")


if __name__ == "__main__":
    main(parse(Args))
