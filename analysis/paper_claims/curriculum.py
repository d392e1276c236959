"""Section 4.3 and the appendix on the curriculum: is it the selection that helps, and what is selected."""

import pandas as pd

from analysis.paper_claims.claim import (
    CONTROL,
    LEAST,
    QUARTER,
    UNTESTABLE,
    Finding,
    Number,
    Row,
    above,
    all_of,
    below,
    claim,
    finding,
    share,
)
from analysis.paper_claims.evidence import SEEDS, difference, only, optional, seeds
from analysis.paper_claims.performance import CURRICULUM, GATED, curriculum_beats_gated, scalarised
from analysis.tables import curriculum_selection

TITLE = "What of the curriculum it is that helps"
CONTROLS, MAIN, SELECTION = only("main", "controls"), only("main"), only("main", "mechanisms")


def control(evidence, script: str, **flags) -> pd.Series:
    """Scalarised return of a control, by training seed."""
    return evidence.metric("scalarized", "controls", script, **flags)


def compared(name: str, first: pd.Series, other: str, second: pd.Series):
    """The finding on a difference of two rows."""
    apart = difference(first, second)
    common = first.index.intersection(second.index)
    rows = [
        Row(f"scalarised, {name}", "", seeds(first[common])),
        Row(f"scalarised, {other}", "", seeds(second[common])),
        Row("difference, paired by seed", "", apart),
    ]
    return finding(rows, above(apart, least=LEAST, what="the difference"))


@claim(
    "Even a random selection of sites brings significant benefits: at the same number of years trained on.",
    "Curriculum mechanism (our control)",
    CONTROLS,
    note="The curriculum trains on about half of its episodes: without selection the agent has half the budget. "
    "At the same budget of simulation the two are compared above.",
    kind=CONTROL,
    repeats=curriculum_beats_gated,
)
def same_training(evidence):
    return compared(
        "Curriculum",
        scalarised(evidence, CURRICULUM),
        "no selection, half the budget",
        control(evidence, GATED, budget=0.5),
    )


@claim(
    "It is the site that the selection has to go by: a coin would not do.",
    "Section 4.4 (our control)",
    CONTROLS,
    why="A random network of the site is a coin too, tossed once for each site, and sites do not come back.",
    note="The control selects every episode by a coin, with the same threshold.",
    kind=CONTROL,
    repeats=curriculum_beats_gated,
)
def coin(evidence):
    return compared(
        "Curriculum",
        scalarised(evidence, CURRICULUM),
        "selection by a coin",
        control(evidence, CURRICULUM, selector="coin"),
    )


@claim(
    "A fixed, randomly initialised network is enough to select sites.",
    "Curriculum mechanism",
    CONTROLS,
    why="A raw random network puts nearly all sites on one side of the threshold, which side depends on its seed.",
    note="Raw networks are of our size and initial weights; the paper names none. Ours are centred and scaled over "
    "sampled sites.",
)
def raw_network(evidence):
    raw = evidence.by_seed(share_selected, "controls", CURRICULUM, raw_selector=True)["share"]
    centred = evidence.by_seed(share_selected, "main", CURRICULUM)["share"]
    splits = share(int(((raw > 0.1) & (raw < 0.9)).sum()), len(raw), SEEDS)
    rows = [
        Row("episodes selected %, lowest of the raw networks", "", Number(100 * raw.min())),
        Row("episodes selected %, highest of the raw networks", "", Number(100 * raw.max())),
        Row("share of raw networks that select a tenth to nine tenths", "", splits),
        Row("episodes selected %, centred and scaled", "", seeds(100 * centred)),
        Row(
            "scalarised, raw less centred",
            "",
            optional(
                lambda: difference(control(evidence, CURRICULUM, raw_selector=True), scalarised(evidence, CURRICULUM))
            ),
        ),
    ]
    return finding(rows, above(splits, 0.5, what="the share that splits the sites"))


def share_selected(one) -> dict:
    """Share of a run's training episodes that were trained on."""
    return {"share": one.runs[0].share_selected}


