"""docs/new_method.md as its reader follows it: the example's changes fit the script, and both examples run."""

import importlib
import json
import re
import shutil

import pandas as pd
import pytest
from scripts import ROOT, run_script

from cleanrl_style.protocol.run_folder import folder_name

PAGE = (ROOT / "docs" / "new_method.md").read_text(encoding="utf-8")


def block(language, start=""):
    """The page's one block of code in a language that begins so."""
    (text,) = re.findall(rf"```{language}\n({start}.*?)```", PAGE, re.DOTALL)
    return text


def test_the_followed_example(tmp_path):
    script, changed = (ROOT / "cleanrl_style" / "ppo_gated.py").read_text(encoding="utf-8"), 0
    for hunk in block("diff").strip("\n").split("\n\n"):
        old, new = ["".join(f"{line[1:]}\n" for line in hunk.split("\n") if line[0] in kept) for kept in (" -", " +")]
        assert script.count(old) == 1, old
        script = script.replace(old, new)
        changed += sum(line[0] in "-+" for line in hunk.split("\n"))
    assert f"says {changed}:" in PAGE
    folder = folder_name("boreal-balanced-v0", {"vectorization": "lockstep"})
    assert f"run=runs/ppo_neighbours/{folder}/seed1\n" in PAGE
    path = tmp_path / "ppo_neighbours.py"
    path.write_text(script, encoding="utf-8")
    run_script(
        path,
        "--num-envs",
        4,
        "--total-timesteps",
        200,
        "--rollout-steps",
        100,
        "--run-dir",
        tmp_path / "run",
        "--eval-episodes",
        1,
        "--eval-weights",
        0.5,
    )
    episodes = pd.read_csv(tmp_path / "run" / "episodes.csv")
    assert len(episodes) == 4 and episodes.site_seed.nunique() == 1
    assert len(pd.read_csv(tmp_path / "run" / "evaluation.csv")) == 2
    config = json.loads((tmp_path / "run" / "config.json").read_text(encoding="utf-8"))
    assert config["training_environment"] == {"group_size": 4}


def test_the_figure_is_drawn_from_the_tables(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs" / "tables").mkdir(parents=True)
    shutil.copy(ROOT / "results" / "tables" / "detailed_objectives.csv", tmp_path / "runs" / "tables")
    exec(block("python", "import matplotlib"), {})
    assert (tmp_path / "gains.png").stat().st_size > 10_000


def test_the_environment_of_ones_own(tmp_path, monkeypatch):
    (tmp_path / "pond.py").write_text(block("python", "# pond.py\n").replace("# pond.py\n", ""), encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.invalidate_caches()
    run_script(
        "cleanrl_style/eupg_var_lambda.py",
        "--env-id",
        "pond:pond-v0",
        "--total-timesteps",
        160,
        "--num-envs",
        2,
        "--run-dir",
        tmp_path / "run",
        "--eval-episodes",
        1,
        "--eval-weights",
        0,
        1,
    )
    table = pd.read_csv(tmp_path / "run" / "evaluation.csv")
    mixes = table.carbon_return / 10
    assert (table.thaw_return <= 10 * (1 - mixes**2) + 1e-6).all()  # the mean of squares is no less than the square
    assert table.scalarized_return.to_numpy() == pytest.approx(
        (table.preference * table.carbon_return + (1 - table.preference) * table.thaw_return).to_numpy()
    )
