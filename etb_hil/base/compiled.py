"""Compile functions with numba, and keep their machine code on disk.

Its key is a hash of everything it was made from.

Numba's own cache looks at a function's source file only. Machine code that holds other files' functions and constants
stays in use there when those change. Here the key has the fingerprint of all of them, the argument types, and what
compiles: Python, numba, llvmlite, numpy and the processor.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import logging
import os
import pickle
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any, TypeAlias, TypeVar

import llvmlite
import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core.base import BaseContext
from numba.core.caching import _Cache
from numba.core.codegen import CPUCodegen, CPUCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.environment import Environment, lookup_environment
from numba.core.errors import ForceLiteralArg
from numba.core.runtime import nrtdynmod, rtsys
from numba.core.serialize import dumps
from numba.core.types import BooleanLiteral, IntegerLiteral, Type
from numba.core.typing.templates import Signature
from numba.misc.appdirs import AppDirs

from etb_hil.base.claim import Claim
from etb_hil.base.fingerprint import fingerprint, options_fingerprint, type_fingerprint
from etb_hil.base.known_calls import remember_calls
from etb_hil.base.lean_imports import lean_numba

_CONFIG: Any = numba.config
PACKAGE = Path(__file__).resolve().parent.parent
Function = TypeVar("Function", bound=Callable[..., Any])
Types: TypeAlias = Signature | tuple[Type, ...]
LOG = logging.getLogger(__name__)  # one record at level INFO for each function that has to be compiled

_FORMAT = 3  # of a file's content
_RUNTIME = "numba.runtime"  # its file
# What does not say these has them from whatever calls it first, by numba: its bits would depend on who that was.
_OWN: Mapping[str, object] = {"fastmath": False, "error_model": "python"}
_HASH = 16  # hexadecimal digits of a hash in a name: 64 bits
_CHECKSUM = hashlib.sha256().digest_size


def njit(*, cache: bool, **options: object) -> Callable[[Function], Function]:
    """Return the decorator `numba.njit`, without a wrapper for calls by address.

    The decorator takes numba's options.

    With `cache` the machine code is kept for later processes.
    """

    def compiled(function: Function) -> Function:
        dispatcher = _dispatcher(function, options, cache=cache)
        if isinstance(dispatcher, Dispatcher):  # with NUMBA_DISABLE_JIT it is the function itself
            inner = functools.cache(functools.partial(_without_wrapper, dispatcher, options, cache=cache))
            dispatcher.get_call_template = lambda *types: _called_with(inner(), *types)
            dispatcher.get_overload = lambda signature: inner().get_overload(signature)
        return dispatcher

    return compiled


def _called_with(dispatcher: Any, types: Iterable[Type], named: Mapping[str, Type]) -> Any:  # noqa: ANN401 (numba's)
    """Return how a function is called from compiled code, by numba.

    Where a caller writes a whole number or a truth value, numba would compile the function anew for it.
    """
    try:
        plain = {name: _without_value(one) for name, one in named.items()}
        return dispatcher.get_call_template(tuple(map(_without_value, types)), plain)
    except ForceLiteralArg:  # it asks for the number
        return dispatcher.get_call_template(types, named)


def _without_value(one: Type) -> Type:
    return one.literal_type if isinstance(one, IntegerLiteral | BooleanLiteral) else one


def _dispatcher(function: Function, options: Mapping[str, object], *, cache: bool) -> Function:
    """Return numba's compiler of a function for its types of arguments."""
    # An address, which needs one more wrapper, nobody takes.
    dispatcher = numba.njit(no_cfunc_wrapper=True, **{**_OWN, **options})(function)
    if isinstance(dispatcher, Dispatcher):
        code = _MachineCode(dispatcher) if cache else None
        _remember_failures(dispatcher._compiler, code)  # noqa: SLF001 (numba has no other way in)
        if cache:
            dispatcher._cache = code  # noqa: SLF001 (as its `enable_caching` does)
    return dispatcher


def _without_wrapper(dispatcher: Any, options: Mapping[str, object], *, cache: bool) -> Any:  # noqa: ANN401
    """Return the compiler for calls of a function from compiled code.

    The wrapper for calls from Python takes time to compile, and hardly one function of ours needs both.
    """
    inner: Any = _dispatcher(dispatcher.py_func, {**options, "no_cpython_wrapper": True}, cache=cache)
    inner._compiling_counter = dispatcher._compiling_counter  # noqa: SLF001 (by it numba knows a recursive call)
    return inner


def _remember_failures(compiler: Any, code: _MachineCode | None) -> None:  # noqa: ANN401 (numba has no types)
    """Let a function that cannot be compiled fail at once when it is called again.

    Numba remembers errors of types only. A loop that goes on after an error, as the one that switches a drive off does,
    would otherwise spend each of its ticks on compiling in vain.
    """
    compile_anew = compiler._compile_core  # noqa: SLF001 (numba has no other way in)

    def compile_once(arguments: Any, return_type: Any) -> Any:  # noqa: ANN401
        try:
            return compile_anew(arguments, return_type)
        except Exception as error:
            compiler._failed_cache[tuple(arguments), return_type] = error  # noqa: SLF001
            if code is not None:
                code.give_up()
            raise

    compiler._compile_core = compile_once  # noqa: SLF001


