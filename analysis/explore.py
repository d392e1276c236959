"""A page to play with: two stands side by side on the same site, weather and dice.

    pip install -e ".[explore]" && python analysis/explore.py

Choose a site and who manages each stand, then step a year or play fifty. The page is served to this machine alone and
needs no internet. Stands, players, charts and controls are in `analysis/exploring/`; here they come together.
"""

import functools
import html
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from cleanrl_style.flags import fail, parse, require


@dataclass
class Args:
    """Serves the page to this machine until Ctrl-C."""

    port: int = 5006
    """port to serve it on"""
    show: bool = True
    """open it in a browser"""
    runs: Path = Path("runs")
    """folder of runs, whose trained policies can be chosen"""


def check_flags(args: Args) -> None:
    """End the command with one line that names a bad flag."""
    if not 0 < args.port < 65536:
        fail(f"--port {args.port}: 1 to 65535 are allowed")
    if args.runs != Args.runs and not args.runs.is_dir():
        fail(f"--runs {args.runs}: no such folder")


if __name__ == "__main__":
    require("panel", "torch", extra="explore")
    args = parse(Args)  # a bad flag is answered before all that follows is loaded
    check_flags(args)

import numpy as np
import panel as pn

import boreal_env
import sim
from analysis.exploring import style
from analysis.exploring.charts import ALONE, ALONE_COLOUR, COLOURS, Lines, largest_stock, stems_by_age
from analysis.exploring.players import trained_runs
from analysis.exploring.site_controls import SiteControls
from analysis.exploring.sliders import put
from analysis.exploring.stand_card import StandCard
from analysis.exploring.stands import YEARS, Stand

TITLE = "Two stands, one weather"
PLANTED_CONIFERS = {"A": 1.0, "B": 0.0}  # at first, of a hundred a year
BREATH_MS = 200  # between years that are watched, in which the page hears its buttons
INTRODUCTION = (
    "Manage a boreal forest for fifty years: store carbon in trees, and keep the frozen ground below them cold. Stands "
    "A and B begin alike, on the same site, under the same weather and the same dice of fire, insects and death; what "
    "differs is who manages them. Gain is what their returns have above those of a third one, which is left alone. "
    "The carbon return is of what stand and products have stored; the thaw return of heat that rose through a depth of "
    "12 m, less 2.5 times what sank, so that more is colder. Cutting takes the oldest trees first."
)

THAW, NO_FROST_M = "Deepest thaw (m), where there is permafrost", sim.CONSTANTS["boundary_depth_m"].low
#: Charts of the annual record over the years: title -> column.
OF_RECORD = {
    "Stems (stems/ha)": "density_stems_ha",
    "Largest snowpack (mm of water)": "peak_swe_mm",
    THAW: "active_layer_depth_m",
}
SURFACE_M, DEEP_M = (sim.CONSTANTS[name].low for name in ("surface_soil_depth_m", "deep_soil_node_m"))
#: Charts of the days of one year: title -> (column of the daily output, factor).
OF_DAYS = {
    "Snow (cm)": ("snow_depth_m", 100.0),
    f"Soil down to {SURFACE_M:g} m (°C)": ("surface_soil_temperature_c", 1.0),
    f"Soil at {DEEP_M:g} m (°C)": ("deep_soil_temperature_c", 1.0),
}
OF_RETURNS = ("Carbon return", "Thaw return", "Weighted gain")


def reported(method):
    """What is wrong with what was chosen is said in one line of the page, and no year is played until it is right."""
    chooses = method.__name__ in ("restart", "replay", "start_over")

    @functools.wraps(method)
    def call(self, *arguments):
        self.say("")
        try:
            method(self, *arguments)
        except (ValueError, OSError, ImportError, sim.PhysicsError) as error:
            self.pause()
            self.say(str(error).splitlines()[0], wrong=True)
            if chooses:  # the stands are not those that the page says
                self.allow(False)
        else:
            if chooses:
                self.allow(True)

    return call


