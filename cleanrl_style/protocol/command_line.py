"""`python -m boreal_env`: what there is, and fifty years of a trained policy to watch.

python -m boreal_env
python -m boreal_env watch ppo_group --preference 0.3 --site-seed 7
"""

import argparse
import hashlib
import sys
import tempfile
from pathlib import Path

import gymnasium as gym
import numpy as np

import boreal_env
from cleanrl_style.flags import fail, policy_file, prepare_output, require, shipped_policies
from cleanrl_style.protocol.agents import Policy, load_policy
from cleanrl_style.protocol.arguments import ask
from cleanrl_style.protocol.compilation import compile_physics
from cleanrl_style.protocol.files import replacing
from cleanrl_style.protocol.task import as_option
from sim.parameters import check_seed
from sim.task.preference import check_weights

ENVIRONMENTS = {
    "boreal-balanced-v0": "the task to study policies with",
    "boreal-generalist-v0": "the paper's; as in all but the next, a new site in every episode",
    "boreal-site-specific-v0": "the paper's: one fixed site",
    "boreal-timber-v0": "the balanced task with a third objective, timber",
    "boreal-four-v0": "and with a fourth, biodiversity",
    "boreal-warming-v0": "the balanced task under the scenario SSP2-4.5",
}
FRAME_MS, LAST_FRAME_MS = 200, 3000
FRAME_SIZE = (640, 400)  # pixels


def overview() -> str:
    """What there is."""
    width = max(map(len, ENVIRONMENTS))
    return "\n".join(
        [
            "BoreaRL: manage a boreal stand for fifty years, for its carbon and for the permafrost below it.",
            "",
            "Environments, for gymnasium.make after `import boreal_env`:",
            *(f"  {name:{width}}  {words}" for name, words in ENVIRONMENTS.items()),
            "",
            "Train, in a checkout of the project (--help has the flags and a short trial):",
            "  python cleanrl_style/ppo_group.py --vectorization lockstep --env-id boreal-balanced-v0",
            "",
            "Watch fifty years of a trained policy:",
            "  python -m boreal_env watch POLICY --preference 0.3 --site-seed 7",
            f"where POLICY is the folder of a run, its policy.pt or one that ships: "
            f"{', '.join(shipped_policies()) or 'none does yet'}.",
        ]
    )


def arguments(argv: list[str]) -> argparse.Namespace:
    """The command line; a bad one ends the command with one line."""

    class Parser(argparse.ArgumentParser):
        def error(self, message):
            fail(message)

    parser = Parser(prog="python -m boreal_env", description=overview(), formatter_class=argparse.RawTextHelpFormatter)
    commands = parser.add_subparsers(dest="command", metavar="watch")
    watch = commands.add_parser("watch", help="fifty years of a trained policy, as an animated GIF or in a window")
    watch.add_argument("policy", help="folder of a run, policy file, or name of a policy that ships")
    watch.add_argument("--script", type=Path, help="the script that trained it, if not of cleanrl_style/")
    watch.add_argument("--preference", type=float, nargs="+", help="carbon weight, or one an objective (all equal)")
    watch.add_argument("--site-seed", type=int, help="the site, as sim.sample_site(seed) draws it (the seed's own)")
    watch.add_argument(
        "--seed", type=int, default=0, help="of weather, first stand and dice, without --site-seed of the site too (0)"
    )
    watch.add_argument("--env-id", help="another environment than the policy was trained on")
    watch.add_argument("--sampled", action="store_true", help="draw actions instead of the most probable ones")
    watch.add_argument("--window", action="store_true", help="show it in a window, instead of writing a GIF")
    watch.add_argument(
        "--out", type=Path, help="the GIF (<policy>-<environment>-preference<w>[-site<seed>]-seed<seed>.gif)"
    )
    return parser.parse_args(argv)


