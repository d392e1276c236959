"""The paper's figures, one a module: SIZE, MADE_BY (a command), CAPTION (what bands are), `draw(figure, results)`."""
