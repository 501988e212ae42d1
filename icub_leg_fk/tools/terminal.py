"""What a terminal shows while something runs, by the library rich."""

from typing import Any

from icub_leg_fk.errors import MissingDependencyError


def import_rich(purpose: str) -> Any:
    """Return the library rich, with those of its modules that are used here.

    Args:
        purpose: what needs it, such as `the live table`.
    """
    try:
        import rich.console
        import rich.live
        import rich.progress
        import rich.table
        import rich.text
    except ImportError as error:
        raise MissingDependencyError('rich', purpose, 'pip install rich') from error
    return rich
