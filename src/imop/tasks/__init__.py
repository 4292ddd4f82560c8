"""Tasks: what stands on the table, when it is done, and how an expert does it."""
