"""How much of the best known plans of the test sites each method reaches, with both policies.

Of the sites that analysis/best_plans.py has searched. `share` is a gain over doing nothing in that of the best known
plan, each a mean over sites before the division; NHGR and EUGR are means over sites of the ratios of
analysis/generalisation.py, in a scale that all methods of an environment share. Intervals are over training seeds.
"""

import numpy as np
import pandas as pd

from analysis import metrics, stored
from analysis.best_plans import unchanging
from analysis.generalisation import RATIOS, judged
from analysis.results import PAIR
from analysis.studies.constant_plans import DECIDUOUS, ENVIRONMENTS, as_evaluation
from analysis.tables.common import ROW_COLUMNS, over_seeds, row_of
from cleanrl_style.protocol import reference
from cleanrl_style.protocol.fronts import evaluation_weights
from cleanrl_style.protocol.score import by_weight

MADE_BY = "python analysis/best_plans.py"
WEIGHTS = evaluation_weights(2)
NOTHING, DENSE_DECIDUOUS = unchanging(reference.NOTHING), unchanging(str(DECIDUOUS))
#: Rows of plans that look at nothing: name -> title.
BLIND = {
    "dense_deciduous": "100 deciduous trees a year",
    "best_constant_mix": "the best constant plan of each weight",
    "best_constant_of_site": "the best constant plan of each site",
}
COLUMNS = ROW_COLUMNS | {
    "policy": "policy",
    "sites": "sites",
    **{f"share_{weight:g}": f"% of the best gain, weight {weight:g}" for weight in WEIGHTS},
    "share": "% of the best gain",
    "nhgr": "NHGR",
    "eugr": "EUGR",
}


def gains_of(plans: pd.DataFrame) -> pd.DataFrame:
    """The plans with returns less those of doing nothing on their site."""
    columns = metrics.return_columns(PAIR)
    nothing = plans[plans.plan == NOTHING].set_index("seed")[columns]
    gained = plans.copy()
    gained[columns] -= nothing.loc[plans.seed].to_numpy()
    return gained


def best_at(plans: pd.DataFrame, weights) -> pd.DataFrame:
    """Best scalarised gain of each site at weights: index the sites' seeds, columns the weights."""
    returns = plans[metrics.return_columns(PAIR)].to_numpy()
    table = pd.DataFrame({weight: returns @ metrics.pair(weight) for weight in weights}, plans.seed)
    return table.groupby(level="seed").max()


def shares(gained: pd.DataFrame, best: pd.DataFrame) -> dict:
    """Gains at each weight in the best known [%], and their mean over weights."""
    ours = by_weight(gained).scalarized_return.mean().reindex(best.columns)
    whole = best.loc[gained.seed.unique()].mean()
    return {f"share_{weight:g}": 100 * ours[weight] / whole[weight] for weight in best.columns} | {
        "share": 100 * ours.mean() / whole.mean()
    }


def rows_of(results, env_id: str, plans: pd.DataFrame) -> list[dict]:
    """Rows of an environment; plans : of its study."""
    plans = gains_of(plans)
    front, constant = plans[plans.front], plans[plans.constant]
    seeds = set(front.seed)
    found = {}  # (row's key, policy, number of the replicate) -> gains on the sites
    for key, replicates in results.rows.items():
        if key[1] != env_id or "thaw_formulation" in key[2]:
            continue
        for number, one in enumerate(replicates):
            for policy, gained in one.by_policy.items():
                chosen = None if gained is None else gained[gained.seed.isin(seeds)]
                if chosen is not None and set(chosen.seed) == seeds and set(chosen.preference) == set(WEIGHTS):
                    found[key, policy, number] = chosen
    best = best_at(front, WEIGHTS)
    rows = []
    if found:
        names = {str(name): name for name in found}
        table = judged({text: found[name] for text, name in names.items()}, front)
        ratios = table.groupby("policy")[list(RATIOS)].mean()
        numbers = {name: shares(found[name], best) | ratios.loc[text].to_dict() for text, name in names.items()}
        for key, policy in dict.fromkeys(name[:2] for name in found):
            of_row = pd.DataFrame([numbers[name] for name in found if name[:2] == (key, policy)])
            rows.append(row_of(key, len(of_row)) | {"policy": policy, "sites": len(seeds)} | over_seeds(of_row))
    for name, gained in of_blind_plans(constant, results.constant_plans_in(env_id, "asymmetric", None)).items():
        row = row_of((name, env_id, "default"), np.nan) | {"sites": len(seeds)}
        row |= {f"share_{weight:g}": 100 * gained[weight] / best[weight].mean() for weight in WEIGHTS}
        rows.append(row | {"share": 100 * gained.mean() / best.mean().mean()})
    return rows


def of_blind_plans(constant: pd.DataFrame, everywhere: pd.DataFrame | None) -> dict[str, pd.Series]:
    """Gain at each weight of the rows `BLIND`, mean over sites.

    constant : gains of the constant plans there; everywhere : their returns on all the sites of the score, on which
    that of each weight is chosen, as the score does; None where they are not measured, without that row then.
    """
    returns = constant[metrics.return_columns(PAIR)].to_numpy()
    gained = pd.DataFrame({weight: returns @ metrics.pair(weight) for weight in WEIGHTS})
    of_plans = gained.groupby(constant.plan.to_numpy()).mean()
    rows = {"dense_deciduous": of_plans.loc[DENSE_DECIDUOUS]}
    if everywhere is not None:
        chosen = by_weight(as_evaluation(everywhere, WEIGHTS)).plan.first()
        rows["best_constant_mix"] = pd.Series({w: of_plans.at[unchanging(plan), w] for w, plan in chosen.items()})
    return rows | {"best_constant_of_site": best_at(constant, WEIGHTS).mean()}


def make(results) -> pd.DataFrame:
    """A row a method, environment, setting and policy, where the run was evaluated on the searched sites."""
    rows = []
    for env_id in ENVIRONMENTS:
        path = results.studies_dir / "best_plans" / f"{env_id}.csv"
        if path.exists():
            rows += rows_of(results, env_id, stored.read(path, text=("plan",)))
    ends = [f"{name}{end}" for name in list(COLUMNS)[6:] for end in ("_low", "_high")]
    return pd.DataFrame(rows).reindex(columns=[*COLUMNS, *ends])
