"""The README as its reader uses it: its Python runs as it stands, and its commands name files that are there."""

import re

import pytest
from scripts import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


@pytest.mark.parametrize("number", range(len(PYTHON)))
def test_python_blocks_run(number):
    exec(compile(PYTHON[number], f"README.md, Python block {number + 1}", "exec"), {})


def test_there_are_python_blocks():
    assert len(PYTHON) >= 2


def test_commands_and_links_name_files_that_exist():
    named = set(re.findall(r"python ([\w/]+\.py)", README)) | set(re.findall(r"\]\(([\w/.-]+)\)", README))
    assert len(named) > 20
    assert [path for path in sorted(named) if not (ROOT / path).exists()] == []
