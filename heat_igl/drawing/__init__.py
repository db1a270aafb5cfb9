"""What pictures and pages are made of: which part of a surface is seen, in which colours, and where it is saved."""
