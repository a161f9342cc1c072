"""What commands share: options, batches, the console, progress, pictures."""