def check(args: argparse.Namespace) -> None:
    """End the command with one line for what is wrong with its flags, before torch is loaded for the policy."""
    policy_file(args.policy)
    if args.script is not None and not (args.script.is_file() and args.script.suffix == ".py"):
        raise ValueError(f"--script {args.script}: a file that ends in .py, and is there, is allowed")
    check_seed("--seed", args.seed)
    if args.site_seed is not None:
        check_seed("--site-seed", args.site_seed)
    if args.env_id is not None:
        ask(args.env_id)
    if args.preference:  # whether it has a weight for each objective shows when policy and environment are known to fit
        check_preference(args.preference, max(2, len(args.preference)))
    if args.out is not None and not args.out.absolute().parent.is_dir():
        raise ValueError(f"--out {args.out}: there is no folder {args.out.parent}")
    if args.out is not None and args.out.suffix.lower() != ".gif":
        raise ValueError(f"--out {args.out}: a file that ends in .gif is allowed")
    if args.window and args.out is not None:
        raise ValueError(f"--out {args.out}: with --window no GIF is written")
    if args.window:
        check_display()
    else:
        check_writable(args.out)


def check_display() -> None:
    """Refuse a window where there is none to be had, before years are played for it."""
    import matplotlib.pyplot as plt
    from matplotlib.backends import BackendFilter, backend_registry

    try:
        plt.switch_backend(plt.get_backend())
        found = plt.get_backend().lower() not in backend_registry.list_builtin(BackendFilter.NON_INTERACTIVE)
    except ImportError:
        found = False
    if not found:
        raise ValueError("--window: matplotlib finds no display here; without it a GIF is written")


def check_writable(out: Path | None) -> None:
    """Refuse a place where the GIF cannot be written, before years are played for it."""
    if out is not None and out.is_dir():
        raise ValueError(f"--out {out}: it is a folder; a file that ends in .gif is allowed")
    folder = Path() if out is None else out.absolute().parent
    try:
        with tempfile.NamedTemporaryFile(dir=folder):
            pass
    except OSError as error:
        what = f"the working folder {folder.absolute()}" if out is None else out
        raise ValueError(f"--out {what}: cannot write there ({error.strerror})") from error


def check_preference(given: list[float] | None, objectives: int) -> np.ndarray:
    """Weights (m,) of --preference; without it all are equal."""
    given = given or [1 / objectives] * objectives
    return check_weights(given[0] if len(given) == 1 else given, objectives, "--preference")


def make_env(policy: Policy, env_id: str | None, site_seed: int | None) -> gym.Env:
    """The environment to watch a policy in: that of its training, or another with the same observation."""

    def make(**kwargs):
        return policy.task().make(**kwargs) if env_id is None else gym.make(env_id, **kwargs)

    env = make()
    if env.observation_space.shape != (policy.size,):
        raise ValueError(
            f"{policy.name} observes {policy.size} entries, {env.spec.id} has {env.observation_space.shape[0]}: "
            f"--env-id {policy.env_id} is what it was trained on"
        )
    if "rgb_array" not in (env.metadata or {}).get("render_modes", []):
        raise ValueError(f"{env.spec.id} draws no pictures: its metadata['render_modes'] lacks 'rgb_array'")
    if site_seed is not None and not isinstance(env.unwrapped, boreal_env.BorealEnv):
        raise ValueError(f"--site-seed is for boreal environments, not for {env.spec.id}")
    return make(render_mode="rgb_array", **({} if site_seed is None else {"site_seed": site_seed}))


def play(env: gym.Env, policy, seed: int, weights: np.ndarray):
    """An episode: its frames, one at the start and one a year, and its returns (m,).

    policy : a function of the observation, the mask and the returns so far.
    """
    observation, _ = env.reset(seed=seed, options={"preference": as_option(weights)})
    frames, returns, ended = [env.render()], np.zeros(len(weights)), False
    while not ended:
        action = policy(observation, env.get_wrapper_attr("action_masks")(), returns)
        observation, reward, terminated, truncated, _ = env.step(action)
        returns, ended = returns + reward, terminated or truncated
        frames.append(env.render())
    return frames, returns


def save_animation(path: Path, frames: list[np.ndarray]) -> None:
    """An animated GIF that stays on its last picture for a while; the colours are those of its first and last."""
    from PIL import Image

    pictures = [Image.fromarray(frame).resize(FRAME_SIZE, Image.Resampling.LANCZOS) for frame in frames]
    colours = Image.fromarray(np.concatenate([pictures[0], pictures[-1]])).quantize(256)
    indexed = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures]
    durations = [FRAME_MS] * (len(indexed) - 1) + [LAST_FRAME_MS]
    options = {"save_all": True, "append_images": indexed[1:], "duration": durations, "loop": 0}
    with replacing(path) as file:
        indexed[0].save(file, format="gif", **options, optimize=True)


