"""Lubrication: viscosity over temperature, oils, and the drag of oil beside the meshes."""