class Page:
    """One visitor's page."""

    def __init__(self, runs: Path):
        self.message = pn.pane.HTML(visible=False)
        self.site = SiteControls(self.restart)
        found = trained_runs(runs)
        self.cards = {name: StandCard(name, mix, found, self.replay) for name, mix in PLANTED_CONIFERS.items()}
        self.alone: Stand | None = None

        def button(name: str, method, primary: bool = False) -> pn.widgets.Button:
            kind = "primary" if primary else "default"
            made = pn.widgets.Button(label=name, color=kind, width=96, height=32, sizing_mode="fixed", margin=4)
            made.on_click(lambda _: method())
            return made

        self.buttons = {
            "Start over": button("Start over", self.start_over),
            "A year": button("A year", lambda: self.forward(1), primary=True),
            "Ten years": button("Ten years", lambda: self.forward(10)),
            "To the end": button("To the end", lambda: self.forward(YEARS)),
            "Play": button("Play", self.play_or_pause),
        }
        self.year = pn.widgets.IntSlider(label="Year", start=0, end=YEARS, value=0, margin=(0, 16))
        self.year.param.watch(lambda event: event.new == self.alone.year or self.look(event.new), "value_throttled")
        self.returns = {title: Lines(title) for title in OF_RETURNS}
        self.record = {title: Lines(title, first=1) for title in OF_RECORD}
        self.days = {title: Lines(title, first=1, daily=True) for title in OF_DAYS}
        self.days_title = pn.pane.HTML()
        self.body = pn.Column(visible=False)
        self.clock = None  # of the years that are watched

    # -----------------------------------------------------------------------------------------------------------
    # What is done
    # -----------------------------------------------------------------------------------------------------------

    def await_physics(self, compiled: Future) -> None:
        """Begin as soon as the physics is compiled."""
        self.say("The physics is being loaded. The first start on a machine compiles it, which takes up to a minute.")
        document = pn.state.curdoc
        compiled.add_done_callback(lambda _: document.add_next_tick_callback(lambda: self.open(compiled)))

    def open(self, compiled: Future) -> None:
        """Show the stands before their first year. Raises what compiling has raised."""
        compiled.result()
        self.start_over()
        self.body.visible = True

    @property
    def stands(self) -> dict[str, Stand]:
        """Stands by the name of their line."""
        return {**{name: card.stand for name, card in self.cards.items()}, ALONE: self.alone}

    @reported
    def restart(self) -> None:
        """Another site: all stands anew, played as far as they were."""
        self.anew(self.alone.played, self.alone.year)

    @reported
    def start_over(self) -> None:
        """Before the first year; all that was played is forgotten."""
        self.pause()
        self.anew(0, 0)

    def anew(self, played: int, year: int) -> None:
        """All stands from their beginning on for so many years, and the page at one of them."""
        setting = self.site.setting()
        alone = Stand(setting)
        for _ in range(played):
            alone.step(boreal_env.NO_CHANGE)
        begun = [card.played(setting, played) for card in self.cards.values()]
        self.alone = alone
        for card, stand_and_player in zip(self.cards.values(), begun, strict=True):
            card.begin(*stand_and_player)
        self.look(year)

    @reported
    def replay(self, card: StandCard) -> None:
        """Another manager of one stand, played anew as far as it was; all stands, if the page shows others."""
        if self.year.disabled:
            self.anew(self.alone.played, self.alone.year)
            return
        card.begin(*card.played(self.alone.setting, self.alone.played))
        self.look(self.alone.year)

    @reported
    def look(self, year: int) -> None:
        """At a year, which is played first if it was not."""
        for stand in self.stands.values():
            stand.look(min(year, stand.played))
        self.forward(year - self.alone.year)

    @reported
    def forward(self, years: int) -> None:
        """So many years on from the one looked at; what was played beyond it is forgotten."""
        for _ in range(min(years, YEARS - self.alone.year)):
            self.alone.step(boreal_env.NO_CHANGE)
            for card in self.cards.values():
                card.forward()
        self.show()

    def play_or_pause(self) -> None:
        """Watch the years pass, or stop that."""
        if self.clock:
            self.pause()
        else:
            if self.alone.year == YEARS:
                self.look(0)
            self.wait()
            self.buttons["Play"].label = "Pause"

    def wait(self) -> None:
        """Have the next year come, which begins only when the last is drawn: however slow that is, the page answers."""
        self.clock = pn.state.add_periodic_callback(self.tick, period=BREATH_MS, count=1)

    def tick(self) -> None:
        """A year of those that are watched."""
        if not self.clock:  # paused since it was called
            return
        self.forward(1)
        if self.alone.year == YEARS:
            self.pause()
        else:
            self.wait()

    def allow(self, playing: bool) -> None:
        """Whether years can be played, and looked at."""
        for widget in (*(made for name, made in self.buttons.items() if name != "Start over"), self.year):
            widget.disabled = not playing

    def pause(self) -> None:
        """Watch no further."""
        if self.clock:
            self.clock.stop()
            self.clock = None
            self.buttons["Play"].label = "Play"

    # -----------------------------------------------------------------------------------------------------------
    # What is shown
    # -----------------------------------------------------------------------------------------------------------

    def say(self, text: str, wrong: bool = False) -> None:
        """One line at the top; none for an empty text."""
        self.message.object = html.escape(text)
        self.message.styles = style.WRONG if wrong else style.SAID
        self.message.visible = bool(text)

    def show(self) -> None:
        """The year looked at, and the years played."""
        year = self.alone.year
        whole = {name: stand.whole_view() for name, stand in self.stands.items()}
        stems = max(stems_by_age(card.stand.view()).sum(axis=0).max() for card in self.cards.values())
        carbon = max(largest_stock(whole[name]) for name in self.cards)
        for card in self.cards.values():
            card.show(self.alone, (1.1 * max(stems, 100.0), 1.1 * carbon))

        totals = {name: cumulative(stand.rewards) for name, stand in self.stands.items()}
        gains = {name: (totals[name] - totals[ALONE]) @ stand.weights for name, stand in self.stands.items()}
        carbon_returns, thaw_returns = ({name: total[:, k] for name, total in totals.items()} for k in (0, 1))
        for title, lines in zip(OF_RETURNS, (carbon_returns, thaw_returns, gains), strict=True):
            self.returns[title].show(lines, year)
        for title, column in OF_RECORD.items():
            values = {name: np.array(view.history[column]) for name, view in whole.items()}
            if title == THAW:
                values = {name: np.where(depths < NO_FROST_M, depths, np.nan) for name, depths in values.items()}
            self.record[title].show(values, year)
        days = {name: stand.days() for name, stand in self.stands.items()}
        for title, (column, factor) in OF_DAYS.items():
            self.days[title].show({name: factor * table[column].to_numpy() for name, table in days.items()})
        self.days_title.object = style.heading(
            f"Through year {year}, day by day" if year else "Day by day, from year 1 on"
        )
        put(self.year, year)

    def layout(self) -> pn.Column:
        """Site on the left, stands and charts on the right; on a narrow screen the site comes last."""
        bar = pn.FlexBox(*self.buttons.values(), pn.Row(self.year, styles={"flex": "1 1 240px"}), align_items="center")

        def charts(lines: dict[str, Lines]) -> pn.FlexBox:
            return pn.FlexBox(*(pn.Column(pn.pane.Bokeh(chart.figure), styles=style.CHART) for chart in lines.values()))

        stands = pn.Column(
            pn.Column(bar, styles=style.CARD, stylesheets=[style.STAYS]),
            pn.FlexBox(*(card.layout() for card in self.cards.values()), gap="14px", align_items="stretch"),
            pn.Column(
                pn.pane.HTML(
                    style.lines({**{f"stand {name}": colour for name, colour in COLOURS.items()}, ALONE: ALONE_COLOUR})
                ),
                pn.pane.HTML(style.heading("Over the years")),
                charts(self.returns),
                charts(self.record),
                self.days_title,
                charts(self.days),
                styles=style.CARD,
            ),
            styles={"flex": "999 1 620px", "gap": "14px"},
        )
        site = pn.Column(
            pn.pane.HTML(style.heading("Site")),
            self.site.layout(),
            styles={**style.CARD, "flex": "1 1 290px"},
            stylesheets=[style.LAST],
        )
        self.body.objects = [pn.FlexBox(site, stands, gap="14px", align_items="flex-start")]
        return pn.Column(
            pn.pane.HTML(style.introduction(TITLE, INTRODUCTION)),
            self.message,
            self.body,
            max_width=1500,
            styles=style.PAGE,
        )


def cumulative(rewards: np.ndarray) -> np.ndarray:
    """Returns after each year, the first before any, shape (years + 1, 2)."""
    return np.vstack([np.zeros((1, 2)), np.cumsum(rewards, axis=0)])


def main(args: Args) -> None:
    """Serve the page."""
    pn.extension(sizing_mode="stretch_width", raw_css=[style.BODY])

    def page():
        made = Page(args.runs)
        pn.state.onload(lambda: made.await_physics(compiled))
        return made.layout()

    compiled = ThreadPoolExecutor(1).submit(boreal_env.warm_up)
    port, origin = args.port, f"localhost:{args.port}"
    print(f"http://{origin} has the page; Ctrl-C ends it", flush=True)
    try:
        pn.serve(page, port=port, address="localhost", websocket_origin=[origin], show=args.show, title=TITLE)
    except OSError as error:
        fail(f"--port {port}: {error.strerror}; another one is allowed, such as --port {port + 1}")


if __name__ == "__main__":
    main(args)
