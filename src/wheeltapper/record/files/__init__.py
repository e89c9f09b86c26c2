"""What is stored of runs and maps, and its checks."""
