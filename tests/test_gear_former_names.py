"""Former names: every one in the tables of the packages leads to a name that is there, with a warning."""

import importlib

import pytest

TABLES = [
    (package, former, new)
    for package in ("gear", "controllers", "actuator")
    for former, new in importlib.import_module(package).FORMER.items()
]


@pytest.mark.parametrize(("package", "former", "new"), TABLES)
def test_a_former_name_gives_the_new_one_and_says_so(package, former, new):
    module = importlib.import_module(package)
    with pytest.warns(DeprecationWarning, match=rf"{package}\.{former} is now {package}\.{new}"):
        found = getattr(module, former)
    assert found is getattr(module, new)


@pytest.mark.parametrize("package", ["gear", "controllers", "actuator"])
def test_an_unknown_name_is_refused(package):
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        importlib.import_module(package).nothing  # noqa: B018
