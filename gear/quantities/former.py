"""Former names: a package goes on answering to them for one minor version, and says the new name."""

import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any


def renamed(package: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """Make the `__getattr__` of a package that gives what has a new name, with a DeprecationWarning.

    Parameters
    ----------
    package : str
        Its `__name__`.
    names : mapping of str to str
        Former name -> new name.
    """

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        warnings.warn(f"{package}.{name} is now {package}.{names[name]}", DeprecationWarning, stacklevel=2)
        return getattr(sys.modules[package], names[name])

    return find
