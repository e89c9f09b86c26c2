"""The faces: command line, plots, the paper's figures and claims."""
