import shutil
import zipfile
from pathlib import Path

import pandas as pd
import pytest
from tiny_runs import TINY_RUNS, write_run

from analysis import archive, make_tables, runs
from cleanrl_style.protocol.provenance import physics_name


def files_of(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_runs_of_another_physics_are_found():
    made = {"old": {}, "here": {"physics": physics_name()}, "elsewhere": {"physics": "0123456789abcdef"}}
    others = runs.of_another_physics([runs.Run(Path(name), config, {}) for name, config in made.items()])
    assert [str(run.folder) for run in others] == ["old", "elsewhere"]  # the first does not say


def test_a_run_of_a_script_that_lost_an_argument_since_is_the_same_run(tmp_path):
    for root in ("archive", "runs"):
        write_run(tmp_path / root / "one", "ppo_group", vectorization="lockstep")
    config = tmp_path / "archive" / "one" / "config.json"
    text = config.read_text(encoding="utf-8").replace('"mode"', '"scalarization": "linear", "mode"')
    config.write_text(text, encoding="utf-8")
    found, left_out = runs.read_runs(tmp_path / "archive", tmp_path / "runs")
    assert [run.folder.parent.name for run in found] == ["archive"] and not left_out


@pytest.fixture
def archived(tmp_path):
    archive.archive(TINY_RUNS, tmp_path / "archive")
    return tmp_path / "archive"


def test_folders_are_named_as_the_runs_are(archived):
    names = {str(path.parent.relative_to(archived)) for path in archived.rglob("config.json")}
    assert names == {
        "ppo_curriculum/boreal-generalist-v0-vectorization=lockstep/seed1",
        "zero_change/boreal-generalist-v0/seed1",
    }
    config = {
        "script": "a",
        "arguments": {"env_id": "my_module:toy/one-v0", "seed": 3},
        "not_default": {"eval_weights": [0.0, 0.5], "site_seed": 7},
    }
    assert archive.folder_of(config, archived) == archived / "a" / "toy-one-v0-eval_weights=0,0.5-site_seed=7" / "seed3"


def test_a_run_and_its_archive_are_the_same(archived):
    (first, *_), left_out = runs.read_runs(TINY_RUNS)
    (copy, *_), left_out_copies = runs.read_runs(archived)
    assert left_out == left_out_copies == []
    assert copy.config == first.config
    assert list(copy.tables) == list(first.tables)
    for name, table in first.tables.items():
        pd.testing.assert_frame_equal(copy.tables[name], table)


@pytest.mark.slow
def test_tables_from_the_archive_are_the_same_bytes(archived, tmp_path):
    for name, folder in (("of_runs", TINY_RUNS), ("of_archive", archived)):
        make_tables.main(make_tables.Args(runs_dir=(folder,), tables_dir=tmp_path / name))
    assert files_of(tmp_path / "of_runs") == files_of(tmp_path / "of_archive") != {}


def test_the_same_bytes_from_another_place(archived, tmp_path):
    shutil.copytree(TINY_RUNS, tmp_path / "elsewhere")
    archive.archive(tmp_path / "elsewhere", tmp_path / "second")
    assert files_of(archived) == files_of(tmp_path / "second")
    with zipfile.ZipFile(next(archived.rglob("tables.zip"))) as packed:
        assert {member.date_time[0] for member in packed.infolist()} == {1980}


def test_only_what_is_new_is_written(archived, capsys):
    before = {path: path.stat().st_mtime_ns for path in archived.rglob("*")}
    archive.archive(TINY_RUNS, archived)
    assert {path: path.stat().st_mtime_ns for path in archived.rglob("*")} == before
    assert "0 runs new of 2" in capsys.readouterr().out


def test_tables_of_another_evaluation_are_written(tmp_path):
    write_run(tmp_path / "runs" / "one", "ppo_gated")
    archive.archive(tmp_path / "runs", tmp_path / "archive")
    table = tmp_path / "runs" / "one" / "evaluation.csv"
    pd.read_csv(table).assign(thaw_return=7.0).to_csv(table, index=False)
    archive.archive(tmp_path / "runs", tmp_path / "archive")
    (run,), _ = runs.read_runs(tmp_path / "archive")
    assert (run.tables["evaluation"].thaw_return == 7.0).all()


def test_an_archive_that_was_stopped_is_completed(archived):
    whole = files_of(archived)
    for path in archived.rglob("tables.zip"):
        path.unlink()
    archive.archive(TINY_RUNS, archived)
    assert files_of(archived) == whole


def test_agents_of_the_main_experiment_are_kept(tmp_path):
    flags = {"vectorization": "lockstep"}
    write_run(tmp_path / "runs" / "main", "ppo_gated", **flags)
    write_run(tmp_path / "runs" / "variant", "ppo_gated", **flags, ent_coef=0.0)
    write_run(tmp_path / "runs" / "balanced", "ppo_gated", env_id="boreal-balanced-v0", **flags)
    for name in ("main", "variant", "balanced"):
        (tmp_path / "runs" / name / "policy.pt").write_bytes(b"weights")
    archive.archive(tmp_path / "runs", tmp_path / "archive")
    names = {"boreal-balanced-v0-vectorization=lockstep", "boreal-generalist-v0-vectorization=lockstep"}
    kept = {path.parent.parent.name: path for path in (tmp_path / "archive").rglob("policy.pt")}
    assert set(kept) == names and {path.read_bytes() for path in kept.values()} == {b"weights"}
    # trained again, by the same commit to the same configuration
    (tmp_path / "runs" / "main" / "policy.pt").write_bytes(b"others")
    archive.archive(tmp_path / "runs", tmp_path / "archive")
    assert kept["boreal-generalist-v0-vectorization=lockstep"].read_bytes() == b"others"


def test_a_damaged_archive_is_written_again(archived):
    broken = next(archived.rglob("tables.zip"))
    whole = broken.read_bytes()
    broken.write_bytes(whole[: len(whole) // 2])
    archive.archive(TINY_RUNS, archived)
    assert broken.read_bytes() == whole


def test_a_script_that_is_no_name_leads_nowhere(tmp_path, capsys):
    folder = tmp_path / "runs" / "one"
    shutil.copytree(TINY_RUNS / "zero_change", folder)
    config = folder / "config.json"
    config.write_text(config.read_text(encoding="utf-8").replace('"zero_change"', '"../../evil"', 1), encoding="utf-8")
    archive.archive(tmp_path / "runs", tmp_path / "a" / "b")
    assert "script is '../../evil', no name of one" in capsys.readouterr().err
    assert not list(tmp_path.rglob("evil"))


def test_a_damaged_archive_is_named(archived):
    next(archived.rglob("tables.zip")).write_bytes(b"no zip")
    assert "damaged: tables.zip" in runs.read_runs(archived)[1][0]


@pytest.mark.parametrize("places", [("runs", "runs"), ("runs", "runs/archive"), (".", "runs")])
def test_an_archive_never_lies_among_the_runs(places, tmp_path):
    shutil.copytree(TINY_RUNS, tmp_path / "runs")
    before = files_of(tmp_path)
    with pytest.raises(SystemExit, match="--archive-dir .*: a folder that is neither in --runs-dir"):
        archive.archive(*(tmp_path / place for place in places))
    assert files_of(tmp_path) == before


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(SystemExit, match="--runs-dir .*nope: no such folder"):
        archive.archive(tmp_path / "nope", tmp_path / "archive")


def test_unfinished_runs_are_named(tmp_path, capsys):
    write_run(tmp_path / "runs" / "one", "zero_change")
    (tmp_path / "runs" / "one" / "evaluation.csv").unlink()
    archive.archive(tmp_path / "runs", tmp_path / "archive")
    assert "one: unfinished" in capsys.readouterr().err
    assert not list((tmp_path / "archive").rglob("*.*"))


def test_runs_of_quick_are_no_results(tmp_path):
    for name in ("quick/one", "other/quick"):
        write_run(tmp_path / name, "zero_change")
    assert runs.run_folders(tmp_path) == [tmp_path / "other" / "quick"]
