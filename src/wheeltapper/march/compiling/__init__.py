"""How kernels are compiled, kept on disk, and told of; of Numba nothing is changed for anybody else."""