def folders() -> list[Path]:
    """Return the folders of machine code, best first.

    They are NUMBA_CACHE_DIR, or one beside the package and one in the user's cache.
    """
    place = f"etb_hil-{_hash(str(PACKAGE))}"
    if _CONFIG.CACHE_DIR:
        return [Path(_CONFIG.CACHE_DIR) / place]
    return [PACKAGE / "__pycache__" / "machine_code", Path(AppDirs("etb_hil", appauthor=False).user_cache_dir) / place]


class _MachineCode(_Cache):  # type: ignore[misc] # numba has no types
    """The machine code of one function, a file for each tuple of argument types."""

    def __init__(self, dispatcher: Any) -> None:  # noqa: ANN401 (numba has no types)
        function: FunctionType = dispatcher.py_func
        self._function, self._options = function, options_fingerprint(dispatcher.targetoptions)
        self._name = f"{function.__module__}.{function.__qualname__}".replace("<", "").replace(">", "")
        self._is_enabled = True
        self._claim: Claim | None = None

    @property
    def cache_path(self) -> str:
        """The best folder."""
        return str(folders()[0])

    def enable(self) -> None:
        """Read and write files from now on."""
        self._is_enabled = True

    def disable(self) -> None:
        """Compile without files from now on."""
        self._is_enabled = False

    def flush(self) -> None:
        """Delete the function's files."""
        for folder in folders():
            _delete(folder.glob(f"*/{self._name}-*"))

    def load_overload(self, signature: Types, target_context: BaseContext) -> CompileResult | None:
        """Return what was compiled for a signature, None if it is not there.

        Then numba compiles it. Of several processes that need it, one compiles it and the others wait.
        """
        _start_runtime(target_context)
        name = f"{_environment(target_context.codegen())}/{self._file(signature)}"
        content = _kept(name) if self._is_enabled else None
        if content is None and self._is_enabled and self._claim is None:
            claim = Claim(folders()[0] / self._file(signature))
            claim.take((folders()[0] / name).exists)
            content = _kept(name)
            if content is None:
                self._claim = claim
            else:
                claim.end()
        if content is not None:
            return _unpacked(target_context, content)
        _load_numba(target_context)
        LOG.info("compiling %s", self._name)
        return None

    def give_up(self) -> None:
        """Let other processes compile the function."""
        if self._claim is not None:
            self._claim.end()
            self._claim = None

    def save_overload(self, signature: Types, result: CompileResult) -> None:
        """Keep what was compiled for a signature, in the first folder that takes it."""
        try:
            self._save(signature, result)
        finally:
            self.give_up()

    def _save(self, signature: Types, result: CompileResult) -> None:
        if not self._is_enabled or result.lifted or result.library.has_dynamic_globals:
            return
        environment, name = _environment(result.codegen), self._file(signature)
        folder = _keep(environment, name, _packed(result))
        if folder is not None:
            code = name.rpartition("-")[0]
            siblings = (folder / environment).glob(f"{self._name}-*")
            _delete(path for path in siblings if not path.name.startswith(code))

    def _file(self, signature: Types) -> str:
        types = [type_fingerprint(one) for one in getattr(signature, "args", signature)]
        return f"{self._name}-{fingerprint(self._function)[:_HASH]}-{_hash(repr((types, self._options)))}"


def _start_runtime(target_context: BaseContext) -> None:
    """Start what counts references of arrays, which all machine code calls.

    Compiling it takes LLVM's optimiser: a twentieth of a second and 25 MB, which a warm process needs for nothing else.
    """
    nrtdynmod.compile_nrt_functions = _runtime
    rtsys.initialize(target_context)


def _runtime(target_context: BaseContext) -> CPUCodeLibrary:
    """Return numba's runtime, as `nrtdynmod.compile_nrt_functions` does."""
    codegen = target_context.codegen()
    environment = _environment(codegen)
    content = _kept(f"{environment}/{_RUNTIME}")
    if content is not None:
        return codegen.unserialize_library(pickle.loads(content))  # noqa: S301 (our own file, as all machine code)
    module, library = nrtdynmod.create_nrt_module(target_context)
    library.enable_object_caching()
    library.add_ir_module(module)
    library.finalize()
    _keep(environment, _RUNTIME, pickle.dumps(library.serialize_using_object_code()))
    return library


