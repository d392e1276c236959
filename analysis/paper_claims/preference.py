"""Section 4.3 and the appendix on λ-monotonicity: whether a policy follows the preference, and better than chance."""

import pandas as pd

from analysis.paper_claims.claim import Missing, Row, about, above, all_of, below, claim, finding, opposite, short
from analysis.paper_claims.evidence import difference, main_metrics, only, optional, seeds
from analysis.paper_claims.performance import CURRICULUM, EUPG, GATED
from analysis.results import METHODS as PAPER_NAMES
from analysis.results import TITLES
from analysis.tables.common import paper
from analysis.tables.lambda_violations import violations

TITLE = "Following the preference"
MAIN = only("main")


def change(evidence, name: str, experiment: str, script: str, **flags) -> pd.Series:
    """Change of a return from weight 0 to 1 by training seed; 0 of a policy that does the same at every weight."""
    table = evidence.by_seed(main_metrics, experiment, script, **flags)
    return table.reindex(columns=[f"{name}_change"]).iloc[:, 0].fillna(0.0)


def follows(evidence, experiment: str, script: str, **flags):
    """Change of both returns from weight 0 to 1, and whether both have the sign that the preference asks for.

    Not, if zero is in an interval and the change of the paper's curriculum is not.
    """
    carbon, thaw = (seeds(change(evidence, name, experiment, script, **flags)) for name in ("carbon", "thaw"))
    papers = paper_change(CURRICULUM)
    return carbon, thaw, all_of(above(carbon, papers=papers[0], what="carbon's change"),
                                below(thaw, papers=papers[1], what="thaw's change"))  # fmt: skip


def paper_change(script: str) -> tuple[float, float]:
    """The same change in the paper's details."""
    table = paper("detailed_objectives", index_col="method").loc[PAPER_NAMES[script]].sort_values("lambda_carbon")
    return tuple(table[f"{name}_mean"].iloc[-1] - table[f"{name}_mean"].iloc[0] for name in ("carbon", "thaw"))


@claim("Curriculum PPO follows the preference.", "Figure 3d; table of detailed objectives", MAIN,
       why="Advantages of the weighted sum are normalised as a whole, and are mostly the thaw return's scatter between "
           "sites; normalised for each objective apart, the preference reaches the policy.")
def curriculum_follows(evidence):
    carbon, thaw, answer = follows(evidence, "main", CURRICULUM)
    papers = paper_change(CURRICULUM)
    rows = [Row("carbon return, weight 1 less weight 0", short(papers[0]), carbon),
            Row("thaw return, weight 1 less weight 0", short(papers[1]), thaw)]
    rows += [Row(f"{name} of PPO Gated with per-objective advantages", "", optional(lambda name=name: seeds(
        change(evidence, name, "variants", GATED, ent_coef=0.0, per_objective_advantages=True))))
        for name in ("carbon", "thaw")]  # fmt: skip
    return finding(rows, answer)


@claim("Standard preference-conditioned PPO fails to follow the preference.", "Abstract; section 4.3", MAIN,
       why="It follows here, however little.")
def gated_does_not_follow(evidence):
    carbon, thaw, answer = follows(evidence, "main", GATED)
    papers = paper_change(GATED)
    rows = [Row("carbon return, weight 1 less weight 0", short(papers[0]), carbon),
            Row("thaw return, weight 1 less weight 0", short(papers[1]), thaw)]
    return finding(rows, opposite(answer))


@claim("Thaw is hard for its asymmetry and physics, not for a difference in the rewards' magnitude.",
       "Appendix, reward function", only("main", "balanced"),
       why="With the carbon scale at which policies move both returns alike, the preference does reach the policy.")
def magnitude_does_not_matter(evidence):
    balanced = {"env_id": "boreal-balanced-v0"}
    carbon, thaw, answer = follows(evidence, "balanced", GATED, **balanced)
    rows = [Row("carbon return of PPO Gated, weight 1 less weight 0, in `boreal-balanced-v0`", "", carbon),
            Row("thaw return, the same", "", thaw)]
    rows += [Row(f"{name} return in `boreal-generalist-v0`", "",
                 optional(lambda name=name: seeds(change(evidence, name, "main", GATED))))
             for name in ("carbon", "thaw")]  # fmt: skip
    return finding(rows, opposite(answer))


def violation(evidence, script: str, name: str = "violations_percent") -> pd.Series:
    """Violations of a script's runs by training seed [%]."""
    experiment = "fixed" if script == "eupg_fixed_lambda" else "main"
    table = evidence.by_seed(violations, experiment, script)
    if name not in table:
        raise Missing("a policy that differs between weights")
    return table[name].dropna()


@claim("Curriculum PPO violates λ-monotonicity least (50 %).", "Appendix, λ-monotonicity", MAIN,
       why="Policies that hardly differ between weights are put in order by chance.",
       note="In random order: the same points, shuffled. Beyond their interval: only changes larger than their paired "
            "interval over episodes count.")
def curriculum_violates_least(evidence):
    rows, printed = [], paper("monotonicity_violations", index_col="method").violations_percent
    for script in (CURRICULUM, GATED, EUPG, "eupg_fixed_lambda"):
        for name, what in (("violations_percent", ""), ("noise_violations_percent", ", in random order"),
                           ("significant_violations_percent", ", beyond their interval")):  # fmt: skip
            papers = "" if what else f"{printed[PAPER_NAMES[script]]:g}"
            ours = optional(lambda script=script, name=name: seeds(violation(evidence, script, name)))
            rows.append(Row(f"violations %, {TITLES[script]}{what}", papers, ours))
    answers = []
    for other in (GATED, EUPG):
        papers = printed[PAPER_NAMES[CURRICULUM]] - printed[PAPER_NAMES[other]]
        apart = difference(violation(evidence, CURRICULUM), violation(evidence, other))
        rows.append(Row(f"Curriculum less {TITLES[other]}", short(papers), apart))
        answers.append(below(apart, papers=papers, what="each difference"))
    return finding(rows, all_of(*answers))


@claim("PPO Gated violates λ-monotonicity in every pair of weights.", "Appendix, λ-monotonicity", MAIN,
       why="A policy that ignores the preference violates three pairs of four by chance if its returns are "
           "independent, more if they rise and fall together between weights.")
def gated_always_violates(evidence):
    ours = seeds(violation(evidence, GATED))
    papers = paper("monotonicity_violations", index_col="method").violations_percent["ppo_gated"]
    rows = [Row("violations %", short(papers), ours),
            Row("in random order %", "", seeds(violation(evidence, GATED, "noise_violations_percent")))]
    return finding(rows, about(ours, papers))


@claim("Curriculum PPO's preference control is better than chance.", "Appendix, λ-monotonicity", MAIN,
       why="The policy hardly differs between weights.")
def curriculum_beats_chance(evidence):
    apart = difference(violation(evidence, CURRICULUM), violation(evidence, CURRICULUM, "noise_violations_percent"))
    return finding([Row("violations %, less those in random order", "", apart)], below(apart, what="the difference"))


CLAIMS = (curriculum_follows, gated_does_not_follow, magnitude_does_not_matter, curriculum_violates_least,
          gated_always_violates, curriculum_beats_chance)  # fmt: skip
