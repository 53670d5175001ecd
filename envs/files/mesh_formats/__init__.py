"""What mesh files hold, read as it is meant or refused; one module a format.

trimesh reads triangles. It cuts polygons into fans, which leave a polygon that is not convex, and
passes over what it does not know; where a file has such, it is read here.
"""
