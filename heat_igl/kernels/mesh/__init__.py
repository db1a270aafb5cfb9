"""Triangles known by their edge lengths: checked, glued, numbered, flipped and refined; bounds of distances."""
