"""The documents as their reader uses them: the site builds without a warning, commands and Python of all pages are
good, and the notebooks show what they would show if they were run now."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from scripts import ROOT, run_script

from analysis import follow_readme
from cleanrl_style import protocol

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("docs/**/*.md"))]
TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES}
SCRIPTS = r"python ((?:analysis|baselines_heuristic|cleanrl_style)/[\w/]+\.py)((?:\\\n|[^\n`#&|<])*)"


def fields(path):
    """Names of the flags that a file defines: annotated fields of its classes `Args`, or of one that ends so."""
    classes = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.ClassDef)]
    of_flags = [node for node in classes if node.name.endswith("Args")]
    return {line.target.id for node in of_flags for line in node.body if isinstance(line, ast.AnnAssign)}


SHARED = fields(ROOT / "baselines_heuristic" / "__init__.py")  # of all fixed strategies


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_name_scripts_and_flags_that_exist(page):
    wrong = []
    for script, rest in re.findall(SCRIPTS, TEXTS[page]):
        if not (ROOT / script).exists():
            wrong.append(script)
            continue
        known = fields(ROOT / script) | (SHARED if script.startswith("baselines_heuristic/") else set())
        if script.startswith("analysis/outside/"):
            known |= fields(ROOT / "analysis" / "outside" / "arguments.py")
        flags = [flag.replace("-", "_") for flag in re.findall(r"(?<!\S)--([a-z][\w-]*)", rest)]
        wrong += [f"{script} --{flag}" for flag in flags if not {flag, flag.removeprefix("no_")} & {*known, "help"}]
    assert wrong == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_trainings_are_accepted_as_they_stand(page, monkeypatch):
    def make_task(args, **more):
        raise SystemExit("accepted")

    monkeypatch.setattr(protocol, "make_task", make_task)
    for block in re.findall(r"```bash\n(.*?)```", TEXTS[page], re.DOTALL):
        for script, flags in re.findall(SCRIPTS, block):
            if script.startswith("cleanrl_style/"):
                with pytest.raises(SystemExit, match="^accepted$"):
                    run_script(script, *flags.replace("\\\n", " ").split())


def test_commands_with_a_wrong_flag_would_be_found():
    flags = fields(ROOT / "cleanrl_style" / "ppo_gated.py")
    assert "total_timesteps" in flags and not flags & {"total_timestep", "seeds", "episodes"}
    assert len(re.findall(SCRIPTS, "".join(TEXTS.values()))) > 60


def test_extras_are_those_of_the_package():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    wanted = re.findall(r"-e \"?\.\[([\w,]+)\]", "".join(TEXTS.values()) + (ROOT / "Dockerfile").read_text())
    assert {name for names in wanted for name in names.split(",")} <= set(extras)


def test_versions_agree():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"^version: (\S+)$", citation, re.MULTILINE)[1] == version
    assert re.search(r"^## (\S+)", changes, re.MULTILINE)[1] == version.removesuffix(".dev0")


def test_every_file_of_data_has_a_licence():
    page = (ROOT / "analysis" / "observations" / "README.md").read_text(encoding="utf-8")
    files = [path.name for path in (ROOT / "analysis" / "observations").iterdir() if path.suffix in (".csv", ".gz")]
    assert files and [name for name in files if name not in page] == []
    licences = TEXTS[ROOT / "docs" / "licences.md"]
    tables = [path.name for path in (ROOT / "sim").glob("*.csv")]
    assert tables and [name for name in tables if name not in licences] == []


def test_decisions_keep_their_numbers_where_they_are_rendered():
    # a list goes on from its first number, whatever the others are
    parts = re.split(r"^(?:##|<!--) .*$", (ROOT / "docs" / "decisions.md").read_text(), flags=re.MULTILINE)
    lists = [[int(number) for number in re.findall(r"^(\d+)\. \*\*", part, flags=re.MULTILINE)] for part in parts]
    assert all(numbers == list(range(numbers[0], numbers[0] + len(numbers))) for numbers in lists if numbers)
    assert sorted(sum(lists, [])) == [*range(1, 55), *range(60, 77), *range(80, 116)]


def test_what_follow_readme_does_is_what_the_readme_says():
    lines = follow_readme.commands(TEXTS[ROOT / "README.md"])
    assert lines[0].startswith(follow_readme.CLONE)
    steps = follow_readme.steps(lines)
    assert [step.split()[0] for step in steps] == ["pip", "python", "pip", "pytest"]
    assert f"`{follow_readme.QUICK}`" in TEXTS[ROOT / "README.md"]


def test_follow_readme_times_commands_and_names_the_one_that_fails(tmp_path):
    table, printed = follow_readme.follow(
        ["python -c 'print(7)'"], tmp_path, {"PATH": str(Path(sys.executable).parent)}
    )
    assert list(table.command) == ["python -c 'print(7)'"] and printed == {"python -c 'print(7)'": "7\n"}
    with pytest.raises(SystemExit, match="python -c 1/0: exit 1"):
        follow_readme.follow(["python -c 1/0"], tmp_path, {"PATH": str(Path(sys.executable).parent)})


def build(*options):
    return subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


def test_the_site_builds_without_a_warning(tmp_path):
    for name in ("sphinx", "myst_nb", "celshast", "sphinxcontrib.mermaid"):
        pytest.importorskip(name)
    done = build("-c", "docs", "-d", tmp_path / "trees", ".", tmp_path / "html")
    assert done.returncode == 0, done.stderr
    names = (tmp_path / "html" / "docs" / "api.html").read_text(encoding="utf-8")
    for name in ("boreal_env.BorealEnv", "boreal_env.NO_CHANGE", "sim.simulate", "cleanrl_style.protocol.load_policy"):
        assert f'id="{name}"' in names


def test_what_is_no_notebook_is_refused():
    pytest.importorskip("nbclient")
    from analysis import execute_notebooks

    with pytest.raises(SystemExit, match="^error: --notebooks .*README.md: a file that ends in .ipynb, and is there"):
        execute_notebooks.main(execute_notebooks.Args(notebooks=(ROOT / "README.md",)))


@pytest.mark.parametrize("path", sorted(ROOT.glob("docs/notebooks/*.ipynb")), ids=lambda path: path.stem)
def test_notebooks_are_current(path):
    pytest.importorskip("nbclient")
    from analysis import execute_notebooks

    ships = (ROOT / "cleanrl_style" / "policies" / "ppo_group.pt").exists()
    if "load_policy" in path.read_text(encoding="utf-8") and not ships:
        pytest.skip("no policy ships yet")
    execute_notebooks.main(execute_notebooks.Args(notebooks=(path,), check=True))
