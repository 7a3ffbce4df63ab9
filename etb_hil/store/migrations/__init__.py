"""How a store's tables get from each version to the next."""
