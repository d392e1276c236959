"""How far the sites that the curriculum accepted and rejected would warm if nothing were done there.

    python analysis/studies/site_warming.py

Reads the training episodes of the curriculum's runs, draws some of both kinds from each run, and leaves their sites
alone for 50 years. Leaves results/studies/site_warming.csv, one row a drawn episode.
"""

import hashlib
import sys
from dataclasses import dataclass

import numpy as np
import pandas as pd

import boreal_env
import sim
from analysis import results, stored
from analysis.reduction import as_text
from analysis.studies import open_loop
from cleanrl_style import protocol

YEARS = 50
EACH = 60  # episodes of each kind and run


@dataclass
class Args:
    """Warming without management of the sites that the curriculum accepted and rejected."""

    quick: bool = False
    """of the runs of `reproduce.py --quick`: 2 episodes of each kind and 5 years, into results/quick/studies"""


def drawn_episodes(episodes: pd.DataFrame, seed: int, each: int) -> pd.DataFrame:
    """`each` episodes of a run that were trained on and as many that were skipped (fewer if there are fewer)."""
    generator = np.random.default_rng(seed)
    kinds = [episodes[episodes.selected == selected] for selected in (0, 1)]
    return pd.concat([kind.iloc[generator.permutation(len(kind))[:each]] for kind in kinds], ignore_index=True)


def study(curricula: list[results.Replicate], each: int, years: int) -> pd.DataFrame:
    """Latitude [degN] and heat through the boundary [MJ m-2 yr-1] of the drawn sites, left alone."""
    tables = []
    progress = protocol.Progress("sites", len(curricula), "runs")
    for number, curriculum in enumerate(curricula):
        run = curriculum.runs[0]
        drawn = drawn_episodes(run.tables["sample"], run.arguments["seed"], each)
        sites = [sim.sample_site(int(seed)) for seed in drawn.site_seed]
        seeds = [open_loop.seeds(int(seed), k) for k, seed in enumerate(drawn.site_seed)]
        episodes = open_loop.play(sites, seeds, np.full((len(drawn), years), boreal_env.NO_CHANGE))
        tables.append(
            pd.DataFrame(
                {
                    "seed": run.arguments["seed"],
                    "site_seed": drawn.site_seed,
                    "selected": drawn.selected,
                    "latitude_deg": [site["latitude_deg"] for site in sites],
                    "warming_mj_m2": episodes.total("boundary_warming_mj_m2") / years,
                    "cooling_mj_m2": episodes.total("boundary_cooling_mj_m2") / years,
                    "thaw_return": episodes.returns()[:, 1],
                }
            )
        )
        progress.show(number + 1)
    return pd.concat(tables, ignore_index=True)


def digest(curricula: list[results.Replicate]) -> str:
    """Hash of the training episodes that are drawn from."""
    texts = [as_text("sample", curriculum.runs[0].tables["sample"]) for curriculum in curricula]
    return hashlib.sha256("".join(texts).encode()).hexdigest()[:16]


def main(args: Args) -> None:
    """Play the drawn sites, unless the table is there."""
    found = results.Results.load(args.quick, here=True)
    curricula = found.of("main", "ppo_curriculum")
    if not curricula:
        command = found.first_job("main", "ppo_curriculum").command
        sys.exit(f"error: no finished run of the curriculum; {command} makes the first")
    each, years = (2, 5) if args.quick else (EACH, YEARS)
    path = found.studies_dir / "site_warming.csv"
    seeds = [curriculum.runs[0].arguments["seed"] for curriculum in curricula]
    settings = {"seeds": seeds, "each": each, "years": years, "samples": digest(curricula)}
    if stored.is_finished(path, settings):
        print(f"{path} is finished")
        return
    stored.write(path, study(curricula, each, years), settings)
    print(f"wrote {path}")


if __name__ == "__main__":
    main(protocol.parse(Args))
