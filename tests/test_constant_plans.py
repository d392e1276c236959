import numpy as np
import pandas as pd

from analysis.studies import constant_plans
from cleanrl_style import protocol


def test_a_plan_is_carried_out_where_it_is_valid(monkeypatch):
    masks = np.zeros((2, 25), dtype=bool)
    masks[0, constant_plans.PLANTING] = True
    observations = np.ones((2, 105), dtype=np.float32)
    chosen = []

    def evaluate(task, policy, weights, episodes, policies):
        chosen.append(policy(observations, masks, None).argmax(axis=1).tolist())
        return pd.DataFrame(columns=["episode", "seed", "carbon_return", "thaw_return"]), None

    monkeypatch.setattr(protocol, "evaluate", evaluate)
    constant_plans.study("boreal-generalist-v0", 1)
    assert chosen == [[action, 12] for action in constant_plans.PLANTING]
