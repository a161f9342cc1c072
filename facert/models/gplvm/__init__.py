"""The shared Gaussian process latent variable model of Bouaziz and Pauly (2014)."""
