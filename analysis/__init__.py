"""Evaluation protocol, metrics, studies, validation, tables and figures of the benchmark."""
