"""What a mechanism becomes for other programs: C, WebAssembly, a functional mock-up unit."""
