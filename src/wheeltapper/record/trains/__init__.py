"""The trains of impacts and maxima from which features are read."""
