"""Policies of several trainings, averaged."""

import numpy as np
import pytest

from analysis import paths, stored
from analysis.studies import ensembles


def test_sets_are_disjoint_and_whole():
    seeds = [1, 6, 7, 8, 9, 10]
    assert ensembles.sets_of(seeds, 3) == [[1, 6, 7], [8, 9, 10]]
    assert len(ensembles.sets_of(seeds, 4)) == 1 and ensembles.sets_of(seeds, 6) == [seeds]


def test_what_most_are_sure_of_is_chosen_and_nothing_invalid():
    masks = np.ones((1, 25), bool)
    masks[0, 3] = False

    def sure_of(action, share):
        probabilities = np.full((1, 25), (1 - share) / 23)
        probabilities[0, action], probabilities[0, 3] = share, 0.0
        return lambda observations, masks, accrued: probabilities

    alike = [sure_of(7, 0.6), sure_of(7, 0.6), sure_of(9, 0.7)]
    mean = ensembles.together(alike)(None, masks, None)
    assert mean.argmax() == 7 and mean[0, 3] == 0.0 and mean.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(ensembles.together(alike[:2])(None, masks, None), alike[0](None, masks, None))


def test_too_few_policies_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr(paths, "archive", lambda: tmp_path)
    with pytest.raises(SystemExit, match="ppo_group: two policies or more of boreal-.*-v0 are needed"):
        ensembles.main(ensembles.Args())


@pytest.mark.slow
def test_the_archived_policies_play_together_and_not_twice(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(paths, "studies", lambda quick: tmp_path)
    ensembles.main(ensembles.Args(quick=True))
    table = stored.read(ensembles.path(quick=True))
    assert table.groupby(["task", "size"]).size().to_list() == [2, 2] and np.isfinite(table.gain).all()
    ensembles.main(ensembles.Args(quick=True))
    assert "is finished" in capsys.readouterr().out
