"""The paper's tables with our own measurements beside, each from one command."""
