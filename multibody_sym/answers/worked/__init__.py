"""The solution of an instant as a book writes it: bodies cut free, relations, elimination, result, conditions."""
