"""Operating points, linear models per contact mode, their loops, margins and poles."""
