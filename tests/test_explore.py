"""The page to play with: stands and players, the page without a browser, and in one."""

import json
import re
import socket
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from scripts import run_script

import boreal_env
import sim
from analysis.exploring import browser, players, stands
from analysis.exploring.stands import PAPER, Setting, Stand

NO_PANEL = 'the page needs panel: pip install -e ".[explore]"'
CONIFERS = players.action_of(100.0, 1.0)


def played(setting, player, years, preference=0.5):
    stand = Stand(setting, preference)
    for _ in range(years):
        stand.step(player(stand))
    return stand


@pytest.fixture(scope="module")
def setting():
    return Setting(PAPER, *stands.evaluation_site(3))


def test_an_evaluation_site_is_the_episode_that_methods_are_evaluated_on(setting):
    env = gym.make(PAPER)
    env.reset(seed=setting.seed, options={"preference": 0.3})
    stand = Stand(setting, 0.3)
    for _ in range(4):
        observation, reward, *_ = env.step(CONIFERS)
        stand.step(CONIFERS)
        assert np.array_equal(observation, stand.observation) and np.array_equal(reward, stand.rewards[-1])


@pytest.mark.parametrize("number", [0, 201])
def test_only_evaluation_sites_have_numbers(number):
    with pytest.raises(ValueError, match=f"site {number}: 1 to 200 are allowed"):
        stands.evaluation_site(number)


def test_a_year_can_be_looked_at_again_and_played_otherwise(setting):
    planted = played(setting, players.constant(CONIFERS), 6)
    planted.look(3)
    assert planted.year == 3 and planted.played == 6 and len(planted.view().history["carbon_reward"]) == 3
    assert planted.whole_view().year == 6 and planted.year == 3
    before = planted.rewards
    for _ in range(3):
        planted.step(CONIFERS)
    assert np.array_equal(planted.rewards, before)
    planted.look(3)
    planted.step(boreal_env.NO_CHANGE)
    assert planted.actions == [CONIFERS] * 3 + [boreal_env.NO_CHANGE] and planted.played == 4
    assert np.array_equal(planted.returns, planted.rewards.sum(axis=0)) and len(planted.rewards) == 4


def test_days_are_those_of_the_year_and_change_nothing(setting):
    looked_at, other = (played(setting, players.constant(CONIFERS), 3) for _ in range(2))
    days = looked_at.days()
    whole = sim.simulate(
        setting.site, CONIFERS, seed=int(looked_at.env._episodes.episode_seeds[0]), years=3, output="daily"
    )
    assert np.array_equal(days, whole[whole.year == 2][days.columns])
    looked_at.step(12), other.step(12)
    assert np.array_equal(looked_at.observation, other.observation)
    assert Stand(setting).days().empty


def test_stands_of_a_setting_share_first_stocks_and_weather(setting):
    planted, alone = (
        played(setting, player, 2) for player in (players.constant(CONIFERS), players.STRATEGIES["Do nothing"])
    )
    assert planted.view().start == pytest.approx(alone.view().start)
    for name in ("air_temperature_c", "precipitation_mm"):
        assert np.array_equal(planted.days()[name], alone.days()[name])
    assert planted.view().stems.sum() > alone.view().stems.sum() + 100


def test_the_temperature_goes_with_the_latitude_and_limits_are_kept():
    site, _ = stands.place("Poker Flat, Alaska (65.1 °N)")
    assert site["latitude_deg"] == pytest.approx(65.1, abs=0.1) and site["mean_annual_temperature_c"] == -2.7
    north = stands.moved(site, "latitude_deg", 60.0)
    assert north["mean_annual_temperature_c"] == pytest.approx(-5.0 - 20.0 / 9.0) and north["wind_speed_m_s"] == 3.0
    warm = stands.moved(north, "mean_annual_temperature_c", 1.0)
    assert warm["latitude_deg"] == 60.0 and warm["mean_annual_temperature_c"] == 1.0
    with pytest.raises(ValueError, match="wind_speed_m_s = 40 is outside its physical limits"):
        stands.moved(site, "wind_speed_m_s", 40.0)


def test_a_constant_plan_rests_where_it_cannot_be_carried_out(setting):
    cut, plant = players.action_of(-100.0, 0.5), players.action_of(50.0, 0.25)
    assert played(setting, players.constant(plant), 1).actions == [plant] == [16]
    assert set(played(setting, players.constant(cut), 6).actions) == {cut, boreal_env.NO_CHANGE}


def saved_run(folder, width=105):
    torch = pytest.importorskip("torch")
    from cleanrl_style import ppo_gated

    space = gym.spaces.Box(-np.inf, np.inf, (width,), np.float32)
    torch.manual_seed(4)
    agent = ppo_gated.Agent(SimpleNamespace(single_observation_space=space))
    folder.mkdir(parents=True)
    run = {"script": "ppo_gated", "arguments": {"env_id": "boreal-site-specific-v0"}}
    saved = {"agent": agent.state_dict(), "arguments": {"num_values": 1}, "observation_shape": (width,), "run": run}
    torch.save(saved, folder / "policy.pt")
    (folder / "config.json").write_text(json.dumps(run))
    return str(folder)


