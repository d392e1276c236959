"""That archived runs repeat from their command: the first fortieth of their training."""

import platform
import sys
import zipfile

import numpy as np
import pandas as pd
import pytest
import torch
from scripts import ROOT, run_script

from analysis import reduction
from cleanrl_style.protocol import run_folder

BALANCED = ("--env-id", "boreal-balanced-v0")
STEPS = 300_000


@pytest.mark.slow
@pytest.mark.skipif(not torch.__version__.startswith("2.13.0"), reason="other versions of torch have other bits")
@pytest.mark.skipif(
    (sys.platform, platform.machine()) != ("linux", "x86_64"), reason="sine and logarithm are those of C's library"
)
@pytest.mark.parametrize(
    ("folder", "flags"),
    [
        ("ppo_group/boreal-generalist-v0-vectorization=lockstep", ()),
        ("ppo_curriculum/boreal-balanced-v0-vectorization=lockstep", BALANCED),
        ("plan_regression/boreal-balanced-v0-vectorization=lockstep", BALANCED),
    ],
)
def test_the_beginning_of_an_archived_run_repeats(folder, flags, tmp_path, monkeypatch):
    """Episodes are those of an agent that has learned from one rollout (Group PPO) or three (Curriculum PPO).

    Plan regression plays all plans until after that, whatever it learns.
    """

    def stop(run, global_step, last, policy):
        if global_step >= STEPS / reduction.BINS:
            raise KeyboardInterrupt

    monkeypatch.setattr(run_folder.Run, "validate", stop)
    with pytest.raises(SystemExit, match="130"):
        script = f"cleanrl_style/{folder.split('/')[0]}.py"
        run_script(script, "--seed", 1, "--vectorization", "lockstep", *flags, "--run-dir", tmp_path / "run")
    with zipfile.ZipFile(ROOT / "results" / "runs" / folder / "seed1" / "tables.zip") as tables:
        archived = pd.read_csv(tables.open("learning.csv")).iloc[0]
    again = reduction.learning(pd.read_csv(tmp_path / "run" / "episodes.csv"), STEPS).iloc[0]
    assert again.episodes >= 84
    np.testing.assert_allclose(again.to_numpy(dtype=float), archived.to_numpy(dtype=float), rtol=1e-11)
