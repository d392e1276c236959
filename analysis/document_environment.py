"""Writes docs/environment.md from the code: the manual of `BorealEnv`, the observation's table, the reward's constants.

python analysis/document_environment.py [--path docs/environment.md]
"""

import inspect
import re
import textwrap
from dataclasses import asdict, dataclass
from pathlib import Path

import boreal_env
import sim
from boreal_env import BALANCED_CARBON_SCALE, BorealEnv, BorealVectorEnv, Objective, Observed, Reward
from cleanrl_style.flags import fail, parse
from cleanrl_style.protocol import replacing
from sim.task.observation import observation_rows

#: Key of the last step's info -> (unit, meaning).
FINAL_INFO = {
    "carbon_return": ("1", "sum of the carbon rewards"),
    "thaw_return": ("1", "sum of the thaw rewards; `<name>_return` of each objective of your own"),
    "site_seed": (
        "",
        "the site is `sim.sample_site(site_seed)` before `parameter_overrides` and the option `site`; "
        "in site-specific mode without temperature noise, and -1, the middle of every range, if no "
        "`site_seed` is given",
    ),
    "episode_seed": (
        "",
        "of the start, the weather and the dice, as in `sim.simulate(seed=)`, drawn by the reset's seed, which is "
        "`seed` of evaluation.csv; in site-specific mode "
        "the `site_seed`, 0 without one",
    ),
    "preference": ("1", "weight of carbon that was observed; of m objectives, not two, an array of all m"),
    "final_density": ("stems ha-1", "at the end of the last year"),
    "mean_density": ("stems ha-1", "mean of the years' ends"),
    "final_conifer_fraction": ("1", "conifers among the stems at the end of the last year"),
    "mean_conifer_fraction": ("1", "mean of the years' ends"),
    "growing_season_days": ("day yr-1", "days with a mean above 5 degC, mean of the years"),
    "latent_heat_mj_m2": ("MJ m-2 yr-1", "latent heat to the air, mean of the years"),
    "ground_shortwave_mj_m2": ("MJ m-2 yr-1", "shortwave absorbed by ground and snow, mean of the years"),
    "net_present_value_eur_ha": ("EUR ha-1", "with prices (`timber`): sum of the discounted net revenues"),
    "years": (
        "",
        "with `record_years`: dict of `year` (from 1) and the columns `boreal_env.HISTORY_NAMES`, each with "
        "one value a year; units in `sim.state.RECORD`, of rewards 1; with prices also `boreal_env.TIMBER_COLUMNS`, "
        "which has their units, and `<name>_reward` and `<name>_clipped` of other objectives",
    ),
}


