"""The picture of a stand that `BorealEnv.render` returns: its trees, the ground below them, the years so far.

The plot is a tenth of a hectare: one tree for every ten stems a hectare, to scale, at places that depend on
the episode's seed only. Deciduous trees keep their autumn leaves, so that the species can be told apart.
Depth in the ground is on a square-root scale.
"""

from dataclasses import dataclass
from itertools import cycle

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from sim import soil
from sim.demography import AGES
from sim.jit import uncompiled
from sim.physical_constants import FREEZING_POINT_K
from sim.spin_up import soil_node
from sim.state import PARAMETER_NAMES, STATE

temperature = uncompiled(soil.temperature)

WIDTH, HEIGHT, DPI = 800, 500, 100  # pixels
STEMS_PER_TREE = 10.0  # stems ha-1
MOST_TREES = 300  # of a kind
TALLEST_M = {"conifer": 15.0, "deciduous": 18.0}  # a very old tree
SMALLEST_TREE_M = 1.2  # what is smaller would not be seen
SNAG_HEIGHT_M, SNAG_YEARS = 8.0, 10  # dead trees after a fire, and how long they stand
SNOWY_MM = 5.0  # water equivalent from which the ground is drawn white

INK, FAINT = "#22303c", "#8a96a0"
CONIFER, DECIDUOUS = "#1f6f5c", "#e6a020"
SOIL, DEADWOOD, BIOMASS, PRODUCTS = "#6b4226", "#b3a59a", "#93b36b", "#f0dca0"
RETURNS = ("#111111", "#0072b2", "#d55e00", "#009e73", "#cc79a7")  # of the objectives, over again beyond five
ORGANIC, THAWED, FROZEN_WARM, FROZEN_COLD = "#3d2b1f", "#a9825a", "#d3e6f2", "#7fb0d3"
SMALL, LARGE = 7.5, 9.5  # points
LABEL = {"facecolor": "white", "alpha": 0.65, "linewidth": 0, "pad": 0.8}

SCENE, GROUND = (0.0, 0.385, 0.655, 0.535), (0.052, 0.075, 0.603, 0.31)  # left, bottom, width, height
CHART_LEFT, CHART_WIDTH, CHART_HEIGHT, CHART_GAP = 0.715, 0.262, 0.142, 0.087
CHARTS = [(CHART_LEFT, bottom, CHART_WIDTH, CHART_HEIGHT) for bottom in (0.744, 0.515)]
RETURN_BOTTOM, RETURN_HEIGHT = 0.057, 2 * CHART_HEIGHT + CHART_GAP  # of the returns' charts, all together

CARBON_STOCKS = ("biomass_kgc_m2", "deadwood_kgc_m2", "soil_kgc_m2")
DEADWOODS = ("conifer_deadwood", "deciduous_deadwood")

#: The scene in metres at its front edge; the camera stands before it. At distance d all is smaller by
#: CAMERA_M / (CAMERA_M + d), and the view is as much wider, so that PLOT_M x d + d^2 is the area up to there.
PLOT_M, CAMERA_M, CAMERA_HEIGHT_M, PLOT_AREA_M2 = 50.0, 25.0, 12.0, 1000.0
SCENE_HEIGHT_M = PLOT_M * SCENE[3] * HEIGHT / (SCENE[2] * WIDTH)


# ------------------------------------------------------------------------------------------------------------
# What is drawn
# ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class View:
    """A stand at the end of a year (or before the first), in the names of the annual record."""

    seed: int
    weights: dict  # objective -> its weight
    years: int
    parameters: dict
    state: dict
    stems: np.ndarray  # (2, AGES) conifer and deciduous stems [ha-1] by year of age
    history: dict  # name -> (years so far,)
    start: dict  # first stocks

    @property
    def year(self) -> int:
        """Years so far."""
        return len(self.history["biomass_kgc_m2"])

    def last(self, name, before_first_year=0.0) -> float:
        """Value of the last year."""
        return float(self.history[name][-1]) if self.year else before_first_year

    def with_start(self, name) -> np.ndarray:
        """A stock over the years, the first one included."""
        return np.concatenate([[self.start[name]], self.history[name]])


