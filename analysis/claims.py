"""Writes docs/reproduction.md: every claim of the paper that a number can test, with ours and a verdict.

    python analysis/claims.py [--runs-dir results/runs] [--output docs/reproduction.md]

Reads the archived runs, the studies, and the paper's tables (analysis/paper_tables). A claim without its runs says
which command makes them. The claims are in analysis/paper_claims, a module a theme; numbers, intervals and verdicts are
computed, and the same results give the same bytes.
"""

import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from analysis import experiments, paths
from analysis.paper_claims import (
    asymmetry,
    curriculum,
    environment,
    mechanisms,
    paper_itself,
    performance,
    preference,
    speed,
    strategies,
)
from analysis.paper_claims.claim import (
    CONTRADICTS,
    FEWEST_SEEDS,
    NO_RUNS,
    NOT_REPRODUCED,
    REPRODUCED,
    UNDECIDED,
    UNTESTABLE,
    VERDICTS,
    Claim,
    Finding,
    Missing,
    Number,
)
from analysis.paper_claims.evidence import Evidence
from analysis.results import Results
from cleanrl_style import protocol

THEMES = (environment, asymmetry, performance, preference, curriculum, mechanisms, strategies, speed, paper_itself)
MEANING = {
    REPRODUCED: "our numbers meet the rule that the claim names",
    NOT_REPRODUCED: "they meet its opposite",
    CONTRADICTS: "another number of the paper, or its own definitions, exclude it",
    UNTESTABLE: "what it needs is not logged, or not there",
    UNDECIDED: f"the interval leaves both open, or there are fewer than {FEWEST_SEEDS} training seeds",
    NO_RUNS: "what it needs has not been run",
}

INTRODUCTION = """\
# The paper's claims

Written by `python analysis/claims.py`; not to be edited. The claims of the paper
([Dsouza et al. 2025](https://arxiv.org/abs/2509.19846)) that a number can test: the paper's value, ours, and a verdict
that is computed from the numbers by the rule that stands with the claim.

Its simulator and ours are two programs with the same purpose. Values of returns, densities and fluxes need not agree;
what a method can do, what comes out ahead, and which way a mechanism works should. Where ours differ, the claim says
why, as far as an experiment tells.

**Numbers.** Ours are interquartile means over training seeds with 95 % bootstrap intervals, of sampled policies on the
same evaluation sites and weathers; differences between methods are paired by seed. Returns are sums over 50 years;
gains are returns less those of zero change on the same episodes. What is over sites or episodes is a mean with its 95 %
t interval, and has no training in it. Protection is less heat through the boundary at 12 m, as the reward has it; where
pairs of stands are compared the active layer stands beside it.

**Verdicts.** A claim that one thing is more than another is reproduced if the whole interval of the difference has its
sign; it is not if the interval has the other sign, or holds no effect worth the name: of a return a quarter of what the
best constant plans gain over doing nothing, of what has the paper's units a quarter of its effect. Beyond that signs
are judged, not sizes: how large the paper's difference is stands beside ours. A value or a range is reproduced if all
of our interval lies in it, give or take a tenth, and not if all of it lies outside. A cost (time, memory, money) is
reproduced if ours is no larger. A claim of several parts is not reproduced if one of them is not. A bootstrap over few
seeds is too narrow (of normal values it covers nine tenths with five seeds instead of 95 %), so verdicts ask for five,
and for the t interval of the seeds' mean, which is not printed, to agree. Dozens of intervals are judged one by one,
uncorrected. Those over training seeds hold for these evaluation sites: other sites are another matter. Curriculum and
PPO Gated of one seed train on the same episodes; EUPG's batches are others, and share the evaluation alone.
"""


@dataclass
class Args:
    """Writes the paper's claims with our numbers and verdicts."""

    runs_dir: tuple[Path, ...] | None = None
    """folders that hold the runs, at any depth (None: the archive, results/runs or results/quick/runs)"""
    output: Path | None = None
    """the document (None: docs/reproduction.md, or results/quick/reproduction.md)"""
    quick: bool = False
    """from the runs of `reproduce.py --quick`"""


def judge(claim: Claim, evidence: Evidence) -> Finding:
    """What the evidence says of a claim; a claim that lacks something has no rows."""
    try:
        return claim.measure(evidence)
    except Missing as lacking:
        return Finding([], NO_RUNS, str(lacking))


def table(rows) -> list[str]:
    """A claim's rows as Markdown."""
    lines = ["| | paper | ours | over |", "|---|---|---|---|"]
    for row in rows:
        basis = row.ours.basis if isinstance(row.ours, Number) else ""
        lines.append(f"| {row.what} | {row.paper} | {row.ours} | {basis} |")
    return lines


