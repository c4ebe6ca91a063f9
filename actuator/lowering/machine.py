"""Text in LLVM's language to functions in memory: target, verification, compilation, and objects kept on disk."""

import ctypes
import hashlib
import logging
import os
import tempfile
from functools import cache
from pathlib import Path

from llvmlite import binding as llvm

log = logging.getLogger("actuator")

# -O3 runs no faster on this kind of code
LEVEL = 2
# wide vectors lose: the aileron runs 1.4 times as long with them
AVOIDED = "avx512"


def cache_folder() -> Path:
    """Where machine code is kept: $ACTUATOR_CACHE, else the user's cache folder."""
    chosen = os.environ.get("ACTUATOR_CACHE")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "geared-actuator"


class Library:
    """The functions of a module in memory; they live as long as this object.

    Parameters
    ----------
    text : str
        Of the module, as `function.module` writes it.
    """

    def __init__(self, text: str) -> None:
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target())
        self._engine.add_object_file(llvm.object_file.ObjectFileRef.from_data(_object(text)))
        self._engine.finalize_object()

    def address(self, name: str) -> int:
        """Of a function.

        Raises
        ------
        KeyError
            Where there is none of that name.
        """
        found = self._engine.get_function_address(name)
        if not found:
            raise KeyError(f"the machine code has no function {name!r}")
        return found

    def function(self, name: str, arguments: int):
        """A function of so many arrays, to be called from Python with their addresses."""
        return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arguments)(self.address(name))


@cache
def _features() -> str:
    found = llvm.get_host_cpu_features()
    for name in found:
        found[name] = found[name] and not name.startswith(AVOIDED)
    return found.flatten()


@cache
def _initialized() -> None:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def _target() -> llvm.TargetMachine:
    _initialized()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=_features(),
        opt=LEVEL,
        reloc="default" if os.name == "nt" else "pic",
        codemodel="jitdefault",
        jit=True,
    )


def compile_text(text: str) -> bytes:
    """The object code of a module.

    Raises
    ------
    RuntimeError
        Where the text is no valid module, with LLVM's own words.
    """
    target = _target()
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = target.triple, str(target.target_data)
    module.verify()
    builder = llvm.create_pass_builder(target, llvm.create_pipeline_tuning_options(speed_level=LEVEL))
    builder.getModulePassManager().run(module, builder)
    return target.emit_object(module)


def _object(text: str) -> bytes:
    """The object code of a module from disk, or compiled and kept there."""
    mark = "\n".join([llvm.get_host_cpu_name(), _features(), str(llvm.llvm_version_info), str(LEVEL), text])
    path = cache_folder() / f"{hashlib.sha256(mark.encode()).hexdigest()[:32]}.o"
    try:
        kept = path.read_bytes()
        content, digest = kept[:-32], kept[-32:]
        if hashlib.sha256(content).digest() == digest:  # a damaged object would crash the process
            return content
    except OSError:
        pass
    code = compile_text(text)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(code + hashlib.sha256(code).digest())
        os.replace(file.name, path)  # whole or not at all, as other processes may look for it
    except OSError as error:
        _say_once(f"machine code cannot be kept in {path.parent} ({error.strerror}): it is made anew in each process")
    return code


@cache
def _say_once(message: str) -> None:
    log.warning(message)
