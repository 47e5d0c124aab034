"""Makes the shared modules beside it (`mechanisms`) importable from every test."""
