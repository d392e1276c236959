"""What is installed: lowest versions as tested, and no more packages than are users'."""

import re
import tomllib

from scripts import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
TESTED = ("train", "planners", "test")  # extras


def requirements():
    groups = [PROJECT["project"]["dependencies"]]
    groups += [PROJECT["project"]["optional-dependencies"][extra] for extra in TESTED]
    return [line for group in groups for line in group if not line.startswith("borearl[")]


def test_lowest_versions_are_those_that_were_tested():
    lowest = dict(re.match(r"([\w-]+)>=([\d.]+)", line).groups() for line in requirements())
    lines = (ROOT / "constraints-lowest.txt").read_text(encoding="utf-8").splitlines()
    tested = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert lowest.keys() - {"torch"} == tested.keys()
    for name, version in tested.items():
        assert re.fullmatch(rf"{re.escape(lowest[name])}(\.0)*", version), name


def test_a_wheel_has_all_of_environment_simulator_and_scripts_and_nothing_else():
    tools = PROJECT["tool"]["setuptools"]
    files = [path for name in ("sim", "cleanrl_style") for path in (ROOT / name).rglob("*") if path.is_file()]
    packages = {path.parent: ".".join(path.parent.relative_to(ROOT).parts) for path in files if path.suffix == ".py"}
    assert set(packages.values()) == set(tools["packages"]) and tools["py-modules"] == ["boreal_env"]
    named = {package: ROOT.joinpath(*package.split(".")) for package in tools["package-data"]}
    data = {
        path for package, patterns in tools["package-data"].items() for p in patterns for path in named[package].glob(p)
    }
    assert data == {path for path in files if path.suffix not in (".py", ".pyc")}
