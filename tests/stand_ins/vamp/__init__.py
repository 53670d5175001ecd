"""Stands in for VAMP, with what its adapter uses of its interface: one robot, made for the test,
whose planner goes by way of a place between the ends, if that is in no obstacle's box."""

from __future__ import annotations

import numpy as np

SEEN = []


class _Shape:
    def __init__(self, *sizes):
        self.sizes, self.name = sizes, ""


class Sphere(_Shape):
    pass


class Cuboid(_Shape):
    pass


class Cylinder(_Shape):
    pass


class Environment:
    def __init__(self):
        self.shapes = []

    def _add(self, kind, shape):
        assert isinstance(shape, kind)
        for sizes in shape.sizes:
            assert isinstance(sizes, (list, float)), "as nanobind wants them"
        self.shapes.append(shape)

    def add_sphere(self, shape):
        self._add(Sphere, shape)

    def add_cuboid(self, shape):
        self._add(Cuboid, shape)

    def add_capsule(self, shape):
        self._add(Cylinder, shape)


class Settings:
    range = 1.0


class _Path(list):
    def numpy(self):
        return np.array(self, dtype=np.float32)


class _Result:
    def __init__(self, path, iterations=7):
        self.path, self.iterations = _Path(path), iterations


class _Sampler:
    def reset(self):
        self.at = 0


class panda:  # noqa: N801  as it is called there
    """Two joints, in another order than the environment's."""

    @staticmethod
    def joint_names():
        return ["elbow", "shoulder"]

    @staticmethod
    def end_effector():
        return "finger"

    @staticmethod
    def eefk(q):
        elbow, shoulder = q
        both = shoulder + elbow
        pose = np.eye(4, dtype=np.float32)
        pose[:2, :2] = [[np.cos(both), -np.sin(both)], [np.sin(both), np.cos(both)]]
        pose[0, 3] = 0.5 * np.cos(shoulder) + 0.55 * np.cos(both)
        pose[1, 3] = 0.5 * np.sin(shoulder) + 0.55 * np.sin(both)
        return pose

    halton = _Sampler
    xorshift = _Sampler

    @staticmethod
    def rrtc(start, goal, scene, settings, sampler):
        goals = goal if isinstance(goal, list) else [goal]
        assert start.dtype == goals[0].dtype == np.float32
        assert sampler.at == 0
        if any(shape.name == "everywhere" for shape in scene.shapes):
            return _Result([])
        return _Result([start, (start + goals[-1]) / 2, goals[-1]])

    @staticmethod
    def simplify(path, scene, settings, sampler):
        return _Result([path[0], path[-1]])


def configure_robot_and_planner_with_kwargs(robot, planner, **options):
    assert planner == "rrtc"
    settings = Settings()
    for name, value in options.items():
        assert hasattr(settings, name)
        setattr(settings, name, value)
    module = globals()[robot]
    return module, module.rrtc, settings, object()
