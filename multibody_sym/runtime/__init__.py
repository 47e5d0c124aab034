"""Runtime: Programs compiled, cached, loaded and called, and the integration loop over them."""
