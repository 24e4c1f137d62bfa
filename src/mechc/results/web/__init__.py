"""A mechanism that is simulated in a page: the module around its WebAssembly, and the page."""