def _packed(result: CompileResult) -> bytes:
    """Return what was compiled as the content of a file.

    Machine code holds what it calls. Only callers that are compiled anew need LLVM's code. It stands apart, since
    parsing it takes half of the time of loading. In its place numba gets a function of the name that it looks for.
    Last come the names of the functions that the machine code calls and does not hold.
    """
    (name, kind, (machine_code, llvm_code)), *others = result._reduce()  # noqa: SLF001 (as numba's cache does)
    functions = list(result.library._get_module_for_linking().functions)  # noqa: SLF001 (likewise)
    wrapper = result.fndesc.llvm_cpython_wrapper_name
    is_wrapped = any(one.name == wrapper for one in functions)
    stub = llvm.parse_assembly(f'define void @"{wrapper}"() {{ ret void }}' if is_wrapped else "")
    called = [one.name for one in functions if one.is_declaration and not one.name.startswith("llvm.")]
    return bytes(dumps(((name, kind, (machine_code, stub.as_bitcode())), *others, llvm_code, called)))


def _unpacked(target_context: BaseContext, content: bytes) -> CompileResult:
    """Return what `_packed` made a file's content of."""
    *parts, llvm_code, called = _Unpickler(io.BytesIO(content)).load()
    engine = target_context.codegen()._engine  # noqa: SLF001 (numba has no other way in)
    if not all(engine.is_symbol_defined(name) or llvm.address_of_symbol(name) for name in called):
        _load_numba(target_context)
    result = CompileResult._rebuild(target_context, *parts)  # noqa: SLF001 (as numba's cache does)
    parse = functools.cache(functools.partial(llvm.parse_bitcode, llvm_code))
    result.library._get_module_for_linking = parse  # noqa: SLF001 (numba's own returns what is parsed already)
    return result


class _Unpickler(pickle.Unpickler):
    """Read machine code without importing modules of numba."""

    def find_class(self, module: str, name: str) -> Any:  # noqa: ANN401 (the signature of pickle)
        """Return what a name in a file stands for."""
        return _rebuilt_environment if name == "_rebuild_env" else super().find_class(module, name)


def _rebuilt_environment(module: str, constants: list[object], name: str) -> Environment:
    """Return the constants of compiled code by their name, as numba does.

    Numba's imports the module, a tenth of a second for those of numba itself. Compiled code reads nothing from it.
    """
    known = lookup_environment(name)
    if known is None:
        known = Environment(vars(sys.modules[module]) if module in sys.modules else {"__name__": module})
        known.consts[:] = constants
        known.env_name = name
        Environment._memo[name] = known  # noqa: SLF001 (as numba's own function does)
    return known


def _load_numba(target_context: BaseContext) -> None:
    """Make all functions of numba known, which compiling needs.

    The modules take more than a tenth of a second.
    """
    with lean_numba():
        target_context.refresh()
    remember_calls()


@functools.cache
def _environment(codegen: CPUCodegen) -> str:
    """Return the name of the folder for what compiles.

    The name has Python, processor, and a hash of versions and settings.
    """
    triple, processor, features = codegen.magic_tuple()
    versions = (_FORMAT, sys.version, numba.__version__, llvmlite.__version__, np.__version__)
    settings = (str(_CONFIG.OPT), _CONFIG.BOUNDSCHECK, _CONFIG.LOOP_VECTORIZE, _CONFIG.SLP_VECTORIZE)
    machine = _hash(repr((triple, processor, features)))
    return f"{sys.implementation.cache_tag}-{machine}-{_hash(repr((versions, settings)))}"


def _drop_other_versions(folder: Path, environment: str) -> None:
    """Delete what other versions compiled for this Python and processor.

    What numba's own cache had goes, too.
    """
    for other in folder.glob(f"{environment.rpartition('-')[0]}-*"):
        if other.name != environment:
            _delete(other.iterdir())
            with contextlib.suppress(OSError):
                other.rmdir()
    _delete(PACKAGE.rglob("__pycache__/*.nb[ic]"))


def _kept(name: str) -> bytes | None:
    """Return the content of a file in the first folder that has it."""
    return next((content for folder in folders() if (content := _read(folder / name)) is not None), None)


def _keep(environment: str, name: str, content: bytes) -> Path | None:
    """Write a file in the first folder that takes it; return the folder."""
    for folder in folders():
        with contextlib.suppress(OSError):  # read-only, or full
            if not (folder / environment).is_dir():
                (folder / environment).mkdir(parents=True, exist_ok=True)
                _drop_other_versions(folder, environment)
            _write(folder / environment / name, content)
            return folder
    return None


def _read(path: Path) -> bytes | None:
    """Return a file's content; None where there is none, or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    content = data[_CHECKSUM:]
    return content if hashlib.sha256(content).digest() == data[:_CHECKSUM] else None


def _write(path: Path, content: bytes) -> None:
    """Write a file that is there as a whole or not at all.

    Others may read or write it at the same time.
    """
    part = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        part.write_bytes(hashlib.sha256(content).digest() + content)
        part.replace(path)
    except OSError:
        _delete([part])
        raise


def _delete(paths: Iterable[Path]) -> None:
    for path in paths:
        with contextlib.suppress(OSError):
            path.unlink()


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_HASH]
