"""One call of a verb, made by Hydra: its configuration becomes arguments, its errors exit codes."""

from __future__ import annotations

import errno
import os
import shlex
import sys
import time
import traceback
from pathlib import Path
from typing import Any, NoReturn

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import InstantiationException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from unmodelled.base import workers
from unmodelled.base.errors import BadInput
from unmodelled.base.extras import missing
from unmodelled.base.progress import mode
from unmodelled.cli.overrides import check_given, checked_paths
from unmodelled.cli.program import Program
from unmodelled.cli.refusal import raised_in, refuse
from unmodelled.cli.written import written

#: What a full disk, or one that nothing can be written to, says, wherever it is.
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)


def call(program: Program, config: DictConfig) -> Any:
    """Call the verb that a configuration names, and return its result, which a sweeper may minimise."""
    try:
        return _called(program, config)
    except Exception as error:
        if workers.interrupted.is_set():  # a library may have made anything of it
            raise KeyboardInterrupt from error
        raise  # to Hydra, one run of a sweep that failed


def _called(program: Program, config: DictConfig) -> Any:
    """Leave with exit code 2 on bad input, 1 on a fault."""
    started, since, verbose = time.monotonic(), time.time(), mode() == "verbose"
    try:
        check_given(config, program)
        paths = checked_paths(config, program)
        if verbose:
            print(OmegaConf.to_yaml(config), file=sys.stderr)
        result = hydra.utils.call(config, **paths)
    except BadInput as error:
        _leave(error)
    except OmegaConfBaseException as error:
        _leave(BadInput(" ".join(str(error).split())))
    except InstantiationException as error:
        _leave(_cause(error))
    seconds = time.monotonic() - started
    single = HydraConfig.get().mode != RunMode.MULTIRUN
    if single:
        workers.ignore_interruptions()  # what is said to be written is written, also for the exit code
    if single and mode() != "quiet":
        arguments = {str(key): value for key, value in config.items()} | paths
        verb, hints = str(config["_target_"]).rpartition(".")[0], "DVC_STAGE" not in os.environ
        if line := written(program.name, verb, arguments, since, hints):
            print(line, file=sys.stderr)
    if verbose:
        print(f"done in {seconds:.1f} s", file=sys.stderr)
    if program.note is not None:
        running = HydraConfig.get()
        words = [*program.name.split(), str(running.job.config_name), *running.overrides.task]
        program.note(shlex.join(words), OmegaConf.to_yaml(config, resolve=True), config.get("seed"), seconds)
    return result


def _cause(error: InstantiationException) -> BaseException:
    """Return the exception of the verb, which Hydra wraps."""
    cause: BaseException = error
    while isinstance(cause, InstantiationException | ImportError) and cause.__cause__ is not None:
        cause = cause.__cause__
    if isinstance(cause, OSError) and cause.errno in FULL:
        return BadInput(f"{cause.filename or 'disk'}: cannot be written: {cause.strerror}")
    if isinstance(cause, PermissionError) and cause.filename:  # of a folder that cannot be entered
        return BadInput(f"{cause.filename}: {cause.strerror}: check its permissions and those of its folder")
    if isinstance(cause, MemoryError):
        return BadInput("the memory is used up: give fewer rows or experiments, or free some memory")
    if isinstance(cause, ModuleNotFoundError) and (line := missing(cause)):
        return BadInput(line)
    if isinstance(cause, InstantiationException) or _is_call(cause):
        return BadInput(" ".join(str(cause).split()))
    return cause


def _is_call(error: BaseException) -> bool:
    """Whether a call failed as such, because the configuration has other keys than the function."""
    return isinstance(error, TypeError) and raised_in(error).startswith("hydra.")


def _leave(error: BaseException) -> NoReturn:
    """End a single run; end one run of a sweep and let the others go on."""
    if workers.interrupted.is_set():
        raise error
    if isinstance(error, BrokenPipeError):  # the program that reads the output, such as head, has read enough
        sys.exit(0)
    if not isinstance(error, BadInput):
        traceback.print_exception(error)
    if HydraConfig.get().mode == RunMode.MULTIRUN:
        # here, for it loads pandas, which many verbs load later or not at all
        from unmodelled.cli.sweep.runs import FAILURE

        line = str(error) if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
        told = Path(HydraConfig.get().runtime.output_dir) / FAILURE
        told.parent.mkdir(exist_ok=True)
        told.write_text(f"{line}\n")
        # a worker can send every BadInput home, but not every exception
        raise error if isinstance(error, BadInput) else RuntimeError(line)
    # a SystemExit passes through Hydra's job runner without a second line
    sys.exit(refuse(error) if isinstance(error, BadInput) else 1)
