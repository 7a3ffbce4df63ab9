"""Parts of the result of `explain`, a file for each subject."""
