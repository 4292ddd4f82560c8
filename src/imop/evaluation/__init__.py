"""Rolling policies out, counting successes, and showing what happened."""
