"""Pieces of a generated document: tables, figures with fixed bytes, and what misses."""

import io
import textwrap
from dataclasses import dataclass, field

import matplotlib.style
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from analysis.validation.scores import IN, Band

#: Colours that people with any colour vision can tell apart (Okabe and Ito 2008).
BLACK, GREY = "#222222", "#9a9a9a"
BLUE, ORANGE, GREEN, PURPLE, SKY = "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9"
DPI, COLOURS = 100, 128
WIDTH = 120
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
}


@dataclass(frozen=True)
class Miss:
    """A value outside what was observed, and the process that likely is behind it."""

    where: str
    what: str
    likely: str


@dataclass
class Part:
    """A part of the document: its text in Markdown, figures (name -> PNG), and what misses."""

    text: str
    figures: dict[str, bytes] = field(default_factory=dict)
    misses: list[Miss] = field(default_factory=list)


def table(header: list[str], rows: list[list[str]], left: int = 1) -> str:
    """A Markdown table whose first `left` columns are text and the rest numbers."""
    marks = ["---" if k < left else "---:" for k in range(len(header))]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (header, marks, *rows))


def number(value: float, digits: int = 2, sign: bool = False) -> str:
    """A number with a real minus; a dash for NaN. A value that rounds to zero has no sign."""
    if value != value:
        return "-"
    text = f"{round(value, digits) + 0.0:{'+' if sign else ''}.{digits}f}"
    return text.replace("-", "−")


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.0f} %"


def spread(values, digits: int = 2, ends: tuple[float, float] = (10.0, 90.0)) -> str:
    """Median and two percentiles of a sample."""
    low, median, high = (number(value, digits) for value in np.percentile(values, [ends[0], 50.0, ends[1]]))
    return f"{median} ({low} .. {high})"


def limits(band: Band, digits: int) -> str:
    """A band's ends."""
    return f"{number(band.low, digits)} .. {number(band.high, digits)}"


def marked(verdict: str) -> str:
    """A verdict of a band, bold where it misses."""
    return verdict if verdict == IN else f"**{verdict}**"


def fill(text: str) -> str:
    """Markdown with its paragraphs filled to WIDTH; tables, headings and images stay as they are."""
    blocks = text.split("\n\n")
    return "\n\n".join(block if block.startswith(("|", "#", "!")) else _fill(block) for block in blocks)


def _fill(paragraph: str) -> str:
    words = " ".join(paragraph.split())
    return textwrap.fill(words, WIDTH, break_long_words=False, break_on_hyphens=False)


#: Decorator of functions that draw: they do so in the document's style.
styled = matplotlib.style.context(STYLE)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inch]; it never opens a window."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def headroom(ax, share: float = 0.35) -> None:
    """Leave a share of the axis above the data, for a legend."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + share * (high - low))


def png(figure: Figure) -> bytes:
    """The figure as PNG of at most COLOURS colours; the same figure gives the same bytes."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI)
    Image.open(drawn).convert("RGB").quantize(COLOURS).save(packed, format="png", optimize=True)
    return packed.getvalue()