def view_of(episodes, i: int) -> View:
    """What there is to draw of episode `i`."""
    years = episodes.history[i, : episodes.year[i]]
    history = {name: years[:, k] for k, name in enumerate(episodes.history_names)}
    row = episodes.stands.state[i]
    stocks = episodes.stands.stocks([i])
    start = {name: float(stocks[name][0]) for name in CARBON_STOCKS} | {"hwp_kgc_m2": 0.0}
    history["deadwood_kgc_m2"] = sum(history[f"{name}_kgc_m2"] for name in DEADWOODS)
    if len(years):
        changes = {name: history[f"{name}_change_kgc_m2"][0] for name in ("biomass", "soil")}
        fluxes = (("input", 1.0), ("decay", -1.0), ("burned", -1.0))
        changes["deadwood"] = sum(
            sign * history[f"{name}_{flux}_kgc_m2"][0] for name in DEADWOODS for flux, sign in fluxes
        )
        for name, change in changes.items():
            start[f"{name}_kgc_m2"] = history[f"{name}_kgc_m2"][0] - change
    return View(
        seed=int(episodes.episode_seeds[i]),
        weights=dict(zip(episodes.objective_names, episodes.weights[i].tolist(), strict=True)),
        years=episodes.years,
        parameters=dict(zip(PARAMETER_NAMES, episodes.stands.parameters[i], strict=True)),
        state=dict(zip(STATE, row, strict=False)),
        stems=row[len(STATE) :].reshape(2, AGES),
        history=history,
        start=start,
    )


def draw_stand(episodes, i: int) -> np.ndarray:
    """Picture of stand `i` of `sim.task.episodes.Episodes`, uint8, shape (500, 800, 3)."""
    view = view_of(episodes, i)
    figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    draw_title(figure, view)
    draw_scene(figure.add_axes(SCENE), view)
    draw_ground(figure.add_axes(GROUND), view)
    draw_years(figure, view)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def draw_title(figure, view: View) -> None:
    """Where and when, and what happened in the last year."""
    p = view.parameters
    title = (
        f"Year {view.year} of {view.years}    {p['latitude_deg']:.1f} °N    "
        f"annual mean {p['mean_annual_temperature_c']:.1f} °C    {preference(view)}"
    )
    figure.text(0.012, 0.966, title, fontsize=LARGE, color=INK, va="center", weight="bold")
    density = view.stems.sum()
    conifers = f"{100 * view.stems[0].sum() / density:.0f} % conifers" if density > 0.0 else "no trees"
    events = [f"{density:.0f} stems/ha", conifers]
    if view.last("planted_stems_ha") > 0.0:
        events.append(f"planted {view.last('planted_stems_ha'):.0f}")
    if view.last("thinned_stems_ha") > 0.0:
        events.append(f"cut {view.last('thinned_stems_ha'):.0f}")
    if view.last("insect_mortality") > 0.0:
        events.append(f"insects killed {100 * view.last('insect_mortality'):.0f} %")
    if view.last("fire_mortality") > 0.0:
        events.append(f"fire killed {100 * view.last('fire_mortality'):.0f} %")
    figure.text(0.012, 0.938, " · ".join(events), fontsize=SMALL + 0.5, color=INK, va="center")


def preference(view: View) -> str:
    """The weight of the first of two objectives, or those of all."""
    if len(view.weights) == 2:
        objective, weight = next(iter(view.weights.items()))
        return f"{objective} weight {weight:.2f}"
    return "weights " + ", ".join(f"{objective} {weight:.2f}" for objective, weight in view.weights.items())


# ------------------------------------------------------------------------------------------------------------
# The trees
# ------------------------------------------------------------------------------------------------------------


