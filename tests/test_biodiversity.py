"""The index of biodiversity: known stands by hand, and its bounds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from playing import play, quick

from sim.task.biodiversity import CLASSES, DEADWOOD_M3, biodiversity_index, deadwood, old_trees, open_ground, structure
from sim.task.timber import VOLUME


def stand(stems=None, conifer_deadwood=0.0, deciduous_deadwood=0.0, cover=1.0):
    """A year's record of one stand; stems : class -> number, none of others."""
    year = dict.fromkeys(CLASSES, 0.0) | (stems or {})
    year |= {"conifer_deadwood_kgc_m2": conifer_deadwood, "deciduous_deadwood_kgc_m2": deciduous_deadwood}
    return {name: np.array([value]) for name, value in (year | {"crown_cover": cover}).items()}


def test_shannon_by_hand():
    assert structure(stand())[0] == 0.0
    assert structure(stand({"conifer_young_stems_ha": 800.0}))[0] == 0.0
    halves = stand({"conifer_young_stems_ha": 300.0, "deciduous_old_stems_ha": 300.0})
    assert structure(halves)[0] == pytest.approx(np.log(2.0) / np.log(10.0))
    assert structure(stand(dict.fromkeys(CLASSES, 7.0)))[0] == pytest.approx(1.0)
    uneven = stand({"conifer_young_stems_ha": 300.0, "conifer_old_stems_ha": 100.0})
    assert structure(uneven)[0] == pytest.approx(-(0.75 * np.log(0.75) + 0.25 * np.log(0.25)) / np.log(10.0))


def test_features_by_hand():
    assert old_trees(stand({"conifer_old_stems_ha": 2.0, "deciduous_old_stems_ha": 3.0}))[0] == pytest.approx(0.5)
    assert old_trees(stand({"conifer_old_stems_ha": 200.0}))[0] == 1.0
    half = 0.5 * DEADWOOD_M3
    both = stand(conifer_deadwood=0.5 * half / VOLUME["conifer"], deciduous_deadwood=0.5 * half / VOLUME["deciduous"])
    assert deadwood(both)[0] == pytest.approx(0.5)
    assert deadwood(stand(conifer_deadwood=5.0))[0] == 1.0
    for cover, value in ((1.0, 0.0), (0.965, 0.5), (0.93, 1.0), (0.6, 1.0), (0.35, 0.5), (0.1, 0.0), (0.0, 0.0)):
        assert open_ground(stand(cover=cover))[0] == pytest.approx(value), cover


def test_the_best_and_the_poorest_stand():
    best = stand(dict.fromkeys(CLASSES, 50.0), conifer_deadwood=3.0, cover=0.8)
    assert biodiversity_index(best)[0] == pytest.approx(1.0)
    plantation = stand({"conifer_sapling_stems_ha": 2000.0})
    assert biodiversity_index(plantation)[0] == 0.0
    two_features = stand({"conifer_old_stems_ha": 10.0}, cover=0.8)
    assert biodiversity_index(two_features)[0] == pytest.approx(0.5)


@given(
    stems=st.lists(st.floats(0.0, 1e4), min_size=10, max_size=10),
    wood=st.tuples(st.floats(0.0, 60.0), st.floats(0.0, 60.0)),
    cover=st.floats(0.0, 1.0),
)
def test_it_stays_in_its_bounds(stems, wood, cover):
    value = biodiversity_index(stand(dict(zip(CLASSES, stems, strict=True)), *wood, cover))
    assert value.shape == (1,) and 0.0 <= value[0] <= 1.0


def test_it_is_an_objective_by_name():
    env = quick(objectives=("carbon", "biodiversity"), record_years=True)
    _, rewards, info = play(env, [2, 12, 22, 4], seed=2)
    np.testing.assert_allclose(4.0 * rewards[:, 1], biodiversity_index(info["years"]), rtol=1e-6)
    assert (info["years"]["biodiversity_clipped"] == 0.0).all() and 0.0 < rewards[:, 1].min()
    assert env.reward_space.low.tolist() == [-1.0, 0.0]
