"""The normalized field of the heat method on faces and its divergence."""
