"""What a shop leaves running: batches, folders that are watched, the project file that saves options."""
