"""Section 4.3 and the appendix on λ-monotonicity: whether a policy follows the preference, and better than chance."""

from dataclasses import replace

import pandas as pd

from analysis import methods, metrics
from analysis.experiments import GENERALIST
from analysis.paper_claims.claim import (
    CONTROL,
    LEAST,
    QUARTER,
    Answer,
    Number,
    Row,
    Undefined,
    about,
    above,
    all_of,
    below,
    claim,
    finding,
    opposite,
    short,
)
from analysis.paper_claims.evidence import (
    EUPG,
    WITH_EUPG,
    difference,
    main_metrics,
    mean_of,
    only,
    optional,
    seeds,
    unpaired,
)
from analysis.paper_claims.mechanisms import gains_of
from analysis.paper_claims.performance import CURRICULUM, GATED
from analysis.tables.common import paper
from analysis.tables.lambda_violations import violations
from cleanrl_style.protocol import reference, sites

TITLE = "Following the preference"
MAIN = only("main")
NO_ENTROPY = {"ent_coef": 0.0, "per_objective_advantages": None}  # None: without this flag
APART = {"ent_coef": 0.0, "per_objective_advantages": True}


def change(evidence, name: str, experiment: str, script: str, **flags) -> pd.Series:
    """Change of a return from weight 0 to 1 by training seed; 0 of a policy that does the same at every weight."""
    table = evidence.by_seed(main_metrics, experiment, script, **flags)
    return table.reindex(columns=[f"{name}_change"]).iloc[:, 0].fillna(0.0)


def follows(evidence, experiment: str, script: str, **flags):
    """Change of both returns from weight 0 to 1, and whether both have the sign that the preference asks for."""
    carbon, thaw = (seeds(change(evidence, name, experiment, script, **flags)) for name in ("carbon", "thaw"))
    least = {name: QUARTER * abs(change_of_plans(name).mean()) for name in ("carbon", "thaw")}
    return (
        carbon,
        thaw,
        all_of(
            above(carbon, least=least["carbon"], what="carbon's change"),
            below(thaw, least=least["thaw"], what="thaw's change"),
        ),
    )


def change_of_plans(name: str) -> pd.Series:
    """The same change of the best constant plans on each test site: what can be had without looking."""
    plans, _ = reference.read(reference.shipped(GENERALIST))
    plans = plans[plans.seed.isin(sites.published_seeds("test"))]
    best = metrics.best_constant_plans(plans, metrics.pair([0.0, 1.0]))
    of_site = best.pivot(index="seed", columns="preference", values=f"{name}_return")
    return of_site[1.0] - of_site[0.0]


def paper_change(script: str) -> tuple[float, float]:
    """The same change in the paper's details."""
    table = (
        paper("detailed_objectives", index_col="method").loc[methods.paper_name(script)].sort_values("lambda_carbon")
    )
    return tuple(table[f"{name}_mean"].iloc[-1] - table[f"{name}_mean"].iloc[0] for name in ("carbon", "thaw"))


def changes(evidence, script: str) -> tuple[list[Row], Answer]:
    """Lines of how far a method's returns follow the preference, beside the paper's, and whether they do."""
    carbon, thaw, answer = follows(evidence, "main", script)
    papers = paper_change(script)
    return [
        Row("carbon return, weight 1 less weight 0", short(papers[0]), carbon),
        Row("thaw return, weight 1 less weight 0", short(papers[1]), thaw),
        *(
            Row(f"{name}, the best constant plans", "", mean_of(change_of_plans(name), "test sites"))
            for name in ("carbon", "thaw")
        ),
    ], answer


@claim("Curriculum PPO follows the preference.", "Figure 3d; table of detailed objectives", only("main", "variants"))
def curriculum_follows(evidence):
    rows, answer = changes(evidence, CURRICULUM)
    return finding(rows + apart_rows(evidence), answer)


def apart_rows(evidence) -> list[Row]:
    """Lines of gated PPO without entropy bonus, and then with advantages of each objective apart too."""
    return [
        Row(
            f"{name}, PPO Gated with {what}",
            "",
            optional(lambda name=name, flags=flags: seeds(change(evidence, name, "variants", GATED, **flags))),
        )
        for what, flags in (("`--ent-coef 0`", NO_ENTROPY), ("`--ent-coef 0 --per-objective-advantages`", APART))
        for name in ("carbon", "thaw")
    ]


def fails_to_follow(script: str, statement: str, where: str):
    """The claim that a method does not follow the preference."""

    @claim(statement, where, WITH_EUPG if script == EUPG else MAIN)
    def does_not_follow(evidence):
        rows, answer = changes(evidence, script)
        return finding(rows, opposite(answer))

    return does_not_follow


gated_does_not_follow = fails_to_follow(
    GATED, "Standard preference-conditioned PPO fails to follow the preference.", "Abstract; section 4.3"
)


