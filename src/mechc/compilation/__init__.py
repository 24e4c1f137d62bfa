"""Compiling on demand, and the cache: the only folder that knows the compiler."""
