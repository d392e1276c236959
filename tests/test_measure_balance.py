import numpy as np
import pytest

import boreal_env
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


def test_every_reference_policy_obeys_masks():
    masks = np.zeros((2, 25), dtype=bool)
    masks[:, boreal_env.NO_CHANGE] = True
    masks[0, 24] = True
    policies = measure_balance.reference_policies()
    assert policies["action 24"](np.zeros((2, 105), np.float32), masks).argmax(axis=1).tolist() == [24, 12]
    only_no_change = np.arange(25)[None] == np.full((2, 1), boreal_env.NO_CHANGE)
    for policy in policies.values():
        chosen = policy(np.zeros((2, 105), np.float32), only_no_change).argmax(axis=1)
        assert (chosen == boreal_env.NO_CHANGE).all()
