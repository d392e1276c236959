"""What every training script and heuristic shares, whatever its algorithm: the one import of the scripts.

A script calls `prepare` (arguments), opens its `Run` (folder), trains on `run.make_envs()`, logs rows, saves
checkpoints and shows `Progress` meanwhile, and ends with `evaluate` and `run.finish`.
"""

from cleanrl_style.protocol.arguments import LIMITS, MAX_ENVS, fail, not_default, parse, prepare, resolve  # noqa: F401
from cleanrl_style.protocol.evaluation import (  # noqa: F401
    EVAL_WEIGHTS,
    FIRST_EVALUATION_SEED,
    MODES,
    POLICIES,
    action_masks,
    evaluate,
    final_info,
)
from cleanrl_style.protocol.fronts import scalarize  # noqa: F401
from cleanrl_style.protocol.progress import Progress  # noqa: F401
from cleanrl_style.protocol.run_folder import (  # noqa: F401
    EPISODE_COLUMNS,
    EPISODE_INFO,
    FLOAT_FORMAT,
    TIMING_COLUMNS,
    Run,
    replacing,
)
