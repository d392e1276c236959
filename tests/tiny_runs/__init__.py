"""Finished runs for tests: two that are committed, of numbers to compute with by hand, and others made on the spot."""

import json
import shutil
from pathlib import Path

import pandas as pd

from cleanrl_style.protocol.evaluation import EVALUATION_COLUMNS

TINY_RUNS = Path(__file__).parent


def write_run(
    folder,
    script,
    seed=1,
    carbon=(0, 1, 2),
    thaw=(2, 1, 0),
    weights=(0.0, 0.5, 1.0),
    env_id="boreal-generalist-v0",
    preference=None,
    **not_default,
):
    """A finished run whose mean returns per weight are the given ones."""
    rows = []
    for policy, shift in (("greedy", 100.0), ("sampled", 0.0)):
        for weight, c, t in zip(weights, carbon, thaw, strict=True):
            for episode, site in enumerate((-1.0, 1.0)):
                rows.append(
                    {
                        "policy": policy,
                        "preference": weight,
                        "episode": episode,
                        "seed": episode,
                        "site_seed": episode,
                        "carbon_return": c + site + shift,
                        "thaw_return": t + 3 * site + shift,
                        "growing_season_days": 110 + 10 * site,
                        "latent_heat_mj_m2": 500 - site,
                        "ground_shortwave_mj_m2": 1500 + site,
                    }
                )
    episodes = pd.DataFrame(rows, columns=EVALUATION_COLUMNS)
    w = episodes.preference
    episodes["scalarized_return"] = w * episodes.carbon_return + (1 - w) * episodes.thaw_return
    folder.mkdir(parents=True)
    episodes.to_csv(folder / "evaluation.csv", index=False)
    trains = script.startswith(("ppo", "eupg"))
    for name in ("timing", "evaluation_years", *(["episodes"] if trains else [])):
        shutil.copy(TINY_RUNS / "curriculum" / f"{name}.csv", folder)
    if preference is not None:
        not_default["preference"] = preference
    arguments = {
        "seed": seed,
        "env_id": env_id,
        "thaw_formulation": "asymmetric",
        "site_seed": None,
        "mode": "generalist",
        "eval_weights": list(weights),
        "eval_episodes": 2,
        **({"total_timesteps": 300_000} if trains else {}),
        **not_default,
    }
    config = {"script": script, "arguments": arguments, "not_default": not_default}
    (folder / "config.json").write_text(json.dumps(config))
