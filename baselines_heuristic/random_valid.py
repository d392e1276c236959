"""Random: every valid action with equal probability, the same policy whether it is called greedy or sampled."""

import numpy as np

from baselines_heuristic import main


def policy(observations: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Probabilities (n, 25) for masks (n, 25) of valid actions, of which there is always one."""
    return masks / masks.sum(axis=1, keepdims=True)


if __name__ == "__main__":
    main(__file__, policy)
