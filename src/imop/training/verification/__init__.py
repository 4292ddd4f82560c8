"""What the verification network is trained on, and its training."""
