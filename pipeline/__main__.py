"""Command line: `python -m pipeline <verb> key=value ...`.

Every verb is a function of `pipeline.stages`; its arguments are the keys of `conf/<verb>.yaml`.
"""

from __future__ import annotations

import ast
import errno
import os
import sys
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

# as a module, for a sweep sends functions of this one to its workers with all that they name
from unmodelled.base import workers

if TYPE_CHECKING:
    from omegaconf import DictConfig

    from unmodelled.base.errors import BadInput

CONF = Path(__file__).parent.parent / "conf"

#: What a full disk, or one that nothing can be written to, says, wherever it is.
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)

#: Threads of numerical libraries, one each unless the user says otherwise: matrices here are so small that
#: threads wait for each other, beside another process most of the time. What profits from cores has workers.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

#: Options of Hydra that no value follows, unlike that of --cfg job.
FLAGS = {"-m", "--multirun", "--resolve"}

#: Of ours: how much is shown (`unmodelled.base.progress`).
SHOWN = {"-q": "quiet", "--quiet": "quiet", "-v": "verbose", "--verbose": "verbose"}

HELP = """usage: python -m pipeline <verb> [key=value ...]

verbs:
{verbs}

  python -m pipeline <verb> --help     the verb's configuration, every key of which can be given as key=value;
                                       `help <verb>` is the same
  python -m pipeline <verb> --cfg job  the configuration after your changes, nothing is run
  python -m pipeline <verb> -m key=a,b one run for every combination, under outputs/; with EXP_LAUNCHER=joblib
                                       side by side, with EXP_LAUNCHER=slurm on a cluster
  python -m pipeline compare <folder>  the runs of a sweep as one table and figure
  python -m pipeline <verb> -q         results without progress; -v: the configuration, progress every second,
                                       the time. EXP_PROGRESS=quiet or verbose: the same of a whole graph
  python -m pipeline --version         the version and the revision of the code

exit codes: 0 done; 2 bad input (a line for every fault, nothing written); 1 a fault of the program;
            130 interrupted (Ctrl-C)"""

#: Faults of one input that are shown.
FAULTS = 20
#: Said after Ctrl-C.
INTERRUPTION = "interrupted: what was not finished is not written; the same command starts it again"


def verbs() -> dict[str, str]:
    """The verbs and what they do: the first line of each stage's module."""
    stages = sorted((Path(__file__).parent / "stages").glob("[a-z]*.py"))
    return {
        p.stem: p.read_text().splitlines()[0].strip('"') for p in stages if (CONF / f"{p.stem}.yaml").exists()
    }


def main(arguments: list[str]) -> int:
    """Run one verb; return the exit code."""
    try:
        return _main(arguments)
    except BaseException as error:
        if not (isinstance(error, KeyboardInterrupt) or workers.interrupted.is_set()):
            raise
        print(INTERRUPTION, file=sys.stderr)
        return workers.INTERRUPTED


def _main(arguments: list[str]) -> int:
    from unmodelled.base.errors import BadInput, closest

    known = verbs()
    if arguments[:1] == ["help"]:  # `help verb` is `verb --help`
        arguments = [*arguments[1:2], "--help"]
    if not arguments or arguments[0] in ("-h", "--help"):
        width = max(map(len, known))
        print(HELP.format(verbs="\n".join(f"  {name:<{width}}  {line}" for name, line in known.items())))
        return 0
    verb, rest = arguments[0], arguments[1:]
    if verb in ("-V", "--version", "version"):
        print(_version())
        return 0
    if verb not in known:
        return _refuse(BadInput(f"unknown verb {verb!r}{closest(verb, known)}"))
    for word in rest:
        if word in SHOWN:
            os.environ["EXP_PROGRESS"] = SHOWN[word]
    rest = [word for word in rest if word not in SHOWN]
    if "-h" in rest or "--help" in rest:
        print(_about(verb))
        rest = [*(r for r in rest if r not in ("-h", "--help")), "--cfg", "job"]
    return _run(verb, _options_last(verb, rest))


def _version() -> str:
    import tomllib

    from pipeline.revision import revision

    project = tomllib.loads((CONF.parent / "pyproject.toml").read_text())["project"]
    python = ".".join(map(str, sys.version_info[:3]))
    return f"{project['name']} {project['version']} (revision {revision()}, Python {python})"