def test_a_trained_policy_plays_as_in_the_evaluation(setting, tmp_path):
    from cleanrl_style import protocol
    from cleanrl_style.protocol.evaluation import play

    folder = saved_run(tmp_path / "runs" / "one")
    assert players.trained_runs(tmp_path) == [*protocol.shipped_policies(), folder]
    task = protocol.Task.of(PAPER, years=3)
    for greedy in (True, False):
        stand = Stand(setting, 0.25)
        player = players.trained(folder, stand, greedy)
        for _ in range(3):
            stand.step(player(stand))
        policy, weights = protocol.load_policy(folder), np.array([[0.25, 0.75]])
        returns, _ = play(task, task.make_lockstep(1), policy, weights, [setting.seed], np.array([greedy]))
        assert stand.returns == pytest.approx(returns[0])


def test_a_policy_that_cannot_play_is_refused(setting, tmp_path):
    stand = Stand(setting)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        players.trained(str(tmp_path / "nowhere"), stand, True)
    folder = saved_run(tmp_path / "narrow", 43)
    with pytest.raises(ValueError, match="trained on another observation than the 105 numbers"):
        players.trained(folder, stand, True)
    (tmp_path / "narrow" / "policy.pt").write_bytes(b"no policy")
    with pytest.raises(ValueError, match="policy.pt: .*no policy that a script of this project has written"):
        players.trained(folder, stand, True)


# ---------------------------------------------------------------------------------------------------------------
# The page, without a browser
# ---------------------------------------------------------------------------------------------------------------


@pytest.fixture
def page(tmp_path):
    pytest.importorskip("panel", reason=NO_PANEL)
    from analysis.explore import Page

    page = Page(tmp_path)
    page.layout()
    page.start_over()
    page.site.world.value = PAPER
    return page


def test_years_are_played_and_shown(page):
    from analysis.exploring.stand_card import signed

    a, b = page.cards.values()
    page.forward(3)
    assert [stand.played for stand in page.stands.values()] == [3, 3, 3] and page.year.value == 3
    assert a.stand.actions != b.stand.actions and page.stands["left alone"].actions == [boreal_env.NO_CHANGE] * 3
    assert a.picture.object.startswith(b"\x89PNG") and a.picture.object != b.picture.object
    gain = b.stand.weights @ (b.stand.returns - page.alone.returns)
    assert f"<td>{signed(gain)}</td></tr></table>" in b.numbers.object
    lines = page.returns["Weighted gain"].source.data
    assert lines["x"].tolist() == [0, 1, 2, 3] and lines["B"][-1] == pytest.approx(gain)
    assert not lines["left alone"].any()
    days = page.days["Snow (cm)"].source.data
    assert len(days["A"]) == 365 and (days["A"] != days["B"]).any()
    page.look(1)
    assert page.alone.year == 1 and page.alone.played == 3 and "After 1 of 50 years" in a.numbers.object
    page.look(5)
    assert page.alone.played == 5
    page.start_over()
    assert page.alone.played == 0 and "After 0 of 50 years" in a.numbers.object


def test_another_site_is_played_as_far(page):
    page.forward(2)
    returns = page.alone.returns
    page.site.move("latitude_deg", 64.0)
    page.restart()
    assert page.alone.played == 2 and (page.alone.returns != returns).any()
    assert page.site.sliders["mean_annual_temperature_c"].value == pytest.approx(-9.4, abs=0.1)
    page.site.place.value = "Middle of all ranges"
    assert page.site.setting() == Setting(PAPER, sim.middle_site(), 1) and not page.site.number.visible
    assert page.site.sliders["deep_boundary_temperature_k"].visible
    page.site.seed.value = 9
    assert all(stand.setting.seed == 9 for stand in page.stands.values())


def test_without_a_seed_no_stand_draws_its_own(page):
    page.site.seed.value = None
    assert "type a seed, 0 to" in page.message.object and page.buttons["A year"].disabled
    page.site.seed.value = 3
    assert not page.message.visible and all(stand.setting.seed == 3 for stand in page.stands.values())


def test_my_own_hand_goes_on_from_what_was_done(page):
    card = page.cards["B"]
    page.forward(2)
    before = card.stand.actions
    card.policy.value = "You, year by year"
    card.change.value, card.mix.value = -100.0, 0.25
    assert card.hint.visible == (not card.stand.masks[1])
    card.change.value = 50.0
    assert not card.hint.visible
    page.forward(1)
    card.change.value = 0.0
    page.forward(1)
    assert card.stand.actions == [*before, 16, 11]
    page.site.seed.value = 5
    assert card.stand.actions == [*before, 16, 11]
    page.look(2)
    page.forward(1)
    assert card.stand.actions == [*before, 11]


