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
LEAF = "gear.quantities"  # units, rules, roles and the registry: all may import it, and it imports none
FILES = [path.relative_to(HERE) for package in MAY_IMPORT for path in sorted((HERE / package).rglob("*.py"))]


def parsed(file):
    return ast.parse((HERE / file).read_text(encoding="utf-8"))


def imported_modules(tree):
    """All absolute imports, wherever in the file they stand."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module


def imported_packages(tree):
    """First parts of all absolute imports but those of the leaf."""
    modules = imported_modules(tree)
    return (name.partition(".")[0] for name in modules if name != LEAF and not name.startswith(f"{LEAF}."))


@pytest.mark.parametrize("file", FILES, ids=str)
def test_imports_go_in_one_direction(file):
    ours = MAY_IMPORT.keys() & set(imported_packages(parsed(file)))
    assert ours <= MAY_IMPORT[file.parts[0]]


@pytest.mark.parametrize("file", [file for file in FILES if file.is_relative_to("gear/quantities")], ids=str)
def test_the_leaf_imports_nothing_of_the_project_but_itself(file):
    ours = [name for name in imported_modules(parsed(file)) if name.partition(".")[0] in MAY_IMPORT]
    assert all(name == LEAF or name.startswith(f"{LEAF}.") for name in ours)


# each room may enter itself and those before it, in its own package; what stands beside them enters the room named last
ACTUATOR = (
    "parts",
    "system",
    "lowering",
    "engine",
    "simulation",
    "linear",
    "verdict",
    "orbits",
    "continuation",
    "stiction",
    "describing",
)
ROOMS = {
    "actuator": ((*ACTUATOR, "diagnosis", "response"), "system"),
    "studies": (("judge", "hunting", "tuning", "robustness", "frequency", "checks"), None),
}
PICTURES = "plots"  # entered by results when they are drawn; itself it knows results only for type checkers
OPEN = ("__init__.py", "__main__.py", "contracts.py")  # bring all together


@pytest.mark.parametrize("file", [file for file in FILES if file.parts[0] in ROOMS], ids=str)
def test_rooms_are_entered_in_one_direction(file):
    package, room = file.parts[:2]
    if file.name in OPEN or room == PICTURES:
        return
    rooms, beside = ROOMS[package]
    if room not in rooms and package == "studies" and len(file.parts) > len(("studies", "file.py")):
        return  # a new study may build on all others
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


# -- circles and pictures -----------------------------------------------------------------------------------

MODULES = {".".join(file.with_suffix("").parts): file for file in FILES}
DRAW = {"actuator": ("actuator/plots/*.py",), "studies": ("studies/*/pictures.py",)}


def run_time_imports(tree, late):
    """Modules imported when the program runs: at module level, and `late` inside functions; not for type checkers."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif late or not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from run_time_imports(node, late)


def circles(graph):
    """Groups of modules that reach each other: what is left when modules that nobody of them imports are taken away."""
    left = {name: set(seen) & set(graph) - {name} for name, seen in graph.items()}
    while free := {name for name, seen in left.items() if not seen & set(left)}:
        left = {name: seen for name, seen in left.items() if name not in free}
    return sorted(left)


@pytest.mark.parametrize("late", [False, True])
def test_no_files_import_each_other_in_a_circle(late):
    assert circles({name: set(run_time_imports(parsed(file), late)) for name, file in MODULES.items()}) == []


def test_a_circle_is_seen():
    found = circles({"a": {"b"}, "b": {"c", "numpy"}, "c": {"a"}, "d": {"a"}, "e": set()})
    assert {"a", "b", "c"} <= set(found) and "e" not in found
    source = "if TYPE_CHECKING:\n    import a\nclass B:\n    import b\n    def f(self):\n        from c import d\n"
    assert set(run_time_imports(ast.parse(source), late=False)) == {"b"}
    assert set(run_time_imports(ast.parse(source), late=True)) == {"b", "c", "c.d"}


@pytest.mark.parametrize("file", [file for file in FILES if file.parts[0] in DRAW], ids=str)
def test_pictures_are_drawn_in_one_room(file):
    if any(file.match(pattern) for pattern in DRAW[file.parts[0]]):
        return
    assert [name for name in run_time_imports(parsed(file), late=True) if name.partition(".")[0] == "matplotlib"] == []


@pytest.mark.parametrize("file", [file for file in FILES if file.match("actuator/*/*.py")], ids=str)
def test_pictures_are_entered_only_when_they_are_drawn(file):
    if PICTURES not in file.parts:
        names = run_time_imports(parsed(file), late=False)
        assert [name for name in names if name.startswith(f"actuator.{PICTURES}")] == []


# -- no meaning is read off a name --------------------------------------------------------------------------

TAKING_APART = {"endswith", "startswith", "removesuffix", "removeprefix", "partition", "rpartition", "split", "rsplit"}
NOT_NAMES = {".toml", ",", "=", ":", "*", "+", "+-", ";", "\n", "\n\n", " ", "_", "__", ".py", "/"}  # files and options
NO_TEXTS = ("np", "shlex", "ca", "log", "self", "pieces.log")  # arrays, and what packs modes into numbers
ALLOWED = {
    "actuator/lowering/function.py",  # operations of CasADi
    "actuator/lowering/machine.py",  # features of processors
    "gear/quantities/registry.py",  # modules of Python
    "studies/study.py",
    "studies/cache.py",  # the head of a file
    "studies/frequency/plan.py",  # result.json among paths
    "controllers/countermeasures.py",  # a path of fields
    "studies/converter.py",  # keys of files and their units
    "studies/units.py",
    "studies/files.py",
    "studies/structure.py",
}


def texts_of(node, constants):
    """Texts that an argument can be, followed through constants of the module; None for what is not known."""
    if isinstance(node, ast.Name):
        node = constants.get(node.id)
    if isinstance(node, ast.IfExp):
        return texts_of(node.body, constants) | texts_of(node.orelse, constants)
    if isinstance(node, ast.Tuple):
        return {text for part in node.elts for text in texts_of(part, constants)}
    return {node.value} if isinstance(node, ast.Constant) else {None}


def names_read(tree):
    """Calls that take a text apart at something that is no sign of a file or an option."""
    constants = {
        target.id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in TAKING_APART:
            owner = ast.unparse(node.func.value)
            texts = set().union(*(texts_of(argument, constants) for argument in node.args), set())
            if owner not in NO_TEXTS and not texts <= NOT_NAMES:
                yield f"line {node.lineno}: {ast.unparse(node)}"


@pytest.mark.parametrize("file", [file for file in FILES if str(file) not in ALLOWED], ids=str)
def test_no_meaning_is_read_off_a_name(file):
    assert list(names_read(parsed(file))) == []


@pytest.mark.parametrize(
    "source",
    [
        'name.endswith(".static")',
        'ENDS = (".gap", ".static")\nname.endswith(ENDS)',
        'name.removeprefix("gear.")',
        'name.rpartition(".")',
        "name.startswith(prefix)",
    ],
)
def test_a_name_that_is_taken_apart_is_seen(source):
    assert len(list(names_read(ast.parse(source)))) == 1
    assert list(names_read(ast.parse('file.endswith(".toml"); text.split(","); np.split(x, ends)'))) == []
