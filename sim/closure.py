"""Whether a year closed: the tolerances, and the error that has what it takes to replay a year that did not."""

import numpy as np

from sim.state import PARAMETER_NAMES, RECORD_NAMES, STATE_NAMES

#: Largest failure to close that a year may show: record column -> tolerance (its unit). That of stems
#: scales with the stock, whose round-off it contains.
TOLERANCES = {
    "energy_residual_w_m2": 1e-6,
    "canopy_residual_w_m2": 1e-6,
    "water_residual_mm": 1e-9,
    "carbon_residual_kgc_m2": 1e-12,
    "annual_carbon_residual_kgc_m2": 1e-9,
    "stems_residual_ha": 1e-9,
}
_COLUMNS = [RECORD_NAMES.index(name) for name in TOLERANCES]
_STEMS, _DENSITY = list(TOLERANCES).index("stems_residual_ha"), RECORD_NAMES.index("density_stems_ha")


class PhysicsError(RuntimeError):
    """A year that failed to close or left the finite numbers, with what is needed to replay it."""


def check_closure(state, record, parameters, describe) -> None:
    """Raise `PhysicsError` where a year did not close, or left a number that is not finite.

    state, record, parameters : (stands, fields) each; describe : function of a row that says which year of which stand.
    """
    residuals = record[:, _COLUMNS]
    limits = np.tile(list(TOLERANCES.values()), (len(record), 1))
    limits[:, _STEMS] *= 1.0 + record[:, _DENSITY]
    closed = residuals <= limits
    finite = np.isfinite(state)
    if closed.all() and finite.all():
        return
    if not closed.all():
        k, column = np.argwhere(~closed)[0]
        problem = f"{list(TOLERANCES)[column]} = {residuals[k, column]:.3g} beyond {limits[k, column]:.1g}"
    else:
        k = int(np.argmin(finite.all(axis=1)))
        wrong = [name for name, value in zip(STATE_NAMES, state[k], strict=False) if not np.isfinite(value)]
        problem = f"{', '.join(wrong) or 'stems'} not finite"
    terms = ", ".join(f"{name}={value:.6g}" for name, value in zip(RECORD_NAMES, record[k], strict=True))
    site = ", ".join(f"{name}={value:.6g}" for name, value in zip(PARAMETER_NAMES, parameters[k], strict=True))
    raise PhysicsError(f"{problem} in {describe(k)}; record: {terms}; site: {site}")
