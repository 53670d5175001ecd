"""The command line, with a 32nd of the training that NTFields gets in rooms."""

from __future__ import annotations

import sys
from dataclasses import replace

from bench import cli
from planners.fields.methods import IN_ROOMS
from planners.learning import trainer
from planners.learning.training_loop import Recipe

if __name__ == "__main__":
    whole = IN_ROOMS["ntfields"]
    IN_ROOMS["ntfields"] = replace(whole, recipe=Recipe(steps=whole.recipe.steps // 32))
    trainer._VALIDATION_PROBLEMS = 2
    sys.exit(cli.main(sys.argv[1:]))
