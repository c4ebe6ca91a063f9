"""Linear models with their derivatives by gains."""
