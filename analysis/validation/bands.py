"""Held stands on sampled sites against the ranges that boreal forests show: a table and a figure."""

import numpy as np

from analysis.validation import document
from analysis.validation.document import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, Miss, Part, number, percent
from analysis.validation.held_stands import KINDS, UNDISTURBED, Run, hold
from analysis.validation.observed_bands import ALL, CHECKS, FELLED, WARMING, Check
from analysis.validation.scores import IN, Band
from boreal_env import BALANCED_WORLD

SKIPPED_YEARS = 7
KEPT_YEARS = 5
FOREST = "mature conifer"
COLOURS = dict(zip(ALL, (BLUE, ORANGE, GREEN, SKY, PURPLE, BLACK), strict=True))
SHORT = dict(zip(ALL, ("conifer", "deciduous", "mixed", "young", "old", "open"), strict=True))


def report(sites: int) -> Part:
    """All kinds of stand on `sites` sites: the table, the figure, what misses."""
    runs = run_all(sites)
    values, rows, misses = _judged({kind: runs[kind] for kind in ALL})
    rows = [[*row, check.source] for row, check in zip(rows, CHECKS.values(), strict=True)]
    pair_rows, pair_misses = _pairs(runs)
    balanced = {
        kind: hold(KINDS[kind], sites, KEPT_YEARS, SKIPPED_YEARS, UNDISTURBED, keep_daily=("swe_mm",), **BALANCED_WORLD)
        for kind in (FOREST, "open")
    }
    _, balanced_rows, balanced_misses = _judged(balanced, ", `boreal-balanced-v0`")
    biomass = ", ".join(f"{kind} {number(KINDS[kind]['biomass_kgc_m2'], 1)}" for kind in ALL if kind != "open")
    text = f"""{sites} sites drawn as for episodes of the environment, each with {SKIPPED_YEARS + KEPT_YEARS} years of
its own weather, of which the last {KEPT_YEARS} are averaged; the same sites and weather for every stand. Stands are
held: on every 1 January trees, dead wood, soil carbon and organic layer are put back to those of the start. Mature is
1500 stems/ha of 41-100 years, young of 21-40, old of more than 100, half of each species where mixed; open ground has
no stems. Biomass [kgC/m2]: {biomass}; dead wood what the stand's deaths keep up. Soil carbon is drawn, 2-10 kgC/m2 as
in an episode. No fire, no insects. Cells are the median over the sites (10-90 %), the verdict of the median and the
share of sites in the band; no verdict where the band is not meant for the stand. So GPP and respiration of deciduous
stands have none: of the towers one is in such a forest; NEP's is a wider choice. The summer
albedo of open ground is given by its band's source; the loss of snow from crowns and, through a constant calibrated at
SE-Svb, the Bowen ratio hang on observations that are in their bands.

{document.table(["", "band", *ALL, "source"], rows, left=len(ALL) + 3)}

The same in the world of `boreal-balanced-v0`: the weather as observed, boundary and first soil carbon in balance, with
each stand its own.

{document.table(["", "band", *balanced], balanced_rows, left=4)}

What felling a stand of mature conifers does to the surface soil, on the same sites and weather: the ground in balance
without trees, with the organic layer of the conifers and with that of open ground.

{document.table(["", "warming [K]", "band", "source"], pair_rows, left=4)}

{_permafrost_text(runs, balanced)}

![Bands](images/validation_bands.png)"""
    return Part(text, {"validation_bands.png": draw(values)}, [*misses, *balanced_misses, *pair_misses])


def _permafrost_text(runs: dict[str, Run], balanced: dict[str, Run]) -> str:
    """On how many sites there is permafrost, and how deep it thaws where there is."""

    def found(run: Run) -> tuple[str, str]:
        frozen = run.sites("permafrost_top_temperature_c") < 0.0
        depth = run.sites("active_layer_depth_m")[frozen]
        return percent(frozen.mean()), number(float(np.median(depth))) if frozen.any() else "-"

    rows = [
        [world, *(cell for kind in (FOREST, "open") for cell in found(of[kind]))]
        for world, of in (
            ("boundary drawn, as in `boreal-generalist-v0`", runs),
            ("boundary and soil carbon balanced, as in `boreal-balanced-v0`", balanced),
        )
    ]
    header = ["", *(f"{kind}: {what}" for kind in (FOREST, "open") for what in ("permafrost", "thaws to [m]"))]
    return f"""Sites with permafrost, ground whose mean over the years stays below 0 degC where thaw is deepest, and the
median of that depth on them. In balance, the boundary of each column is that of its own stand, so that the two do not
show what felling does there.

{document.table(header, rows, left=1)}"""


