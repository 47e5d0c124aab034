"""The methods, as tables that prove themselves."""
