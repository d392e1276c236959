"""Writes docs/environment.md from the code: the manual of `BorealEnv`, the observation's table, the reward's constants.

    python analysis/document_environment.py [--path docs/environment.md]
"""

import inspect
import textwrap
from dataclasses import asdict
from pathlib import Path

import tyro

import boreal_env
from boreal_env import OBSERVATION, BorealEnv, BorealVectorEnv, Objective, Observed, Reward


def page() -> str:
    """The whole page, Markdown."""
    columns = textwrap.fill(", ".join(f"`{name}`" for name in boreal_env.REWARD_COLUMNS), 120)
    return f"""# The environment

*Made from `boreal_env.py` by `python analysis/document_environment.py`.* How it goes with gymnasium's,
mo-gymnasium's and other libraries is in [clients.md](clients.md); where the paper is silent, in
[decisions.md](decisions.md).

{inspect.getdoc(BorealEnv)}

## Vector Environment
{inspect.getdoc(BorealVectorEnv)}

## Observation, entry by entry
`boreal_env.OBSERVATION`, in the paper's order. The agent sees the normalised value; limits are those of the value *x*
in its unit, from physics. Names that end in `2yr` are of the year before last. The `site_` entries are the 62
parameters of `sim/site_parameters.csv`, scaled by the ranges that they are sampled from.

{table(("index", "name", "unit", "normalised", "limits", "group"), map(observation_row, enumerate(OBSERVATION)))}

## Reward, constant by constant
`boreal_env.Reward`; the paper's values. `boreal-balanced-v0` has `carbon_scale = {boreal_env.BALANCED_CARBON_SCALE:g}`.

{table(("constant", "value"), ((f"`{name}`", f"{value:g}") for name, value in asdict(Reward()).items()))}

What the environment adds to the annual record:
{columns}

Change and bonuses less penalties are `carbon_reward + carbon_clipped`; with `components_clipped`, what they would be if
nothing were clipped.

## Objectives of your own
`boreal_env.Objective(name, value, low, high)`. {inspect.getdoc(Objective)}

```python
def timber(year):
    \"\"\"Revenue from what is cut, 1 for 1 kgC/m2.\"\"\"
    return year["harvest_kgc_m2"]

env = gym.make("boreal-generalist-v0", objectives=("carbon", "thaw", boreal_env.Objective("timber", timber, 0.0, 1.0)))
```
"""


def observation_row(numbered: tuple[int, Observed]) -> tuple[str, ...]:
    """Cells of an entry of the observation."""
    index, entry = numbered
    return (str(index), f"`{entry.name}`", entry.unit, normalisation(entry), f"{entry.low:g} .. {entry.high:g}",
            entry.group)  # fmt: skip


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


def main(path: Path = Path("docs/environment.md")) -> None:
    """Write the environment's page.

    Args:
        path: file of the page
    """
    path.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    tyro.cli(main)
