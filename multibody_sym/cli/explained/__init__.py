"""The pages of errors: what each number means, its cause, its cure, and a small file that produces it."""
