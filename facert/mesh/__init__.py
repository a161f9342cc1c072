"""Geometry of faces: rigid motion, normals, morph targets, captures of a moving mesh."""
