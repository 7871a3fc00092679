"""Interpret the words of a command line, and return an exit code."""

from __future__ import annotations

import io
import os
import sys
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

# as a module, for a sweep sends functions of this one to its workers with all that they name
from unmodelled.base import workers
from unmodelled.cli.program import Program

#: Options of Hydra that no value follows, unlike that of --cfg job.
FLAGS = {"-m", "--multirun", "--resolve"}

#: Address space that the libraries of a verb take when they are loaded (measured for `simulate`), bytes.
LIBRARIES = 8e8

#: Own options: how much is shown (`unmodelled.base.progress`).
SHOWN = {"-q": "quiet", "--quiet": "quiet", "-v": "verbose", "--verbose": "verbose"}

HELP = """usage: {name} <verb> [key=value ...]

verbs:
{verbs}

{forms}

EXP_PROGRESS=quiet or verbose stands for -q or -v, for a whole graph too. EXP_LAUNCHER=joblib makes the runs
of a sweep side by side, EXP_LAUNCHER=slurm on a cluster.

exit codes: 0 done; 2 bad input (a line for every fault, nothing written); 1 a fault of the program;
            130 interrupted (Ctrl-C); 143 ended by SIGTERM (kill, timeout)"""
#: Forms of a command, and what each does.
FORMS = {
    "<verb> --help": "the verb's keys, each of which can be given as key=value; the same as `help <verb>`",
    "<verb> <word> ...": "words without = stand for the keys that must be given: diagnose system.yaml logs",
    "<verb> --cfg job": "the configuration after your changes; nothing is run",
    "<verb> -m key=a,b": "one run for every combination, in folders under outputs/",
    "compare <folder>": "the runs of a sweep as one table and figure",
    "report <folder>": "the answers of all diagnoses in a folder as one page",
    "completion bash": "what makes bash complete verbs, keys and paths (also zsh); eval it at start",
    "<verb> -q": "results without progress",
    "<verb> -v": "the configuration, progress every second, and the time",
    "--version": "the version",
}


def main(program: Program, arguments: list[str]) -> int:
    """Run one verb."""
    try:
        return _main(program, arguments)
    except BaseException as error:
        if not (isinstance(error, KeyboardInterrupt) or workers.interrupted.is_set()):
            raise
        print(workers.INTERRUPTION, file=sys.stderr)
        return workers.exit_code()


def run(program: Program) -> None:
    """Run the command line of the current process, and end the process with the exit code."""
    workers.limit_threads()
    workers.heed_interruptions()
    if isinstance(sys.stdout, io.TextIOWrapper):  # a terminal without Unicode shows what it can
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        code = main(program, sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:  # the program that reads the output, such as head, has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    workers.leave(code)


def _main(program: Program, arguments: list[str]) -> int:
    from unmodelled.base.errors import BadInput, closest
    from unmodelled.cli.refusal import refuse

    if arguments[:1] == ["help"]:  # `help verb` is `verb --help`
        arguments = [*arguments[1:2], "--help"]
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_help(program))
        return 0
    verb, rest = arguments[0], arguments[1:]
    if verb in ("-V", "--version", "version"):
        print(program.version())
        return 0
    if verb == "completion":
        from unmodelled.cli.completion import completion

        try:
            print(completion(program, rest))
        except BadInput as error:
            return refuse(error)
        return 0
    if verb not in program.verbs:
        return refuse(BadInput(f"unknown verb {verb!r}{closest(verb, program.verbs)}"))
    for word in rest:
        if word in SHOWN:
            os.environ["EXP_PROGRESS"] = SHOWN[word]
    rest = [word for word in rest if word not in SHOWN]
    if "-h" in rest or "--help" in rest:
        print(_about(program, verb))
        rest = [*(r for r in rest if r not in ("-h", "--help")), "--cfg", "job"]
    return _run(program, verb, _options_last(program.required_keys(verb), rest))


def _help(program: Program) -> str:
    forms = {f"{program.name} {form}": meaning for form, meaning in FORMS.items()}
    return HELP.format(name=program.name, verbs=_columns(program.summaries()), forms=_columns(forms))


