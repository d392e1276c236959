"""A training that is stopped after a checkpoint, and goes on by the same command, leaves the same bytes."""

import pytest

from cleanrl_style.protocol import run_folder


def assert_same_bytes(folder, other, but=("timing.csv",)):
    """Two runs' folders have the same files, and but for some the same bytes in them."""
    assert {path.name for path in folder.iterdir()} == {path.name for path in other.iterdir()}
    for path in folder.iterdir():
        if path.name not in but:
            assert path.read_bytes() == (other / path.name).read_bytes(), path.name


def assert_goes_on_to_the_same_bytes(train, folder, stops=1):
    """train(run folder) is a training in this process; leaves <folder>/whole, of a run that was never stopped."""
    train(folder / "whole")
    save = run_folder.Run.save

    def save_and_stop(run, global_step, last, **state):
        save(run, global_step, last, **state)
        if run.checkpoint_step:
            raise KeyboardInterrupt

    for _ in range(stops):
        with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit, match="130"):
            patch.setattr(run_folder.Run, "save", save_and_stop)
            train(folder / "stopped")
    assert (folder / "stopped" / "checkpoint.pt").exists() and not (folder / "stopped" / "evaluation.csv").exists()
    train(folder / "stopped")
    assert_same_bytes(folder / "whole", folder / "stopped")
