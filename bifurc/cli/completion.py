"""``bifurc completion bash|zsh|fish``: a script that completes commands, systems and options, made from the parser itself."""
import argparse
import inspect

import bifurc as bf

SHELLS = ("bash", "zsh", "fish")


def add(commands, parser) -> None:
    """Add the command to the parser."""
    completion = commands.add_parser("completion", help="print a script that completes commands in a shell",
                                     description=inspect.getdoc(run_completion))
    completion.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))
    completion.set_defaults(run=run_completion, parser=parser)


def run_completion(options: argparse.Namespace) -> int:
    """Print a completion script: ``eval "$(bifurc completion bash)"``, or ``bifurc completion fish | source``."""
    print({"bash": bash, "zsh": zsh, "fish": fish}[options.shell](words(options.parser)))
    return 0


def words(parser: argparse.ArgumentParser) -> dict[str, list[str]]:
    """Return the options of every command, and the systems of those that take one."""
    found = {}
    (commands,) = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    for name, command in commands.choices.items():
        options = [option for action in command._actions for option in action.option_strings]
        takes = any((action.metavar or "").startswith("SYSTEM") for action in command._actions)
        shells = [str(choice) for action in command._actions if action.metavar == "SHELL" for choice in action.choices or ()]
        found[name] = [*options, *(bf.systems.__all__ if takes else ()), *shells]
    return found


def bash(table: dict[str, list[str]]) -> str:
    """Return a script for bash."""
    cases = "\n".join(f"        {name}) words='{' '.join(items)}' ;;" for name, items in table.items())
    return f"""_bifurc() {{
    local words
    if [[ $COMP_CWORD -eq 1 ]]; then words='{' '.join(table)} --version --help'
    else case ${{COMP_WORDS[1]}} in
{cases}
    esac; fi
    COMPREPLY=($(compgen -W "$words" -- "${{COMP_WORDS[COMP_CWORD]}}"))
}}
complete -o default -F _bifurc bifurc"""


def zsh(table: dict[str, list[str]]) -> str:
    """Return a script for zsh, by way of that for bash."""
    return "autoload -U +X bashcompinit && bashcompinit\n" + bash(table)


def fish(table: dict[str, list[str]]) -> str:
    """Return a script for fish."""
    lines = [f"complete -c bifurc -n __fish_use_subcommand -a '{' '.join(table)}'"]
    for name, items in table.items():
        flags = [item.removeprefix("--") for item in items if item.startswith("--")]
        plain = [item for item in items if not item.startswith("-")]
        lines += [f"complete -c bifurc -n '__fish_seen_subcommand_from {name}' -l {flag}" for flag in flags]
        if plain:
            lines.append(f"complete -c bifurc -n '__fish_seen_subcommand_from {name}' -a '{' '.join(plain)}'")
    return "\n".join(lines)
