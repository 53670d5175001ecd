"""Meshes in the frame in which Assimp has them, and with them OMPL.app."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from envs.errors import InputError, reason
from envs.files.mesh_file import FileMesh, read_mesh
from envs.files.mesh_formats import dae
from envs.files.mesh_formats.soup import check_finite, vertices_of_flat_faces
from envs.problem import Array


def read_as_assimp(file: Path) -> tuple[FileMesh, Array]:
    """A mesh with its up axis applied, so that y is up, where its format says one; and the mean of
    its vertices, (3,), each counted once for each of its normals.

    Only Collada says an up axis. Its vertices are those of the file; in other formats faces are
    taken to be flat, whatever normals are written.

    Raises:
        InputError: the file cannot be used.
    """
    read = read_mesh(file)
    if file.suffix.lower() != ".dae":
        return read, vertices_of_flat_faces(read.vertices, read.faces).mean(axis=0)
    try:
        turn, drawn = dae.turn_to_y_up(file), dae.drawn_vertices(file)
        check_finite(drawn)
    except Exception as error:  # of normals and lines, which nobody has looked at yet
        raise InputError(f"{file} cannot be read as a mesh: {reason(error)}") from error
    notes = () if (turn == np.eye(3)).all() else ("turned so that y is up",)
    turned = replace(read, vertices=read.vertices @ turn.T, notes=notes)
    return turned, (drawn @ turn.T).mean(axis=0)
