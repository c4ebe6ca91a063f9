"""Where a case hunts: maps over two parameters, and exact boundaries in them."""
