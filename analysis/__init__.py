"""Evaluation protocol, metrics, studies, validation, tables and figures of the benchmark."""

from cleanrl_style.command_line import require

require("tyro", "matplotlib", "moocore", "scipy")
