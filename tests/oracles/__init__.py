"""The engine's kernels in plain numpy, by which they are tested."""
