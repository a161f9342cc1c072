"""The help of commands: usage, options in panels, and examples to copy.

The lines at the end of a command's docstring that begin with ``facert`` are its examples.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from enum import Enum
from typing import Any

from rich.console import Console
from rich.panel import Panel
from rich.table import Table
from rich.text import Text
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

FILES = "Files"
"""The last panel: what is read beside a take, and what is written where."""
VALUES = {"path": "FILE", "str": "TEXT", "int": "N", "float": "X"}
"""What stands for a value of a type that has no name of its own."""
RESULT = "retargeted.h5"
"""A file that examples take; the example that writes it is `RETARGET`."""
RETARGET = f"facert retarget facert-demo/performance.h5 {RESULT}"

Row = tuple[str, Text]


class Command(TyperCommand):
    """A command whose help names values plainly, and ends with its examples."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """The arguments by their names, those that may be left out in brackets."""
        arguments = [param for param in self.get_params(ctx) if isinstance(param, TyperArgument)]
        names = [_argument(one) if one.required else f"[{_argument(one)}]" for one in arguments]
        return ["[OPTIONS]", *names]

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002  as the parent has it
        """Print the help as wide as the terminal."""
        _print_help(self, ctx)


class Group(TyperGroup):
    """Group of commands, listed in panels."""

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002  as the parent has it
        """Print the help as wide as the terminal."""
        _print_help(self, ctx)


def examples(command: TyperCommand | TyperGroup) -> list[str]:
    """The examples of a command, ready for a shell."""
    _, begin, rest = (command.help or "").partition("\n\nfacert ")
    return f"facert {rest}".splitlines() if begin else []


def _print_help(command: TyperCommand | TyperGroup, ctx: Any) -> None:
    console = Console(highlight=False)
    console.print(Text(f"\n{command.get_usage(ctx)}\n", style="bold"))
    for paragraph in (command.help or "").partition("\n\nfacert ")[0].split("\n\n"):
        console.print(Text(" ".join(paragraph.split()) + "\n"))
    panels: dict[str, list[Row]] = defaultdict(list)
    for param in command.get_params(ctx):
        if isinstance(param, TyperArgument):
            panels["Arguments"].append((_argument(param), _description(param)))
        elif isinstance(param, TyperOption):
            rows = panels[param.rich_help_panel or "Options"]
            rows.append((_option(param, ctx), _description(param)))
    for one in _commands(command, ctx):
        panels[one.rich_help_panel or "Commands"].append((str(one.name), _summary(one)))
    width = max(len(first) for rows in panels.values() for first, _ in rows)
    for name in sorted(panels, key=lambda name: name == FILES):
        console.print(_panel(name, panels[name], width))
    if examples(command):
        lines = "\n".join(f"  {line}" for line in examples(command))
        if RESULT in lines and RETARGET not in lines:
            console.print(Text(f"\nTo make the examples' {RESULT}\n  {RETARGET}"), soft_wrap=True)
        console.print(Text(f"\nExamples\n{lines}"), soft_wrap=True)


def _panel(name: str, rows: Iterable[Row], width: int) -> Panel:
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True, width=width, style="cyan")
    table.add_column()
    for first, second in rows:
        table.add_row(Text(first), second)
    return Panel(table, title=name, title_align="left", border_style="dim")


def _commands(command: TyperCommand | TyperGroup, ctx: Any) -> list[Any]:
    if not isinstance(command, TyperGroup):
        return []
    return [command.get_command(ctx, name) for name in command.list_commands(ctx)]


def _summary(command: Any) -> Text:
    return Text(" ".join((command.help or "").split("\n\n")[0].split()))


def _argument(param: TyperArgument) -> str:
    return param.metavar or str(param.name).upper()


def _option(param: TyperOption, ctx: Any) -> str:
    """The names of an option, the short one first, and what stands for its value."""
    names = ", ".join([*sorted(param.opts, key=len), *param.secondary_opts])
    if param.is_flag:
        return names
    kind = param.display_type(ctx).strip("<>").removesuffix(" range")
    return f"{names} {param.metavar or VALUES.get(kind, kind)}"


def _description(param: TyperArgument | TyperOption) -> Text:
    """The help, and the default where there is one."""
    text, default = Text(param.help or ""), param.default
    if isinstance(param.show_default, str):
        default = param.show_default
    if param.required and isinstance(param, TyperOption):
        text.append(" [required]", style="red")
    elif param.show_default and default is not False and default not in (None, "", ()):
        shown = default.value if isinstance(default, Enum) else default
        text.append(f" [default: {shown}]", style="dim")
    return text
