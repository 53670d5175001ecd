"""Files from outside: names of files, and meshes in their formats."""
