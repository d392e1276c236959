from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from tiny_runs import TINY_RUNS, write_run, write_run_of_three

from analysis import experiments, make_figures, make_tables, methods, stored
from analysis.figures import (
    algorithm_comparison,
    common,
    learning_difficulty,
    many_objectives,
    site_influence,
    training_dynamics,
)
from analysis.figures.common import no_data
from analysis.results import Results

ROOT = Path(__file__).parents[1]

PANELS = {
    "learning_curves": 6,
    "learning_asymmetry": 6,
    "algorithm_comparison": 4,
    "strategies": 4,
    "site_influence": 2,
    "trade_off_coverage": 1 + len(methods.LEARNERS),
    "training_dynamics": 2,
    "performance_panel": 4,
    "individual_objectives": 4,
    "demographics": 7,
    "learning_difficulty": 4,
}


def lettered(figure):
    """Panels of a figure by letter."""
    return {ax.get_title("left")[1]: ax for ax in figure.get_axes() if ax.get_title("left")}


def words(ax):
    return " ".join(text.get_text().replace("\n", " ") for text in ax.texts)


@pytest.fixture(scope="module")
def figures():
    """Figures of the tiny runs: the curriculum and zero change, nothing else."""
    results = Results((TINY_RUNS,), experiments.jobs(), TINY_RUNS / "no studies")
    return {make_tables.name_of(module): make_figures.draw(module, results) for module in make_figures.FIGURES}


def test_the_papers_panels(figures):
    assert {name: len(lettered(figure)) for name, figure in figures.items()} == PANELS
    for name, figure in figures.items():
        assert figure.get_supxlabel(), name  # what the bands are


def test_a_panel_without_data_says_which_command_makes_it(figures):
    for ax in lettered(figures["learning_asymmetry"]).values():
        assert "not run yet: python cleanrl_style/eupg_fixed_lambda.py" in words(ax)
    assert "python cleanrl_style/eupg_var_lambda.py" in words(lettered(figures["trade_off_coverage"])["b"])


def test_a_panel_that_lacks_some_names_them(figures):
    lacking = ", ".join(script for script in methods.LEARNERS if script != "ppo_curriculum")
    for name in ("strategies", "training_dynamics", "individual_objectives", "demographics"):
        for ax in lettered(figures[name]).values():
            assert f"not run yet: {lacking} (python analysis/reproduce.py --only main)" in words(ax)


def test_what_is_drawn_is_what_the_runs_hold(figures):
    carbon = lettered(figures["individual_objectives"])["c"].lines[0]
    assert carbon.get_xdata().tolist() == [0, 0.5, 1] and carbon.get_ydata() == pytest.approx([0, 1, 2])
    density = lettered(figures["strategies"])["b"].lines[0]
    assert density.get_ydata() == pytest.approx([400, 1200])
    ages = lettered(figures["demographics"])["g"]
    assert [label.get_text() for label in ages.get_yticklabels()] == ["0", "0.5", "1"]
    assert len(ages.lines) == 3 * 3  # a weight: seeds, line, median
    learning = lettered(figures["individual_objectives"])["a"].lines[0]
    assert learning.get_ydata() == pytest.approx([0, 1, 2, 3])
    assert learning.get_xdata() == pytest.approx(np.array([75, 150, 225, 300]) - 3.75)


def test_gains_are_of_the_validation_sites(tmp_path):
    course = pd.DataFrame({"global_step": [500, 500, 1000, 1000], "carbon_gain": [0.0, 1.0, 2.0, 4.0]})
    for seed in (1, 2):
        write_run(tmp_path / str(seed), "ppo_gated", seed, vectorization="lockstep")
        course.assign(carbon_gain=course.carbon_gain * seed).to_csv(
            tmp_path / str(seed) / "validation.csv", index=False
        )
    ax = Figure().subplots()
    common.validation_curve(
        ax, Results((tmp_path,), experiments.jobs(), tmp_path).of("main", "ppo_gated"), "carbon_gain", "C0"
    )
    assert ax.lines[0].get_xydata().tolist() == [[0.5, 0.75], [1.0, 4.5]]


def test_the_same_bytes_again(tmp_path, monkeypatch):
    monkeypatch.setattr(make_figures, "FIGURES", (training_dynamics,))
    write_run(tmp_path / "runs" / "gated", "ppo_gated", vectorization="lockstep")
    for name in ("first", "second"):
        make_figures.main(make_figures.Args(runs_dir=(tmp_path / "runs",), figures_dir=tmp_path / name))
    names = sorted(path.name for path in (tmp_path / "first").iterdir())
    assert names == ["training_dynamics.pdf", "training_dynamics.png"]
    for name in names:
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes(), name


