"""Training examples, the files that they lie in, and the tensors that they become."""
