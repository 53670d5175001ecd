"""What each command of the command line does, given its parsed arguments; the exit code."""

from __future__ import annotations

import dataclasses
import json
import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import envs
import planners
from bench import api, conformance
from bench import replay as replaying
from bench.analysis import audit as auditing
from bench.analysis import comparison, regression, summary
from bench.analysis.run_results import RunResults
from bench.cli.terminal import note, tell, tell_tables
from bench.execution import weights_manager
from bench.execution.config import make_run_config, on_device
from bench.execution.problem_choice import check_range
from bench.judged_file import judge_file
from bench.report import comparison_text, markdown, path_file, regression_text, writers
from envs import InputError
from envs.seeding import TEST_SEEDS

DONE, REGRESSION, NOTHING_MEASURED = 0, 1, 3
FAILED = DIFFERENT = 1

_AUDITED_MEMORY_MB = 4096

_SPREADS = {"deviation": "std", "variance": "var"}


def run(chosen: SimpleNamespace) -> int:
    """`bench run`."""
    config = make_run_config(
        env=chosen.env,
        planner=chosen.planners,
        problems=chosen.problems,
        repeats=chosen.repeats,
        seed=chosen.seed,
        time_limit_s=chosen.time_limit,
        stop=chosen.stop,
        jobs=chosen.jobs,
        memory_limit_mb=chosen.memory_limit,
        train=not chosen.no_train,
        device=chosen.device,
        keep_invalid=chosen.keep_invalid,
        simplify_s=chosen.simplify,
        problem_file=chosen.problem_file,
    )
    folder: Path = chosen.out or Path("results/runs") / config.problem_sets[0].entry.spec.id
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    recorded = api.carry_out(config, folder, force=chosen.force, started_s=chosen.started_s)
    tell_tables(markdown.text(recorded), wide=chosen.wide)
    note(f"{folder}: {', '.join(sorted(p.name for p in folder.iterdir()))}")
    return DONE if summary.attempted(recorded.records) else NOTHING_MEASURED


