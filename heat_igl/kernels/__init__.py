"""Compiled loops: Cython in pure Python mode, built with the package, plain arrays in and out, no interpreter lock.

A kernel checks nothing that it is given: the modules that call it pass contiguous arrays of the stated types and sizes.
"""
