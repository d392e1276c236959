"""Who chooses a stand's action: a fixed strategy, one action every year, or the trained policy of a run.

A player is a function of a `Stand` that gives an action.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from analysis.exploring.stands import YEARS, Stand
from baselines_heuristic import conifer_restoration, obeying, plus_100, random_valid, target_density, zero_change
from boreal_env import NO_CHANGE
from cleanrl_style import protocol
from cleanrl_style.protocol.evaluation import choose_actions
from sim.management import CONIFER_MIXES, DENSITY_CHANGES

Player = Callable[[Stand], int]


def of_strategy(policy) -> Player:
    """A strategy of `baselines_heuristic`, as its script plays it."""
    played = obeying(policy)
    return lambda stand: drawn(played(stand.observation[None], stand.masks[None]), stand)


#: What the page calls a fixed strategy -> the player.
STRATEGIES: dict[str, Player] = {
    "Do nothing": of_strategy(zero_change.policy),
    "Plant 100 a year, half conifers": of_strategy(plus_100.policy),
    "Keep 1000 stems/ha, half conifers": of_strategy(target_density.policy),
    "Keep 1000 stems/ha, plant conifers": of_strategy(conifer_restoration.policy),
    "Anything valid, by chance": of_strategy(random_valid.policy),
}


def action_of(density_change: float, conifers: float) -> int:
    """The action that changes the density so [stems ha-1], with that share of conifers."""
    return len(CONIFER_MIXES) * DENSITY_CHANGES.index(density_change) + CONIFER_MIXES.index(conifers)


def constant(action: int) -> Player:
    """The same action every year wherever it can be carried out: a constant plan, as the score knows them."""
    return lambda stand: action if stand.masks[action] else NO_CHANGE


def drawn(probabilities: np.ndarray, stand: Stand) -> int:
    """An action by chance, of probabilities (1, 25), with the dice that the evaluation throws in that year."""
    dice = np.random.default_rng([stand.setting.seed, 1]).random(YEARS)
    return int(choose_actions(probabilities, dice[stand.year : stand.year + 1])[0])


def trained_runs(folder: Path) -> list[str]:
    """Runs in a folder that have left a policy, after those that ship."""
    return [*protocol.shipped_policies(), *sorted(str(policy.parent) for policy in folder.rglob("policy.pt"))]


def trained(folder: str, stand: Stand, greedy: bool) -> Player:
    """The policy that a run has trained, by its most likely action or by chance.

    Raises FileNotFoundError where there is none, ValueError for one that cannot be read or does not know the stand's
    observation.
    """
    policy = protocol.load_policy(folder)

    def probabilities(stand: Stand) -> np.ndarray:
        return policy(stand.observation[None], stand.masks[None], stand.returns[None])

    try:
        probabilities(stand)
    except RuntimeError as error:
        raise ValueError(
            f"{folder}: trained on another observation than the {len(stand.observation)} numbers here"
        ) from error
    if greedy:
        return lambda stand: int(choose_actions(probabilities(stand), None)[0])
    return lambda stand: drawn(probabilities(stand), stand)