def _mirrored(right):
    """Outline, counterclockwise from the top, of a shape given by its right half."""
    right = np.array(right, dtype=float)
    return np.concatenate([right, right[::-1] * [-1.0, 1.0]])


def _ellipse(x, y, width, height, lobes=0.0):
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    radius = 1.0 + lobes * np.cos(6.0 * angle + 0.4)
    return np.column_stack([x + 0.5 * width * radius * np.cos(angle), y + 0.5 * height * radius * np.sin(angle)])


def _shape(*parts):
    """Polygons, padded to 24 vertices by the last one, shape (parts, 24, 2), and colours, (parts, 3)."""
    polygons = np.zeros((len(parts), 24, 2))
    for polygon, (vertices, _) in zip(polygons, parts, strict=True):
        polygon[:] = vertices[-1]
        polygon[: len(vertices)] = vertices
    return polygons, np.array([[int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)] for _, colour in parts])


_TIERS = [(0.0, 1.0), (0.2, 0.72), (0.1, 0.73), (0.34, 0.46), (0.2, 0.475), (0.5, 0.12)]
_SNOW = [
    [(0.0, 1.0), (-0.2, 0.72), (-0.06, 0.79)],
    [(-0.1, 0.73), (-0.34, 0.46), (-0.14, 0.56)],
    [(-0.2, 0.475), (-0.5, 0.12), (-0.24, 0.29)],
]
_SHADOW = (_ellipse(0.12, 0.0, 0.9, 0.05), "#bccbd8")

#: Shapes of unit height and crown width, standing at (0, 0).
SHAPES = {
    "conifer": _shape(
        _SHADOW,
        ([(-0.05, 0.0), (0.05, 0.0), (0.05, 0.2), (-0.05, 0.2)], "#4a3628"),
        (_mirrored(_TIERS), "#185848"),
        ([*_TIERS, (0.08, 0.12)], "#2a8069"),
    ),
    "snowy conifer": _shape(
        _SHADOW,
        ([(-0.05, 0.0), (0.05, 0.0), (0.05, 0.2), (-0.05, 0.2)], "#4a3628"),
        (_mirrored(_TIERS), "#185848"),
        ([*_TIERS, (0.08, 0.12)], "#2a8069"),
        *((triangle, "#e9f2f8") for triangle in _SNOW),
    ),
    "deciduous": _shape(
        _SHADOW,
        ([(-0.045, 0.0), (0.045, 0.0), (0.02, 0.6), (-0.02, 0.6)], "#d9d5cb"),
        ([(0.01, 0.0), (0.045, 0.0), (0.02, 0.6), (0.005, 0.6)], "#a49e92"),
        (_ellipse(0.0, 0.68, 0.96, 0.62, 0.05), "#c9820f"),
        (_ellipse(0.07, 0.73, 0.72, 0.46, 0.06), "#eba92b"),
        (_ellipse(0.14, 0.79, 0.36, 0.23, 0.07), "#f6c65a"),
    ),
    "snag": _shape(
        ([(-0.07, 0.0), (0.07, 0.0), (0.02, 1.0), (-0.01, 0.93)], "#2b2522"),
        ([(0.0, 0.55), (0.32, 0.72), (0.0, 0.61)], "#2b2522"),
        ([(0.0, 0.4), (-0.3, 0.52), (0.0, 0.45)], "#2b2522"),
        ([(0.0, 0.74), (-0.2, 0.84), (0.0, 0.78)], "#2b2522"),
    ),
    "stump": _shape(
        ([(-0.5, 0.0), (0.5, 0.0), (0.42, 0.8), (-0.42, 0.8)], "#6b4a30"),
        (_ellipse(0.0, 0.8, 0.84, 0.4), "#e3bf8a"),
    ),
}


