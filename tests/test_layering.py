"""The layers: which package may import which, read from the source with ast, and a word for every public name."""

import ast
from pathlib import Path

import pytest

HERE = Path(__file__).parent.parent
MAY_IMPORT = {
    "gear": {"gear"},
    "controllers": {"controllers"},
    "actuator": {"actuator", "gear", "controllers"},
    "studies": {"studies", "actuator", "gear", "controllers"},
}
FILES = [path.relative_to(HERE) for package in MAY_IMPORT for path in sorted((HERE / package).rglob("*.py"))]


def parsed(file):
    return ast.parse((HERE / file).read_text(encoding="utf-8"))


def imported_packages(tree):
    """First parts of all absolute imports, wherever in the file they stand."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.partition(".")[0]


@pytest.mark.parametrize("file", FILES, ids=str)
def test_imports_go_in_one_direction(file):
    ours = MAY_IMPORT.keys() & set(imported_packages(parsed(file)))
    assert ours <= MAY_IMPORT[file.parts[0]]


# each room may enter itself and those before it, in its own package; what stands beside them enters the room named last
ROOMS = {
    "actuator": (("parts", "simulation", "linear", "hunting", "response"), "parts"),
    "studies": (("hunting", "tuning", "frequency", "checks"), None),
}
OPEN = ("__init__.py", "__main__.py")  # bring all together


@pytest.mark.parametrize("file", [file for file in FILES if file.parts[0] in ROOMS], ids=str)
def test_rooms_are_entered_in_one_direction(file):
    if file.name in OPEN:
        return
    package, room = file.parts[:2]
    rooms, beside = ROOMS[package]
    last = room if room in rooms else beside
    modules = {node.module or "" for node in ast.walk(parsed(file)) if isinstance(node, ast.ImportFrom)}
    entered = {name.split(".")[1] for name in modules if name.startswith(f"{package}.")} & set(rooms)
    assert entered <= set(rooms[: rooms.index(last) + 1] if last else ())


@pytest.mark.parametrize("file", FILES, ids=str)
def test_every_public_name_has_a_docstring(file):
    tree = parsed(file)
    public = [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) and not node.name.startswith("_")
    ]
    assert [node.name for node in public if not ast.get_docstring(node)] == []
    assert not tree.body or ast.get_docstring(tree)


def test_every_package_was_looked_at():
    assert {file.parts[0] for file in FILES} == MAY_IMPORT.keys()


def test_an_import_inside_a_function_is_seen():
    tree = ast.parse("def late():\n    from actuator.simulation.run import Run\n    import studies.report as report\n")
    assert set(imported_packages(tree)) == {"actuator", "studies"}
