"""What all marches share: the decorators of kernels, numbers of the contract, plastic laws, blocks of work."""