def test_a_figure_without_data_is_removed(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(make_figures, "FIGURES", (training_dynamics, algorithm_comparison))
    write_run(tmp_path / "runs" / "zero", "zero_change")
    (tmp_path / "figures").mkdir()
    for name in ("training_dynamics.png", "training_dynamics.pdf", "many_objectives_timber-v0.png", "mine.png"):
        (tmp_path / "figures" / name).touch()
    make_figures.main(make_figures.Args(runs_dir=(tmp_path / "runs",), figures_dir=tmp_path / "figures"))
    left = {path.name for path in (tmp_path / "figures").iterdir()}
    assert left == {"mine.png", "algorithm_comparison.png", "algorithm_comparison.pdf"}
    assert "training_dynamics: python analysis/reproduce.py --only main\n" in capsys.readouterr().out


def test_three_objectives_have_a_figure_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setattr(make_figures, "FIGURES", ())
    returns = np.array([[3.0, 0.0, 1.0], [0.0, 5.0, 1.0], [1.0, 1.0, 2.0]])  # at all weight on each
    for seed in (1, 2):
        write_run_of_three(tmp_path / "runs" / f"ours {seed}", "ppo_gated", seed * returns, seed)
    write_run_of_three(tmp_path / "runs" / "zero", "zero_change", np.full((3, 3), 0.5))
    make_figures.main(make_figures.Args(runs_dir=(tmp_path / "runs",), figures_dir=tmp_path / "figures"))
    names = sorted(path.name for path in (tmp_path / "figures").iterdir())
    assert names == ["many_objectives_timber-v0.pdf", "many_objectives_timber-v0.png"]

    results = Results((tmp_path / "runs",), experiments.jobs(), TINY_RUNS / "no studies")
    figure = Figure()
    many_objectives.figures(results)["many_objectives_timber-v0"][1](figure)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[-1] == "fixed strategy, which does not look at the weight"
    lines, *triangles = figure.get_axes()[:4]
    curves = [line for line in lines.lines if len(line.get_xdata()) == 3]
    assert len(curves) == 4  # three weights, and zero change, which looks at none
    mean = 1.5 * returns
    low, high = np.minimum(mean.min(axis=0), 0.5), mean.max(axis=0)
    drawn = {line.get_color(): line.get_ydata() for line in curves}
    for colour, point in zip(many_objectives.COLOURS, mean, strict=False):
        np.testing.assert_allclose(drawn[colour], (point - low) / (high - low))
    np.testing.assert_allclose(drawn[many_objectives.REFERENCE], (0.5 - low) / (high - low))
    for k, triangle in enumerate(triangles):
        points = triangle.collections[0]
        corner = points.get_offsets()[np.argmax(points.get_array())]
        np.testing.assert_allclose(corner, [[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]][k], atol=1e-12)
    assert not many_objectives.figures(Results((TINY_RUNS,), experiments.jobs(), TINY_RUNS / "no studies"))


def test_no_fixed_strategy_no_dashed_line(tmp_path):
    write_run_of_three(tmp_path / "ours", "ppo_gated", np.eye(3), 1)
    figure = Figure()
    many_objectives.figures(Results((tmp_path,), experiments.jobs(), tmp_path))["many_objectives_timber-v0"][1](figure)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["carbon", "thaw", "timber", "shared"]
    assert "dashed" not in many_objectives.CAPTION


def test_sites_differ_more_than_methods():
    ax = Figure().subplots()
    site_influence.draw_sites(ax, pd.DataFrame({"one": [0.0, -20.0], "other": [2.0, -18.0]}, index=[1, 2]))
    assert words(ax) == "sd between sites: 14.1 sd between methods on a site: 1.4"
    assert ax.lines[0].get_ydata().tolist() == [1.0, -19.0]
    assert [segment[:, 1].tolist() for segment in ax.collections[0].get_segments()] == [[0.0, 2.0], [-20.0, -18.0]]


def test_an_effect_whose_course_is_drawn_is_told_from_none():
    table = stored.read(ROOT / "results/studies/signal_to_noise.csv", text=("year",))
    drawn = {"contrast": learning_difficulty.COURSE, "year": learning_difficulty.COURSE_YEAR, "reference": "uniform"}
    case = table[(table[list(drawn)] == list(drawn.values())).all(axis=1) & (table.weighting == "return")]
    ends = case.set_index("objective").loc[["carbon", "thaw"], ["effect_low", "effect_high"]]
    assert (ends.prod(axis=1) > 0).all()


def test_ids_that_differ_behind_a_dot_have_files_of_their_own():
    stems = [
        Path(many_objectives.file_stem(f"ponds:pond.{size}-v0")).with_suffix(".csv") for size in ("small", "large")
    ]
    assert len(set(stems)) == 2


def test_marks_lie_within_their_axis():
    assert learning_difficulty.around(np.array([0.0, 3.0, 60.0, np.inf]), 2.0, 100.0) == (1.0, 120.0)
    assert learning_difficulty.around(np.array([50.0]), 2.0, 100.0) == (2.0, 100.0)


def test_an_empty_panel_shows_its_command():
    ax = Figure().subplots()
    no_data(ax, "python a.py --seed 1")
    assert words(ax) == "not run yet: python a.py --seed 1"


def test_figures_of_the_quick_jobs_are_drawn():
    results = Results((TINY_RUNS,), experiments.quick_jobs(), TINY_RUNS / "no studies")
    for module in make_figures.FIGURES:
        assert make_figures.draw(module, results).get_axes()


def test_there_are_letters_for_any_number_of_panels():
    axes = Figure().subplots(30)
    common.letter(axes, ["title"] * 30)
    names = [ax.get_title(loc="left").split()[0] for ax in axes]
    assert names[:2] == ["(a)", "(b)"] and names[25:27] == ["(z)", "(aa)"] and len(set(names)) == 30
