"""What the methods do with a stand, and what comes of it."""

import pandas as pd

from analysis.methods import LEARNERS, STRATEGIES
from analysis.tables.common import ROW_COLUMNS, over_seeds, paper, paper_name, row_of

MADE_BY = "python analysis/reproduce.py --only main"
YEARS = {
    "density_stems_ha": "density",
    "conifer_fraction": "conifer_fraction",
    "planted_stems_ha": "planted",
    "thinned_stems_ha": "thinned",
    "max_lai": "max_lai",
    "winter_albedo": "winter_albedo",
    "boundary_warming_mj_m2": "warming",
}
COLUMNS = ROW_COLUMNS | {
    "density": "density (stems/ha)",
    "final_density": "density, last year",
    "paper_density": "density (paper)",
    "conifer_fraction": "conifer fraction",
    "final_conifer_fraction": "conifer fraction, last year",
    "paper_species": "species (paper)",
    "planted": "planted (stems/ha/yr)",
    "thinned": "thinned (stems/ha/yr)",
    "max_lai": "LAI",
    "winter_albedo": "winter albedo",
    "carbon": "carbon",
    "paper_carbon": "carbon (paper)",
    "thaw": "thaw",
    "paper_thaw_or_warming": "thaw (paper)",
    "warming": "heat down at 12 m (MJ/m2/yr)",
    "paper_note": "the paper's note",
}


def numbers(one) -> dict:
    """Means over the episodes of one run: 50 years for the stand, all weights for the returns."""
    row = {YEARS[name]: value for name, value in one.mean_of_years(YEARS).items()}
    # of a run that was evaluated at none of the kept weights these are not numbers
    last = one.years[one.years.year == one.years.year.max()]
    row |= {"final_density": last.density_stems_ha.mean(), "final_conifer_fraction": last.conifer_fraction.mean()}
    return row | {"carbon": one.evaluation.carbon_return.mean(), "thaw": one.evaluation.thaw_return.mean()}


def make(results) -> pd.DataFrame:
    """One row per method, those of one's own last; the annual record is of the weights 0, 0.5 and 1."""
    published = paper("learned_strategies", index_col="method").add_prefix("paper_")
    columns = [name for name in COLUMNS if name not in ROW_COLUMNS and not name.startswith("paper_")]
    rows = []
    for key, replicates in results.of_main_and_others((*LEARNERS, *STRATEGIES)).items():
        table = pd.DataFrame([numbers(one) for one in replicates], columns=columns).astype(float)
        row = row_of(key, len(table)) | over_seeds(table)
        if paper_name(*key) in published.index:
            row |= published.loc[paper_name(*key)].to_dict()
        rows.append(row)
    return pd.DataFrame(rows)