@claim(
    "More data would not help as selection does.",
    "Section 4.3 (our control)",
    CONTROLS,
    why="The curriculum is compared here with the same agent, without selection and with twice the budget.",
    kind=CONTROL,
    repeats=curriculum_beats_gated,
)
def more_data(evidence):
    return compared(
        "Curriculum",
        scalarised(evidence, CURRICULUM),
        "no selection, twice the budget",
        control(evidence, GATED, budget=2.0),
    )


def selection(evidence, column: str) -> dict[str, Number]:
    """Means by training seed of a column of the table of selected sites: accepted, rejected and their difference."""
    sites = evidence.study("site_warming")
    name = {ours: theirs for theirs, ours in curriculum_selection.NUMBERS.items()}[column]
    means = {
        category: sites[sites.selected == selected].groupby("seed")[name].mean()
        for category, selected in curriculum_selection.CATEGORIES.items()
    }
    means["accepted less rejected"] = means["accepted"] - means["rejected"]
    return {category: seeds(values) for category, values in means.items()}


@claim(
    "Accepted sites lie north, rejected ones south of 60° N.",
    "Table of curriculum selection",
    SELECTION,
    why="A network with random weights knows nothing of latitude; which way it leans is its seed's, and over seeds "
    "accepted and rejected sites are alike.",
)
def accepted_lie_north(evidence):
    latitude = selection(evidence, "latitude")
    rows = [
        Row("latitude of accepted sites", "above 60", latitude["accepted"]),
        Row("latitude of rejected sites", "below 60", latitude["rejected"]),
        Row("accepted less rejected", "above 0", latitude["accepted less rejected"]),
    ]
    accepted = above(latitude["accepted"], 60, what="accepted")
    return finding(rows, all_of(accepted, below(latitude["rejected"], 60, what="rejected")))


@claim(
    "Accepted sites would hardly warm, rejected ones strongly.",
    "Table of curriculum selection",
    SELECTION,
    why="The selector sees parameters, not heat; its weights are random and never trained.",
)
def accepted_are_safe(evidence):
    warming, thaw = selection(evidence, "warming"), selection(evidence, "thaw")
    apart = warming["accepted less rejected"]
    rows = [
        Row("warming of accepted sites, left alone [MJ/m2/yr]", "about 0.5", warming["accepted"]),
        Row("warming of rejected sites", "about 8.0", warming["rejected"]),
        Row("accepted less rejected", "−7.5", apart),
        Row("thaw return of zero change, accepted less rejected", "", thaw["accepted less rejected"]),
    ]
    return finding(rows, below(apart, least=QUARTER * 7.5, what="the difference"))


@claim(
    "The threshold breathes: training expands and contracts with the agent's competence.",
    "Curriculum mechanism",
    MAIN,
    note="The paper moves the threshold by a thousandth, and does not say how often; once a rollout, as here, it "
    "cannot move far within the budget. It moves up and down with the coin, too, which knows of no competence: that "
    "would have to be measured at every move.",
)
def threshold_breathes(evidence):
    table = evidence.by_seed(breathing, "main", CURRICULUM)
    change = seeds(table["range"])
    rows = [
        Row("episodes that score between the lowest and the highest threshold, in points", "", change),
        Row("lowest threshold", "", seeds(table.lowest)),
        Row("highest threshold", "", seeds(table.highest)),
        Row("moves up, of all moves %", "both ways", seeds(table.up)),
        Row(
            "the same of selection by a coin",
            "",
            optional(lambda: seeds(evidence.by_seed(breathing, "controls", CURRICULUM, selector="coin")["up"])),
        ),
    ]
    return Finding(rows, UNTESTABLE)


def breathing(one) -> dict:
    """How the threshold of a run moved, and with it the share of its episodes that score above it."""
    (row,) = one.runs[0].tables["selection"].itertuples()
    return {
        "lowest": row.lowest_threshold,
        "highest": row.highest_threshold,
        "range": 100 * row.between / row.episodes,
        "up": 100 * row.moves_up / row.moves if row.moves else 0.0,
    }


CLAIMS = (same_training, coin, raw_network, more_data, accepted_lie_north, accepted_are_safe, threshold_breathes)
