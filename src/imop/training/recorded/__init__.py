"""Training pairs of recorded demonstrations, which nobody annotated."""
