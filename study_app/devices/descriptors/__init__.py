"""One module for each device: ``DEVICES`` holds its descriptors. Importing one loads neither compiler nor driver."""
