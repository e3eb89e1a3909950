"""The estimator as a service: drives come in, planners ask, people watch; over HTTP."""
