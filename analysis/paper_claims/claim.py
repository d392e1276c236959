"""A claim of the paper, a number of ours with its interval, and the rules by which numbers become verdicts."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

HOLDS, FAILS, COMPARED = "holds", "does not hold in our simulator", "compared"
CONTRADICTS = "the paper contradicts itself"
UNTESTABLE = "cannot be tested here"
UNDECIDED, NO_RUNS = "undecided", "not run yet"
VERDICTS = (HOLDS, FAILS, COMPARED, CONTRADICTS, UNTESTABLE, UNDECIDED, NO_RUNS)

DIRECTION, LEVEL, IMPLEMENTATION = "direction", "level", "implementation"
COST, ARITHMETIC, CONTROL = "cost", "arithmetic", "own control"
KINDS = {
    DIRECTION: "what comes out ahead, and which way a mechanism works",
    LEVEL: "a number of another simulator: set beside ours, never failed",
    IMPLEMENTATION: "what the environment is made of",
    COST: "time, memory and money, which are met if ours are no larger",
    ARITHMETIC: "the paper's tables against each other, without ours",
    CONTROL: "experiments of ours on why, of which the paper does not speak",
}

SEEDS = "training seeds"
FEWEST_SEEDS = 5  # for a verdict: a 95 % bootstrap interval over three covers 75 % of the time, over five 91 %
#: The smallest effect on a return that counts as one: a quarter of what the best constant plan of each weight gains
#: over doing nothing, which a test compares with the returns that ship.
LEAST = 0.47
QUARTER = 0.25  # of the paper's effect, where its units are ours
ABOUT = 0.1  # a value of the paper is met within this share of it


class Missing(Exception):
    """What a claim needs is not there; the text says what."""


class Undefined(Missing):
    """The runs are there, but have no such number; the text says why."""


@dataclass(frozen=True)
class Number:
    """A number with its 95 % interval (NaN without one).

    over : what the interval is over, "" for an exact number; count : how many of them, 0 if that says nothing;
    t_low, t_high : the t interval of the mean, where the other is a bootstrap over few (NaN without one).
    """

    value: float
    low: float = np.nan
    high: float = np.nan
    over: str = ""
    count: int = 0
    t_low: float = np.nan
    t_high: float = np.nan

    @property
    def decides(self) -> bool:
        """Whether a verdict may rest on it."""
        if np.isnan(self.value):
            return False
        return not self.over or (not np.isnan(self.low) and (self.over != SEEDS or self.count >= FEWEST_SEEDS))

    @property
    def ends(self) -> tuple[float, float]:
        """What a verdict is judged by: all of both its intervals; an exact number is its own."""
        if not self.over:
            return self.value, self.value
        return float(np.fmin(self.low, self.t_low)), float(np.fmax(self.high, self.t_high))

    @property
    def mirrored(self) -> "Number":
        """The number with the other sign."""
        return Number(-self.value, -self.high, -self.low, self.over, self.count, -self.t_high, -self.t_low)

    def __str__(self) -> str:
        text = short(self.value)
        return text if np.isnan(self.low) else f"{text} [{', '.join(map(short, self.ends))}]"

    @property
    def basis(self) -> str:
        """What it is over, as text."""
        one = self.count == 1
        return f"{self.count} {self.over.removesuffix('s') if one else self.over}" if self.count else self.over


def short(value: float) -> str:
    """Three digits, without an exponent, with a true minus."""
    if np.isnan(value):
        return "?"
    text = f"{value:,.0f}" if abs(value) >= 999.5 else f"{value:.3g}" if abs(value) >= 1e-4 or value == 0 else "0"
    return text.replace("-", "−")


@dataclass(frozen=True)
class Row:
    """A line of a claim's table: a quantity, the paper's value as text, and ours."""

    what: str
    paper: str
    ours: Number | str


@dataclass(frozen=True)
class Answer:
    """Whether a claim holds (None: the numbers do not decide), and the rule as text: "holds if .."."""

    holds: bool | None
    rule: str
    waits: bool = False  # for more training seeds
    small: bool = False  # it does not hold, for no other reason than that no effect large enough to count is left
    reached: float = np.nan  # if small: the share of the least effect that the interval reaches up to


@dataclass(frozen=True)
class Finding:
    """What our results say of a claim; remark : a sentence that is printed with it."""

    rows: list[Row]
    verdict: str
    rule: str = ""
    waits: bool = False
    small: bool = False
    reached: float = np.nan
    remark: str = ""


def finding(rows: list[Row], answer: Answer, otherwise: str = FAILS) -> Finding:
    """The finding of an answer; `otherwise` is the verdict on a claim that does not hold."""
    verdict = UNDECIDED if answer.holds is None else HOLDS if answer.holds else otherwise
    return Finding(rows, verdict, answer.rule, answer.waits, answer.small, answer.reached)


def read_twice(first: Finding, second: Finding, names: tuple[str, str]) -> Finding:
    """The finding of two readings of a claim, undecided where they part; small only if it is in both.

    names : of the readings, as they are told.
    """
    told = (f"{name}: {one.verdict}. {one.remark}".strip() for name, one in zip(names, (first, second), strict=True))
    small = first.small and second.small
    return replace(
        first,
        verdict=first.verdict if second.verdict == first.verdict else UNDECIDED,
        small=small,
        reached=min(first.reached, second.reached) if small else np.nan,
        remark=" ".join(told),
    )


@dataclass(frozen=True)
class Claim:
    """A claim of the paper; `measure` turns the evidence into a finding, or raises Missing.

    why : the mechanism, printed if the claim does not hold; note : printed always. Neither has a number in it: numbers
    are in the rows. command : what makes the runs, "" if the paper's tables are enough. kind : one of KINDS.
    repeats : the claim whose fact it states once more; it has no vote of its own then.
    """

    statement: str
    where: str
    command: str
    measure: Callable
    why: str = ""
    note: str = ""
    kind: str = DIRECTION
    repeats: "Claim | None" = None


def claim(statement: str, where: str, command: str = "", **more) -> Callable:
    """Makes a claim of the function below it."""
    return lambda measure: Claim(statement, where, command, measure, **more)


# ------------------------------------------------------------------------------------------------ rules


def above(number: Number, limit: float = 0.0, least: float | None = None, what: str = "the interval") -> Answer:
    """Holds if the interval lies above the limit; not if below, or if all of it is less than `least` above it."""
    low, high = number.ends
    no_effect = "" if least is None else f" (not, if all of it is below {short(limit + least)})"
    rule = f"{what} lies above {short(limit)}{no_effect}"
    if not number.decides:
        return Answer(None, rule, waits=True)
    fails = high <= limit or (least is not None and high < limit + least)
    small = bool(fails and high > limit)
    reached = (high - limit) / least if small else np.nan
    return Answer(False if fails else True if low > limit else None, rule, small=small, reached=reached)


def below(number: Number, limit: float = 0.0, least: float | None = None, what: str = "the interval") -> Answer:
    """Holds if the interval lies below the limit; not if above, or if all of it is less than `least` below it."""
    answer = above(number.mirrored, -limit, least)
    no_effect = "" if least is None else f" (not, if all of it is above {short(limit - least)})"
    return replace(answer, rule=f"{what} lies below {short(limit)}{no_effect}")


def within(number: Number, low: float, high: float, what: str = "the value") -> Answer:
    """Holds if the whole interval lies in a range; not if all of it lies outside."""
    rule = f"{what} lies between {short(low)} and {short(high)}"
    if not number.decides:
        return Answer(None, rule, waits=True)
    inside = low <= number.ends[0] and number.ends[1] <= high
    outside = number.ends[1] < low or number.ends[0] > high
    return Answer(True if inside else False if outside else None, rule)


def equals(value: float, wanted: float, what: str) -> Answer:
    """Holds if a count is the wanted one."""
    return Answer(bool(value == wanted), f"{what} is {short(wanted)}")


def share(count: int, of: int, over: str) -> Number:
    """A share with its Wilson interval."""
    ends = stats.binomtest(count, of).proportion_ci(method="wilson")
    return Number(count / of, ends.low, ends.high, over, of)


def about(number: Number, low: float, high: float | None = None, what: str = "the value") -> Answer:
    """Holds if the value is the paper's, or in the paper's range, give or take a tenth."""
    high = low if high is None else high
    return within(number, low - ABOUT * abs(low), high + ABOUT * abs(high), what)


def opposite(answer: Answer) -> Answer:
    """Holds if the answer does not."""
    return Answer(None if answer.holds is None else not answer.holds, f"it is not so that {answer.rule}", answer.waits)


def all_of(*answers: Answer) -> Answer:
    """Holds if all do, not if one does not."""
    holds = [answer.holds for answer in answers]
    rule = " and ".join(dict.fromkeys(answer.rule for answer in answers))
    decided = False if False in holds else None if None in holds else True
    fails = [answer for answer in answers if answer.holds is False]
    small = bool(fails) and all(answer.small for answer in fails)
    waits = decided is None and any(answer.waits for answer in answers)
    return Answer(decided, rule, waits, small, min(one.reached for one in fails) if small else np.nan)
