"""One of the two stands: who manages it, its picture, its returns."""

import functools
from collections.abc import Callable

import panel as pn

from analysis.exploring import style
from analysis.exploring.charts import COLOURS, SPECIES, STOCKS, AgeBars, StockAreas, drawing
from analysis.exploring.players import STRATEGIES, Player, action_of, constant, trained
from analysis.exploring.stands import YEARS, Setting, Stand
from sim.management import CONIFER_MIXES, DENSITY_CHANGES
from sim.task.picture import View

CONSTANT, BY_HAND, OTHER_RUN = "One action, every year", "You, year by year", "The policy of a run's folder"
CHANGES = {
    f"{'plant' if change > 0 else 'cut'} {abs(change):.0f} stems/ha" if change else "neither plant nor cut": change
    for change in reversed(DENSITY_CHANGES)
}
MIXES = {f"{100 * mix:.0f} % conifers": mix for mix in CONIFER_MIXES}
HINT = "Only a part of that can be done now, and that costs a penalty."
PENALTIES = ("biomass_limit_penalty", "soil_limit_penalty", "density_penalty", "ineffective_penalty")
LEGEND = {**SPECIES, **{name: colour for name, (_, colour) in STOCKS.items()}}
GREEDY = {"most likely action": True, "action by chance": False}


class StandCard:
    """Controls and picture of a stand; `changed` is called with the card when somebody else manages the stand."""

    def __init__(self, letter: str, conifers: float, runs: list[str], changed: Callable[["StandCard"], None]):
        """conifers : share of them among the trees that are planted every year, to begin with."""
        self.letter, self.runs = letter, runs
        self.stand: Stand | None = None
        self.player: Player | None = None
        self.policy = pn.widgets.Select(
            label="Who manages it", options=[CONSTANT, BY_HAND, *STRATEGIES, *runs, OTHER_RUN]
        )
        self.change = pn.widgets.Select(label="Each year", options=CHANGES)
        self.mix = pn.widgets.Select(label="of which", options=MIXES, value=conifers)
        self.folder = pn.widgets.TextInput(
            label="Folder of the run", placeholder="runs/ppo_group/boreal-generalist-v0/seed1"
        )
        self.greedy = pn.widgets.RadioButtonGroup(options=GREEDY, margin=(5, 10))
        self.preference = pn.widgets.FloatSlider(
            label="Preference: weight of carbon (the rest is thaw's)", start=0.0, end=1.0, step=0.05, value=0.5
        )
        self.hint = pn.pane.HTML(HINT, margin=(0, 10), visible=False)
        self.picture = pn.pane.PNG(sizing_mode="scale_width", margin=0)
        self.numbers = pn.pane.HTML(stylesheets=[style.NUMBERS])
        self.ages, self.stocks = AgeBars(), StockAreas()
        for widget in (self.policy, self.change, self.mix, self.folder, self.greedy):
            widget.param.watch(lambda _: self.take(changed), "value")
        self.preference.param.watch(lambda _: changed(self), "value_throttled")
        self.show_controls()

    @property
    def by_hand(self) -> bool:
        """Whether the user chooses each year's action."""
        return self.policy.value == BY_HAND

    def layout(self) -> pn.Column:
        """The card."""
        return pn.Column(
            pn.pane.HTML(style.heading(f"Stand {self.letter}", COLOURS[self.letter]), margin=(0, 10)),
            self.policy,
            pn.Row(self.change, self.mix),
            self.hint,
            self.folder,
            self.greedy,
            self.preference,
            self.picture,
            self.numbers,
            pn.pane.Bokeh(self.ages.figure),
            pn.pane.Bokeh(self.stocks.figure),
            styles={**style.CARD, "border-top": f"4px solid {COLOURS[self.letter]}", "flex": "1 1 330px"},
        )

    def show_controls(self) -> None:
        """Only those that matter to who manages the stand."""
        chosen = self.policy.value
        self.change.visible = self.mix.visible = chosen in (CONSTANT, BY_HAND)
        self.change.label = "This year" if self.by_hand else "Each year, if possible"
        self.folder.visible = chosen == OTHER_RUN
        self.greedy.visible = chosen in (*self.runs, OTHER_RUN)
        self.hint.visible = self.by_hand and self.stand is not None and not self.stand.masks[self.action]

    def take(self, changed) -> None:
        """Somebody else manages the stand, or otherwise. By hand it begins with what was done before."""
        self.show_controls()
        if not self.by_hand:
            # after this event: the browser sends two of a text that is entered, and charts hear the later one
            pn.state.execute(functools.partial(changed, self), schedule=True)

    def played(self, setting: Setting, years: int) -> tuple[Stand, Player]:
        """A new stand after so many years, managed as is chosen, or by hand as it was. Raises what `trained` does."""
        stand = Stand(setting, self.preference.value)
        player = self.chosen(stand)
        before = self.stand.actions if self.by_hand and self.stand else []
        for year in range(years):
            stand.step(before[year] if before else player(stand))
        return stand, player

    def begin(self, stand: Stand, player: Player) -> None:
        """Go on with this stand."""
        self.stand, self.player = stand, player

    def chosen(self, stand: Stand) -> Player:
        """Who manages it now."""
        name = self.policy.value
        if name in STRATEGIES:
            return STRATEGIES[name]
        if name == CONSTANT:
            return constant(self.action)
        if name == BY_HAND:
            return lambda _: self.action
        if name == OTHER_RUN and not self.folder.value:
            raise ValueError(f"stand {self.letter}: type the folder of the run, and Enter")
        return trained(self.folder.value if name == OTHER_RUN else name, stand, self.greedy.value)

    @property
    def action(self) -> int:
        """What is chosen by hand, or for every year."""
        return action_of(self.change.value, self.mix.value)

    def forward(self) -> None:
        """A year on."""
        self.stand.step(self.action if self.by_hand else self.player(self.stand))

    def show(self, alone: Stand, tops: tuple[float, float]) -> None:
        """Picture and numbers of the year looked at; tops : of the axes, the same for both stands."""
        self.show_controls()
        view = self.stand.view()
        self.picture.object = drawing(view)
        self.numbers.object = numbers(self.stand, alone) + events(view) + style.squares(LEGEND)
        self.ages.show(view, tops[0])
        self.stocks.show(self.stand.whole_view(), self.stand.year, tops[1])


