"""What every training script and heuristic shares, whatever its algorithm.

A script reads its arguments (`parse`, of `cleanrl_style.flags`, which loads at once), asks the environment what
it is (`make_task`), opens its folder (`Run`), trains on `run.make_envs()`, logs rows, shows `run.progress`, plays
`run.validate` and saves checkpoints meanwhile, and ends with `run.save_policy`, `evaluate` and `run.finish`.
`load_policy` gives a finished run's policy, or one that ships.
"""

from cleanrl_style.flags import FIRST_EVALUATION_SEED, LIMITS, MAX_ENVS, fail, parse, shipped_policies
from cleanrl_style.protocol.agents import Policy, load_policy
from cleanrl_style.protocol.arguments import make_task, not_default
from cleanrl_style.protocol.compilation import compile_physics
from cleanrl_style.protocol.evaluation import POLICIES, evaluate
from cleanrl_style.protocol.files import replacing
from cleanrl_style.protocol.flat import flat_parameters
from cleanrl_style.protocol.fronts import scalarize
from cleanrl_style.protocol.progress import Progress
from cleanrl_style.protocol.run_folder import FLOAT_FORMAT, Run
from cleanrl_style.protocol.sites import evaluation_seeds
from cleanrl_style.protocol.task import EPISODE_INFO, Task, final_info
from sim.task.preference import observed_weights

__all__ = [
    "EPISODE_INFO",
    "FIRST_EVALUATION_SEED",
    "FLOAT_FORMAT",
    "LIMITS",
    "MAX_ENVS",
    "POLICIES",
    "Policy",
    "Progress",
    "Run",
    "Task",
    "compile_physics",
    "evaluate",
    "evaluation_seeds",
    "fail",
    "final_info",
    "flat_parameters",
    "load_policy",
    "make_task",
    "not_default",
    "observed_weights",
    "parse",
    "replacing",
    "scalarize",
    "shipped_policies",
]
