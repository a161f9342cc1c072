"""The linear shared latent variable model: factors behind frames and poses, poses censored."""
