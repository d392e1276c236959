"""Finished runs for tests: two that are committed, of numbers to compute with by hand, and others made on the spot."""

import json
import shutil
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from cleanrl_style.protocol import EPISODE_INFO
from cleanrl_style.protocol.evaluation import evaluation_columns
from cleanrl_style.protocol.fronts import return_columns, weight_columns
from cleanrl_style.protocol.provenance import physics_name

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
    for policy, shift in (("greedy", 0.0), ("sampled", 100.0)):
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
    episodes = pd.DataFrame(rows, columns=evaluation_columns(("carbon", "thaw")))
    w = episodes.preference
    episodes["scalarized_return"] = w * episodes.carbon_return + (1 - w) * episodes.thaw_return
    folder.mkdir(parents=True)
    episodes.to_csv(folder / "evaluation.csv", index=False)
    trains = script.startswith(("ppo", "eupg"))
    for name in ("timing", "evaluation_years", *(["episodes"] if trains else [])):
        shutil.copy(TINY_RUNS / "curriculum" / f"{name}.csv", folder)
    if preference is not None:
        not_default["preference"] = preference
    steps = {"total_timesteps": 300_000} if trains else {}
    write_config(folder, script, seed, env_id, list(weights), steps, not_default)


def write_run_of_three(folder, script, returns, seed=1, env_id="timber_env:timber-v0"):
    """A finished run of carbon, thaw and timber, evaluated at their corners; returns : a row a corner."""
    objectives, corners = ("carbon", "thaw", "timber"), np.eye(3)
    trains = script.startswith(("ppo", "eupg"))
    parts = {"evaluation": [], "episodes": [], "evaluation_years": []}
    for weights, mean in zip(corners, np.asarray(returns, dtype=float), strict=True):
        its_weights = dict(zip(weight_columns(objectives), weights, strict=True))
        for episode, shift in enumerate((-1.0, 1.0)):
            scores = dict(zip(return_columns(objectives), mean + shift, strict=True))
            scores["scalarized_return"] = weights @ (mean + shift)
            one = {**its_weights, "episode": episode, "seed": episode, "site_seed": episode, **scores}
            parts["evaluation"] += [{"policy": policy, **one} for policy in ("greedy", "sampled")]
            stand = dict.fromkeys(EPISODE_INFO, 0.5)
            parts["episodes"].append({"global_step": 100 * (episode + 1), "env": 0, **its_weights, **scores, **stand})
        for policy, year in product(("greedy", "sampled"), (1, 2)):
            statistics = dict.fromkeys(("mean", "sd", "p10", "p50", "p90"), 500.0)
            row = {"policy": policy, **its_weights, "year": year, "variable": "density_stems_ha", **statistics}
            parts["evaluation_years"].append(row)
    folder.mkdir(parents=True)
    for name, rows in parts.items():
        if trains or name != "episodes":
            pd.DataFrame(rows).to_csv(folder / f"{name}.csv", index=False)
    shutil.copy(TINY_RUNS / "curriculum" / "timing.csv", folder)
    write_config(folder, script, seed, env_id, corners.tolist(), {"total_timesteps": 200} if trains else {}, {})


def write_config(folder, script, seed, env_id, weights, steps, not_default):
    """The config.json of a run that is evaluated on two episodes."""
    arguments = {"seed": seed, "env_id": env_id, "mode": "generalist", "site_seed": None, "eval_weights": weights}
    arguments |= {"thaw_formulation": "asymmetric", "eval_episodes": 2, **steps, **not_default}
    config = {"script": script, "arguments": arguments, "not_default": not_default, "physics": physics_name()}
    (folder / "config.json").write_text(json.dumps(config))
