"""Distance as a function that other libraries differentiate: PyTorch and JAX."""
