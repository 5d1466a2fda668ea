"""Problems and warnings of the open study, and their repairs."""
