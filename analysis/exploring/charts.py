"""Charts of two stands, A and B, beside one left alone; `show` fills a chart again."""

import io
import itertools

import numpy as np
from bokeh.models import ColumnDataSource, FactorRange, HoverTool, Range1d, Span
from bokeh.plotting import figure
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from analysis.exploring.stands import YEARS
from sim.demography import first_ages
from sim.parameters import CONSTANTS
from sim.task import picture
from sim.task.picture import View, draw_ground, draw_scene

#: Colours that those who see no red or no green can tell apart (Okabe and Ito), and what the lines are called.
COLOURS = {"A": "#0072b2", "B": "#d55e00"}
ALONE, ALONE_COLOUR = "left alone", "#8a96a0"
SPECIES = {"conifers": picture.CONIFER, "deciduous": picture.DECIDUOUS}
STOCKS = {
    "soil": ("soil_kgc_m2", picture.SOIL),
    "dead wood": ("deadwood_kgc_m2", picture.DEADWOOD),
    "trees": ("biomass_kgc_m2", picture.BIOMASS),
    "products": ("hwp_kgc_m2", picture.PRODUCTS),
}
FIRST_AGES = first_ages({name: CONSTANTS[name].low for name in ("young_age_limit", "mature_age_limit")})[:-1]
AGES = [f"{low}–{after - 1}" for low, after in itertools.pairwise(FIRST_AGES)] + [f"{FIRST_AGES[-1]}+"]
MONTHS = dict(zip(np.cumsum([1, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30]).tolist(), "JFMAMJJASOND", strict=True))
INK, FAINT = picture.INK, "#d5dbe0"
WIDTH_IN, HEIGHT_IN, SCENE_SHARE, DPI = 4.4, 4.1, 0.545, 170  # of the picture; the scene keeps its shape


def blank(title: str, height: int, **options) -> figure:
    """An empty chart in the page's style."""
    chart = figure(title=title, height=height, sizing_mode="stretch_width", toolbar_location=None, tools="", **options)
    chart.title.text_font_size, chart.title.text_color = "13px", INK
    chart.outline_line_color = chart.xgrid.grid_line_color = None
    chart.ygrid.grid_line_color = "#eef1f3"
    for axis in chart.axis:
        axis.axis_line_color = axis.major_tick_line_color = FAINT
        axis.minor_tick_line_color = None
        axis.major_label_text_color, axis.major_label_text_font_size = INK, "11px"
    chart.yaxis.ticker.desired_num_ticks = 4
    chart.min_border_right, chart.min_border_left = 12, 44
    return chart


class Lines:
    """A line for each stand and a dashed one for the stand left alone, over years or over the days of one."""

    def __init__(self, title: str, first: int = 0, daily: bool = False):
        self.first = first
        ends = (1, 365) if daily else (0, YEARS)
        self.figure = blank(title, 190, x_range=Range1d(*ends))
        self.source = ColumnDataSource({name: [] for name in ("x", "A", "B", ALONE)})
        alone = self.figure.line("x", ALONE, source=self.source, color=ALONE_COLOUR, line_dash=[5, 4], line_width=1.5)
        for name, colour in COLOURS.items():
            self.figure.line("x", name, source=self.source, color=colour, line_width=2.2, alpha=0.9)
        what = [("day of year" if daily else "year", "@x")]
        lines = [(name, f"@{{{name}}}{{0.00}}") for name in (*COLOURS, ALONE)]
        self.figure.add_tools(HoverTool(mode="vline", renderers=[alone], tooltips=[*what, *lines]))
        self.now = Span(dimension="height", line_color=FAINT, line_width=1.5, visible=False)
        self.figure.add_layout(self.now)
        self.figure.xaxis.ticker = list(MONTHS) if daily else list(range(0, YEARS + 1, 10))
        if daily:
            self.figure.xaxis.major_label_overrides = MONTHS

    def show(self, lines: dict[str, np.ndarray], year: int | None = None) -> None:
        """Values by line, from `first` on; year : the one looked at."""
        number = max(map(len, lines.values()))
        self.source.data = {"x": np.arange(self.first, self.first + number), **lines}
        self.now.location, self.now.visible = year, year is not None


class AgeBars:
    """Stems by age and species, as bars."""

    def __init__(self):
        self.figure = blank("Stems by age, years (stems/ha)", 170, x_range=FactorRange(*AGES), y_range=Range1d(0, 1))
        self.source = ColumnDataSource({name: [] for name in ("age", *SPECIES)})
        bars = self.figure.vbar_stack(
            list(SPECIES), x="age", width=0.8, source=self.source, color=list(SPECIES.values()), line_color=None
        )
        tooltips = [("years", "@age"), *((name, f"@{name}{{0}} stems/ha") for name in SPECIES)]
        self.figure.add_tools(HoverTool(renderers=bars, tooltips=tooltips))

    def show(self, view: View, top: float) -> None:
        """top : of the axis, the same for both stands."""
        stems = stems_by_age(view)
        self.source.data = {"age": AGES, **dict(zip(SPECIES, stems, strict=True))}
        self.figure.y_range.end = top


class StockAreas:
    """Carbon in soil, dead wood, trees and products over the years, one upon the other."""

    def __init__(self):
        self.figure = blank("Carbon (kgC/m²)", 170, x_range=Range1d(0, YEARS), y_range=Range1d(0, 1))
        self.source = ColumnDataSource({name: [] for name in ("x", "total", *STOCKS)})
        colours = [colour for _, colour in STOCKS.values()]
        self.figure.varea_stack(list(STOCKS), x="x", source=self.source, color=colours)
        top = self.figure.line("x", "total", source=self.source, color=INK, line_width=1)
        tooltips = [("year", "@x"), *((name, f"@{{{name}}}{{0.00}} kgC/m²") for name in reversed(STOCKS))]
        self.figure.add_tools(HoverTool(mode="vline", renderers=[top], tooltips=tooltips))
        self.now = Span(dimension="height", line_color=INK, line_width=1, line_dash=[2, 3], visible=False)
        self.figure.add_layout(self.now)
        self.figure.xaxis.ticker = list(range(0, YEARS + 1, 10))

    def show(self, view: View, year: int, top: float) -> None:
        """year : the one looked at; top : of the axis, the same for both stands."""
        stocks = {name: view.with_start(column) for name, (column, _) in STOCKS.items()}
        self.source.data = {"x": np.arange(view.year + 1), "total": sum(stocks.values()), **stocks}
        self.figure.y_range.end = top
        self.now.location, self.now.visible = year, True


def stems_by_age(view: View) -> np.ndarray:
    """Conifers and deciduous trees of each age class [stems ha-1], shape (2, 5)."""
    return np.add.reduceat(view.stems, FIRST_AGES, axis=1)


def largest_stock(view: View) -> float:
    """All carbon of the year that has the most of it [kgC m-2]."""
    return float(np.sum([view.with_start(column) for column, _ in STOCKS.values()], axis=0).max())


def drawing(view: View) -> bytes:
    """Trees, and the ground below them, as a PNG: what `env.render()` draws without its charts, in larger print."""
    drawn = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, facecolor="white")
    FigureCanvasAgg(drawn)
    draw_scene(drawn.add_axes((0.0, 1.0 - SCENE_SHARE, 1.0, SCENE_SHARE)), view)
    draw_ground(drawn.add_axes((0.075, 0.085, 0.915, 0.985 - SCENE_SHARE - 0.085)), view)
    file = io.BytesIO()
    drawn.savefig(file, format="png")
    return file.getvalue()
