"""Writes docs/reproduction.md: every claim of the paper that a number can test, with ours and a verdict.

    python analysis/claims.py
    python analysis/claims.py --runs-dir runs    # of your own runs, into runs/reproduction.md

Reads the archived runs, the studies, and the paper's tables (analysis/paper_tables). A claim without its runs says
which command makes them. The claims are in analysis/paper_claims, a module a theme; numbers, intervals and verdicts are
computed, and the same results give the same bytes.
"""

from collections import Counter
from dataclasses import dataclass, replace
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
    summary,
)
from analysis.paper_claims.claim import (
    COMPARED,
    CONTRADICTS,
    DIRECTION,
    FAILS,
    FEWEST_SEEDS,
    HOLDS,
    KINDS,
    LEVEL,
    NO_RUNS,
    UNDECIDED,
    UNTESTABLE,
    VERDICTS,
    Claim,
    Finding,
    Missing,
    Number,
    read_twice,
)
from analysis.paper_claims.evidence import Evidence, WithoutMasks
from analysis.results import Results
from cleanrl_style import protocol

THEMES = (environment, asymmetry, performance, preference, curriculum, mechanisms, strategies, speed, paper_itself)
MEANING = {
    HOLDS: "our numbers meet the rule that the claim names",
    FAILS: "they meet its opposite, or an effect too small to count",
    COMPARED: "a level of another simulator, beside ours",
    CONTRADICTS: "another number of the paper, or its own definitions, exclude it",
    UNTESTABLE: "what it needs is not logged, or not there",
    UNDECIDED: f"the interval leaves both open, two readings of the paper part, or there are fewer than {FEWEST_SEEDS} "
    "training seeds",
    NO_RUNS: "what it needs has not been run",
}

HEAD = """\
# The paper's claims

What of the paper ([Dsouza et al. 2025](https://arxiv.org/abs/2509.19846)) holds here: its claims that a number can
test, with the paper's value, ours, and a verdict that is computed from the numbers by the rule that stands with the
claim. Written by `python analysis/claims.py`; not to be edited.
"""
INTRODUCTION = """\
## How it is judged

The paper's simulator and ours are two programs with the same purpose. Values of returns, densities and fluxes need not
agree; what a method can do, what comes out ahead, and which way a mechanism works should. Where ours differ, the claim
says why, as far as an experiment tells.

**Numbers.** Ours are of `boreal-generalist-v0`, the paper's task, where a row names no other. They are interquartile
means over training seeds, of the policy that the runs name primary, the greedy one, on the same test sites and
weathers, with 95 % intervals: bootstrap and t, each end of the one that reaches further. Differences are paired by seed
between runs of one script, and between Curriculum and PPO Gated, which train on the same episodes; between others each
side's seeds are its own. Returns are sums over 50 years; gains are returns less those of zero change on the same
episodes. What is over sites or episodes is a mean with its 95 % t interval, a share with Wilson's, a component of
variance with a bootstrap over sites, and has no training in it; a correlation is a mean over training seeds, with
Fisher's interval over sites. Protection is less heat through the boundary at 12 m, as the reward has it; where pairs of
stands are compared the active layer stands beside it. The paper's boundary is the top of the permafrost table: claims
on how much the site decides, on scatter between episodes and on warming fluxes hang on that depth, too. The paper
trained a single agent for all sites; its ± is over episodes. Trained methods in our tables choose among valid actions.
The paper names masks for its PPOs alone, so claims on Variable λ EUPG are judged, too, by one that chooses among all
actions and pays for what cannot be carried out, where that has been run (its rows stand where they differ); those on
Fixed λ EUPG are not.

**Kinds and votes.** Claims of the paper are sorted by what they are about, and every fact has one vote: a claim that
states another's fact once more names it and has none. A level, a return or a density of another simulator, is set
beside ours and never failed.

**Verdicts.** A claim that one thing is more than another holds if the whole interval of the difference has its sign. It
does not if the interval has the other sign or, whatever its sign, no effect worth the name in it: of a return a quarter
of what the best constant plans gain over doing nothing (25 points of score), of how far a preference is followed a
quarter of what the best constant plans' return changes by from weight 0 to 1, of what has the paper's units a quarter
of its effect, of a ratio of spreads a tenth, of a growing season a day. That is much: planting 100 stems a year blindly
and the best constant plan are less far apart. The best constant plans' change of the thaw return is itself not told
from 0 on these sites, so following in thaw is hard to judge in this world. Beyond that signs are judged, not sizes: how
large the paper's difference is stands beside ours. A value or a range is met if all of our interval lies in it, give or
take a tenth, and not if all of it lies outside. A cost is met if ours is no larger. A claim of several parts does not
hold if one of them does not, and one that can be read in two ways is undecided where the two part. A bootstrap over few
seeds is too narrow (of normal values it covers nine tenths with five seeds instead of 95 %), so verdicts ask for five,
and for the t interval of the seeds' mean to agree. Dozens of intervals are judged one by one, uncorrected. Those over
training seeds hold for these test sites: other sites are another matter.
"""