def train(chosen: SimpleNamespace) -> int:
    """`bench train`."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    file = weights_manager.train(
        envs.REGISTRY.entry(chosen.env),
        planners.REGISTRY.entry(chosen.planner).imported(),
        seed=chosen.seed,
        minutes=chosen.minutes,
        device=chosen.device,
        out=chosen.out,
    )
    tell(str(file))
    return DONE


def report(chosen: SimpleNamespace) -> int:
    """`bench report`."""
    formats = writers.chosen_formats(chosen.format)
    runs = [RunResults.read(folder) for folder in chosen.dirs]
    if chosen.out is not None:
        runs = [RunResults.joined(runs)]
    for run in (dataclasses.replace(run, spread=_SPREADS[chosen.spread]) for run in runs):
        writers.write(run, chosen.out or run.folders[0], formats)
        tell_tables(markdown.text(run), wide=chosen.wide)
    return DONE


def audit(chosen: SimpleNamespace) -> int:
    """`bench audit`."""
    from bench.report import audit_report  # takes a second, which only this command needs

    run = _run_to_audit(chosen)
    found = auditing.audit(run)
    folder: Path = chosen.out or run.folders[0]
    written = audit_report.write(run, found, folder)
    tell_tables(audit_report.text(run, found), wide=chosen.wide)
    note(f"{folder}: {', '.join(written)}")
    return DONE


def _run_to_audit(chosen: SimpleNamespace) -> RunResults:
    """The runs of some folders, or one that is made first."""
    if bool(chosen.dirs) == bool(chosen.env) or bool(chosen.env) != bool(chosen.planners):
        raise InputError("name folders of runs, or --env and --planners to run first")
    if chosen.dirs:
        return RunResults.joined([RunResults.read(folder) for folder in chosen.dirs])
    config = make_run_config(
        env=chosen.env,
        planner=chosen.planners,
        problems=chosen.problems,
        seed=chosen.seed,
        time_limit_s=chosen.time_limit,
        stop="first",
        jobs=chosen.jobs,
        memory_limit_mb=_AUDITED_MEMORY_MB,
    )
    folder = chosen.out or Path("results/runs") / f"audit-{config.problem_sets[0].entry.spec.id}"
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    return api.carry_out(config, folder, started_s=chosen.started_s)


def compare(chosen: SimpleNamespace) -> int:
    """`bench compare`."""
    a = RunResults.read(chosen.a)
    b = a if chosen.b is None else RunResults.read(chosen.b)
    who = comparison.chosen_planners(chosen.planners, a, b)
    pairing = comparison.pair_runs(a, b, who)
    metrics = comparison.chosen_metrics(chosen.metrics, a, b)
    table = comparison.compare(pairing.pairs, metrics)
    if chosen.out is not None:
        comparison_text.write_csv(table, chosen.out)
    text = comparison_text.text(a, b, table, pairing.left_out, metrics)
    tell_tables(text, wide=chosen.wide)
    return DONE


def check(chosen: SimpleNamespace) -> int:
    """`bench check`."""
    wanted = regression.CheckOptions.parse(
        alpha=chosen.alpha,
        ratios=chosen.ratios,
        reference=chosen.reference,
        tolerance=chosen.tolerance,
        update=chosen.update,
    )
    file: Path = chosen.baseline
    run = RunResults.read(chosen.dir)
    now = regression.Baseline.of(run, wanted.measures)
    wanted = wanted.of(now, str(chosen.dir))
    if chosen.update:
        if run.incomplete:
            note(run.incomplete)
        return _update(now.attempted, file, chosen)
    before = regression.read(file)
    found = regression.check(before, now, wanted.of(before, str(file)), run.incomplete)
    _tell(regression_text.text(found, chosen.dir, file), chosen)
    if found.regressions:
        return REGRESSION
    return DONE if found.passes else NOTHING_MEASURED


def _update(now: regression.Baseline, file: Path, chosen: SimpleNamespace) -> int:
    """`bench check --update`."""
    if not now.rows:
        note("nothing was measured; no baseline is written")
        return NOTHING_MEASURED
    before = regression.read(file) if file.exists() else None
    regression.write(now, file)
    _tell(regression_text.changes(before, now, file), chosen)
    return DONE


def _tell(text: str, chosen: SimpleNamespace) -> None:
    if chosen.out is not None:
        regression_text.write_text(text, chosen.out)
    tell_tables(text, wide=chosen.wide)


def show(chosen: SimpleNamespace) -> int:
    """`bench show`."""
    # Matplotlib takes a second, which only this command needs.
    from bench.report import chosen_paths, scene

    env = envs.REGISTRY.entry(chosen.env)
    world = env.make()
    shown, seed = None, 0
    if chosen.paths is not None:
        records = RunResults.read(chosen.paths).records
        records = chosen_paths.of_planners(records, chosen.planners, chosen.paths)
        shown = chosen_paths.paths_of_problem(records, world.fingerprint, chosen.problem)
        seed = int(records["problems_seed"].iloc[0])
    if world.scenes_differ:
        number = shown.problem if shown else chosen.problem or 0
        [problem] = world.problems_at([number], seed)
        world = world.scene_of(problem)
    scene.draw(world, env.id, shown, chosen.out)
    return DONE


def field(chosen: SimpleNamespace) -> int:
    """`bench field`."""
    from bench.report import field as fields  # matplotlib, as above

    env = envs.REGISTRY.entry(chosen.env)
    world = env.make()
    where = fields.Slice.through(world, chosen.source and np.array(chosen.source))
    found = {}
    for entry in planners.REGISTRY.entries(chosen.planners):
        entry = on_device(entry, chosen.device).imported()
        planner = weights_manager.ready(env, entry, not chosen.no_train)
        found[entry.id] = fields.field_of(planner, entry.id, where)
    reference = found.get("fmm")
    if reference is None:
        fmm = weights_manager.ready(env, planners.REGISTRY.entry("fmm"), may_train=False)
        reference = fields.field_of(fmm, "fmm", where)
    table = fields.errors(found, reference, where)
    fields.draw([fields.Strip(env.id, where, found, table)], chosen.out)
    tell(table.to_markdown(index=False, floatfmt=".4f"))
    return DONE


def paper(chosen: SimpleNamespace) -> int:
    """`bench paper`."""
    from bench.paper import runner  # matplotlib, as above
    from bench.paper.experiment import Place

    folder = runner.data_folder()
    names = [name for name in (chosen.only or "").split(",") if name]
    experiments = runner.experiments(folder)
    wanted = runner.chosen(experiments, names)
    out = chosen.out or Path("results/runs") / ("paper-quick" if chosen.quick else "paper")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    outcome = runner.carry_out(wanted, experiments, Place(folder, out, chosen.quick))
    tell_tables(outcome.text, wide=chosen.wide)
    if outcome.failed:
        left = ", ".join(outcome.failed)
        raise InputError(f"could not be carried out, see {out / 'paper.md'}: {left}")
    return DONE


def test_planner(chosen: SimpleNamespace) -> int:
    """`bench test-planner`."""
    check_range("--time-limit", chosen.time_limit, 0.001, 86_400)
    env = envs.REGISTRY.entry(chosen.env)
    with conformance.resolve_planner(chosen.planner) as planner:
        evidence = conformance.gathered(env, planner, chosen.time_limit)
    found = conformance.findings(evidence)
    tell("\n".join(finding.text for finding in found))
    if evidence.unsupported:
        raise InputError(
            f"{planner.id} does not plan in {env.id}, so little was checked; choose another --env: "
            + evidence.unsupported
        )
    return FAILED if any(f.outcome is conformance.Outcome.FAILED for f in found) else DONE


def test_env(chosen: SimpleNamespace) -> int:
    """`bench test-env`."""
    check_range("--seed", chosen.seed, 0, TEST_SEEDS - 1)
    found = conformance.environment_findings(envs.REGISTRY.entry(chosen.env), chosen.seed)
    tell("\n".join(finding.text for finding in found))
    return FAILED if any(f.outcome is conformance.Outcome.FAILED for f in found) else DONE


def judge(chosen: SimpleNamespace) -> int:
    """`bench judge`."""
    found = judge_file(
        chosen.env,
        chosen.paths,
        problems=chosen.problems,
        seed=chosen.seed,
        problem_file=chosen.problem_file,
    )
    if chosen.json:
        tell(json.dumps(found.data, indent=2))
    else:
        tell_tables(found.text, wide=chosen.wide)
    if not found.judgements:
        return NOTHING_MEASURED
    return DONE if found.all_valid else FAILED


def paths(chosen: SimpleNamespace) -> int:
    """`bench paths`."""
    run = RunResults.read(chosen.dir)
    count = path_file.write(run, chosen.out, chosen.planner, chosen.env, chosen.repeat)
    note(f"{chosen.out}: {count} attempts")
    return DONE


def replay(chosen: SimpleNamespace) -> int:
    """`bench replay`."""
    found = replaying.replay(chosen.dir, chosen.planner, chosen.problem, chosen.env, chosen.repeat)
    tell(found.text)
    return DIFFERENT if found.difference else DONE
