"""Refusals that several files of the task share."""


def check_choice(what: str, value, allowed) -> None:
    """Refuse what is not one of the allowed names."""
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{what} {value!r}: allowed are {', '.join(allowed)}")