def _options_last(verb: str, rest: list[str]) -> list[str]:
    """Keys before options, as Hydra needs them; a bare word after `compare` stands for runs=<folder>."""
    options: list[str] = []
    keys: list[str] = []
    for before, word in zip(["", *rest], rest, strict=False):
        is_value = before.startswith("-") and before not in FLAGS and "=" not in word
        if word.startswith("-") or is_value:
            options.append(word)
        elif verb == "compare" and "=" not in word and not any(key.startswith("runs=") for key in keys):
            # quoted, for Hydra gives commas and brackets a meaning
            keys.append("runs='" + word.replace("'", "\\'") + "'")
        else:
            keys.append(word)
    return [*keys, *options]


def _about(verb: str) -> str:
    """The stage's docstring and its choices of config files, read without importing anything."""
    tree = ast.parse((Path(__file__).parent / "stages" / f"{verb}.py").read_text())
    function = next(n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == verb)
    config = (CONF / f"{verb}.yaml").read_text()
    groups = [g for g in sorted(CONF.iterdir()) if g.is_dir() and f"- {g.name}:" in config]
    choices = [f"  {g.name}={'|'.join(sorted(p.stem for p in g.glob('*.yaml')))}" for g in groups]
    usage = f"usage: python -m pipeline {verb} [key=value ...] [--quiet | --verbose]"
    head = f"{usage}\n\n{ast.get_docstring(function)}\n"
    return "\n".join([head, *(["Choices:", *choices, ""] if choices else []), "Configuration:"])


def _run(verb: str, rest: list[str]) -> int:
    import hydra
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException
    from yaml import YAMLError

    from pipeline.overrides import check_words, explained
    from unmodelled.base.errors import BadInput
    from unmodelled.base.progress import mode

    if _sweeps(rest) and any(r.startswith("out=") for r in rest):
        own = "every run of a sweep has a folder of its own, in hydra.sweep.dir=<folder>"
        return _refuse(BadInput(f"out: {own}"))
    # without this Hydra prints its own traceback and exits
    os.environ["HYDRA_FULL_ERROR"] = "1"
    settings = _hydra_settings(verb, rest)
    sys.argv = [f"{sys.argv[0]} {verb}", *settings, *rest]
    try:
        check_words(verb, rest)
        hydra.main(version_base="1.3", config_path=str(CONF), config_name=verb)(_call)()
    except BadInput as error:
        return _refuse(error)
    except (HydraException, OmegaConfBaseException, ValueError, YAMLError) as error:
        return _refuse(BadInput(explained(error, verb, rest, CONF)))
    except OSError as error:  # the folder of the run
        return _refuse(BadInput(f"{error.filename}: {error.strerror}"))
    folder = next((r.split("=", 1)[1] for r in [*rest, *settings] if r.startswith("hydra.sweep.dir=")), "")
    if _sweeps(rest) and Path(folder).is_dir() and mode() != "quiet":
        print(f"wrote {folder}; compare its runs: python -m pipeline compare {folder}", file=sys.stderr)
    return 0


def _call(config: DictConfig) -> Any:
    """Call the stage that `config` names and return what it returns: a sweeper may minimise it."""
    try:
        return _called(config)
    except Exception as error:
        if workers.interrupted.is_set():  # a library may have made anything of it
            raise KeyboardInterrupt from error
        raise  # to Hydra, one run of a sweep that failed


def _called(config: DictConfig) -> Any:
    """Leave with exit code 2 on bad input, 1 on a fault."""
    import hydra
    from hydra.core.hydra_config import HydraConfig
    from hydra.errors import InstantiationException
    from hydra.types import RunMode
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException

    from pipeline.overrides import checked_paths
    from pipeline.written import written
    from unmodelled.base.errors import BadInput
    from unmodelled.base.progress import mode

    started, since, verbose = time.monotonic(), time.time(), mode() == "verbose"
    try:
        paths = checked_paths(config, CONF)
        if verbose:
            print(OmegaConf.to_yaml(config), file=sys.stderr)
        result = hydra.utils.call(config, **paths)
    except BadInput as error:
        _leave(error)
    except OmegaConfBaseException as error:
        _leave(BadInput(" ".join(str(error).split())))
    except InstantiationException as error:
        # Hydra wraps what the stage raised
        cause: BaseException = error
        while isinstance(cause, InstantiationException) and cause.__cause__ is not None:
            cause = cause.__cause__
        if isinstance(cause, OSError) and cause.errno in FULL:
            cause = BadInput(f"{cause.filename or 'disk'}: cannot be written: {cause.strerror}")
        if isinstance(cause, InstantiationException) or _is_call(cause):
            cause = BadInput(" ".join(str(cause).split()))
        _leave(cause)
    seconds = time.monotonic() - started
    if HydraConfig.get().mode != RunMode.MULTIRUN and mode() != "quiet":
        arguments = {str(key): value for key, value in config.items()} | paths
        stage = str(config["_target_"]).rpartition(".")[0]
        if line := written(stage, arguments, since, hints="DVC_STAGE" not in os.environ):
            print(line, file=sys.stderr)
    if verbose:
        print(f"done in {seconds:.1f} s", file=sys.stderr)
    _note(config, seconds)
    return result