def page() -> str:
    """The whole page, Markdown."""
    rows = observation_rows(boreal_env.PAPER_OBJECTIVES)
    columns = textwrap.fill(", ".join(f"`{name}`" for name in boreal_env.REWARD_COLUMNS), 120)
    return f"""# The environment

*Made from `boreal_env.py` by `python analysis/document_environment.py`.* [clients.md](clients.md) has
its use with gymnasium's, mo-gymnasium's and other libraries; [decisions.md](decisions.md) what was chosen where the
paper is silent.

{inspect.getdoc(BorealEnv)}

## Vector Environment
{inspect.getdoc(BorealVectorEnv)}

## Observation, entry by entry
`boreal_env.OBSERVATION`, in the paper's order and for its two objectives. The agent sees the normalised value; limits
are those of the value *x* in its unit, from physics. Names that end in `2yr` are of the year before last. The `site_`
entries are the 62 parameters of `sim/site_parameters.csv`, scaled by the ranges that they are sampled from. Of the last
year,
- `carbon_stock` is of trees, dead wood and soil; `total_change` has wood products besides,
- `products_stored` is what went into products, `hwp_stored_kgc_m2` of the record (harvested wood products),
- `thinning_loss` is the carbon of all that was cut, products included, `harvest_kgc_m2` of the record,
- `density_change` is what was carried out of the action, `mix_change` how much the action changed the conifer fraction
  of the stand (without a density change 0 but for round-off).

`growing_season_length` is a site's `fall_start_day` less `growth_start_day`, another thing than `growing_season_days`
of the last info. Where it never snows the drought index can grow without end; it is observed up to its limit. Within
the 1000 years that `years` allows, or with constants at their ends, carbon stocks can pass theirs.

Before the first year both indices are those of an action that changes nothing: the middle density, the nearest mix.

`boreal_env.action_masks(observations)` reads whole observations, 43 or 105 columns; of m objectives give
`objectives=m`, and with `observation_groups` ask the environment: `env.unwrapped.action_masks()` or
`env.unwrapped.mask_function()`. `boreal_env.in_unit(observations, "density", env.unwrapped.observation_names)` gives an
entry in its unit again, of observations (n, d); `observation[None]` makes one of one.

{table(("index", "name", "unit", "normalised", "limits", "group"), map(observation_row, enumerate(rows)))}

## First stocks
Drawn uniformly between these, unless `initial_ranges` says otherwise; biomass within what the stems can hold, and
their age follows from it. `boreal-balanced-v0` takes the soil's carbon that the first stand's litter keeps up.

{table(("stock", "lowest", "highest"), ((f"`{k}`", *(f"{x:g}" for x in v)) for k, v in sim.INITIAL_RANGES.items()))}

## Reward, constant by constant
`boreal_env.Reward`; the paper's values. `boreal-balanced-v0` has `carbon_scale = {boreal_env.BALANCED_CARBON_SCALE:g}`
and keeps it when `reward` is a dict of other constants.

{table(("constant", "value", "unit"), ((f"`{k}`", f"{value:g}", unit(k)) for k, value in asdict(Reward()).items()))}

So a carbon return of 1 is {Reward().carbon_scale:g} kgC m-2 more in the stand and its products
({BALANCED_CARBON_SCALE:g} in `boreal-balanced-v0`), and a thaw return of 1 is {Reward().thaw_scale:g} MJ m-2 that went
up through the boundary.

Each year, with the names of the record: the carbon reward is `carbon_change`, the net change of all stocks over
`carbon_scale`, clipped to -1 .. 1, plus the two bonuses (0 as it stands), less
- `biomass_limit_penalty`: `limit_penalty` x the share by which biomass exceeds `biomass_limit`, and
  `soil_limit_penalty` alike;
- `density_penalty`, where stems after the action reach `density_limit`;
- `ineffective_penalty` x the share of the asked change of density that could not be carried out.

The thaw reward is (heat up - `warming_weight` x heat down) / `thaw_scale`. Both are clipped to -1 .. 1 at the end. A
return is the plain sum over the years, not discounted.

What the environment adds to the annual record:
{columns}

Change and bonuses less penalties are `carbon_reward + carbon_clipped`; with `components_clipped`, what they would be if
nothing were clipped.

## The last step's info
Of a vector environment each is an array in `infos["final_info"]`.

{table(("key", "unit", "meaning"), ((f"`{name}`", *row) for name, row in FINAL_INFO.items()))}

## Objectives of your own
`boreal_env.Objective(name, value, low, high)`. {inspect.getdoc(Objective)}

```python
import gymnasium as gym
import boreal_env


def cut(year):
    \"\"\"Carbon of what is cut, 1 for 1 kgC/m2.\"\"\"
    return year["harvest_kgc_m2"]


env = gym.make("boreal-generalist-v0", objectives=("carbon", "thaw", boreal_env.Objective("cut", cut, 0.0, 1.0)))
```
"""


def unit(constant: str) -> str:
    """Unit of a constant of the reward, which stands behind it in its source."""
    return re.search(rf"^    {constant}: float = \S+(?:  # (.*))?$", inspect.getsource(Reward), re.MULTILINE)[1] or "1"


def observation_row(numbered: tuple[int, Observed]) -> tuple[str, ...]:
    """Cells of an entry of the observation."""
    index, entry = numbered
    return (
        str(index),
        f"`{entry.name}`",
        entry.unit,
        normalisation(entry),
        f"{entry.low:g} .. {entry.high:g}",
        entry.group,
    )


def normalisation(entry: Observed) -> str:
    """(x + shift) / scale, without what does nothing."""
    shifted = f"x {'+' if entry.shift > 0.0 else '-'} {abs(entry.shift):.5g}" if entry.shift else "x"
    if entry.scale == 1.0:
        return shifted
    return f"{f'({shifted})' if entry.shift else shifted} / {entry.scale:.5g}"


def table(head: tuple[str, ...], rows) -> str:
    """A Markdown table."""
    lines = [head, ("-",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


@dataclass
class Args:
    """Writes the environment's page."""

    path: Path = Path("docs/environment.md")
    """file of the page"""


if __name__ == "__main__":
    args = parse(Args)
    if not args.path.parent.is_dir():
        fail(f"--path {args.path}: there is no folder {args.path.parent}")
    with replacing(args.path) as file:
        file.write(page().encode())
