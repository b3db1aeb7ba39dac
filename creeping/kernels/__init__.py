"""What all kernels share: blocks of rays, the compiler's options, vector code, threads; no physics."""
