"""Evaluation protocol, metrics and tables of the benchmark."""