def _judged(runs: dict[str, Run], world: str = "") -> tuple[dict, list[list[str]], list[Miss]]:
    """Every quantity of the kinds of stand in `runs`: samples by quantity and kind, rows of a table, and what misses, a
    kind's name with `world` behind it."""
    values, rows, misses = {}, [], []
    for name, check in CHECKS.items():
        values[name] = {kind: check.value(run) for kind, run in runs.items() if kind in check.shown}
        cells = [_cell(check, kind, values[name]) for kind in runs]
        unit = "" if check.unit == "1" else f" [{check.unit}]"
        rows.append([f"{name}{unit}", _limits(check, values[name]), *cells])
        for kind, sample in values[name].items():
            if kind in check.bands:
                misses += _miss(name, check, kind, sample, kind + world)
    return values, rows, misses


def run_all(sites: int) -> dict[str, Run]:
    """Every kind of `KINDS`, and felled conifers, by name."""
    runs = {}
    for kind, stocks in KINDS.items():
        runs[kind] = hold(stocks, sites, KEPT_YEARS, SKIPPED_YEARS, UNDISTURBED, keep_daily=("swe_mm",))
    layer = float(np.median(runs[FOREST].sites("organic_layer_m")))
    runs[FELLED] = hold({**KINDS["open"], "organic_layer_m": layer}, sites, KEPT_YEARS, SKIPPED_YEARS, UNDISTURBED)
    return runs


def _limits(check: Check, samples: dict[str, np.ndarray]) -> str:
    """The band, or one for each kind of stand in `samples` where they differ."""
    bands = {kind: band for kind, band in check.bands.items() if kind in samples}
    digits = max(_digits(check, kind, samples[kind]) for kind in bands)
    texts = {kind: document.limits(band, digits) for kind, band in bands.items()}
    if len(set(texts.values())) == 1:
        return next(iter(texts.values()))
    return "; ".join(f"{SHORT[kind]} {text}" for kind, text in texts.items())


def _digits(check: Check, kind: str, sample: np.ndarray) -> int:
    """Digits of a kind's values with which the verdict is seen."""
    return check.bands[kind].digits(float(np.median(sample)), check.digits) if kind in check.bands else check.digits


def _cell(check: Check, kind: str, samples: dict[str, np.ndarray]) -> str:
    if kind not in samples:
        return "-"
    digits = _digits(check, kind, samples[kind])
    text = document.spread(samples[kind], digits)
    return f"{text} {_verdict(check.bands[kind], samples[kind])}" if kind in check.bands else text


def _verdict(band: Band, sample: np.ndarray) -> str:
    verdict = band.verdict(float(np.median(sample)))
    return f"{document.marked(verdict)}, {percent(band.share_within(sample))}"


def _miss(name: str, check: Check, kind: str, sample: np.ndarray, where: str) -> list[Miss]:
    median, band = float(np.median(sample)), check.bands[kind]
    verdict = band.verdict(median)
    if verdict == IN:
        return []
    digits = _digits(check, kind, sample)
    limits = document.limits(band, digits)
    likely = check.low if "low" in verdict else check.high
    return [Miss(where, f"{name}: median {number(median, digits)}, band {limits}", likely)]


def _pairs(runs: dict[str, Run]) -> tuple[list[list[str]], list[Miss]]:
    """Surface soil of open ground less that of mature conifers on the same sites."""
    forest = WARMING.value(runs[FOREST])
    rows, misses = [], []
    for label, kind in (("organic layer as it was", FELLED), ("organic layer of open ground", "open")):
        sample = WARMING.value(runs[kind]) - forest
        cells = [_cell(WARMING, FELLED, {FELLED: sample}), _limits(WARMING, {FELLED: sample})]
        rows.append([label, *cells, WARMING.source])
        misses += _miss(f"warming of the surface soil [K], {label}", WARMING, FELLED, sample, FELLED)
    return rows, misses


@document.styled
def draw(values: dict[str, dict[str, np.ndarray]]) -> bytes:
    """PNG: per quantity the median and 10-90 % of the sites of every kind, over the bands (grey)."""
    figure = document.new_figure(8.5, 8.0)
    axes = figure.subplots(4, 3).ravel()
    for ax, (name, samples) in zip(axes, values.items(), strict=True):
        check = CHECKS[name]
        ax.use_sticky_edges = False  # a band's lower end is seen, too
        for row, kind in enumerate(ALL):
            if kind in check.bands:
                band = check.bands[kind]
                ax.barh(row, band.high - band.low, left=band.low, height=0.8, color=GREY, alpha=0.35)
            if kind in samples:
                low, median, high = np.percentile(samples[kind], [10, 50, 90])
                ax.plot([low, high], [row, row], color=COLOURS[kind], lw=2.5)
                ax.plot(median, row, "o", color=COLOURS[kind], ms=5)
        ax.set_yticks(range(len(ALL)), [SHORT[kind] for kind in ALL])
        ax.invert_yaxis()
        ax.set_title(name)
        ax.set_xlabel("" if check.unit == "1" else check.unit)
    figure.suptitle("Held stands on sampled sites: median and 10-90 % of sites, and the band of the table (grey)")
    return document.png(figure)
