"""One script per reported table or ratio."""