def _columns(rows: Mapping[str, str]) -> str:
    width = max(map(len, rows))
    return "\n".join(f"  {name:<{width}}  {meaning}" for name, meaning in rows.items())


def _about(program: Program, verb: str) -> str:
    """The verb's docstring and its choices of config files, read without importing anything."""
    choices = [f"  {group}={'|'.join(names)}" for group, names in program.choices(verb).items()]
    usage = f"usage: {program.name} {verb} [key=value ...] [--quiet | --verbose]"
    head = f"{usage}\n\n{program.docstring(verb)}\n"
    return "\n".join([head, *(["Choices:", *choices, ""] if choices else []), "Configuration:"])


def _options_last(required: Sequence[str], rest: list[str]) -> list[str]:
    """Keys before options, as Hydra needs them; bare words stand for the required keys, in their order."""
    bare = [key for key in required if not any(word.startswith(f"{key}=") for word in rest)]
    options: list[str] = []
    keys: list[str] = []
    for before, word in zip(["", *rest], rest, strict=False):
        is_value = before.startswith("-") and before not in FLAGS and "=" not in word
        if word.startswith("-") or is_value:
            options.append(word)
        elif bare and "=" not in word and not word.startswith("~"):
            # quoted, for Hydra gives commas and brackets a meaning
            keys.append(f"{bare.pop(0)}='" + word.replace("'", "\\'") + "'")
        else:
            keys.append(word)
    return [*keys, *options]


def _run(program: Program, verb: str, rest: list[str]) -> int:
    import hydra
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException
    from yaml import YAMLError

    from unmodelled.base.errors import BadInput
    from unmodelled.base.limits import check_address_space
    from unmodelled.base.progress import mode
    from unmodelled.cli.call import call
    from unmodelled.cli.overrides import check_words, explained
    from unmodelled.cli.refusal import modules_of, raised_in, refuse

    if _sweeps(rest) and any(r.startswith("out=") for r in rest):
        own = "every run of a sweep has a folder of its own, in hydra.sweep.dir=<folder>"
        return refuse(BadInput(f"out: {own}"))
    # without this Hydra prints its own traceback and exits
    os.environ["HYDRA_FULL_ERROR"] = "1"
    settings = [*program.search_path(verb), *_hydra_settings(verb, rest)]
    sys.argv = [f"{sys.argv[0]} {verb}", *settings, *rest]
    task = partial(call, program)
    task.__module__, task.__name__ = call.__module__, call.__name__  # type: ignore[attr-defined]  # Hydra asks
    try:
        check_address_space(LIBRARIES)
        check_words(program, verb, rest)
        hydra.main(version_base="1.3", config_path=program.folder(verb), config_name=verb)(task)()
    except BadInput as error:
        return refuse(error)
    except (HydraException, OmegaConfBaseException, ValueError, YAMLError) as error:
        return refuse(BadInput(explained(error, program, verb, rest)))
    except Exception as error:
        told = " ".join(str(error).split()) or type(error).__name__
        # a verb's own exception comes home in `return_value` of a job
        of_job = raised_in(error).endswith(".return_value")
        if not of_job and any(name.startswith("hydra_plugins.") for name in modules_of(error)):
            advice = "check its launcher (EXP_LAUNCHER) and the keys hydra.<...>"
            return refuse(BadInput(f"sweep: {told}: {advice}"))
        if isinstance(error, OSError):  # the folder of the run
            place = error.filename or "the working folder was removed, change to another one"
            return refuse(BadInput(f"{place}: {error.strerror}"))
        if of_job or not raised_in(error).startswith("hydra."):
            raise
        return refuse(BadInput(f"hydra: {told}: check the keys hydra.<...> of the command"))
    folder = next((r.split("=", 1)[1] for r in [*rest, *settings] if r.startswith("hydra.sweep.dir=")), "")
    if _sweeps(rest) and Path(folder).is_dir() and mode() != "quiet":
        print(f"wrote {folder}; compare its runs: {program.name} compare {folder}", file=sys.stderr)
    return 0


def _sweeps(rest: list[str]) -> bool:
    return "-m" in rest or "--multirun" in rest


def _hydra_settings(verb: str, rest: list[str]) -> list[str]:
    """Return the default settings of Hydra, which the command line can override."""
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
