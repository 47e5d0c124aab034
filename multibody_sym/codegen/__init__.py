"""Code generation: Programs as C and as Python source, each able to test itself."""