def sizes(view: View, species: str) -> np.ndarray:
    """Crown width and height [m] of the trees of a species, oldest first, shape (trees, 2)."""
    p = view.parameters
    stems = view.stems[("conifer", "deciduous").index(species), ::-1]
    trees = min(int(np.ceil(stems.sum() / STEMS_PER_TREE - 0.5)), MOST_TREES)
    rank = (np.arange(trees) + 0.5) / max(trees, 1) * stems.sum()
    age = AGES - 1 - np.searchsorted(np.cumsum(stems), rank)
    height = (1.0 - np.exp(-p[f"height_rate_{species}"] * age)) ** p[f"height_shape_{species}"] * TALLEST_M[species]
    factors = [p[f"crown_{species}_{name}"] for name in ("seedling", "sapling", "young", "mature", "old")]
    crown = p[f"crown_area_{species}_m2"] * np.interp(age, [0, 3, 13, 30, 70, 101], [0.0, *factors])
    height = np.maximum(height, SMALLEST_TREE_M)
    return np.column_stack([np.maximum(2.0 * np.sqrt(crown / np.pi), 0.4 * height), height])


def trees(view: View) -> list[tuple[str, np.ndarray]]:
    """Kinds of trees, and the size [m] of each tree of the kind, shape (trees, 2)."""
    snowy = view.state["swe"] >= SNOWY_MM
    before = view.history["density_after_action"][-SNAG_YEARS:]
    burnt = (before * view.history["fire_mortality"][-SNAG_YEARS:]).sum()
    snags = min(int(round(burnt / STEMS_PER_TREE)), MOST_TREES)
    stumps = int(round(view.last("thinned_stems_ha") / STEMS_PER_TREE))
    heights = SNAG_HEIGHT_M * (0.6 + 0.4 * np.modf(0.618 * np.arange(snags))[0])
    return [
        ("snowy conifer" if snowy else "conifer", sizes(view, "conifer")),
        ("deciduous", sizes(view, "deciduous")),
        ("snag", np.column_stack([0.25 * heights, heights])),
        ("stump", np.full((stumps, 2), (0.7, 0.6))),
    ]


def places(generator, number) -> tuple[np.ndarray, np.ndarray]:
    """Scattered places: share of the width, and distance from the front edge [m], shape (number,) each.

    The first k places are even for every k (low-discrepancy sequence R2, Roberts 2018, jittered): trees stay
    where they are when others come or go.
    """
    steps = np.array([[0.7548776662], [0.5698402910]]) * np.arange(number)
    jitter = generator.random((2, MOST_TREES))[:, :number] * [[0.08], [0.25]]
    along, area = (generator.random((2, 1)) + steps + jitter) % 1.0
    return along, np.sqrt((0.5 * PLOT_M) ** 2 + PLOT_AREA_M2 * area) - 0.5 * PLOT_M


