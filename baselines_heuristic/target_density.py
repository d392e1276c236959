"""Target density: steers the stand to 1000 stems/ha, planting half conifers."""

import numpy as np

from baselines_heuristic import main
from boreal_env import in_unit

TARGET_STEMS_HA = 1000


def policy(observations: np.ndarray, masks: np.ndarray, mix_index: int = 2) -> np.ndarray:
    """Actions (n,) for observations (n, d): the density change among -100 .. +100 nearest to what is missing.

    Within 25 stems/ha of the target the nearest change is none: the dead band.
    """
    density = in_unit(observations, "density")
    density_index = 2 + np.clip(np.rint((TARGET_STEMS_HA - density) / 50), -2, 2).astype(int)
    return 5 * density_index + mix_index


if __name__ == "__main__":
    main(__file__, policy)
