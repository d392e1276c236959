"""That archived runs repeat from their command: their beginning, up to the first time that the policy is scored."""

import zipfile

import pandas as pd
import pytest
import torch
from scripts import ROOT, run_script

from cleanrl_style.protocol import run_folder
from cleanrl_style.protocol.course import Course

BALANCED = ("--env-id", "boreal-balanced-v0")


@pytest.mark.slow
@pytest.mark.skipif(not torch.__version__.startswith("2.13.0"), reason="other versions of torch have other bits")
@pytest.mark.parametrize(
    ("folder", "flags"),
    [
        ("ppo_group/boreal-generalist-v0-vectorization=lockstep", ()),
        ("ppo_curriculum/boreal-balanced-v0-vectorization=lockstep", BALANCED),
        ("plan_regression/boreal-balanced-v0-vectorization=lockstep", BALANCED),
    ],
)
def test_the_first_updates_of_an_archived_run_repeat(folder, flags, tmp_path, monkeypatch):
    """Each gain is of a policy after some updates, on ten sites: no update can change and leave it alone.

    Plan regression's finals, after a fifth of the training, are not reached.
    """
    play = Course.play

    def play_and_stop(course, policy):
        play(course, policy).to_csv(tmp_path / "again.csv", float_format=run_folder.FLOAT_FORMAT, index=False)
        raise KeyboardInterrupt

    monkeypatch.setattr(Course, "play", play_and_stop)
    with pytest.raises(SystemExit, match="130"):
        script = f"cleanrl_style/{folder.split('/')[0]}.py"
        run_script(script, "--seed", 1, "--vectorization", "lockstep", *flags, "--run-dir", tmp_path / "run")
    with zipfile.ZipFile(ROOT / "results" / "runs" / folder / "seed1" / "tables.zip") as tables:
        archived = pd.read_csv(tables.open("validation.csv"))
    again = pd.read_csv(tmp_path / "again.csv")
    assert len(again) == 3
    pd.testing.assert_frame_equal(again, archived[list(again)].head(3), rtol=5e-6)  # archives have six digits