def draw_scene(ax, view: View) -> None:
    """Sky, hills, ground and trees, in metres at the front edge."""
    ax.set(xlim=(0.0, PLOT_M), ylim=(0.0, SCENE_HEIGHT_M))
    ax.axis("off")
    fire = view.last("fire_mortality") > 0.0
    snowy = view.state["swe"] >= SNOWY_MM
    top, bottom = ((0.66, 0.60, 0.56), (0.93, 0.72, 0.50)) if fire else ((0.55, 0.72, 0.87), (0.95, 0.93, 0.88))
    share = np.linspace(0.0, 1.0, 64)[:, None, None]
    sky = (1.0 - share) * np.array(top) + share * np.array(bottom)
    ax.imshow(sky, extent=(0.0, PLOT_M, CAMERA_HEIGHT_M, SCENE_HEIGHT_M), aspect="auto", interpolation="bilinear")

    generator = np.random.default_rng(view.seed)
    x = np.linspace(0.0, PLOT_M, 60)
    haze = np.array(bottom)
    for height, colour, waves in ((2.4, "#a9bac8", 0.23), (1.1, "#8fa5b1", 0.41)):
        phase = generator.random(2) * 2.0 * np.pi
        ridge = 0.6 * height * (1.0 + 0.5 * np.sin(waves * x + phase[0]) + 0.3 * np.sin(2.7 * waves * x + phase[1]))
        ax.fill_between(x, CAMERA_HEIGHT_M, CAMERA_HEIGHT_M + ridge, color=colour, linewidth=0)
    near, far = ((0.90, 0.94, 0.97), (0.98, 0.98, 0.98)) if snowy else ((0.47, 0.49, 0.30), (0.66, 0.67, 0.50))
    if fire:
        near, far = (0.45, 0.42, 0.40), (0.60, 0.56, 0.53)
    floor = share * np.array(near) + (1.0 - share) * np.array(far)
    ax.imshow(floor, extent=(0.0, PLOT_M, 0.0, CAMERA_HEIGHT_M), aspect="auto", interpolation="bilinear")
    ax.set(xlim=(0.0, PLOT_M), ylim=(0.0, SCENE_HEIGHT_M))

    polygons, colours, distances = [], [], []
    for kind, size in trees(view):
        shape, colour = SHAPES[kind]
        along, distance = places(generator, len(size))
        light = 0.92 + 0.16 * generator.random(MOST_TREES)[: len(size)]
        scale = CAMERA_M / (CAMERA_M + distance)
        foot = np.column_stack([along * PLOT_M, CAMERA_HEIGHT_M * (1.0 - scale)])
        polygons += list(foot[:, None, None] + shape * (size * scale[:, None])[:, None, None])
        fade = 0.9 * (1.0 - scale)[:, None, None]
        colours += list(np.clip((1.0 - fade) * colour * light[:, None, None] + fade * haze, 0.0, 1.0))
        distances += list(distance)
    if not polygons:
        return
    order = np.argsort(-np.array(distances), kind="stable")
    vertices = np.concatenate([polygons[k] for k in order])
    facecolors = np.concatenate([colours[k] for k in order])
    crowns = PolyCollection(vertices, facecolors=facecolors, linewidths=0)  # type: ignore[arg-type]  # an array will do
    ax.add_collection(crowns, autolim=False)


# ------------------------------------------------------------------------------------------------------------
# The ground
# ------------------------------------------------------------------------------------------------------------


def height_on_scale(depth):
    """Square-root scale of depth [m], with snow and air (negative depth) above."""
    return -np.sign(depth) * np.sqrt(np.abs(depth))


