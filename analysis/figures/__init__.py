"""The paper's figures, one a module: SIZE, CAPTION (what the bands are) and `draw(figure, results)`."""
