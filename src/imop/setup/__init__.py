"""What a policy has to know of an arm, its cameras and its table, in one file; and its check."""
