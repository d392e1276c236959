from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scripts import run_script

import sim
from analysis.studies import open_loop, sensitivity
from sim.parameters import check_constants, check_mechanisms, check_overrides


@pytest.mark.parametrize("share", [0.1, 0.95])
def test_levels_keep_limits_and_order(share):
    for name, constant in sim.CONSTANTS.items():
        low, high = sensitivity.levels(name, share=share)
        assert low <= constant.low <= high and low < high
        check_constants({name: low})
        check_constants({name: high})


@pytest.mark.parametrize(
    "name, steps",
    [
        ("light_use_conifer", (0.07457, 0.07457)),
        ("acclimation_start_conifer_c", (2, 2)),
        ("warmest_day", (9.1, 9.1)),
        ("humidity_wet_spring", (0.02, 0.02)),
        ("ground_emissivity", (0.08, 0.02)),
    ],
)
def test_steps(name, steps):
    """A tenth of the value; of a span, where zero is arbitrary; no farther than the limits of .9 and 1."""
    low, high = sensitivity.levels(name)
    value = sim.CONSTANTS[name].low
    assert (value - low, high - value) == pytest.approx(steps)


def test_a_step_stops_half_way_to_its_neighbour():
    near = sim.CONSTANTS | {"snow_albedo_cold": replace(sim.CONSTANTS["snow_albedo_cold"], low=0.52, high=0.52)}
    assert sensitivity.levels("snow_albedo_old", near)[1] == pytest.approx(0.51)
    assert sensitivity.levels("snow_albedo_cold", near)[0] == pytest.approx(0.51)


def test_every_variant_can_be_run_and_every_parameter_varies():
    variants = sensitivity.variants()
    for variant in variants:
        check_overrides(variant.site)
        check_constants(variant.constants)
        check_mechanisms(variant.mechanisms)
    factors = {variant.factor for variant in variants}
    assert factors >= {*sim.SITE_PARAMETERS, *sim.CONSTANTS, *sensitivity.ALTERNATIVES}
    assert [v.level for v in variants if v.factor == "harvest_stored_share"] == ["low", "high"]
    assert [v.level for v in variants if v.factor == "mature_age_limit"] == ["low"]


def returns_table(values: dict) -> pd.DataFrame:
    """A table from (factor, level) -> carbon of the four plans; thaw is its negative; two sites, 1 above and below."""
    rows = [
        {"factor": factor, "level": level, "value": level, "site": site, "plan": plan, "carbon": c, "thaw": -c}
        for (factor, level), carbon in values.items()
        for site in (-1, 1)
        for plan, c in zip(sensitivity.PLANS, np.add(carbon, site), strict=True)
    ]
    return pd.DataFrame(rows)


def test_measures_and_effects_of_a_hand_case():
    table = returns_table(
        {
            ("default", "default"): (0, 1, 2, 3),
            ("straight", "low"): (0, 1, 2, 3),
            ("straight", "middle"): (2, 3, 4, 5),
            ("straight", "high"): (4, 5, 6, 7),
            ("bent", "low"): (0, 1, 2, 3),
            ("bent", "middle"): (2, 3, 4, 5),
            ("bent", "high"): (0, 5, 2, 3),
            ("at its limit", "low"): (1, 1, 1, 1),
        }
    )
    default = sensitivity.measures(table).loc[("default", "default")]
    assert (default.zero_carbon, default.gain_carbon, default.species_carbon) == (0, 2, -1)
    assert (default.zero_thaw, default.gain_thaw, default.species_thaw) == (0, -2, 1)
    moved = sensitivity.effects(table).set_index("factor")
    assert moved.loc["straight", ["zero_carbon", "gain_carbon", "bend"]].tolist() == [4, 0, 0]
    assert moved.loc["bent", ["zero_carbon", "species_carbon", "zero_thaw"]].tolist() == [0, 4, 0]
    assert moved.loc["bent", "bend"] == pytest.approx(2 / 4)
    assert moved.loc["at its limit", ["zero_carbon", "high"]].tolist() == [-1, ""]
    assert sensitivity.by_size(moved, ["species_carbon"]).index[0] == "bent"


def test_page_has_every_factor():
    generator = np.random.default_rng(0)
    values = {(v.factor, v.level): generator.normal(size=4) for v in sensitivity.variants()}
    page = sensitivity.page(returns_table(values))
    names = [*(f"`{name}`" for name in (*sim.SITE_PARAMETERS, *sim.CONSTANTS)), *sensitivity.ALTERNATIVES]
    assert all(f"| {name} |" in page for name in names)


def test_a_variant_is_played():
    site = open_loop.FIRST_SITE_SEED
    default = sensitivity.play(sensitivity.DEFAULT, [site], weathers=2, years=2)
    constants = {"light_use_conifer": 1.4, "light_use_deciduous": 1.7}
    other = sensitivity.play(replace(sensitivity.DEFAULT, constants=constants), [site], weathers=2, years=2)
    assert (other.carbon > default.carbon).all()
    first, second = (
        open_loop.play([sim.sample_site(site)], [open_loop.seeds(site, weather)], [[24, 24]]).returns()[0]
        for weather in (0, 1)
    )
    row = default[default.plan == "conifers"][["carbon", "thaw"]].to_numpy()[0]
    assert row == pytest.approx((first + second) / 2, rel=1e-12)


@pytest.mark.slow
def test_a_stopped_study_goes_on_with_the_groups_that_are_left(tmp_path, monkeypatch, capsys):
    chosen = ("default", "soil_respiration", "mature_age_limit", next(iter(sensitivity.ALTERNATIVES)))
    variants = [variant for variant in sensitivity.variants() if variant.factor in chosen]
    for name, value in (("variants", lambda: variants), ("SITES", 1), ("WEATHERS", 1), ("YEARS", 2)):
        monkeypatch.setattr(sensitivity, name, value)
    args = sensitivity.Args(output_dir=tmp_path, document=tmp_path / "sensitivity.md")
    sensitivity.main(args)
    page = args.document.read_text()
    assert "| `soil_respiration` | 0.4 | 0.6 | -" in page  # more respiration, less carbon
    assert "| `mature_age_limit` | 90 |  |" in page
    (tmp_path / "alternatives.csv").unlink()
    sensitivity.main(args)
    assert "3 of 4 groups are there" in capsys.readouterr().out
    assert args.document.read_text() == page


def test_refusals():
    with pytest.raises(SystemExit, match="--names nonsense"):
        run_script("analysis/studies/sensitivity.py", "--names", "nonsense")
