"""Check the simulator against reality, and write what comes out: docs/validation.md and its figures.

    python analysis/validate.py            # everything, a few minutes on two cores
    python analysis/validate.py --quick    # few sites, to see that it runs; to results/validation
    python analysis/validate.py --parts towers weather

Held stands on sampled sites against the bands of the literature; two towers, driven by their own weather; the weather
generator and its calibration; the seasonal course of carbon and water; fire, insects and mortality; stands that run
free, against chronosequences; field experiments; what the thaw return hangs on; a list of what misses. Every
modelled number is from the run that wrote it, but for the signs under every constant, which a study of its own finds.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

from analysis import paths
from analysis.validation import (
    bands,
    disturbance_report,
    document,
    field_report,
    free_report,
    robustness_report,
    seasonal_fluxes,
    tower_report,
    weather_report,
)
from analysis.validation.document import Part
from cleanrl_style import protocol

QUICK = {"sites": 16, "free_sites": 1, "field_sites": 1, "thaw_sites": 2, "tower_repeats": 1}
FEWEST = {"sites": 1, "free_sites": 1, "field_sites": 1, "thaw_sites": 2, "tower_repeats": 1}
FULL_DOCUMENT = Path("docs")
OTHERWISE = Path("results/validation")

PartName = Literal["bands", "towers", "weather", "seasons", "disturbance", "free", "field", "robustness"]


@dataclass
class Args:
    """Check the simulator against observations and write validation.md with its figures."""

    parts: tuple[PartName, ...] = get_args(PartName)
    """parts to run; fewer than all give a document of those"""
    sites: int = 200
    """sampled sites that stands are held on"""
    free_sites: int = 96
    """sampled sites that stands run free on, up to 150 years"""
    field_sites: int = 48
    """sampled sites that field experiments are repeated on"""
    thaw_sites: int = 48
    """sampled sites that the thaw return's variance is split on"""
    tower_repeats: int = 3
    """times that a tower's years are run; the last, with soil and snow in balance, is compared"""
    quick: bool = False
    """16 sites (later parts 1 or 2) and a tower's years once: to see that everything runs, not to be believed"""
    output_dir: Path | None = None
    """folder for validation.md and images/; by default docs for the whole, otherwise results/validation"""


#: Name -> heading and what makes it, from the arguments.
PARTS: dict[str, tuple[str, Callable[[Args], Part]]] = {
    "bands": ("Stands on sampled sites against observed ranges", lambda args: bands.report(args.sites)),
    "towers": ("Two towers, driven by their own weather", lambda args: tower_report.report(args.tower_repeats)),
    "weather": (
        "The weather generator and its calibration",
        lambda args: weather_report.report(args.sites, args.tower_repeats),
    ),
    "seasons": ("Seasonal courses of carbon and water", lambda args: seasonal_fluxes.report(args.sites)),
    "disturbance": ("Fire, insects and mortality", lambda args: disturbance_report.report(args.sites)),
    "free": ("Stands that run free", lambda args: free_report.report(args.free_sites)),
    "field": ("Field experiments", lambda args: field_report.report(args.field_sites)),
    "robustness": ("What the thaw return hangs on", lambda args: robustness_report.report(args.thaw_sites, args.quick)),
}

INTRODUCTION = """# Validation

Of the physics, against what was measured (validation *sites*, to choose methods by, are in [planners.md](planners.md)).
Written by `python analysis/validate.py`; every modelled number is from that run, but for the paragraph on constants in
part 8, which is from `python analysis/studies/planting_signs.py`. Numbers of the literature and remarks on the records
were written by hand. Observations, with their sources and licences, are in
[analysis/observations](../analysis/observations/README.md), equations in [model.md](model.md). Bias is modelled less
measured, RMSE the root mean square error, r Pearson's correlation. **MISS** is a value outside the band or beyond the
tolerance that the part states; all of them are listed at the end. *Input* is what the simulator is given, so that it
cannot miss by itself. Constants that were calibrated to observations, some of them to those below, have the mark [C] in
[model.md](model.md).

Where nothing else is said, sampled sites are in the world of `boreal-generalist-v0`: weather by the paper's ranges,
boundary and first soil carbon drawn. Held stands are looked at in that of `boreal-balanced-v0`, too (part 1), and so
are its weather (part 3), stands that run free in it (part 6) and its thaw return (part 8)."""


def assemble(parts: dict[str, Part]) -> str:
    """The document of the parts that were run, in the order of `PARTS`."""
    sections = [INTRODUCTION]
    for number, (name, (heading, _)) in enumerate(PARTS.items(), start=1):
        if name in parts:
            sections.append(f"## {number}. {heading}\n\n{parts[name].text}")
    rows = [[miss.where, miss.what, miss.likely] for part in parts.values() for miss in part.misses]
    listed = document.table(["where", "what", "process that is likely behind it"], rows, left=3) if rows else "Nothing."
    sections.append(f"## {len(PARTS) + 1}. What misses\n\n{listed}")
    return document.fill("\n\n".join(sections)) + "\n"


def write(folder: Path, text: str, figures: dict[str, bytes]) -> None:
    """validation.md and images/ in a folder, each file whole or not at all."""
    images = folder / "images"
    for path, content in [(images / name, png) for name, png in figures.items()] + [
        (folder / "validation.md", text.encode())
    ]:
        with protocol.replacing(path) as file:
            file.write(content)


def main(args: Args) -> None:
    """Play what is compared with observations, and write the page."""
    for name, fewest in FEWEST.items():
        if getattr(args, name) < fewest:
            given = getattr(args, name)
            protocol.fail(f"--{name.replace('_', '-')} of at least {fewest} is allowed, not {given}")
    if args.quick:
        args = replace(args, **QUICK)
    whole = set(args.parts) == set(PARTS) and not args.quick
    folder = args.output_dir or (FULL_DOCUMENT if whole else OTHERWISE)
    for one in (folder, folder / "images"):
        paths.make_writable("--output-dir", one)
    parts = {}
    for name, (heading, report) in PARTS.items():
        if name in args.parts:
            print(f"{heading} ...", flush=True)
            parts[name] = report(args)
    figures = {name: png for part in parts.values() for name, png in part.figures.items()}
    write(folder, assemble(parts), figures)
    misses = sum(len(part.misses) for part in parts.values())
    print(f"wrote {folder / 'validation.md'}, figures: {len(figures)}; values that miss, listed at its end: {misses}")


if __name__ == "__main__":
    main(protocol.parse(Args))
