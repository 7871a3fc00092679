"""Completion of a command line by a shell: verbs, keys with their choices, and paths."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from unmodelled.base.errors import BadInput, closest
from unmodelled.cli.program import Program

#: What a shell runs at start, by its name; it asks the command itself, so that it never is out of date.
SCRIPTS = {
    "bash": """_unmodelled() {
    local word=${COMP_LINE:0:COMP_POINT}
    word=${word##*[[:space:]]}
    mapfile -t COMPREPLY < <(unmodelled completion words "${COMP_WORDS[1]}" "$word" 2>/dev/null)
    local before=${word%"${COMP_WORDS[COMP_CWORD]}"}
    [[ ${COMP_WORDS[COMP_CWORD]} == "=" ]] && before=$word
    COMPREPLY=("${COMPREPLY[@]#"$before"}")
    [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *[=/] ]] && compopt -o nospace
}
complete -o nosort -F _unmodelled unmodelled
""",
    "zsh": """#compdef unmodelled
_unmodelled() {
    local -a found
    found=(${(f)"$(unmodelled completion words "${words[2]}" "${words[CURRENT]}" 2>/dev/null)"})
    compadd -Q -S '' -a found
}
compdef _unmodelled unmodelled
""",
}
#: How the scripts are switched on.
HOW = {
    "bash": 'eval "$(unmodelled completion bash)"  # in ~/.bashrc',
    "zsh": 'eval "$(unmodelled completion zsh)"  # in ~/.zshrc, after compinit',
}
#: Words of every verb.
OPTIONS = ("--help", "--quiet", "--verbose")


def completion(program: Program, arguments: Sequence[str]) -> str:
    """Return the script of a shell, or the words that may stand where a user writes.

    Raises BadInput for another shell.
    """
    asked, *words = [*arguments, ""]
    if asked == "words":
        verb, word = (*words, "", "")[:2]
        return "\n".join(candidates(program, verb, word))
    if asked not in SCRIPTS:
        lines = "; ".join(HOW.values())
        raise BadInput(f"completion: there is no shell {asked!r}{closest(asked, SCRIPTS)}: {lines}")
    return SCRIPTS[asked].rstrip()


def candidates(program: Program, verb: str, word: str) -> list[str]:
    """Return the words that begin as a user has begun to write one, after a verb that may be unfinished."""
    if verb not in program.verbs:
        return [name for name in (*program.verbs, "help", "completion") if name.startswith(verb)]
    key, given, value = word.partition("=")
    if given:
        choices = program.choices(verb).get(key)
        values = choices if choices is not None else _paths(value)
        return [f"{key}={one}" for one in values if one.startswith(value)]
    keys = sorted(program.keys(verb) - {"_target_"})
    found = [f"{name}=" for name in keys] + list(OPTIONS if word.startswith("-") else ())
    return [one for one in found if one.startswith(word)] or _paths(word)


def _paths(begun: str) -> list[str]:
    """Files and folders that begin so; hidden ones where a user asks for them."""
    folder, slash, name = begun.rpartition("/")
    place = Path(f"{folder}{slash}" or ".").expanduser()
    try:
        there = sorted(place.iterdir())
    except OSError:
        return []
    shown = [path for path in there if path.name.startswith(name) and (name or path.name[0] != ".")]
    return [f"{folder}{slash}{path.name}{'/' if path.is_dir() else ''}" for path in shown]
