"""CasADi functions as machine code: generated C, compiled once, cached by content."""

import contextlib
import hashlib
import logging
import os
import shlex
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import casadi as ca

log = logging.getLogger("actuator")

# -O2 and -O3 run a tenth faster on this kind of code and take twice as long to compile
FLAGS = ("-O1", "-fPIC", "-shared")


def cache_folder() -> Path:
    """Where compiled systems are kept: $ACTUATOR_CACHE, else the user's cache folder."""
    chosen = os.environ.get("ACTUATOR_CACHE")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "geared-actuator"


@cache
def compiler() -> str | None:
    """Path of the C compiler ($CC, else cc or gcc), or None where there is none."""
    candidates = shlex.split(os.environ["CC"])[:1] if "CC" in os.environ else ["cc", "gcc", "clang"]
    return next((path for path in map(shutil.which, candidates) if path), None)


def compile_function(function: ca.Function) -> ca.Function | None:
    """The same function from compiled C, or None where no C compiler is present.

    Raises
    ------
    RuntimeError
        Where a compiler is present and fails; with its message.
    """
    found = compiler()
    if found is None:
        _say_once("no C compiler found: simulations run interpreted, about ten times slower")
        return None
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        _say_once(f"no cache for compiled systems in {folder} ({error.strerror}): simulations run interpreted")
        return None
    with tempfile.TemporaryDirectory(dir=folder) as work:
        generator = ca.CodeGenerator("system.c", {"with_header": False})
        generator.add(function)
        generator.generate(work + "/")
        source = Path(work) / "system.c"
        key = hashlib.sha256(source.read_bytes() + " ".join((found, *FLAGS)).encode()).hexdigest()[:32]
        library = folder / f"{key}.so"
        if not library.exists():
            target = Path(work) / "system.so"
            done = subprocess.run(
                [found, *FLAGS, str(source), "-o", str(target), "-lm"], capture_output=True, text=True, check=False
            )
            if done.returncode:
                raise RuntimeError(f"{found} failed on generated code: {done.stderr.strip()[:2000]}")
            # atomic, so that two processes may compile the same system at once
            with contextlib.suppress(FileExistsError):
                os.replace(target, library)
    log.info("%s runs compiled (%s, %s)", function.name(), found, library.name)
    return ca.external(function.name(), str(library))


def compiled_where_wanted(function: ca.Function, wanted: bool | None) -> ca.Function | None:
    """The function compiled, or None: False wants none, True insists, None takes what can be had.

    Raises
    ------
    RuntimeError
        Where it is insisted on and there is no C compiler, or one fails.
    """
    loaded = None if wanted is False else compile_function(function)
    if loaded is None and wanted:
        raise RuntimeError("compiled=True needs a C compiler (cc, gcc or $CC); none was found")
    return loaded


@cache
def _say_once(message: str) -> None:
    log.warning(message)
