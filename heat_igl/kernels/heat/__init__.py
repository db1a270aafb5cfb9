"""The normalized field of the heat method on faces, its divergence, and the derivatives of both."""
