"""The pages of the documentation that are made from the package itself: none of them is ever written by hand."""
