"""Studies of the problem itself: what plans reach, what returns vary with and hang on, how hard they are to learn."""