@dataclass
class Args:
    """Writes the paper's claims with our numbers and verdicts."""

    runs_dir: tuple[Path, ...] | None = None
    """folders that hold the runs, at any depth (None: the archive, results/runs or results/quick/runs)"""
    output: Path | None = None
    """the document (None: docs/reproduction.md or results/quick/reproduction.md; with --runs-dir: there)"""
    quick: bool = False
    """from the runs of `reproduce.py --quick`"""


def judge(claim: Claim, evidence: Evidence) -> Finding:
    """What the evidence says of a claim, read twice if it is on Variable λ EUPG; one that lacks something has no rows.

    The second reading has EUPG without masks. It counts where it has runs enough for a verdict.
    """
    evidence.asked_for_eupg = False
    found = measure(claim, evidence)
    if found.verdict == NO_RUNS or not evidence.asked_for_eupg:
        return found
    unmasked = WithoutMasks(evidence)
    other = measure(claim, unmasked) if unmasked.is_there() else Finding([], NO_RUNS)
    if other.verdict == NO_RUNS or other.waits:
        lacking = "too few training seeds" if other.waits else NO_RUNS
        return replace(found, remark=f"{found.remark} EUPG without masks: {lacking}.".strip())
    return of_both(found, other)


def of_both(found: Finding, other: Finding) -> Finding:
    """The finding of EUPG with masks and of that without, undecided where they part."""
    rows = [replace(row, what=f"{row.what}; EUPG without masks") for row in other.rows if row not in found.rows]
    found = replace(found, rows=[*found.rows, *rows])
    if found.verdict not in (HOLDS, FAILS, UNDECIDED):
        return found
    return read_twice(found, other, ("EUPG with masks", "Without"))


def measure(claim: Claim, evidence: Evidence) -> Finding:
    """What the evidence says of a claim in one reading; levels are compared, and never failed."""
    try:
        found = claim.measure(evidence)
    except Missing as lacking:
        return Finding([], NO_RUNS, str(lacking))
    if claim.kind == LEVEL and found.verdict in (HOLDS, FAILS, UNDECIDED):
        return Finding(found.rows, COMPARED)
    return found


def table(rows) -> list[str]:
    """A claim's rows as Markdown."""
    lines = ["| | paper | ours | over |", "|---|---|---|---|"]
    for row in rows:
        basis = row.ours.basis if isinstance(row.ours, Number) else ""
        lines.append(f"| {row.what} | {row.paper} | {row.ours} | {basis} |")
    return lines


def explanation(claim: Claim, found: Finding, numbers: dict[Claim, int]) -> list[str]:
    """The rule, whose fact it is, the mechanism if the claim does not hold, and the note."""
    lines = []
    if found.rule and found.verdict != UNTESTABLE:
        lines.append(f"Holds if {found.rule}.")
    if found.verdict == FAILS and found.small:
        lines.append("It fails because no effect large enough to count is left, not by a sign of its own.")
    if found.remark:
        lines.append(found.remark)
    if claim.repeats is not None:
        number = numbers[claim.repeats]
        lines.append(f"No vote: the fact is that of [claim {number}](#claim-{number}).")
    if found.waits:
        lines.append(f"Too few training seeds for a verdict: {FEWEST_SEEDS} are needed.")
    if found.verdict in (FAILS, CONTRADICTS, COMPARED) and claim.why:
        lines.append(f"Why: {claim.why}")
    elif found.verdict == FAILS and claim.command:
        lines.append("Why: no experiment has separated that yet.")
    return lines + [claim.note] if claim.note else lines


