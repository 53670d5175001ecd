"""The arguments of all commands, in the order of the help."""

from bench.cli.arguments.measuring import add_paper, add_run, add_train
from bench.cli.arguments.reporting import add_check, add_compare, add_field, add_report, add_show
from bench.cli.arguments.trying import add_list, add_replay, add_test_planner

COMMANDS = (
    add_run,
    add_train,
    add_report,
    add_compare,
    add_check,
    add_show,
    add_field,
    add_paper,
    add_test_planner,
    add_replay,
    add_list,
)
"""Each adds a command to the subparsers that it is given."""

__all__ = ["COMMANDS"]
