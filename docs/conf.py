"""Sphinx makes a site of the Markdown of this repository: sphinx-build -W -b html -c docs . build/html

The pages are written for GitHub, and links between them and to the code are relative there. So the source folder is the
repository, from which the pages below are taken, and nothing has to be rewritten.
"""

import ast
import importlib
import inspect
import json
import re
import sys
import tomllib
from pathlib import Path

from sphinx.util import logging

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

project = "BoreaRL benchmark"
author = "The BoreaRL benchmark authors"
project_copyright = f"{author}, MIT licence"
release = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]

root_doc = "docs/index"
include_patterns = [
    "docs/**",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "analysis/observations/README.md",
    "results/README.md",
]
exclude_patterns = ["build", "runs", "results/runs", ".*", "**/__pycache__"]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinxcontrib.mermaid"]
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math", "mermaid"]  # GitHub's way to write them
myst_heading_anchors = 4
nb_execution_mode = "off"  # analysis/execute_notebooks.py does it, and a test tells whether they are current

nitpicky = True
# strict for our public names alone, not for those of other libraries
nitpick_ignore_regex = [("py:.*", r"(?!(boreal_env|sim|cleanrl_style\.protocol)\.\w+$).*")]
autodoc_member_order = "bysource"
autodoc_default_options = {"no-value": True}
default_role = "literal"  # docstrings are Markdown: `name` is code

html_theme = "celshast"
html_theme_options = {"description": "Managing a boreal forest for carbon and permafrost: a benchmark"}
html_title = project
html_static_path = ["_static"]
html_css_files = ["site.css"]
templates_path = ["_templates"]
html_additional_pages = {"index": "to_index.html"}
html_show_sourcelink = False

ANCHOR = re.compile(r'^<a id="([\w-]+)"></a>$', re.MULTILINE)
PARAMETER = re.compile(r"(\w+(?:, \w+)*) : ")


def as_myst(app, docname, source):
    """Anchors as GitHub wants them become those that MyST links to; a list of pages is of those that are there; a
    notebook's page ends with the notebook itself."""
    text = ANCHOR.sub(r"(\1)=", source[0])
    if docname == root_doc:
        patterns = re.findall(r"^\S+\*$", text, re.MULTILINE)
        for pattern in (pattern for pattern in patterns if not any(Path(__file__).parent.glob(pattern + ".*"))):
            text = text.replace(f"{pattern}\n", "")
    file = ROOT / f"{docname}.ipynb"
    if file.exists():
        notebook = json.loads(text)
        link = f"{{download}}`{file.name} <{file.name}>`"
        last = {"cell_type": "markdown", "id": "file", "metadata": {}, "source": link}
        text = json.dumps({**notebook, "cells": [*notebook["cells"], last]})
    source[0] = re.sub(r"(\.\. automodule:: (\S+)\n(?: +:.*\n)+)", lambda found: found[1] + others(found[2]), text)


def others(module: str) -> str:
    """What automodule leaves out of a module's public names: its constants, and what is loaded when it is asked for."""
    names = importlib.import_module(module)
    text = ""
    for name in names.__all__:
        thing = getattr(names, name)
        if not (inspect.isclass(thing) or inspect.isroutine(thing)):
            text += f"\n.. autodata:: {module}.{name}\n   :no-value:\n"
        elif name not in vars(names):
            text += f"\n.. autofunction:: {module}.{name}\n"
    return text


def docstring(app, what, name, thing, options, lines):
    """House style to reStructuredText: headings to bold text, `name : meaning` to a list, comments of constants."""
    if what == "data":
        lines[:] = [comment(*name.rsplit(".", 1)), ""]
    if what != "attribute" and not any(lines):
        logging.getLogger(__name__).warning("public name without a docstring: %s", name)
    if what == "class" and "## Description" in lines:  # the manual; docs/environment.md is made from it
        description = lines.index("## Description")
        lines[:] = [*lines[description + 1 : lines.index("", description)], ""]
    text = inspect.cleandoc("\n".join(lines))
    text = re.sub(r"^(\w+)\n-+\n", r"**\1**\n\n", text, flags=re.MULTILINE)  # Parameters, Returns, Raises
    text = re.sub(r"\*(?=\*?\w)(?<!\*\*)(?!\*?\w+\*\*)", r"\\*", text)
    lines[:] = [*"\n\n".join(map(listed, text.split("\n\n"))).splitlines(), ""]


def listed(paragraph: str) -> str:
    """A paragraph of `name : meaning` as a list, if it is nothing else."""
    first, *others = re.sub(r",\n(?=\w+ : )", ", ", paragraph).splitlines() or [""]
    if not PARAMETER.match(first) or not all(line.startswith("  ") or PARAMETER.match(line) for line in others):
        return paragraph if first.startswith((" ", ">", "-")) else "\n".join(map(str.strip, paragraph.splitlines()))
    items = [[]]
    for line in (first, *others):
        if PARAMETER.match(line):
            items.append([PARAMETER.sub(r"- `\1`: ", line)])
        else:
            items[-1].append(f"  {line.strip()}")
    return "\n".join(line for item in items for line in item)


def comment(module: str, constant: str) -> str:
    """The comment above a constant, or behind it, in the file that it is assigned in."""
    source = Path(sys.modules[module].__file__).read_text(encoding="utf-8")
    for node in ast.parse(source).body:
        if isinstance(node, ast.ImportFrom) and constant in [alias.asname or alias.name for alias in node.names]:
            return comment(node.module, constant)
    found = re.search(rf"((?:^#.*\n)*)^{constant}\b[^\n#]*(#.*)?", source, re.MULTILINE)
    lines = (found[1] or found[2] or "").splitlines()
    return " ".join(line.lstrip("#: ") for line in lines)


def without_menu(app, pagename, templatename, context, doctree):
    """The theme's menu of Farama's projects, of which this is none, asks nobody for them."""
    context["farama_projects_api"] = "data:application/json,{}"


def setup(app):
    """Sphinx calls this."""
    app.connect("source-read", as_myst)
    app.connect("autodoc-process-docstring", docstring)
    app.connect("html-page-context", without_menu, priority=900)
