"""Files that hold no usable mesh, by name: their content, and what is to be said of them."""

from __future__ import annotations

BAD = {
    "empty.ply": (b"", "is empty"),
    "junk.ply": (b"hello world" * 9, "cannot be read as a mesh"),
    "junk.glb": (b"hello world" * 9, "cannot be read as a mesh"),
    "junk.off": (b"hello world" * 9, "cannot be read as a mesh"),
    "junk.stl": (b"hello world" * 9, "holds no faces"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "a cloud of points has to be meshed first"),
    "nan.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN or infinite"),
    "infinite.off": (b"OFF\n3 1 0\ninf 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "NaN or infinite"),
    "nowhere.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot be read as a mesh"),
    "flat.obj": (b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "no extent"),
    "line.obj": (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "degenerate faces only"),
    "mesh.xyz": (b"0 0 0\n", "meshes are read from"),
}