def _is_call(error: BaseException) -> bool:
    """Whether a call failed as such, because the configuration has other keys than the function."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    inside = trace.tb_frame.f_globals["__name__"] if trace is not None else ""
    return isinstance(error, TypeError) and str(inside).startswith("hydra.")


def _note(config: DictConfig, seconds: float) -> None:
    import shlex

    from hydra.core.hydra_config import HydraConfig
    from omegaconf import OmegaConf

    from pipeline.execution import note

    running = HydraConfig.get()
    command = shlex.join(["python", "-m", "pipeline", str(running.job.config_name), *running.overrides.task])
    note(command, OmegaConf.to_yaml(config, resolve=True), config.get("seed"), seconds)


def _leave(error: BaseException) -> NoReturn:
    """End a single run; end one run of a sweep and let the others go on."""
    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode

    from unmodelled.base.errors import BadInput

    if workers.interrupted.is_set():
        raise error
    if not isinstance(error, BadInput):
        traceback.print_exception(error)
    if HydraConfig.get().mode == RunMode.MULTIRUN:
        from pipeline.sweep.runs import FAILURE

        line = str(error) if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
        told = Path(HydraConfig.get().runtime.output_dir) / FAILURE
        told.parent.mkdir(exist_ok=True)
        told.write_text(f"{line}\n")
        # a worker can send every BadInput home, but not every exception
        raise error if isinstance(error, BadInput) else RuntimeError(line)
    # a SystemExit passes through Hydra's job runner without a second line
    sys.exit(_refuse(error) if isinstance(error, BadInput) else 1)


def _sweeps(rest: list[str]) -> bool:
    return "-m" in rest or "--multirun" in rest


def _hydra_settings(verb: str, rest: list[str]) -> list[str]:
    """What is set unless the command line says otherwise."""
    if not _sweeps(rest):
        # a stage writes where `out` says and nowhere else; without `out` a folder of its own
        own = "." if any(r.startswith("out=") for r in rest) else "outputs/${hydra.job.config_name}/last"
        quiet = ["hydra/job_logging=none", "hydra/hydra_logging=none"]
        return [*quiet, "hydra.output_subdir=null", f"hydra.run.dir={own}"]
    settings = ["hydra/job_logging=none", "hydra/hydra_logging=sweep"]
    settings += [f"hydra.sweep.dir=outputs/{verb}/{time.strftime('%Y-%m-%d_%H-%M-%S')}"]
    if launcher := os.environ.get("EXP_LAUNCHER"):
        settings += [f"hydra/launcher={launcher}"]
        # says how many runs are done and how long the others take
        settings += ["hydra.launcher.verbose=10"] if launcher == "joblib" else []
    return settings


def _refuse(error: BadInput) -> int:
    """Print the first fault after `error: `, and every other one after `also: `; return the exit code."""
    if workers.interrupted.is_set():
        raise KeyboardInterrupt
    count = len(error.others)
    more = f" ({count} more {'fault' if count == 1 else 'faults'} below)" if count else ""
    also = [f"also: {other}" for other in error.others[: FAULTS - 1]]
    rest = [f"... and {count - len(also)} more"] if count > len(also) else []
    print("\n".join([f"error: {error}{more}", *also, *rest]), file=sys.stderr)
    return 2


def one_thread() -> None:
    """Give numerical libraries `THREADS`; they read it when they are loaded."""
    for library in THREADS:
        os.environ.setdefault(library, "1")


if __name__ == "__main__":
    one_thread()
    workers.heed_interruptions()
    code = None
    if "EXP_PRELOADED" in os.environ:
        from pipeline.preloaded import ask

        code = ask(sys.argv[1:])
    workers.leave(main(sys.argv[1:]) if code is None else code)
