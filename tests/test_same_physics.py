"""A source that was compared with an earlier one, and makes the same numbers, stands for it."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from analysis import same_physics
from cleanrl_style import protocol
from cleanrl_style.protocol import provenance, reference


@pytest.fixture
def compare(monkeypatch, tmp_path):
    """A function that compares this checkout with its last commit, given what either source makes."""
    monkeypatch.setattr(provenance, "SAME_PHYSICS", tmp_path / "same_physics.csv")
    monkeypatch.setattr(same_physics.provenance, "own_hash", lambda: "new")
    repository = tmp_path / "repository"
    git = ["git", "-C", str(repository), "-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run(["git", "init", "-q", str(repository)], check=True)
    subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "first"], check=True)
    monkeypatch.setattr(same_physics.boreal_env, "__file__", str(repository / "boreal_env.py"))

    def run(before, after):
        def of_tree(tree):
            earlier = tree != repository
            return {
                "source": "old" if earlier else "new",
                "folder": str(tree / "sim"),
                "of": before if earlier else after,
            }

        monkeypatch.setattr(same_physics, "of_tree", of_tree)
        same_physics.main(same_physics.Args(changed="a message"))
        left = subprocess.run([*git, "worktree", "list"], capture_output=True, text=True, check=True).stdout
        assert len(left.splitlines()) == 1
        return provenance.physics_hash()

    return run


def test_a_source_of_the_same_numbers_has_the_name_of_the_first(compare):
    assert compare({"a": "1", "b": "2"}, {"a": "1", "b": "2"}) == "old"
    assert provenance.physics_name() == "old"


@pytest.mark.parametrize("before", [{"a": "1", "b": "3"}, {"a": "1"}])
def test_a_source_of_other_numbers_has_its_own_name(compare, before):
    provenance.SAME_PHYSICS.write_text("source,stands_for,changed\nanother,old,\n")
    with pytest.raises(SystemExit, match="other numbers in: b"):
        compare(before, {"a": "1", "b": "2"})
    assert provenance.physics_hash() == "new"


def test_a_note_that_is_shipped_has_a_source_and_what_it_stands_for():
    lines = Path(provenance.SAME_PHYSICS).read_text().splitlines()
    assert lines[0] == "source,stands_for,changed"
    for line in lines[1:]:
        source, stands_for, changed = line.split(",", 2)
        assert len(source) == len(stands_for) == 64 and source != stands_for and changed


@pytest.mark.parametrize(
    "path", sorted((Path(reference.__file__).parent / reference.FOLDER).iterdir()), ids=lambda p: p.name
)
def test_returns_that_ship_are_of_this_simulator(path):
    """Else everybody's first evaluation would measure the constant plans anew, for minutes."""
    _, physics = reference.read(path)
    task = protocol.Task.of(path.name.removesuffix(".csv.gz"))
    assert physics == reference.fingerprint(task), (
        "simulator or environment were changed: analysis/same_physics.py if all numbers stay the same, else "
        "analysis/reference_returns.py, and the archived runs are of another physics (CONTRIBUTING.md)"
    )


def test_a_digest_sees_the_last_bit():
    one = [np.ones(3), np.zeros(2, bool)]
    assert same_physics.digest(one) == same_physics.digest([a.copy() for a in one])
    assert same_physics.digest([np.nextafter(one[0], 2), one[1]]) != same_physics.digest(one)


def test_what_was_changed_and_a_commit_are_asked_for():
    for named, args in {
        "--changed": same_physics.Args(),
        "--before no such": same_physics.Args(before="no such", changed="a"),
    }.items():
        with pytest.raises(SystemExit, match=named):
            same_physics.main(args)
