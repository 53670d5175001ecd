"""What is ours in how Click reads a command line: mistakes are told in one line, each with what may
have been meant, and commands are listed in sections."""

from __future__ import annotations

from typing import ClassVar

import click

from envs.errors import InputError, UnknownNameError, suggestion


class Command(click.Command):
    """A command whose mistakes are told in one line, each with what may have been meant."""

    def parse_args(self, context: click.Context, arguments: list[str]) -> list[str]:
        context.allow_extra_args = True  # looked at here, for a message of our own
        try:
            left = super().parse_args(context, arguments)
        except click.NoSuchOption as error:
            options = [name for one in self.get_params(context) for name in one.opts]
            known = [name for name in options if name.startswith("--")]
            raise _unknown(error.option_name, known) from None
        if context.args and not context.resilient_parsing:  # as when a shell completes
            raise InputError(
                f"unknown argument {context.args[0]!r} (see {context.command_path} --help)"
            )
        return left


def _unknown(argument: str, known: list[str]) -> InputError:
    return InputError(f"unknown argument {argument!r}; {suggestion(argument, set(known))}")


class Commands(click.Group):
    """All commands, listed in sections."""

    sections: ClassVar[dict[str, tuple[str, ...]]] = {
        "Measure": ("run", "train", "paper"),
        "Report": ("report", "compare", "check", "audit", "show", "field"),
        "Try": ("list", "problems", "judge", "paths", "test-planner", "test-env", "replay"),
    }

    def list_commands(self, context: click.Context) -> list[str]:
        return [name for names in self.sections.values() for name in names]

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, self.commands)) + 2
        for section, names in self.sections.items():
            with formatter.section(section):
                rows = [(n.ljust(width), self.commands[n].get_short_help_str(60)) for n in names]
                formatter.write_dl(rows)

    def parse_args(self, context: click.Context, arguments: list[str]) -> list[str]:
        if not arguments and not context.resilient_parsing:
            raise InputError(f"COMMAND is missing; choose from: {', '.join(self.commands)}")
        try:
            return super().parse_args(context, arguments)
        except click.NoSuchOption as error:
            raise _unknown(error.option_name, ["--help", "--version"]) from None

    def resolve_command(
        self, context: click.Context, arguments: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if arguments[0] not in self.commands and not context.resilient_parsing:
            raise UnknownNameError("command", arguments[0], self.commands)
        return super().resolve_command(context, arguments)
