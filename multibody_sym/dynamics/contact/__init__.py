"""Problems of laws and of impacts, posed by a mechanism at an instant."""
