"""What several commands share: options, output, progress, views, serving."""
