"""What is chosen for both stands: the world, the site, and the seed of first stand, weather and dice."""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import panel as pn

from analysis.exploring.sliders import put
from analysis.exploring.stands import PAPER, PLACES, WORLDS, Setting, evaluation_site, evaluation_sites, moved, place
from sim.physical_constants import FREEZING_POINT_K
from sim.spin_up import BOUNDARY

EVALUATION = "Evaluation site"


@dataclass(frozen=True)
class Scale:
    """How the page shows a site parameter."""

    name: str
    low: float
    high: float
    step: float
    zero: float = 0.0  # what the page shows as 0


SCALES = {
    "latitude_deg": Scale("Latitude (°N), with its temperature", 50.0, 70.0, 0.5),
    "mean_annual_temperature_c": Scale("Mean air temperature (°C)", -15.0, 5.0, 0.1),
    "seasonal_amplitude_c": Scale("Summer above that mean (°C)", 10.0, 30.0, 0.5),
    "winter_snow_mm_day": Scale("Snow on a snowy day (mm water)", 0.0, 12.0, 0.5),
    "summer_rain_mm_day": Scale("Rain on a wet summer day (mm)", 2.0, 30.0, 1.0),
    "wind_speed_m_s": Scale("Wind (m/s)", 0.5, 8.0, 0.1),
    BOUNDARY: Scale("Ground 12 m down (°C)", -8.0, 6.0, 0.1, FREEZING_POINT_K),
}


class SiteControls:
    """The controls; `changed` is called, without arguments, when there is another setting."""

    def __init__(self, changed: Callable[[], None]):
        self.changed = changed
        self.world = pn.widgets.Select(label="World", options=WORLDS)
        self.place = pn.widgets.Select(label="Site", options=[EVALUATION, *PLACES])
        self.number = pn.widgets.IntSlider(label="Number of the evaluation site", start=1, end=len(evaluation_sites()))
        self.seed = pn.widgets.IntInput(label="Seed of first stand, weather and dice", value=0, start=0, end=2**31 - 1)
        self.sliders = {
            parameter: pn.widgets.FloatSlider(
                label=scale.name, start=scale.low, end=scale.high, step=scale.step, format="0.0"
            )
            for parameter, scale in SCALES.items()
        }
        self.filling = False  # whether values are set here, not by the user
        self.take_place()
        self.take_world()
        self.watch(self.world, "value", lambda _: self.take_world())
        self.watch(self.place, "value", lambda _: self.take_place())
        self.watch(self.number, "value_throttled", lambda _: self.take_place())
        self.watch(self.seed, "value", lambda _: None)
        for parameter, slider in self.sliders.items():
            self.watch(slider, "value_throttled", functools.partial(self.move, parameter))

    def watch(self, widget, what: str, take: Callable[[float], None]) -> None:
        """Have the user's choices taken, with their value, and told."""

        def chosen(event):
            if not self.filling:
                take(event.new)
                self.changed()

        widget.param.watch(chosen, what)

    def setting(self) -> Setting:
        """What is chosen. Raises ValueError without a seed, of which every stand would draw its own."""
        if self.seed.value is None:
            raise ValueError(f"type a seed, {self.seed.start} to {self.seed.end}")
        return Setting(self.world.value, self.site, self.seed.value)

    def layout(self) -> pn.Column:
        """All controls, one below another."""
        return pn.Column(self.world, self.place, self.number, *self.sliders.values(), self.seed)

    def take_world(self) -> None:
        """The ground far below can be chosen where it does not follow from the climate."""
        self.sliders[BOUNDARY].visible = self.world.value == PAPER

    def take_place(self) -> None:
        """All parameters and the seed of the place, or of the evaluation site."""
        numbered = self.place.value == EVALUATION
        self.number.visible = numbered
        self.site, seed = evaluation_site(self.number.value) if numbered else place(self.place.value)
        self.fill(seed)

    def move(self, parameter: str, value: float) -> None:
        """Another value of a parameter, as the page shows it."""
        self.site = moved(self.site, parameter, value + SCALES[parameter].zero)
        self.fill(self.seed.value)

    def fill(self, seed: int) -> None:
        """Show what was chosen."""
        self.filling = True
        self.seed.value = seed
        for parameter, slider in self.sliders.items():
            put(slider, round(self.site[parameter] - SCALES[parameter].zero, 2))
        self.filling = False
