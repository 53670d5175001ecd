"""How a path is found: planners behind one contract."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from envs.registry import Registry, Spec

if TYPE_CHECKING:
    from planners.base import Budget, Planner, PlannerResult, Status

__all__ = ["Budget", "Planner", "PlannerResult", "Status", "REGISTRY", "make"]


_LATER = ("Budget", "Planner", "PlannerResult", "Status")
"""Of `planners.base`, imported when they are asked for, as in `envs`."""


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module("planners.base"), name)
    return globals()[name]


def _ompl(
    id: str,
    algorithm: str,
    name: str,
    aliases: tuple[str, ...] = (),
    groups: tuple[str, ...] = (),
    not_repeatable: str = "",
    colour: str = "",
) -> Spec:
    return Spec(
        id,
        "planners.ompl.planner:OmplPlanner",
        f"OMPL's {name} with certified motion checks",
        {"algorithm": algorithm},
        aliases=aliases,
        groups=groups,
        version=3,  # 2 asked FCL about motions of points and rigid bodies, from Python
        not_repeatable=not_repeatable,
        colour=colour,
    )


def _field(id: str, description: str, group: str = "", colour: str = "", **more: Any) -> Spec:
    """A time field; `more` are arguments of the planner besides the method, which is `id`."""
    return Spec(
        id,
        "planners.fields.planner:FieldPlanner",
        description,
        {"method": id, **more},
        groups=(group,) if group else (),
        in_all=group != "ablations",
        colour=colour,
    )


def _peer(id: str, entry_point: str, description: str) -> Spec:
    """Another program's planner, which is installed by whoever wants it."""
    return Spec(id, f"planners.peers.{entry_point}", description, groups=("peers",), in_all=False)


def _ompl2(id: str, algorithm: str, name: str, not_repeatable: str = "") -> Spec:
    return Spec(
        f"ompl2-{id}",
        "planners.peers.ompl2:Ompl2Planner",
        f"OMPL 2's {name} with certified motion checks, a peer (python)",
        {"algorithm": algorithm},
        groups=("peers",),
        in_all=False,
        not_repeatable=not_repeatable,
    )


_SECOND_THREAD = (
    "a second thread looks for a solution every 0.1 s, while the roadmap grows as fast as the "
    "machine is"
)
"""Why PRM*'s paths are not repeatable."""


REGISTRY: Registry[Planner] = Registry(
    "planner",
    [
        _field(
            "ntfields", "neural time field, trained on the physics alone", "paper", "tab:orange"
        ),
        _field(
            "ief3d", "the same network, trained on fast marching's times", "paper", "tab:purple"
        ),
        Spec(
            "fmm",
            "planners.fmm:FastMarching",
            "fast marching on a grid of the speed field, 100 nodes along a side (scikit-fmm)",
            groups=("paper",),
            version=2,  # 1 followed each front over the whole grid
            colour="tab:green",
            reference=1,
        ),
        Spec(
            "mpnet",
            "planners.mpnet.planner:MpnetPlanner",
            "imitation of RRT* by a network for many scenes (MPNet), no other planner's help",
            groups=("paper",),
            colour="tab:blue",
            reference=2,  # the paper's
        ),
        _ompl("rrtstar", "RRTstar", "RRT*", ("rrt*",), ("paper",), colour="tab:cyan"),
        _ompl("lazyprmstar", "LazyPRMstar", "LazyPRM*", ("lazyprm*",), ("paper",), colour="gold"),
        _ompl("rrtconnect", "RRTConnect", "RRT-Connect, first solution only"),
        Spec(
            "rrtconnect-fast",
            "planners.compiled.rrt_connect:CompiledRrtConnect",
            "compiled RRT-Connect with proofs of motions, first solution only",
        ),
        Spec(
            "aorrtc",
            "planners.compiled.aorrtc:Aorrtc",
            "compiled RRT-Connect, repeated for ever shorter paths (AORRTC)",
        ),
        _peer("mplib", "mplib:Mplib", "a peer: MPlib's RRT-Connect (python, range)"),
        _peer("roboplan", "roboplan:RoboPlan", "a peer: RoboPlan's RRT-Connect (python, range)"),
        _peer("vamp", "vamp:Vamp", "a peer: VAMP's RRT-Connect (python, range)"),
        _ompl2("rrtconnect", "RRTConnect", "RRT-Connect"),
        _ompl2("aorrtc", "AORRTC", "AORRTC"),
        _ompl2("rrtstar", "RRTstar", "RRT*"),
        _ompl2("informedrrtstar", "InformedRRTstar", "Informed RRT*"),
        _ompl2("prmstar", "PRMstar", "PRM*", _SECOND_THREAD),
        _ompl2("bitstar", "BITstar", "BIT*"),
        _ompl2("fmt", "FMT", "FMT*"),
        _ompl2("bfmt", "BFMT", "bidirectional FMT*"),
        Spec(
            "mpnet-hybrid",
            "planners.mpnet.planner:MpnetPlanner",
            "the same, with RRT-Connect for the motions that the network cannot make feasible",
            {"fallback": "rrtconnect"},
        ),
        _ompl(
            "prmstar",
            "PRMstar",
            "PRM*",
            ("prm*",),
            not_repeatable=_SECOND_THREAD,
        ),
        _ompl("informedrrtstar", "InformedRRTstar", "Informed RRT*", ("informedrrt*",)),
        _ompl("bitstar", "BITstar", "BIT*", ("bit*",)),
        _ompl("aitstar", "AITstar", "AIT*", ("ait*",)),
        _ompl("eitstar", "EITstar", "EIT*", ("eit*",)),
        _ompl("fmt", "FMT", "FMT*, one batch of samples", ("fmt*",)),
        Spec(
            "straight-line",
            "planners.baselines:StraightLine",
            "a baseline: the straight line, if it is free",
        ),
        Spec(
            "random-detours",
            "planners.baselines:RandomDetours",
            "a baseline: the straight line, or by way of a few random places",
        ),
        Spec(
            "recorded",
            "planners.recorded.planner:RecordedPaths",
            "paths that were planned elsewhere, from a file, with the times that it claims",
            in_all=False,
        ),
        _field(
            "eikonet",
            "factored time without symmetry or bounds, trained on speeds (EikoNet)",
            attempts=1,
        ),
        _field(
            "ntrl", "neural time field that is a metric, trained by temporal differences (NTRL)"
        ),
        _field(
            "ntfields-paper",
            "the paper's network, training and single attempt, for a GPU and hours",
            "ablations",
            attempts=1,
        ),
        *(
            _field(id, description, "ablations")
            for id, description in (
                ("ntfields-nosym", "ntfields without symmetry: features concatenated"),
                ("ntfields-wenc", "ntfields with the w-space encoder, brought in gradually"),
                ("ntfields-wenc-early", "ntfields with the w-space encoder from the start"),
                ("ntfields-nowenc", "ntfields without any w-space encoding"),
            )
        ),
    ],
    entry_point_group="bench.planners",
    base="planners.base:Planner",
    of_files={".py": "a file's planners have names of their own, once --planner-file {} is given"},
)


def make(text: str) -> Planner:
    """The planner that `name` or `name:key=value,...` names.

    Raises:
        InputError: a name or an argument is unknown or out of range.
    """
    return REGISTRY.make(text)