def section(claim: Claim, found: Finding, numbers: dict[Claim, int]) -> str:
    """A claim as Markdown; numbers : of all claims."""
    number = numbers[claim]
    head = [
        f'<a id="claim-{number}"></a>',
        "",
        f"### {number}. {claim.statement}",
        "",
        f"{claim.where}. {claim.kind[0].upper()}{claim.kind[1:]}. **{found.verdict[0].upper()}{found.verdict[1:]}.**",
    ]
    if found.verdict == NO_RUNS:
        return "\n".join([*head, "", f"Not run yet: `{claim.command}` ({found.rule} is lacking)", ""])
    source = f"`{claim.command}`" if claim.command else "From the paper and this project's tables alone."
    words = " ".join(explanation(claim, found, numbers))
    return "\n".join([*head, "", *table(found.rows), "", *([words, ""] if words else []), source, ""])


def votes(findings: dict[Claim, Finding], kind: str) -> Counter:
    """Facts of a kind by verdict."""
    return Counter(found.verdict for claim, found in findings.items() if claim.kind == kind and claim.repeats is None)


def contents(findings: dict[Claim, Finding], numbers: dict[Claim, int]) -> str:
    """Facts by kind and verdict, claims by verdict, and the themes, as tables."""
    shown = [verdict for verdict in VERDICTS if any(found.verdict == verdict for found in findings.values())]
    facts = sum(claim.repeats is None for claim in findings)
    lines = [
        f"{len(findings)} claims on {facts} facts:",
        "",
        "| kind | facts | " + " | ".join(shown) + " | that is |",
        "|---" * (len(shown) + 3) + "|",
    ]
    for kind, meaning in KINDS.items():
        counts = votes(findings, kind)
        cells = [kind, str(counts.total()), *(str(counts[verdict] or "") for verdict in shown), meaning]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", "| verdict | claims | | that is |", "|---|---|---|---|"]
    for verdict in shown:
        of_it = [numbers[claim] for claim, found in findings.items() if found.verdict == verdict]
        links = " ".join(f"[{number}](#claim-{number})" for number in of_it)
        lines.append(f"| {verdict} | {len(of_it)} | {links} | {MEANING[verdict]} |")
    lines += ["", "| theme | claims |", "|---|---|"]
    for theme in THEMES:
        first, last = numbers[theme.CLAIMS[0]], numbers[theme.CLAIMS[-1]]
        lines.append(f"| [{theme.TITLE}](#claim-{first}) | {first} - {last} |")
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
    """The document, and the number of facts by verdict."""
    evidence = Evidence(results)
    claims = [claim for theme in THEMES for claim in theme.CLAIMS]
    numbers = {claim: number for number, claim in enumerate(claims, start=1)}
    findings = {claim: judge(claim, evidence) for claim in claims}
    known = {claim: (numbers[claim], findings[claim]) for claim in claims}
    ten = "## Ten sentences\n\n" + summary.sentences(known, votes(findings, DIRECTION))
    parts = [HEAD, ten, INTRODUCTION, contents(findings, numbers)]
    for theme in THEMES:
        parts += [f"## {theme.TITLE}\n", *(section(claim, findings[claim], numbers) for claim in theme.CLAIMS)]
    last = "## What has been run\n\n`python analysis/reproduce.py` makes all, and goes on where it stopped.\n\n"
    left_out = "".join(f"\nLeft out: {line}\n" for line in results.left_out)
    text = "\n".join([*parts, last + progress(results) + "\n"]) + left_out
    return text, sum((votes(findings, kind) for kind in KINDS), Counter())


def folder_of(args: Args) -> Path:
    """Where the document goes: the project's own is of the archive alone."""
    if args.runs_dir:
        return args.runs_dir[0]
    return paths.results(quick=True) if args.quick else Path("docs")


def main(args: Args) -> None:
    """Write the document; print how many claims have which verdict."""
    path = args.output or folder_of(args) / "reproduction.md"
    paths.make_file_writable("--output", path)
    results = Results.load(args.quick, args.runs_dir or (paths.there(paths.archive(args.quick)),))
    text, counts = document(results)
    with protocol.replacing(path) as file:
        file.write(text.encode())
    of_each = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
    print(f"{path}: {counts.total()} facts that the paper claims or that we asked about; {of_each}")


if __name__ == "__main__":
    main(protocol.parse(Args))