def numbers(stand: Stand, alone: Stand) -> str:
    """Both returns and the weighted sum, beside what they are above those of the stand left alone."""
    gains = stand.returns - alone.returns
    rows = [
        f"<tr><td>{name}, weight {weight:.2f}</td><td>{signed(total)}</td><td>{signed(gain)}</td></tr>"
        for name, weight, total, gain in zip(("Carbon", "Thaw"), stand.weights, stand.returns, gains, strict=True)
    ]
    head = f"<tr><th>After {stand.year} of {YEARS} years</th><th>return</th><th>gain</th></tr>"
    total, gain = stand.weights @ stand.returns, stand.weights @ gains
    last = f"<tr class=sum><td>Weighted sum</td><td>{signed(total)}</td><td>{signed(gain)}</td></tr>"
    return f"<table>{head}{''.join(rows)}{last}</table>"


def signed(number: float) -> str:
    """With its sign, to two places."""
    return f"{number:+.2f}".replace("-", "−")


def events(view: View) -> str:
    """The trees, and what happened to them in the year looked at."""
    density = view.stems.sum()
    conifers = f"{100 * view.stems[0].sum() / density:.0f} % conifers" if density > 0.0 else "no trees"
    stems = {"planted": "planted", "cut": "thinned", "came by themselves": "recruited", "died": "dead"}
    moved = [
        f"{what} {view.last(f'{k}_stems_ha'):.0f}" for what, k in stems.items() if view.last(f"{k}_stems_ha") >= 0.5
    ]
    said = [f"{', '.join(moved)} stems/ha"] if moved else []
    killed = {name: 100 * view.last(f"{name}_mortality") for name in ("fire", "insect")}
    said += [f"{name}{'s' * (name == 'insect')} killed {share:.0f} %" for name, share in killed.items() if share > 0.0]
    penalty = sum(view.last(name) for name in PENALTIES)
    said += [f"penalty {signed(-penalty)} carbon"] * (penalty > 0.0)
    year = f"<p>This year: {' · '.join(said)}</p>" if said else ""
    return f"<p>{density:.0f} stems/ha · {conifers}</p>{year}"
