//! Bond-based peridynamics of elastomers.
