"""What the paper claims, a module a theme; `analysis/claims.py` writes them down with our numbers and verdicts."""
