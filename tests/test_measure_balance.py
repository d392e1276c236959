import numpy as np
import pytest

from analysis.studies import measure_balance


@pytest.mark.slow
def test_the_measured_scale_equalises_the_spreads(capsys, monkeypatch):
    args = measure_balance.Args(sites=2, years=3)
    play = measure_balance.play
    sums = play(args)
    assert sums.shape == (29, 2, 3) and np.isfinite(sums).all()
    change, _, thaw = measure_balance.within_site_spread(sums, measure_balance.unbeaten(sums))
    monkeypatch.setattr(measure_balance, "play", lambda args, **reward: play(args, **reward) if reward else sums)
    measure_balance.main(args)
    assert f"balanced carbon_scale: {change / thaw:.4f}" in capsys.readouterr().out


def test_only_what_no_other_policy_beats_counts():
    sums = np.array([[[2.0, 2.0, 1.0]], [[1.0, 1.0, 3.0]], [[9.0, -9.0, 0.5]], [[2.0, 2.0, 1.0]]])  # 4 policies, 1 site
    chosen = measure_balance.unbeaten(sums)
    assert sorted(chosen[[0, 3], 0]) == [False, True] and chosen[1, 0] and not chosen[2, 0]
    assert measure_balance.within_site_spread(sums, chosen).tolist() == [0.5, 0.5, 1.0]


def test_actions_that_are_not_valid_become_no_change():
    masks = np.zeros((2, 25), dtype=bool)
    masks[0, 24] = True
    assert measure_balance.where_valid(masks, 24).tolist() == [24, 12]