def explanation(claim: Claim, found: Finding) -> list[str]:
    """The rule, the mechanism if the claim is not reproduced, and the note."""
    lines = []
    if found.rule and found.verdict != UNTESTABLE:
        lines.append(f"Reproduced if {found.rule}.")
    if found.waits:
        lines.append(f"Too few training seeds for a verdict: {FEWEST_SEEDS} are needed.")
    if found.verdict in (NOT_REPRODUCED, CONTRADICTS) and claim.why:
        lines.append(f"Why: {claim.why}")
    elif found.verdict == NOT_REPRODUCED and claim.command:
        lines.append("Why: no experiment has separated that yet.")
    return lines + [claim.note] if claim.note else lines


def section(number: int, claim: Claim, found: Finding) -> str:
    """A claim as Markdown."""
    head = [
        f'<a id="claim-{number}"></a>',
        "",
        f"### {number}. {claim.statement}",
        "",
        f"{claim.where}. **{found.verdict[0].upper()}{found.verdict[1:]}.**",
    ]
    if found.verdict == NO_RUNS:
        return "\n".join([*head, "", f"No runs yet: `{claim.command}` ({found.rule} is lacking)", ""])
    source = f"`{claim.command}`" if claim.command else "From the paper and this project's tables alone."
    return "\n".join([*head, "", *table(found.rows), "", " ".join(explanation(claim, found)), "", source, ""])


def contents(themes: dict[str, dict[int, str]], controls: int) -> str:
    """Claims by verdict, then by theme, as tables; themes : title -> number of the claim -> verdict."""
    verdicts = {number: verdict for theme in themes.values() for number, verdict in theme.items()}
    lines = [
        f"{len(verdicts)} claims, {controls} of them controls of ours that the paper does not speak of (they say so):",
        "",
        "| verdict | claims | | that is |",
        "|---|---|---|---|",
    ]
    for verdict in VERDICTS:
        of_it = [number for number in verdicts if verdicts[number] == verdict]
        links = " ".join(f"[{number}](#claim-{number})" for number in of_it)
        lines.append(f"| {verdict} | {len(of_it)} | {links} | {MEANING[verdict]} |")
    lines += ["", "| theme | claims | " + " | ".join(VERDICTS) + " |", "|---" * (2 + len(VERDICTS)) + "|"]
    for title, theme in themes.items():
        counts = [list(theme.values()).count(verdict) for verdict in VERDICTS]
        cells = [f"[{title}](#claim-{min(theme)})", f"{min(theme)} - {max(theme)}", *(str(n or "") for n in counts)]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, ""])


def progress(results: Results) -> str:
    """How much of every experiment has been run, as a table, and its studies."""
    lines = ["| experiment | runs | planned | studies | what |", "|---|---|---|---|---|"]
    for name, experiment in experiments.EXPERIMENTS.items():
        jobs = [job for job in results.jobs if job.experiment == name]
        planned = [job for job in jobs if not job.is_study]
        there = len(planned) - sum(job.experiment == name for job in results.missing)
        studies = [
            f"`{job.script}`{'' if results.study(job.script) is not None else ' (not yet)'}"
            for job in jobs
            if job.is_study
        ]
        lines.append(f"| `{name}` | {there} | {len(planned)} | {', '.join(studies)} | {experiment.what} |")
    return "\n".join(lines)


def document(results: Results) -> tuple[str, Counter]:
    """The document, and the number of claims by verdict."""
    evidence, sections, themes, number = Evidence(results), [], {}, 0
    controls = sum("our control" in claim.where for theme in THEMES for claim in theme.CLAIMS)
    for theme in THEMES:
        sections.append(f"## {theme.TITLE}\n")
        themes[theme.TITLE] = {}
        for claim in theme.CLAIMS:
            number += 1
            found = judge(claim, evidence)
            themes[theme.TITLE][number] = found.verdict
            sections.append(section(number, claim, found))
    last = "## What has been run\n\n`python analysis/reproduce.py` makes all, and goes on where it stopped.\n\n"
    left_out = "".join(f"\nLeft out: {line}\n" for line in results.left_out)
    text = "\n".join([INTRODUCTION, contents(themes, controls), *sections, last + progress(results) + "\n"]) + left_out
    return text, Counter(verdict for theme in themes.values() for verdict in theme.values())


def main(args: Args) -> None:
    """Write the document; print how many claims have which verdict."""
    results = Results.load(args.quick, args.runs_dir or (paths.archive(args.quick),))
    text, counts = document(results)
    path = args.output or (paths.results(quick=True) if args.quick else Path("docs")) / "reproduction.md"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with protocol.replacing(path) as file:
            file.write(text.encode())
    except OSError as error:
        sys.exit(f"error: --output {path}: cannot write there ({error.strerror})")
    of_each = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
    print(f"{path}: {counts.total()} claims of the paper; {of_each}")


if __name__ == "__main__":
    main(protocol.parse(Args))