@claim(
    "Thaw is hard for its asymmetry and physics, not for a difference in the rewards' magnitude.",
    "Appendix, reward function",
    only("main", "thaw", "variants", "balanced"),
    note="The scale of `boreal-balanced-v0`, at which policies move both returns alike, does not make their noise "
    "alike. Raw degree-days change the magnitude of thaw too, so that row does not isolate asymmetry, and decides "
    "nothing.",
)
def magnitude_does_not_matter(evidence):
    symmetric = difference(*(gains_of(evidence, name) for name in ("raw_degree_days", "asymmetric")))
    equal, given = (evidence.by_seed(thaw_alone, "variants", GATED, **flags)["thaw"] for flags in (APART, NO_ENTROPY))
    apart = difference(equal, given)
    rows = [
        Row(
            "thaw return at weight 0, `--ent-coef 0`: with `--per-objective-advantages`, so of equal magnitudes, less "
            "without",
            "no more",
            apart,
        ),
        Row(
            "gain under the asymmetric reward, trained on raw degree-days, without asymmetry, less the default",
            "more",
            symmetric,
        ),
        Row(
            "thaw return at weight 0, Group PPO less PPO Gated, the same reward and physics",
            "",
            optional(lambda: unpaired(*(by_thaw(evidence, script) for script in ("ppo_group", GATED)))),
        ),
        *apart_rows(evidence),
    ]
    rows += [
        Row(
            f"{name}, PPO Gated in `{env}`",
            "",
            optional(
                lambda name=name, experiment=experiment, flags=flags: seeds(
                    change(evidence, name, experiment, GATED, **flags)
                )
            ),
        )
        for env, experiment, flags in (
            ("boreal-generalist-v0", "main", {}),
            ("boreal-balanced-v0", "balanced", {"env_id": "boreal-balanced-v0"}),
        )
        for name in ("carbon", "thaw")
    ]
    return finding(rows, opposite(above(apart, least=LEAST, what="the difference of thaw returns")))


def by_thaw(evidence, script: str) -> pd.Series:
    """Thaw return at weight 0 of the main table's runs, by training seed."""
    return evidence.by_seed(thaw_alone, "main", script)["thaw"]


def thaw_alone(one) -> dict:
    """Thaw return at weight 0."""
    evaluation = one.evaluation
    return {"thaw": evaluation[evaluation.preference == 0].thaw_return.mean()}


def percent(by_seed: pd.Series) -> Number:
    """A percentage over training seeds, whose t interval goes no further than 0 and 100."""
    number = seeds(by_seed)
    return replace(number, t_low=max(number.t_low, 0.0), t_high=min(number.t_high, 100.0))


def violation(evidence, script: str, name: str = "violations_percent") -> pd.Series:
    """Violations of a script's runs by training seed [%]."""
    experiment = "fixed" if script == "eupg_fixed_lambda" else "main"
    table = evidence.by_seed(violations, experiment, script)
    if name == "violations_or_ties_percent":  # a policy that does the same at every weight has ties alone
        return table.reindex(columns=[name])[name].fillna(100.0)
    if name not in table:
        raise Undefined("none: the same returns at every weight")
    return table[name].dropna()


@claim(
    "Curriculum PPO violates λ-monotonicity least (50 %).",
    "Appendix, λ-monotonicity",
    only("main", "variants", "fixed"),
    note="The paper counts a return that fails to increase, ties included, and so does the verdict; without ties, "
    "one that moves the wrong way counts. In random order: the same points, shuffled. Beyond their interval: "
    "only changes larger than their paired interval over episodes count.",
)
def curriculum_violates_least(evidence):
    rows, printed = [], paper("monotonicity_violations", index_col="method").violations_percent
    for script in (CURRICULUM, GATED, EUPG, "eupg_fixed_lambda"):
        for name, what in (
            ("violations_or_ties_percent", ""),
            ("violations_percent", ", without ties"),
            ("noise_violations_percent", ", without ties, in random order"),
            ("significant_violations_percent", ", beyond their interval"),
        ):
            papers = "" if what else f"{printed[methods.paper_name(script)]:g}"
            ours = optional(lambda script=script, name=name: percent(violation(evidence, script, name)))
            rows.append(Row(f"violations %, {methods.title(script)}{what}", papers, ours))
    answers = []
    for other, less in ((GATED, difference), (EUPG, unpaired)):
        papers = printed[methods.paper_name(CURRICULUM)] - printed[methods.paper_name(other)]
        apart = less(*(violation(evidence, script, "violations_or_ties_percent") for script in (CURRICULUM, other)))
        rows.append(Row(f"Curriculum less {methods.title(other)}", short(papers), apart))
        answers.append(below(apart, least=QUARTER * abs(papers), what="each difference"))
    return finding(rows, all_of(*answers))


@claim(
    "PPO Gated violates λ-monotonicity in every pair of weights.",
    "Appendix, λ-monotonicity",
    MAIN,
    why="A policy that ignores the preference violates three pairs of four by chance if its returns are "
    "independent, more if they rise and fall together between weights.",
)
def gated_always_violates(evidence):
    ours = percent(violation(evidence, GATED, "violations_or_ties_percent"))
    papers = paper("monotonicity_violations", index_col="method").violations_percent["ppo_gated"]
    rows = [
        Row("violations %", short(papers), ours),
        Row("without ties, in random order %", "", percent(violation(evidence, GATED, "noise_violations_percent"))),
    ]
    return finding(rows, about(ours, papers))


@claim(
    "Curriculum PPO violates λ-monotonicity less than its own points in random order.",
    "Appendix, λ-monotonicity (our control)",
    MAIN,
    note="That the order of the weights is not a random one is not yet that the preference is followed, which is "
    "judged above.",
    kind=CONTROL,
)
def curriculum_beats_chance(evidence):
    apart = difference(violation(evidence, CURRICULUM), violation(evidence, CURRICULUM, "noise_violations_percent"))
    return finding([Row("violations %, less those in random order", "", apart)], below(apart, what="the difference"))


CLAIMS = (
    curriculum_follows,
    gated_does_not_follow,
    magnitude_does_not_matter,
    curriculum_violates_least,
    gated_always_violates,
    curriculum_beats_chance,
)
