"""Plans that look at nothing, as the score and the tables have them."""

import numpy as np
import pandas as pd

from analysis.studies import constant_plans
from cleanrl_style.protocol import reference


class Stage:
    """Stands for the environments: two, of which the second has no room to plant; notes what is done."""

    def close(self):
        """Nothing to close."""


def test_a_plan_is_carried_out_where_it_is_valid(monkeypatch):
    masks = np.ones((len(reference.PLANS), 25), dtype=bool)
    masks[:, 15:] = False  # no room to plant
    chosen = []

    def play(task, envs, policy, weights, seeds, greedy):
        chosen.extend(policy(np.ones((len(seeds), 105)), masks[: len(seeds)], None).argmax(axis=1).tolist())
        return np.ones((len(seeds), 2)), None

    monkeypatch.setattr(reference, "play", play)
    monkeypatch.setattr(reference, "make_envs", lambda task, number: Stage())
    monkeypatch.setattr(reference, "compile_physics", lambda lanes: None)
    task = constant_plans.protocol.Task.of("boreal-generalist-v0")
    table = reference.measure(task, [7])
    assert table.plan.tolist() == list(reference.PLANS) and set(table.seed) == {7}
    assert chosen == [min(int(plan), 14) if int(plan) < 15 else 12 for plan in reference.PLANS]
    assert len(reference.PLANS) == 21 and reference.PLANS[0] == "12"


def test_the_study_has_every_constant_plan_and_no_strategy(monkeypatch):
    plans = pd.DataFrame({"plan": ["12", "24", "random_valid"], "seed": 1, "carbon_return": 0.0, "thaw_return": 1.0})
    monkeypatch.setattr(constant_plans, "reference_returns", lambda task, seeds: plans)
    table = constant_plans.study("boreal-generalist-v0", 1)
    assert table.action.tolist() == [12, 24] and set(table.env_id) == {"boreal-generalist-v0"}


def test_an_environment_has_the_returns_of_its_objectives():
    two = pd.DataFrame(
        {"env_id": "two", "action": [12, 24], "seed": 1, "carbon_return": 0.0, "thaw_return": [0.0, 1.0]}
    )
    three = pd.DataFrame({"env_id": "three", "action": [12, 24, 22], "seed": 1, "carbon_return": [0.0, 0.0, 1.0]})
    three = three.assign(thaw_return=[0.0, 1.0, 0.0], timber_return=[0.0, 3.0, 0.0])
    both = pd.concat([two, three], ignore_index=True)
    assert "timber_return" not in constant_plans.of_environment(both, "two")
    best = constant_plans.as_evaluation(constant_plans.of_environment(both, "two"), (0.0, 1.0))
    assert best.action.tolist() == [24, 12] and best.preference.tolist() == [0.0, 1.0]
    weights = ((1.0, 0.0, 0.0), (0.0, 0.5, 0.5))
    best = constant_plans.as_evaluation(constant_plans.of_environment(both, "three"), weights)
    assert best.action.tolist() == [22, 24] and best.scalarized_return.tolist() == [1.0, 2.0]
    dense = constant_plans.as_evaluation(constant_plans.of_environment(both, "three"), weights, constant_plans.CONIFERS)
    assert dense.action.tolist() == [24, 24] and dense.weight_timber.tolist() == [0.0, 0.5]
