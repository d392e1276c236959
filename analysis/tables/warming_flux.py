"""Heat through the permafrost boundary under policies trained on each formulation of the thaw reward."""

import pandas as pd

from analysis.tables.common import over_seeds, paper
from analysis.tables.thaw_formulations import FORMULATIONS, replicates_of

MADE_BY = "python analysis/reproduce.py --only main thaw"
FLUXES = {"boundary_warming_mj_m2": "warming", "boundary_cooling_mj_m2": "cooling"}  # MJ m-2 yr-1
COLUMNS = {
    "formulation": "formulation",
    "seeds": "seeds",
    "warming": "heat down at 12 m (MJ/m2/yr)",
    "paper_warming": "heat down (MJ, paper)",
    "cooling": "heat up at 12 m (MJ/m2/yr)",
    "zero_change_warming": "heat down, zero change",
}


def make(results) -> pd.DataFrame:
    """One row per formulation: means over 50 years, the episodes and the kept weights."""
    published = paper("thaw_formulations", index_col="formulation").warming_flux_mj
    zero_change = results.of("main", "zero_change")
    reference = [one.mean_of_years(FLUXES)["boundary_warming_mj_m2"] for one in zero_change]
    rows = []
    for formulation in FORMULATIONS:
        table = pd.DataFrame(
            [one.mean_of_years(FLUXES) for one in replicates_of(results, formulation)], columns=list(FLUXES)
        ).rename(columns=FLUXES)
        row = {"formulation": formulation, "seeds": len(table)} | over_seeds(table)
        row |= {"paper_warming": published[formulation], "zero_change_warming": reference[0] if reference else None}
        rows.append(row)
    return pd.DataFrame(rows)
