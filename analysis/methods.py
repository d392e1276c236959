"""The methods that are compared, a row each. Experiments, tables, figures and documents take them from here."""

from dataclasses import dataclass

CONDITIONED = "conditioned on the preference"
FIXED_WEIGHT = "trained for one weight"
POPULATION = "a population, one of which is chosen for each weight"
BANDIT = "a plan is chosen for each site and weight"
HEURISTIC = "fixed strategy of the paper"
CONTROL = "fixed strategy of ours"
OTHERS = "of another library"
FOLDERS = {HEURISTIC: "baselines_heuristic", CONTROL: "baselines_heuristic", OTHERS: "analysis/outside"}


@dataclass(frozen=True)
class Method:
    """A script, and how it is shown."""

    script: str  # its file without .py
    title: str
    kind: str
    colour: str
    marker: str
    paper: str | None = None  # its name in analysis/paper_tables; None: the paper does not have it

    @property
    def trains(self) -> bool:
        """Whether it is trained."""
        return self.kind not in (HEURISTIC, CONTROL)

    @property
    def path(self) -> str:
        """The script's file, relative to the repository."""
        return f"{FOLDERS.get(self.kind, 'cleanrl_style')}/{self.script}.py"


# Colours of Okabe and Ito (2008), then of Tol (2021): told apart with every kind of colour vision; markers tell them
# apart in grey. No yellow: it is hardly seen on white.
ROWS = (
    Method("zero_change", "Zero change", HEURISTIC, "#000000", "x", "zero_density_change"),
    Method("plus_100", "+100 a year", HEURISTIC, "#56B4E9", "+", "plus_100_density"),
    Method("target_density", "Target density 1000", HEURISTIC, "#E69F00", "v", "target_density"),
    Method("conifer_restoration", "Conifer restoration", HEURISTIC, "#999933", "*", "conifer_restoration"),
    Method("random_valid", "Random", CONTROL, "#999999", "1"),
    Method("eupg_var_lambda", "Variable λ EUPG", CONDITIONED, "#CC79A7", "s", "eupg_variable_lambda"),
    Method("ppo_gated", "PPO Gated", CONDITIONED, "#009E73", "^", "ppo_gated"),
    Method("ppo_curriculum", "Curriculum PPO", CONDITIONED, "#D55E00", "o", "curriculum_ppo"),
    Method("ppo_group", "Group PPO", CONDITIONED, "#0072B2", "P"),
    Method("plan_regression", "Plan regression", BANDIT, "#117733", "<"),
    Method("eupg_fixed_lambda", "Fixed λ EUPG", FIXED_WEIGHT, "#882255", "D", "fixed_weight_eupg"),
    Method("pcn", "PCN", OTHERS, "#E69F00", "p"),
    Method("gpi_ls", "GPI-LS", OTHERS, "#56B4E9", "h"),
    Method("envelope", "Envelope", OTHERS, "#CC79A7", "8"),
    Method("morld", "MORL/D", OTHERS, "#D55E00", "X"),
    Method("maskable_ppo", "MaskablePPO", OTHERS, "#332288", "d"),
    Method("moea", "NSGA-II", POPULATION, "#56B4E9", "H"),
)
METHODS = {method.script: method for method in ROWS}
BY_FLAGS = {("moea", "--algorithm moead"): "MOEA/D"}
"""Flags that make another method of a script: (script, flags) -> its title."""


def scripts(*kinds: str) -> tuple[str, ...]:
    """The scripts of these kinds, in order."""
    return tuple(method.script for method in ROWS if method.kind in kinds)


LEARNERS = scripts(CONDITIONED)
TRAINED = tuple(method.script for method in ROWS if method.trains)
STRATEGIES = scripts(HEURISTIC, CONTROL)
OUTSIDE = scripts(OTHERS)


def title(script: str, its_flags: str = "") -> str:
    """A method's title, by its script and the flags that make another of it; of one's own script its name."""
    return BY_FLAGS.get((script, its_flags)) or (METHODS[script].title if script in METHODS else script)


def flags(setting: str) -> str:
    """A row's setting as flags of the command line; lockstep, which all runs of the experiments share, left out."""
    words = []
    for item in setting.split(", "):
        name, _, value = item.partition("=")
        if name not in ("default", "vectorization"):
            flag = f"--{'no-' if value == 'False' else ''}{name.replace('_', '-')}"
            words.append(flag if value in ("True", "False") else f"{flag} {value.replace(',', ' ')}")
    return " ".join(words)


def paper_name(script: str) -> str | None:
    """What the paper's tables call a script; None if they do not have it."""
    return METHODS[script].paper if script in METHODS else None
