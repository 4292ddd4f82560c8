"""The paper's networks in plain PyTorch: invariant regions, matching, routing. One network a file."""
