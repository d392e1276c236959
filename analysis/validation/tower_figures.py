"""Figures of the towers: the measured and the modelled course of the days."""

import matplotlib.dates as dates
import pandas as pd

from analysis.validation import document
from analysis.validation.document import BLACK, BLUE, GREY, ORANGE, number
from analysis.validation.tower_comparison import QUANTITIES, scores

PANELS = ("GPP", "ecosystem respiration", "net exchange", "latent heat", "sensible heat", "net radiation", "albedo")
CARBON = "gC m$^{-2}$ day$^{-1}$"
AXES = {"GPP": CARBON, "ecosystem respiration": CARBON, "net exchange": CARBON, "albedo": "share reflected"}


@document.styled
def draw(title: str, compared: dict[str, pd.DataFrame], swe: pd.Series, soil_label: str, weeks: bool) -> bytes:
    """PNG of the course of the compared quantities, soil temperature, and snow.

    swe : modelled snow water [mm] a day; soil_label : what was measured where; weeks : lines are means of 7 days, with
    the measured days as dots.
    """
    figure = document.new_figure(8.5, 11.5)
    axes = figure.subplots(len(PANELS) + 1, 1, sharex=True)
    for ax, name in zip(axes, PANELS, strict=False):
        days = compared[name]
        counted = days["measured"].where(days["counts"])
        if weeks:
            ax.plot(days.index, counted, ".", color=GREY, ms=3, label="measured, days")
        modelled = days["modelled"].where(days["measured"].notna()) if name == "albedo" else days["modelled"]
        ax.plot(days.index, _week(counted), color=BLACK, lw=1.2, label="measured, 7 days")
        ax.plot(days.index, _week(modelled), color=ORANGE, lw=1.2, label="modelled, 7 days")
        s, digits = scores(days)[1], QUANTITIES[name].digits
        bias = number(s.bias, digits, sign=True)
        ax.set_title(f"{name}: days' bias {bias}, RMSE {number(s.rmse, digits)}, r {number(s.r)}")
        ax.set_ylabel(AXES.get(name, "W m$^{-2}$"))
    axes[0].legend(ncols=3, loc="upper left")
    document.headroom(axes[0])

    ax, days = axes[-1], compared["soil temperature"]
    ax.plot(days.index, days["measured"].where(days["counts"]), color=BLACK, lw=1.2, label=soil_label)
    ax.plot(days.index, days["modelled"], color=ORANGE, lw=1.2, label="modelled")
    ax.set_title("soil temperature, and the modelled snow")
    ax.set_ylabel("°C")
    ax.legend(loc="upper left", ncols=2)
    document.headroom(ax)
    snow = ax.twinx()
    snow.spines["right"].set_visible(True)
    snow.fill_between(days.index, swe.to_numpy(), color=BLUE, alpha=0.2, lw=0)
    snow.set_ylabel("snow water [mm]", color=BLUE)
    snow.set_ylim(0, max(1.0, 2.0 * swe.max()))
    locator = dates.MonthLocator() if weeks else dates.MonthLocator(bymonth=(1, 7))
    ax.xaxis.set_major_locator(locator)
    ax.xaxis.set_major_formatter(dates.DateFormatter("%b" if weeks else "%b %Y"))
    ax.set_xlim(days.index[0], days.index[-1])
    figure.suptitle(title)
    return document.png(figure)


def _week(days: pd.Series) -> pd.Series:
    return days.rolling(7, center=True, min_periods=3).mean()
