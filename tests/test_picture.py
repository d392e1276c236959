import itertools

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RenderCollection
from PIL import Image

import boreal_env
from analysis import draw_readme
from cleanrl_style.protocol.command_line import FRAME_SIZE, save_animation
from sim.task.picture import HEIGHT, WIDTH, preference, return_charts, view_of

NO_FIRE = {"fire": False, "insects": False}


@pytest.fixture
def env():
    return boreal_env.BorealEnv(render_mode="rgb_array", mechanisms=NO_FIRE)


def test_picture_of_every_year(env):
    env.reset(seed=3)
    first = env.render()
    assert first.shape == (HEIGHT, WIDTH, 3) and first.dtype == np.uint8
    assert first.std() > 20.0
    env.step(22)
    second = env.render()
    assert second.shape == first.shape
    assert (first != second).any()


def test_same_state_gives_the_same_pixels_and_drawing_changes_nothing(env):
    def play(draw_every_year):
        env.reset(seed=5)
        for _ in range(3):
            if draw_every_year:
                env.render()
            observation = env.step(22)[0]
        return env.render(), env.render(), observation

    first, again, observation = play(False)
    drawn, _, drawn_observation = play(True)
    assert np.array_equal(first, again) and np.array_equal(first, drawn)
    assert np.array_equal(observation, drawn_observation)


def test_trees_show_density_and_species(env):
    def colours(density, conifers):
        env.reset(seed=1)
        stands = env.unwrapped._episodes.stands
        stands.start(
            [0],
            [boreal_env.sim.sample_site(1)],
            stands.seeds,
            {0: {"density_stems_ha": density, "conifer_fraction": conifers, "oldest_age_years": 80.0}},
        )
        scene = env.render()[60:300, :500].astype(int)
        red, green, blue = scene[..., 0], scene[..., 1], scene[..., 2]
        return int((green > red + 40).sum()), int((red > blue + 80).sum())

    green_few, gold_few = colours(200.0, 0.5)
    green_many, gold_many = colours(1500.0, 0.5)
    assert green_many > 2 * green_few > 0 and gold_many > 2 * gold_few > 0
    assert colours(1500.0, 1.0)[1] == 0 and colours(1500.0, 0.0)[0] == 0
    assert colours(0.0, 0.5) == (0, 0)


def test_burnt_and_empty_stands_can_be_drawn():
    always = {"fire_base_probability": 0.05, "fire_drought_threshold": 0.0}
    env = boreal_env.BorealEnv(render_mode="rgb_array", parameter_overrides=always, record_years=True, years=10)
    env.reset(seed=2)
    pictures = [env.render()]
    terminated = False
    while not terminated:
        *_, terminated, _, info = env.step(24)
        pictures.append(env.render())
    assert (info["years"]["fire_mortality"] > 0.0).any()
    assert len({picture.tobytes() for picture in pictures}) == 11

    bare = boreal_env.BorealEnv(render_mode="rgb_array", initial_ranges={"density_stems_ha": (0.0, 0.0)})
    bare.reset(seed=2)
    assert bare.render().shape == (HEIGHT, WIDTH, 3)


def test_without_render_mode_nothing_is_drawn():
    env = boreal_env.BorealEnv()
    env.reset(seed=1)
    assert env.render() is None


def test_frames_of_a_video():
    """As `RecordVideo` collects them, which needs moviepy to write them."""
    env = RenderCollection(gym.make("boreal-generalist-v0", render_mode="rgb_array", years=3))
    env.reset(seed=1)
    for _ in range(3):
        env.step(12)
    frames = env.render()
    assert len(frames) == 4
    assert all(frame.shape == (HEIGHT, WIDTH, 3) and frame.dtype == np.uint8 for frame in frames)
    assert all((one != other).any() for one, other in itertools.pairwise(frames))


def test_an_animation_has_all_frames_and_colours(tmp_path):
    pictures = [Image.new("RGB", FRAME_SIZE, colour) for colour in ("red", "blue", "red", "blue")]
    save_animation(tmp_path / "four.gif", [np.array(picture) for picture in pictures])
    with Image.open(tmp_path / "four.gif") as animation:
        assert animation.n_frames == 4 and animation.size == FRAME_SIZE
        for k, primary in enumerate((0, 2, 0, 2)):
            animation.seek(k)
            assert animation.convert("RGB").getpixel((0, 0))[primary] > 200


def test_a_folder_without_a_policy_is_refused(tmp_path):
    with pytest.raises(SystemExit, match="--policy .*: neither the folder of a finished run"):
        draw_readme.main(draw_readme.Args(policy=str(tmp_path)))


def timber(year):
    """What is cut."""
    return year["harvest_kgc_m2"]


@pytest.mark.parametrize("objectives", [("thaw",), ("carbon", "thaw", boreal_env.Objective("timber", timber))], ids=len)
def test_pictures_of_any_number_of_objectives(objectives):
    env = boreal_env.BorealEnv(render_mode="rgb_array", objectives=objectives, mechanisms=NO_FIRE)
    two = boreal_env.BorealEnv(render_mode="rgb_array", mechanisms=NO_FIRE)
    env.reset(seed=3), two.reset(seed=3)
    env.step(22), two.step(22)
    picture, of_two = env.render(), two.render()
    scene, charts = (slice(40, 480), slice(0, 500)), (slice(270, 500), slice(520, 800))
    assert np.array_equal(picture[scene], of_two[scene])
    assert (picture[charts] != of_two[charts]).any()


def test_charts_of_the_returns_share_the_room():
    for number in range(1, 6):
        places = return_charts(number)
        assert len(places) == number
        tops = [bottom + height for _, bottom, _, height in places]
        assert tops[0] == pytest.approx(0.428) and places[-1][1] == pytest.approx(0.057)
        assert all(below < place[1] for below, place in zip(tops[1:], places, strict=False))


def test_the_title_has_the_weights():
    def title(**arguments):
        env = boreal_env.BorealEnv(render_mode="rgb_array", **arguments)
        env.reset(seed=1)
        return preference(view_of(env._episodes, 0))

    assert title(fixed_preference=0.25) == "carbon weight 0.25"
    three = ("carbon", "thaw", boreal_env.Objective("timber", timber))
    assert title(objectives=three, fixed_preference=[0.5, 0.3, 0.2]) == "weights carbon 0.50, thaw 0.30, timber 0.20"
