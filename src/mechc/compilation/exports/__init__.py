"""Exports of a mechanism to other programs: C, WebAssembly, a functional mock-up unit."""
