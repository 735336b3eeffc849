"""Pages made of what the code says of itself: models, effects, optimizers, readers, commands, files of a workspace."""