def test_what_is_wrong_is_said_in_one_line_and_no_year_is_played_with_it(page, tmp_path):
    card = page.cards["A"]
    page.forward(1)
    stand = card.stand
    card.policy.value = "The policy of a run's folder"
    assert "stand A: type the folder of the run" in page.message.object and card.folder.visible
    card.folder.value = str(tmp_path / "no<where>")
    assert page.message.visible and "no&lt;where&gt;" in page.message.object
    assert card.stand is stand
    steps = [page.buttons[name] for name in ("A year", "Ten years", "To the end", "Play")]
    assert all(button.disabled for button in steps) and not page.buttons["Start over"].disabled
    page.start_over()
    assert page.message.visible and all(button.disabled for button in steps)
    card.folder.value = saved_run(tmp_path / "run")
    assert not page.message.visible and card.stand is not stand and not any(button.disabled for button in steps)
    page.forward(1)
    assert card.stand.played == 2


def test_another_stands_change_plays_nothing_that_the_page_does_not_say(page):
    first, second = page.cards.values()
    page.forward(1)
    first.policy.value = "The policy of a run's folder"
    before = first.stand
    page.replay(second)
    assert page.message.visible and page.buttons["A year"].disabled and first.stand is before


# ---------------------------------------------------------------------------------------------------------------
# In a browser
# ---------------------------------------------------------------------------------------------------------------


def test_the_page_in_a_browser(tmp_path):
    pytest.importorskip("panel", reason=NO_PANEL)
    pytest.importorskip("playwright", reason='needs playwright: pip install -e ".[explore-test]"')
    if browser.program() is None:
        pytest.skip(f"no browser: one of {', '.join(browser.PROGRAMS)} has to be installed")
    with browser.served(tmp_path) as address, browser.opened(address, 1280, 900) as tab:
        tab.set_default_timeout(120_000)  # of a machine that compiles the physics beside it
        requests, problems = [], []
        tab.on("request", lambda request: requests.append(request.url))
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.reload()
        tab.get_by_text("After 0 of 50 years").first.wait_for()
        tab.get_by_role("button", name="Ten years").click()
        tab.get_by_text("After 10 of 50 years").nth(1).wait_for()
        tab.get_by_text("Through year 10, day by day").wait_for()
        tab.get_by_label("Who manages it").first.select_option("Do nothing")
        tab.locator("tr.sum").first.get_by_text("+0.00").wait_for()

        tab.get_by_label("Who manages it").nth(1).select_option("The policy of a run's folder")
        folder = tab.get_by_label("Folder of the run").nth(1)
        folder.fill("runs/nowhere")
        folder.press("Enter")
        tab.get_by_text("runs/nowhere").wait_for()
        assert tab.get_by_role("button", name="Play").is_disabled()
        folder.fill(saved_run(tmp_path / "own"))
        folder.press("Enter")
        tab.get_by_text("runs/nowhere").wait_for(state="hidden")
        tab.get_by_role("button", name="Play").click()
        tab.get_by_text(re.compile("After 1[23] of 50 years")).first.wait_for()
        tab.get_by_role("button", name="Pause").click()
        year = tab.locator("[role=slider][aria-valuemax='50.0']")
        for _ in range(2):  # a drag that ends where the last one did is heard, too
            tab.get_by_role("button", name="To the end").click()
            tab.get_by_text("After 50 of 50 years").first.wait_for()
            year.press("Home")
            tab.get_by_text("After 0 of 50 years").first.wait_for()

        tab.set_viewport_size({"width": 390, "height": 800})
        tab.wait_for_timeout(500)
        assert tab.evaluate("document.documentElement.scrollWidth") <= 390
        assert problems == []
        hosts = {url.split("/")[2] for url in requests if not url.startswith(("data:", "blob:"))}
        assert hosts == {address.split("/")[2]}  # nothing comes from the internet


@pytest.mark.parametrize(
    "given, message",
    [
        (("--runs", "/nowhere"), "--runs /nowhere: no such folder"),
        (("--port", "0"), "--port 0: 1 to 65535 are allowed"),
        (("--prot", "5"), "Unrecognized options: --prot"),
    ],
)
def test_a_bad_flag_of_the_page_gets_one_line(given, message):
    pytest.importorskip("panel", reason=NO_PANEL)
    with pytest.raises(SystemExit, match=f"^error: {message}"):
        run_script("analysis/explore.py", *given)


def test_a_port_that_is_taken_is_refused(tmp_path):
    pytest.importorskip("panel", reason=NO_PANEL)
    with socket.socket() as taken:
        taken.bind(("localhost", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(SystemExit, match=rf"^error: --port {port}: [^\n]*$"):
            run_script("analysis/explore.py", "--port", port, "--no-show")
