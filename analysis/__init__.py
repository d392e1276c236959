"""Evaluation protocol, metrics, studies, validation, tables and figures of the benchmark."""

from cleanrl_style.flags import require

require("tyro", "matplotlib", "moocore", "scipy")
