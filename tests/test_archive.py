import gzip
import shutil

import numpy as np
import pandas as pd
import pytest
from tiny_runs import TINY_RUNS, write_run

from analysis import archive, make_tables, runs


def files_of(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


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


def test_round_trip(archived):
    (first, *_), left_out = runs.read_runs(TINY_RUNS)
    (copy, *_), left_out_copies = runs.read_runs(archived)
    assert left_out == left_out_copies == []
    assert copy.config == first.config
    for name in ("evaluation", "episodes", "timing"):
        pd.testing.assert_frame_equal(getattr(copy, name), getattr(first, name))
    pd.testing.assert_frame_equal(copy.years, first.years.reset_index(drop=True), check_dtype=False)


def test_tables_from_the_archive_are_the_same_bytes(archived, tmp_path):
    for name, folder in (("of_runs", TINY_RUNS), ("of_archive", archived)):
        make_tables.main(make_tables.Args(runs_dir=(folder,), tables_dir=tmp_path / name))
    assert files_of(tmp_path / "of_runs") == files_of(tmp_path / "of_archive") != {}


def test_the_same_bytes_from_another_place(archived, tmp_path):
    shutil.copytree(TINY_RUNS, tmp_path / "elsewhere")
    archive.archive(tmp_path / "elsewhere", tmp_path / "second")
    assert files_of(archived) == files_of(tmp_path / "second")
    header = gzip.open(next(archived.rglob("*.gz")), "rb")
    header.read()
    assert header.mtime == 0


def test_only_what_is_new_is_written(archived, capsys):
    before = {path: path.stat().st_mtime_ns for path in archived.rglob("*")}
    archive.archive(TINY_RUNS, archived)
    assert {path: path.stat().st_mtime_ns for path in archived.rglob("*")} == before
    assert "0 runs new of 2" in capsys.readouterr().out


def test_an_archive_that_was_stopped_is_completed(archived):
    whole = files_of(archived)
    for path in archived.rglob("evaluation.csv.gz"):
        path.unlink()
    archive.archive(TINY_RUNS, archived)
    assert files_of(archived) == whole


def test_many_episodes_are_thinned_evenly():
    table = pd.DataFrame({"episode": np.arange(1, 12_002)})
    kept = archive.thin("episodes", table).episode
    assert len(kept) == 4001 and set(np.diff(kept)) == {3}
    assert len(archive.thin("episodes", table[:6000])) == 6000
    assert archive.thin("episodes", table[:0]).empty


def test_annual_records_of_other_weights_are_left_out():
    years = pd.DataFrame({"policy": ["greedy", "sampled", "sampled"], "preference": [0.5, 0.5, 0.4]})
    assert archive.thin("evaluation_years", years).index.tolist() == [1]


def test_unfinished_runs_are_named(tmp_path, capsys):
    write_run(tmp_path / "runs" / "one", "zero_change")
    (tmp_path / "runs" / "one" / "evaluation.csv").unlink()
    archive.archive(tmp_path / "runs", tmp_path / "archive")
    assert "one: unfinished" in capsys.readouterr().err
    assert not list((tmp_path / "archive").rglob("*.gz"))


def test_runs_of_quick_are_no_results(tmp_path):
    for name in ("quick/one", "other/quick"):
        write_run(tmp_path / name, "zero_change")
    assert runs.run_folders(tmp_path) == [tmp_path / "other" / "quick"]
