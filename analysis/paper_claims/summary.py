"""What the paper's reader should know, in ten sentences, each made of a finding."""

from collections import Counter
from dataclasses import dataclass

from analysis.paper_claims import asymmetry, curriculum, mechanisms, paper_itself, performance, preference
from analysis.paper_claims.claim import CONTRADICTS, DIRECTION, FAILS, HOLDS, QUARTER, Claim, Finding, Number


@dataclass(frozen=True)
class Sentence:
    """A sentence on a claim: how it reads if the claim holds, if it does not, and if that is open.

    row : the line of the claim's table whose numbers stand behind it; beside : another that has to be read with it.
    """

    claim: Claim
    row: str
    holds: str
    fails: str
    otherwise: str
    beside: str = ""

    def text(self, number: int, found: Finding) -> str:
        """The sentence; number : the claim's."""
        words = self.holds if found.verdict == HOLDS else self.otherwise
        words = self.fails if found.verdict in (FAILS, CONTRADICTS) else words
        row = next((row for row in found.rows if row.what == self.row), None)
        numbers = "not run yet"
        if row is not None:
            over = f" over {row.ours.basis}" if isinstance(row.ours, Number) and row.ours.basis else ""
            numbers = f"{row.what}: {row.ours}{over}" + (f", the paper's {row.paper}" if row.paper else "")
            numbers += "".join(f"; {other.what}: {other.ours}" for other in found.rows if other.what == self.beside)
        return f"{words} ({numbers}; [claim {number}](#claim-{number}))."


SENTENCES = (
    Sentence(
        performance.VALUES[performance.GATED],
        "scalarised return",
        *("Returns are of two simulators, so their levels say nothing: what can be compared are gains and signs",) * 3,
    ),
    Sentence(
        performance.curriculum_beats_gated,
        "scalarised, Curriculum less Gated",
        "Choosing sites pays: Curriculum PPO is better than PPO Gated",
        "Choosing sites pays less than 25 points of score here, if anything: Curriculum PPO is not shown to be better "
        "than PPO Gated",
        "Whether choosing sites pays is open",
    ),
    Sentence(
        performance.gated_beats_heuristics,
        "PPO Gated less the best of them",
        "PPO Gated is better than each of the paper's fixed strategies",
        "PPO Gated is no better than the best of the paper's fixed strategies, which look at nothing or at the density "
        "alone",
        "Whether PPO Gated is better than each of the paper's fixed strategies hangs on whether those obey masks, "
        "which the paper does not say",
        beside=performance.OBEYING,
    ),
    Sentence(
        preference.curriculum_follows,
        "carbon return, weight 1 less weight 0",
        "Curriculum PPO follows the preference in both returns",
        "Curriculum PPO does not follow the preference in both returns",
        "Whether Curriculum PPO follows the preference in both returns is open",
    ),
    Sentence(
        asymmetry.asymmetry,
        "carbon less thaw",
        "Fixed λ EUPG learns carbon better than thaw, by agents of equal seeds",
        "Fixed λ EUPG learns carbon no better than thaw",
        "Whether Fixed λ EUPG learns carbon better than thaw is open",
        beside=asymmetry.NOT_PAIRED,
    ),
    Sentence(
        asymmetry.physics_hides_thaw,
        asymmetry.MISSED,
        "On a single site thaw is not learnt even with a baseline: its delay is enough to hide it",
        "Delay alone does not hide thaw: on single sites the same agents learn what a constant plan gains of it once "
        "eight episodes share an update and their mean is taken off",
        "Whether delay alone hides thaw is open",
    ),
    Sentence(
        curriculum.coin,
        "difference, paired by seed",
        "Selecting by site is worth more than selecting by a coin",
        "Selecting by site beats selecting by a coin by less than 25 points of score, if at all",
        "Whether selecting by site is worth more than selecting by a coin is open",
    ),
    Sentence(
        mechanisms.stems,
        mechanisms.WITHOUT_SNOW,
        "Stems store carbon, help permafrost by the snow that they catch and harm it by what they absorb",
        "The paper says that dense stands store carbon, help permafrost by the snow that they catch (its table says "
        "the opposite) and can harm it by what they absorb; not all of it holds here",
        "That planted stems store carbon and help permafrost by the snow that they catch, as the paper's introduction "
        "says (its table says the opposite), holds; whether the rest of what they do harms it hangs on the wind",
        beside=mechanisms.IN_WEAK_WIND,
    ),
    Sentence(
        paper_itself.heuristic_hypervolumes,
        "hypervolume, Zero change (scalarised −2.5)",
        *(
            "The paper computes its hypervolumes over 100 episodes a weight, and does not say of which points; those "
            "of its heuristics cannot be of mean returns",
        )
        * 3,
    ),
)


A_TENTH = 0.1  # instead of QUARTER


def counted(verdicts: Counter, reached: list[float]) -> str:
    """The first sentence: how the directions came out, a vote a fact; reached : of the facts that fail by no large
    effect alone, the share of the smallest that counts which the interval reaches."""
    small, open_by_less = len(reached), sum(share >= A_TENTH / QUARTER for share in reached)
    open_ = verdicts.total() - verdicts[HOLDS] - verdicts[FAILS]
    numbers = verdicts[FAILS] - small
    return (
        f"We read {verdicts.total()} facts in the paper on what comes out ahead or which way a mechanism works. Here "
        f"{verdicts[HOLDS]} hold, {verdicts[FAILS]} do not, and {open_} are open or cannot be tested. Of the "
        f"{verdicts[FAILS]} that do not, {numbers} fail since our numbers say otherwise, and {small} since what is "
        f"left of the effect is too small: less than a quarter (of a ratio of spreads a tenth) of what [its "
        f"rule](#how-it-is-judged) measures it by. "
        f"If a tenth counted, {open_by_less} of these {small} would be open."
    )


def sentences(findings: dict[Claim, tuple[int, Finding]], directions: Counter) -> str:
    """All of them as a list; findings : a claim's number and finding."""
    voting = [found for claim, (_, found) in findings.items() if claim.kind == DIRECTION and claim.repeats is None]
    reached = [found.reached for found in voting if found.verdict == FAILS and found.small]
    lines = [counted(directions, reached), *(one.text(*findings[one.claim]) for one in SENTENCES)]
    return "".join(f"{number}. {line}\n" for number, line in enumerate(lines, start=1))