def show(frames: list[np.ndarray]) -> None:
    """The frames in a window, until it is closed."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(8, 5), num="BoreaRL")
    figure.subplots_adjust(0, 0, 1, 1)
    ax.set_axis_off()
    picture = ax.imshow(frames[0])
    for frame in frames:
        if plt.fignum_exists(figure.number):
            picture.set_data(frame)
            plt.pause(FRAME_MS / 1000)
    plt.show()


def watch(args: argparse.Namespace) -> None:
    """Play the policy, say what it returned beside doing nothing, and show its years."""
    check(args)
    policy = load_policy(args.policy, args.script)
    env_id = args.env_id or policy.env_id
    env, objectives = make_env(policy, args.env_id, args.site_seed), ask(env_id).objectives
    trained_for = policy.arguments.get("preference")  # of a script with one preference throughout
    own = None if trained_for is None else np.ravel(trained_for).tolist()
    weights = check_preference(args.preference or own, len(objectives))
    generator = np.random.default_rng([args.seed, 1]) if args.sampled else None
    if isinstance(env.unwrapped, boreal_env.BorealEnv):
        compile_physics([1])
    frames, returns = play(env, lambda *given: policy.act(*given, generator=generator), args.seed, weights)
    print(f"{policy.name} on {env_id}")
    if own is not None and not np.allclose(weights, check_preference(own, len(objectives))):
        print(f"trained for the preference {' '.join(f'{weight:g}' for weight in own)} alone, whatever it is asked for")
    print_returns(env, objectives, args.seed, weights, returns)
    if args.window:
        show(frames)
        return
    path = args.out or Path(name_of_animation(args, policy, env_id, weights))
    save_animation(path, frames)
    print(f"wrote {path}: {len(frames) - 1} years")


def print_returns(env: gym.Env, objectives, seed: int, weights: np.ndarray, returns: np.ndarray) -> None:
    """What was returned; of a stand, beside what doing nothing returns there."""
    if not isinstance(env.unwrapped, boreal_env.BorealEnv):
        for name, weight, one in zip(objectives, weights, returns, strict=True):
            print(f"{name:>12} weight {weight:.2f}: return {one:+.2f}")
        return
    env.unwrapped.render_mode = None
    _, nothing = play(env, lambda *given: boreal_env.NO_CHANGE, seed, weights)
    for name, weight, one, other in zip(objectives, weights, returns, nothing, strict=True):
        print(f"{name:>12} weight {weight:.2f}: return {one:+.2f}, doing nothing {other:+.2f}, gain {one - other:+.2f}")
    print(f"{'weighted':>12} gain {weights @ (returns - nothing):+.2f}")


def name_of_animation(args: argparse.Namespace, policy: Policy, env_id: str, weights: np.ndarray) -> str:
    """A GIF's name, another one for whatever shows other years: of a run its policy's hash is in it."""
    shown = weights[:1] if len(weights) == 2 else weights
    file = policy_file(args.policy)
    ships = shipped_policies().get(args.policy) == file
    name = args.policy if ships else f"{policy.script}-{hashlib.sha256(file.read_bytes()).hexdigest()[:6]}"
    parts = [name, env_id.split(":")[-1], f"preference{','.join(f'{weight:g}' for weight in shown)}"]
    parts += [] if args.site_seed is None else [f"site{args.site_seed}"]
    return "-".join([*parts, f"seed{args.seed}", *["sampled"] * args.sampled]) + ".gif"


def main(argv: list[str] | None = None) -> None:
    """Run the command."""
    prepare_output()
    args = arguments(sys.argv[1:] if argv is None else argv)
    if args.command is None:
        print(overview())
        return
    require("torch", "matplotlib", "tyro")
    try:
        watch(args)
    except (ValueError, OSError, gym.error.Error, ImportError) as error:
        fail(str(error).splitlines()[0])


if __name__ == "__main__":
    main()