def draw_ground(ax, view: View) -> None:
    """Snow, organic layer, summer thaw and frozen ground, and the profile of mean temperatures."""
    p, s = view.parameters, view.state
    boundary = p["deep_boundary_temperature_k"] - FREEZING_POINT_K
    organic = view.last("organic_layer_m", s["organic_depth"]) * p["moss"]
    mean = p["mean_annual_temperature_c"]
    air = view.last("air_temperature_c", mean)
    surface = view.last("surface_soil_temperature_c", temperature(s["surface_heat"], *soil_node(p, "surface")))
    deep = view.last("deep_soil_temperature_c", temperature(s["deep_heat"], *soil_node(p, "deep")))
    depths = organic + np.array([0.5 * p["surface_soil_depth_m"], p["deep_soil_node_m"], p["boundary_depth_m"]])
    temperatures = np.array([surface, deep, boundary])
    active = view.last("active_layer_depth_m")
    swe = view.last("peak_swe_mm", s["swe"])
    snow = view.last("peak_snow_depth_m", s["swe"] / s["snow_density"])

    points = np.concatenate([[air], temperatures]), np.concatenate([[0.88], height_on_scale(depths)])
    low, high = min(mean - 4.0, boundary - 3.0, points[0].min() - 1.0), max(mean + 4.0, 4.0, points[0].max() + 2.0)
    bottom = height_on_scale(1.04 * depths[-1])
    ax.set(xlim=(low, high), ylim=(bottom, 1.05))
    y = np.linspace(height_on_scale(organic), bottom, 160)
    ground_depth = y**2
    column = np.interp(ground_depth, depths, temperatures)
    cold = np.clip(-column / 6.0, 0.0, 1.0)[:, None]
    colours = (1.0 - cold) * _rgb(FROZEN_WARM) + cold * _rgb(FROZEN_COLD)
    colours[(ground_depth <= active) | (column > 0.0)] = _rgb(THAWED)
    ax.imshow(colours[:, None], extent=(low, high, bottom, y[0]), aspect="auto", interpolation="nearest")
    ax.axhspan(height_on_scale(organic), 0.0, color=ORGANIC, linewidth=0)
    ax.axhspan(0.0, 1.05, color="#dfeaf2", linewidth=0)
    ax.axhspan(0.0, height_on_scale(-snow), color="white", linewidth=0)
    ax.set(xlim=(low, high), ylim=(bottom, 1.05))

    ax.axvline(0.0, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    ax.plot(*points, color="white", linewidth=3.2, solid_joinstyle="round")
    ax.plot(
        *points,
        color="#b5361c",
        linewidth=1.6,
        marker="o",
        markersize=4.5,
        markeredgecolor="white",
        markeredgewidth=0.7,
    )
    air_name = "air" if view.year else "air, annual mean"
    for name, x, y in zip((air_name, "surface soil", "deep soil", "boundary"), *points, strict=True):
        left = x > 0.3 * low + 0.7 * high  # of the point, where the label would be cut off on its right
        offset, side = (-0.02, "right") if left else (0.02, "left")
        x_of_label = x + offset * (high - low)
        ax.text(x_of_label, y, f"{name} {x:.1f}", fontsize=SMALL, color=INK, ha=side, va="center", bbox=LABEL)

    labels = [(f"snow, {swe:.0f} mm of water", "left", -0.25 * max(snow, 0.1))]
    if organic > 0.0:
        labels.append((f"organic layer {100 * organic:.0f} cm", "right", 0.25 * organic))
    if view.year:
        thaws = f"thaws in summer, to {active:.2f} m" if active < depths[-1] - 0.01 else "no permafrost"
        labels.append((thaws, "left", max(0.5 * (organic + active), 0.3)))
    frozen = np.interp(0.5 * (active + depths[-1]), depths, temperatures) < 0.0
    always = "all year" if view.year else "now"
    labels.append((f"{'frozen' if frozen else 'thawed'} {always}", "left", 0.5 * (active + depths[-1])))
    for text, side, depth in labels:
        x = low + (0.012 if side == "left" else 0.988) * (high - low)
        ax.text(x, height_on_scale(depth), text, fontsize=SMALL, color=INK, ha=side, va="center", bbox=LABEL)

    ticks = {-0.5: "0.5", 0.0: "0", 0.5: "0.5", 2.0: "2", 5.0: "5", 12.0: "12 m"}
    ax.set_yticks([height_on_scale(depth) for depth in ticks], list(ticks.values()))
    step = 4.0 if high - low > 14.0 else 2.0
    ax.set_xticks(np.arange(step * np.ceil(low / step), high + 0.1, step))
    ax.tick_params(labelsize=SMALL, length=2, pad=2, colors=INK)
    what = "mean of the year (°C)" if view.year else "now, before the first year (°C)"
    ax.text(0.5, -0.17, what, fontsize=SMALL, color=INK, ha="center", va="center", transform=ax.transAxes)
    for side in ax.spines.values():
        side.set_visible(False)


def _rgb(colour: str) -> np.ndarray:
    return np.array([int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])


# ------------------------------------------------------------------------------------------------------------
# The years so far
# ------------------------------------------------------------------------------------------------------------


def draw_years(figure, view: View) -> None:
    """Stems, carbon stocks and the return of each objective over the years."""
    stems, stocks = (figure.add_axes(place) for place in CHARTS)
    returns = [figure.add_axes(place) for place in return_charts(len(view.weights))]
    years = np.arange(view.year + 1)

    now = view.stems.sum(axis=1)
    density = np.concatenate([view.history["density_stems_ha"], now.sum()[None] if not view.year else []])
    share = np.concatenate([view.history["conifer_fraction"], [now[0] / max(now.sum(), 1e-9)] if not view.year else []])
    after = years[-len(density) :]
    _areas(
        stems,
        after,
        [("conifers", share * density, CONIFER), ("deciduous", (1.0 - share) * density, DECIDUOUS)],
    )
    _frame(stems, view, "stems/ha", 0.0, 500.0 * np.ceil(max(density.max(), 1.0) / 500.0))

    layers = [
        ("soil", "soil_kgc_m2", SOIL),
        ("dead", "deadwood_kgc_m2", DEADWOOD),
        ("trees", "biomass_kgc_m2", BIOMASS),
        ("products", "hwp_kgc_m2", PRODUCTS),
    ]
    pools = [(label, view.with_start(name), colour) for label, name, colour in layers]
    _areas(stocks, years, pools)
    _frame(stocks, view, "kgC/m²", 0.0, 4.0 * np.ceil(np.sum([pool for _, pool, _ in pools], axis=0).max() / 4.0))

    for ax, name, colour in zip(returns, view.weights, cycle(RETURNS), strict=False):
        total = np.concatenate([[0.0], np.cumsum(view.history[f"{name}_reward"])])
        ax.axhline(0.0, color=FAINT, linewidth=0.7)
        ax.plot(years, total, color=colour, linewidth=1.8)
        ax.plot(years[-1:], total[-1:], "o", color=colour, markersize=3.5)
        step = 1.0 if np.ptp(total) < 4.0 else 5.0
        low, high = (
            step * np.floor(min(total.min(), -0.5) / step),
            step * np.ceil(max(total.max(), 0.5) / step),
        )
        _frame(ax, view, f"{name} return {total[-1]:+.2f}", low, high)
    last = returns[-1]
    last.tick_params(labelbottom=True)
    last.set_xticks(last.get_xticks(), [*(f"{year:g}" for year in last.get_xticks()[:-1]), f"{view.years} yr"])


def return_charts(number: int) -> list[tuple[float, float, float, float]]:
    """Places of so many charts, the first on top, as high as the room lets them be."""
    gap = CHART_GAP if number <= 2 else 0.6 * CHART_GAP
    height = (RETURN_HEIGHT - (number - 1) * gap) / number
    bottoms = [RETURN_BOTTOM + k * (height + gap) for k in reversed(range(number))]
    return [(CHART_LEFT, bottom, CHART_WIDTH, height) for bottom in bottoms]


def _areas(ax, years, layers) -> None:
    """Stacked areas; before the first year, stacked at year 0."""
    base = np.zeros(len(years))
    for label, values, colour in layers:
        ax.fill_between(years, base, base + values, color=colour, linewidth=0.6, label=label)
        if len(years) == 1:
            ax.plot([years[0]] * 2, [base[0], base[0] + values[0]], color=colour, linewidth=4)
        base = base + values
    ax.legend(
        loc="lower right",
        bbox_to_anchor=(1.02, 0.94),
        ncols=len(layers),
        fontsize=SMALL - 0.5,
        frameon=False,
        handlelength=0.7,
        handletextpad=0.25,
        columnspacing=0.5,
        borderpad=0.0,
        labelcolor=INK,
    )


def _frame(ax, view: View, title: str, low: float, high: float) -> None:
    """Axes of a small chart, with round limits so that a video does not flicker."""
    ax.set(xlim=(0, view.years), ylim=(low, high))
    ax.text(0.0, 1.05, title, fontsize=SMALL + 0.5, color=INK, weight="bold", transform=ax.transAxes)
    ax.set_xticks(np.linspace(0, view.years, 6).astype(int))
    ax.set_yticks(sorted({low, 0.0, high}))
    ax.tick_params(labelsize=SMALL, length=2, pad=2, colors=INK, labelbottom=False)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color(FAINT)
