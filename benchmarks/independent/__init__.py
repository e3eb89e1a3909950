"""A second simulator, which shares no code and few assumptions with the estimator's own."""
